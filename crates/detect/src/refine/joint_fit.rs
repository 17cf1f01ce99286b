//! The joint fit of corners and their shared parameters by damped least squares. The corners' blocks of the normal
//! equations are eliminated.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::correlation::{self, Influence};
use super::model::corner::{Corner, MIN_BLUR_PX, OWN};
use super::model::fitter::CornerFitter;
use super::model::joint::{Common, Joint};
use super::model::window::Patch;
use super::optics::{HALO, INK, INK_UNIT, MIN_MOTION, Optics, PARAMS, SKEWNESS};
use super::significance::Estimate;
use super::small_systems::solved;
use deltille_core::damping::Damping;
use deltille_core::detection::{InkEstimate, TONE_PARAMS};
use deltille_core::raster::ImageView;
use deltille_core::statistics::median;

/// Minimum strength of a halo: blur with wide tails. Below it, the tails are equivalent to a wider blur.
const MIN_HALO: f64 = -0.45;

/// Prior standard deviations of the parameters. Gamma 2.6 has (1.6, 0, 0), and S-shaped curves have
/// −0.5 at both ends. Halos of 0.5 are strong. A blur twice as wide in one direction has an
/// astigmatism of 0.6. Edges along the diagonals that are blurred by half more
/// have a cross of 0.4. A plane of red filters, reduced by half, has a skewness of 0.6. Ink that spreads by 2 % of an edge covers a fifth of the bits of a tag.
const PRIOR: [f64; PARAMS] = [2.0, 1.0, 1.0, 0.3, 0.3, 0.3, 0.3, 0.3, 0.5, 2.0];

/// Maximum step of the parameters.
const MAX_STEP: f64 = 2.0;

/// Maximum number of iterations; four are usual.
const MAX_ITERATIONS: usize = 10;

/// Minimum damping after a step that raised the cost. Earlier steps are undamped, because the equations of a few common
/// parameters are nearly linear.
const FIRST_DAMPING: f64 = 0.01;

/// Remaining distance at which the iteration has converged, in standard deviations of the
/// parameters. It is the sum of a series of further steps that shrink like the last one. A first
/// step may be twice as long, because each step is less than half as long as the previous one.
const CONVERGED: f64 = 0.25;

/// The same where the fit only decides which groups are significant.
const ROUGHLY_CONVERGED: f64 = 0.5;

/// Maximum residual of a corner, relative to the median. Corners above it have no weight, because they show something
/// else.
const MAX_RESIDUAL_RATIO: f64 = 3.0;

/// Minimum number of corners in excess of the parameters whose scatter counts: it is known to within a factor of 1.6.
const LEAST_FREE: usize = 5;

/// A corner in the joint fit, in image coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    /// The pixels that show only this corner.
    pub patch: Patch,
    /// Its separate estimate.
    pub corner: Corner<3>,
    /// Its residual, relative to half the contrast.
    pub residual: f64,
}

impl Optics {
    /// Returns the parameter at this index, in the form used by the equations of the corners.
    pub(super) fn common(&self, parameter: usize) -> Common {
        match parameter {
            0..TONE_PARAMS => Common::Tone { parameter, moved: Box::new(self.moved(parameter)) },
            HALO => Common::Halo,
            INK => Common::Ink,
            SKEWNESS.. => Common::Skewness(parameter - SKEWNESS),
            _ => Common::Shape(parameter - TONE_PARAMS),
        }
    }
}

/// A corner of K edges in the joint fit.
#[derive(Clone)]
pub(super) struct Member<const K: usize> {
    patch: Patch,
    corner: Corner<K>,
}

impl<const K: usize> From<Sample> for Member<K> {
    fn from(sample: Sample) -> Self {
        Self { patch: sample.patch, corner: sample.corner.with_edges() }
    }
}

impl<const K: usize> Member<K> {
    /// Returns the corner with its contrast multiplied by a factor, at the same black.
    pub(super) fn brighter(&self, factor: f64) -> Self {
        let mut member = self.clone();
        member.corner.level += (factor - 1.0) * member.corner.amplitude.abs();
        member.corner.amplitude *= factor;
        member
    }

    /// Returns the corner with the blur whose edges are seen at this distance, in standard deviations of the blur, from
    /// their positions, where dark areas seem to have grown by `ink`, in edges.
    pub(super) fn blurred(&self, ink: f64, distance: f64) -> Self {
        let mut member = self.clone();
        let across_px = member.corner.across_px.iter().sum::<f64>() / K as f64;
        member.corner.blur_px = (ink.abs() * across_px / distance).max(MIN_BLUR_PX);
        member
    }
}

/// Corners to be fitted together.
pub(super) struct Problem<'a, const K: usize> {
    pub(super) fitter: &'a mut CornerFitter,
    pub(super) image: ImageView<'a>,
    pub(super) members: Vec<Member<K>>,
    /// Median black and white of the corners.
    pub(super) greys: [f64; 2],
    /// Parameters that may be estimated, and those that are.
    pub(super) all: Vec<usize>,
    pub(super) active: Vec<usize>,
}

/// The equations of all parameters at these optics and corners.
pub(super) struct Linearised<const K: usize> {
    pub(super) optics: Optics,
    pub(super) corners: Vec<Corner<K>>,
    pub(super) equations: Vec<Option<Joint>>,
}

/// Optics that fit the corners best, the covariance of the active parameters, and the equations
/// before the last step.
pub(super) struct Adjusted<const K: usize> {
    pub(super) optics: Optics,
    pub(super) cov: DMatrix<f64>,
    /// Remaining distance after the last step, in standard deviations, extrapolated from the steps before it.
    pub(super) lack: f64,
    pub(super) at: Linearised<K>,
    pub(super) reduced: Reduced,
}

/// The equations of the common parameters, after elimination of the corners.
pub(super) struct Reduced {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Scatter of the corners' gradients.
    scatter: DMatrix<f64>,
    /// A⁻¹a and A⁻¹B of each corner; columns of B beyond the parameters are zero.
    own: Vec<Option<(SVector<f64, OWN>, SMatrix<f64, OWN, PARAMS>)>>,
}

impl Reduced {
    /// Returns the covariance of corner positions, xx, xy, yy, px², caused by this covariance of the common parameters:
    /// the mean over corners with nonzero weight.
    fn shift(&self, cov: &DMatrix<f64>, weights: &[f64]) -> [f64; 3] {
        let counting = self.own.iter().zip(weights).filter(|(_, weight)| **weight > 0.0);
        let mut sum = DMatrix::zeros(2, 2);
        let mut count = 0;
        for (_, slope) in counting.filter_map(|(own, _)| own.as_ref()) {
            let position = slope.view((0, 0), (2, cov.nrows()));
            sum += position * cov * position.transpose();
            count += 1;
        }
        [(0, 0), (0, 1), (1, 1)].map(|at| sum[at] / f64::from(count.max(1)))
    }
}

impl<const K: usize> Problem<'_, K> {
    /// Returns the estimate after a first step with the covariance of the noise alone, and the covariance with the
    /// scatter of gradients.
    pub(super) fn first_step(
        &self,
        optics: &Optics,
        reduced: &Reduced,
    ) -> (Estimate, DMatrix<f64>) {
        let count = self.active.len();
        let unknown = DMatrix::identity(count, count);
        let mut vector = optics.vector();
        let Some(factor) = reduced.matrix.clone().cholesky() else {
            return (self.estimate(optics, vector, &unknown), unknown);
        };
        let step = factor.solve(&reduced.gradient);
        self.active.iter().zip(step.iter()).for_each(|(&p, s)| vector[p] += s);
        let estimate = self.estimate(optics, vector, &factor.inverse());
        (estimate, covariance(reduced).unwrap_or(unknown))
    }

    /// Returns the estimate with these values of the parameters, near these optics, given the covariance of the active
    /// ones.
    pub(super) fn estimate(
        &self,
        optics: &Optics,
        vector: [f64; PARAMS],
        cov: &DMatrix<f64>,
    ) -> Estimate {
        let active = self.active.clone();
        let inverse = cov.clone().cholesky().map(|factor| factor.inverse());
        let information = inverse.unwrap_or_else(|| DMatrix::zeros(active.len(), active.len()));
        let kappa_slopes = [0, 1, 2].map(|p| optics.kappa_slope(self.greys, p));
        let pixels = self.members.iter().map(|member| member.patch.window.count()).sum();
        let blurs = self.members.iter().map(|member| member.corner.blur_px).collect();
        let blur_px = median(blurs).unwrap_or(0.0);
        Estimate { vector, active, information, kappa_slopes, pixels, blur_px }
    }

    /// Returns the estimated ink spread; `None` if it was not estimated.
    pub(super) fn ink(
        &self,
        optics: &Optics,
        cov: &DMatrix<f64>,
        used: bool,
    ) -> Option<InkEstimate> {
        let at = self.active.iter().position(|&p| p == INK)?;
        let deviation = INK_UNIT * cov[(at, at)].max(0.0).sqrt();
        Some(InkEstimate::new(INK_UNIT * optics.ink, deviation, used))
    }

    /// Returns the optics that fit the corners best, up to a fraction of their standard deviations.
    fn adjusted(&mut self, mut at: Linearised<K>, converged: f64) -> Adjusted<K> {
        let mut optics = at.optics.clone();
        let mut damping = Damping::NONE.at_least(0.0, FIRST_DAMPING);
        let (mut before, mut lack) = (None, f64::INFINITY);
        // Weights by the current residual noise. With an unknown tone curve, it is many times the final noise.
        let mut weights = weights_of(&at.equations);
        let mut reduced = self.reduced(&at, &weights);
        for _ in 0..MAX_ITERATIONS {
            let Some(step) = self.step(&reduced, &at.optics, damping) else {
                break;
            };
            let mut vector = at.optics.vector();
            self.active.iter().zip(step.iter()).for_each(|(&p, s)| vector[p] += s);
            let there = self.stepped(&at, &reduced, &vector);
            let length = step.dot(&(&reduced.matrix * &step)).max(0.0).sqrt();
            lack = match before {
                Some(before) if length < before => length * length / (before - length),
                _ => length / 2.0,
            };
            if lack < converged || length < 2.0 * converged {
                optics = there;
                break;
            }
            let next = self.linearised(there);
            if cost(&next, &weights) <= cost(&at, &weights) {
                (at, before) = (next, Some(length));
                optics.clone_from(&at.optics);
                weights = weights_of(&at.equations);
                reduced = self.reduced(&at, &weights);
                damping.ease();
            } else {
                self.put_back(&at.corners);
                if length < 2.0 * ROUGHLY_CONVERGED {
                    // The gain would be within the rounding of single-precision sums.
                    break;
                }
                before = None;
                damping.stiffen();
            }
        }
        let count = self.active.len();
        let cov = covariance(&reduced).unwrap_or_else(|| DMatrix::identity(count, count));
        let optics = Optics { shift: reduced.shift(&cov, &weights), ..optics };
        Adjusted { optics, cov, lack, at, reduced }
    }

    /// Returns the optics that fit the corners best, without the groups that are then not significant.
    pub(super) fn settled(&mut self, start: Linearised<K>) -> Adjusted<K> {
        let mut found = self.adjusted(start, ROUGHLY_CONVERGED);
        let vector = found.optics.vector();
        let supported = self.estimate(&found.optics, vector, &found.cov).supported(1.0);
        let is_less = supported.active.len() < self.active.len();
        if is_less {
            // Starts at the best fit of the other groups with the covariance of the noise alone.
            // The scatter determines significance, but not this optimum.
            let (step, _) = self.first_step(&found.at.optics, &found.reduced);
            let rest = step.only(&supported.active);
            found.optics = self.stepped(&found.at, &found.reduced, &rest.vector);
            self.active = rest.active;
        }
        if is_less || found.lack >= CONVERGED {
            let at = self.linearised(found.optics);
            found = self.adjusted(at, CONVERGED);
        }
        if found.optics.stretch() > MIN_MOTION && !found.optics.is_motion {
            found = self.moved(&found.optics).unwrap_or(found);
        }
        found
    }

    /// Returns the optics of an image that moved along a line, if they fit the corners better than a Gaussian does.
    fn moved(&mut self, still: &Optics) -> Option<Adjusted<K>> {
        let before = self.linearised(still.clone());
        let weights = weights_of(&before.equations);
        let moved = self.linearised(Optics { is_motion: true, ..still.clone() });
        let found = self.adjusted(moved, CONVERGED);
        if cost(&self.linearised(found.optics.clone()), &weights) < cost(&before, &weights) {
            return Some(found);
        }
        self.put_back(&before.corners);
        None
    }

    /// Returns the optics with these values of the active parameters. Moves the corners
    /// accordingly, by their equations.
    pub(super) fn stepped(
        &mut self,
        at: &Linearised<K>,
        reduced: &Reduced,
        vector: &[f64; PARAMS],
    ) -> Optics {
        let there = at.optics.with(vector);
        let (from, to) = (at.optics.vector(), there.vector());
        let mut step = SVector::<f64, PARAMS>::zeros();
        self.active.iter().enumerate().for_each(|(i, &p)| step[i] = to[p] - from[p]);
        let corners = at.corners.iter().zip(&reduced.own);
        for (member, (corner, own)) in self.members.iter_mut().zip(corners) {
            let moved = own
                .as_ref()
                .and_then(|(constant, slope)| corner.stepped(&(constant - slope * step)));
            member.corner = moved.unwrap_or(*corner);
        }
        there
    }

    /// Returns the covariance of corner positions due to the uncertainty of the active parameters, px².
    pub(super) fn shift(&self, at: &Linearised<K>) -> [f64; 3] {
        let weights = weights_of(&at.equations);
        let reduced = self.reduced(at, &weights);
        covariance(&reduced).map_or(at.optics.shift, |cov| reduced.shift(&cov, &weights))
    }

    /// Returns the corners of the members.
    fn corners(&self) -> Vec<Corner<K>> {
        self.members.iter().map(|member| member.corner).collect()
    }

    /// Resets the members to these corners.
    fn put_back(&mut self, corners: &[Corner<K>]) {
        self.members.iter_mut().zip(corners).for_each(|(member, corner)| member.corner = *corner);
    }

    /// Returns the next step of the active parameters: none longer than [`MAX_STEP`], and the halo not below its
    /// minimum.
    fn step(&self, reduced: &Reduced, optics: &Optics, damping: Damping) -> Option<DVector<f64>> {
        let mut damped = reduced.matrix.clone();
        for i in 0..damped.nrows() {
            damped[(i, i)] = damping.grown(damped[(i, i)]);
        }
        let mut step = damped.clone().cholesky()?.solve(&reduced.gradient);
        if let Some(at) = self.active.iter().position(|&p| p == HALO) {
            let most = MIN_HALO - optics.halo[0];
            if step[at] < most {
                // The others follow.
                let mut gradient = &reduced.gradient - most * damped.column(at);
                damped.column_mut(at).fill(0.0);
                damped.row_mut(at).fill(0.0);
                (damped[(at, at)], gradient[at]) = (1.0, most);
                step = damped.cholesky()?.solve(&gradient);
            }
        }
        let length = step.amax();
        Some(if length > MAX_STEP { step * (MAX_STEP / length) } else { step })
    }

    /// Returns the influence of pixels on the corners, the lowest noise first, because other objects next to a corner
    /// affect its residuals; none if there are too few corners to determine correlations.
    pub(super) fn influences(&mut self, optics: &Optics) -> Vec<Influence> {
        let Self { fitter, image, members, .. } = self;
        if members.len() < correlation::CORNERS / 2 {
            return Vec::new();
        }
        let mut found: Vec<Influence> = members
            .iter()
            .filter_map(|member| fitter.influence(*image, &member.patch, &member.corner, optics))
            .collect();
        found.sort_by(|a, b| a.noise.total_cmp(&b.noise));
        found
    }

    /// Returns the equations of all parameters at the members' corners.
    pub(super) fn linearised(&mut self, optics: Optics) -> Linearised<K> {
        let corners = self.corners();
        let Self { fitter, image, members, all, .. } = self;
        let common: Vec<Common> = all.iter().map(|&p| optics.common(p)).collect();
        let equations = members
            .iter()
            .map(|member| fitter.joint(*image, &member.patch, &member.corner, &optics, &common))
            .collect();
        Linearised { optics, corners, equations }
    }

    /// Returns the equations of the active parameters.
    pub(super) fn reduced(&self, at: &Linearised<K>, weights: &[f64]) -> Reduced {
        let places = self.active.iter().filter_map(|p| self.all.iter().position(|a| a == p));
        let places: Vec<usize> = places.map(|place| OWN + place).collect();
        let count = places.len();
        let mut matrix = SMatrix::<f64, PARAMS, PARAMS>::zeros();
        let mut scatter = SMatrix::<f64, PARAMS, PARAMS>::zeros();
        let mut gradient = SVector::<f64, PARAMS>::zeros();
        let mut own = Vec::with_capacity(at.equations.len());
        for (joint, weight) in at.equations.iter().zip(weights) {
            own.push(joint.as_ref().and_then(|joint| {
                /// Unknowns of a corner with the optics.
                const ALL: usize = OWN + PARAMS;
                let mut shared = SMatrix::<f64, OWN, PARAMS>::zeros();
                let mut block = SMatrix::<f64, PARAMS, PARAMS>::zeros();
                let mut pull = SVector::<f64, PARAMS>::zeros();
                for (j, &from) in places.iter().enumerate() {
                    (0..OWN).for_each(|i| shared[(i, j)] = joint.matrix[(i, from)]);
                    (0..count).for_each(|i| block[(i, j)] = joint.matrix[(places[i], from)]);
                    pull[j] = joint.gradient[from];
                }
                let rows = std::array::from_fn::<[f64; ALL + 1], OWN, _>(|i| {
                    std::array::from_fn(|j| match j {
                        0..OWN => joint.matrix[(i, j)],
                        OWN..ALL => shared[(i, j - OWN)],
                        _ => joint.gradient[i],
                    })
                });
                let solution = solved(rows)?;
                let constant = SVector::from_fn(|i, _| solution[i][ALL]);
                let slope = SMatrix::from_fn(|i, j| solution[i][OWN + j]);
                pull -= shared.tr_mul(&constant);
                matrix += *weight * (block - shared.tr_mul(&slope));
                scatter += *weight * weight * pull * pull.transpose();
                gradient += *weight * pull;
                Some((constant, slope))
            }));
        }
        let cut =
            |all: &SMatrix<f64, PARAMS, PARAMS>| DMatrix::from_fn(count, count, |i, j| all[(i, j)]);
        let mut reduced = Reduced {
            matrix: cut(&matrix),
            gradient: DVector::from_fn(count, |i, _| gradient[i]),
            scatter: cut(&scatter),
            own,
        };
        let vector = at.optics.vector();
        for (i, &p) in self.active.iter().enumerate() {
            let weight = 1.0 / (PRIOR[p] * PRIOR[p]);
            reduced.matrix[(i, i)] += weight;
            reduced.gradient[i] -= weight * vector[p];
        }
        reduced
    }
}

/// Returns the median noise of corners.
pub(super) fn noise_of(equations: &[Option<Joint>]) -> f64 {
    median(equations.iter().flatten().map(|joint| joint.noise).collect()).unwrap_or(1.0)
}

/// Returns the weights of corners: the inverse of their noise, limited to that of the median corner.
pub(super) fn weights_of(equations: &[Option<Joint>]) -> Vec<f64> {
    let middle = noise_of(equations);
    let weight = |joint: &Option<Joint>| match joint {
        Some(joint) if joint.noise <= MAX_RESIDUAL_RATIO * middle => {
            1.0 / joint.noise.max(middle).powi(2)
        }
        _ => 0.0,
    };
    equations.iter().map(weight).collect()
}

fn cost<const K: usize>(at: &Linearised<K>, weights: &[f64]) -> f64 {
    let prior = at.optics.vector().iter().zip(PRIOR).map(|(p, d)| (p / d).powi(2)).sum::<f64>();
    let costs = at.equations.iter().zip(weights);
    let of = |(joint, weight): (&Option<Joint>, &f64)| match joint {
        Some(joint) => weight * joint.cost,
        None if *weight > 0.0 => f64::INFINITY,
        None => 0.0,
    };
    prior + costs.map(of).sum::<f64>()
}

/// Returns the larger of the covariances from the noise and from the scatter of the gradients.
fn covariance(reduced: &Reduced) -> Option<DMatrix<f64>> {
    let inverse = reduced.matrix.clone().cholesky()?.inverse();
    let members = reduced.own.iter().flatten().count();
    let count = reduced.gradient.len();
    if members < count + LEAST_FREE {
        // With so few corners, the scatter is as uncertain as the noise that it corrects.
        return Some(inverse);
    }
    let correction = members as f64 / (members - count) as f64;
    let sandwich = &inverse * &reduced.scatter * &inverse * correction;
    // Along each parameter the larger one; correlations are those of the noise.
    let scale: Vec<f64> =
        (0..count).map(|i| (sandwich[(i, i)] / inverse[(i, i)]).max(1.0).sqrt()).collect();
    Some(DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
