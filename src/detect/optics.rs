//! What all corners of a picture have in common: tone curve, halo and astigmatism.
//!
//! Corners from all over the picture are fitted together, each with its own place, edges, blur and light, and
//! with the common parameters: the normal equations have a block for each corner, which is eliminated
//! (Schur's complement). Then the common parameters are held, so that they cost single corners
//! nothing. Groups of them that differ from nothing by no more than chance explains are left out; what
//! chance explains is told by the scatter of the corners' gradients, so that pixels which depend on each
//! other, or a model that holds only nearly, make no evidence.

use nalgebra::{DMatrix, DVector};

use super::corner_model::{Common, Corner, CornerFitter, Joint, Window};
use super::correlation::{self, Influence};
use super::curve::{Curve, Piece, TONE_PARAMS, Tone, ToneEstimate};
use super::detection::median;
use crate::raster::{Gray, Intensity};

/// Corners that are fitted together; more tell the curve better than single corners can use it.
pub const SAMPLES: usize = 16;

/// Windows of these corners end here, px, or after so many deviations of the blur: what is common shows
/// at the edges, and near the corner.
pub const REACH_PX: f64 = 7.0;
pub const REACH_SIGMAS: f64 = 5.0;

/// Width of a halo over that of the blur: masks of 1 to 2 px on pictures of 0.7 to 1 px of blur.
const HALO_WIDTH: f64 = 2.0;

/// Prior deviations of the parameters: gamma 2.6 has (1.6, 0, 0), smooth steps have −0.5 at both ends,
/// halos of 0.5 are strong, and a blur twice as wide in one direction has an astigmatism of 0.6.
const PRIOR: [f64; PARAMS] = [2.0, 1.0, 1.0, 0.3, 0.3, 0.5];

/// The parameters: the curve's, the astigmatism's, the halo's.
const PARAMS: usize = TONE_PARAMS + 3;
const GROUPS: [&[usize]; 3] = [&[0, 1, 2], &[3, 4], &[HALO]];
const HALO: usize = PARAMS - 1;

/// A group is used when chance has it with less than 1 : 1000: χ² of three, two and one degrees of freedom.
const CHI2: [f64; 3] = [16.3, 13.8, 10.8];

/// A group is looked for where the first step, from a straight curve, promises this part of it.
const WORTH_A_LOOK: f64 = 0.5;

/// Steps of difference quotients, and of the parameters at most.
pub const STEP: f64 = 0.01;
const MAX_STEP: f64 = 0.7;

/// Most iterations; four are usual.
const MAX_ITERATIONS: usize = 10;

/// Steps below this part of the parameters' deviations end the iteration.
const CONVERGED: f64 = 0.3;

/// Weights of corners end where their residuals are this many times the median: they show something else.
const MAX_RESIDUAL_RATIO: f64 = 3.0;

/// Most of the blur's square that may lie in one direction, over the mean of both.
const MAX_ASTIGMATISM: f64 = 0.95;

/// What is common to the corners of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Optics {
    /// Whether the curve is not known.
    is_open: bool,
    curve: Option<Curve>,
    params: [f64; TONE_PARAMS],
    /// Grey values that an estimated curve is made for.
    range: [f64; 2],
    /// e₁, e₂ of M = (1 + e₁, e₂; e₂, 1 − e₁).
    pub astigmatism: [f64; 2],
    /// Strength of the halo, and its width over that of the blur.
    pub halo: [f64; 2],
    /// Factor of the covariances.
    pub inflation: f64,
    /// What single corners leave without them, of half the contrast: the median.
    pub plain_residual: f64,
    /// What was found of the curve.
    pub tone: Option<ToneEstimate>,
}

impl Default for Optics {
    fn default() -> Self {
        Self {
            is_open: false,
            curve: None,
            params: [0.0; TONE_PARAMS],
            range: [0.0, 1.0],
            astigmatism: [0.0; 2],
            halo: [0.0, HALO_WIDTH],
            inflation: 1.0,
            plain_residual: 0.0,
            tone: None,
        }
    }
}

/// A corner that is fitted together with others, in picture coordinates.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Pixels that show nothing else.
    pub window: Window,
    /// The pixel in its middle.
    pub centre: [f64; 2],
    /// What was found of it.
    pub corner: Corner<3>,
    /// What it leaves, over half the contrast.
    pub residual: f64,
}

impl Optics {
    /// What is known of a camera with this tone curve.
    pub fn of(tone: Tone) -> Self {
        Self { is_open: tone == Tone::Auto, curve: Curve::of(tone), ..Self::default() }
    }

    /// Whether there is a halo.
    pub fn has_halo(&self) -> bool {
        self.halo[0] != 0.0
    }

    /// Whether there is a tone curve.
    pub fn is_toned(&self) -> bool {
        self.curve.is_some()
    }

    /// The tone curve between the black and white of a corner.
    pub fn piece(&self, level: f64, amplitude: f64) -> Piece {
        match &self.curve {
            Some(curve) => curve.piece(level, amplitude),
            None => Piece::line(level, amplitude),
        }
    }

    /// The optics with one parameter a [`STEP`] further.
    fn moved(&self, parameter: usize) -> Self {
        let mut params = self.vector();
        params[parameter] += STEP;
        self.with(&params)
    }

    /// A parameter, for the corners' equations.
    fn common(&self, parameter: usize) -> Common {
        match parameter {
            0..TONE_PARAMS => Common::Tone { parameter, moved: Box::new(self.moved(parameter)) },
            HALO => Common::Halo,
            _ => Common::Astigmatism(parameter - TONE_PARAMS),
        }
    }

    fn vector(&self) -> [f64; PARAMS] {
        let ([p1, p2, p3], [e1, e2]) = (self.params, self.astigmatism);
        [p1, p2, p3, e1, e2, self.halo[0]]
    }

    fn with(&self, &[p1, p2, p3, e1, e2, halo]: &[f64; PARAMS]) -> Self {
        let params = [p1, p2, p3];
        let curve = if params == self.params {
            self.curve.clone()
        } else {
            Some(Curve::estimated(params, self.range))
        };
        let long = (e1.hypot(e2) / MAX_ASTIGMATISM).max(1.0);
        Self {
            curve,
            params,
            astigmatism: [e1 / long, e2 / long],
            halo: [halo, self.halo[1]],
            ..self.clone()
        }
    }

    /// The optics that a picture's corners show; a tone curve that is known is kept.
    pub fn estimate<const K: usize, T: Intensity>(
        fitter: &mut CornerFitter,
        image: &Gray<T>,
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
        let active = (0..PARAMS).filter(|&p| known.is_open || p >= TONE_PARAMS).collect();
        let members = samples.into_iter().map(Member::from).collect();
        let mut problem = Problem::<K, T> { fitter, image, members, active };
        let middle = |v: Vec<f64>| median(v).unwrap_or(0.0);
        let (black, white) = (middle(blacks), middle(whites));
        let tone = |optics: &Self, cov: &DMatrix<f64>, active: &[usize], used| {
            let [kappa, kappa_deviation, kappa_odd] =
                optics.curvature([black, white], cov, active)?;
            Some(ToneEstimate { black, white, kappa, kappa_deviation, kappa_odd, used })
        };
        // A first step tells what is worth looking for. What the model lacks there scatters the gradients: that is
        // no reason to look away, but the deviation that is reported.
        let (vector, under_noise, cov) = problem.first_step(&known);
        let mut found = tone(&known.with(&vector), &cov, &problem.active, false);
        let active = problem.supported(&vector, &under_noise, WORTH_A_LOOK);
        let mut optics = known.clone();
        if !active.is_empty() {
            problem.active = active;
            let mut cov;
            (optics, cov) = problem.adjusted(&known);
            let vector = optics.vector();
            let used = problem.supported(&vector, &cov, 1.0);
            if used.len() < problem.active.len() {
                let without = problem.without(&vector, &cov, &used);
                problem.active = used;
                optics = known.with(&without);
                if !problem.active.is_empty() {
                    (optics, cov) = problem.adjusted(&optics);
                }
            }
            found = tone(&optics, &cov, &problem.active, true).or(found);
        }
        let inflation = problem.inflation(&optics);
        Self { tone: found, inflation, ..optics }
    }

    /// κ₀ between black and white, its deviation, and κ₁; `None` where the curve was not looked for.
    fn curvature(
        &self,
        [black, white]: [f64; 2],
        cov: &DMatrix<f64>,
        active: &[usize],
    ) -> Option<[f64; 3]> {
        active.contains(&0).then(|| {
            let terms = |optics: &Self| {
                optics.piece((white + black) / 2.0, (white - black) / 2.0).terms.map(f64::from)
            };
            let here = terms(self);
            let slopes = DVector::from_iterator(
                active.len(),
                active.iter().map(|&p| (terms(&self.moved(p))[0] - here[0]) / STEP),
            );
            [here[0], slopes.dot(&(cov * &slopes)).max(0.0).sqrt(), here[1]]
        })
    }
}

/// How much a group of parameters differs from nothing, in squared deviations.
fn chi2(vector: &[f64; PARAMS], cov: &DMatrix<f64>, active: &[usize], group: &[usize]) -> f64 {
    let places: Vec<usize> =
        active.iter().enumerate().filter_map(|(i, p)| group.contains(p).then_some(i)).collect();
    if places.is_empty() {
        return 0.0;
    }
    let part = cov.select_rows(&places).select_columns(&places);
    let value = DVector::from_iterator(places.len(), places.iter().map(|&i| vector[active[i]]));
    part.cholesky().map_or(0.0, |part| value.dot(&part.solve(&value)))
}

/// A corner of K edges in the joint fit.
#[derive(Clone)]
struct Member<const K: usize> {
    window: Window,
    centre: [f64; 2],
    corner: Corner<K>,
}

impl<const K: usize> From<Sample> for Member<K> {
    fn from(sample: Sample) -> Self {
        Self { window: sample.window, centre: sample.centre, corner: sample.corner.with_edges() }
    }
}

/// Corners to be fitted together.
struct Problem<'a, const K: usize, T> {
    fitter: &'a mut CornerFitter,
    image: &'a Gray<T>,
    members: Vec<Member<K>>,
    active: Vec<usize>,
}

/// The equations of the common parameters, the corners' eliminated.
struct Reduced {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Scatter of the corners' gradients.
    scatter: DMatrix<f64>,
    /// A⁻¹a and A⁻¹B of each corner.
    own: Vec<Option<(DVector<f64>, DMatrix<f64>)>>,
}

impl<const K: usize, T: Intensity> Problem<'_, K, T> {
    /// Where a first step leads, and the covariances there: under the noise alone, and by the scatter too.
    fn first_step(&mut self, optics: &Optics) -> ([f64; PARAMS], DMatrix<f64>, DMatrix<f64>) {
        let count = self.active.len();
        let unknown = || DMatrix::identity(count, count);
        let equations = self.equations(optics);
        let reduced = self.reduced(&equations, &weights(&equations), optics);
        let mut vector = optics.vector();
        let Some(factor) = reduced.matrix.clone().cholesky() else {
            return (vector, unknown(), unknown());
        };
        let step = factor.solve(&reduced.gradient);
        self.active.iter().zip(step.iter()).for_each(|(&p, s)| vector[p] += s);
        (vector, factor.inverse(), covariance(&reduced).unwrap_or_else(unknown))
    }

    /// The active parameters of groups that differ from nothing by more than this part of what counts.
    fn supported(&self, vector: &[f64; PARAMS], cov: &DMatrix<f64>, part: f64) -> Vec<usize> {
        let differs = |group: &&[usize], limit: f64| chi2(vector, cov, &self.active, group) > limit;
        let groups = GROUPS.iter().zip(CHI2);
        groups
            .filter(|(group, limit)| differs(group, part * limit))
            .flat_map(|(group, _)| group.iter().copied())
            .collect()
    }

    /// The most likely parameters where those that are not `used` are nothing.
    fn without(&self, vector: &[f64; PARAMS], cov: &DMatrix<f64>, used: &[usize]) -> [f64; PARAMS] {
        let (kept, dropped): (Vec<usize>, Vec<usize>) =
            (0..self.active.len()).partition(|&i| used.contains(&self.active[i]));
        let value =
            DVector::from_iterator(dropped.len(), dropped.iter().map(|&i| vector[self.active[i]]));
        let part = cov.select_rows(&dropped).select_columns(&dropped);
        let mut changed = *vector;
        dropped.iter().for_each(|&i| changed[self.active[i]] = 0.0);
        if let Some(part) = part.cholesky() {
            let shift = cov.select_rows(&kept).select_columns(&dropped) * part.solve(&value);
            kept.iter().zip(shift.iter()).for_each(|(&i, s)| changed[self.active[i]] -= s);
        }
        changed
    }

    /// The optics that fit the corners best, from these, and the covariance of the active parameters.
    fn adjusted(&mut self, first: &Optics) -> (Optics, DMatrix<f64>) {
        let count = self.active.len();
        let mut optics = first.clone();
        let mut damping = 0.0;
        let mut equations = self.equations(&optics);
        let weights = weights(&equations);
        let mut reduced = self.reduced(&equations, &weights, &optics);
        for _ in 0..MAX_ITERATIONS {
            let mut damped = reduced.matrix.clone();
            for i in 0..count {
                damped[(i, i)] *= 1.0 + damping;
            }
            let Some(factor) = damped.cholesky() else { break };
            let mut step = factor.solve(&reduced.gradient);
            let length = step.amax();
            if length > MAX_STEP {
                step *= MAX_STEP / length;
            }
            let mut vector = optics.vector();
            self.active.iter().zip(step.iter()).for_each(|(&p, s)| vector[p] += s);
            let there = optics.with(&vector);
            let before = self.members.clone();
            for (member, own) in self.members.iter_mut().zip(&reduced.own) {
                let Some((constant, slope)) = own else { continue };
                let own = constant - slope * &step;
                member.corner = member.corner.stepped(own.as_slice()).unwrap_or(member.corner);
            }
            let next = self.equations(&there);
            let improved = cost(&next, &weights, &there) <= cost(&equations, &weights, &optics);
            let small = step.dot(&(&reduced.matrix * &step)) < CONVERGED * CONVERGED;
            if improved {
                (optics, equations) = (there, next);
                reduced = self.reduced(&equations, &weights, &optics);
                damping *= 0.1;
                if small {
                    break;
                }
            } else {
                self.members = before;
                if small {
                    break;
                }
                damping = (damping * 10.0).max(0.01);
            }
        }
        let cov = covariance(&reduced).unwrap_or_else(|| DMatrix::identity(count, count));
        (optics, cov)
    }

    /// Factor of the covariances: what the noise is more than white.
    fn inflation(&mut self, optics: &Optics) -> f64 {
        let Self { fitter, image, members, .. } = self;
        if members.len() < correlation::CORNERS / 2 {
            return 1.0;
        }
        // Those of the least noise: what others show beside the corner counts in their own residuals.
        let mut found: Vec<Influence> = members
            .iter()
            .filter_map(|member| {
                let window = (&member.window, member.centre);
                fitter.influence(image, window, &member.corner, optics)
            })
            .collect();
        found.sort_by(|a, b| a.noise.total_cmp(&b.noise));
        correlation::inflation(&found)
    }

    fn equations(&mut self, optics: &Optics) -> Vec<Option<Joint>> {
        let Self { fitter, image, members, active } = self;
        let common: Vec<Common> = active.iter().map(|&p| optics.common(p)).collect();
        members
            .iter()
            .map(|member| {
                let window = (&member.window, member.centre);
                fitter.joint(image, window, &member.corner, optics, &common)
            })
            .collect()
    }

    fn reduced(&self, equations: &[Option<Joint>], weights: &[f64], optics: &Optics) -> Reduced {
        let count = self.active.len();
        let vector = optics.vector();
        let mut reduced = Reduced {
            matrix: DMatrix::zeros(count, count),
            gradient: DVector::zeros(count),
            scatter: DMatrix::zeros(count, count),
            own: Vec::with_capacity(equations.len()),
        };
        for (joint, weight) in equations.iter().zip(weights) {
            let eliminated = joint.as_ref().and_then(|joint| {
                let own = joint.own;
                let a = joint.matrix.view((0, 0), (own, own)).into_owned().cholesky()?;
                let b = joint.matrix.view((0, own), (own, count)).into_owned();
                let constant = a.solve(&joint.gradient.rows(0, own).into_owned());
                let slope = a.solve(&b);
                let matrix = joint.matrix.view((own, own), (count, count)) - b.transpose() * &slope;
                let gradient = joint.gradient.rows(own, count) - b.transpose() * &constant;
                reduced.matrix += *weight * matrix;
                reduced.scatter += *weight * weight * &gradient * gradient.transpose();
                reduced.gradient += *weight * gradient;
                Some((constant, slope))
            });
            reduced.own.push(eliminated);
        }
        for (i, &p) in self.active.iter().enumerate() {
            let weight = 1.0 / (PRIOR[p] * PRIOR[p]);
            reduced.matrix[(i, i)] += weight;
            reduced.gradient[i] -= weight * vector[p];
        }
        reduced
    }
}

/// Weights of corners: the inverse of their noise, but of none more than of the middle one's.
fn weights(equations: &[Option<Joint>]) -> Vec<f64> {
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

fn cost(equations: &[Option<Joint>], weights: &[f64], optics: &Optics) -> f64 {
    let prior = optics.vector().iter().zip(PRIOR).map(|(p, d)| (p / d).powi(2)).sum::<f64>();
    let costs = equations.iter().zip(weights);
    let of = |(joint, weight): (&Option<Joint>, &f64)| match joint {
        Some(joint) => weight * joint.cost,
        None if *weight > 0.0 => f64::INFINITY,
        None => 0.0,
    };
    prior + costs.map(of).sum::<f64>()
}

/// The larger of what the noise and what the scatter of the corners say.
fn covariance(reduced: &Reduced) -> Option<DMatrix<f64>> {
    let inverse = reduced.matrix.clone().cholesky()?.inverse();
    let members = reduced.own.iter().flatten().count();
    let count = reduced.gradient.len();
    if members <= 2 * count {
        return Some(inverse);
    }
    let correction = members as f64 / (members - count) as f64;
    let sandwich = &inverse * &reduced.scatter * &inverse * correction;
    // Along each parameter the larger; correlations as the noise has them.
    let scale: Vec<f64> =
        (0..count).map(|i| (sandwich[(i, i)] / inverse[(i, i)]).max(1.0).sqrt()).collect();
    Some(DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
