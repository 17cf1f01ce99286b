//! Finds the reason why an image has no labels.

use glam::DVec2;

use super::placement::labeller::TagEvidence;
use crate::grid::saddle_grid::SaddleGrid;
use deltille_core::detection::{Reason, ReasonKind};
use deltille_core::lattice::GridKind;
use deltille_core::raster::{Gray, PYRAMID_FULL_SCALE, Pyramid};
use deltille_core::statistics::median;

/// Brightness of the brightest pixels, as a fraction of full scale, below which an image is too
/// dark. An image this dark shows a board in at most a dozen grey levels.
const DARK: f64 = 0.06;

/// Fraction of saturated pixels above which an image is overexposed.
const MOSTLY_SATURATED: f64 = 0.6;

/// Fraction of full scale from which a pixel is saturated.
const SATURATED: f64 = 0.985;

/// Blur that hides corners on all levels of the pyramid, px.
const HIDING_BLUR_PX: f64 = 6.0;

/// Minimum length of a readable cell on a board of tags, px, however sharp the image is.
const MIN_BIT_PX: f64 = 0.9;

/// Minimum length of a readable cell, in standard deviations of the blur.
const MIN_BIT_BLURS: f64 = 1.0;

/// Factor by which cells must be longer to read a single tag than to read a board.
const TAG_FOR_TAG: f64 = 2.0;

/// One in this many pixels may be outside the range of the image: dead, hot, or a specular
/// highlight. The smoothing of level 0 spreads each over nine pixels, so a dark image with one hot
/// pixel in 9000 is still dark. Values from 250 to 4000 change the reported blur by 4 %. At 100, a
/// small bright board would be ignored as highlights.
const PIXELS_A_DEAD_ONE: usize = 1000;

/// One in this many pixels may have a steeper gradient than the sharpest edges. In two megapixels,
/// the edges of a single tile of a board, 100 px long, have as many pixels.
const PIXELS_A_STEEP_ONE: usize = 5000;

/// Returns the reason why nothing was found in an image with this number of corners of its tiling.
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

/// Returns the reason why the tags of a grid gave no labels.
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
    if evidence.tiles == 0 {
        return Reason::new(ReasonKind::NoTiles, [corners]);
    }
    let (bit_px, blur_px) = (evidence.bit_px, evidence.blur_px);
    let needed_bit_px = MIN_BIT_PX.max(MIN_BIT_BLURS * blur_px);
    if bit_px < needed_bit_px {
        let figures = [("bit_px", bit_px), ("blur_px", blur_px), ("needed_bit_px", needed_bit_px)];
        return Reason::new(ReasonKind::UnreadableTags, figures);
    }
    if let Some([agreeing, disagreeing]) = evidence.contradicted {
        let figures = [("agreeing", agreeing as f64), ("disagreeing", disagreeing as f64)];
        return Reason::new(ReasonKind::OtherLayout, figures);
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

/// Returns the reason why a grid is not labelled by an outline of `expected` corners.
pub(crate) fn no_outline(grid: &SaddleGrid, expected: usize, size: [usize; 2]) -> Reason {
    let figures = [("corners", grid.len() as f64), ("expected", expected as f64)];
    let kind = if grid.len() < expected && ends_at_border(grid, size) {
        ReasonKind::CutByBorder
    } else {
        ReasonKind::NotWhole
    };
    Reason::new(kind, figures)
}

/// Returns whether a corner lies less than an edge length from the border of the image.
fn ends_at_border(grid: &SaddleGrid, [width, height]: [usize; 2]) -> bool {
    let Some(edge_px) = edge_px(grid) else {
        return false;
    };
    grid.values().any(|placed| {
        let DVec2 { x, y } = placed.position;
        x.min(y).min(width as f64 - x).min(height as f64 - y) < edge_px
    })
}

/// Returns the median distance of successive corners in a row or column, px; `None` if there are none.
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

/// Returns the darkest and brightest pixels, ignoring one in [`PIXELS_A_DEAD_ONE`].
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

/// Returns the standard deviation of the blur of the steepest edges, px. They are assumed to have the full contrast: an
/// edge of contrast c has a slope of c / (√2π σ).
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
