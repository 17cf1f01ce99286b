//! Finds corners that are not where the smooth map of the corners around them predicts them.
//!
//! Next to the edge of an occluder or of a shadow, the model fits another edge well enough, but in another position. A
//! fold of a board also displaces corners from a smooth map. So only corners are examined that are clearly less certain
//! than the others of their grid.

use std::collections::BTreeMap;

use glam::DVec2;

use crate::grid::local_map::{LocalMap, PLACE_PX, Shape};
use crate::tiling::{CHECKER, DELTILLE};
use deltille_core::detection::{Grid, GridCorner};
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::statistics::median;

/// Maximum distance of a corner from its prediction, in standard deviations.
const MAX_SIGMAS: f64 = 3.0;

/// Standard deviation of a corner, relative to the median of the grid, above which its residuals contain more than noise.
/// Without an occluder, corners of a grid differ by less, because each has a clear area of similar size.
const DOUBTFUL: f64 = 2.0;

/// Lattice distance within which a misplaced corner makes others seem misplaced.
const REACH: i32 = 2;

/// Removes the misplaced ones from the refined corners of a grid.
pub(crate) fn drop_misplaced(grid: &mut Grid) {
    let variance = |corner: &GridCorner| corner.cov.map(|cov| cov[0] + cov[2]);
    let Some(usual) = median(grid.corners.iter().filter_map(variance).collect()) else {
        return;
    };
    let is_doubtful = |corner| variance(corner).is_none_or(|own| own > DOUBTFUL.powi(2) * usual);
    let doubtful: Vec<bool> = grid.corners.iter().map(is_doubtful).collect();
    let mut is_misplaced = match grid.kind {
        GridKind::Deltille => misplaced::<DELTILLE>(&grid.corners, &doubtful),
        GridKind::Checker => misplaced::<CHECKER>(&grid.corners, &doubtful),
    }
    .into_iter();
    grid.corners.retain(|_| is_misplaced.next() != Some(true));
}

/// Returns for each corner whether it is misplaced. The worst in its surroundings is removed before the others are
/// examined again.
fn misplaced<const N: usize>(corners: &[GridCorner], doubtful: &[bool]) -> Vec<bool> {
    let mut found = vec![false; corners.len()];
    if !doubtful.contains(&true) {
        return found;
    }
    let vertex = |corner: &GridCorner| Vertex::new(corner.row, corner.col);
    let mut places: BTreeMap<Vertex, DVec2> =
        corners.iter().map(|corner| (vertex(corner), corner.position())).collect();
    let shape = Shape::of::<N>(places.keys().copied(), |v| places.get(&v).copied(), 0);
    loop {
        let off = |(i, corner): (usize, &GridCorner)| {
            let here = vertex(corner);
            let others = |v: Vertex| places.get(&v).copied().filter(|_| v != here);
            let map = LocalMap::about::<N>(here, others, shape)?;
            let sigma_px = (map.sigma * map.edge_px()).hypot(PLACE_PX);
            let sigmas = map.place.distance(corner.position()) / sigma_px;
            (sigmas > MAX_SIGMAS).then_some((i, here, sigmas))
        };
        let examined = corners.iter().enumerate().filter(|&(i, _)| doubtful[i] && !found[i]);
        let off: Vec<(usize, Vertex, f64)> = examined.filter_map(off).collect();
        let is_worst = |&&(i, here, sigmas): &&(usize, Vertex, f64)| {
            off.iter().all(|&(other, there, of_other)| {
                let step = there - here;
                let is_near = step.row.abs() <= REACH && step.col.abs() <= REACH;
                other == i || !is_near || (sigmas, i) > (of_other, other)
            })
        };
        let worst: Vec<usize> = off.iter().filter(is_worst).map(|&(i, ..)| i).collect();
        if worst.is_empty() {
            return found;
        }
        for i in worst {
            found[i] = true;
            places.remove(&vertex(&corners[i]));
        }
    }
}
