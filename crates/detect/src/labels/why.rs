//! What a picture without labels can tell of the reason.

use glam::DVec2;

use super::placement::labeller::TagEvidence;
use crate::grid::saddle_grid::SaddleGrid;
use deltille_core::detection::{Reason, ReasonKind};
use deltille_core::lattice::GridKind;
use deltille_core::raster::{Gray, PYRAMID_FULL_SCALE, Pyramid};
use deltille_core::statistics::median;

/// A picture whose brightest pixels are under this part of full scale is too dark to show a board in
/// more than a dozen grey levels.
const DARK: f64 = 0.06;

/// A picture more of which is saturated than this shows nothing else.
const MOSTLY_SATURATED: f64 = 0.6;

/// From this part of full scale on a pixel is saturated.
const SATURATED: f64 = 0.985;

/// Blur that hides corners on all levels of the pyramid, px.
const HIDING_BLUR_PX: f64 = 6.0;

/// Cells of a board of tags are read from this length on, px, however sharp they are.
const LEAST_BIT_PX: f64 = 1.25;

/// And from this length on in deviations of the blur.
const LEAST_BIT_BLURS: f64 = 1.0;

/// Single tags are read where cells are so many times as long as a board of them needs.
const TAG_FOR_TAG: f64 = 2.0;

/// One pixel in so many may be darker or brighter than all that the picture shows: dead, hot, or a spark, which the smoothing
/// of level 0 spreads over nine. So a dark picture with one hot pixel in 9000 is still dark. From 250 to 4000 the
/// blur that is told changes by 4 %; at 100 a small board in the light is taken for sparks.
const PIXELS_A_DEAD_ONE: usize = 1000;

/// One pixel in so many may be steeper than the sharpest edges. The edges of a single tile of a board, 100 px long, are as many in two megapixels.
const PIXELS_A_STEEP_ONE: usize = 5000;

/// Why nothing was found in a picture with so many corners of its tiling.
pub(crate) fn nothing_found(pyramid: &Pyramid, corners: usize) -> Reason {
    let level = &pyramid.levels()[0];
    let [low, high] = range(level);
    let brightest = high / f64::from(PYRAMID_FULL_SCALE);
    if brightest < DARK {
        return Reason::new(ReasonKind::TooDark, [("brightest", brightest)]);
    }
    let limit = (SATURATED * f64::from(PYRAMID_FULL_SCALE)) as i16;
    let bright = level.pixels().iter().filter(|&&v| v >= limit).count();
    let saturated = bright as f64 / level.pixels().len().max(1) as f64;
    if saturated > MOSTLY_SATURATED {
        return Reason::new(ReasonKind::Overexposed, [("saturated", saturated)]);
    }
    let blur_px = sharpest_edge_px(level, high - low);
    if blur_px > HIDING_BLUR_PX {
        return Reason::new(ReasonKind::TooBlurred, [("blur_px", blur_px)]);
    }
    if corners > 0 {
        return Reason::new(ReasonKind::NoGrid, [("corners", corners as f64)]);
    }
    Reason::new(ReasonKind::NoCorners, [])
}

/// Why the tags of a grid gave no labels.
pub(crate) fn no_labels(evidence: &TagEvidence, grid: &SaddleGrid, size: [usize; 2]) -> Reason {
    let corners = ("corners", grid.len() as f64);
    if evidence.is_ambiguous {
        return Reason::new(ReasonKind::Ambiguous, [corners]);
    }
    if evidence.is_cut_short {
        return Reason::new(ReasonKind::TooManyGrids, []);
    }
    if let Some(&id) = evidence.foreign_ids.first() {
        let tags = evidence.foreign_ids.len() as f64;
        return Reason::new(ReasonKind::OtherIds, [("tags", tags), ("id", f64::from(id))]);
    }
    if let Some([agreeing, disagreeing]) = evidence.contradicted {
        let figures = [("agreeing", agreeing as f64), ("disagreeing", disagreeing as f64)];
        return Reason::new(ReasonKind::OtherLayout, figures);
    }
    if evidence.tiles == 0 {
        return Reason::new(ReasonKind::NoTiles, [corners]);
    }
    let (bit_px, blur_px) = (evidence.bit_px, evidence.blur_px);
    let needed_bit_px = LEAST_BIT_PX.max(LEAST_BIT_BLURS * blur_px);
    if bit_px < needed_bit_px {
        let figures = [("bit_px", bit_px), ("blur_px", blur_px), ("needed_bit_px", needed_bit_px)];
        return Reason::new(ReasonKind::UnreadableTags, figures);
    }
    if 2 * evidence.unread > evidence.tiles {
        let mut figures = vec![("bit_px", bit_px), ("blur_px", blur_px)];
        if bit_px < TAG_FOR_TAG * needed_bit_px {
            figures.push(("needed_bit_px", TAG_FOR_TAG * needed_bit_px));
        }
        return Reason::of(ReasonKind::UnreadableTags, figures);
    }
    if evidence.no_codes > 1 {
        return Reason::new(ReasonKind::OtherFamily, [("tiles", evidence.no_codes as f64)]);
    }
    if ends_at_border(grid, size) {
        return Reason::new(ReasonKind::CutByBorder, [corners]);
    }
    Reason::new(ReasonKind::NoTags, [("tiles", evidence.tiles as f64)])
}

/// Why a grid is not labelled by an outline of so many corners.
pub(crate) fn no_outline(grid: &SaddleGrid, expected: usize, size: [usize; 2]) -> Reason {
    let figures = [("corners", grid.len() as f64), ("expected", expected as f64)];
    let kind = if grid.len() < expected && ends_at_border(grid, size) {
        ReasonKind::CutByBorder
    } else {
        ReasonKind::NotWhole
    };
    Reason::new(kind, figures)
}

/// Whether some corner lies less than an edge's length from the border of the picture.
fn ends_at_border(grid: &SaddleGrid, [width, height]: [usize; 2]) -> bool {
    let Some(edge_px) = edge_px(grid) else {
        return false;
    };
    grid.values().any(|placed| {
        let DVec2 { x, y } = placed.position;
        x.min(y).min(width as f64 - x).min(height as f64 - y) < edge_px
    })
}

/// The median distance of corners that follow each other in a row or column, px; `None` where there are none such.
pub(crate) fn edge_px(grid: &SaddleGrid) -> Option<f64> {
    let lengths = grid.iter().flat_map(|(&v, placed)| {
        let beside = GridKind::Checker.neighbours(v).filter_map(|n| grid.get(&n));
        beside.map(move |other| {
            let edge = other.position - placed.position;
            edge.x.hypot(edge.y)
        })
    });
    median(lengths.collect())
}

/// Darkest and brightest pixels, but for one in [`PIXELS_A_DEAD_ONE`].
fn range(level: &Gray<i16>) -> [f64; 2] {
    let mut counts = vec![0usize; PYRAMID_FULL_SCALE as usize + 1];
    for &value in level.pixels() {
        counts[(value.max(0) as usize).min(PYRAMID_FULL_SCALE as usize)] += 1;
    }
    let few = level.pixels().len() / PIXELS_A_DEAD_ONE;
    let reaches = |sum: &mut usize, value: usize| {
        *sum += counts[value];
        *sum > few
    };
    let (mut below, mut above) = (0, 0);
    let low = (0..counts.len()).find(|&value| reaches(&mut below, value)).unwrap_or(0);
    let high = (0..counts.len()).rev().find(|&value| reaches(&mut above, value)).unwrap_or(0);
    [low as f64, high as f64]
}

/// Deviation of the blur of the steepest edges, px, taken to have all of the contrast: an edge of contrast c is as
/// steep as c / (√2π σ).
fn sharpest_edge_px(level: &Gray<i16>, contrast: f64) -> f64 {
    let steps = (1..level.height()).flat_map(|y| {
        let (row, above) = (level.row(y), level.row(y - 1));
        (1..row.len()).map(move |x| {
            let (dx, dy) = (i32::from(row[x] - row[x - 1]), i32::from(row[x] - above[x]));
            dx.abs().max(dy.abs())
        })
    });
    let mut counts = vec![0usize; PYRAMID_FULL_SCALE as usize + 1];
    steps.for_each(|step| counts[(step as usize).min(PYRAMID_FULL_SCALE as usize)] += 1);
    let few = level.pixels().len() / PIXELS_A_STEEP_ONE;
    let mut sum = 0;
    let steepest = (0..counts.len()).rev().find(|&step| {
        sum += counts[step];
        sum > few
    });
    contrast / (std::f64::consts::TAU.sqrt() * steepest.unwrap_or(0).max(1) as f64)
}
