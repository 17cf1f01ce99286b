//! Finds a corner in the frame of its neighbours.
//!
//! Near the edge of a fisheye image, tiles become strips a few pixels wide that meet at 15°. No
//! circle around a corner of these tiles shows only the sectors of that corner. Its neighbours
//! predict two edges. The image is resampled so that these have the lengths and the angle of the
//! print. The corner then looks like any other.
//!
//! ```text
//!      ╱░░╱██╱                          ░░│██
//!     ╱░░·██╱     patch_from_image      ──·──
//!    ╱██╱░░╱      ───────────────→      ██│░░
//! ```

use std::f64::consts::TAU;

use glam::DVec2;
use nalgebra::{Matrix2, Vector2};

use crate::corners::saddles::{Saddle, SaddleFinder};
use crate::corners::sectors::Sectors;
use deltille_core::raster::{Gray, Pyramid};

/// Lengths of an edge in the patch, px, in the order in which they are tried. The widest fit of the
/// finder reaches 8 px and stays within the tiles around the corner. The usual fit stays within the
/// area that tags leave clear on a longer edge.
const EDGES_PX: [f64; 2] = [16.0, 28.0];

/// Maximum distance of a corner from its predicted position, as a fraction of an edge. If each tile
/// is a third as large as the previous one, extrapolated rows are off by this much, and still no
/// other corner is nearer.
const MAX_WAY: f64 = 0.5;

/// Reach of the widest fit, px.
const FIT_REACH_PX: f64 = 9.0;

/// Minimum ratio of the axes of a view. A view with a smaller ratio shows nothing that the image
/// does not show, too: sectors seen at 45° are still 40° wide.
const MIN_STRETCH: f64 = 1.5;

/// An affine view of the surroundings of a position.
pub(crate) struct Rectified {
    place: DVec2,
    edge_px: f64,
    image_from_patch: Matrix2<f64>,
}

impl Rectified {
    /// Returns the views around `place`, smaller and larger, in which two edges have the lengths
    /// and the angle of the print. These are edge `k` of the lattice, seen along `edges[0]`, and
    /// the next one counter-clockwise, along `edges[1]`. Returns `None` if they are collinear.
    pub(crate) fn views<const N: usize>(
        place: DVec2,
        k: usize,
        edges: [DVec2; 2],
    ) -> [Option<Self>; 2] {
        EDGES_PX.map(|edge_px| Self::new::<N>(place, k, edges, edge_px))
    }

    fn new<const N: usize>(
        place: DVec2,
        k: usize,
        edges: [DVec2; 2],
        edge_px: f64,
    ) -> Option<Self> {
        // Image angles fall counter-clockwise on the print.
        let direction = |k: usize| {
            let angle = -TAU * k as f64 / N as f64;
            edge_px * Vector2::new(angle.cos(), angle.sin())
        };
        let patch = Matrix2::from_columns(&[direction(k), direction(k + 1)]);
        let image = Matrix2::from_columns(&edges.map(|edge| edge.to_array().into()));
        let image_from_patch = image * patch.try_inverse()?;
        // A mirrored view is not a view of this print.
        (image_from_patch.determinant() > 0.0).then_some(Self { place, edge_px, image_from_patch })
    }

    /// Returns whether the patch shows more than a level of the pyramid: tiles that are narrow or
    /// too small on that level.
    fn shows_more(&self, level: usize) -> bool {
        let axes = self.image_from_patch.singular_values() / f64::from(1u32 << level);
        axes[1] < 1.0 || axes[0] > MIN_STRETCH * axes[1]
    }

    /// Returns the nearest accepted corner about the position, as a level of the pyramid shows it, if the patch shows
    /// more than that level.
    pub(crate) fn find<const N: usize, S>(
        &self,
        finder: &SaddleFinder<N>,
        pyramid: &Pyramid,
        level: usize,
        accept: impl Fn(Saddle<N>) -> Option<S>,
    ) -> Option<S> {
        if !self.shows_more(level) {
            return None;
        }
        let image = &pyramid.levels()[level];
        // The search needs that reach plus the displacement.
        let way_px = MAX_WAY * self.edge_px;
        let half_side = (FIT_REACH_PX + way_px) as usize + 1;
        let centre = DVec2::splat(half_side as f64);
        let in_level_0 = |at: DVec2| self.place + self.way_in_image(at - centre);
        let in_image = |at: DVec2| Pyramid::from_level_0(level, in_level_0(at));
        let side = 2 * half_side + 1;
        let inside = [[0, 0], [side, 0], [0, side], [side, side]].into_iter().all(|[x, y]| {
            let at = in_image(DVec2::new(x as f64, y as f64));
            at.x >= 0.0
                && at.y >= 0.0
                && at.x < (image.width() - 1) as f64
                && at.y < (image.height() - 1) as f64
        });
        if !inside {
            return None;
        }
        let origin = in_image(DVec2::ZERO);
        let [right, below] = [DVec2::X, DVec2::Y].map(|step| in_image(step) - origin);
        let patch = Gray::from_fn(side, side, |x, y| {
            let at = origin + x as f64 * right + y as f64 * below;
            (image.bilinear_inside(at.x, at.y) + 0.5) as i16
        });
        let turned = |ray: f64| self.way_in_image(DVec2::from_angle(ray)).to_angle();
        finder.near_in(&patch, centre, way_px, |found| {
            let sectors = Sectors { rays: found.sectors.rays.map(turned), ..found.sectors };
            accept(Saddle { position: in_level_0(found.position), sectors, level })
        })
    }

    /// Converts a displacement from the patch to the image, px.
    fn way_in_image(&self, way: DVec2) -> DVec2 {
        let seen = self.image_from_patch * Vector2::new(way.x, way.y);
        DVec2::new(seen.x, seen.y)
    }
}
