//! Settings and errors of meshes.

use std::io;

use deltille_core::targets::{ClosedMeshError, TargetError};
use deltille_core::words::counted;
use deltille_layout::artwork::ArtworkError;

/// Default depth of the inlay, mm: two layers of most printers.
pub const INLAY_MM: f64 = 0.4;

/// Minimum depth of an inlay, mm: no printer makes thinner layers.
pub const MIN_INLAY_MM: f64 = 0.05;

/// Default number of texels along the edge of a cell of a tag, enough for a sharp close-up view.
pub const TEXELS_PER_BIT: f64 = 20.0;

/// Maximum side of a texture, px, that graphics hardware of the last ten years accepts.
pub const MAX_TEXTURE_PX: u32 = 16_384;

/// Minimum number of texels along the edge of a cell: tags need 2 px per cell, and a camera blurs texels.
pub const MIN_TEXELS_PER_BIT: f64 = 4.0;

/// The same for squares. Their edges run along the rows and columns of texels, and interpolation rounds their ends.
pub const MIN_TEXELS_PER_SQUARE_BIT: f64 = 12.0;

/// Default thickness of a plate, mm.
pub const PLATE_MM: f64 = 3.0;

/// Error of making a mesh of a target.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The target is a list of corners or a sheet of tags.
    #[error("{0} is neither a board nor a solid, so it has no mesh")]
    NoShape(String),
    /// Several independent boards have no relative pose.
    #[error("{0} has {1} boards, and each needs its own mesh: make one at a time")]
    SeveralBoards(String, usize),
    /// A texture would be too large.
    #[error(
        "the texture would have {width} x {height} px, more than {MAX_TEXTURE_PX} on a side: {instead}"
    )]
    Texture {
        /// Width, px.
        width: u32,
        /// Height, px.
        height: u32,
        /// The remedy.
        instead: String,
    },
    /// The requested resolution is too low for sharp tags.
    #[error(
        "the texture would have {texels:.1} texels per {cell}, but at least {needed} are needed: set {least}"
    )]
    Unsharp {
        /// The feature that must be sharp.
        cell: &'static str,
        /// Texels per bit.
        texels: f64,
        /// The number needed.
        needed: f64,
        /// The minimum that suffices, in words: a resolution in the unit of the request or,
        /// if that helps, a number of textures.
        least: String,
    },
    /// More textures than faces, or none.
    #[error("the texture of {} cannot be split into {asked}: set {}", counted(*faces, "face"), up_to(*most))]
    Textures {
        /// Number of textures.
        asked: u32,
        /// Faces that carry a board.
        faces: usize,
        /// Maximum number of textures.
        most: u32,
    },
    /// A board with two sides, where one side is needed.
    #[error("{0} has two sides, but two-colour bodies have a board on one side only")]
    TwoSides(String),
    /// An invalid thickness of a plate.
    #[error("a plate cannot be {0} mm thick: set 0.1 to 1000 mm")]
    Thickness(f64),
    /// An inlay that is thinner than any printed layer.
    #[error("an inlay cannot be {0} mm deep: set {MIN_INLAY_MM} mm or more")]
    ThinInlay(f64),
    /// An inlay that is as deep as the plate, or that meets the inlay of another face.
    #[error("an inlay cannot be {inlay_mm} mm deep here: set less than {most_mm:.2} mm")]
    DeepInlay {
        /// Depth of the inlay, mm.
        inlay_mm: f64,
        /// Depth at which it reaches through the plate or meets another inlay, mm.
        most_mm: f64,
    },
    /// A solid that is not convex.
    #[error("{0} is not convex, so it cannot be exported as two bodies")]
    Dented(String),
    /// Shapes of the drawing cross each other.
    #[error("its outlines intersect each other, so it cannot be exported as two bodies")]
    Crossing,
    /// A skeleton is not a closed body.
    #[error("the skeleton does not form one closed body: {0}")]
    Skeleton(#[from] ClosedMeshError),
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

/// Resolution of a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Resolution {
    /// From [`TEXELS_PER_BIT`], limited by [`MAX_TEXTURE_PX`].
    #[default]
    Usual,
    /// Dots per inch on the target.
    Dpi(f64),
    /// Maximum side of a texture, px.
    Side(u32),
}

fn up_to(most: u32) -> String {
    if most == 1 { "1".to_owned() } else { format!("1 to {most}") }
}

/// Settings of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Meshing {
    /// Resolution of the textures.
    pub resolution: Resolution,
    /// Number of textures that share the faces, 1 to [`MAX_TEXTURES`](super::texture::MAX_TEXTURES).
    pub textures: u32,
    /// Thickness of the plate of a board, mm.
    pub plate_mm: f64,
    /// Depth of the dark parts, mm, if they are a separate body.
    pub inlay_mm: f64,
}

impl Default for Meshing {
    fn default() -> Self {
        let resolution = Resolution::Usual;
        Self { resolution, textures: 1, plate_mm: PLATE_MM, inlay_mm: INLAY_MM }
    }
}
