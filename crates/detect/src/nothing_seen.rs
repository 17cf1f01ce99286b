//! Finds the reason why no grid of a tiling was detected: the image shows the other tiling, the
//! grid is too small, or neither.

use super::labels::why;
use super::levels::{MIN_LEVEL_SIDE, PYRAMID_LEVELS};
use super::tiling::{CHECKER, DELTILLE, kind};
use crate::corners::saddles::SaddleFinder;
use crate::grid::grids::grids;
use deltille_core::detection::{MIN_UNTAGGED_EDGE_PX, Reason, ReasonKind};
use deltille_core::lattice::GridKind;
use deltille_core::raster::{Gray, PYRAMID_FULL_SCALE, Pyramid};

/// Minimum number of corners of a grid of the other tiling for which a wrong tiling is reported.
const MIN_OTHER_CORNERS: usize = 20;

/// Returns the reason why an image with this number of corners has no grid.
pub(super) fn nothing_found<const N: usize>(pyramid: &Pyramid, corners: usize) -> Reason {
    // Half the size takes a quarter of the time.
    let half = pyramid.levels().get(1).map(|level| {
        let to_one = 1.0 / PYRAMID_FULL_SCALE;
        Pyramid::new(&level.map(|v| f32::from(v) * to_one), PYRAMID_LEVELS - 1, MIN_LEVEL_SIDE)
    });
    let (others, edges) = half.map_or((0, 0.0), |half| match kind::<N>() {
        GridKind::Deltille => (most_corners(&SaddleFinder::<CHECKER>::new(), &half), 2.0),
        GridKind::Checker => (most_corners(&SaddleFinder::<DELTILLE>::new(), &half), 3.0),
    });
    if others >= MIN_OTHER_CORNERS {
        let figures = [("corners", others as f64), ("edges", edges)];
        return Reason::new(ReasonKind::OtherTiling, figures);
    }
    let reason = why::nothing_found(pyramid, corners);
    if matches!(reason.kind, ReasonKind::NoCorners | ReasonKind::NoGrid)
        && let Some(edge_px) = edge_of_small_tiles::<N>(&pyramid.levels()[0])
    {
        let figures = [("edge_px", edge_px), ("needed_edge_px", MIN_UNTAGGED_EDGE_PX)];
        return Reason::new(ReasonKind::TooSmall, figures);
    }
    reason
}

/// Returns the edge length in px of a grid that is too small to detect. To find it, doubles the
/// size of the image part with the highest contrast.
fn edge_of_small_tiles<const N: usize>(level: &Gray<i16>) -> Option<f64> {
    /// Width and height of the part, px. Enlarged, it has half a megapixel. Twenty corners 7 px apart fill 1 % of it.
    const PART: [usize; 2] = [400, 300];
    /// Magnification: shows tiles down to half the minimum size.
    const TIMES: usize = 2;
    let size = [level.width().min(PART[0]), level.height().min(PART[1])];
    let [left, top] = busiest_part(level, size);
    let to_one = 1.0 / PYRAMID_FULL_SCALE;
    let enlarged = Gray::from_fn(TIMES * size[0], TIMES * size[1], |x, y| {
        let [u, v] = [(left, x), (top, y)].map(|(from, i)| from as f64 + i as f64 / TIMES as f64);
        level.bilinear(u, v) * to_one
    });
    let pyramid = Pyramid::new(&enlarged, 1, MIN_LEVEL_SIDE);
    let finder = SaddleFinder::<N>::new();
    let found = grids(&finder, &pyramid, &finder.find(&pyramid), None);
    let largest = found.iter().max_by_key(|grid| grid.len())?;
    let edge_px = why::edge_px(largest)? / TIMES as f64;
    (largest.len() >= MIN_OTHER_CORNERS && edge_px < MIN_UNTAGGED_EDGE_PX).then_some(edge_px)
}

/// Returns the top left pixel of an image part of the given width and height, centred on the square
/// with the highest contrast if the image permits.
fn busiest_part(level: &Gray<i16>, size: [usize; 2]) -> [usize; 2] {
    /// Side of the square, px. Twenty corners of tiles that are too small fit into it.
    const SQUARE: usize = 64;
    let contrast = |[x, y]: [usize; 2]| {
        let [right, bottom] = [(x + SQUARE).min(level.width()), (y + SQUARE).min(level.height())];
        let rows = (y..bottom).map(|v| &level.row(v)[x..right]);
        rows.flat_map(|row| row.windows(2))
            .map(|two| two[0].abs_diff(two[1]) as usize)
            .sum::<usize>()
    };
    let columns = (0..level.width()).step_by(SQUARE);
    let squares = columns.flat_map(|x| (0..level.height()).step_by(SQUARE).map(move |y| [x, y]));
    let [x, y] = squares.max_by_key(|&square| contrast(square)).unwrap_or_default();
    let around = |at: usize, part: usize, side: usize| {
        (at + SQUARE / 2).saturating_sub(part / 2).min(side - part)
    };
    [around(x, size[0], level.width()), around(y, size[1], level.height())]
}

/// Returns the number of corners of the largest grid of a tiling.
fn most_corners<const N: usize>(finder: &SaddleFinder<N>, pyramid: &Pyramid) -> usize {
    let saddles = finder.find(pyramid);
    grids(finder, pyramid, &saddles, None).iter().map(|grid| grid.len()).max().unwrap_or(0)
}
