//! Finds a corner as the intersection of its edges, without its immediate surroundings.
//!
//! A speck, a sharpening halo, the edge of a shadow or motion with ringing changes the pixels of a corner so that they
//! no longer show a saddle or a blurred corner. The edges from it to its neighbours are still visible. The
//! prediction gives their courses. Across each, the position of the largest step is measured at several stations.
//! Lines through these positions meet in the corner.
//!
//! ```text
//!            │░░░░░
//!      ██████│┼ ┼ ┼      ┼ stations, from END to FAR of the edge on either side of the corner;
//!      ─┼─┼─┼ ? ┼─┼─┼─   the corner itself is not read
//!      ░ ┼ ┼ ┼│██████
//!      ░░░░░░░│██████
//! ```

use std::collections::BTreeSet;

use glam::DVec2;
use nalgebra::{DMatrix, DVector};

use crate::grid::links::edge::MAX_CHORD_RAD;
use crate::grid::links::link::MAX_CONTRAST_RATIO;
use crate::tiling::CHECKER;
use deltille_core::raster::ImageView;
use deltille_core::statistics::median;

/// Fraction of an edge, next to the corner, that is not read: an occlusion of the corner is seldom
/// larger, and blur mixes the sectors there.
const END: f64 = 0.15;

/// Fraction of an edge at which the stations end. The other half belongs to the neighbour.
const FAR: f64 = 0.55;

/// Number of stations of an edge.
const STATIONS: usize = 8;

/// Number of stations of an edge at which it must be visible.
const MIN_STATIONS: usize = 6;

/// Distance of the samples on either side of the edge, as a fraction of the height of its tiles: within the border of
/// a tag, like the samples that join corners.
const SIDE: f64 = 0.08;

/// Minimum of that distance, px: a step is blurred over this much.
const MIN_SIDE_PX: f64 = 2.0;

/// Distance of the samples from each other, px.
const SAMPLE_PX: f64 = 0.5;

/// Largest distance of the edge from its predicted course, as a fraction of the height of its tiles. Tags begin at
/// 0.16.
const MAX_OFF: f64 = 0.1;

/// Minimum of that distance, px.
const MIN_OFF_PX: f64 = 1.5;

/// Largest standard deviation of the steps from their line, as a fraction of the height of a tile. The outline of a round
/// dot deviates more, so gaps between dots are not corners.
const MAX_SCATTER: f64 = 0.03;

/// The same, px: the steps of a noisy or blurred edge scatter by this much in tiles of any size.
const SCATTER_PX: f64 = 0.7;

/// Minimum standard deviation of a step, px: that of interpolated pixels.
const MIN_SIGMA_PX: f64 = 0.1;

/// A corner in which edges meet.
#[derive(Clone, Debug)]
pub(crate) struct EdgeCrossing {
    /// Its position, px.
    pub(crate) position: DVec2,
    /// Covariance xx, xy, yy of the position, px².
    pub(crate) cov: [f64; 3],
    /// Image angles of the edges, radians, in the order of the neighbours.
    pub(crate) rays: Vec<f64>,
    /// Whether the tile to the left of the first edge, seen from the corner on the print, is dark.
    pub(crate) is_dark_left: bool,
    /// Brightness half-way between dark and bright, in units of the image.
    pub(crate) level: f64,
    /// Half the contrast.
    pub(crate) amplitude: f64,
}

/// A neighbour of a corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Neighbour {
    /// Its displacement from the corner, px.
    pub(crate) way: DVec2,
    /// Whether it is a known corner. Otherwise its position is predicted, and the edge there may have another direction.
    pub(crate) is_seen: bool,
}

/// The predicted course of an edge: a parabola through the corner and two opposite neighbours.
#[derive(Clone, Copy, Debug)]
struct Course {
    chord: DVec2,
    bend: DVec2,
    /// How far the edge may be from its course, px: at the corner, and in addition at the neighbour.
    reach_px: [f64; 2],
    /// Distance of the neighbours beside the edge from it, px.
    across_px: f64,
}

impl Course {
    fn at(&self, t: f64) -> DVec2 {
        t * self.chord + t * t * self.bend
    }

    /// Returns the unit vector to the left of the edge on the print, for either end.
    fn left(&self, t: f64) -> DVec2 {
        -(self.chord + 2.0 * t * self.bend).normalize_or_zero().perp()
    }
}

/// A step of brightness across an edge.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Line from the corner to which it belongs; both halves of an edge may lie on the same line.
    line: usize,
    /// Position along the line, in edges; negative on the opposite side of the corner.
    along: f64,
    /// Unit vector across the line, and the distance of the step from the predicted course in that direction, px.
    across: DVec2,
    off_px: f64,
}

impl EdgeCrossing {
    /// Returns the corner near `place`, px, with these neighbours in counter-clockwise order on the print. All its edges
    /// must be visible, with dark and bright tiles in turn.
    pub(crate) fn find(image: ImageView, place: DVec2, neighbours: &[Neighbour]) -> Option<Self> {
        if neighbours.len() != CHECKER {
            // Six edges leave sectors of 60°. Between the faces of a net, edges of other tiles imitate them.
            return None;
        }
        let half = neighbours.len() / 2;
        let courses: Vec<Course> = (0..neighbours.len()).map(|k| course(neighbours, k)).collect();
        let size_px = (image.width() + image.height()) as f64;
        if !neighbours.iter().all(|neighbour| neighbour.way.length() < size_px) {
            return None;
        }
        let profiles: Vec<Vec<Profile>> = courses
            .iter()
            .map(|course| {
                let at = |station| {
                    let t = END + (FAR - END) * (f64::from(station) + 0.5) / STATIONS as f64;
                    Profile::read(image, place + course.at(t), t, course)
                };
                (0..STATIONS as u32).filter_map(at).collect()
            })
            .collect();
        // Tiles to the left are dark in turn, beginning with the first or the second edge.
        let signs = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let middle = profiles
            .iter()
            .enumerate()
            .map(|(k, edge)| signs(k) * edge.iter().map(Profile::step_in_the_middle).sum::<f64>());
        let first = if middle.sum::<f64>() > 0.0 { 1.0 } else { -1.0 };
        let found: Vec<Vec<(&Profile, Peak)>> = profiles
            .iter()
            .enumerate()
            .map(|(k, edge)| {
                let peak = |profile| Some((profile, Profile::peak(profile, first * signs(k))?));
                edge.iter().filter_map(peak).collect()
            })
            .collect();
        let all = || found.iter().flatten();
        let usual = median(all().map(|(_, peak)| peak.step).collect())?;
        // Where only one half of an edge ends at a known corner, the other half may be bent.
        let line = |k: usize| {
            let [first, second] = [k % half, k % half + half].map(|k| neighbours[k].is_seen);
            if first == second { k % half } else { k }
        };
        let mut steps = Vec::new();
        for (k, edge) in found.iter().enumerate() {
            let is_visible = |peak: &Peak| MAX_CONTRAST_RATIO * peak.step >= usual;
            let visible: Vec<_> = edge.iter().filter(|(_, peak)| is_visible(peak)).collect();
            if visible.len() < MIN_STATIONS {
                return None;
            }
            let side = if k < half { 1.0 } else { -1.0 };
            steps.extend(visible.into_iter().map(|(profile, peak)| Step {
                line: line(k),
                along: side * profile.t,
                across: side * profile.left,
                off_px: side * peak.off_px,
            }));
        }
        let across_px = courses.iter().map(|c| c.across_px).fold(f64::INFINITY, f64::min);
        let Lines { off, turns, cov } = Lines::through(&steps, neighbours.len(), across_px)?;
        // Bent edges without known ends may meet anywhere.
        let most_px = courses.iter().map(|c| c.reach_px[0]).fold(0.0, f64::max);
        if off.length() > most_px {
            return None;
        }
        let level = median(all().map(|(_, peak)| peak.level).collect())?;
        let rays = courses
            .iter()
            .enumerate()
            .map(|(k, course)| (course.chord + turns[line(k)] * course.left(0.0)).to_angle());
        Some(Self {
            position: place + off,
            cov,
            rays: rays.collect(),
            is_dark_left: first > 0.0,
            level,
            amplitude: usual / 2.0,
        })
    }
}

/// Returns the course of the edge to neighbour `k`.
fn course(neighbours: &[Neighbour], k: usize) -> Course {
    let n = neighbours.len();
    let way = |by: usize| neighbours[(k + by) % n].way;
    let (there, opposite) = (way(0), way(n / 2));
    let along = (there - opposite).normalize_or_zero();
    let beside = [1, n - 1, n / 2 + 1, n / 2 - 1].map(|by| along.perp_dot(way(by)).abs());
    let across_px = beside.into_iter().sum::<f64>() / 4.0;
    let turned_px = if neighbours[k].is_seen { 0.0 } else { MAX_CHORD_RAD.tan() * there.length() };
    Course {
        chord: (there - opposite) / 2.0,
        bend: (there + opposite) / 2.0,
        reach_px: [(MAX_OFF * across_px).max(MIN_OFF_PX), turned_px],
        across_px,
    }
}

/// Brightness along a line across an edge.
struct Profile {
    /// Position along the edge, in edges.
    t: f64,
    /// Unit vector to the left.
    left: DVec2,
    /// Brightness from right to left, every [`SAMPLE_PX`].
    values: Vec<f64>,
    /// Number of samples on either side of a step.
    side: usize,
}

/// The largest step of a profile.
#[derive(Clone, Copy, Debug)]
struct Peak {
    /// Bright minus dark.
    step: f64,
    level: f64,
    /// Distance from the predicted course, to the left, px.
    off_px: f64,
}

impl Profile {
    fn read(image: ImageView, middle: DVec2, t: f64, course: &Course) -> Option<Self> {
        let left = course.left(t);
        let side = ((SIDE * course.across_px).max(MIN_SIDE_PX) / SAMPLE_PX).round() as usize;
        let reach_px = course.reach_px[0] + t * course.reach_px[1];
        let half = (reach_px / SAMPLE_PX).ceil() as usize + side;
        let size = DVec2::new(image.width() as f64, image.height() as f64) - 1.0;
        let value = |i: usize| {
            let at = middle + SAMPLE_PX * (i as f64 - half as f64) * left;
            let inside = at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all();
            inside.then(|| image.bilinear_inside(at.x, at.y))
        };
        let values: Option<Vec<f64>> = (0..=2 * half).map(value).collect();
        Some(Self { t, left, values: values?, side })
    }

    /// Returns the mean to the right of a sample and to its left.
    fn sides(&self, i: usize) -> [f64; 2] {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        [mean(&self.values[i - self.side..i]), mean(&self.values[i + 1..=i + self.side])]
    }

    /// Returns how much brighter the right is than the left on the predicted course.
    fn step_in_the_middle(&self) -> f64 {
        let [right, left] = self.sides(self.values.len() / 2);
        right - left
    }

    /// Returns the largest step from dark on the left to bright on the right, for a sign of 1, unless it lies at the end.
    fn peak(&self, sign: f64) -> Option<Peak> {
        let steps: Vec<f64> = (self.side..self.values.len() - self.side)
            .map(|i| {
                let [right, left] = self.sides(i);
                sign * (right - left)
            })
            .collect();
        let best = (0..steps.len()).max_by(|&a, &b| steps[a].total_cmp(&steps[b]))?;
        let (&before, &after) = (steps.get(best.checked_sub(1)?)?, steps.get(best + 1)?);
        let curvature = 2.0 * steps[best] - before - after;
        let beside = if curvature > 0.0 { (after - before) / (2.0 * curvature) } else { 0.0 };
        let [right, left] = self.sides(best + self.side);
        Some(Peak {
            step: steps[best],
            level: (right + left) / 2.0,
            off_px: SAMPLE_PX * (best as f64 + beside - (steps.len() / 2) as f64),
        })
    }
}

/// Straight lines through steps that meet in a position.
struct Lines {
    /// Displacement of this position, px.
    off: DVec2,
    /// Displacement of each line per edge, px.
    turns: Vec<f64>,
    /// Covariance xx, xy, yy of the position, px².
    cov: [f64; 3],
}

impl Lines {
    /// Fits the lines, with less weight for steps far from them; `None` if they scatter more than those of an edge.
    fn through(steps: &[Step], lines: usize, across_px: f64) -> Option<Self> {
        /// Steps that lie off the lines have little weight after this many iterations.
        const ITERATIONS: usize = 4;
        let unknowns = 2 + lines;
        let used = 2 + steps.iter().map(|step| step.line).collect::<BTreeSet<_>>().len();
        let row = |step: &Step| {
            let mut row = DVector::zeros(unknowns);
            (row[0], row[1], row[2 + step.line]) = (step.across.x, step.across.y, step.along);
            row
        };
        let mut weights = vec![1.0; steps.len()];
        let mut fitted = None;
        for _ in 0..ITERATIONS {
            // Lines without steps are no unknowns: the prior is a billionth of a step.
            let mut normal = 1e-9 * DMatrix::<f64>::identity(unknowns, unknowns);
            let mut right = DVector::zeros(unknowns);
            for (step, weight) in steps.iter().zip(&weights) {
                let row = row(step);
                normal += *weight * &row * row.transpose();
                right += *weight * step.off_px * row;
            }
            let inverse = normal.cholesky()?.inverse();
            let solution = &inverse * right;
            let rests: Vec<f64> =
                steps.iter().map(|step| step.off_px - row(step).dot(&solution)).collect();
            let sum = rests.iter().zip(&weights).map(|(rest, weight)| weight * rest * rest);
            let freedom = weights.iter().sum::<f64>() - used as f64;
            let sigma = (sum.sum::<f64>() / freedom.max(1.0)).sqrt().max(MIN_SIGMA_PX);
            weights = rests.iter().map(|rest| 1.0 / (1.0 + (rest / sigma).powi(2))).collect();
            fitted = Some((solution, inverse, sigma));
        }
        let (solution, inverse, sigma) = fitted?;
        if sigma > (MAX_SCATTER * across_px).max(SCATTER_PX) {
            return None;
        }
        // What displaces a step displaces those beside it: each half of an edge counts as one.
        let variance = STATIONS as f64 * sigma * sigma;
        let cov = [(0, 0), (0, 1), (1, 1)].map(|at| variance * inverse[at]);
        let turns = (0..lines).map(|line| solution[2 + line]).collect();
        Some(Self { off: DVec2::new(solution[0], solution[1]), turns, cov })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use deltille_core::raster::Gray;

    const EDGE_PX: f64 = 30.0;

    /// Renders a corner of a checkerboard at `place`, turned by 0.2 rad, with something on top of it.
    fn seen(place: DVec2, on_top: impl Fn(DVec2) -> Option<f64>) -> Gray<f32> {
        Gray::from_fn(101, 101, |x, y| {
            let value = |dx: f64, dy: f64| {
                let off = DVec2::new(x as f64 + dx, y as f64 + dy) - place;
                let on_print = DVec2::from_angle(-0.2).rotate(off);
                let tile = if on_print.x * on_print.y > 0.0 { 0.1 } else { 0.8 };
                on_top(off).unwrap_or(tile)
            };
            let parts = [-0.375, -0.125, 0.125, 0.375];
            let sum: f64 = parts.iter().flat_map(|dx| parts.map(|dy| value(*dx, dy))).sum();
            (sum / 16.0) as f32
        })
    }

    /// Returns neighbours of which one is not known.
    fn neighbours(turned: f64) -> [Neighbour; 4] {
        [0u8, 1, 2, 3].map(|k| Neighbour {
            way: EDGE_PX * DVec2::from_angle(turned - f64::from(k) * FRAC_PI_2),
            is_seen: k > 0,
        })
    }

    fn found(image: &Gray<f32>, near: DVec2) -> Option<EdgeCrossing> {
        EdgeCrossing::find(image.into(), near, &neighbours(0.24))
    }

    #[test]
    fn edges_meet_under_a_speck() {
        let place = DVec2::new(50.3, 49.8);
        for grey in [0.0, 0.45, 1.0] {
            let image = seen(place, |off| (off.length() < 4.0).then_some(grey));
            let met = found(&image, place + DVec2::new(0.7, -0.9)).unwrap();
            assert!(met.position.distance(place) < 0.2, "{met:?}");
            assert!((met.level - 0.45).abs() < 0.05 && (met.amplitude - 0.35).abs() < 0.05);
            assert!(met.rays.iter().all(|ray| (4.0 * (ray - 0.2)).sin().abs() < 0.05), "{met:?}");
        }
    }

    #[test]
    fn covered_edges_do_not_meet() {
        let place = DVec2::new(50.3, 49.8);
        for grey in [0.0, 0.45, 1.0] {
            let image = seen(place, |off| (off.x > 1.0).then_some(grey));
            assert!(found(&image, place).is_none(), "{grey}");
        }
    }

    #[test]
    fn dots_that_do_not_meet_are_not_corners() {
        let image = Gray::from_fn(101, 101, |x, y| {
            let off = DVec2::new(x as f64, y as f64) - DVec2::splat(50.0);
            let middles = [DVec2::splat(0.5), DVec2::splat(-0.5)];
            let is_dot = middles.iter().any(|m| off.distance(EDGE_PX * *m) < 0.48 * EDGE_PX);
            if is_dot { 0.1f32 } else { 0.8 }
        });
        let found = EdgeCrossing::find((&image).into(), DVec2::splat(50.0), &neighbours(0.0));
        assert!(found.is_none(), "{found:?}");
    }
}
