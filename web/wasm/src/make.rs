//! Settings to targets, their files, and the files read back.

use deltille_core::family::Family;
use deltille_core::lattice::GridKind;
use deltille_core::targets::{
    BoardSpec, ClosedMesh, DEFAULT_MARGIN_MM, PaperSpec, SkeletonSpec, SolidShape, SolidSheets,
    SolidSpec, TagSpec, TagsIn, Target, TargetSpec, usual_edge_mm,
};
use deltille_files::export::artifacts::{Making, What, make};
use deltille_files::export::obj;
use deltille_files::family_file;
use deltille_verify::{Artifact, Verifier};
use js_sys::{Array, Uint8Array};
use serde::Deserialize;
use wasm_bindgen::prelude::*;

use crate::errors::{Raise, told};

/// What a form says. What is left out is as the programs have it.
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
            mesh: None,
            paper: None,
            orientation: "auto".to_owned(),
            margin_mm: None,
            name: "board".to_owned(),
        }
    }
}

impl Wanted {
    fn paper(&self) -> Result<PaperSpec, JsError> {
        let size = self.paper.as_deref().filter(|paper| !paper.is_empty());
        Ok(PaperSpec {
            size: size.map(str::parse).transpose().raise()?,
            orientation: self.orientation.parse().raise()?,
            margin_mm: self.margin_mm.unwrap_or(DEFAULT_MARGIN_MM),
            solids: if self.per_face { SolidSheets::PerFace } else { SolidSheets::Net },
            ..PaperSpec::default()
        })
    }

    fn tags(&self, usual: TagSpec) -> TagSpec {
        TagSpec {
            family: self.family.clone().unwrap_or(usual.family),
            first_id: self.first_id,
            spacing: self.tag_spacing.unwrap_or(usual.spacing),
            border_bits: self.tag_border.unwrap_or(usual.border_bits),
            tags_in: self.tags_in,
        }
    }

    fn board(&self, grid: GridKind, paper: &PaperSpec) -> TargetSpec {
        let has_tags = match (&self.family, grid) {
            (Some(family), _) => !family.is_empty(),
            (None, grid) => grid == GridKind::Deltille,
        };
        let tags = has_tags.then(|| match grid {
            GridKind::Deltille => self.tags(TagSpec::default()),
            GridKind::Checker => self.tags(TagSpec::for_squares(self.tags_in)),
        });
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
            other => return Err(JsError::new(&format!("{other} is no kind of target"))),
        };
        let usual = SolidSpec::new(shape);
        let mut spec = SolidSpec {
            edge_mm: self.edge_mm.unwrap_or(usual.edge_mm),
            tiles: self.tiles.unwrap_or(usual.tiles),
            board_id: self.board_id,
            tags: self.tags(TagSpec::default()),
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

/// A target that was made, with the family of its tags.
#[wasm_bindgen]
pub struct Made {
    target: Target,
    family: Option<Family>,
}

#[wasm_bindgen]
impl Made {
    /// The target of settings, which are JSON.
    ///
    /// # Errors
    /// In words, where there is no such target.
    #[wasm_bindgen(constructor)]
    pub fn new(settings: &str) -> Result<Self, JsError> {
        let wanted: Wanted = serde_json::from_str(settings).raise()?;
        let paper = wanted.paper()?;
        let spec = match wanted.kind.as_str() {
            "deltille" => wanted.board(GridKind::Deltille, &paper),
            "checker" => wanted.board(GridKind::Checker, &paper),
            _ => wanted.solid()?,
        };
        let tags = match &spec {
            TargetSpec::Board(board) => board.tags.as_ref(),
            TargetSpec::Solid(solid) => Some(&solid.tags),
            _ => None,
        };
        let family = tags.map(|tags| family_file::resolve(&tags.family)).transpose().raise()?;
        let target = Target::build(&wanted.name, &spec, family.as_ref(), Some(&paper)).raise()?;
        Ok(Self { target, family })
    }

    /// The description.
    pub fn json(&self) -> String {
        self.target.to_json()
    }

    /// How many corners there are.
    pub fn corner_count(&self) -> usize {
        self.target.panels.iter().map(|panel| panel.corners.len()).sum()
    }

    /// How many tags there are, and how many codes the family has; 0 without tags.
    pub fn tag_counts(&self) -> Vec<u32> {
        let tags = self.target.panels.iter().map(|panel| panel.tags.len()).sum::<usize>();
        let codes = self.family.as_ref().map_or(0, Family::len);
        vec![tags as u32, codes as u32]
    }

    /// Edge of a tile, width of a cell of a tag (0 without tags) and the longest side of the box around all corners, mm.
    pub fn sizes_mm(&self) -> Vec<f64> {
        let Some(panel) = self.target.panels.first() else { return vec![0.0; 3] };
        let family = self.family.as_ref().filter(|_| !panel.tags.is_empty());
        let cell = family
            .map_or(0.0, |family| panel.edge_mm / family.cells().width(panel.tag_inset_bits()));
        let places =
            || self.target.panels.iter().flat_map(|panel| &panel.corners).map(|c| c.target_mm);
        let first = places().next().unwrap_or_default();
        let (least, most) =
            places().fold((first, first), |(least, most), at| (least.min(at), most.max(at)));
        vec![panel.edge_mm, cell, (most - least).max_element()]
    }

    /// Names and bytes of the files of a format, one after the other.
    ///
    /// # Errors
    /// In words, where the target has no such file.
    pub fn files(&self, format: &str, dpi: f64) -> Result<Array, JsError> {
        let what: What = format.parse().raise()?;
        let mut making = Making::default();
        making.dpi = dpi;
        let made = make(&self.target, self.family.as_ref(), what, making).raise()?;
        let files = Array::new();
        for (name, bytes) in made {
            files.push(&JsValue::from_str(&name));
            files.push(&Uint8Array::from(bytes.as_slice()).into());
        }
        Ok(files)
    }

    /// Reads a file back and compares it with the target: the verdict as JSON, with the sentences of its findings.
    ///
    /// # Errors
    /// In words, where nothing can be compared.
    pub fn prove(&self, names: Vec<String>, contents: Vec<Uint8Array>) -> Result<String, JsError> {
        let verifier = Verifier::new(&self.target, self.family.as_ref()).raise()?;
        let artifacts = names
            .iter()
            .zip(&contents)
            .map(|(name, bytes)| Artifact::new(name.clone(), bytes.to_vec()));
        let artifacts: Vec<_> = artifacts.collect();
        let name = names.first().ok_or_else(|| JsError::new("there is no file"))?;
        let verdict = verifier.verify(name, &artifacts).raise()?;
        let of_sheets = verdict.sheets.iter().flat_map(|sheet| &sheet.findings);
        let of_faces = verdict.faces.iter().flat_map(|face| &face.findings);
        let all = verdict.findings.iter().chain(of_sheets).chain(of_faces);
        let sentences: Vec<String> = all.map(|finding| told(&finding)).collect();
        let said = serde_json::json!({
            "passed": verdict.passed, "summary": told(&verdict), "sentences": sentences, "verdict": verdict,
        });
        Ok(said.to_string())
    }
}
