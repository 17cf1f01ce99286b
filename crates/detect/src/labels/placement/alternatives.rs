//! Alternatives to a placement: hidden and dirty tiles, boards that are partly plain, and sums over them.

/// Probability that a tag is hidden or damaged, so that its tile contains no information.
pub(super) const SPOILT: f64 = 1.0 / 16.0;

/// Probabilities that an untagged tile is dirty or misread, so that its cells contain no
/// information. A cause such as a lack of focus affects all tiles equally, so the image decides
/// which of these applies.
pub(super) const DIRTY: [f64; 3] = [SPOILT, 1.0 / 2.0, 1.0 - SPOILT];

/// Fractions of plain tiles on the board of arbitrary plain tiles and codes: from tags in nearly all tiles to a single
/// tag. The fraction that explains the image best counts.
pub(super) const PLAIN_PARTS: [f64; 5] = [1.0 / 16.0, 1.0 / 4.0, 1.0 / 2.0, 3.0 / 4.0, 15.0 / 16.0];

/// Returns the log-likelihood ratio, nats, of a tile that shows the predicted content (with ratio `evidence`) or, with
/// probability `chance`, random cells: ln( h + (1 − h) e^Λ ).
pub(super) fn or_spoilt(evidence: f64, chance: f64) -> f64 {
    (chance + (1.0 - chance) * evidence.exp()).ln()
}

/// Adds log-likelihoods, as independent tiles multiply likelihoods.
pub(super) fn add<const N: usize>(sums: &mut [f64; N], logs: [f64; N]) {
    sums.iter_mut().zip(logs).for_each(|(sum, log)| *sum += log);
}

/// Returns the greatest log-likelihood: that of the alternative that fits best.
pub(super) fn greatest<const N: usize>(logs: [f64; N]) -> f64 {
    logs.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// Returns the logarithm of the mean likelihood, given log-likelihoods of alternatives with equal prior probability.
pub(super) fn mean<const N: usize>(logs: [f64; N]) -> f64 {
    let most = greatest(logs);
    most + (logs.iter().map(|log| (log - most).exp()).sum::<f64>() / N as f64).ln()
}
