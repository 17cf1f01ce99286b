//! A panel has an id, on the print and in the target's file. All output identifies panels by this id.

use std::path::Path;

use crate::common::view::tilted;
use assert_cmd::Command;
use deltille::camera::{Camera, Pose};
use deltille::detect::{Detection, Grid, GridCorner};
use deltille::export::detection;
use deltille::targets::{Panel, Target};
use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

const CAMERA: &str = "width: 1600\nheight: 1200\nfocal_px: [1500, 1500]\ncentre_px: [799, 601]\n\
                      distortion: [-0.1, 0.02]\n";

/// The ids of an icosahedron with `--board-id 40`.
const IDS: std::ops::Range<u64> = 40..60;

/// The panel whose recorded position differs from that of its print.
const MISPLACED: u32 = 47;

/// Returns the detection of the panels that face a camera.
fn seen(target: &Target, camera: &Camera, camera_from_target: &Pose, view: u32) -> Detection {
    let mut random = ChaCha8Rng::seed_from_u64(view.into());
    let grid = |panel: &Panel| {
        let pose = camera_from_target.after(&panel.pose.to_pose());
        // Faces seen at a grazing angle, or from behind, show nothing.
        let towards = (pose.rotation * DVec3::Z).dot(pose.translation.normalize()) < -0.35;
        let off = if panel.id == MISPLACED { DVec3::new(0.03, -0.02, 0.04) } else { DVec3::ZERO };
        let corner = |corner: &deltille::targets::Corner| {
            let at = pose.apply(corner.panel_mm.extend(0.0) + off);
            let (x, y) = camera.project(at)?.into();
            let (row, col, id) = (corner.row, corner.col, Some(corner.id));
            let mut noise = || random.random_range(-0.05..0.05);
            Some(GridCorner {
                row,
                col,
                id,
                x: x + noise(),
                y: y + noise(),
                cov: Some([1e-3, 0.0, 1e-3]),
            })
        };
        let corners: Option<Vec<GridCorner>> = panel.corners.iter().map(corner).collect();
        let (kind, panel) = (panel.kind, Some(panel.id));
        towards.then_some(Grid {
            kind,
            target: None,
            panel,
            mirrored: false,
            corners: corners?,
            tags: Vec::new(),
        })
    };
    let grids = target.panels.iter().filter_map(grid).collect();
    Detection::new(format!("{view:02}.png"), [camera.width, camera.height], grids)
}

/// Adds every panel that a JSON file names.
fn panels(value: &Value, found: &mut Vec<u64>) {
    match value {
        Value::Array(values) => values.iter().for_each(|value| panels(value, found)),
        Value::Object(fields) => {
            for (name, value) in fields {
                match value.as_u64().filter(|_| name == "panel") {
                    Some(panel) => found.push(panel),
                    None => panels(value, found),
                }
            }
        }
        _ => {}
    }
}

/// Returns every panel, or board, that a text names by a number.
fn named(text: &str) -> Vec<u64> {
    let text = text.to_lowercase();
    let words: Vec<&str> =
        text.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
    let names = |pair: &&[&str]| matches!(pair[0], "panel" | "board" | "panels" | "boards");
    words.windows(2).filter(names).filter_map(|pair| pair[1].parse().ok()).collect()
}

fn of_json(path: &Path) -> Vec<u64> {
    let mut found = Vec::new();
    panels(&serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap(), &mut found);
    found
}

/// Returns the output of a command on both streams.
fn said(at: &Path, args: &str) -> String {
    let mut command = Command::cargo_bin("deltille").unwrap();
    let output = command.current_dir(at).args(args.split_whitespace()).output().unwrap();
    let said = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    assert!(output.status.success(), "{args}: {said}");
    said
}

#[test]
fn panels_are_identified_only_by_id() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("known.yaml"), CAMERA).unwrap();
    said(at, "icosahedron --board-id 40 --tiles 6 --edge 90mm --svg --name ico --no-verify");
    let target = Target::from_json(&std::fs::read_to_string(at.join("ico.json")).unwrap()).unwrap();
    let ids: Vec<u64> = target.panels.iter().map(|panel| panel.id.into()).collect();
    assert_eq!(ids, IDS.collect::<Vec<u64>>());
    let is_id = |ids: &[u64], what: &str| {
        assert!(!ids.is_empty() && ids.iter().all(|id| IDS.contains(id)), "{what}: {ids:?}");
    };

    // An image, with its truth and its detection.
    said(at, "render ico.json --camera known.yaml --eye 150,-400,200 -o picture.png");
    is_id(&of_json(&at.join("picture.json")), "truth");
    said(at, "detect --target ico.json picture.png --format json,csv -o found");
    is_id(&of_json(&at.join("found/picture.json")), "detection");
    let csv = std::fs::read_to_string(at.join("found/picture.csv")).unwrap();
    let column = csv.lines().skip(1).map(|line| line.split(',').nth(2).unwrap().parse().unwrap());
    is_id(&column.collect::<Vec<u64>>(), "csv");

    let camera = Camera::from_yaml(CAMERA).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let right_from_left =
        Pose { rotation: DQuat::from_rotation_y(0.1), translation: DVec3::new(-120.0, 0.0, 10.0) };
    for name in ["left", "right"] {
        std::fs::create_dir(at.join(name)).unwrap();
    }
    // From all sides.
    for index in 0..20 {
        let left =
            tilted(&mut random, DVec3::ZERO, 400.0, (1.0 - (f64::from(index) + 0.5) / 10.0).acos());
        for (name, pose) in [("left", left), ("right", right_from_left.after(&left))] {
            let mut found = seen(&target, &camera, &pose, index);
            if (name, index) == ("left", 5) {
                // An inconsistent grid is named as well.
                let corners = found.grids[0].corners.iter_mut();
                corners.for_each(|corner| (corner.row, corner.col) = (corner.col, corner.row));
            }
            std::fs::write(at.join(format!("{name}/{index:02}.json")), detection::write(&found))
                .unwrap();
        }
    }
    let text =
        said(at, "calibrate left --target ico.json --model radtan --residuals --report page.html");
    is_id(&named(&text), &text);
    assert!(named(&text).contains(&MISPLACED.into()), "{text}");
    is_id(&of_json(&at.join("camera.json")), "calibration");
    let page = std::fs::read_to_string(at.join("page.html")).unwrap();
    is_id(&named(&page), "page");

    let rig = "rig --camera left=left --camera right=right --target ico.json";
    let text = said(at, &format!("{rig} -o stated"));
    is_id(&named(&text), &text);
    assert!(named(&text).contains(&MISPLACED.into()), "{text}");
    said(at, &format!("{rig} --refine-target --residuals -o refined"));
    let refined = std::fs::read_to_string(at.join("refined/ico-refined.json")).unwrap();
    let refined = Target::from_json(&refined).unwrap();
    let moved = |panel: &Panel| {
        let stated = target.panels.iter().find(|stated| stated.id == panel.id).unwrap();
        panel.pose.translation_mm.distance(stated.pose.translation_mm)
    };
    let most = refined.panels.iter().max_by(|a, b| moved(a).total_cmp(&moved(b)));
    assert_eq!(most.unwrap().id, MISPLACED);
    let places: Vec<u64> = of_json(&at.join("refined/rig.json"));
    assert!(places.iter().all(|id| IDS.contains(id)), "{places:?}");
}
