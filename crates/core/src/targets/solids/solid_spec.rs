//! The specification of a solid.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::lattice::GridKind;
use crate::setting::Setting::{
    SolidBoardId, SolidEdgeMm, SolidMarginMm, SolidShapeCuboid, SolidShapeMesh, SolidSquareTags,
    SolidTiles,
};
use crate::targets::boards::board_spec::EDGE_MM;
use crate::targets::length::format_mm;
use crate::targets::{ClosedMesh, Polyhedron, SkeletonSpec, TagSpec, TagsIn, TargetError};

/// Range of a solid's edge, mm.
const SOLID_EDGE_MM: std::ops::RangeInclusive<f64> = 10.0..=5000.0;

/// Range of tiles along a side of a face: with fewer than six a face has at most six corners, too few for the
/// detector to accept as a grid.
pub const FACE_TILES: std::ops::RangeInclusive<u32> = 6..=200;

/// Least margin of a face with white tiles on black, mm: it contains the black around the tiles, and the numbers of
/// the face outside that.
const MIN_INVERTED_MARGIN_MM: f64 = 5.0;

/// Usual margins of a face, mm: room to fold and glue; the second is for white tiles on black.
const MARGIN_MM: f64 = 5.0;

const INVERTED_MARGIN_MM: f64 = 8.0;

/// Fraction of the margin of a face with white tiles that is black.
const RIM_PART: f64 = 0.4;

/// Largest distance of a mesh from its origin, mm: meshes and bodies are written in single precision, which resolves
/// 0.01 mm at 100 m.
const FARTHEST_MM: f64 = 1e5;

/// Maximum number of triangles of all faces: mesh files index their corners with 16 bits.
const MAX_TRIANGLES: usize = 20_000;

/// Maximum number of faces of a solid.
const MAX_FACES: u32 = 10_000;

/// A solid whose faces carry boards with tags: triangles of deltille tiles on triangular faces, checkerboards
/// on rectangular ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolidSpec {
    /// The shape of the solid.
    pub shape: SolidShape,
    /// Length of the solid's edges, mm. A cuboid or mesh is scaled so that this is the mean length.
    pub edge_mm: f64,
    /// Number of black tiles along each side of a triangle, and of squares along the shortest side of all rectangles;
    /// 6 to 200.
    pub tiles: u32,
    /// Margin between a face's edges and its tiles, mm.
    pub margin_mm: f64,
    /// Id of the first face's board; the others follow in the order of the faces.
    pub board_id: u32,
    /// The tags; `None` for bare tilings, whose faces cannot be distinguished.
    pub tags: Option<TagSpec>,
    /// The tags of rectangular faces, if other faces have deltille tiles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub square_tags: Option<TagSpec>,
    /// Whether black and white are inverted: white tiles on a black field, which uses part of the margin.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub inverted: bool,
    /// A frame for the faces as panels, if one is to be printed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skeleton: Option<SkeletonSpec>,
}

/// The solids; see [`Polyhedron`](crate::targets::Polyhedron) for the order of the faces of regular ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum SolidShape {
    /// Four faces.
    Tetrahedron,
    /// Eight faces.
    Octahedron,
    /// Twenty faces.
    Icosahedron,
    /// Six square faces.
    Cube,
    /// Six rectangular faces: the sides along x, y and z, to be scaled to the mean edge.
    Cuboid(DVec3),
    /// Any other shape, given by its faces.
    Mesh(ClosedMesh),
}

impl SolidShape {
    /// Returns the name of the shape.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Tetrahedron => "tetrahedron",
            Self::Octahedron => "octahedron",
            Self::Icosahedron => "icosahedron",
            Self::Cube => "cube",
            Self::Cuboid(_) => "cuboid",
            Self::Mesh(_) => "mesh",
        }
    }
}

impl SolidSpec {
    /// Returns the shape and size in words.
    pub fn size(&self) -> String {
        match &self.shape {
            SolidShape::Cuboid(sides) => {
                let sides = *sides * (self.edge_mm / mean_side(*sides));
                let [x, y, z] = sides.to_array().map(format_mm);
                let [x, y] = [&x, &y].map(|side| side.trim_end_matches(" mm"));
                format!("cuboid {x} × {y} × {z}")
            }
            shape => format!("{} edge {}", shape.name(), format_mm(self.edge_mm)),
        }
    }
}

impl SolidShape {
    /// Returns the tiling that [`SolidSpec::tags`] refers to: squares if all faces are rectangles.
    pub fn tag_tiling(&self) -> GridKind {
        if self.tilings()[0] { GridKind::Deltille } else { GridKind::Checker }
    }

    /// Returns whether some faces have deltille tiles, and whether some have squares.
    fn tilings(&self) -> [bool; 2] {
        match self {
            Self::Cube | Self::Cuboid(_) => [false, true],
            Self::Mesh(mesh) => {
                let (vertices_mm, faces) = (mesh.vertices().to_vec(), mesh.faces().to_vec());
                let solid = Polyhedron { vertices_mm, faces };
                let has = |kind| (0..solid.faces.len()).any(|face| solid.tiling(face) == kind);
                [GridKind::Deltille, GridKind::Checker].map(has)
            }
            _ => [true, false],
        }
    }
}

impl SolidSpec {
    /// Shortest edge, mm.
    pub const MIN_EDGE_MM: f64 = *SOLID_EDGE_MM.start();

    /// Fewest tiles along a side of a face.
    pub const MIN_TILES: u32 = *FACE_TILES.start();

    /// Finest edge of a tile, mm: what [`BoardSpec`](crate::targets::BoardSpec) allows.
    pub const MIN_TILE_MM: f64 = *EDGE_MM.start();

    /// Creates a solid with edges of 150 mm; a cuboid or mesh keeps its own size. A face has ten
    /// tiles along a side (the tags on a triangle are then arranged symmetrically), or eight
    /// squares. A blank margin of 5 mm along its edges leaves room to fold and glue.
    pub fn new(shape: SolidShape) -> Self {
        let squares = || TagSpec::for_squares(TagsIn::Black);
        let (tags, square_tags) = match shape.tilings() {
            [false, _] => (Some(squares()), None),
            [true, has_squares] => (Some(TagSpec::default()), has_squares.then(squares)),
        };
        let edge_mm = match &shape {
            SolidShape::Mesh(mesh) => mesh.mean_edge(),
            SolidShape::Cuboid(sides) => mean_side(*sides),
            _ => 150.0,
        };
        // A square has room for more corners and tags than a triangle, so its tiles may be larger.
        let tiles = if shape.tilings()[0] { 10 } else { 8 };
        let (margin_mm, board_id, inverted, skeleton) = (MARGIN_MM, 0, false, None);
        Self { shape, edge_mm, tiles, margin_mm, board_id, tags, square_tags, inverted, skeleton }
    }

    /// Returns the margin unless a skeleton needs more, mm.
    pub(in crate::targets) fn usual_margin_mm(&self) -> f64 {
        if self.inverted { INVERTED_MARGIN_MM } else { MARGIN_MM }
    }

    /// Returns the width of the black around the tiles, mm; `None` for black tiles on white.
    pub(crate) fn rim_mm(&self) -> Option<f64> {
        self.inverted.then_some(RIM_PART * self.margin_mm)
    }

    /// Returns the width of the white along the edges of a face, mm.
    #[doc(hidden)]
    pub fn white_margin_mm(&self) -> f64 {
        self.margin_mm - self.rim_mm().unwrap_or_default()
    }

    /// Returns the margin that leaves the given width of white along the edges, mm.
    pub(in crate::targets) fn margin_around_mm(&self, white_mm: f64) -> f64 {
        if self.inverted { white_mm / (1.0 - RIM_PART) } else { white_mm }
    }

    /// Returns the tags of faces of a tiling.
    pub(in crate::targets) fn tags_of(&self, kind: GridKind) -> Option<&TagSpec> {
        match (kind, &self.square_tags) {
            (GridKind::Checker, Some(tags)) => Some(tags),
            _ => self.tags.as_ref(),
        }
    }

    /// Checks each number on its own.
    pub(crate) fn check(&self) -> Result<(), TargetError> {
        self.check_edge()?;
        match &self.shape {
            SolidShape::Cuboid(sides) => self.check_sides(*sides)?,
            SolidShape::Mesh(mesh) => self.check_mesh(mesh)?,
            _ => {}
        }
        self.check_faces()?;
        self.check_tags()
    }

    fn check_edge(&self) -> Result<(), TargetError> {
        // The mean edge of a cuboid that is not scaled follows from its sides, which are checked on their own.
        let follows =
            matches!(&self.shape, SolidShape::Cuboid(sides) if mean_side(*sides) == self.edge_mm);
        if follows || SOLID_EDGE_MM.contains(&self.edge_mm) {
            return Ok(());
        }
        let edge = format_mm(self.edge_mm);
        let problem = match &self.shape {
            SolidShape::Mesh(_) => {
                format!(
                    "the mean is {edge}, not between 10 mm and 5000 mm: set the edge, or scale the mesh to mm"
                )
            }
            _ => format!("{edge} is not between 10 mm and 5000 mm"),
        };
        Err(TargetError::invalid(SolidEdgeMm, problem))
    }

    fn check_sides(&self, sides: DVec3) -> Result<(), TargetError> {
        let scale = self.edge_mm / mean_side(sides);
        let wrong = |side: &f64| !(*side > 0.0 && SOLID_EDGE_MM.contains(&(side * scale)));
        let Some(side) = sides.to_array().into_iter().find(wrong) else { return Ok(()) };
        let problem =
            format!("a side of {} is not between 10 mm and 5000 mm", format_mm(side * scale));
        Err(TargetError::invalid(SolidShapeCuboid, problem))
    }

    fn check_mesh(&self, mesh: &ClosedMesh) -> Result<(), TargetError> {
        let wrong = |problem: String| Err(TargetError::invalid(SolidShapeMesh, problem));
        let count = mesh.faces().len();
        if count > MAX_FACES as usize {
            return wrong(format!("{count} faces exceed the maximum of {MAX_FACES}"));
        }
        let triangles: usize = mesh.faces().iter().map(|face| face.len() - 2).sum();
        if triangles > MAX_TRIANGLES {
            return wrong(format!(
                "its faces consist of {triangles} triangles, which exceeds the maximum of {MAX_TRIANGLES}"
            ));
        }
        let scale = self.edge_mm / mesh.mean_edge();
        let far = |v: &DVec3| v.abs().max_element() * scale;
        let farthest = mesh.vertices().iter().map(far).fold(0.0, f64::max);
        if farthest > FARTHEST_MM {
            return wrong(format!(
                "the mesh extends to {} from the origin, more than {}: move it closer to the origin",
                format_mm(farthest),
                format_mm(FARTHEST_MM)
            ));
        }
        Ok(())
    }

    fn check_faces(&self) -> Result<(), TargetError> {
        let margin = format_mm(self.margin_mm);
        if !FACE_TILES.contains(&self.tiles) {
            let problem = format!("{} is not between 6 and 200", self.tiles);
            return Err(TargetError::invalid(SolidTiles, problem));
        }
        if !(0.0..=SOLID_EDGE_MM.end() / 4.0).contains(&self.margin_mm) {
            let problem = format!("{margin} is not a valid margin of a face");
            return Err(TargetError::invalid(SolidMarginMm, problem));
        }
        if self.board_id.checked_add(MAX_FACES).is_none() {
            let problem =
                format!("{} is too large: it leaves no ids for the following faces", self.board_id);
            return Err(TargetError::invalid(SolidBoardId, problem));
        }
        if self.inverted && self.margin_mm < MIN_INVERTED_MARGIN_MM {
            let problem = format!(
                "{margin} leaves no room for a black field around white tiles: use at least {}",
                format_mm(MIN_INVERTED_MARGIN_MM)
            );
            return Err(TargetError::invalid(SolidMarginMm, problem));
        }
        Ok(())
    }

    fn check_tags(&self) -> Result<(), TargetError> {
        let wrong = |problem| Err(TargetError::invalid(SolidSquareTags, problem));
        let Some(tags) = &self.tags else {
            return match self.square_tags {
                Some(_) => wrong("the other faces have no tags: omit it"),
                None => Ok(()),
            };
        };
        if tags.is_dense() && self.shape.tag_tiling() == GridKind::Deltille {
            let boards = self.board_id..self.board_id + self.polyhedron().faces.len() as u32;
            // Faces other than triangles have up to twice as many rows.
            let rows = if matches!(self.shape, SolidShape::Mesh(_)) { 2 } else { 1 } * self.tiles;
            tags.check_places(SolidBoardId, boards, SolidTiles, [rows, rows])?;
        }
        match (self.shape.tilings(), &self.square_tags) {
            ([true, true], Some(square_tags)) => {
                square_tags.check(GridKind::Checker)?;
                tags.check(GridKind::Deltille)
            }
            ([true, false], None) => tags.check(GridKind::Deltille),
            ([false, _], None) => tags.check(GridKind::Checker),
            ([true, true], None) => {
                wrong("rectangular faces need square tags, because the others have triangular ones")
            }
            (_, Some(_)) => wrong("all faces are of one kind and have one kind of tags: omit it"),
        }
    }
}

/// Returns the mean side of a cuboid.
pub(in crate::targets) fn mean_side(sides: DVec3) -> f64 {
    sides.element_sum() / 3.0
}
