//! Joint estimation of the parameters that all corners of an image share: tone curve, halo and astigmatism of the point
//! spread function, and the ink spread of the print.
//!
//! Corners from all over the image are fitted together by damped least squares. Each has its own position, edges, blur
//! and light, and all share the common parameters. The normal equations have a block for each corner, which is
//! eliminated (Schur complement). Afterwards the common parameters are fixed, so that they add no unknowns to single
//! corners. Groups of parameters that are not significant are omitted. The scatter of the gradients of the corners
//! decides significance, so that correlated pixels, or an approximate model, do not count as evidence.

use nalgebra::{DMatrix, DVector};

use super::correlation;
use super::displaced_rows;
use super::joint_fit::{Linearised, Member, Problem, Sample, noise_of, weights_of};
use super::model::fitter::CornerFitter;
use super::optics::{CROSS, HALO, INK, Optics, PARAMS};
use deltille_core::detection::{InkEstimate, TONE_PARAMS, ToneEstimate};
use deltille_core::raster::ImageView;
use deltille_core::statistics::median;

/// Number of corners that are fitted together. More corners would determine the curve more
/// accurately than single corners need.
pub(crate) const SAMPLES: usize = 16;

/// Radius of the windows of these corners, px. The common parameters affect the pixels at the edges
/// and near the corner.
pub(crate) const REACH_PX: f64 = 7.0;

/// The same for a blurred image, in standard deviations of the blur.
pub(crate) const REACH_SIGMAS: f64 = 5.0;

/// Minimum evidence at which a group is estimated, as a fraction of its threshold. The first step,
/// from a straight curve, predicts the evidence.
const WORTH_ESTIMATING: f64 = 0.5;

/// Whites from which the fit starts if the image is clipped, relative to the brightest one that it shows. From a start
/// at the limit of the sensor, the fit may end where dark areas have shrunk instead. Light that is clipped at less than
/// 0.4 of white hides the middle of the edges.
const CLIPPED_WHITES: [f64; 4] = [1.0, 1.5, 2.5, 5.0];

/// The same if edges seem to have moved because light that is spread by blur is clipped, with the distance at which half
/// of the visible light is reached on the dark side of an edge, in standard deviations of the blur: Φ⁻¹(1 − 1/(2·white)).
const OVEREXPOSED_WHITES: [[f64; 2]; 4] = [[1.5, 0.431], [2.5, 0.842], [5.0, 1.282], [10.0, 1.645]];

/// Maximum noise of the fit of an overexposed image, relative to that of a print whose dark areas have shrunk: of two
/// equal fits, that with fewer parameters. The median noise of the corners is known to within a few per cent.
const MAX_OVEREXPOSED_NOISE: f64 = 1.05;

impl Optics {
    /// Estimates the optics from the corners of an image; a known tone curve is kept.
    pub(crate) fn estimate<const K: usize>(
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
        let is_clipped = range[1] >= 1.0;
        let is_active = |known: &Self, p: usize| match p {
            0..TONE_PARAMS => known.is_open,
            INK => known.is_ink_open,
            // Of a clipped edge, only the dark side shows its profile. Two edges do not move with their blur, and
            // where their halves have parted, the profile of a gap would be taken for that of an edge.
            CROSS.. if p < HALO => K == 3 && !is_clipped,
            _ => true,
        };
        let members: Vec<Member<K>> = samples.into_iter().map(Member::from).collect();
        let greys = [blacks, whites].map(|greys| median(greys).unwrap_or(0.0));
        let (all, active) = (Vec::new(), Vec::new());
        let mut problem = Problem { fitter, image, members: Vec::new(), greys, all, active };
        let mut fitted = |known: &Self, members: Vec<Member<K>>, white: f64| {
            problem.all = (0..PARAMS).filter(|&p| is_active(known, p)).collect();
            problem.active.clone_from(&problem.all);
            problem.members = members.iter().map(|member| member.brighter(white)).collect();
            let range = [range[0], range[0] + white * (range[1] - range[0])];
            let (optics, at, found) = problem.chosen(Self { range, ..known.clone() }, is_clipped);
            (noise_of(&at.equations), (std::mem::take(&mut problem.members), optics, found))
        };
        let starts = if is_clipped { &CLIPPED_WHITES[..] } else { &[1.0] };
        let fits = starts.iter().map(|&white| fitted(&known, members.clone(), white));
        let Some((noise, mut best)) = fits.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            return known;
        };
        if is_clipped && known.is_ink_open && known.ink < 0.0 {
            let unmoved = Self { ink: 0.0, is_ink_open: false, ..known.clone() };
            let fits = OVEREXPOSED_WHITES.map(|[white, distance]| {
                let blurred = members.iter().map(|member| member.blurred(known.ink(), distance));
                fitted(&unmoved, blurred.collect(), white)
            });
            let unmoved = fits.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, fit)) = unmoved.filter(|fit| fit.0 <= MAX_OVEREXPOSED_NOISE * noise) {
                best = fit;
            }
        }
        let (members, optics, found) = best;
        problem.members = members;
        let influences = problem.influences(&optics);
        let inflation = correlation::inflation(&influences);
        let displaced = displaced_rows::limits(&influences, inflation);
        Self { tone: found.tone, ink_found: found.ink, inflation, displaced, ..optics }
    }

    /// Returns the tone curve between black and white, given the covariance of the active parameters; `None` if it was
    /// not estimated.
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
            let kappa_sd = slopes.dot(&(cov * &slopes)).max(0.0).sqrt();
            let mut tone = ToneEstimate::new(greys, kappa, kappa_sd);
            (tone.kappa_odd, tone.used) = (kappa_odd, used);
            tone
        })
    }
}

impl<const K: usize> Problem<'_, K> {
    /// Returns the optics with the groups of parameters that are significant, the equations there, and the estimates to
    /// report.
    fn chosen(&mut self, known: Optics, is_clipped: bool) -> (Optics, Linearised<K>, Reported) {
        let reported = |problem: &Self, optics: &Optics, cov: &DMatrix<f64>, used| Reported {
            tone: optics.tone_between(problem.greys, cov, &problem.active, used),
            ink: problem.ink(optics, cov, used),
        };
        let mut optics = known.clone();
        let mut at = self.linearised(known);
        let (mut used, mut found) = (Vec::new(), Reported::default());
        // The first step selects the groups to estimate. There, model errors scatter the gradients.
        // They do not exclude a group, but increase the reported standard deviation. A step from a
        // straight curve reveals little about effects that are weak compared with the curve. A step
        // from a Gaussian reveals little about motion. So all groups are tested once more.
        for is_first in [true, false] {
            self.active.clone_from(&self.all);
            let reduced = self.reduced(&at, &weights_of(&at.equations));
            let (step, scattered) = self.first_step(&at.optics, &reduced);
            let unused = reported(self, &at.optics.with(&step.vector), &scattered, false);
            let worth = match is_first {
                true => step.supported(WORTH_ESTIMATING),
                false => self.estimate(&at.optics, step.vector, &scattered).supported(1.0),
            };
            if worth.active == used {
                found = found.or(unused);
                break;
            }
            if !is_first {
                let start = self.stepped(&at, &reduced, &worth.vector);
                at = self.linearised(start);
            }
            self.active = worth.active;
            let settled = self.settled(at);
            used.clone_from(&self.active);
            found = reported(self, &settled.optics, &settled.cov, true).or(unused);
            (optics, at) = (settled.optics, settled.at);
        }
        // Symmetry cancels the effect of a wrong blur on a corner only if grey values are linear. Otherwise, a group that
        // is not significant may be zero, or as uncertain as it is: the mean of both.
        if used.contains(&0) && !is_clipped {
            self.active.clone_from(&self.all);
            let uncertain = self.shift(&at);
            optics.shift = [0, 1, 2].map(|i| (optics.shift[i] + uncertain[i]) / 2.0);
        }
        (optics, at, found)
    }
}

/// Estimates that are reported to the user.
#[derive(Default)]
struct Reported {
    tone: Option<ToneEstimate>,
    ink: Option<InkEstimate>,
}

impl Reported {
    /// Returns the estimates that are used, and those of `unused` for the rest.
    fn or(self, unused: Self) -> Self {
        Self {
            tone: self.tone.filter(|tone| tone.used).or(unused.tone),
            ink: self.ink.filter(|ink| ink.used).or(unused.ink),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec2;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use nalgebra::SVector;

    use super::*;
    use crate::refine::model::corner::{Corner, OWN};
    use crate::refine::model::fitter::{Accuracy, Fitted};
    use crate::refine::model::joint::Common;
    use crate::refine::model::window::{Patch, Window};
    use deltille_core::detection::Tone;
    use deltille_core::raster::Gray;

    /// Square of each corner, px; points of each pixel's side; blur, px.
    const SIDE: usize = 33;
    const FINE: usize = 6;
    const BLUR_PX: f64 = 0.8;
    const EDGE_PX: f64 = 40.0;
    const COUNT: usize = 5;

    /// Renders an image of corners seen from 55° in which ink has moved all sides, and returns the corners. Points in a
    /// dark sector, or nearer to one on the paper than the ink spread, are dark.
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
            // A point before a line lies behind the same line in the opposite direction.
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

    /// Applies a Gaussian blur to a fine square and returns the mean over each pixel.
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

    /// Returns the pixels around a corner.
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

    /// Checks all parameters, a corner's own and the common ones, under a halo, ink, motion and a curve.
    #[test]
    fn gradients_of_the_joint_equations_are_those_of_the_cost() {
        let (image, corners) = picture(0.004, |light| Tone::Srgb.grey(light));
        let plain = Optics { range: [0.1, 0.9], ..Optics::of(Tone::Auto).with_ink(None) };
        let still = plain.with(&[0.3, -0.2, 0.1, 0.3, -0.25, 0.1, 0.2, -0.1, -0.3, 0.5]);
        for optics in [Optics { is_motion: true, ..still.clone() }, still] {
            for corner in &corners[..4] {
                compare_gradients(&image, corner, &optics);
                compare_gradients(&image, &corner.with_edges::<2>(), &optics);
            }
        }
    }

    fn compare_gradients<const K: usize>(image: &Gray<f32>, corner: &Corner<K>, optics: &Optics) {
        /// Black and white of a corner, between which a piece of the curve is fixed.
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
    fn ink_is_distinguished_from_tone_and_does_not_move_corners() {
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
