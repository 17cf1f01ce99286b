//! Makes targets and their files from settings.

#![allow(unreachable_pub, reason = "the page is the only user of this interface")]

mod codes;

use deltille_core::family::Family;
use deltille_core::lattice::GridKind;
use deltille_core::targets::{
    AprilGridSpec, BoardSpec, CharucoSpec, CirclesSpec, ClosedMesh, SkeletonSpec, SolidShape,
    SolidSpec, TagSpec, TagsIn, Target, TargetSpec, parse_box_mm,
};
use deltille_files::export::artifacts::{Making, What, make};
use deltille_files::export::dsc::Dialect;
use deltille_files::export::obj;
use deltille_layout::{
    DEFAULT_MARGIN_MM, Finish, Logo, Orientation, PaperSize, PaperSpec, Printing, Reach,
    SolidSheets, usual_edge_mm, usual_solid_edge_mm,
};
use js_sys::Array;
use serde::{Deserialize, Serialize};
use wasm_bindgen::prelude::*;

use deltille_web::errors::Raise;
use deltille_web::files::in_array;

/// Edge of a square of a ChArUco board, side of a tag of an AprilGrid, and spacing of circles, mm: the defaults of the
/// programs, like the dictionary.
const SQUARE_MM: f64 = 30.0;
const TAG_MM: f64 = 25.0;
const SPACING_MM: f64 = 20.0;
const DICTIONARY: &str = "DICT_5X5_100";

/// Edges of a cuboid: the example of the programs.
const CUBOID: &str = "200x150x100mm";

/// Settings of the form. Missing ones have the defaults of the programs.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Wanted {
    /// `deltille`, `checker`, `charuco`, `aprilgrid`, `circles`, `tetrahedron`, `octahedron`, `icosahedron`, `cube`, `cuboid`
    /// or `mesh`.
    kind: String,
    /// Rows of corners; of squares of a ChArUco board, tags of an AprilGrid, or circles.
    rows: u32,
    cols: u32,
    /// Edge of a tile or solid; of a square of a ChArUco board or a tag of an AprilGrid; spacing of circles.
    edge_mm: Option<f64>,
    /// Side of a marker of a ChArUco board.
    marker_mm: Option<f64>,
    /// Whether a ChArUco board has the pattern of OpenCV before version 4.6.
    legacy: bool,
    /// Gaps of an AprilGrid, in tags.
    gap: Option<f64>,
    /// Diameter of circles.
    diameter_mm: Option<f64>,
    /// Whether every second row of circles is shifted.
    asymmetric: bool,
    /// Edges of a cuboid, such as `200x150x100mm`.
    size: Option<String>,
    /// Empty for a board without tags. The dictionary of a ChArUco board.
    family: Option<String>,
    /// The content of the family file, if the page does not have it.
    family_file: Option<String>,
    tags_in: TagsIn,
    tag_spacing: Option<u32>,
    tag_border: Option<f64>,
    /// Diameter of a hole in each tag.
    hole_mm: Option<f64>,
    first_id: u32,
    /// Whether the id of each tag is printed beside it.
    tag_ids: bool,
    boards: u32,
    board_id: u32,
    inverted: bool,
    /// Distance between the sides of a two-sided board.
    two_sided_mm: Option<f64>,
    tiles: Option<u32>,
    face_margin_mm: Option<f64>,
    skeleton: bool,
    per_face: bool,
    allow_seams: bool,
    poster: bool,
    packed: bool,
    /// The text of an OBJ file.
    mesh: Option<String>,
    paper: Option<String>,
    pages: Option<u32>,
    orientation: String,
    margin_mm: Option<f64>,
    guide_page: bool,
    /// Text on the label of every sheet.
    note: Option<String>,
    /// The outline that `logo_of_svg` of the module `prove` returns.
    logo: Option<Logo>,
    logo_height_mm: Option<f64>,
    mirrored: bool,
    /// Width of the material that a laser removes.
    kerf_mm: Option<f64>,
    name: String,
}

impl Default for Wanted {
    fn default() -> Self {
        Self {
            kind: "deltille".to_owned(),
            rows: 10,
            cols: 11,
            edge_mm: None,
            marker_mm: None,
            legacy: false,
            gap: None,
            diameter_mm: None,
            asymmetric: false,
            size: None,
            family: None,
            family_file: None,
            tags_in: TagsIn::Black,
            tag_spacing: None,
            tag_border: None,
            hole_mm: None,
            first_id: 0,
            tag_ids: false,
            boards: 1,
            board_id: 0,
            inverted: false,
            two_sided_mm: None,
            tiles: None,
            face_margin_mm: None,
            skeleton: false,
            per_face: false,
            allow_seams: false,
            poster: false,
            packed: false,
            mesh: None,
            paper: None,
            pages: None,
            orientation: "auto".to_owned(),
            margin_mm: None,
            guide_page: false,
            note: None,
            logo: None,
            logo_height_mm: None,
            mirrored: false,
            kerf_mm: None,
            name: "board".to_owned(),
        }
    }
}

impl Wanted {
    fn spec(&self) -> Result<TargetSpec, JsError> {
        match self.kind.as_str() {
            "deltille" => Ok(self.board(GridKind::Deltille, &self.paper()?)),
            "checker" => Ok(self.board(GridKind::Checker, &self.paper()?)),
            "charuco" => Ok(self.charuco()),
            "aprilgrid" => Ok(self.april_grid()),
            "circles" => Ok(self.circles()),
            _ => self.solid(&self.paper()?),
        }
    }

    fn paper(&self) -> Result<PaperSpec, JsError> {
        let size = self.paper.as_deref().filter(|paper| !paper.is_empty());
        Ok(PaperSpec {
            size: size.map(str::parse).transpose().raise()?,
            orientation: self.orientation.parse().raise()?,
            margin_mm: self.margin_mm.unwrap_or(DEFAULT_MARGIN_MM),
            solids: match (self.per_face, self.allow_seams) {
                (true, _) => SolidSheets::PerFace,
                (false, true) => SolidSheets::SeamedNet,
                (false, false) => SolidSheets::Net,
            },
            pages: self.pages.filter(|_| !self.per_face),
            poster: self.poster,
            packed: self.packed,
            note: self.note.clone().filter(|note| !note.is_empty()),
            logo: self.logo.clone(),
            logo_height_mm: self.logo_height_mm,
            tag_ids: self.tag_ids,
            guide_page: self.guide_page,
        })
    }

    fn tags(&self, grid: GridKind) -> TagSpec {
        let usual = TagSpec::usual(grid, self.family.as_deref(), self.tags_in);
        TagSpec {
            first_id: self.first_id,
            spacing: self.tag_spacing.unwrap_or(usual.spacing),
            border_bits: self.tag_border.unwrap_or(usual.border_bits),
            tags_in: self.tags_in,
            hole_mm: self.hole_mm,
            ..usual
        }
    }

    /// Returns the tags of a board or of the faces of a solid, or `None` for an untagged target.
    fn wanted_tags(&self, grid: GridKind, is_usual: bool) -> Option<TagSpec> {
        let is_wanted = self.family.as_ref().map_or(is_usual, |family| !family.is_empty());
        is_wanted.then(|| self.tags(grid))
    }

    fn board(&self, grid: GridKind, paper: &PaperSpec) -> TargetSpec {
        let tags = self.wanted_tags(grid, grid == GridKind::Deltille);
        let mut spec = BoardSpec {
            boards: self.boards,
            board_id: self.board_id,
            tags,
            inverted: self.inverted,
            two_sided_mm: self.two_sided_mm,
            ..BoardSpec::new(grid, self.rows, self.cols, 1.0)
        };
        spec.edge_mm = self.edge_mm.unwrap_or_else(|| usual_edge_mm(&spec, paper));
        TargetSpec::Board(spec)
    }

    fn charuco(&self) -> TargetSpec {
        let (squares, dictionary) = ([self.cols, self.rows], self.family.as_deref());
        let square_mm = self.edge_mm.unwrap_or(SQUARE_MM);
        let usual = CharucoSpec::new(squares, square_mm, dictionary.unwrap_or(DICTIONARY));
        TargetSpec::Charuco(CharucoSpec {
            marker_mm: self.marker_mm.unwrap_or(usual.marker_mm),
            first_id: self.first_id,
            board_id: self.board_id,
            legacy: self.legacy,
            ..usual
        })
    }

    fn april_grid(&self) -> TargetSpec {
        let usual = AprilGridSpec::new([self.cols, self.rows], self.edge_mm.unwrap_or(TAG_MM));
        TargetSpec::AprilGrid(AprilGridSpec {
            gap: self.gap.unwrap_or(usual.gap),
            family: self.family.clone().unwrap_or(usual.family),
            first_id: self.first_id,
            border_bits: self.tag_border.unwrap_or(usual.border_bits),
            board_id: self.board_id,
            ..usual
        })
    }

    fn circles(&self) -> TargetSpec {
        let usual = CirclesSpec::new([self.cols, self.rows], self.edge_mm.unwrap_or(SPACING_MM));
        TargetSpec::Circles(CirclesSpec {
            diameter_mm: self.diameter_mm.unwrap_or(usual.diameter_mm),
            asymmetric: self.asymmetric,
            board_id: self.board_id,
            ..usual
        })
    }

    fn solid(&self, paper: &PaperSpec) -> Result<TargetSpec, JsError> {
        let shape = match self.kind.as_str() {
            "tetrahedron" => SolidShape::Tetrahedron,
            "octahedron" => SolidShape::Octahedron,
            "icosahedron" => SolidShape::Icosahedron,
            "cube" => SolidShape::Cube,
            "cuboid" => {
                let size = self.size.as_deref().unwrap_or(CUBOID);
                SolidShape::Cuboid(parse_box_mm(size).raise()?)
            }
            "mesh" => {
                let text = self.mesh.as_deref().unwrap_or_default();
                let (mesh, _) = obj::read(text.as_bytes()).raise()?;
                let scaled = ClosedMesh::new(mesh.vertices(), mesh.faces()).raise()?;
                SolidShape::Mesh(scaled.0)
            }
            other => return Err(JsError::new(&format!("unknown kind of target {other}"))),
        };
        let usual = SolidSpec::new(shape);
        if usual.square_tags.is_some() {
            let what = "this mesh mixes rectangular and other faces, which need two tag families: the deltille \
                        program can make it";
            return Err(JsError::new(what));
        }
        let mut spec = SolidSpec {
            tiles: self.tiles.unwrap_or(usual.tiles),
            board_id: self.board_id,
            tags: self.wanted_tags(usual.shape.tag_tiling(), true),
            inverted: self.inverted,
            skeleton: self.skeleton.then(SkeletonSpec::default),
            ..usual
        };
        spec.edge_mm = self.edge_mm.unwrap_or_else(|| usual_solid_edge_mm(&spec, paper));
        spec.margin_mm = match self.face_margin_mm {
            Some(given) => given,
            None => spec.comfortable_margin_mm().raise()?,
        };
        Ok(TargetSpec::Solid(spec))
    }
}

/// Returns the name of the family that settings need; nothing for a target without tags, or if its file is among the settings.
///
/// # Errors
/// Throws if `settings` is invalid.
#[wasm_bindgen]
pub fn family_of_settings(settings: &str) -> Result<Option<String>, JsError> {
    let wanted: Wanted = serde_json::from_str(settings).raise()?;
    let has_file = wanted.family_file.is_some();
    Ok(wanted.spec()?.family().filter(|_| !has_file).map(str::to_owned))
}

/// A finished target.
#[wasm_bindgen]
pub struct Made {
    printing: Printing,
    paper: PaperSpec,
    kerf_mm: f64,
}

/// The paper of a target.
#[derive(Serialize)]
struct Sheets {
    /// The name of the paper size; nothing for another size.
    paper: Option<String>,
    size_mm: [f64; 2],
    pages: usize,
    /// The edge of a tile of a board, of a solid, of a square or of a tag, or the spacing of circles, mm.
    edge_mm: Option<f64>,
}

#[wasm_bindgen]
impl Made {
    /// Makes the target described by `settings` (JSON). `family` is the content of the family file that [`family_of_settings`]
    /// names.
    ///
    /// # Errors
    /// Throws if the settings are invalid or contradict each other.
    #[wasm_bindgen(constructor)]
    pub fn new(settings: &str, family: Option<String>) -> Result<Self, JsError> {
        let wanted: Wanted = serde_json::from_str(settings).raise()?;
        let (spec, paper) = (wanted.spec()?, wanted.paper()?);
        let family = wanted.family_file.as_deref().or(family.as_deref());
        let family = family.map(Family::from_json).transpose().raise()?;
        let family = family.filter(|_| spec.family().is_some());
        let printing =
            Printing::build(&wanted.name, &spec, family.as_ref(), Some(&paper)).raise()?;
        let finish = Finish { mirrored: wanted.mirrored, ..Finish::default() };
        let printing = printing.finished(finish, paper.margin_mm).raise()?;
        Ok(Self { printing, paper, kerf_mm: wanted.kerf_mm.unwrap_or(0.0) })
    }

    /// Returns the paper of the first sheet, the number of pages, and the edge of the target, as JSON; nothing for a target
    /// without sheets.
    pub fn sheets(&self) -> Option<String> {
        let sheet = self.printing.sheets.first()?;
        let page = sheet.first_page();
        let size_mm = [page.width_mm, page.height_mm];
        let is_same = |paper: &PaperSize| {
            [paper.portrait_mm(), paper.landscape_mm()]
                .map(|size| size.to_array())
                .contains(&size_mm)
        };
        let edge_mm = match &self.printing.target.spec {
            TargetSpec::Board(spec) => Some(spec.edge_mm),
            TargetSpec::Solid(spec) => {
                Some(spec.edge_mm).filter(|_| !matches!(spec.shape, SolidShape::Cuboid(_)))
            }
            TargetSpec::Charuco(spec) => Some(spec.square_mm),
            TargetSpec::AprilGrid(spec) => Some(spec.tag_mm),
            TargetSpec::Circles(spec) => Some(spec.spacing_mm),
            TargetSpec::Tags(_) | TargetSpec::Listed(_) => None,
        };
        let paper = PaperSize::all().find(is_same).map(|paper| paper.name().to_owned());
        let pages = self.printing.page_count();
        serde_json::to_string(&Sheets { paper, size_mm, pages, edge_mm }).ok()
    }

    /// Returns the number of A4 pages on which the target fits at this size, as a poster or in pieces of its net; nothing if it
    /// does not.
    pub fn pages_on_a4(&self) -> Option<usize> {
        let size = PaperSize::all().find(|paper| paper.name() == "A4");
        let paper =
            PaperSpec { size, orientation: Orientation::Auto, poster: true, ..self.paper.clone() };
        let Target { name, spec, .. } = &self.printing.target;
        let family = self.printing.target.family().ok()?;
        Some(Printing::build(name, spec, family, Some(&paper)).ok()?.page_count())
    }

    /// Returns the description of the target.
    pub fn json(&self) -> String {
        self.printing.to_json()
    }

    /// Returns corner, tag and size figures of the target, and the detail a camera must resolve, as JSON.
    ///
    /// # Errors
    /// Throws if the family of its tags is unknown.
    pub fn reach(&self) -> Result<String, JsError> {
        serde_json::to_string(&Reach::of(&self.printing.target).raise()?).raise()
    }

    /// Returns the nearest and the farthest distance, mm, at which a camera can use the target; nothing if there is no such
    /// distance. The camera is given by its horizontal field of view, degrees, and its image width, px.
    pub fn distances_mm(&self, field_of_view_deg: f64, width_px: f64) -> Option<Vec<f64>> {
        let focal_px = width_px / 2.0 / (field_of_view_deg.to_radians() / 2.0).tan();
        let reach = Reach::of(&self.printing.target).ok()?;
        Some(reach.distances_mm(focal_px, width_px)?.to_vec())
    }

    /// Returns how the faces of a solid are joined in its net, as JSON; an empty list if there is no net.
    pub fn hinges(&self) -> String {
        serde_json::to_string(&self.printing.hinges()).unwrap_or_default()
    }

    /// Returns the files of the target in a format, as alternating names and bytes. `files` of the module `prove` returns
    /// PNG pages and meshes, whose writers are large.
    ///
    /// # Errors
    /// Throws if the target cannot be written in this format.
    pub fn files(&self, format: &str) -> Result<Array, JsError> {
        let mut making = Making::default();
        making.kerf_mm = self.kerf_mm;
        // Each call contains only the writer of its kind.
        let made = match format {
            "json" => make(&self.printing, What::Json, making),
            "pdf" => make(&self.printing, What::Pdf, making),
            "svg" => make(&self.printing, What::Svg, making),
            "dsc" => make(&self.printing, What::Dsc(Dialect::Fork), making),
            "net" => make(&self.printing, What::Net, making),
            "panels" => make(&self.printing, What::Panels, making),
            "laser-dxf" => make(&self.printing, What::LaserDxf, making),
            "laser-svg" => make(&self.printing, What::LaserSvg, making),
            "kalibr" => make(&self.printing, What::Kalibr, making),
            _ => {
                return Err(JsError::new(&format!("`files` of `prove` makes the format {format}")));
            }
        };
        Ok(in_array(&made.raise()?))
    }
}
