//! The textured mesh of a solid, or of a plate with a board: the source of glTF, OBJ and scenes for simulators.

use glam::{DVec2, DVec3};

pub use super::meshing::{
    MAX_TEXTURE_PX, MIN_TEXELS_PER_BIT, MIN_TEXELS_PER_SQUARE_BIT, MeshError, Meshing, PLATE_MM,
    Resolution, TEXELS_PER_BIT,
};
use super::texture::{Finest, Picture, Surface, pictures};
use crate::export::GENERATOR;
use crate::export::pages::png;
use deltille_core::family::Family;
use deltille_core::lattice::GridKind;
use deltille_core::polygon::rectangle;
use deltille_core::targets::{Panel, SolidSpec, Target, TargetError, TargetSpec, triangles};

/// Cells along the edge of a tile without a tag, as if it had a small tag; messages call them eighths of a tile.
pub const UNTAGGED_CELLS: f64 = 8.0;

const TAGS_TOO_FINE: &str =
    "its tags would be blurred in a smaller texture; use fewer tiles, or a family with fewer bits";

const TILES_TOO_FINE: &str = "its tiles would be blurred in a smaller texture; use fewer tiles";

/// Number of triangles of a plate: two for each of its six sides.
pub const PLATE_TRIANGLES: usize = 12;

/// Specification and family of a target as JSON, for the metadata of its mesh.
pub fn extras(target: &Target) -> serde_json::Value {
    serde_json::json!({
        "generator": GENERATOR,
        "name": target.name,
        "spec": target.spec,
        "family": target.family,
    })
}

/// Triangles with textures, in the target frame, mm.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TexturedMesh {
    /// Name of the target.
    pub name: String,
    /// The triangles: those of the faces of a solid in the order of its panels, or those of a plate, the front first.
    /// The triangles of a texture are consecutive.
    pub faces: Vec<MeshFace>,
    /// The textures, all of the same resolution.
    pub textures: Vec<Texture>,
    /// Texels along the edge of the smallest cell of a tag; `None` without tags.
    pub texels_per_bit: Option<f64>,
    /// Specification and family of the target, for the metadata of the file.
    pub extras: serde_json::Value,
}

/// A texture of a mesh.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Texture {
    /// A grey 8-bit PNG file.
    pub png: Vec<u8>,
    /// Width and height, px.
    pub size_px: [u32; 2],
}

/// A triangle of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MeshFace {
    /// Vertices in the target frame, mm, counter-clockwise seen from outside.
    pub vertices_mm: [DVec3; 3],
    /// Unit normal, pointing outwards.
    pub normal: DVec3,
    /// Texture coordinates: (0,0) is the upper left corner of the texture, (1,1) the lower right.
    pub uv: [DVec2; 3],
    /// Index of the texture.
    pub texture: usize,
}

/// Position of a triangle on a texture.
#[derive(Clone, Copy)]
struct Textured {
    uv: [DVec2; 3],
    texture: usize,
}

impl MeshFace {
    fn new(vertices_mm: [DVec3; 3], Textured { uv, texture }: Textured) -> Self {
        let [a, b, c] = vertices_mm;
        Self { vertices_mm, normal: (b - a).cross(c - a).normalize(), uv, texture }
    }
}

/// The shape of a mesh.
#[derive(Clone, Copy)]
enum Shape<'a> {
    Solid(&'a SolidSpec),
    /// A plate for a board, on one side or on both.
    Plate(&'a [Panel]),
}

impl TexturedMesh {
    /// Makes the mesh of a solid, or of a plate with a board and its quiet zone. The front of the plate is the plane of the board.
    ///
    /// # Errors
    /// Returns an error if the target is neither, or has several boards, if the family of its tags is unknown, or if the texture
    /// would be too large, or too coarse for the tags.
    pub fn new(target: &Target, meshing: Meshing) -> Result<Self, MeshError> {
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
        let faces;
        let (surface, panels) = match shape {
            Shape::Plate(sides) => (Surface::Plate(sides), sides),
            Shape::Solid(spec) => {
                faces = spec.faces()?;
                (Surface::Faces(&faces), target.panels.as_slice())
            }
        };
        let cell_mm = smallest_cell_mm(target, target.family().map_err(TargetError::from)?);
        let is_square = target.panels.iter().any(|panel| panel.kind == GridKind::Checker);
        let needed = if is_square { MIN_TEXELS_PER_SQUARE_BIT } else { MIN_TEXELS_PER_BIT };
        let cell = match target.family {
            Some(_) => Finest { name: "tag bit", mm: cell_mm, needed, coarser: TAGS_TOO_FINE },
            None => {
                Finest { name: "eighth of a tile", mm: cell_mm, needed, coarser: TILES_TOO_FINE }
            }
        };
        let pictures = pictures(surface, meshing.textures, meshing.resolution, cell)?;
        let px_per_m = pictures.first().map_or(0.0, |first| f64::from(first.atlas.px_per_m));
        let (mut textures, mut textured) = (Vec::new(), Vec::new());
        for (texture, Picture { faces, atlas }) in pictures.into_iter().enumerate() {
            let sheet = atlas.drawn(target, panels.get(faces).unwrap_or_default())?;
            let png = png::to_bytes(&sheet, &target.name, px_per_m * 0.0254)?;
            textures.push(Texture { png, size_px: atlas.size_px });
            let size_mm = atlas.size_mm();
            let place = |corner: DVec2| {
                let part = corner / size_mm;
                DVec2::new(part.x, 1.0 - part.y)
            };
            let outlines = atlas.outlines_mm.iter();
            let corners = outlines.flat_map(|outline| triangles(outline));
            textured.extend(corners.map(|corners| Textured { uv: corners.map(place), texture }));
        }
        let faces = match shape {
            Shape::Solid(spec) => {
                let surface = spec.polyhedron().triangles_mm().into_iter();
                surface.zip(textured).map(|(mm, on)| MeshFace::new(mm, on)).collect()
            }
            Shape::Plate(sides) => plate_faces(sides, plate_mm, &textured, &textures),
        };
        let texels_per_bit = target.family.is_some().then_some(px_per_m * cell_mm / 1e3);
        let extras = extras(target);
        Ok(Self { name: name(), faces, textures, texels_per_bit, extras })
    }

    /// The triangles of a texture.
    pub fn faces_of(&self, texture: usize) -> impl Iterator<Item = &MeshFace> + Clone {
        self.faces.iter().filter(move |face| face.texture == texture)
    }
}

/// Edge of the smallest cell of a tag, mm, or of the equivalent part of a tile without a tag.
pub(super) fn smallest_cell_mm(target: &Target, family: Option<&Family>) -> f64 {
    let of_panel = |panel: &Panel| family.and_then(|family| family.of_tiling(panel.kind));
    let cells = |panel: &Panel| match (of_panel(panel), panel.border_bits) {
        (Some(family), Some(_)) => family.cells().width(panel.tag_inset_bits()),
        _ => UNTAGGED_CELLS,
    };
    let edges = target.panels.iter().map(|panel| panel.edge_mm / cells(panel));
    edges.fold(f64::INFINITY, f64::min)
}

/// The triangles of a plate: sides with boards have their texture, other sides the blank border of the last texture.
fn plate_faces(
    sides: &[Panel],
    thickness_mm: f64,
    textured: &[Textured],
    textures: &[Texture],
) -> Vec<MeshFace> {
    let around = rectangle(sides[0].field_mm());
    let before = around.map(|corner| sides[0].pose.target_from_panel(corner));
    let behind = before.map(|place| place - thickness_mm * sides[0].pose.matrix().z_axis);
    let [a, b, c, d] = behind;
    // The lower left corner, as seen from that side, is first.
    let back = [b, a, d, c];
    let last = textures.len() - 1;
    let white = DVec2::splat(BLANK_PX) / DVec2::from(textures[last].size_px.map(f64::from));
    let white = Textured { uv: [white; 3], texture: last };
    let two = |[p, q, r, s]: [DVec3; 4]| [[p, q, r], [p, r, s]];
    let rims = (0..4).map(|i| {
        let next = (i + 1) % 4;
        [before[next], before[i], behind[i], behind[next]]
    });
    let boards = [before, back].into_iter().take(sides.len()).flat_map(two);
    let blank = rims.chain([back].into_iter().skip(sides.len() - 1)).flat_map(two);
    boards
        .zip(textured)
        .map(|(vertices_mm, on)| MeshFace::new(vertices_mm, *on))
        .chain(blank.map(|vertices_mm| MeshFace::new(vertices_mm, white)))
        .collect()
}

/// A position in the blank border of a texture, px from its corner.
const BLANK_PX: f64 = 2.0;
