//! Joint estimation of the parameters that all corners of a picture share: tone curve, halo and
//! astigmatism of the point spread function, and the ink spread of the print.
//!
//! Corners from all over the picture are fitted together by damped least squares, each with its own
//! position, edges, blur and light, and with the common parameters: the normal equations have a
//! block for each corner, which is eliminated (Schur complement). Afterwards the common parameters
//! are fixed, so that they add no unknowns to single corners. Groups of parameters that are not
//! significant are omitted; significance is judged by the scatter of the gradients of the corners,
//! so that correlated pixels, or a model that holds only approximately, are not taken for evidence.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::correlation::{self, Influence};
use super::model::corner::{Corner, OWN};
use super::model::fitter::CornerFitter;
use super::model::joint::{Common, Joint};
use super::model::window::Patch;
use super::optics::{HALO, INK, INK_UNIT, LEAST_MOTION, Optics, PARAMS, STEP};
use super::small_systems::solved;
use deltille_core::damping::Damping;
use deltille_core::detection::InkEstimate;
use deltille_core::detection::{TONE_PARAMS, ToneEstimate};
use deltille_core::raster::ImageView;
use deltille_core::statistics::median;

/// Number of corners that are fitted together; more would determine the curve better than single
/// corners can use it.
pub const SAMPLES: usize = 16;

/// Radius of the windows of these corners, px: the common parameters show at the edges, and near the corner.
pub const REACH_PX: f64 = 7.0;

/// Where the picture is blurred the radius is so many standard deviations of the blur instead.
pub const REACH_SIGMAS: f64 = 5.0;

/// The least strength of a halo: blur with wide tails. Beyond it the tails are no more than a wider
/// blur.
const LEAST_HALO: f64 = -0.45;

/// Prior standard deviations of the parameters: gamma 2.6 has (1.6, 0, 0), smooth steps have −0.5
/// at both ends, halos of 0.5 are strong, a blur twice as wide in one direction has an astigmatism
/// of 0.6, and ink that spreads by 2 % of an edge covers a fifth of the bits of a tag.
const PRIOR: [f64; PARAMS] = [2.0, 1.0, 1.0, 0.3, 0.3, 0.5, 2.0];

/// Groups of parameters that are used together.
const GROUPS: [&[usize]; 4] = [&[0, 1, 2], &[3, 4], &[HALO], &[INK]];

/// A group is used when its probability by chance is below 1 : 1000: χ² of three, two and one
/// degrees of freedom. Astigmatism is used from 1 : 10 on, because every picture is blurred a
/// little more in one direction, and from a grazing angle that resembles a tone curve.
const CHI2: [f64; 4] = [16.3, 4.6, 10.8, 10.8];

/// The threshold of one degree of freedom, 1 : 1000.
const CHI2_OF_ONE: f64 = 10.8;

/// A curve that displaces no corner is used where it explains this fraction of the noise.
const NOTICED: f64 = 0.05;

/// A group is estimated where the first step, from a straight curve, promises this fraction of its
/// threshold.
const WORTH_A_LOOK: f64 = 0.5;

/// Largest step of the parameters.
const MAX_STEP: f64 = 2.0;

/// Most iterations; four are usual.
const MAX_ITERATIONS: usize = 10;

/// The least damping after a step that raised the cost. Steps before are whole: the equations of a few common parameters
/// are nearly linear.
const FIRST_DAMPING: f64 = 0.01;

/// The iteration ends where it lacks less than this fraction of the standard deviations of the parameters,
/// as a series of steps that go on to shrink as the last one did would. A first step may be twice as long, as no step is
/// half as long as the one before.
const CONVERGED: f64 = 0.25;

/// It ends earlier where it only decides which groups are significant.
const ROUGHLY_CONVERGED: f64 = 0.5;

/// Corners whose residuals exceed this many times the median have no weight: they show something
/// else.
const MAX_RESIDUAL_RATIO: f64 = 3.0;

/// A corner that takes part in the joint fit, in picture coordinates.
#[derive(Clone, Debug)]
pub struct Sample {
    /// The pixels that show only this corner.
    pub patch: Patch,
    /// Its estimate by itself.
    pub corner: Corner<3>,
    /// Its residual, over half the contrast.
    pub residual: f64,
}

impl Optics {
    /// A parameter, for the corners' equations.
    fn common(&self, parameter: usize) -> Common {
        match parameter {
            0..TONE_PARAMS => Common::Tone { parameter, moved: Box::new(self.moved(parameter)) },
            HALO => Common::Halo,
            INK => Common::Ink,
            _ => Common::Astigmatism(parameter - TONE_PARAMS),
        }
    }

    /// Estimates the optics from the corners of a picture; a tone curve that is known is kept.
    pub fn estimate<const K: usize>(
        fitter: &mut CornerFitter,
        image: ImageView,
        samples: Vec<Sample>,
        known: &Self,
    ) -> Self {
        if samples.is_empty() {
            return known.clone();
        }
        let greys = |sign: f64| {
            let grey = move |s: &Sample| s.corner.level + sign * s.corner.amplitude.abs();
            samples.iter().map(grey).collect::<Vec<f64>>()
        };
        let (blacks, whites) = (greys(-1.0), greys(1.0));
        let ends = |v: &[f64], of: fn(f64, f64) -> f64, first| v.iter().copied().fold(first, of);
        let range = [ends(&blacks, f64::min, 1.0), ends(&whites, f64::max, 0.0)];
        let residuals = samples.iter().map(|sample| sample.residual).collect();
        let plain_residual = median(residuals).unwrap_or(0.0);
        let known = Self { range, plain_residual, ..known.clone() };
        // Ink spread does not displace corners of two edges.
        let has_ink = known.is_ink_open && K == 3;
        let is_active = |p: usize| match p {
            0..TONE_PARAMS => known.is_open,
            INK => has_ink,
            _ => true,
        };
        let members = samples.into_iter().map(Member::from).collect();
        let greys = [blacks, whites].map(|greys| median(greys).unwrap_or(0.0));
        let all: Vec<usize> = (0..PARAMS).filter(|&p| is_active(p)).collect();
        let active = all.clone();
        let mut problem = Problem::<K> { fitter, image, members, greys, all, active };
        let reported = |problem: &Problem<K>, optics: &Self, cov: &DMatrix<f64>, used| Reported {
            tone: optics.tone_between(greys, cov, &problem.active, used),
            ink: problem.ink(optics, cov, used),
        };
        let mut optics = known.clone();
        let mut at = problem.linearised(known);
        let (mut used, mut found) = (Vec::new(), Reported::default());
        // A first step tells what is worth looking for. What the model lacks there scatters the gradients: that is
        // no reason to look away, but the deviation that is reported. From a straight curve it tells little of what
        // is weak beside the curve, and from a Gaussian little of what a motion leaves: all is asked once more.
        for is_first in [true, false] {
            problem.active.clone_from(&problem.all);
            let reduced = problem.reduced(&at, &weights_of(&at.equations));
            let (step, scattered) = problem.first_step(&at.optics, &reduced);
            let unused = reported(&problem, &at.optics.with(&step.vector), &scattered, false);
            let worth = match is_first {
                true => step.supported(WORTH_A_LOOK),
                false => problem.estimate(&at.optics, step.vector, &scattered).supported(1.0),
            };
            if worth.active == used {
                found = found.or(unused);
                break;
            }
            if !is_first {
                let start = problem.stepped(&at, &reduced, &worth.vector);
                at = problem.linearised(start);
            }
            problem.active = worth.active;
            let settled = problem.settled(at);
            used.clone_from(&problem.active);
            found = reported(&problem, &settled.optics, &settled.cov, true).or(unused);
            (optics, at) = (settled.optics, settled.at);
        }
        let inflation = problem.inflation(&optics);
        Self { tone: found.tone, ink_found: found.ink, inflation, ..optics }
    }

    /// The tone curve between black and white, given the covariance of the active parameters;
    /// `None` where it was not estimated.
    fn tone_between(
        &self,
        greys: [f64; 2],
        cov: &DMatrix<f64>,
        active: &[usize],
        used: bool,
    ) -> Option<ToneEstimate> {
        active.contains(&0).then(|| {
            let [kappa, kappa_odd] = self.kappas(greys);
            let slopes = active.iter().map(|&p| self.kappa_slope(greys, p));
            let slopes = DVector::from_iterator(active.len(), slopes);
            let kappa_deviation = slopes.dot(&(cov * &slopes)).max(0.0).sqrt();
            let mut tone = ToneEstimate::new(greys, kappa, kappa_deviation);
            (tone.kappa_odd, tone.used) = (kappa_odd, used);
            tone
        })
    }

    /// κ₀ and κ₁ between black and white.
    fn kappas(&self, [black, white]: [f64; 2]) -> [f64; 2] {
        let piece = self.piece((white + black) / 2.0, (white - black) / 2.0);
        [0, 1].map(|i| f64::from(piece.terms[i]))
    }

    /// The derivative of κ₀ by a parameter.
    fn kappa_slope(&self, greys: [f64; 2], parameter: usize) -> f64 {
        match parameter {
            0..TONE_PARAMS => {
                (self.moved(parameter).kappas(greys)[0] - self.kappas(greys)[0]) / STEP
            }
            _ => 0.0,
        }
    }
}

/// What is reported to the user about the optics.
#[derive(Default)]
struct Reported {
    tone: Option<ToneEstimate>,
    ink: Option<InkEstimate>,
}

impl Reported {
    /// What is used, and what `unused` says of the rest.
    fn or(self, unused: Self) -> Self {
        Self {
            tone: self.tone.filter(|tone| tone.used).or(unused.tone),
            ink: self.ink.filter(|ink| ink.used).or(unused.ink),
        }
    }
}

/// Values of all parameters, with the information on the active ones.
struct Estimate {
    vector: [f64; PARAMS],
    active: Vec<usize>,
    /// The inverse of their covariance.
    information: DMatrix<f64>,
    /// Derivatives of κ₀ by the parameters of the curve.
    kappa_slopes: [f64; TONE_PARAMS],
    /// Number of corners from which they come.
    pixels: usize,
}

impl Estimate {
    fn values(&self) -> DVector<f64> {
        DVector::from_iterator(self.active.len(), self.active.iter().map(|&p| self.vector[p]))
    }

    /// The estimate without the groups whose evidence is below this fraction of the threshold,
    /// removed one by one from the weakest on, since one group may explain another.
    fn supported(mut self, part: f64) -> Self {
        loop {
            let present =
                GROUPS.iter().zip(CHI2).filter(|(group, _)| self.active.contains(&group[0]));
            let present = present.map(|(group, limit)| (self.evidence(group) / limit, group));
            match present.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((ratio, group)) if ratio <= part => self = self.without(group),
                _ => return self,
            }
        }
    }

    /// Evidence against a group being zero, in squared standard deviations.
    ///
    /// The part of a curve besides κ₀ displaces no corner, and occurs in every picture whose blur
    /// differs a little from the model. It counts where it is more than a twentieth of the noise.
    fn evidence(&self, group: &[usize]) -> f64 {
        let places = |inside: bool| -> Vec<usize> {
            let all = 0..self.active.len();
            all.filter(|&i| group.contains(&self.active[i]) == inside).collect()
        };
        let (own, others) = (places(true), places(false));
        let between = |a: &[usize], b: &[usize]| self.information.select_rows(a).select_columns(b);
        let value = self.values().select_rows(&own);
        let shared = match between(&others, &others).cholesky() {
            _ if others.is_empty() => DMatrix::zeros(own.len(), own.len()),
            Some(factor) => between(&own, &others) * factor.solve(&between(&others, &own)),
            None => return 0.0,
        };
        let information = between(&own, &own) - shared;
        let chi2 = value.dot(&(&information * &value));
        if group[0] != 0 {
            return chi2;
        }
        let slopes = DVector::from_column_slice(&self.kappa_slopes);
        let Some(factor) = information.cholesky() else { return 0.0 };
        let of_kappa = slopes.dot(&value).powi(2) / slopes.dot(&factor.solve(&slopes));
        let of_noise = chi2 / (NOTICED * self.pixels as f64);
        CHI2[0] * (of_kappa / CHI2_OF_ONE).max(of_noise)
    }

    /// The most likely values of these parameters if those of all other groups are zero.
    fn only(self, active: &[usize]) -> Self {
        let others = GROUPS.iter().filter(|group| !active.contains(&group[0]));
        let present = |all: &Self, group: &[usize]| all.active.contains(&group[0]);
        others.fold(
            self,
            |rest, group| if present(&rest, group) { rest.without(group) } else { rest },
        )
    }

    /// The most likely values of the other parameters if a group is zero.
    fn without(&self, group: &[usize]) -> Self {
        let kept: Vec<usize> =
            (0..self.active.len()).filter(|&i| !group.contains(&self.active[i])).collect();
        let right = (&self.information * self.values()).select_rows(&kept);
        let information = self.information.select_rows(&kept).select_columns(&kept);
        let values = match information.clone().cholesky() {
            Some(factor) => factor.solve(&right),
            None => DVector::zeros(kept.len()),
        };
        let active: Vec<usize> = kept.iter().map(|&i| self.active[i]).collect();
        let mut vector = self.vector;
        group.iter().for_each(|&p| vector[p] = 0.0);
        active.iter().zip(&values).for_each(|(&p, value)| vector[p] = *value);
        Self { vector, active, information, ..*self }
    }
}

/// A corner of K edges in the joint fit.
#[derive(Clone)]
struct Member<const K: usize> {
    patch: Patch,
    corner: Corner<K>,
}

impl<const K: usize> From<Sample> for Member<K> {
    fn from(sample: Sample) -> Self {
        Self { patch: sample.patch, corner: sample.corner.with_edges() }
    }
}

/// Corners to be fitted together.
struct Problem<'a, const K: usize> {
    fitter: &'a mut CornerFitter,
    image: ImageView<'a>,
    members: Vec<Member<K>>,
    /// Median black and white of the corners.
    greys: [f64; 2],
    /// The parameters that may be estimated, and those of them that are.
    all: Vec<usize>,
    active: Vec<usize>,
}

/// The equations of all parameters at these optics and corners.
struct Linearised<const K: usize> {
    optics: Optics,
    corners: Vec<Corner<K>>,
    equations: Vec<Option<Joint>>,
}

/// Optics that fit the corners, the covariance of the active parameters, and the equations before the last step.
struct Adjusted<const K: usize> {
    optics: Optics,
    cov: DMatrix<f64>,
    /// What the last step lacks, in standard deviations, as the steps before it say.
    lack: f64,
    at: Linearised<K>,
    reduced: Reduced,
}

/// The equations of the common parameters, the corners' eliminated.
struct Reduced {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Scatter of the corners' gradients.
    scatter: DMatrix<f64>,
    /// A⁻¹a and A⁻¹B of each corner; columns of B beyond the parameters are zero.
    own: Vec<Option<(SVector<f64, OWN>, SMatrix<f64, OWN, PARAMS>)>>,
}

impl Reduced {
    /// The covariance of corner positions, xx, xy, yy, px², that follows from this covariance of
    /// the common parameters: the mean over corners with weight.
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
    /// The estimate after a first step, with the covariance of the noise alone, and the covariance
    /// with the scatter of gradients.
    fn first_step(&self, optics: &Optics, reduced: &Reduced) -> (Estimate, DMatrix<f64>) {
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

    /// The estimate with these values of the parameters, near these optics, given the covariance of
    /// the active ones.
    fn estimate(&self, optics: &Optics, vector: [f64; PARAMS], cov: &DMatrix<f64>) -> Estimate {
        let active = self.active.clone();
        let inverse = cov.clone().cholesky().map(|factor| factor.inverse());
        let information = inverse.unwrap_or_else(|| DMatrix::zeros(active.len(), active.len()));
        let kappa_slopes = [0, 1, 2].map(|p| optics.kappa_slope(self.greys, p));
        let pixels = self.members.iter().map(|member| member.patch.window.count()).sum();
        Estimate { vector, active, information, kappa_slopes, pixels }
    }

    /// The estimated ink spread; `None` where it was not estimated.
    fn ink(&self, optics: &Optics, cov: &DMatrix<f64>, used: bool) -> Option<InkEstimate> {
        let at = self.active.iter().position(|&p| p == INK)?;
        let deviation = INK_UNIT * cov[(at, at)].max(0.0).sqrt();
        Some(InkEstimate::new(INK_UNIT * optics.ink, deviation, used))
    }

    /// The optics that fit the corners best up to a part of their deviations.
    fn adjusted(&mut self, mut at: Linearised<K>, converged: f64) -> Adjusted<K> {
        let mut optics = at.optics.clone();
        let mut damping = Damping::NONE.at_least(0.0, FIRST_DAMPING);
        let (mut before, mut lack) = (None, f64::INFINITY);
        // By the noise that is left so far: of a curve that is not yet known it is many times what it will be.
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
                    // What it would gain is no more than sums of single precision tell.
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

    /// The optics that fit the corners best, without the groups that then differ from nothing by no more than
    /// chance.
    fn settled(&mut self, start: Linearised<K>) -> Adjusted<K> {
        let mut found = self.adjusted(start, ROUGHLY_CONVERGED);
        let vector = found.optics.vector();
        let supported = self.estimate(&found.optics, vector, &found.cov).supported(1.0);
        let is_less = supported.active.len() < self.active.len();
        if is_less {
            // Where the others then fit best, which the scatter, by which they are judged, does not tell.
            let (step, _) = self.first_step(&found.at.optics, &found.reduced);
            let rest = step.only(&supported.active);
            found.optics = self.stepped(&found.at, &found.reduced, &rest.vector);
            self.active = rest.active;
        }
        if is_less || found.lack >= CONVERGED {
            let at = self.linearised(found.optics);
            found = self.adjusted(at, CONVERGED);
        }
        if found.optics.stretch() > LEAST_MOTION && !found.optics.is_motion {
            found = self.moved(&found.optics).unwrap_or(found);
        }
        found
    }

    /// The optics if the picture moved along a line, where that fits the corners better than a Gaussian does.
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

    /// The optics with these values of the active parameters, with the corners moved along as their equations say.
    fn stepped(&mut self, at: &Linearised<K>, reduced: &Reduced, vector: &[f64; PARAMS]) -> Optics {
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

    /// The members' corners.
    fn corners(&self) -> Vec<Corner<K>> {
        self.members.iter().map(|member| member.corner).collect()
    }

    /// Gives the members these corners again.
    fn put_back(&mut self, corners: &[Corner<K>]) {
        self.members.iter_mut().zip(corners).for_each(|(member, corner)| member.corner = *corner);
    }

    /// The next step of the active parameters: none further than [`MAX_STEP`], and the halo not beyond its end.
    fn step(&self, reduced: &Reduced, optics: &Optics, damping: Damping) -> Option<DVector<f64>> {
        let mut damped = reduced.matrix.clone();
        for i in 0..damped.nrows() {
            damped[(i, i)] = damping.grown(damped[(i, i)]);
        }
        let mut step = damped.clone().cholesky()?.solve(&reduced.gradient);
        if let Some(at) = self.active.iter().position(|&p| p == HALO) {
            let most = LEAST_HALO - optics.halo[0];
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

    /// Factor of the covariances: what the noise is more than white.
    fn inflation(&mut self, optics: &Optics) -> f64 {
        let Self { fitter, image, members, .. } = self;
        if members.len() < correlation::CORNERS / 2 {
            // Too few to tell correlations.
            return 1.0;
        }
        // Those of the least noise: what others show beside the corner counts in their own residuals.
        let mut found: Vec<Influence> = members
            .iter()
            .filter_map(|member| fitter.influence(*image, &member.patch, &member.corner, optics))
            .collect();
        found.sort_by(|a, b| a.noise.total_cmp(&b.noise));
        correlation::inflation(&found)
    }

    /// The equations of all parameters at the members' corners.
    fn linearised(&mut self, optics: Optics) -> Linearised<K> {
        let corners = self.corners();
        let Self { fitter, image, members, all, .. } = self;
        let common: Vec<Common> = all.iter().map(|&p| optics.common(p)).collect();
        let equations = members
            .iter()
            .map(|member| fitter.joint(*image, &member.patch, &member.corner, &optics, &common))
            .collect();
        Linearised { optics, corners, equations }
    }

    /// The equations of the active parameters.
    fn reduced(&self, at: &Linearised<K>, weights: &[f64]) -> Reduced {
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

/// Weights of corners: the inverse of their noise, but not above that of the median corner.
fn weights_of(equations: &[Option<Joint>]) -> Vec<f64> {
    let noises = equations.iter().flatten().map(|joint| joint.noise).collect();
    let middle = median(noises).unwrap_or(1.0);
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

/// The larger of the covariances by the noise and by the scatter of the gradients.
fn covariance(reduced: &Reduced) -> Option<DMatrix<f64>> {
    let inverse = reduced.matrix.clone().cholesky()?.inverse();
    let members = reduced.own.iter().flatten().count();
    let count = reduced.gradient.len();
    if members <= 2 * count {
        // The scatter of so few is as uncertain as what it is to correct.
        return Some(inverse);
    }
    let correction = members as f64 / (members - count) as f64;
    let sandwich = &inverse * &reduced.scatter * &inverse * correction;
    // Along each parameter the larger; correlations as the noise has them.
    let scale: Vec<f64> =
        (0..count).map(|i| (sandwich[(i, i)] / inverse[(i, i)]).max(1.0).sqrt()).collect();
    Some(DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec2;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;
    use crate::refine::model::fitter::{Accuracy, Fitted};
    use crate::refine::model::window::Window;
    use deltille_core::detection::Tone;
    use deltille_core::raster::Gray;

    /// Square of each corner, px; points of each pixel's side; blur, px.
    const SIDE: usize = 33;
    const FINE: usize = 6;
    const BLUR_PX: f64 = 0.8;
    const EDGE_PX: f64 = 40.0;
    const COUNT: usize = 5;

    /// A picture of corners seen from 55°, all sides of which ink has moved, and the corners. Every point is dark
    /// that lies in a dark sector or nearer to one than the ink, on the paper.
    fn picture(ink: f64, grey: impl Fn(f64) -> f64) -> (Gray<f32>, Vec<Corner<3>>) {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let shrink = 55f64.to_radians().cos();
        let mut fine = vec![0.0f64; (COUNT * SIDE * FINE).pow(2)];
        let mut corners = Vec::new();
        for tile in 0..COUNT * COUNT {
            let first = DVec2::from([tile % COUNT, tile / COUNT].map(|c| (c * SIDE) as f64));
            let position = first.map(|c| c + (SIDE / 2) as f64 + rng.random_range(-0.5..0.5));
            let (turn, roll) = (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0f64));
            let on_paper = |place: DVec2| {
                let off = DVec2::from_angle(-roll).rotate(place - position);
                DVec2::new(off.x, off.y / shrink)
            };
            let lines = [0, 1, 2].map(|k| turn + f64::from(k) * PI / 3.0);
            let distances =
                |paper: DVec2| lines.map(|line| DVec2::from_angle(line).perp_dot(paper));
            for y in 0..SIDE * FINE {
                for x in 0..SIDE * FINE {
                    let place = [x, y].map(|c| (c as f64 + 0.5) / FINE as f64 - 0.5);
                    let h = distances(on_paper(DVec2::from(place) + first));
                    let grown = ink * EDGE_PX;
                    let sides = [h[0] < grown, h[1] > -grown, h[2] < grown];
                    let is_dark = sides.iter().filter(|&&side| side).count() > 1;
                    let [row, col] = [1, 0].map(|i| first[i] as usize * FINE + [x, y][i]);
                    fine[row * COUNT * SIDE * FINE + col] = f64::from(!is_dark);
                }
            }
            let edge = |line: &f64| {
                let in_picture =
                    |way: DVec2| DVec2::from_angle(roll).rotate(DVec2::new(way.x, way.y * shrink));
                let line = DVec2::from_angle(*line);
                let (along, across) = (in_picture(line), in_picture(line.perp()));
                let off = along.perp_dot(across).abs() / along.length();
                (along.to_angle(), EDGE_PX * off)
            };
            let mut edges: Vec<(f64, f64)> = lines.iter().map(edge).collect();
            // What is before a line lies behind the same line the other way.
            let turned = edges.iter().filter(|(angle, _)| *angle < 0.0).count();
            edges.iter_mut().for_each(|(angle, _)| *angle = angle.rem_euclid(PI));
            edges.sort_by(|a, b| a.0.total_cmp(&b.0));
            corners.push(Corner {
                position,
                blur_px: BLUR_PX,
                amplitude: if turned % 2 == 0 { 0.35 } else { -0.35 },
                level: 0.45,
                slope: DVec2::ZERO,
                angles: [0, 1, 2].map(|k| edges[k].0),
                bends: [0.0; 3],
                across_px: [0, 1, 2].map(|k| edges[k].1),
            });
        }
        let blurred = blurred_and_sampled(&fine);
        let noise = Normal::new(0.0, 0.003).unwrap();
        let picture = Gray::from_fn(COUNT * SIDE, COUNT * SIDE, |x, y| {
            let light = 0.1 + 0.7 * blurred[y * COUNT * SIDE + x];
            (grey(light) + noise.sample(&mut rng)) as f32
        });
        (picture, corners)
    }

    /// A fine square under a Gaussian blur and the mean over each pixel.
    fn blurred_and_sampled(fine: &[f64]) -> Vec<f64> {
        let side = COUNT * SIDE * FINE;
        let reach = (4.0 * BLUR_PX * FINE as f64) as isize;
        let kernel: Vec<f64> = (-reach..=reach)
            .map(|k| (-0.5 * (k as f64 / (BLUR_PX * FINE as f64)).powi(2)).exp())
            .collect();
        let total: f64 = kernel.iter().sum();
        // Along the rows, then transposed, and again.
        let pass = |image: &[f64], rows: usize| -> Vec<f64> {
            let mut result = vec![0.0; rows * COUNT * SIDE];
            for row in 0..rows {
                for (i, pixel) in (0..COUNT * SIDE).enumerate() {
                    let points = (0..FINE).flat_map(|f| {
                        let at = (pixel * FINE + f) as isize;
                        (-reach..=reach).map(move |k| (at + k, (k + reach) as usize))
                    });
                    let sum: f64 = points
                        .map(|(at, k)| {
                            image[row * side + at.clamp(0, side as isize - 1) as usize] * kernel[k]
                        })
                        .sum();
                    result[i * rows + row] = sum / (total * FINE as f64);
                }
            }
            result
        };
        pass(&pass(fine, side), COUNT * SIDE)
    }

    /// The pixels around a corner.
    fn around<const K: usize>(corner: &Corner<K>) -> Patch {
        Patch { window: Window::new(9), centre: corner.position.round() }
    }

    fn fitted(
        fitter: &mut CornerFitter,
        image: &Gray<f32>,
        corner: &Corner<3>,
        optics: &Optics,
    ) -> Fitted<3> {
        let start = Corner { position: corner.position.round(), ..*corner };
        fitter.fit(image.into(), &Window::new(9), &start, optics, Accuracy::Full).unwrap()
    }

    /// Of all parameters, a corner's own and the common ones, under a halo, ink, a motion and a curve.
    #[test]
    fn gradients_of_the_joint_equations_are_those_of_the_cost() {
        let (image, corners) = picture(0.004, |light| Tone::Srgb.grey(light));
        let plain = Optics { range: [0.1, 0.9], ..Optics::of(Tone::Auto).with_ink(None) };
        let still = plain.with(&[0.3, -0.2, 0.1, 0.3, -0.25, -0.3, 0.5]);
        for optics in [Optics { is_motion: true, ..still.clone() }, still] {
            for corner in &corners[..4] {
                compare_gradients(&image, corner, &optics);
                compare_gradients(&image, &corner.with_edges::<2>(), &optics);
            }
        }
    }

    fn compare_gradients<const K: usize>(image: &Gray<f32>, corner: &Corner<K>, optics: &Optics) {
        /// A corner's black and white, between which a piece of the curve is held.
        const LIGHT: [usize; 2] = [3, 4];
        let patch = around(corner);
        let common: Vec<Common> = (0..PARAMS).map(|p| optics.common(p)).collect();
        let mut fitter = CornerFitter::default();
        let mut joint = |corner: &Corner<K>, optics: &Optics| {
            fitter.joint(image.into(), &patch, corner, optics, &common).unwrap()
        };
        let here = joint(corner, optics);
        for i in 0..OWN + PARAMS {
            let scale = (here.matrix[(i, i)] * here.cost).sqrt();
            if scale == 0.0 {
                continue;
            }
            let step = 2e-3 * here.cost / scale;
            let moved = |by: f64| {
                let mut own = SVector::zeros();
                let mut vector = optics.vector();
                match i.checked_sub(OWN) {
                    Some(i) => vector[i] += by,
                    None => own[i] = by,
                }
                (corner.stepped(&own).unwrap(), optics.with(&vector))
            };
            let [(c1, o1), (c2, o2)] = [moved(step), moved(-step)];
            let quotient = (joint(&c2, &o2).cost - joint(&c1, &o1).cost) / (4.0 * step);
            let error = (here.gradient[i] - quotient).abs() / scale;
            let most = if LIGHT.contains(&i) { 0.1 } else { 0.03 };
            assert!(error < most, "{K} edges, motion {}, {i}: {error}", optics.is_motion);
        }
    }

    #[test]
    fn ink_is_told_from_tone_and_does_not_move_corners() {
        let srgb = |light: f64| Tone::Srgb.grey(light);
        let curves: [(&str, &dyn Fn(f64) -> f64); 2] = [("line", &|light| light), ("sRGB", &srgb)];
        for (ink, (name, curve)) in
            [0.0, 0.004, -0.006].into_iter().flat_map(|ink| curves.map(|curve| (ink, curve)))
        {
            let (image, corners) = picture(ink, curve);
            let known = Optics::of(Tone::Auto).with_ink(None);
            let mut fitter = CornerFitter::default();
            let samples = corners.iter().take(SAMPLES).map(|corner| {
                let Fitted { corner: found, noise, .. } =
                    fitted(&mut fitter, &image, corner, &known);
                Sample {
                    patch: around(corner),
                    corner: found,
                    residual: noise / found.amplitude.abs(),
                }
            });
            let samples = samples.collect();
            let optics = Optics::estimate::<3>(&mut fitter, (&image).into(), samples, &known);
            let found = optics.ink_found.unwrap();
            assert_eq!(found.used, ink != 0.0, "{ink} {name}: {found:?}");
            assert!((found.edges - ink).abs() < 2e-4, "{ink} {name}: {found:?}");
            let square: f64 = corners
                .iter()
                .map(|corner| {
                    let found = fitted(&mut fitter, &image, corner, &optics).corner.position;
                    (0..2).map(|i| (found[i] - corner.position[i]).powi(2)).sum::<f64>()
                })
                .sum();
            let rms = (square / (2.0 * corners.len() as f64)).sqrt();
            assert!(rms < 0.01, "{ink} {name}: {rms}");
        }
    }
}
