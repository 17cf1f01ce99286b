//! Patterns in the residuals that noise does not make.
//!
//! ```text
//!   over the image    the mean residual of a cell, against how it differs between views
//!   over the target   the move of a corner in space that explains its residuals in all views best,
//!                     against what is left; the same of a panel as a whole
//! ```
//!
//! Both are analyses of variance: what a pattern explains, for each of its unknowns, over what is left,
//! for each of its degrees of freedom, is F. Cameras and poses have taken up their part of every pattern
//! before, so that F is rather too small than too large. Outliers take no part.

use std::collections::BTreeMap;

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::input::panel::PanelRef;
use crate::problem::bundle::Problem;
use crate::problem::whitening::Whitening;

/// Cells of the image along its longer side: the rings that a wrong polynomial leaves between the
/// middle and the rim are a few, and a cell is well within one of them.
const CELLS: f64 = 16.0;

/// A normal deviate is larger once in a thousand times.
pub(crate) const SIGNIFICANT: f64 = 3.09;

/// A pattern matters from this part of the remaining noise on. Deviations take every residual for
/// independent; a pattern is the same in all views, so that it does not average out, and with half of the
/// noise it outweighs what the noise leaves of a parameter as soon as a few corners bear on it.
pub(crate) const MATTERS: f64 = 0.5;

/// Of many panels one must be displaced by more: of a million hardly one is by chance.
const SIGNIFICANT_PANEL: f64 = 5.0;

/// Fewest panels of which one can be displaced against the others.
const LEAST_PANELS: usize = 3;

/// A direction in which views move a corner by less than this part of what they do in the best one is
/// not sought: its information is the square. All views came from the same side then.
const BLIND: f64 = 0.03;

/// Fewest views of a corner: two coordinates each, and its move has three.
const LEAST_VIEWS: usize = 3;

/// A pattern that noise does not make, and that matters beside the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LackOfFit {
    /// Residuals depend on the place in the image: the lens is not what the model says.
    Lens {
        /// Index of the camera.
        camera: usize,
        /// Root mean square of the pattern, px a coordinate.
        rms_px: f64,
    },
    /// Residuals depend on the place on the target: its corners are not where they are said to be.
    Target {
        /// The panel that shows it most.
        panel: PanelRef,
        /// Root mean square of the pattern, px a coordinate.
        rms_px: f64,
        /// The same of what moves the corners in space, mm. What poses and camera take up is not in it.
        rms_mm: f64,
    },
}

/// A corner in a view; whitened.
struct Seen {
    block: usize,
    camera: usize,
    panel: PanelRef,
    cell: [i32; 2],
    label: [i32; 2],
    place_mm: DVec3,
    residual: DVec2,
    /// The residual by the corner's place on the panel, 1/mm.
    by_place: [DVec3; 2],
}

/// What can leave a pattern.
#[derive(Clone, Copy, PartialEq)]
enum Source {
    Lens(usize),
    Target,
    Panels,
}

/// What a source explains of the residuals.
#[derive(Default)]
struct Explained {
    /// By index of the corner.
    fitted: Vec<(usize, DVec2)>,
    /// Sums of squares: of all, and of the means or moves.
    all: f64,
    explained: f64,
    unknowns: f64,
    left: f64,
    freedom: f64,
    /// By panel: what is explained; and Σ|move|², Σ of its variances by that of the residuals, corners.
    by_panel: BTreeMap<PanelRef, f64>,
    moves: [f64; 3],
}

/// The patterns of a problem's residuals, the strongest first. Each is taken out before weaker ones are
/// looked for: corners of the board and places in the image go together where all views are alike.
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
            // Where panels are displaced their corners are.
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

/// The corners that are no outliers, and how many px a whitened coordinate is worth.
fn seen(problem: &Problem, whitening: &Whitening) -> (Vec<Seen>, f64) {
    let mut all = Vec::new();
    let (mut px, mut white) = (0.0, 0.0);
    for (index, (block, weights)) in problem.blocks.iter().zip(&whitening.blocks).enumerate() {
        let unknowns = &problem.cameras[block.camera];
        let camera = &unknowns.camera;
        let cell_px = f64::from(camera.width.max(camera.height)) / CELLS;
        let camera_from_panel = unknowns.camera_from_rig.rotation
            * problem.frames[block.frame].rotation
            * problem.scene_from_panel(block.panel).rotation;
        let panel_from_camera = DMat3::from_quat(camera_from_panel.conjugate());
        for (corner, &w) in block.observations.iter().zip(weights) {
            let at = camera.project_with_derivatives(problem.camera_point(block, corner));
            let Some(at) = at else { continue };
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
                cell: (corner.pixel / cell_px).floor().as_ivec2().to_array(),
                label: [corner.row, corner.col],
                place_mm: corner.panel_mm,
                residual: whitened,
                by_place: [a * x, b * x + c * y],
            });
        }
    }
    let px = if white > 0.0 { (px / white).sqrt() } else { 0.0 };
    (all, px)
}

/// Means of cells. Corners of one view in one cell share what is wrong with that view, so that a
/// view's mean counts as one.
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

/// Moves of corners in space.
fn over_target(seen: &[Seen]) -> Explained {
    let mut corners: BTreeMap<(PanelRef, [i32; 2]), Vec<usize>> = BTreeMap::new();
    for (index, corner) in seen.iter().enumerate() {
        corners.entry((corner.panel, corner.label)).or_default().push(index);
    }
    let mut found = Explained::default();
    for ((panel, _), views) in corners.iter().filter(|(_, views)| views.len() >= LEAST_VIEWS) {
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

/// Moves of panels as a whole, of those alone that show one.
fn over_panels(seen: &[Seen]) -> Explained {
    let mut panels: BTreeMap<PanelRef, Vec<usize>> = BTreeMap::new();
    for (index, corner) in seen.iter().enumerate() {
        panels.entry(corner.panel).or_default().push(index);
    }
    let mut found = Explained::default();
    // Of two nothing tells which is wrong, and of one there is nothing that it could be wrong to.
    if panels.len() < LEAST_PANELS {
        return found;
    }
    for (&panel, views) in &panels {
        let places = || views.iter().map(|&index| seen[index].place_mm);
        let middle = places().sum::<DVec3>() / views.len() as f64;
        let reach = places().map(|at| at.distance(middle)).fold(f64::MIN_POSITIVE, f64::max);
        // Turns in lengths at the rim, so that all unknowns are alike.
        let arm = |seen: &Seen| (seen.place_mm - middle) / reach;
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

/// What explains the residuals of some corners best.
struct Move<const N: usize> {
    by: [f64; N],
    /// By the variance of a residual.
    variances: [f64; N],
    explained: f64,
    unknowns: f64,
}

/// Least squares of some corners' residuals, of which each coordinate has a row; what views hardly see is not sought.
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
    /// Adds what a move explains of some corners of a panel.
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

    /// How rare it is that chance makes as much of a pattern, as a normal deviate.
    fn deviate(&self) -> f64 {
        let f_ratio = self.explained / self.unknowns / (self.left / self.freedom);
        deviate_of_f(f_ratio, self.unknowns, self.freedom)
    }

    /// The part of all squares that the pattern makes, where that is more than chance and matters.
    fn pattern(&self) -> Option<f64> {
        let noise = self.left / self.freedom;
        let pattern = self.explained - self.unknowns * noise;
        let is_sure = self.deviate() > SIGNIFICANT;
        let matters = pattern > MATTERS * MATTERS * (self.all - pattern);
        (is_sure && matters).then_some(pattern / self.all)
    }

    fn rms_mm(&self) -> f64 {
        let [squares, noise, count] = self.moves;
        let noise = noise * self.left / self.freedom;
        ((squares - noise).max(0.0) / count).sqrt()
    }
}

/// The normal deviate as rare as a value of the F distribution, by Paulson's cube roots; no
/// number where there is no freedom.
pub(crate) fn deviate_of_f(f_ratio: f64, unknowns: f64, freedom: f64) -> f64 {
    let (a, b) = (2.0 / (9.0 * unknowns), 2.0 / (9.0 * freedom));
    let root = f_ratio.cbrt();
    ((1.0 - b) * root - (1.0 - a)) / (b * root * root + a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of the F distribution, once in a thousand.
    #[test]
    fn one_in_a_thousand_is_three_deviations() {
        for (unknowns, freedom, f_ratio) in
            [(10.0, 10.0, 8.754), (10.0, 60.0, 3.54), (60.0, 120.0, 1.95)]
        {
            let z = deviate_of_f(f_ratio, unknowns, freedom);
            assert!((z - 3.09).abs() < 0.06, "{unknowns} {freedom}: {z}");
        }
        assert!(deviate_of_f(f64::NAN, 0.0, 0.0).is_nan());
    }
}
