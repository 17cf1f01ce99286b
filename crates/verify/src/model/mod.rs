//! Meshes read back through the gltf and tobj crates, as other programs read them.

mod load;
mod stl;
mod view;

use glam::{DVec2, DVec3};

use deltille_core::raster::Gray;

pub(super) use load::load;
pub(super) use stl::{Facet, load_stl};
pub(super) use view::View;

/// A loaded mesh: textured triangles, mm.
pub(super) struct Model {
    pub triangles: Vec<Triangle>,
    pub texture: Gray<u8>,
}

/// A triangle as loaded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub vertices_mm: [DVec3; 3],
    pub normals: [DVec3; 3],
    /// (0,0) is the upper left corner of the texture.
    pub uv: [DVec2; 3],
}

impl Triangle {
    /// Normal by the order of the vertices, of any length.
    pub fn winding(&self) -> DVec3 {
        let [a, b, c] = self.vertices_mm;
        (b - a).cross(c - a)
    }
}
