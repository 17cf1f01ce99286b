//! How a mesh is made, and why there is none.

use std::io;

use deltille_core::targets::{ClosedMeshError, TargetError};
use deltille_core::words::counted;
use deltille_layout::artwork::ArtworkError;

/// Depth of the inlay, mm, unless another is asked for: two layers of most printers.
pub const INLAY_MM: f64 = 0.4;

/// Thinnest inlay, mm: thinner ones are no layer of any printer.
pub const LEAST_INLAY_MM: f64 = 0.05;

/// Texels along the edge of a cell of a tag, unless another resolution is asked for, so that a viewer sees it sharp at
/// close range.
pub const TEXELS_PER_BIT: f64 = 20.0;

/// Longest side of a texture, px, that graphics hardware of the last ten years accepts.
pub const MAX_TEXTURE_PX: u32 = 16_384;

/// Least texels along the edge of a cell: tags are read from 2 px a cell on, and a camera may see no texel sharp.
pub const LEAST_TEXELS_PER_BIT: f64 = 4.0;

/// And of squares, whose edges run along its rows and columns: interpolation rounds their ends.
pub const LEAST_TEXELS_PER_SQUARE_BIT: f64 = 12.0;

/// Thickness of a plate, mm, unless another is asked for.
pub const PLATE_MM: f64 = 3.0;

/// Why a target has no mesh.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The target is known by its corners only, or is a sheet of tags.
    #[error("{0} was made neither as a board nor as a solid: it has no mesh")]
    NoShape(String),
    /// Several boards that lie about have no place beside each other.
    #[error("{0} has {1} boards, of which each is a mesh of its own: make one at a time")]
    SeveralBoards(String, usize),
    /// A texture would be too large.
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
        "the texture would have {texels:.1} texels per {cell}, at least {needed} are needed: give {least}"
    )]
    Unsharp {
        /// What must be sharp.
        cell: &'static str,
        /// Texels per bit.
        texels: f64,
        /// How many are needed.
        needed: f64,
        /// What would do: a resolution in the unit of what was asked for, or more textures.
        least: String,
    },
    /// More textures than faces, or none.
    #[error("the texture of {} cannot be split in {asked}: give {}", counted(*faces, "face"), up_to(*most))]
    Textures {
        /// Number of textures.
        asked: u32,
        /// Faces that carry a board.
        faces: usize,
        /// Most textures.
        most: u32,
    },
    /// A board with two sides where one is asked for.
    #[error("{0} has two sides: two bodies are printed with their board on one")]
    TwoSides(String),
    /// A thickness that no plate has.
    #[error("a plate cannot be {0} mm thick: give 0.1 to 1000 mm")]
    Thickness(f64),
    /// An inlay that is thinner than any layer.
    #[error("an inlay cannot be {0} mm deep: give {LEAST_INLAY_MM} mm or more")]
    ThinInlay(f64),
    /// An inlay that is as deep as the plate, or that meets that of another face.
    #[error("an inlay cannot be {inlay_mm} mm deep there: give less than {most_mm:.2} mm")]
    DeepInlay {
        /// Depth of the inlay, mm.
        inlay_mm: f64,
        /// Depth at which it reaches through the plate, or meets another, mm.
        most_mm: f64,
    },
    /// A solid that is not convex.
    #[error("{0} has faces that lean towards each other: it is not made as two bodies")]
    Dented(String),
    /// Shapes of the drawing cross each other.
    #[error("what is drawn on it crosses itself: it cannot be made as two bodies")]
    Crossing,
    /// A skeleton is no closed body.
    #[error("the skeleton cannot be made as one body: {0}")]
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

/// How finely a texture is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Resolution {
    /// By [`TEXELS_PER_BIT`], or as finely as [`MAX_TEXTURE_PX`] permits.
    #[default]
    Usual,
    /// Dots per inch on the target.
    Dpi(f64),
    /// No side of a texture is longer than this, px.
    Side(u32),
}

fn up_to(most: u32) -> String {
    if most == 1 { "1".to_owned() } else { format!("1 to {most}") }
}

/// How a mesh is made.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Meshing {
    /// Of the textures.
    pub resolution: Resolution,
    /// Among how many textures the faces are shared, 1 to [`MAX_TEXTURES`](super::texture::MAX_TEXTURES).
    pub textures: u32,
    /// Thickness of the plate of a board, mm.
    pub plate_mm: f64,
    /// Depth of what is dark, mm, where it is a body of its own.
    pub inlay_mm: f64,
}

impl Default for Meshing {
    fn default() -> Self {
        let resolution = Resolution::Usual;
        Self { resolution, textures: 1, plate_mm: PLATE_MM, inlay_mm: INLAY_MM }
    }
}
