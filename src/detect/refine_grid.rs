//! All corners of a grid refined, each in the largest window that shows nothing but it.
//!
//! How far the next edges reach into a window is known once the blur is: a few corners tell it, on
//! coarser levels of the pyramid where the finest shows too little of it. What
//! covers a part of the board may still lie beside a corner; then the model leaves more than
//! elsewhere in the grid, and smaller windows are tried. A corner at the end of what is seen of the
//! board that no window shows cleanly is dropped, since what hides the board has drawn it aside.

use std::collections::BTreeSet;

use super::clearance::clear_squares;
use super::corner_model::CornerFitter;
use super::detection::{Grid, GridCorner, median};
use super::refine::{MIN_MODEL_RADIUS, ModelFit, RefineStatus, Refined, Refinement, Refiner};
use crate::raster::{Gray, Intensity, Pyramid};

/// Corners that tell the blur: those with the most room.
const BLUR_CORNERS: usize = 15;

/// Blur that is assumed before it is known, px: that of a good photograph.
const USUAL_BLUR_PX: f64 = 1.0;

/// Larger blurs than this part of the radius of the largest window are looked for again on a coarser
/// level: the window shows little but the middle of the edges.
const MAX_BLUR: f64 = 0.5;

/// Residuals of the model above this many times the median of the grid show something else than the
/// corner; noise of a 7×7 window varies by a tenth.
const MAX_RESIDUAL_RATIO: f64 = 3.0;

/// Residuals below this part of the amplitude are no reason to doubt a corner: of a clean image the
/// median says nothing.
const MIN_RESIDUAL: f64 = 0.05;

/// A window is followed by one that is smaller by this factor.
const NEXT_WINDOW: f64 = 0.7;

impl Refiner {
    /// Refines the corners of a grid in place and drops those that are spoilt; the blur in px where
    /// the model can tell it. `part` as in [`clear_squares`].
    pub(super) fn refine_grid<T: Intensity>(
        &self,
        fitter: &mut CornerFitter,
        (image, pyramid): (&Gray<T>, &Pyramid),
        grid: &mut Grid,
        part: f64,
    ) -> Option<f64> {
        // Of a grid without tags nothing says that its tiles are not plain.
        let shown = if grid.tags.is_empty() { 1.0 } else { part };
        let fine = self.blur(fitter, image, 0, grid, shown);
        let most_px = MAX_BLUR * self.largest_radius();
        let blur_px = fine.filter(|&blur_px| blur_px <= most_px).or_else(|| {
            let coarser = pyramid.levels().iter().enumerate().skip(1);
            coarser
                .filter_map(|(n, level)| self.blur(fitter, level, n, grid, shown))
                .last()
                .or(fine)
        });
        let clear = clear_squares(grid, part, blur_px.unwrap_or(USUAL_BLUR_PX));
        let starts = grid.corners.iter().map(|corner| [corner.x, corner.y]);
        let refined: Vec<(Refined, Option<ModelFit>)> = starts
            .zip(&clear)
            .map(|(start, &clear_px)| self.refine_within(fitter, image, start, clear_px))
            .collect();
        let residuals: Vec<f64> =
            refined.iter().filter_map(|(_, fit)| Some((*fit)?.residual)).collect();
        // Of edges as sharp as pixels the model makes nothing; then it is no judge of corners.
        let judged = 2 * residuals.len() > refined.len();
        let limit = (MAX_RESIDUAL_RATIO * median(residuals).unwrap_or(0.0)).max(MIN_RESIDUAL);
        let places: BTreeSet<(i32, i32)> = grid.corners.iter().map(|c| (c.row, c.col)).collect();
        let inner = |corner: &GridCorner| {
            let steps = grid.kind.steps();
            steps.iter().all(|s| places.contains(&(corner.row + s.row, corner.col + s.col)))
        };
        let mut kept = Vec::with_capacity(grid.corners.len());
        for ((corner, (refined, fit)), &clear_px) in grid.corners.iter().zip(refined).zip(&clear) {
            let clean = fit.is_some_and(|fit| fit.residual <= limit);
            let modelled =
                self.method() == Refinement::Model && clear_px >= MIN_MODEL_RADIUS as f64;
            let refined = if clean || !modelled || !judged {
                Some(refined)
            } else {
                let smaller = self.clean_fit(fitter, image, corner, clear_px, limit);
                smaller.or_else(|| inner(corner).then_some(refined))
            };
            if let Some(Refined { position: [x, y], cov, .. }) = refined {
                kept.push(GridCorner { x, y, cov, ..*corner });
            }
        }
        grid.corners = kept;
        blur_px
    }

    /// The blur of a grid as `image`, a level of its pyramid, shows it, px of level 0: the median over
    /// the corners with the most room.
    fn blur<T: Intensity>(
        &self,
        fitter: &mut CornerFitter,
        image: &Gray<T>,
        level: usize,
        grid: &Grid,
        part: f64,
    ) -> Option<f64> {
        let scale = f64::from(1u32 << level);
        let clear = clear_squares(grid, part, USUAL_BLUR_PX * scale);
        let mut order: Vec<usize> = (0..clear.len()).collect();
        order.sort_by(|&a, &b| clear[b].total_cmp(&clear[a]));
        let fits = order.into_iter().take(BLUR_CORNERS).filter_map(|i| {
            let GridCorner { x, y, .. } = grid.corners[i];
            let place = Pyramid::from_level_0(level, [x, y]);
            self.model(fitter, image, place, clear[i] / scale).map(|fit| scale * fit.blur_px)
        });
        median(fits.collect())
    }

    /// The model in the largest window smaller than `clear_px` that leaves no more than `limit`.
    fn clean_fit<T: Intensity>(
        &self,
        fitter: &mut CornerFitter,
        image: &Gray<T>,
        corner: &GridCorner,
        clear_px: f64,
        limit: f64,
    ) -> Option<Refined> {
        let least = MIN_MODEL_RADIUS as f64;
        let first = NEXT_WINDOW * clear_px.min(self.largest_radius());
        let sides = std::iter::successors(Some(first), |side| Some(NEXT_WINDOW * side));
        let sides =
            sides.take_while(|&side| side / NEXT_WINDOW > least).map(|side| side.max(least));
        let mut fits =
            sides.filter_map(|side| self.model(fitter, image, [corner.x, corner.y], side));
        let fit = fits.find(|fit| fit.residual <= limit)?;
        Some(Refined { position: fit.position, cov: Some(fit.cov), status: RefineStatus::Ok })
    }
}
