//! Changed numbers in files: either the file is refused with the name of the field, or all results are finite.

use crate::common::view::tilted;
use deltille::calibrate::{Calibration, Model, Reference, views};
use deltille::camera::Camera;
use deltille::detect::{Detection, Grid, GridCorner};
use deltille::export::calibration::{self, Print, Residuals};
use deltille::export::{camera, detection, dsc, orpc};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::targets::{
    BoardSpec, ClosedMesh, Polyhedron, SolidShape, SolidSpec, Target, TargetSpec,
};
use glam::DVec3;
use rand::SeedableRng;
use serde_json::Value;

/// Replacements of numbers; values that JSON cannot represent are left out there.
const HOSTILE: [&str; 13] = [
    "1e308",
    "-1e308",
    "1e-308",
    "1e160",
    "1e-160",
    "NaN",
    "inf",
    "-1",
    "0",
    "4294967295",
    "4294967296",
    "9007199254740992",
    "-2147483648",
];

/// Positions of the numbers in a text, outside quotes.
fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let bytes = text.as_bytes();
    let in_number = |b: u8| b.is_ascii_digit() || b"+-.eE".contains(&b);
    let mut found = Vec::new();
    let (mut at, mut quoted) = (0, false);
    while at < bytes.len() {
        match bytes[at] {
            b'"' => quoted = !quoted,
            b if !quoted && (b.is_ascii_digit() || b == b'-') => {
                let before = at.checked_sub(1).map_or(b' ', |i| bytes[i]);
                let length = bytes[at..].iter().take_while(|&&b| in_number(b)).count();
                let word = &text[at..at + length];
                if !before.is_ascii_alphabetic() && word.parse::<f64>().is_ok() {
                    found.push(at..at + length);
                }
                at += length;
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    found
}

/// Texts that differ from this one in one number, each with a description of the change. Of long texts, about `most` evenly
/// sampled numbers are changed.
fn changed(text: &str, most: usize) -> impl Iterator<Item = (String, String)> + use<'_> {
    let places = numbers(text);
    assert!(!places.is_empty());
    let step = places.len().div_ceil(most);
    let some: Vec<_> = places.into_iter().step_by(step).collect();
    some.into_iter().enumerate().flat_map(move |(nth, place)| {
        HOSTILE.iter().map(move |hostile| {
            let line = text[..place.start].matches('\n').count() + 1;
            let changed = format!("{}{hostile}{}", &text[..place.start], &text[place.end..]);
            (changed, format!("number {nth}, line {line}, made {hostile}"))
        })
    })
}

/// Asserts that an error is one short line.
fn is_told(said: &str, what: &str) {
    assert!(!said.is_empty() && said.lines().count() == 1 && said.len() < 500, "{what}: {said}");
}

/// Asserts that all numbers of a text are finite; JSON writes `null` for others.
fn is_finite(text: &str, what: &str) {
    for word in text.split(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c))) {
        let none = matches!(word.to_lowercase().as_str(), "nan" | "inf" | "-inf" | "infinity");
        assert!(!none, "{what}: {word}");
        if let Ok(number) = word.parse::<f64>() {
            assert!(number.is_finite(), "{what}: {word}");
        }
    }
}

fn is_finite_json(text: &str, what: &str) {
    is_finite(text, what);
    fn numbers(value: &Value, path: &str, what: &str) {
        match value {
            Value::Array(values) => {
                for value in values {
                    assert!(!value.is_null(), "{what}: {path} has a null");
                    numbers(value, path, what);
                }
            }
            Value::Object(fields) => {
                for (field, value) in fields {
                    numbers(value, &format!("{path}.{field}"), what);
                }
            }
            _ => {}
        }
    }
    numbers(&serde_json::from_str(text).unwrap(), "", what);
}

fn board() -> Printing {
    let spec = BoardSpec::new(GridKind::Deltille, 5, 4, 20.0);
    let family = Family::shipped("delTag25h7").unwrap();
    let paper = PaperSpec::default();
    Printing::build("board", &TargetSpec::Board(spec), Some(&family), Some(&paper)).unwrap()
}

fn solid() -> Printing {
    let spec = SolidSpec { tiles: 6, ..SolidSpec::new(SolidShape::Tetrahedron) };
    let family = Family::shipped("delTag25h7").unwrap();
    Target::build("solid", &TargetSpec::Solid(spec), Some(&family)).unwrap().into()
}

/// A solid described by its triangles.
fn mesh() -> Printing {
    let octahedron = Polyhedron::octahedron(120.0);
    let (mesh, _) = ClosedMesh::new(&octahedron.vertices_mm, &octahedron.faces).unwrap();
    let spec = SolidSpec { tiles: 6, ..SolidSpec::new(SolidShape::Mesh(mesh)) };
    let family = Family::shipped("delTag25h7").unwrap();
    Target::build("mesh", &TargetSpec::Solid(spec), Some(&family)).unwrap().into()
}

/// A solid described by the lengths of its sides.
fn cuboid() -> Printing {
    let shape = SolidShape::Cuboid(DVec3::new(90.0, 70.0, 60.0));
    let spec = SolidSpec { tiles: 6, ..SolidSpec::new(shape) };
    let family = Family::shipped("aprilTag36h11").unwrap();
    Target::build("cuboid", &TargetSpec::Solid(spec), Some(&family)).unwrap().into()
}

/// The measured solid: poses with their covariances.
fn measured() -> Printing {
    let mut target = solid();
    for panel in &mut target.target.panels {
        let entry = |i: usize, j: usize| if i == j { 1e-4 } else { 1e-6 };
        panel.pose.covariance = Some(std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j))));
    }
    target
}

fn pictures(target: &Printing) -> Vec<(String, Detection)> {
    let camera = Camera::from_yaml(CAMERA).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    let middle = target.target.panels[0].middle_mm();
    (0..5)
        .map(|index| {
            let pose = tilted(&mut rng, middle, 260.0, 0.5);
            let panel = &target.target.panels[0];
            let corner = |corner: &deltille::targets::Corner| {
                let (x, y) = camera.project(pose.apply(corner.target_mm)).unwrap().into();
                let (row, col, id) = (corner.row, corner.col, Some(corner.id));
                GridCorner { row, col, id, x, y, cov: Some([1e-3, 1e-5, 2e-3]) }
            };
            let grid = Grid {
                kind: panel.kind,
                target: None,
                panel: Some(panel.id),
                mirrored: false,
                corners: panel.corners.iter().map(corner).collect(),
                tags: Vec::new(),
            };
            let size = [camera.width, camera.height];
            let detection = Detection::new(format!("{index}.png"), size, vec![grid]);
            (index.to_string(), detection)
        })
        .collect()
}

const CAMERA: &str = "width: 1280\nheight: 960\nfocal_px: [1100.5, 1100]\ncentre_px: [639.5, 479.5]\n\
                      model: pinhole\ndistortion: [-0.1, 0.02]\n";

#[test]
fn targets() {
    for target in [board(), solid(), mesh(), cuboid(), measured()] {
        for (text, what) in changed(&target.to_json(), 150) {
            match Printing::from_json(&text) {
                Err(error) => is_told(&error.to_string(), &what),
                Ok(target) => {
                    is_finite_json(&target.to_json(), &what);
                    if let Ok(text) = dsc::write(&target.target, dsc::Dialect::Fork) {
                        is_finite(&text, &what);
                    }
                }
            }
        }
    }
}

#[test]
fn lists() {
    for target in [board(), solid()] {
        let text = dsc::write(&target.target, dsc::Dialect::Fork).unwrap();
        for (text, what) in changed(&text, 120) {
            match dsc::read(&text, "list") {
                Err(error) => is_told(&error.to_string(), &what),
                Ok(target) => {
                    is_finite_json(&target.to_json(), &what);
                    // A file that is read can be written and read again.
                    Printing::from_json(&target.to_json())
                        .unwrap_or_else(|e| panic!("{what}: {e}"));
                    is_finite(&dsc::write(&target, dsc::Dialect::Fork).unwrap(), &what);
                }
            }
        }
    }
}

#[test]
fn cameras() {
    let ros = "image_width: 640\nimage_height: 480\n\
               camera_matrix: {data: [500.5, 0, 320, 0, 501, 240, 0, 0, 1]}\n\
               distortion_model: plumb_bob\n\
               distortion_coefficients: {data: [-0.1, 0.01, 0.001, 0.002, 0]}\n";
    let fisheye = CAMERA.replace("pinhole", "fisheye");
    let two = CAMERA.replace("[-0.1, 0.02]", "[0.6, 1.1]");
    let texts = [
        CAMERA,
        ros,
        &fisheye,
        &two.replace("pinhole", "eucm"),
        &CAMERA.replace("pinhole", "double-sphere").replace("[-0.1, 0.02]", "[-0.2, 0.6]"),
        "cam0:\n  camera_model: omni\n  intrinsics: [1.2, 500.5, 501, 320, 240]\n  distortion_model: none\n  \
         distortion_coeffs: []\n  resolution: [640, 480]\n",
        "1 RADIAL 640 480 500.5 320.5 240.5 -0.1 0.02\n",
        "{ 'lensmodel': 'LENSMODEL_OPENCV4', 'intrinsics': [ 500.5, 501, 320, 240, -0.1, 0.01, 0.001, 0.002, ], \
         'imagersize': [ 640, 480 ] }\n",
    ];
    for text in texts {
        assert!(Camera::from_yaml(text).is_ok(), "{text}");
        let yaml = text.to_owned();
        for (text, what) in changed(&yaml, 40) {
            for text in [text.clone(), text.replace("NaN", ".nan").replace("inf", ".inf")] {
                match Camera::from_yaml(&text) {
                    Err(error) => is_told(&error.to_string(), &what),
                    Ok(found) => {
                        is_finite(&found.to_yaml(), &what);
                        for point in [[0.0, 0.0, 300.0], [100.0, -50.0, 200.0], [90.0, 3.0, -4.0]] {
                            let pixel = found.project(point.into());
                            let finite = pixel.is_none_or(|pixel| pixel.is_finite());
                            assert!(finite, "{what}: {pixel:?}");
                        }
                        for write in [camera::opencv, |camera: &Camera| camera::ros(camera, "c")] {
                            write(&found).iter().for_each(|text| is_finite(text, &what));
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn families() {
    let family = Family::shipped("delTag16h5").unwrap();
    for (text, what) in changed(&family.to_json(), 60) {
        match Family::from_json(&text) {
            Err(error) => is_told(&error.to_string(), &what),
            Ok(family) => is_finite_json(&family.to_json(), &what),
        }
    }
}

#[test]
fn detections() {
    let target = board();
    let pictures = pictures(&target);
    let mut first = pictures[0].1.clone();
    first.tone = serde_json::from_str(
        r#"{"black": 0.1, "white": 0.9, "kappa": 0.2, "kappa_sd": 0.1, "kappa_odd": 0.2, "used": true}"#,
    )
    .unwrap();
    first.ink = serde_json::from_str(
        r#"{"edges": 0.01, "edges_sd": 0.001, "um": 20.0, "um_sd": 2.0, "used": true, "images": 5}"#,
    )
    .unwrap();
    first.timing_ms.insert("all".to_owned(), 12.5);
    for (text, what) in changed(&detection::write(&first), 60) {
        let read = match detection::read(&text) {
            Err(error) => {
                is_told(&error.to_string(), &what);
                continue;
            }
            Ok(read) => read,
        };
        is_finite_json(&detection::write(&read), &what);
        is_finite(&orpc::write(&read, Some(&target.target)), &what);
        read.grids.iter().for_each(|grid| assert!(grid.edge_px().is_none_or(f64::is_finite)));
        let mut all = pictures.clone();
        all[0].1 = read;
        let shown = match views(&all, &Reference::Target(&target.target)) {
            Ok(shown) => shown,
            Err(error) => {
                is_told(&error.to_string(), &what);
                continue;
            }
        };
        let panels = Reference::Target(&target.target).panels();
        let calibration = Calibration::new(panels).camera("", shown.views, Model::Radtan);
        match calibration.solve() {
            Err(error) => is_told(&error.to_string(), &what),
            Ok(found) => {
                let said = calibration.explain(&found);
                let text =
                    calibration::write(&found, &said, Print::default(), Residuals::Listed, &[])
                        .unwrap();
                is_finite_json(&text, &what);
                let camera = &found.cameras[0].camera;
                is_finite(&camera.to_yaml(), &what);
                let fx = camera.focal_px.x;
                assert!((fx / 1100.5 - 1.0).abs() < 0.2, "{what}: fx {fx}");
            }
        }
    }
}
