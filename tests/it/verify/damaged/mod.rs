//! A corpus of damaged artifacts. Each differs from a valid one by a single cause and must fail. The findings, which
//! must name the cause, are compared with a page for each format in `tests/snapshots`.
//!
//! Most of the damage is not visible in the image that the verifier renders, but would change what other viewers
//! show. Each format has a table with a line for each cause.

mod edit;
pub mod glb;
mod lists;
mod obj;
mod pdf;
pub mod png;
mod split;
mod stl;
mod svg;

use std::ffi::OsStr;
use std::fs;
use std::path::{MAIN_SEPARATOR, Path};
use std::sync::LazyLock;

use deltille::artwork;
use deltille::export::artifacts::{Making, What, make};
use deltille::export::dsc::{self, Dialect};
use deltille::export::mesh::{Meshing, TexturedMesh};
use deltille::export::{
    dxf, gltf, obj as obj_writer, pdf as pdf_writer, png as png_writer, stl as stl_writer,
    svg as svg_writer,
};
use deltille::lattice::GridKind;
use deltille::layout::Printing;
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TargetSpec};
use deltille::verify::{Finding, Format, Verdict, Verifier, whole_of};
use deltille_core::words::shown;
use tempfile::TempDir;

use crate::common::page::Page;
use crate::common::verdict::findings;

/// Minimum number of damaged files.
const LEAST: usize = 440;

/// One way of damaging a file.
pub struct Case {
    /// Description of the damage.
    name: &'static str,
    /// File that is damaged.
    file: &'static str,
    damage: Damage,
}

/// Damages a valid file.
pub type Damage = Box<dyn Fn(&[u8]) -> Vec<u8>>;

/// A line of a table: the description of the damage, and the damage.
type Row = (&'static str, Damage);

/// Creates the cases of a table, all for one file.
fn cases(file: &'static str, rows: Vec<Row>) -> Vec<Case> {
    let case = |(name, damage)| Case { name, file, damage };
    rows.into_iter().map(case).collect()
}

/// A target with its files in a folder.
struct Artifacts {
    target: Printing,
    folder: TempDir,
}

/// Creates a small board as `b.pdf`, `.svg`, `.png` and `.dsc`.
static BOARD: LazyLock<Artifacts> = LazyLock::new(|| {
    let spec = TargetSpec::Board(BoardSpec::new(GridKind::Deltille, 4, 5, 20.0));
    let artifacts = Artifacts::new("b", &spec);
    artifacts.draw();
    artifacts
});

/// Creates a small tetrahedron in all formats; its net fits on one page.
static SOLID: LazyLock<Artifacts> = LazyLock::new(|| {
    let spec = SolidSpec {
        edge_mm: 60.0,
        tiles: 7,
        margin_mm: 4.0,
        ..SolidSpec::new(SolidShape::Tetrahedron)
    };
    let artifacts = Artifacts::new("t", &TargetSpec::Solid(spec.clone()));
    artifacts.draw();
    let (target, write) =
        (&artifacts.target, |name: &str, bytes: &[u8]| artifacts.write(name, bytes));
    let mesh = TexturedMesh::new(&target.target, Meshing::default()).unwrap();
    write("t.glb", &gltf::to_bytes(&mesh));
    write("t.obj", obj_writer::text(&mesh).as_bytes());
    write("t.mtl", obj_writer::material(&mesh).as_bytes());
    write("t-texture.png", &mesh.textures[0].png);
    write("t.stl", &stl_writer::to_bytes("t", &spec.polyhedron().triangles_mm()));
    write("t-panels.dxf", dxf::text(&artwork::panels_to_cut(&target.target).unwrap()).as_bytes());
    write("t-net.dxf", dxf::text(&artwork::net_to_cut(target).unwrap()).as_bytes());
    artifacts
});

/// Creates a small tetrahedron as meshes with two textures.
static SPLIT: LazyLock<Artifacts> = LazyLock::new(|| {
    let spec = SolidSpec {
        edge_mm: 60.0,
        tiles: 7,
        margin_mm: 4.0,
        ..SolidSpec::new(SolidShape::Tetrahedron)
    };
    let artifacts = Artifacts::new("s", &TargetSpec::Solid(spec));
    let mut making = Making::default();
    making.mesh.textures = 2;
    for what in [What::Gltf, What::Mjcf, What::Usd] {
        let files = make(&artifacts.target, what, making).unwrap();
        files.iter().for_each(|(name, bytes)| artifacts.write(name, bytes));
    }
    artifacts
});

impl Artifacts {
    fn new(name: &str, spec: &TargetSpec) -> Self {
        let target = Printing::new(name, spec.clone()).unwrap();
        Self { target, folder: TempDir::new().unwrap() }
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.folder.path().join(name), bytes).unwrap();
    }

    /// Writes the formats that all targets have.
    fn draw(&self) {
        let artwork = self.target.draw().unwrap();
        let path =
            |extension| self.folder.path().join(format!("{}.{extension}", self.target.target.name));
        pdf_writer::write(&artwork, &path("pdf")).unwrap();
        svg_writer::write(&artwork, 0, &path("svg")).unwrap();
        png_writer::write(&artwork.sheets[0], &artwork.title, &path("png"), 300.0).unwrap();
        let list = dsc::write(&self.target.target, Dialect::Fork).unwrap();
        fs::write(path("dsc"), list).unwrap();
    }

    fn verify(&self, path: &Path) -> Result<Verdict, String> {
        let verifier = Verifier::new(&self.target).unwrap();
        verifier.verify_path(path).map_err(|error| error.to_string())
    }

    /// Returns the report on a damaged file, or `None` if it passes.
    fn damaged(&self, case: &Case) -> Option<String> {
        let good = fs::read(self.folder.path().join(case.file)).unwrap();
        let bad = (case.damage)(&good);
        assert!(bad != good, "{}, {}: the file is unchanged", case.file, case.name);
        let folder = TempDir::new().unwrap();
        // Material libraries and textures are verified with their mesh, parts of the mesh with the MuJoCo model.
        for entry in fs::read_dir(self.folder.path()).unwrap() {
            let path = entry.unwrap().path();
            let is_part = ["obj", "mtl", "png", "xml"].map(OsStr::new);
            if path.extension().is_some_and(|extension| is_part.contains(&extension)) {
                fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
            }
        }
        fs::write(folder.path().join(case.file), bad).unwrap();
        let verified = match case.file {
            "t.mtl" | "t-texture.png" => "t.obj",
            "s.mtl" | "s-texture-2.png" => "s.obj",
            "s-2.obj" => "s.xml",
            file => file,
        };
        match self.verify(&folder.path().join(verified)) {
            Ok(verdict) if verdict.passed => None,
            Ok(verdict) => Some(found(&verdict)),
            Err(error) => {
                let place = format!("{}{MAIN_SEPARATOR}", folder.path().display());
                Some(format!("not read: {}", error.replace(&place, "")))
            }
        }
    }

    /// Verifies damaged files and adds the findings to a page.
    fn all_fail(&self, cases: &[Case], page: &mut Page) {
        let mut passing = Vec::new();
        for case in cases {
            let name = format!("{}: {}", case.file, case.name);
            match self.damaged(case) {
                None => passing.push(name),
                Some(found) => page.said(&name, &found),
            }
        }
        assert_eq!(passing, [""; 0], "damaged files that pass");
    }
}

/// Lists the kind and text of the first few findings, one per line, and the number of further findings.
fn found(verdict: &Verdict) -> String {
    const SHOWN: usize = 4;
    let kind = |finding: &Finding| serde_json::to_value(finding).unwrap()["kind"].clone();
    let all = findings(verdict);
    let line = |finding: &Finding| {
        let kind = kind(finding);
        let kind = kind.as_str().expect("a finding has a kind");
        format!("{kind}: {}\n", shown(&finding.to_string()))
    };
    let all: Vec<String> = all.map(line).collect();
    let more = all.len().saturating_sub(SHOWN);
    let more = if more > 0 { format!("and {more} more\n") } else { String::new() };
    all.iter().take(SHOWN).cloned().collect::<String>() + &more
}

#[test]
fn undamaged_artifacts_pass() {
    for (artifacts, least) in [(&*BOARD, 4), (&*SOLID, 9), (&*SPLIT, 4)] {
        let mut passed = 0;
        for entry in fs::read_dir(artifacts.folder.path()).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy();
            if Format::of(&path).is_none()
                || whole_of(&artifacts.target.target.name, &name).is_some()
            {
                continue;
            }
            let verdict = artifacts.verify(&path).unwrap();
            assert!(verdict.passed, "{verdict}");
            passed += 1;
        }
        assert_eq!(passed, least);
    }
}

#[test]
fn the_corpus_is_large_and_its_names_are_unique() {
    let board = [svg::board(), pdf::board(), png::board(), lists::dsc()];
    let solid = [
        svg::net(),
        glb::all(),
        obj::mesh(),
        obj::material(),
        obj::texture(),
        stl::all(),
        lists::net(),
        lists::panels(),
    ];
    let split = [
        split::glb(),
        split::obj(),
        split::material(),
        split::texture(),
        split::usd(),
        split::mujoco(),
    ];
    let all: Vec<Case> = board.into_iter().chain(solid).chain(split).flatten().collect();
    assert!(all.len() >= LEAST, "{} cases", all.len());
    let mut names: Vec<_> = all.iter().map(|case| (case.file, case.name)).collect();
    names.sort_unstable();
    let twice = names.windows(2).find(|pair| pair[0] == pair[1]);
    assert_eq!(twice, None);
}

#[test]
fn damaged_svg_fails() {
    let mut page = Page::default();
    BOARD.all_fail(&svg::board(), &mut page);
    SOLID.all_fail(&svg::net(), &mut page);
    page.is("damaged-svg");
}

#[test]
fn damaged_pdf_fails() {
    let mut page = Page::default();
    BOARD.all_fail(&pdf::board(), &mut page);
    page.is("damaged-pdf");
}

#[test]
fn damaged_png_fails() {
    let mut page = Page::default();
    BOARD.all_fail(&png::board(), &mut page);
    page.is("damaged-png");
}

#[test]
fn damaged_glb_fails() {
    let mut page = Page::default();
    SOLID.all_fail(&glb::all(), &mut page);
    page.is("damaged-glb");
}

#[test]
fn damaged_obj_fails() {
    let mut page = Page::default();
    SOLID.all_fail(&obj::mesh(), &mut page);
    SOLID.all_fail(&obj::material(), &mut page);
    SOLID.all_fail(&obj::texture(), &mut page);
    page.is("damaged-obj");
}

#[test]
fn damaged_meshes_of_two_textures_fail() {
    let mut page = Page::default();
    SPLIT.all_fail(&split::glb(), &mut page);
    SPLIT.all_fail(&split::obj(), &mut page);
    SPLIT.all_fail(&split::material(), &mut page);
    SPLIT.all_fail(&split::texture(), &mut page);
    SPLIT.all_fail(&split::usd(), &mut page);
    SPLIT.all_fail(&split::mujoco(), &mut page);
    page.is("damaged-split");
}

#[test]
fn damaged_stl_fails() {
    let mut page = Page::default();
    SOLID.all_fail(&stl::all(), &mut page);
    page.is("damaged-stl");
}

#[test]
fn damaged_dsc_fails() {
    let mut page = Page::default();
    BOARD.all_fail(&lists::dsc(), &mut page);
    page.is("damaged-dsc");
}

#[test]
fn damaged_dxf_fails() {
    let mut page = Page::default();
    SOLID.all_fail(&lists::net(), &mut page);
    SOLID.all_fail(&lists::panels(), &mut page);
    page.is("damaged-dxf");
}
