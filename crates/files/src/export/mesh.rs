//! The textured mesh of a solid, or of a plate with a board, from which glTF, OBJ and scenes for simulators are written.

use std::io;

use glam::{DVec2, DVec3};

use super::inlay::{INLAY_MM, LEAST_INLAY_MM};
use super::{GENERATOR, png};
use deltille_core::artwork::{ArtworkError, Atlas};
use deltille_core::family::Family;
use deltille_core::lattice::GridKind;
use deltille_core::polygon::rectangle;
use deltille_core::targets::{
    ClosedMeshError, Panel, SolidSpec, Target, TargetError, TargetSpec, triangles,
};

/// Texels along the edge of a cell of a tag, unless another resolution is asked for, so that a viewer sees it sharp at
/// close range.
pub const TEXELS_PER_BIT: f64 = 20.0;

/// Least texels along the edge of a cell: tags are read from 2 px a cell on, and a camera may see no texel sharp.
pub const LEAST_TEXELS_PER_BIT: f64 = 4.0;

/// And of squares, whose edges run along its rows and columns: interpolation rounds their ends.
pub const LEAST_TEXELS_PER_SQUARE_BIT: f64 = 12.0;

/// Longest side of a texture, px, that graphics hardware of the last ten years accepts.
pub const MAX_TEXTURE_PX: u32 = 16_384;

/// Cells along the edge of a tile without a tag, as if it had a small one.
pub const UNTAGGED_CELLS: f64 = 8.0;

/// Triangles of a plate: the front in two, and as many for each of the other five sides.
pub const PLATE_TRIANGLES: usize = 12;

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
        "the texture would have {texels:.1} texels per tag bit, at least {needed} are needed: give {least} or more"
    )]
    Unsharp {
        /// Texels per bit.
        texels: f64,
        /// How many are needed.
        needed: f64,
        /// Least sufficient resolution, in the unit of what was asked for.
        least: String,
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
    /// No side of the texture is longer than this, px.
    Side(u32),
}

/// How a mesh is made.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Meshing {
    /// Of the texture.
    pub resolution: Resolution,
    /// Thickness of the plate of a board, mm.
    pub plate_mm: f64,
    /// Depth of what is dark, mm, where it is a body of its own.
    pub inlay_mm: f64,
}

impl Default for Meshing {
    fn default() -> Self {
        Self { resolution: Resolution::Usual, plate_mm: PLATE_MM, inlay_mm: INLAY_MM }
    }
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
    /// The triangles: those of the faces of a solid in the order of its panels, or those of a plate, the front first.
    pub faces: Vec<MeshFace>,
    /// The texture as a grey 8-bit PNG file.
    pub texture_png: Vec<u8>,
    /// Width and height of the texture, px.
    pub texture_px: [u32; 2],
    /// Texels along the edge of the smallest cell of a tag; `None` where there are no tags.
    pub texels_per_bit: Option<f64>,
    /// Specification and family of the target, for the metadata of the file.
    pub extras: serde_json::Value,
}

/// A triangle of the mesh.
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

impl MeshFace {
    fn new(vertices_mm: [DVec3; 3], uv: [DVec2; 3]) -> Self {
        let [a, b, c] = vertices_mm;
        Self { vertices_mm, normal: (b - a).cross(c - a).normalize(), uv }
    }
}

/// What has the shape of a mesh.
#[derive(Clone, Copy)]
enum Shape<'a> {
    Solid(&'a SolidSpec),
    /// A plate for a board, on one side or on both.
    Plate(&'a [Panel]),
}

impl TexturedMesh {
    /// Makes the mesh of a solid, or of a plate with a board, its quiet zone around it, whose front is the board's plane.
    ///
    /// # Errors
    /// When the target is neither, or is several boards, its family is missing, or the texture would be too large, or
    /// too coarse for the tags.
    pub fn new(
        target: &Target,
        family: Option<&Family>,
        meshing: Meshing,
    ) -> Result<Self, MeshError> {
        let name = || target.name.to_string();
        let shape = match (&target.spec, target.panels.as_slice()) {
            (TargetSpec::Solid(spec), _) => Shape::Solid(spec),
            (spec, panels) if spec.is_on_plate() && (panels.len() == 1 || spec.is_rigid()) => {
                Shape::Plate(panels)
            }
            (TargetSpec::Board(_), panels) => {
                return Err(MeshError::SeveralBoards(name(), panels.len()));
            }
            _ => return Err(MeshError::NoShape(name())),
        };
        let plate_mm = target.spec.two_sided_mm().unwrap_or(meshing.plate_mm);
        if !(0.1..=1000.0).contains(&plate_mm) {
            return Err(MeshError::Thickness(plate_mm));
        }
        let atlas = |px_per_m: u32| match shape {
            Shape::Plate(sides) => Ok(Atlas::of_plate(target, sides, family, px_per_m)?),
            Shape::Solid(spec) => Ok(Atlas::new(target, &spec.faces()?, family, px_per_m)?),
        };
        let cell_mm = smallest_cell_mm(target, family);
        let is_square = target.panels.iter().any(|panel| panel.kind == GridKind::Checker);
        let needed = if is_square { LEAST_TEXELS_PER_SQUARE_BIT } else { LEAST_TEXELS_PER_BIT };
        let atlas = drawn(atlas, meshing.resolution, (cell_mm, needed))?;
        let size_mm = DVec2::new(atlas.sheet.width_mm, atlas.sheet.height_mm);
        let front =
            atlas.outlines_mm.iter().flat_map(|outline| triangles(outline)).map(|triangle| {
                triangle.map(|corner| {
                    let part = corner / size_mm;
                    DVec2::new(part.x, 1.0 - part.y)
                })
            });
        let faces = match shape {
            Shape::Solid(spec) => {
                let surface = spec.polyhedron().triangles_mm();
                surface.into_iter().zip(front).map(|(mm, uv)| MeshFace::new(mm, uv)).collect()
            }
            Shape::Plate(sides) => plate_faces(sides, plate_mm, &front.collect::<Vec<_>>(), &atlas),
        };
        let px_per_m = f64::from(atlas.px_per_m);
        Ok(Self {
            name: name(),
            faces,
            texture_png: png::to_bytes(&atlas.sheet, &target.name, px_per_m * 0.0254)?,
            texture_px: atlas.size_px,
            texels_per_bit: target.family.is_some().then_some(px_per_m * cell_mm / 1e3),
            extras: extras(target),
        })
    }
}

/// Edge of the smallest cell of a tag, mm, or what would be one.
fn smallest_cell_mm(target: &Target, family: Option<&Family>) -> f64 {
    let of_panel = |panel: &Panel| family.and_then(|family| family.of_tiling(panel.kind));
    let cells = |panel: &Panel| match (of_panel(panel), panel.border_bits) {
        (Some(family), Some(_)) => family.cells().width(panel.tag_inset_bits()),
        _ => UNTAGGED_CELLS,
    };
    let edges = target.panels.iter().map(|panel| panel.edge_mm / cells(panel));
    edges.fold(f64::INFINITY, f64::min)
}

/// The atlas at the resolution that was asked for, of cells of this size in mm, which need so many texels.
fn drawn(
    atlas: impl Fn(u32) -> Result<Atlas, MeshError>,
    resolution: Resolution,
    (cell_mm, needed): (f64, f64),
) -> Result<Atlas, MeshError> {
    // Pixels per metre that so many texels a cell are.
    let per_m = |texels: f64| 1e3 * texels / cell_mm;
    let whole = |per_m: f64| per_m.ceil().clamp(1.0, u32::MAX.into()) as u32;
    let atlas = match resolution {
        Resolution::Usual => {
            let usual = atlas(whole(per_m(TEXELS_PER_BIT)))?;
            match usual.size_px.into_iter().max() {
                Some(side) if side > MAX_TEXTURE_PX => within(usual, MAX_TEXTURE_PX, &atlas)?,
                _ => usual,
            }
        }
        Resolution::Dpi(dpi) => atlas(whole(dpi / 0.0254))?,
        Resolution::Side(side) => {
            let usual = atlas(whole(per_m(TEXELS_PER_BIT)))?;
            within(usual, side.min(MAX_TEXTURE_PX), &atlas)?
        }
    };
    let [width, height] = atlas.size_px;
    // A resolution in whole dots per inch may be the least one, rounded.
    let texels = f64::from(atlas.px_per_m) * cell_mm / 1e3;
    if texels < needed * (1.0 - 1e-9) {
        // And some for spaces, which are in px.
        let more = 1.02 * needed / texels;
        let least = match resolution {
            Resolution::Side(_) | Resolution::Usual => {
                format!("{:.0} px", (f64::from(width.max(height)) * more).ceil())
            }
            Resolution::Dpi(_) => {
                format!("{:.0} dpi", (per_m(needed) * 0.0254).ceil())
            }
        };
        return Err(match resolution {
            Resolution::Usual => too_large(width, height, TOO_MANY_CELLS),
            _ => MeshError::Unsharp { texels, needed, least },
        });
    }
    match width.max(height) > MAX_TEXTURE_PX {
        true => Err(too_large(width, height, "choose a lower resolution")),
        false => Ok(atlas),
    }
}

const TOO_MANY_CELLS: &str =
    "its tags would be unsharp in a smaller one; take fewer tiles, or a family of fewer bits";

fn too_large(width: u32, height: u32, instead: &str) -> MeshError {
    MeshError::Texture { width, height, instead: instead.to_owned() }
}

/// The finest atlas whose sides have no more than `side` px. Space between faces is in px, so that sizes are not quite
/// in proportion to the resolution.
fn within(
    first: Atlas,
    side: u32,
    atlas: impl Fn(u32) -> Result<Atlas, MeshError>,
) -> Result<Atlas, MeshError> {
    let longest = |atlas: &Atlas| atlas.size_px.into_iter().max().unwrap_or(1);
    let mut found = first;
    for _ in 0..MOST_ATTEMPTS {
        let is = longest(&found);
        if is <= side && f64::from(is) > CLOSE * f64::from(side) {
            break;
        }
        let part = CLOSE.midpoint(1.0) * f64::from(side) / f64::from(is);
        found = atlas((f64::from(found.px_per_m) * part).max(1.0) as u32)?;
    }
    Ok(found)
}

/// A texture that is so much of the longest side is as large as can be.
const CLOSE: f64 = 0.99;

/// Each attempt is nearer by the part that spaces are of the whole.
const MOST_ATTEMPTS: usize = 12;

/// The triangles of a plate: sides with boards with their texture, others in the colour of the texture's border.
fn plate_faces(
    sides: &[Panel],
    thickness_mm: f64,
    textured: &[[DVec2; 3]],
    atlas: &Atlas,
) -> Vec<MeshFace> {
    let around = rectangle(sides[0].field_mm());
    let before = around.map(|corner| sides[0].pose.target_from_panel(corner));
    let behind = before.map(|place| place - thickness_mm * sides[0].pose.matrix().z_axis);
    let [a, b, c, d] = behind;
    // Lower left end first, as the board on that side is seen.
    let back = [b, a, d, c];
    let white = DVec2::splat(BLANK_PX) / DVec2::from(atlas.size_px.map(f64::from));
    let two = |[p, q, r, s]: [DVec3; 4]| [[p, q, r], [p, r, s]];
    let rims = (0..4).map(|i| {
        let next = (i + 1) % 4;
        [before[next], before[i], behind[i], behind[next]]
    });
    let boards = [before, back].into_iter().take(sides.len()).flat_map(two);
    let blank = rims.chain([back].into_iter().skip(sides.len() - 1)).flat_map(two);
    boards
        .zip(textured)
        .map(|(vertices_mm, uv)| MeshFace::new(vertices_mm, *uv))
        .chain(blank.map(|vertices_mm| MeshFace::new(vertices_mm, [white; 3])))
        .collect()
}

/// A place in the blank border of a texture, px from its corner.
const BLANK_PX: f64 = 2.0;
