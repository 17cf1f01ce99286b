//! Predicts vertices of a grid, near by its local map and far away by its homography.

use glam::DVec2;

use super::local_map::{LocalMap, Shape};
use super::plane_map::PlaneMap;
use deltille_core::lattice::Vertex;

/// Maximum number of corners from which the homography is fitted. More hardly reduce its error.
const MOST_OF_PLANE: usize = 200;

/// Both maps of a grid.
pub(crate) struct Maps {
    pub shape: Shape,
    pub plane: Option<PlaneMap>,
}

impl Maps {
    /// Creates the maps of a grid of corners with N rays, found on levels of the pyramid up to `level`.
    pub(crate) fn of<const N: usize>(
        vertices: impl ExactSizeIterator<Item = Vertex> + Clone,
        at: impl Fn(Vertex) -> Option<DVec2>,
        level: usize,
    ) -> Self {
        let shape = Shape::of::<N>(vertices.clone(), &at, level);
        let every = vertices.len().div_ceil(MOST_OF_PLANE).max(1);
        let corners: Vec<(Vertex, DVec2)> =
            vertices.step_by(every).filter_map(|v| Some((v, at(v)?))).collect();
        Self { shape, plane: PlaneMap::of(&corners, shape) }
    }

    /// Returns the map about a vertex whose standard deviation is at most `sigma` edges.
    pub(crate) fn about<const N: usize>(
        &self,
        vertex: Vertex,
        at: impl Fn(Vertex) -> Option<DVec2>,
        sigma: f64,
    ) -> Option<LocalMap> {
        let is_known = |map: &LocalMap| map.sigma <= sigma;
        let local = LocalMap::about::<N>(vertex, at, self.shape).filter(is_known);
        local.or_else(|| self.plane.as_ref()?.about(vertex).filter(is_known))
    }
}
