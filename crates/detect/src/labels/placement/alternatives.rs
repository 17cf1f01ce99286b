//! What a placement is compared with: hidden and dirty tiles, boards that are partly plain, and sums over such alternatives.

/// Probability that a tag is hidden or spoiled, so that its tile has no information.
pub(super) const SPOILT: f64 = 1.0 / 16.0;

/// Probabilities that a tile without a tag is dirty or misread, so that its cells have no
/// information: a cause such as a picture without blur affects all tiles alike, and the picture
/// decides which of these applies.
pub(super) const DIRTY: [f64; 3] = [SPOILT, 1.0 / 2.0, 1.0 - SPOILT];

/// Fractions of the tiles of a board that may be plain, for the board that shows plain tiles and codes
/// as it likes: from tags in nearly all tiles to a single tag. The one that explains the picture best
/// counts.
pub(super) const PLAIN_PARTS: [f64; 5] = [1.0 / 16.0, 1.0 / 4.0, 1.0 / 2.0, 3.0 / 4.0, 15.0 / 16.0];

/// Log-likelihood ratio, nats, of a tile that shows what is predicted, for which it is `evidence`, or
/// with the probability `chance` random cells: ln( h + (1 − h) e^Λ ).
pub(super) fn or_spoilt(evidence: f64, chance: f64) -> f64 {
    (chance + (1.0 - chance) * evidence.exp()).ln()
}

/// Adds log-likelihoods, as independent tiles multiply likelihoods.
pub(super) fn add<const N: usize>(sums: &mut [f64; N], logs: [f64; N]) {
    sums.iter_mut().zip(logs).for_each(|(sum, log)| *sum += log);
}

/// The greatest of some log-likelihoods: that of the alternative that fits best.
pub(super) fn greatest<const N: usize>(logs: [f64; N]) -> f64 {
    logs.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// Logarithm of the mean of likelihoods, given their logarithms: that of alternatives of equal prior
/// probability.
pub(super) fn mean<const N: usize>(logs: [f64; N]) -> f64 {
    let most = greatest(logs);
    most + (logs.iter().map(|log| (log - most).exp()).sum::<f64>() / N as f64).ln()
}
