//! Iteratively reweighted adjustment: alternately estimates the weights of the corners, the set of
//! inliers, and the unknowns, until they are consistent.
//!
//! Robust losses are M-estimators. Gross outliers, beyond a gap in the distribution of residuals,
//! are excluded. Smooth residuals, which an unsuitable lens model leaves, are not.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;

use crate::equations::factor::Factor;
use crate::equations::minimise::{Minimum, Until, minimise, minimise_with};
use crate::error::CalibrationError;
use crate::input::loss::Loss;
use crate::input::observation::{MIN_CORNERS, Observation};
use crate::input::panel::PanelRef;
use crate::input::weights::Weights;
use crate::problem::bundle::Problem;
use crate::problem::unknowns::Block;
use crate::problem::whitening::{OUTLIER_SIGMA, Whitening, deviations, residuals};

/// Minimum number of iterations in which weights and solution are estimated alternately; the third
/// changes no significant digit.
const WEIGHT_ROUNDS: usize = 3;

/// Maximum number of iterations until the set of inliers is stable; a corner at the limit may
/// change sides forever.
const MAX_ROUNDS: usize = 12;

/// Minimum size of a gross outlier, in standard deviations. Beyond [`OUTLIER_SIGMA`], a corner is
/// called an outlier.
const GROSS_SIGMA: f64 = 2.0 * OUTLIER_SIGMA;

/// Maximum number of corners in the gap before the gross outliers, relative to the number beyond
/// it; the gap extends from half the limit to the limit. A lens that the model does not fit well
/// has no gap, but a tail of residuals at its rim, with fewer corners at larger residuals.
/// Excluding the rim would make the fit there worse and worse.
const IN_THE_GAP: f64 = 0.25;

/// Lens model errors are smooth. Consider the neighbours of corners with large residuals. More than
/// the fraction `SMOOTH` of them have residuals towards the same side, larger than the fraction
/// `FALLS_OFF` of that residual and than `MIN_SMOOTH_SIGMA` standard deviations. Wrong positions
/// are not smooth. For labels or corners that are displaced together, only the displaced corners
/// have residuals like these.
const SMOOTH: f64 = 0.5;
const FALLS_OFF: f64 = 0.05;
const MIN_SMOOTH_SIGMA: f64 = 3.0;

/// A gross outlier of a measured target is used if its residual then falls below this fraction of
/// its value: it determines more of the estimate at its place than all other corners together, for
/// example the lens in a part of the image that only this corner reaches. A wrong position of a
/// corner in fewer than half of its views stays above it.
const SELF_DETERMINED: f64 = 0.5;

/// The parts of a problem that agree with each other.
#[derive(Clone, Debug)]
pub(crate) struct Kept {
    pub problem: Problem,
    /// Excluded blocks.
    pub left_out: Vec<bool>,
    /// Whether gross outliers stand out already at the start. They must then have no influence even
    /// in the first round: if two fifths of the corners are displaced together, they bias the
    /// estimate so much that they no longer stand out.
    pub some_stand_out: bool,
    /// The factor of similar equations.
    pub factor: Option<Factor>,
}

/// A consistent solution for the weights, the set of inliers, and the unknowns.
pub(crate) struct Settled {
    /// The minimum over the inliers.
    pub minimum: Minimum,
    /// The whitening of the inliers.
    pub whitening: Whitening,
    /// The same unknowns with all corners.
    pub problem: Problem,
    /// For each block, which of its corners are outliers.
    pub outliers: Vec<Vec<bool>>,
}

/// Minimises with weights that are consistent with the residuals at the minimum. Gross outliers and
/// excluded blocks are not used, so standard deviations describe only the corners that are used.
/// With [`Loss::Squared`], every corner is used.
///
/// # Errors
/// Returns an error if the normal equations cannot be formed or solved from the initial values.
pub(crate) fn settle(
    kept: Kept,
    weights: Weights,
    loss: Loss,
) -> Result<Settled, CalibrationError> {
    let Kept { problem, left_out, some_stand_out, mut factor } = kept;
    let start = || CalibrationError::NoStart;
    let all_of = |keep: bool| move |block: &Block| vec![keep; block.observations.len()];
    let none: Vec<Vec<bool>> = problem.blocks.iter().map(all_of(false)).collect();
    let counting = |problem: &Problem, gross: &[Vec<bool>]| counting(problem, gross, &left_out);
    let mut all = problem;
    let mut gross = none.clone();
    if some_stand_out && loss != Loss::Squared {
        let whitening = Whitening::fit(&all, weights, &residuals(&all));
        gross = with_gross_errors(&all, &left_out, &whitening);
    }
    let mut part = counting(&all, &gross);
    let mut whitening = Whitening::fit(&part, weights, &residuals(&part));
    // In the first iteration, all corners are used except those that stand out, so that the fit
    // includes the rim of the lens. With equal weights and squared loss, reweighting changes
    // nothing.
    let rounds = match whitening.common_px.is_some() || loss != Loss::Squared {
        true => MAX_ROUNDS,
        false => 0,
    };
    for round in 1..rounds {
        let minimum = minimise_with(factor, part, &whitening, loss, Until::Rough);
        Minimum { problem: part, factor, .. } = minimum.ok_or_else(start)?;
        all = all.at(&part);
        whitening = Whitening::fit(&part, weights, &residuals(&part));
        let now = match loss {
            Loss::Squared => none.clone(),
            Loss::Huber | Loss::Cauchy => with_gross_errors(&all, &left_out, &whitening),
        };
        let is_same = now == gross;
        if !is_same {
            gross = now;
            part = counting(&all, &gross);
            whitening = Whitening::fit(&part, weights, &residuals(&part));
        }
        if is_same && round + 1 >= WEIGHT_ROUNDS {
            break;
        }
    }
    let mut loss = loss;
    if let Some((with, contradicted)) = without_contradicted(&all, &gross, &left_out, &whitening) {
        (all, loss) = (with, Loss::Squared);
        part = counting(&all, &contradicted);
    }
    if loss == Loss::Squared {
        whitening = Whitening::fit(&part, weights, &residuals(&part));
    }
    let minimum = minimise_with(factor, part, &whitening, loss, Until::Fine).ok_or_else(start)?;
    let problem = all.at(&minimum.problem);
    let limit = whitening.outlier_limit();
    let of_block = |off: Vec<f64>| off.into_iter().map(|off| off > limit).collect();
    let outliers = deviations(&problem, &whitening).into_iter().map(of_block).collect();
    Ok(Settled { minimum, whitening, problem, outliers })
}

/// The problem without outliers and excluded blocks.
fn counting(problem: &Problem, outliers: &[Vec<bool>], left_out: &[bool]) -> Problem {
    let kept = outliers.iter().zip(left_out);
    let kept = kept.map(|(of_block, out)| of_block.iter().map(|far| !far && !out).collect());
    problem.with_corners(&kept.collect::<Vec<_>>())
}

/// If the corners of the target are measured: a solution that includes those gross outliers with which it agrees, and the
/// outliers that remain; `None` if all of them remain.
///
/// Offsets of corners absorb the smooth residuals of a wrong lens, except at its rim. Corners that determine the estimate alone
/// count in full: a robust loss would reduce their weight until the estimate fits the other corners only.
fn without_contradicted(
    all: &Problem,
    gross: &[Vec<bool>],
    left_out: &[bool],
    whitening: &Whitening,
) -> Option<(Problem, Vec<Vec<bool>>)> {
    all.map.as_ref()?;
    let without = deviations(all, whitening);
    let mut wrong = wrong_corners(all, gross);
    let mut tried =
        marked(all, |block, corner, label| gross[block][corner] && wrong.contains(&label));
    let mut found: Option<(Problem, Vec<Vec<bool>>)> = None;
    loop {
        let (all, gross) =
            found.as_ref().map_or((all, gross), |(all, gross)| (all, gross.as_slice()));
        if !gross.iter().flatten().any(|gross| *gross) {
            return found;
        }
        let used = counting(all, &tried, left_out);
        let weights = whitening.of(&used);
        let Some(with) = minimise(used, &weights, Loss::Squared, Until::Rough) else {
            return found;
        };
        let with = all.at(&with.problem);
        let (off, limit) = (deviations(&with, whitening), whitening.outlier_limit());
        // The wrong observations of a corner displace it from the others.
        let far = marked(all, |block, corner, _| off[block][corner] > limit);
        wrong.extend(wrong_corners(all, &far));
        let contradicted = marked(all, |block, corner, label| {
            let is_far = off[block][corner] > SELF_DETERMINED * without[block][corner];
            gross[block][corner] && (is_far || wrong.contains(&label))
        });
        if contradicted == gross {
            return found;
        }
        tried.clone_from(&contradicted);
        found = Some((with, contradicted));
    }
}

/// A corner of a target: its panel, row and column.
type Label = (PanelRef, i32, i32);

/// Marks the observations for which `is` returns true: of the block, the index in it, and the corner.
fn marked(problem: &Problem, is: impl Fn(usize, usize, Label) -> bool) -> Vec<Vec<bool>> {
    let of_block = |(block, of): (usize, &Block)| {
        let corners = of.observations.iter().enumerate();
        corners.map(|(corner, seen)| is(block, corner, (of.panel, seen.row, seen.col))).collect()
    };
    problem.blocks.iter().enumerate().map(of_block).collect()
}

/// The corners of which at least half of the observations are `far` off: their positions are wrong, or differ between views.
fn wrong_corners(problem: &Problem, far: &[Vec<bool>]) -> BTreeSet<Label> {
    let mut counts: BTreeMap<Label, [usize; 2]> = BTreeMap::new();
    for (block, far) in problem.blocks.iter().zip(far) {
        for (seen, &far) in block.observations.iter().zip(far) {
            let [outliers, views] = counts.entry((block.panel, seen.row, seen.col)).or_default();
            (*outliers, *views) = (*outliers + usize::from(far), *views + 1);
        }
    }
    let wrong = counts.into_iter().filter(|(_, [outliers, views])| 2 * outliers >= *views);
    wrong.map(|(label, _)| label).collect()
}

/// Marks the gross outliers of each block. Every frame keeps at least the corners with the smallest
/// residuals, as many as a pose needs.
pub(super) fn with_gross_errors(
    problem: &Problem,
    left_out: &[bool],
    whitening: &Whitening,
) -> Vec<Vec<bool>> {
    let off = deviations(problem, whitening);
    let mut of_frames = vec![Vec::new(); problem.frames.len()];
    let of_blocks = problem.blocks.iter().zip(&off).zip(left_out);
    for ((block, off), _) in of_blocks.filter(|(_, left_out)| !**left_out) {
        of_frames[block.frame].extend_from_slice(off);
    }
    let limit = gross_limit(&of_frames.concat(), whitening.sigma);
    let limits = of_frames.into_iter().map(|mut off| {
        off.sort_by(f64::total_cmp);
        let needed = off.get(MIN_CORNERS.min(off.len()).saturating_sub(1)).copied();
        needed.filter(|off| off.is_finite()).unwrap_or_default().max(limit)
    });
    let limits: Vec<f64> = limits.collect();
    let of_blocks = problem.blocks.iter().zip(&off);
    let mut gross: Vec<Vec<bool>> = of_blocks
        .map(|(block, off)| off.iter().map(|off| *off > limits[block.frame]).collect())
        .collect();
    let least = MIN_SMOOTH_SIGMA * whitening.sigma;
    let of_blocks = problem.blocks.iter().zip(&gross).zip(&off).zip(left_out);
    let smooth: Vec<Vec<[usize; 2]>> = of_blocks
        .map(|(((block, gross), off), out)| match *out || !gross.contains(&true) {
            true => Vec::new(),
            false => smooth_neighbours(problem, block, gross, |corner| off[corner] > least),
        })
        .collect();
    let all = smooth.iter().flatten();
    let [alike, count] = all.fold([0, 0], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
    if alike as f64 > SMOOTH * count as f64 {
        gross.iter_mut().for_each(|gross| gross.fill(false));
    }
    gross
}

/// For every gross outlier: the number of neighbours with a residual towards the same side and of
/// comparable size, and the number of all neighbours. Both are zero for all other corners.
fn smooth_neighbours(
    problem: &Problem,
    block: &Block,
    gross: &[bool],
    is_off: impl Fn(usize) -> bool,
) -> Vec<[usize; 2]> {
    let off: Vec<Option<DVec2>> = problem.residuals(block).collect();
    let places: BTreeMap<(i32, i32), usize> =
        block.observations.iter().enumerate().map(|(i, seen)| ((seen.row, seen.col), i)).collect();
    let of_corner = |(index, seen): (usize, &Observation)| {
        let (true, Some(own)) = (gross[index], off[index]) else { return [0, 0] };
        let steps = [(0, 1), (1, 0), (1, -1), (0, -1), (-1, 0), (-1, 1)];
        let neighbours = steps.iter().filter_map(|(rows, cols)| {
            let &neighbour = places.get(&(seen.row + rows, seen.col + cols))?;
            Some((neighbour, off[neighbour]?))
        });
        neighbours.fold([0, 0], |[alike, count], (neighbour, other)| {
            let along = own.dot(other) / own.length_squared();
            [alike + usize::from(along > FALLS_OFF && is_off(neighbour)), count + 1]
        })
    };
    block.observations.iter().enumerate().map(of_corner).collect()
}

/// The whitened residual above which outliers are gross: the first gap, or `f64::MAX` if there is
/// no gap.
fn gross_limit(off: &[f64], sigma: f64) -> f64 {
    let beyond = |limit: f64| off.iter().filter(|&&off| off > limit).count() as f64;
    let mut limit = GROSS_SIGMA * sigma;
    while beyond(limit) > 0.0 {
        if beyond(limit / 2.0) - beyond(limit) <= IN_THE_GAP * beyond(limit) {
            return limit;
        }
        limit *= 2.0;
        // Corners that a camera cannot image have an infinite residual.
        if limit.is_infinite() {
            break;
        }
    }
    f64::MAX
}

/// The variance factor by which the inverse of the normal equations is multiplied to give the
/// covariance; for a robust loss, from the asymptotic formula of an M-estimator (Huber & Ronchetti
/// 2009, 7.6),
///
/// ```text
///     σ² = Σψ² / (2N − p) · mean w / (mean ψ′)²
/// ```
///
/// with the influence ψ = w e of each coordinate. If every corner counts in full, this is the sum
/// of squares divided by the degrees of freedom.
pub(crate) fn variance(minimum: &Minimum, whitening: &Whitening, loss: Loss) -> f64 {
    let Minimum { problem, normal, layout, .. } = minimum;
    // Priors on corner offsets add as many observations as there are unknowns.
    let expected = problem.cameras.iter().filter_map(|camera| camera.roughness.as_ref());
    // The prior on second differences of knots adds as many as its rank.
    // Each parameter with a prior was observed once more.
    let measured = problem.cameras.iter().filter_map(|camera| camera.prior.as_ref());
    let unknowns = layout.shared + 6 * problem.frames.len()
        - expected.map(|roughness| roughness.rank()).sum::<usize>()
        - measured.map(|prior| prior.count()).sum::<usize>();
    let freedom = (2 * problem.count()).saturating_sub(unknowns).max(1) as f64;
    if loss == Loss::Squared {
        return normal.cost / freedom;
    }
    // Priors on poses and offsets contribute to the cost, too.
    let (mut cost, mut pull, mut weight, mut slope) = (0.0, 0.0, 0.0, 0.0);
    for (block, weights) in problem.blocks.iter().zip(&whitening.blocks) {
        for (off, &w) in problem.residuals(block).zip(weights) {
            let Some(off) = off else { continue };
            let squared = Whitening::apply(w, off).length_squared();
            let influence = loss.influence(squared, whitening.sigma);
            cost += loss.of(squared, whitening.sigma).0;
            pull += influence.squared;
            weight += influence.weight;
            slope += influence.slope;
        }
    }
    let count = problem.count().max(1) as f64;
    let beside = normal.cost - cost;
    (pull + beside) / freedom * (weight / count) / (slope / count).powi(2)
}
