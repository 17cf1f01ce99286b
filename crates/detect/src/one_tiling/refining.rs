//! Refinement of all grids of an image: from a start near their motion or the shift of their edges, on the level of the
//! pyramid that suits their blur.

use std::borrow::Cow;

use super::{Frame, OneTiling, Shared};
use crate::grid::saddle_grid::PlacedSaddle;
use crate::labels::grid_blur::GridBlur;
use crate::labels::grid_light::{GridLight, TagInsets};
use crate::refine::edge_shift::{EdgeShift, centre, large_shift};
use crate::refine::model::fitter::CornerFitter;
use crate::refine::optics::Optics;
use crate::refine::refine_grid::{Level, Seen, is_sampled, sharp_level};
use crate::refine::refiner::Refiner;
use deltille_core::detection::{Grid, GridCorner};
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::raster::{ImageView, Pyramid};

/// Largest blur of an untagged grid, as a fraction of the edge length. At this blur, the next
/// harmonic has less than a tenth of the amplitude of the fundamental. The model estimates a blur
/// of 0.25 edges from the fundamental alone, and of 0.155 edges from three harmonics.
const fn max_untagged_blur(kind: GridKind) -> f64 {
    match kind {
        GridKind::Deltille => 0.14,
        GridKind::Checker => 0.2,
    }
}

/// Blur above which motion is estimated before corners are fitted, px. Fits without motion converge below it.
const MIN_MOTION_BLUR_PX: f64 = 1.5;

/// Largest displacement of edges by tags that are blurred into them, in standard deviations of the blur.
const TAG_SHIFT_BLURS: f64 = 1.0;

impl OneTiling {
    /// Refines all grids on the level of the pyramid that suits their blur.
    pub(super) fn refine(
        &self,
        fitter: &mut CornerFitter,
        frame: Frame,
        grids: &mut [Grid],
    ) -> Shared {
        let levels = frame.pyramid.levels();
        let finest = Level { image: frame.image, enlarged: 0, coarser: &levels[1..] };
        let mut blurs = self.refiner.blurs(fitter, finest, grids, &self.tag_areas);
        let shift = large_shift(frame.image, grids).filter(|_| self.refiner.is_ink_open());
        let motion = self.motion(frame.image, grids, &blurs, shift);
        let blur_px = blurs.iter().copied().flatten().reduce(f64::min);
        let by_tags_px =
            TAG_SHIFT_BLURS * blur_px.filter(|_| !self.tag_areas.is_empty()).unwrap_or(0.0);
        let (mut refiner, mut least) = (Cow::Borrowed(&self.refiner), 0);
        let mut before = None;
        if let Some(motion) = motion {
            refiner = Cow::Owned(self.refiner.with_motion_near(motion.astigmatism()));
        } else if let Some(shift) = shift.filter(|shift| shift.px > by_tags_px) {
            before = Some((grids.to_vec(), blurs.clone()));
            refiner = Cow::Owned(self.refiner.with_ink_near(shift.edges));
            grids.iter_mut().for_each(|grid| centre(frame.image, grid, shift.edges));
            least = shift.level(levels.len());
        }
        if matches!(refiner, Cow::Owned(_)) {
            blurs = refiner.blurs(fitter, finest, grids, &self.tag_areas);
        }
        let sharp = sharp_level(&blurs, levels.len());
        for number in (least.max(1)..=sharp.max(least)).rev() {
            // On a level that is coarser than its sharpness requires, edges would be sharper than the pixels.
            let smooth = (number > sharp).then(|| Pyramid::new(&levels[number], 1, 1));
            let image = smooth.as_ref().map_or(&levels[number], |smooth| &smooth.levels()[0]);
            let image = ImageView::from(image);
            let enlarged = if number > sharp { 0 } else { number };
            let level = Level { image, enlarged, coarser: &levels[number + 1..] };
            grids.iter_mut().for_each(|grid| grid.moved_to_level(number));
            let blurs = refiner.blurs(fitter, level, grids, &self.tag_areas);
            let optics = refiner.optics(fitter, level, grids, &blurs, &self.tag_areas);
            // Motion blur leaves an image sharp perpendicular to the motion.
            let found = (number == least || is_sampled(&blurs, optics.narrowest()))
                .then(|| self.refine_under(&refiner, fitter, image, grids, optics, &blurs));
            grids.iter_mut().for_each(|grid| grid.moved_from_level(number));
            if let Some(found) = found {
                return Shared { noise: None, ..found };
            }
        }
        let optics = refiner.optics(fitter, finest, grids, &blurs, &self.tag_areas);
        if let Some((usual, before)) = before
            && optics.ink() == 0.0
        {
            grids.clone_from_slice(&usual);
            (refiner, blurs) = (Cow::Borrowed(&self.refiner), before);
        }
        let found = self.refine_under(&refiner, fitter, frame.image, grids, optics, &blurs);
        let is_usual = matches!(refiner, Cow::Borrowed(_));
        Shared { noise: found.noise.filter(|_| is_usual), ..found }
    }

    /// Refines all grids in an image whose optics and blurs, px, are nearly known.
    pub(super) fn refine_again(
        &self,
        fitter: &mut CornerFitter,
        image: ImageView,
        grids: &mut [Grid],
        optics: &Optics,
        blurs: &[Option<f64>],
    ) -> Shared {
        self.refine_under(&self.refiner, fitter, image, grids, optics.clone(), blurs)
    }

    /// Returns the blur of the largest grid if its edges show motion and have not moved by `shift` instead. Only grids with
    /// large blurs, px, may show any.
    fn motion(
        &self,
        image: ImageView,
        grids: &[Grid],
        blurs: &[Option<f64>],
        shift: Option<EdgeShift>,
    ) -> Option<GridBlur> {
        let may_move = |blur: &Option<f64>| blur.is_none_or(|blur_px| blur_px > MIN_MOTION_BLUR_PX);
        let blurred = grids.iter().zip(blurs).filter(|(_, blur)| may_move(blur));
        let (grid, _) = blurred.max_by_key(|(grid, _)| grid.corners.len())?;
        let placed = |corner: &GridCorner| {
            let position = corner.position();
            (Vertex::new(corner.row, corner.col), PlacedSaddle { position, amplitude: 0.0 })
        };
        let corners = grid.corners.iter().map(placed).collect();
        let [dark, bright] = self.tag_areas.insets(grid);
        let insets = TagInsets { dark, bright };
        let light = |shift| GridLight::of(image, &corners, grid.kind, insets, shift);
        let still = light(0.0).filter(|light| light.blur.is_motion())?;
        let moved = shift.and_then(|shift| light(shift.edges));
        moved.is_none_or(|moved| still.misfit < moved.misfit).then_some(still.blur)
    }

    /// Refines the grids in an image with these optics and blurs, px.
    fn refine_under(
        &self,
        refiner: &Refiner,
        fitter: &mut CornerFitter,
        image: ImageView,
        grids: &mut [Grid],
        optics: Optics,
        blurs: &[Option<f64>],
    ) -> Shared {
        let mut refine = |(grid, &blur_px): (&mut Grid, &Option<f64>)| {
            refiner.refine_grid(fitter, image, grid, &self.tag_areas, &optics, blur_px)
        };
        let seen: Vec<Option<Seen>> = grids.iter_mut().zip(blurs).map(&mut refine).collect();
        let is_wave = |(grid, blur): (&Grid, &Option<f64>)| {
            let edge_px = grid.edge_px().unwrap_or(0.0);
            blur.is_some_and(|blur_px| blur_px > max_untagged_blur(grid.kind) * edge_px)
        };
        Shared {
            are_waves: grids.iter().zip(blurs).map(is_wave).collect(),
            blurs: seen.iter().map(|seen| seen.map(|seen| seen.blur_px)).collect(),
            noise: seen.first().and_then(|seen| seen.map(|seen| seen.noise)),
            optics,
        }
    }
}
