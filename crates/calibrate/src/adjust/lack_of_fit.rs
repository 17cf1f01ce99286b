//! Patterns in the residuals that noise does not explain.
//!
//! ```text
//!   over the image    the mean residual of a cell, relative to its variation between views
//!   over the target   the displacement of a corner in space that explains its residuals in all
//!                     views best, relative to the remainder; the same for a whole panel
//! ```
//!
//! Both are analyses of variance: F is the sum of squares that a pattern explains, per unknown, over the remainder, per
//! degree of freedom. Cameras and poses have already absorbed a part of every pattern, so F is
//! underestimated. Outliers are excluded.

use std::collections::BTreeMap;

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::input::observation::Observation;
use crate::input::panel::PanelRef;
use crate::problem::bundle::Problem;
use crate::problem::whitening::Whitening;

/// Number of cells along the longer side of the image: a wrong polynomial leaves a few rings between the centre and the
/// rim, and a cell is well within one of them.
const CELLS: f64 = 16.0;

/// Normal deviate that is exceeded once in a thousand cases.
pub(crate) const SIGNIFICANT: f64 = 3.09;

/// Size of a pattern, relative to the remaining noise, above which it matters. Standard deviations
/// assume independent residuals, but a pattern is the same in all views and does not average out.
/// At half of the noise, it outweighs the noise in a parameter as soon as a few corners determine
/// that parameter.
pub(crate) const MATTERS: f64 = 0.5;

/// Minimum significance of the displacement of one of many panels. Noise exceeds it less than once
/// in a million cases.
const SIGNIFICANT_PANEL: f64 = 5.0;

/// Minimum number of panels for identifying a displaced one.
const MIN_PANELS: usize = 3;

/// Minimum sensitivity to a displacement of a corner, relative to the best direction; the
/// information is its square. Below it, all views were taken from the same side, and the direction
/// is not estimated.
const BLIND: f64 = 0.03;

/// Minimum number of views of a corner: each view has two coordinates, and the displacement has
/// three.
const MIN_VIEWS: usize = 3;

/// A pattern that noise does not explain, and that matters compared with the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LackOfFit {
    /// Residuals depend on the position in the image: the model does not fit the lens.
    Lens {
        /// Index of the camera.
        camera: usize,
        /// RMS of the pattern per axis, px.
        rms_px: f64,
    },
    /// Residuals depend on the position on the target: its corners are not where the description places them.
    Target {
        /// The panel with the strongest pattern.
        panel: PanelRef,
        /// RMS of the pattern per axis, px.
        rms_px: f64,
        /// RMS displacement of the corners in space, mm, without the part that poses and camera
        /// absorb.
        rms_mm: f64,
    },
}

/// A corner in a view, whitened.
struct Seen<'a> {
    block: usize,
    camera: usize,
    panel: PanelRef,
    corner: &'a Observation,
    cell: [i32; 2],
    residual: DVec2,
    /// Derivative of the residual with respect to the corner's position on the panel, 1/mm.
    by_place: [DVec3; 2],
}

/// A possible source of a pattern.
#[derive(Clone, Copy, PartialEq)]
enum Source {
    Lens(usize),
    Target,
    Panels,
}

/// The part of the residuals that a source explains.
#[derive(Default)]
struct Explained {
    /// Explained residuals by index of the corner.
    fitted: Vec<(usize, DVec2)>,
    /// Sums of squares: of all residuals, and of the means or displacements.
    all: f64,
    explained: f64,
    unknowns: f64,
    left: f64,
    freedom: f64,
    /// By panel: the explained sum of squares; and Σ|displacement|², Σ of its variances in units of that of the
    /// residuals, and the number of corners.
    by_panel: BTreeMap<PanelRef, f64>,
    moves: [f64; 3],
}

/// Finds the patterns in a problem's residuals, the strongest first. Each is subtracted before the
/// search for weaker ones, because corners of the board and positions in the image coincide if all
/// views are similar.
pub(crate) fn lack_of_fit(problem: &Problem, whitening: &Whitening) -> Vec<LackOfFit> {
    let (mut seen, px) = seen(problem, whitening);
    let mut open: Vec<Source> = (0..problem.cameras.len()).map(Source::Lens).collect();
    open.extend([Source::Target, Source::Panels]);
    let mut found = Vec::new();
    loop {
        let patterns = open.iter().enumerate().filter_map(|(index, &source)| {
            let explained = match source {
                Source::Lens(camera) => over_image(&seen, camera),
                Source::Target => over_target(&seen),
                Source::Panels => over_panels(&seen),
            };
            let part = explained.pattern()?;
            Some((index, part, explained))
        });
        let strongest = patterns.max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((index, part, explained)) = strongest else { return found };
        let rms_px = px * (part * explained.all / (2 * explained.fitted.len()) as f64).sqrt();
        let source = open.remove(index);
        if !matches!(source, Source::Lens(_)) {
            // Displaced panels imply displaced corners.
            open.retain(|other| matches!(other, Source::Lens(_)));
        }
        found.push(match source {
            Source::Lens(camera) => LackOfFit::Lens { camera, rms_px },
            Source::Target | Source::Panels => {
                let most = explained.by_panel.iter().max_by(|a, b| a.1.total_cmp(b.1));
                LackOfFit::Target {
                    panel: most.map_or(PanelRef::ONLY, |(&panel, _)| panel),
                    rms_px,
                    rms_mm: explained.rms_mm(),
                }
            }
        });
        for (index, fitted) in explained.fitted {
            seen[index].residual -= fitted;
        }
    }
}

/// The corners that are not outliers, and the size of a whitened coordinate, px.
fn seen<'a>(problem: &'a Problem, whitening: &Whitening) -> (Vec<Seen<'a>>, f64) {
    let mut all = Vec::with_capacity(problem.count());
    let (mut px, mut white) = (0.0, 0.0);
    for (index, (block, weights)) in problem.blocks.iter().zip(&whitening.blocks).enumerate() {
        let unknowns = &problem.cameras[block.camera];
        let camera = &unknowns.camera;
        let cell_px = f64::from(camera.width.max(camera.height)) / CELLS;
        let camera_from_panel = unknowns.camera_from_rig.rotation
            * problem.frames[block.frame].rotation
            * problem.scene_from_panel(block.panel).rotation;
        let panel_from_camera = DMat3::from_quat(camera_from_panel.conjugate());
        let corners = block.observations.iter().zip(problem.camera_points(block));
        for ((corner, point), &w) in corners.zip(weights) {
            let Some(at) = camera.project_with_derivatives(point) else { continue };
            let residual = corner.pixel - at.pixel;
            if whitening.is_outlier(w, residual) {
                continue;
            }
            let [x, y] = at.by_point.map(|row| panel_from_camera * DVec3::from(row));
            let [a, b, c] = w;
            let whitened = Whitening::apply(w, residual);
            px += residual.length_squared();
            white += whitened.length_squared();
            all.push(Seen {
                block: index,
                camera: block.camera,
                panel: block.panel,
                corner,
                cell: (corner.pixel / cell_px).floor().as_ivec2().to_array(),
                residual: whitened,
                by_place: [a * x, b * x + c * y],
            });
        }
    }
    let px = if white > 0.0 { (px / white).sqrt() } else { 0.0 };
    (all, px)
}

/// Means over the cells of an image. Corners of one view in one cell share the errors of that view, so the mean of a
/// view counts as one observation.
fn over_image(seen: &[Seen], camera: usize) -> Explained {
    let mut cells: BTreeMap<[i32; 2], BTreeMap<usize, Vec<usize>>> = BTreeMap::new();
    for (index, corner) in seen.iter().enumerate().filter(|(_, c)| c.camera == camera) {
        cells.entry(corner.cell).or_default().entry(corner.block).or_default().push(index);
    }
    let mut found = Explained::default();
    let mean_of = |corners: &mut dyn Iterator<Item = usize>| {
        let (mut sum, mut count) = (DVec2::ZERO, 0.0);
        for index in corners {
            sum += seen[index].residual;
            count += 1.0;
        }
        (sum / count, count)
    };
    for views in cells.values().filter(|views| views.len() > 1) {
        let (mean, count) = mean_of(&mut views.values().flatten().copied());
        found.explained += count * mean.length_squared();
        found.unknowns += 2.0;
        found.freedom += 2.0 * (views.len() - 1) as f64;
        for corners in views.values() {
            let (of_view, count) = mean_of(&mut corners.iter().copied());
            found.left += count * of_view.distance_squared(mean);
            for &index in corners {
                found.all += seen[index].residual.length_squared();
                found.fitted.push((index, mean));
            }
        }
    }
    found
}

/// Displacements of corners in space.
fn over_target(seen: &[Seen]) -> Explained {
    let mut corners: BTreeMap<(PanelRef, [i32; 2]), Vec<usize>> = BTreeMap::new();
    for (index, corner) in seen.iter().enumerate() {
        let label = [corner.corner.row, corner.corner.col];
        corners.entry((corner.panel, label)).or_default().push(index);
    }
    let mut found = Explained::default();
    for ((panel, _), views) in corners.iter().filter(|(_, views)| views.len() >= MIN_VIEWS) {
        let row = |by: DVec3, _: &Seen| by.to_array();
        let of_corner = best_move(seen, views, row);
        let [x, y, z] = of_corner.by;
        let moved = DVec3::new(x, y, z);
        found.add(*panel, seen, views, &of_corner, |_| moved);
        let [squares, noise, count] = &mut found.moves;
        *squares += moved.length_squared();
        *noise += of_corner.variances.iter().sum::<f64>();
        *count += 1.0;
    }
    found
}

/// Displacements of panels as a whole; only panels with a significant displacement count.
fn over_panels(seen: &[Seen]) -> Explained {
    let mut panels: BTreeMap<PanelRef, Vec<usize>> = BTreeMap::new();
    for (index, corner) in seen.iter().enumerate() {
        panels.entry(corner.panel).or_default().push(index);
    }
    let mut found = Explained::default();
    // With two panels, it is unknown which one is wrong. A single panel has no reference.
    if panels.len() < MIN_PANELS {
        return found;
    }
    for (&panel, views) in &panels {
        let places = || views.iter().map(|&index| seen[index].corner.panel_mm);
        let middle = places().sum::<DVec3>() / views.len() as f64;
        let reach = places().map(|at| at.distance(middle)).fold(f64::MIN_POSITIVE, f64::max);
        // Expresses rotations as lengths at the rim, so that all unknowns have the same unit.
        let arm = |seen: &Seen| (seen.corner.panel_mm - middle) / reach;
        let row = |by: DVec3, seen: &Seen| {
            let turn = arm(seen).cross(by);
            [by.x, by.y, by.z, turn.x, turn.y, turn.z]
        };
        let of_panel = best_move(seen, views, row);
        let [x, y, z, u, v, w] = of_panel.by;
        let [shift, turn] = [DVec3::new(x, y, z), DVec3::new(u, v, w)];
        let moved = |seen: &Seen| shift + turn.cross(arm(seen));
        let mut single = Explained::default();
        single.add(panel, seen, views, &of_panel, moved);
        if single.deviate() > SIGNIFICANT_PANEL && single.pattern().is_some() {
            found.add(panel, seen, views, &of_panel, moved);
            let [squares, noise, count] = &mut found.moves;
            *squares += views.iter().map(|&i| moved(&seen[i]).length_squared()).sum::<f64>();
            *noise += views.len() as f64 * of_panel.variances[..3].iter().sum::<f64>();
            *count += views.len() as f64;
        }
    }
    found
}

/// The displacement that explains the residuals of some corners best.
struct Move<const N: usize> {
    by: [f64; N],
    /// In units of the variance of a residual.
    variances: [f64; N],
    explained: f64,
    unknowns: f64,
}

/// Least-squares fit to the residuals of some corners, one row per coordinate; poorly observed directions are omitted.
fn best_move<const N: usize>(
    seen: &[Seen],
    corners: &[usize],
    row: impl Fn(DVec3, &Seen) -> [f64; N],
) -> Move<N> {
    let (mut normal, mut right) = (DMatrix::zeros(N, N), DVector::zeros(N));
    for corner in corners.iter().map(|&index| &seen[index]) {
        for (&by, residual) in corner.by_place.iter().zip(corner.residual.to_array()) {
            let by = DVector::from_row_slice(&row(by, corner));
            right.axpy(residual, &by, 1.0);
            normal.ger(1.0, &by, &by, 1.0);
        }
    }
    let eigen = SymmetricEigen::new(normal);
    let most = eigen.eigenvalues.max();
    let mut found = Move { by: [0.0; N], variances: [0.0; N], explained: 0.0, unknowns: 0.0 };
    for (&value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if value > BLIND * BLIND * most {
            let along = direction.dot(&right);
            for (i, part) in direction.iter().enumerate() {
                found.by[i] += part * along / value;
                found.variances[i] += part * part / value;
            }
            found.explained += along * along / value;
            found.unknowns += 1.0;
        }
    }
    found
}

impl Explained {
    /// Adds the residuals that a displacement explains for some corners of a panel.
    fn add<const N: usize>(
        &mut self,
        panel: PanelRef,
        seen: &[Seen],
        corners: &[usize],
        found: &Move<N>,
        moved: impl Fn(&Seen) -> DVec3,
    ) {
        let all: f64 = corners.iter().map(|&index| seen[index].residual.length_squared()).sum();
        self.all += all;
        self.explained += found.explained;
        self.unknowns += found.unknowns;
        self.left += all - found.explained;
        self.freedom += (2 * corners.len()) as f64 - found.unknowns;
        *self.by_panel.entry(panel).or_default() += found.explained - found.unknowns;
        let fitted = |&index: &usize| {
            let corner = &seen[index];
            (index, DVec2::from(corner.by_place.map(|by| by.dot(moved(corner)))))
        };
        self.fitted.extend(corners.iter().map(fitted));
    }

    /// The significance of the pattern as a normal deviate.
    fn deviate(&self) -> f64 {
        let f_ratio = self.explained / self.unknowns / (self.left / self.freedom);
        deviate_of_f(f_ratio, self.unknowns, self.freedom)
    }

    /// The fraction of all squares that the pattern explains, if it is significant and matters.
    fn pattern(&self) -> Option<f64> {
        let noise = self.left / self.freedom;
        let pattern = self.explained - self.unknowns * noise;
        let is_confirmed = self.deviate() > SIGNIFICANT;
        let matters = pattern > MATTERS * MATTERS * (self.all - pattern);
        (is_confirmed && matters).then_some(pattern / self.all)
    }

    fn rms_mm(&self) -> f64 {
        let [squares, noise, count] = self.moves;
        let noise = noise * self.left / self.freedom;
        ((squares - noise).max(0.0) / count).sqrt()
    }
}

/// The normal deviate with the same probability as a value of the F distribution, from Paulson's
/// cube-root approximation; NaN without degrees of freedom.
pub(crate) fn deviate_of_f(f_ratio: f64, unknowns: f64, freedom: f64) -> f64 {
    let (a, b) = (2.0 / (9.0 * unknowns), 2.0 / (9.0 * freedom));
    let root = f_ratio.cbrt();
    ((1.0 - b) * root - (1.0 - a)) / (b * root * root + a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values from tables of the F distribution, probability 0.001.
    #[test]
    fn one_in_a_thousand_is_three_standard_deviations() {
        for (unknowns, freedom, f_ratio) in
            [(10.0, 10.0, 8.754), (10.0, 60.0, 3.54), (60.0, 120.0, 1.95)]
        {
            let z = deviate_of_f(f_ratio, unknowns, freedom);
            assert!((z - 3.09).abs() < 0.06, "{unknowns} {freedom}: {z}");
        }
        assert!(deviate_of_f(f64::NAN, 0.0, 0.0).is_nan());
    }
}
