//! Artifacts that are generated, compared and damaged as bytes, without files on disk.

use deltille::artwork;
use deltille::export::artifacts::{self, Making, What};
use deltille::export::dsc::{self, Dialect};
use deltille::export::mesh::{Meshing, Resolution, TexturedMesh};
use deltille::export::{dxf, gltf, obj, pdf, png, sheet_file_name, stl, svg};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::limits::{Guard, Limits};
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TargetSpec};
use deltille::verify::{Artifact, Verdict, Verifier, VerifyError, verify};

const DPI: f64 = 150.0;

fn family() -> Family {
    Family::shipped("delTag25h7").unwrap()
}

fn build(name: &str, spec: TargetSpec, paper: PaperSpec) -> Printing {
    Printing::build(name, &spec, Some(&family()), Some(&paper)).unwrap()
}

fn board() -> Printing {
    let spec = BoardSpec::new(GridKind::Deltille, 4, 5, 20.0);
    build("b", TargetSpec::Board(spec), PaperSpec::default())
}

fn icosahedron() -> SolidSpec {
    SolidSpec { edge_mm: 60.0, tiles: 7, margin_mm: 4.0, ..SolidSpec::new(SolidShape::Icosahedron) }
}

/// Returns the pages of a target as separate files.
fn pages(target: &Printing) -> Vec<Artifact> {
    let artwork = target.draw().unwrap();
    let count = artwork.sheets.len();
    let page = |index| {
        let name = sheet_file_name(&target.target.name, index, count, "svg");
        Artifact::new(name, svg::to_string(&artwork, index))
    };
    (0..count).map(page).collect()
}

/// Returns the artifacts that every target has.
fn drawn(target: &Printing) -> Vec<Artifact> {
    let artwork = target.draw().unwrap();
    let named = |extension: &str| format!("{}.{extension}", target.target.name);
    let mut files = pages(target);
    files.push(Artifact::new(named("pdf"), pdf::to_bytes(&artwork)));
    files.push(Artifact::new(named("dsc"), dsc::write(&target.target, Dialect::Fork).unwrap()));
    files
}

/// Returns a board in its four formats.
fn board_files(target: &Printing) -> Vec<Artifact> {
    let artwork = target.draw().unwrap();
    let picture = png::to_bytes(&artwork.sheets[0], &artwork.title, DPI).unwrap();
    [drawn(target), vec![Artifact::new("b.png", picture)]].concat()
}

/// Returns a solid in all its formats.
fn solid_files(target: &Printing, spec: &SolidSpec) -> Vec<Artifact> {
    let mesh = TexturedMesh::new(&target.target, Meshing::default()).unwrap();
    let body = stl::to_bytes("i", &spec.polyhedron().triangles_mm());
    let cut = |drawing| dxf::text(&drawing);
    let more = [
        Artifact::new("i.glb", gltf::to_bytes(&mesh)),
        Artifact::new("i.obj", obj::text(&mesh)),
        Artifact::new("i.mtl", obj::material(&mesh)),
        Artifact::new(obj::texture_name("i", 0, 1), mesh.textures[0].png.as_slice()),
        Artifact::new("i.stl", body),
        Artifact::new("i-panels.dxf", cut(artwork::panels_to_cut(&target.target).unwrap())),
        Artifact::new("i-net.dxf", cut(artwork::net_to_cut(target).unwrap())),
    ];
    [drawn(target), more.to_vec()].concat()
}

/// Returns the files, with changed bytes in one of them.
fn changed(files: &[Artifact], name: &str, change: impl Fn(&mut Vec<u8>)) -> Vec<Artifact> {
    let change = |file: &Artifact| {
        let mut bytes = file.bytes().to_vec();
        if file.name() == name {
            change(&mut bytes);
            assert_ne!(bytes, file.bytes(), "{name} is unchanged");
        }
        Artifact::new(file.name(), bytes)
    };
    files.iter().map(change).collect()
}

/// Replaces the first occurrence of some bytes.
fn replace<'a>(from: &'a str, to: &'a str) -> impl Fn(&mut Vec<u8>) + 'a {
    move |bytes| {
        let mut windows = bytes.windows(from.len());
        let at = windows.position(|window| window == from.as_bytes()).expect("it is there");
        bytes.splice(at..at + from.len(), to.bytes());
    }
}

#[track_caller]
fn compare(target: &Printing, name: &str, files: &[Artifact]) -> Verdict {
    verify(target, name, files).unwrap()
}

#[track_caller]
fn assert_told(verdict: &Verdict, said: &str) {
    let line = verdict.to_string();
    assert!(!verdict.passed && line.contains(said), "no {said:?} in {line}");
}

#[test]
fn a_board_is_verified_in_memory_and_every_change_is_found() {
    let target = board();
    let files = board_files(&target);
    for file in &files {
        let verdict = compare(&target, file.name(), &files);
        assert!(verdict.passed, "{verdict}");
    }
    for (name, from, to, said) in [
        ("b.svg", "calibration target", "calibration tarpet", "describe"),
        ("b.svg", "id=\"label-0\"", "id=\"label-0\" opacity=\"0\"", "opacity"),
        ("b.pdf", "/MediaBox", "/MediaBoy", "MediaBo"),
        ("b.png", "IDAT", "IDAU", "IDAU"),
        ("b.dsc", "delTag25h7", "delTag16h5", "family"),
    ] {
        let damaged = changed(&files, name, replace(from, to));
        match verify(&target, name, &damaged) {
            Ok(verdict) => assert_told(&verdict, said),
            Err(error) => panic!("{name}: {error}"),
        }
    }
    let mut artwork = target.draw().unwrap();
    artwork.sheets[0].shapes.remove(0);
    for file in [
        Artifact::new("b.pdf", pdf::to_bytes(&artwork)),
        Artifact::new("b.png", png::to_bytes(&artwork.sheets[0], "b", DPI).unwrap()),
    ] {
        let verdict = compare(&target, file.name(), std::slice::from_ref(&file));
        assert_told(&verdict, "tile missing at row -1 col 1");
    }
}

#[test]
fn a_solid_is_verified_in_memory_with_the_files_that_belong_together() {
    let spec = icosahedron();
    let target = build("i", TargetSpec::Solid(spec.clone()), PaperSpec::default());
    let files = solid_files(&target, &spec);
    let with_their_mesh = ["i.mtl", &obj::texture_name("i", 0, 1)].map(str::to_owned);
    for file in files.iter().filter(|file| !with_their_mesh.contains(&file.name().to_owned())) {
        let verdict = compare(&target, file.name(), &files);
        assert!(verdict.passed, "{verdict}");
    }
    let part = verify(&target, "i.mtl", &files);
    assert!(matches!(part, Err(VerifyError::PartOf { .. })), "{part:?}");

    // All files of an artifact must be given.
    for (name, without) in [("i.obj", "i.mtl"), ("i.obj", "i-texture.png"), ("i.stl", "i.stl")] {
        let rest: Vec<Artifact> =
            files.iter().filter(|file| file.name() != without).cloned().collect();
        let error = verify(&target, name, &rest).unwrap_err();
        assert_eq!(error.to_string(), format!("{without}: not among the given files"));
    }
    for (name, part, from, to, said) in [
        ("i.obj", "i.obj", "\nvn 0", "\nvn 1", "normals"),
        ("i.obj", "i.mtl", "Kd 1 1 1", "Kd 1 1 0", "Kd 1 1 0"),
        ("i.glb", "i.glb", "\"version\":\"2.0\"", "\"version\":\"2.1\"", "version"),
        ("i-net.dxf", "i-net.dxf", "POLYLINE", "POLYLINF", "POLYLINF"),
    ] {
        let damaged = changed(&files, part, replace(from, to));
        assert_told(&compare(&target, name, &damaged), said);
    }
    let flipped = changed(&files, "i.stl", |bytes| bytes[103] ^= 0x40);
    assert_told(&compare(&target, "i.stl", &flipped), "FAILED");
}

/// Each face must have the right one of several textures, in every format.
#[test]
fn a_solid_with_several_textures_is_verified_in_memory() {
    let spec = SolidSpec { tiles: 6, ..SolidSpec::new(SolidShape::Tetrahedron) };
    let target = build("i", TargetSpec::Solid(spec), PaperSpec::default());
    let mut making = Making::default();
    (making.mesh.textures, making.mesh.resolution) = (3, Resolution::Side(700));
    for (what, name) in [
        (What::Gltf, "i.glb"),
        (What::Obj, "i.obj"),
        (What::Sdf, "i.sdf"),
        (What::Mjcf, "i.xml"),
        (What::Usd, "i.usda"),
    ] {
        let files = artifacts::make(&target, what, making).unwrap();
        let files: Vec<Artifact> =
            files.into_iter().map(|(name, bytes)| Artifact::new(name, bytes)).collect();
        let verdict = compare(&target, name, &files);
        assert!(verdict.passed, "{verdict}");
        // The limit applies to all textures together: none has more than half a megapixel.
        let verifier = Verifier::new(&target).unwrap();
        let mut limits = Limits::default();
        limits.max_pixels = 500_000;
        let error = verifier.within(limits).verify(name, &files).unwrap_err().to_string();
        assert!(error.contains("max_pixels"), "{name}: {error}");
    }
}

/// The texts on the sheets of a net are part of its description, so a print with other texts differs from it.
#[test]
fn labels_of_a_net_in_memory_are_compared_by_their_text() {
    let paper = PaperSpec { size: Some("A4".parse().unwrap()), ..PaperSpec::default() };
    let target = build("i", TargetSpec::Solid(icosahedron()), paper);
    let whole = pages(&target);
    let renumbered = target.to_json().replacen("\"text\": \"face 3\"", "\"text\": \"face 4\"", 1);
    let renumbered = Printing::from_json(&renumbered).unwrap();
    let name = whole[0].name();
    assert_told(&compare(&target, name, &pages(&renumbered)), "differs from the description");
    assert_told(&compare(&renumbered, name, &pages(&renumbered)), "instead of face number 3");
    assert_told(&compare(&target, name, &whole[..1]), "i-2.svg is missing");
    let verifier = || Verifier::new(&target).unwrap();
    let guarded = verifier().with_guard(Guard::Timed).verify(name, &whole).unwrap();
    assert_eq!(verifier().verify(name, &whole).unwrap(), guarded);
}
