//! Meshes read back through the gltf and tobj crates, as other programs read them.

mod load;
mod stl;
mod view;

use glam::{DVec2, DVec3};

use deltille_core::raster::Gray;

pub(super) use load::load;
pub(super) use stl::{Facet, load_stl};
pub(super) use view::View;

/// A loaded mesh with one texture, in the target frame.
pub(super) struct Model {
    /// Its triangles.
    pub triangles: Vec<Triangle>,
    /// Its texture as grey values.
    pub texture: Gray<u8>,
}

/// A triangle as loaded, with the attributes of its three vertices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// Positions in the target frame, mm; counter-clockwise from outside.
    pub vertices_mm: [DVec3; 3],
    /// Stated normals in the target frame.
    pub normals: [DVec3; 3],
    /// Texture coordinates, 0 to 1: (0, 0) is the upper left corner of the texture, (1, 1) the lower
    /// right one.
    pub uv: [DVec2; 3],
}

impl Triangle {
    /// Normal that follows from the order of the vertices; its length is twice the area, mm².
    pub fn winding(&self) -> DVec3 {
        let [a, b, c] = self.vertices_mm;
        (b - a).cross(c - a)
    }

    /// Side of a pixel of the texture of this size, px, on the triangle, mm.
    pub fn texel_mm(&self, texture_px: DVec2) -> f64 {
        let [a, b, c] = self.uv.map(|uv| uv * texture_px);
        (self.winding().length() / (b - a).perp_dot(c - a).abs()).sqrt()
    }
}
