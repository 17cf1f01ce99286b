//! The textured mesh of a solid, from which glTF, OBJ and STL are written.

use std::io;

use glam::{DVec2, DVec3};

use super::{GENERATOR, png};
use deltille_core::artwork::{ArtworkError, Atlas};
use deltille_core::family::Family;
use deltille_core::targets::{Target, TargetError, TargetSpec};

/// Least texels along the edge of a cell of a tag, so that a viewer sees it sharp at close range.
pub const TEXELS_PER_BIT: f64 = 20.0;

/// Longest side of a texture, px, that graphics hardware of the last ten years accepts.
pub const MAX_TEXTURE_PX: u32 = 16_384;

/// Why a target has no mesh.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The target is flat, or known by its corners only.
    #[error("{0} was not made as a solid: it has no mesh")]
    NotSolid(String),
    /// The texture would be too large.
    #[error(
        "the texture would have {width} x {height} px, more than {MAX_TEXTURE_PX} a side: {instead}"
    )]
    Texture {
        /// Width, px.
        width: u32,
        /// Height, px.
        height: u32,
        /// What to do.
        instead: String,
    },
    /// The requested resolution leaves the tags unsharp.
    #[error(
        "{dpi} dpi are {texels:.1} texels per tag bit, at least {TEXELS_PER_BIT} are \
         needed: give {least} or more"
    )]
    Unsharp {
        /// Resolution asked for, dots per inch.
        dpi: f64,
        /// Texels per bit.
        texels: f64,
        /// Least sufficient resolution, dots per inch.
        least: u32,
    },
    /// The faces cannot be made.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// The faces cannot be drawn.
    #[error(transparent)]
    Artwork(#[from] ArtworkError),
    /// The texture cannot be encoded.
    #[error("cannot encode the texture: {0}")]
    Encode(#[from] io::Error),
}

/// Specification and family of a target as JSON, for the metadata of its mesh.
pub fn extras(target: &Target) -> serde_json::Value {
    serde_json::json!({
        "generator": GENERATOR,
        "name": target.name,
        "spec": target.spec,
        "family": target.family,
    })
}

/// Triangles with a texture, in the target frame, mm.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TexturedMesh {
    /// Name of the target.
    pub name: String,
    /// The faces, in the order of the panels.
    pub faces: Vec<MeshFace>,
    /// The texture as a grey 8-bit PNG file.
    pub texture_png: Vec<u8>,
    /// Width and height of the texture, px.
    pub texture_px: [u32; 2],
    /// Specification and family of the target, for the metadata of the file.
    pub extras: serde_json::Value,
}

/// A triangular face of the solid.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MeshFace {
    /// Vertices in the target frame, mm, counter-clockwise seen from outside.
    pub vertices_mm: [DVec3; 3],
    /// Unit normal, pointing outwards.
    pub normal: DVec3,
    /// Texture coordinates: (0,0) is the upper left corner of the picture, (1,1) the lower right.
    pub uv: [DVec2; 3],
}

impl TexturedMesh {
    /// Makes the mesh of a solid. `dpi` is the resolution of the texture in dots per inch on the
    /// solid; by default it is that of [`TEXELS_PER_BIT`].
    ///
    /// # Errors
    /// When the target is not a solid, its family is missing, or the texture would be too large or
    /// too coarse for the tags.
    pub fn new(
        target: &Target,
        family: Option<&Family>,
        dpi: Option<f64>,
    ) -> Result<Self, MeshError> {
        let TargetSpec::Solid(spec) = &target.spec else {
            return Err(MeshError::NotSolid(target.name.to_string()));
        };
        let faces = spec.faces()?;
        let rows = family.map_or(0, |family| family.dimension().rows());
        let bits = f64::from(rows) + 3.0 * spec.tags.border_bits;
        let finest = faces.iter().map(|face| face.tile_edge_mm).fold(f64::INFINITY, f64::min);
        let least_per_m = 1e3 * TEXELS_PER_BIT * bits / finest;
        let per_m = dpi.map_or(least_per_m, |dpi| dpi / 0.0254);
        // A resolution in whole dots per inch may be the least one, rounded.
        if per_m < least_per_m * (1.0 - 1e-9) {
            let texels = TEXELS_PER_BIT * per_m / least_per_m;
            let least = (least_per_m * 0.0254).ceil() as u32;
            return Err(MeshError::Unsharp { dpi: dpi.unwrap_or_default(), texels, least });
        }
        let px_per_m = per_m.ceil().min(f64::from(u32::MAX)) as u32;
        let atlas = Atlas::new(target, &faces, family, px_per_m)?;
        let [width, height] = atlas.size_px;
        if width.max(height) > MAX_TEXTURE_PX {
            let instead = match dpi {
                Some(_) => "choose a lower resolution".to_owned(),
                None => "take fewer `SolidSpec::tiles`, or a family of fewer bits".to_owned(),
            };
            return Err(MeshError::Texture { width, height, instead });
        }
        let solid = spec.polyhedron();
        let size_mm = DVec2::new(atlas.sheet.width_mm, atlas.sheet.height_mm);
        let mesh_face = |index: usize| {
            let vertices_mm = solid.triangle_mm(index);
            let [a, b, c] = vertices_mm;
            MeshFace {
                vertices_mm,
                normal: (b - a).cross(c - a).normalize(),
                uv: atlas.outlines_mm[index].map(|corner| {
                    let part = corner / size_mm;
                    DVec2::new(part.x, 1.0 - part.y)
                }),
            }
        };
        Ok(Self {
            name: target.name.to_string(),
            faces: (0..faces.len()).map(mesh_face).collect(),
            texture_png: png::to_bytes(&atlas.sheet, &target.name, f64::from(px_per_m) * 0.0254)?,
            texture_px: atlas.size_px,
            extras: extras(target),
        })
    }
}
