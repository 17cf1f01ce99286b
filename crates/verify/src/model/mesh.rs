//! A loaded mesh with its textures.

use glam::{DVec2, DVec3};

use deltille_core::raster::Gray;

/// A loaded mesh with its textures, in the target frame.
pub(crate) struct Model {
    /// Its triangles, each with an existing texture.
    pub triangles: Vec<Triangle>,
    /// Its textures as grey values.
    pub textures: Vec<Gray<u8>>,
}

impl Model {
    /// Returns the texture of a triangle, and its size, px.
    pub(crate) fn texture(&self, triangle: &Triangle) -> (&Gray<u8>, DVec2) {
        let texture = &self.textures[triangle.texture];
        (texture, DVec2::new(texture.width() as f64, texture.height() as f64))
    }

    /// Returns the size of a texture pixel on a triangle, mm.
    pub(crate) fn texel_mm(&self, triangle: &Triangle) -> f64 {
        let (_, size_px) = self.texture(triangle);
        let [a, b, c] = triangle.uv.map(|uv| uv * size_px);
        (triangle.winding().length() / (b - a).perp_dot(c - a).abs()).sqrt()
    }
}

/// A triangle as loaded, with the attributes of its three vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    /// Positions in the target frame, mm; counter-clockwise from outside.
    pub vertices_mm: [DVec3; 3],
    /// Stated normals in the target frame.
    pub normals: [DVec3; 3],
    /// Texture coordinates, 0 to 1: (0, 0) is the upper left corner of the texture, (1, 1) the lower right corner.
    pub uv: [DVec2; 3],
    /// Index of its texture.
    pub texture: usize,
}

impl Triangle {
    /// Returns the normal given by the order of the vertices; its length is twice the area, mm².
    pub(crate) fn winding(&self) -> DVec3 {
        let [a, b, c] = self.vertices_mm;
        (b - a).cross(c - a)
    }
}
