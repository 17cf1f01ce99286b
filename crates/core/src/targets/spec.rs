use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::length::format_mm;
use super::solid::mean_side;
use super::{
    AprilGridSpec, CharucoSpec, CirclesSpec, ClosedMesh, GridKind, Polyhedron, SkeletonSpec,
    TagPlacement, TagsIn, TargetError,
};
use crate::family::places;
use crate::lattice::Vertex;
use crate::quantity;

/// Most rows or columns of a board: more than the largest paper holds at the finest edge that
/// anybody prints, and few enough that no number overflows.
pub const MOST_ROWS: u32 = 500;

/// Smallest hole in a tag, mm: for a thin pin.
const LEAST_HOLE_MM: f64 = 0.5;

/// Range of rows and of columns: two rows of two corners have a tile between them.
pub const SIDES: std::ops::RangeInclusive<u32> = 2..=MOST_ROWS;

/// Most corners of all boards together: their description takes 100 MB of text.
const MOST_CORNERS: u64 = 1_000_000;

/// Fewest corners of an untagged board: what the detector asks for where no tag vouches for a grid.
/// A hexagon of triangles, or four squares: a quad or two of random texture may pass for tiles,
/// twelve clean edges between so few corners do not.
pub const fn least_untagged_corners(kind: GridKind) -> u32 {
    match kind {
        GridKind::Deltille => 7,
        GridKind::Checker => 9,
    }
}

/// Fewest tiles of a board of place codes: three by four, which tell their place also where some are hidden.
const LEAST_DENSE_TILES: u32 = 12;

/// Least border of a square tag, bit-widths: that of an AprilTag.
const LEAST_SQUARE_BORDER_BITS: f64 = 1.0;

/// Range of the thickness of a plate with a board on either side, mm.
const TWO_SIDED_MM: std::ops::RangeInclusive<f64> = 0.1..=1000.0;

/// Range of a tile's edge, mm.
const EDGE_MM: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Range of a solid's edge, mm.
const SOLID_EDGE_MM: std::ops::RangeInclusive<f64> = 10.0..=5000.0;

/// Range of tiles along a side of a face: with fewer than six a face has at most six corners,
/// and the detector takes so few for no grid.
pub const FACE_TILES: std::ops::RangeInclusive<u32> = 6..=200;

/// Least margin of a face with white tiles on black, mm: it has the black around the tiles, and beyond that the numbers of
/// the face.
const LEAST_INVERTED_MARGIN_MM: f64 = 5.0;

/// Usual margin of a face, mm: room to fold and glue; and of one with white tiles on black.
const MARGIN_MM: f64 = 5.0;
const INVERTED_MARGIN_MM: f64 = 8.0;

/// So much of the margin of a face with white tiles is black.
const RIM_PART: f64 = 0.4;

/// Farthest a mesh may lie from its origin, mm: meshes and bodies are written in single precision,
/// which at 100 m leaves 0.01 mm.
const FARTHEST_MM: f64 = 1e5;

/// Most triangles that the faces of a solid are divided into: meshes count their corners in 16 bits.
const MOST_TRIANGLES: usize = 20_000;

/// Most faces of a solid.
const MOST_FACES: u32 = 10_000;

/// Range of a tag's border, bit-widths. The border separates the code from the white around the
/// tile; with half a bit of it the detector no longer finds every corner of a clean print, from 0.6
/// on it does.
pub const BORDER_BITS: std::ops::RangeInclusive<f64> = 0.6..=10.0;

/// The specification of a target: enough to make it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum TargetSpec {
    /// Flat boards: deltille zigzags, or checkerboards.
    Board(BoardSpec),
    /// A solid with a board on each face.
    Solid(SolidSpec),
    /// Single tags, in rows.
    Tags(TagSheetSpec),
    /// A ChArUco board.
    Charuco(CharucoSpec),
    /// An AprilGrid.
    AprilGrid(AprilGridSpec),
    /// A grid of circles.
    Circles(CirclesSpec),
    /// Known only by its corners and tags, as another program listed them.
    Listed(ListedSpec),
}

/// Boards of `rows × cols` corners, all alike but for their ids.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardSpec {
    /// The tiling.
    #[serde(default, skip_serializing_if = "is_deltille")]
    pub grid: GridKind,
    /// Number of rows of corners, 2 to 500.
    pub rows: u32,
    /// Number of corners in each row, 2 to 500.
    pub cols: u32,
    /// Length of a tile's edge, mm.
    pub edge_mm: f64,
    /// Number of boards. Each has a sheet of its own; they are loose, so that each lies in the
    /// origin of the target frame.
    #[serde(default = "one")]
    pub boards: u32,
    /// Id of the first board; the others follow.
    pub board_id: u32,
    /// Tags; `None` for an untagged board.
    pub tags: Option<TagSpec>,
    /// Whether black and white are exchanged: white tiles on a black field.
    pub inverted: bool,
    /// Thickness of the plate that carries a board on its back, too, mm; `None` for boards with one side. The back, whose
    /// id follows, is turned about the upright axis through the middle of the plate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub two_sided_mm: Option<f64>,
}

fn one() -> u32 {
    1
}

fn is_deltille(kind: &GridKind) -> bool {
    *kind == GridKind::Deltille
}

/// Which tags a board carries, and where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TagSpec {
    /// Family name, or path of a family file. Of [`places`] every tile has a tag, whose id follows from the board's and
    /// its place.
    pub family: String,
    /// Id of the first tag; the others follow, by row, then column, board after board. 0 with place codes.
    pub first_id: u32,
    /// Every how many rows and columns there is a tag.
    pub spacing: u32,
    /// Width of the border, in widths of a bit, 0.6 to 10.
    pub border_bits: f64,
    /// Which squares of a checkerboard carry the tags.
    #[serde(default, skip_serializing_if = "TagsIn::is_black")]
    pub tags_in: TagsIn,
    /// Diameter of a hole in the middle of each tag, mm, for a screw or a camera: bare paper on print, a cut for a laser. The
    /// family leaves the cells there free.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::edge_mm::de"
    )]
    pub hole_mm: Option<f64>,
}

/// Single tags on sheets: a panel of one tile without corners for each, whose id is the tag's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TagSheetSpec {
    /// Family name, or path of a family file.
    pub family: String,
    /// Tags in the order of printing, each once.
    pub ids: Vec<u32>,
    /// Length of a tag's edge, mm.
    pub edge_mm: f64,
    /// Width of the border, in widths of a bit, 0.6 to 10.
    pub border_bits: f64,
}

/// A solid whose faces carry boards with tags: triangles of deltille tiles on triangular faces, checkerboards
/// on rectangular ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolidSpec {
    /// The shape of the solid.
    pub shape: SolidShape,
    /// Length of the solid's edges, mm; of a cuboid or mesh their mean, to which it is scaled.
    pub edge_mm: f64,
    /// Number of black tiles along each side of a triangle, and of squares along the shortest side of all
    /// rectangles, 6 to 200.
    pub tiles: u32,
    /// Blank between a face's edges and its tiles, mm.
    pub margin_mm: f64,
    /// Id of the first face's board; the others follow in the order of the faces.
    pub board_id: u32,
    /// The tags; `None` for bare tilings, whose faces are not told apart.
    pub tags: Option<TagSpec>,
    /// The tags of rectangular faces, where other faces have deltille tiles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub square_tags: Option<TagSpec>,
    /// Whether black and white are exchanged: white tiles on a black field, which takes a part of the margin.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub inverted: bool,
    /// A frame that holds the faces as panels, if one is to be printed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skeleton: Option<SkeletonSpec>,
}

/// The solids; see [`Polyhedron`](super::Polyhedron) for the order of the faces of regular ones.
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
    /// Any other, by its faces.
    Mesh(ClosedMesh),
}

/// Where a listed target comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListedSpec {
    /// The format of the list.
    pub format: ListFormat,
}

/// Formats that list a target's corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ListFormat {
    /// `.dsc` in the dialect of the reference detector (`docs/formats.md`, “.dsc target descriptions”).
    DscOriginal,
    /// `.dsc` in the dialect of its fork.
    DscFork,
}

impl Default for TagSpec {
    /// delTag25h7 from id 0, a tag in every third row and column, a border of 1.5 bits: a tag has
    /// six plain tiles around each of its corners, and the border is that of published targets.
    fn default() -> Self {
        let family = "delTag25h7".to_owned();
        Self {
            family,
            first_id: 0,
            spacing: 3,
            border_bits: 1.5,
            tags_in: TagsIn::Black,
            hole_mm: None,
        }
    }
}

impl TagSpec {
    /// A place code in every tile of a deltille grid, with the usual border: corners are as precise as without codes from 2 px
    /// a cell on.
    pub fn dense() -> Self {
        Self { family: places::NAME.to_owned(), spacing: 1, ..Self::default() }
    }

    /// The usual tags of a tiling: those above, or of the family that is asked for by its name.
    pub fn usual(grid: GridKind, family: Option<&str>, tags_in: TagsIn) -> Self {
        let usual = match grid {
            GridKind::Checker => Self::for_squares(tags_in),
            GridKind::Deltille if family == Some(places::NAME) => Self::dense(),
            GridKind::Deltille => Self::default(),
        };
        let family = family.map_or(usual.family, str::to_owned);
        Self { family, ..usual }
    }

    /// Whether every tile has a place code.
    pub fn is_dense(&self) -> bool {
        self.family == places::NAME
    }

    /// The tags in some tiles of the panel with an id, where those of a family begin with `first`.
    pub(crate) fn placements(&self, panel: u32, first: u32, tiles: &[Vertex]) -> Vec<TagPlacement> {
        let tiles = tiles.iter().zip(0..);
        let of_tile = |(tile, i): (&Vertex, u32)| TagPlacement {
            id: match self.is_dense() {
                true => places::id(panel, *tile),
                // No family has so many codes that ids overflow; a spec may ask for them.
                false => first.saturating_add(i),
            },
            row: tile.row,
            col: tile.col,
        };
        tiles.map(of_tile).collect()
    }

    /// Checks that there are place codes for panels with these ids, whose tiles lie in so many rows and columns.
    fn check_places(
        &self,
        (setting, panels): (&'static str, std::ops::Range<u32>),
        (size, rows, cols): (&'static str, u32, u32),
    ) -> Result<(), TargetError> {
        let last = places::BOARDS - 1;
        if panels.end > places::BOARDS {
            let problem = format!(
                "boards {} to {} are needed, {} tells {last} as the last: lower it, or make fewer",
                panels.start,
                panels.end - 1,
                places::NAME
            );
            return Err(TargetError::invalid(setting, problem));
        }
        if !places::are_different(rows, cols) {
            let problem = format!(
                "{rows} rows of {cols} tiles are more than {} tells apart, whose places come again after 256 edges: \
                 make it smaller",
                places::NAME
            );
            return Err(TargetError::invalid(size, problem));
        }
        let fixed = [
            ("TagSpec::spacing", self.spacing, 1, "every tile has a place code"),
            (
                "TagSpec::first_id",
                self.first_id,
                0,
                "the ids of place codes follow from the board's",
            ),
        ];
        match fixed.into_iter().find(|(_, value, only, _)| value != only) {
            Some((setting, value, only, why)) => {
                let problem = format!("{value} is not {only}: {why}; leave it out");
                Err(TargetError::invalid(setting, problem))
            }
            None => Ok(()),
        }
    }

    /// Tags for a checkerboard: aprilTag36h11 in every second row and column, so that each corner
    /// touches one tag at most.
    ///
    /// In black squares the border has two bits: with one, cells come so near to the corners that
    /// these are found half as precisely (docs/measurements.md). In white squares it has the one bit
    /// that every reader of AprilTags knows.
    pub fn for_squares(tags_in: TagsIn) -> Self {
        Self {
            family: "aprilTag36h11".to_owned(),
            spacing: 2,
            border_bits: match tags_in {
                TagsIn::Black => 2.0,
                TagsIn::White => LEAST_SQUARE_BORDER_BITS,
            },
            tags_in,
            ..Self::default()
        }
    }
}

impl SolidShape {
    /// Its name.
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
    /// Shape and size in words.
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
    /// The tiling whose tags [`SolidSpec::tags`] are: squares where all faces are rectangles.
    pub fn tag_tiling(&self) -> GridKind {
        if self.tilings()[0] { GridKind::Deltille } else { GridKind::Checker }
    }

    /// Whether faces have deltille tiles, and whether faces have squares.
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
    pub const LEAST_EDGE_MM: f64 = *SOLID_EDGE_MM.start();

    /// Fewest tiles along a side of a face.
    pub const FEWEST_TILES: u32 = *FACE_TILES.start();

    /// Finest edge of a tile, mm: what [`BoardSpec`] allows.
    pub const FINEST_TILE_MM: f64 = *EDGE_MM.start();

    /// A solid of 150 mm edges, or a cuboid or mesh in its own size, with ten tiles a side (the tags of a
    /// triangle then lie symmetrically), or eight squares, and 5 mm of blank along its edges, which leaves room to fold
    /// and glue.
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

    /// The margin that it has unless a skeleton needs more, mm.
    pub(super) fn usual_margin_mm(&self) -> f64 {
        if self.inverted { INVERTED_MARGIN_MM } else { MARGIN_MM }
    }

    /// Width of the black around the tiles, mm; `None` where tiles are black on white.
    pub(crate) fn rim_mm(&self) -> Option<f64> {
        self.inverted.then_some(RIM_PART * self.margin_mm)
    }

    /// Width of the white along the edges of a face, mm.
    pub(crate) fn white_margin_mm(&self) -> f64 {
        self.margin_mm - self.rim_mm().unwrap_or_default()
    }

    /// The margin that leaves so much white along the edges, mm.
    pub(super) fn margin_around_mm(&self, white_mm: f64) -> f64 {
        if self.inverted { white_mm / (1.0 - RIM_PART) } else { white_mm }
    }

    /// The tags of faces of a tiling.
    pub(super) fn tags_of(&self, kind: GridKind) -> Option<&TagSpec> {
        match (kind, &self.square_tags) {
            (GridKind::Checker, Some(tags)) => Some(tags),
            _ => self.tags.as_ref(),
        }
    }

    /// Checks every number by itself.
    pub(crate) fn check(&self) -> Result<(), TargetError> {
        if !SOLID_EDGE_MM.contains(&self.edge_mm) {
            let edge = format_mm(self.edge_mm);
            let problem = match &self.shape {
                SolidShape::Mesh(_) => {
                    format!(
                        "the mean is {edge}, not between 10 mm and 5000 mm: set it, or scale the mesh to mm"
                    )
                }
                _ => format!("{edge} is not between 10 mm and 5000 mm"),
            };
            return Err(TargetError::invalid("SolidSpec::edge_mm", problem));
        }
        if let SolidShape::Cuboid(sides) = &self.shape {
            let scale = self.edge_mm / mean_side(*sides);
            let wrong = |side: &f64| !(*side > 0.0 && SOLID_EDGE_MM.contains(&(side * scale)));
            if let Some(side) = sides.to_array().into_iter().find(wrong) {
                let side = format_mm(side * scale);
                let problem = format!("a side of {side} is not between 10 mm and 5000 mm");
                return Err(TargetError::invalid("SolidShape::Cuboid", problem));
            }
        }
        if let SolidShape::Mesh(mesh) = &self.shape
            && mesh.faces().len() > MOST_FACES as usize
        {
            let problem = format!("{} faces are more than {MOST_FACES}", mesh.faces().len());
            return Err(TargetError::invalid("SolidShape::Mesh", problem));
        }
        if let SolidShape::Mesh(mesh) = &self.shape {
            let triangles: usize = mesh.faces().iter().map(|face| face.len() - 2).sum();
            if triangles > MOST_TRIANGLES {
                let problem =
                    format!("its faces are {triangles} triangles, more than {MOST_TRIANGLES}");
                return Err(TargetError::invalid("SolidShape::Mesh", problem));
            }
        }
        if let SolidShape::Mesh(mesh) = &self.shape {
            let scale = self.edge_mm / mesh.mean_edge();
            let far = |v: &DVec3| v.abs().max_element() * scale;
            let farthest = mesh.vertices().iter().map(far).fold(0.0, f64::max);
            if farthest > FARTHEST_MM {
                let problem = format!(
                    "it reaches {} from the origin, more than {}: move it nearer",
                    format_mm(farthest),
                    format_mm(FARTHEST_MM)
                );
                return Err(TargetError::invalid("SolidShape::Mesh", problem));
            }
        }
        if !FACE_TILES.contains(&self.tiles) {
            let problem = format!("{} is not between 6 and 200", self.tiles);
            return Err(TargetError::invalid("SolidSpec::tiles", problem));
        }
        if !(0.0..=SOLID_EDGE_MM.end() / 4.0).contains(&self.margin_mm) {
            let problem = format!("{} is no margin of a face", format_mm(self.margin_mm));
            return Err(TargetError::invalid("SolidSpec::margin_mm", problem));
        }
        if self.board_id.checked_add(MOST_FACES).is_none() {
            let problem = format!("{} leaves no ids for the faces after it", self.board_id);
            return Err(TargetError::invalid("SolidSpec::board_id", problem));
        }
        if self.inverted && self.margin_mm < LEAST_INVERTED_MARGIN_MM {
            let problem = format!(
                "{} leaves no room for a black field around white tiles: take at least {}",
                format_mm(self.margin_mm),
                format_mm(LEAST_INVERTED_MARGIN_MM)
            );
            return Err(TargetError::invalid("SolidSpec::margin_mm", problem));
        }
        let Some(tags) = &self.tags else {
            return match self.square_tags {
                Some(_) => {
                    let problem = "the other faces have no tags: leave it out";
                    Err(TargetError::invalid("SolidSpec::square_tags", problem))
                }
                None => Ok(()),
            };
        };
        if tags.is_dense() && self.shape.tag_tiling() == GridKind::Deltille {
            let boards = self.board_id..self.board_id + self.polyhedron().faces.len() as u32;
            // Faces of other shapes than triangles have up to twice as many rows.
            let rows = if matches!(self.shape, SolidShape::Mesh(_)) { 2 } else { 1 } * self.tiles;
            let size = ("SolidSpec::tiles", rows, rows);
            tags.check_places(("SolidSpec::board_id", boards), size)?;
        }
        let kind = match (self.shape.tilings(), &self.square_tags) {
            ([true, true], Some(tags)) => {
                tags.check(GridKind::Checker)?;
                GridKind::Deltille
            }
            ([true, false], None) => GridKind::Deltille,
            ([false, _], None) => GridKind::Checker,
            ([true, true], None) => {
                let problem = "rectangular faces need square tags, the others have triangular ones";
                return Err(TargetError::invalid("SolidSpec::square_tags", problem));
            }
            (_, Some(_)) => {
                let problem = "all faces are of one kind and have one kind of tags: leave it out";
                return Err(TargetError::invalid("SolidSpec::square_tags", problem));
            }
        };
        tags.check(kind)
    }
}

impl From<BoardSpec> for TargetSpec {
    fn from(spec: BoardSpec) -> Self {
        Self::Board(spec)
    }
}

impl From<SolidSpec> for TargetSpec {
    fn from(spec: SolidSpec) -> Self {
        Self::Solid(spec)
    }
}

impl From<TagSheetSpec> for TargetSpec {
    fn from(spec: TagSheetSpec) -> Self {
        Self::Tags(spec)
    }
}

impl From<AprilGridSpec> for TargetSpec {
    fn from(spec: AprilGridSpec) -> Self {
        Self::AprilGrid(spec)
    }
}

impl From<CirclesSpec> for TargetSpec {
    fn from(spec: CirclesSpec) -> Self {
        Self::Circles(spec)
    }
}

impl From<CharucoSpec> for TargetSpec {
    fn from(spec: CharucoSpec) -> Self {
        Self::Charuco(spec)
    }
}

impl TargetSpec {
    /// Whether its panels are fixed to each other: the faces of a solid, the sides of a board, what a list names together.
    /// Others are sheets that lie about, each for itself.
    pub fn is_rigid(&self) -> bool {
        match self {
            Self::Solid(_) | Self::Listed(_) => true,
            Self::Board(_) => self.two_sided_mm().is_some(),
            Self::Tags(_) | Self::Charuco(_) | Self::AprilGrid(_) | Self::Circles(_) => false,
        }
    }

    /// The distance between the sides of a board that has two, mm.
    pub fn two_sided_mm(&self) -> Option<f64> {
        match self {
            Self::Board(board) => board.two_sided_mm,
            _ => None,
        }
    }

    /// Whether each of its panels can be the front of a plate: boards whose corners are detected.
    pub fn is_on_plate(&self) -> bool {
        matches!(self, Self::Board(_) | Self::Charuco(_) | Self::AprilGrid(_))
    }

    /// The family that its tags are of, by name or path; `None` for an untagged target, and for a listed
    /// one.
    pub fn family(&self) -> Option<&str> {
        match self {
            Self::Board(board) => board.tags.as_ref().map(|tags| tags.family.as_str()),
            Self::Solid(solid) => solid.tags.as_ref().map(|tags| tags.family.as_str()),
            Self::Tags(tags) => Some(&tags.family),
            Self::Charuco(charuco) => Some(&charuco.dictionary),
            Self::AprilGrid(grid) => Some(&grid.family),
            Self::Listed(_) | Self::Circles(_) => None,
        }
    }

    /// The family of its square tags, where others are triangular: by name or path.
    pub fn square_family(&self) -> Option<&str> {
        match self {
            Self::Solid(solid) => solid.square_tags.as_ref().map(|tags| tags.family.as_str()),
            _ => None,
        }
    }
}

impl BoardSpec {
    /// One deltille board with tags, of so many rows and columns of corners.
    pub fn deltille(rows: u32, cols: u32, edge_mm: f64) -> Self {
        Self::new(GridKind::Deltille, rows, cols, edge_mm)
    }

    /// One checkerboard with AprilTags, of so many rows and columns of corners.
    pub fn checkerboard(rows: u32, cols: u32, edge_mm: f64) -> Self {
        Self::new(GridKind::Checker, rows, cols, edge_mm)
    }

    /// One board with tags.
    pub fn new(grid: GridKind, rows: u32, cols: u32, edge_mm: f64) -> Self {
        let tags = Some(match grid {
            GridKind::Deltille => TagSpec::default(),
            GridKind::Checker => TagSpec::for_squares(TagsIn::Black),
        });
        let (boards, board_id, inverted, two_sided_mm) = (1, 0, false, None);
        Self { grid, rows, cols, edge_mm, boards, board_id, tags, inverted, two_sided_mm }
    }

    /// How many panels they are: one for each side.
    pub(crate) fn panel_count(&self) -> u32 {
        self.boards * if self.two_sided_mm.is_some() { 2 } else { 1 }
    }

    /// Checks what two sides need.
    fn check_sides(&self) -> Result<(), TargetError> {
        let refused =
            |problem: String| Err(TargetError::invalid("BoardSpec::two_sided_mm", problem));
        match self.two_sided_mm {
            None => Ok(()),
            Some(mm) if !TWO_SIDED_MM.contains(&mm) => {
                refused(format!("{} is not between 0.1 mm and 1000 mm", format_mm(mm)))
            }
            Some(_) if self.boards > 1 => refused(
                "the two sides of one board are described together: make one board at a time"
                    .to_owned(),
            ),
            Some(_) if self.tags.is_none() => {
                refused("untagged sides cannot be told apart: give them tags".to_owned())
            }
            Some(_) if self.tags.as_ref().is_some_and(|tags| tags.hole_mm.is_some()) => refused(
                "a hole through a tag of one side would be in a tile of the other: leave out `TagSpec::hole_mm`, or \
                 make one side"
                    .to_owned(),
            ),
            Some(_) => Ok(()),
        }
    }

    /// Checks every number by itself.
    pub(crate) fn check(&self) -> Result<(), TargetError> {
        self.check_sides()?;
        for (setting, value) in [("BoardSpec::rows", self.rows), ("BoardSpec::cols", self.cols)] {
            if !SIDES.contains(&value) {
                let problem = format!("{value} is not between 2 and {MOST_ROWS}");
                return Err(TargetError::invalid(setting, problem));
            }
        }
        if !EDGE_MM.contains(&self.edge_mm) {
            let problem = format!("{} is not between 1 mm and 1000 mm", format_mm(self.edge_mm));
            return Err(TargetError::invalid("BoardSpec::edge_mm", problem));
        }
        if !(1..=MOST_ROWS).contains(&self.boards) {
            let problem = format!("{} is not between 1 and {MOST_ROWS}", self.boards);
            return Err(TargetError::invalid("BoardSpec::boards", problem));
        }
        let corners =
            [self.rows, self.cols, self.panel_count()].into_iter().map(u64::from).product::<u64>();
        if corners > MOST_CORNERS {
            let problem = format!("{corners} corners are more than {MOST_CORNERS} in one target");
            return Err(TargetError::invalid("BoardSpec::boards", problem));
        }
        if self.board_id.checked_add(self.panel_count()).is_none() {
            let problem = format!("{} leaves no ids for the boards after it", self.board_id);
            return Err(TargetError::invalid("BoardSpec::board_id", problem));
        }
        let least = least_untagged_corners(self.grid);
        if self.tags.is_none() && self.rows * self.cols < least {
            let problem = format!(
                "{} × {} corners without tags are too few to be told from texture: take at least \
                 {least} corners, or tags",
                self.rows, self.cols
            );
            let setting = match self.grid {
                GridKind::Deltille => "BoardSpec::tags",
                GridKind::Checker => "BoardSpec::rows",
            };
            return Err(TargetError::invalid(setting, problem));
        }
        match &self.tags {
            Some(tags) => {
                tags.check(self.grid)?;
                if (self.grid, self.rows, self.cols, tags.tags_in)
                    == (GridKind::Checker, 2, 2, TagsIn::White)
                {
                    let problem = "the one square between 2 × 2 corners is black";
                    return Err(TargetError::invalid("TagSpec::tags_in", problem));
                }
                if tags.is_dense() && self.grid == GridKind::Deltille {
                    let boards = self.board_id..self.board_id + self.panel_count();
                    let (rows, cols) = (self.rows, self.cols);
                    if (rows - 1) * (cols - 1) < LEAST_DENSE_TILES {
                        let problem = format!(
                            "{rows} × {cols} corners have fewer than {LEAST_DENSE_TILES} tiles between them, too few to \
                             tell a place: take more, or tags of another `TagSpec::family`"
                        );
                        return Err(TargetError::invalid("BoardSpec::rows", problem));
                    }
                    tags.check_places(
                        ("BoardSpec::board_id", boards),
                        ("BoardSpec::rows", rows, cols),
                    )?;
                }
                Ok(())
            }
            None if self.boards > 1 => {
                let problem = "untagged boards cannot be told apart: give them tags, or make one";
                Err(TargetError::invalid("BoardSpec::boards", problem))
            }
            None => Ok(()),
        }
    }
}

impl TagSpec {
    /// Checks every number by itself, of tags in tiles of a kind.
    fn check(&self, grid: GridKind) -> Result<(), TargetError> {
        if grid == GridKind::Deltille && self.tags_in == TagsIn::White {
            let problem = "the tags of a deltille board are in its black tiles";
            return Err(TargetError::invalid("TagSpec::tags_in", problem));
        }
        let least = LEAST_SQUARE_BORDER_BITS;
        if grid == GridKind::Checker && self.border_bits < least {
            let problem = format!(
                "{} is too narrow, a square tag has a border of at least {least} bit-width",
                self.border_bits
            );
            return Err(TargetError::invalid("TagSpec::border_bits", problem));
        }
        if !(1..=MOST_ROWS).contains(&self.spacing) {
            let problem = format!("{} is not between 1 and {MOST_ROWS}", self.spacing);
            return Err(TargetError::invalid("TagSpec::spacing", problem));
        }
        if !BORDER_BITS.contains(&self.border_bits) {
            let problem = format!("{} is not between 0.6 and 10 bit-widths", self.border_bits);
            return Err(TargetError::invalid("TagSpec::border_bits", problem));
        }
        let refused = |problem: &str| Err(TargetError::invalid("TagSpec::hole_mm", problem));
        match self.hole_mm {
            Some(_) if grid == GridKind::Checker => {
                refused("square tags have no free cells: make a deltille board or solid")
            }
            Some(mm) if mm.is_nan() || mm < LEAST_HOLE_MM => {
                refused(&format!("{mm} mm is less than {LEAST_HOLE_MM} mm"))
            }
            _ => Ok(()),
        }
    }
}
