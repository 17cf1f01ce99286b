//! Removes corners at the end of a grid whose outer edges are not visible.
//!
//! All tiles around a corner of a board are printed. Outside a board, vertices of the lattice at which tiles end look
//! like corners if something else takes the place of the missing tiles: a letter, the border of the page, or a shadow.
//! Next to an occluder, a corner seems to be displaced. In both cases an edge that leaves the grid is not visible, or
//! only in part.
//!
//! ```text
//!      ██╲   ╱██╲   ╱██      the end of a board: two of the three dark tiles around an outer vertex ○
//!      ███╲ ╱████╲ ╱███      are printed, and nothing on both sides of its outer edges (┄)
//!      ────○──────○────
//!         ┊ ┊    ┊ ┊
//! ```

use glam::DVec2;

use super::links::link::MAX_CONTRAST_RATIO;
use super::saddle_grid::{Growing, GrownSaddle};
use crate::tiling::{CHECKER, step};
use deltille_core::lattice::Vertex;
use deltille_core::raster::{Gray, Pyramid};
use deltille_core::statistics::median;

/// Fraction of an edge at which the stations end. The other half belongs to the neighbour, which may be covered.
const FAR: f64 = 0.55;

/// The same, px of the level. With all but one station visible, a corner is clear up to 5 px: the radius of the smallest
/// window of the model, 3 px, and two standard deviations of a blur of 1 px.
const FAR_PX: f64 = 5.5;

/// Fraction of this range that is not read. At the corner itself, blur mixes the sectors.
const NEAR: f64 = 0.25;

/// Number of stations along an edge.
const STATIONS: usize = 8;

/// Number of stations at which an edge must be visible, of [`STATIONS`]. One may show a scratch or a highlight.
const MIN_STATIONS: usize = 7;

/// Distance of the samples from the edge, as a fraction of the height of the tile on that side: within the border of a
/// tag.
const SIDE: f64 = 0.08;

/// Minimum of that distance, px of the level, for a step that blur does not hide.
const MIN_SIDE_PX: f64 = 1.2;

/// Removes the corners whose outer edges are not visible, until all are.
pub(super) fn trim<const N: usize>(pyramid: &Pyramid, grid: &mut Growing<N>) {
    loop {
        let hidden: Vec<Vertex> = grid
            .iter()
            .filter(|(vertex, corner)| !has_outer_edges(pyramid, grid, **vertex, corner))
            .map(|(vertex, _)| *vertex)
            .collect();
        if hidden.is_empty() {
            return;
        }
        for vertex in &hidden {
            grid.remove(vertex);
        }
    }
}

/// Returns whether all edges from a corner to missing neighbours are visible in the image, as clearly as those to known
/// ones.
fn has_outer_edges<const N: usize>(
    pyramid: &Pyramid,
    grid: &Growing<N>,
    vertex: Vertex,
    corner: &GrownSaddle<N>,
) -> bool {
    let at = |v: Vertex| grid.get(&v).map(|grown| grown.saddle.position);
    let neighbours: [Option<DVec2>; N] = std::array::from_fn(|k| at(vertex + step::<N>(k)));
    if neighbours.iter().all(Option::is_some) {
        return true;
    }
    let level = corner.saddle.level;
    let scale = f64::from(1u32 << level);
    let known = |k: usize| Some((neighbours[k % N]? - corner.saddle.position) / scale);
    let lengths = (0..N).filter_map(|k| Some(known(k)?.length()));
    let length_px = median(lengths.collect()).unwrap_or(FAR_PX / FAR);
    let ways: [DVec2; N] = std::array::from_fn(|k| {
        let measured = || length_px * DVec2::from_angle(corner.saddle.sectors.rays[corner.ray(k)]);
        // Perspective keeps an edge straight across the corner. What covers it turns its ray.
        known(k).or_else(|| Some(-known(k + N / 2)?)).unwrap_or_else(measured)
    });
    let around = Around { image: &pyramid.levels()[level], corner, ways };
    let steps: [[Option<f64>; STATIONS]; N] = std::array::from_fn(|k| around.steps(k));
    let is_alone = neighbours.iter().all(Option::is_none);
    (0..N).filter(|&k| neighbours[k].is_none()).all(|k| {
        let opposite = (k + N / 2) % N;
        let usual = |station: usize| match neighbours[opposite] {
            // Opposite sectors have equal angles, so blur reduces the steps between them equally.
            Some(_) => steps[opposite][station],
            // So have any two neighbouring sectors of a checkerboard.
            None if is_alone || N == CHECKER => {
                let known = (0..N).filter(|&k| is_alone || neighbours[k].is_some());
                median(known.filter_map(|k| steps[k][station]).collect())
            }
            None => None,
        };
        let pairs = (0..STATIONS).filter_map(|i| Some((steps[k][i]?, usual(i)?)));
        let (seen, clear) = pairs.fold((0, 0), |(seen, clear), (step, usual)| {
            (seen + 1, clear + usize::from(MAX_CONTRAST_RATIO * step >= usual))
        });
        // Where the image ends, the rest of an edge counts.
        STATIONS * clear >= MIN_STATIONS * seen
    })
}

/// A corner on its level of the pyramid.
struct Around<'a, const N: usize> {
    image: &'a Gray<i16>,
    corner: &'a GrownSaddle<N>,
    /// Displacements of its neighbours, px of the level.
    ways: [DVec2; N],
}

impl<const N: usize> Around<'_, N> {
    /// Returns the steps from dark to bright across the edge along step `k` of the lattice, from the corner outwards;
    /// `None` outside the image.
    fn steps(&self, k: usize) -> [Option<f64>; STATIONS] {
        let ray = self.corner.ray(k);
        let place = Pyramid::from_level_0(self.corner.saddle.level, self.corner.saddle.position);
        let along = self.ways[k].normalize_or_zero();
        // On the print.
        let left = -along.perp();
        let far_px = (FAR * self.ways[k].length()).min(FAR_PX);
        let side = |next: usize| {
            let height = self.ways[k].perp_dot(self.ways[next % N]).abs() / self.ways[k].length();
            let half = self.ways[k].angle_to(self.ways[next % N]).abs() / 2.0;
            ((SIDE * height).max(MIN_SIDE_PX), half.tan())
        };
        let (on_left, on_right) = (side(k + 1), side(k + N - 1));
        let dark_left = if ray.is_multiple_of(2) { 1.0 } else { -1.0 };
        std::array::from_fn(|station| {
            let part = (station as f64 + 0.5) / STATIONS as f64;
            let away_px = far_px * (NEAR + (1.0 - NEAR) * part);
            // No farther than the middle of the sector. Where it is narrower, pixels do not resolve it.
            let value = |(side_px, slope): (f64, f64), sign: f64| {
                let lateral_px = side_px.min(away_px * slope);
                let place = place + away_px * along + sign * lateral_px * left;
                (lateral_px >= MIN_SIDE_PX).then(|| self.brightness(place)).flatten()
            };
            Some(dark_left * (value(on_right, -1.0)? - value(on_left, 1.0)?))
        })
    }

    fn brightness(&self, place: DVec2) -> Option<f64> {
        let size = DVec2::new(self.image.width() as f64, self.image.height() as f64) - 1.0;
        let inside = place.cmpge(DVec2::ZERO).all() && place.cmplt(size).all();
        inside.then(|| self.image.bilinear_inside(place.x, place.y))
    }
}
