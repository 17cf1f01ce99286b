//! Makes targets and their files from settings.

use deltille_core::family::Family;
use deltille_core::lattice::GridKind;
use deltille_core::targets::{
    BoardSpec, ClosedMesh, SkeletonSpec, SolidShape, SolidSpec, TagSpec, TagsIn, TargetSpec,
};
use deltille_files::export::artifacts::{Making, What, make};
use deltille_files::export::obj;
use deltille_layout::Reach;
use deltille_layout::{DEFAULT_MARGIN_MM, PaperSpec, Printing, SolidSheets, usual_edge_mm};
use js_sys::{Array, Uint8Array};
use serde::Deserialize;
use wasm_bindgen::prelude::*;

use crate::errors::Raise;

/// Settings of the form. Missing ones have the defaults of the programs.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Wanted {
    /// `deltille`, `checker`, `tetrahedron`, `octahedron`, `icosahedron` or `mesh`.
    kind: String,
    rows: u32,
    cols: u32,
    edge_mm: Option<f64>,
    /// Empty for a board without tags.
    family: Option<String>,
    tags_in: TagsIn,
    tag_spacing: Option<u32>,
    tag_border: Option<f64>,
    first_id: u32,
    boards: u32,
    board_id: u32,
    inverted: bool,
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
    orientation: String,
    margin_mm: Option<f64>,
    name: String,
}

impl Default for Wanted {
    fn default() -> Self {
        Self {
            kind: "deltille".to_owned(),
            rows: 10,
            cols: 11,
            edge_mm: None,
            family: None,
            tags_in: TagsIn::Black,
            tag_spacing: None,
            tag_border: None,
            first_id: 0,
            boards: 1,
            board_id: 0,
            inverted: false,
            tiles: None,
            face_margin_mm: None,
            skeleton: false,
            per_face: false,
            allow_seams: false,
            poster: false,
            packed: false,
            mesh: None,
            paper: None,
            orientation: "auto".to_owned(),
            margin_mm: None,
            name: "board".to_owned(),
        }
    }
}

impl Wanted {
    fn spec(&self) -> Result<TargetSpec, JsError> {
        match self.kind.as_str() {
            "deltille" => Ok(self.board(GridKind::Deltille, &self.paper()?)),
            "checker" => Ok(self.board(GridKind::Checker, &self.paper()?)),
            _ => self.solid(),
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
            poster: self.poster,
            packed: self.packed,
            ..PaperSpec::default()
        })
    }

    fn tags(&self, grid: GridKind) -> TagSpec {
        let usual = TagSpec::usual(grid, self.family.as_deref(), self.tags_in);
        TagSpec {
            first_id: self.first_id,
            spacing: self.tag_spacing.unwrap_or(usual.spacing),
            border_bits: self.tag_border.unwrap_or(usual.border_bits),
            tags_in: self.tags_in,
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
            ..BoardSpec::new(grid, self.rows, self.cols, 1.0)
        };
        spec.edge_mm = self.edge_mm.unwrap_or_else(|| usual_edge_mm(&spec, paper));
        TargetSpec::Board(spec)
    }

    fn solid(&self) -> Result<TargetSpec, JsError> {
        let shape = match self.kind.as_str() {
            "tetrahedron" => SolidShape::Tetrahedron,
            "octahedron" => SolidShape::Octahedron,
            "icosahedron" => SolidShape::Icosahedron,
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
            let what = "this mesh mixes rectangular and other faces, which need two tag families: use \
                        `deltille solid --mesh` instead";
            return Err(JsError::new(what));
        }
        let mut spec = SolidSpec {
            edge_mm: self.edge_mm.unwrap_or(usual.edge_mm),
            tiles: self.tiles.unwrap_or(usual.tiles),
            board_id: self.board_id,
            tags: self.wanted_tags(usual.shape.tag_tiling(), true),
            inverted: self.inverted,
            skeleton: self.skeleton.then(SkeletonSpec::default),
            ..usual
        };
        spec.margin_mm = match self.face_margin_mm {
            Some(given) => given,
            None => spec.comfortable_margin_mm().raise()?,
        };
        Ok(TargetSpec::Solid(spec))
    }
}

/// Returns the name of the family that settings need; nothing for a target without tags.
///
/// # Errors
/// Throws if `settings` is invalid.
#[wasm_bindgen]
pub fn family_of_settings(settings: &str) -> Result<Option<String>, JsError> {
    let wanted: Wanted = serde_json::from_str(settings).raise()?;
    Ok(wanted.spec()?.family().map(str::to_owned))
}

/// A finished target.
#[wasm_bindgen]
pub struct Made {
    printing: Printing,
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
        let family = family.map(|file| Family::from_json(&file)).transpose().raise()?;
        let family = family.filter(|_| spec.family().is_some());
        let printing =
            Printing::build(&wanted.name, &spec, family.as_ref(), Some(&paper)).raise()?;
        Ok(Self { printing })
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

    /// Returns the files of the target in a format, as alternating names and bytes.
    ///
    /// # Errors
    /// Throws if the target cannot be written in this format.
    pub fn files(&self, format: &str, dpi: f64) -> Result<Array, JsError> {
        let what: What = format.parse().raise()?;
        let mut making = Making::default();
        making.dpi = dpi;
        let made = make(&self.printing, what, making).raise()?;
        let files = Array::new();
        for (name, bytes) in made {
            files.push(&JsValue::from_str(&name));
            files.push(&Uint8Array::from(bytes.as_slice()).into());
        }
        Ok(files)
    }
}
