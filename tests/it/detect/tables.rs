//! Detections as tables in Parquet. They give the same camera as JSON, runs can be resumed with them, and no file harms
//! their reader.

use std::path::Path;

use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::detect::{Detection, Grid, GridCorner};
use deltille::export::detection;
use deltille::export::tables::{Contents, ImageRecord, Reader, TableError, Writer};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::limits::Limits;
use deltille::targets::{BoardSpec, TagSpec, Target, TargetSpec};
use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use crate::common::command::deltille;

fn board() -> Target {
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let spec = TargetSpec::Board(BoardSpec::new(GridKind::Deltille, 6, 7, 20.0));
    Target::build("board", &spec, Some(&family)).unwrap()
}

/// Views of a board from several sides, with everything that a detection may have.
fn detections(target: &Target) -> Vec<Detection> {
    let camera = Camera::centred(1600, 1200, 900.0, Lens::BrownConrady(BrownConrady::default()));
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let middle = DVec3::new(70.0, 50.0, 0.0);
    let view = |index: usize| {
        let turn = DQuat::from_rotation_x(0.25 * (index % 4) as f64 - 2.8)
            * DQuat::from_rotation_y(0.3 * (index % 3) as f64 - 0.3)
            * DQuat::from_rotation_z(0.4 * index as f64);
        let pose =
            Pose { rotation: turn, translation: DVec3::new(9.0, 4.0, 300.0) - turn * middle };
        let corners = target.panels[0].corners.iter().map(|corner| {
            let place = camera.project(pose.apply(corner.target_mm)).unwrap();
            let mut noise = || random.random_range(-0.05..0.05);
            let (x, y) = (place.x + noise(), place.y + noise());
            let (xx, xy, yy) = (0.002 + noise() / 50.0, noise() / 50.0, 0.002 + noise() / 50.0);
            let (row, col, id) = (corner.row, corner.col, Some(corner.id));
            GridCorner { row, col, id, x, y, cov: Some([xx, xy, yy]) }
        });
        let corners: Vec<GridCorner> = corners.collect();
        let grid = Grid {
            kind: GridKind::Deltille,
            target: None,
            panel: Some(0),
            mirrored: false,
            corners,
            tags: Vec::new(),
        };
        let mut loose = grid.clone();
        loose.panel = None;
        loose.corners.truncate(3);
        for corner in &mut loose.corners {
            (corner.id, corner.cov, corner.x) = (None, None, corner.x + 300.0);
        }
        let mut found = Detection::new(format!("{index}.png"), [1600, 1200], vec![grid, loose]);
        let ink = json!({
            "edges": 0.1 / 3.0, "edges_sd": 1e-3, "um": 12.0, "used": true, "images": 1,
        });
        let tone = json!({
            "black": 0.1, "white": 0.9, "kappa": 1.0 / 3.0, "kappa_sd": 0.01, "kappa_odd": -0.2, "used": true,
        });
        let reasons = json!([{ "kind": "no_tags", "grid": 1, "figures": { "tiles": 3.0 } }]);
        found.ink = serde_json::from_value(ink).unwrap();
        found.tone = serde_json::from_value(tone).unwrap();
        found.reasons = serde_json::from_value(reasons).unwrap();
        found.file = serde_json::from_value(json!({
            "exif_orientation": 6, "camera": {"model": "EOS R6", "focal_mm": 24.0 / 7.0},
        }))
        .unwrap();
        found.time_ns = Some(1_700_000_000_000_000_123 + index as i64);
        found
    };
    (0..12).map(view).collect()
}

/// Returns both tables of images.
fn written(pictures: &[ImageRecord], target: &Target) -> [Vec<u8>; 2] {
    let mut writer = Writer::new(Vec::new(), Vec::new(), std::slice::from_ref(target)).unwrap();
    pictures.iter().for_each(|picture| writer.push(picture).unwrap());
    writer.finish().unwrap()
}

fn pictures(target: &Target) -> Vec<ImageRecord> {
    let mut pictures: Vec<ImageRecord> = detections(target).iter().map(ImageRecord::of).collect();
    pictures.push(ImageRecord::unread("broken.png", "broken.png: it ends too soon"));
    pictures
}

#[test]
fn a_camera_is_the_same_to_the_last_bit_from_tables_and_from_json() {
    let (folder, target) = (tempfile::tempdir().unwrap(), board());
    let at = |name: &str| folder.path().join(name);
    for name in ["json", "tables", "many/corners", "many/images"] {
        std::fs::create_dir_all(at(name)).unwrap();
    }
    std::fs::write(at("board.json"), target.to_json()).unwrap();
    for found in detections(&target) {
        let name = format!("json/{}", found.image.replace("png", "json"));
        std::fs::write(at(&name), detection::write(&found)).unwrap();
    }
    let all = pictures(&target);
    let save = |pictures: &[ImageRecord], names: [&str; 2]| {
        for (name, content) in names.into_iter().zip(written(pictures, &target)) {
            std::fs::write(at(name), content).unwrap();
        }
    };
    save(&all, ["tables/corners.parquet", "tables/images.parquet"]);
    // As a cluster writes them: in parts, in any order.
    save(&all[5..], ["many/corners/1.parquet", "many/images/1.parquet"]);
    save(&all[..5], ["many/corners/2.parquet", "many/images/2.parquet"]);
    // A part whose images were not written.
    save(&all[..3], ["many/corners/3.parquet", "left.parquet"]);

    let camera = |from: &str| {
        let out = format!("of-{}", from.replace(['/', '.'], "-"));
        let args =
            format!("calibrate {from} --target board.json --model radtan -o {out} --residuals");
        deltille(folder.path(), &args).success();
        ["json", "yaml"]
            .map(|end| std::fs::read_to_string(at(&format!("{out}/camera.{end}"))).unwrap())
    };
    let of_json = camera("json");
    assert!(of_json[0].contains("\"ink\""), "{}", of_json[0]);
    for from in ["tables", "tables/corners.parquet", "tables/images.parquet", "many"] {
        assert_eq!(camera(from), of_json, "{from}");
    }
}

#[test]
fn images_survive_a_round_trip() {
    let target = board();
    let pictures = pictures(&target);
    let mut reader = Reader::new(Limits::default());
    let contents = written(&pictures, &target).map(|table| reader.add(table).unwrap());
    assert_eq!(contents, [Contents::Corners, Contents::Images]);
    let read = reader.finish().unwrap();
    assert_eq!((read.images, read.short), (pictures, 0));
}

#[test]
fn inconsistent_tables_are_rejected() {
    let target = board();
    let all = pictures(&target);
    let [corners, rows] = written(&all, &target);
    let error = |tables: &[&Vec<u8>]| {
        let mut reader = Reader::new(Limits::default());
        let added = tables.iter().try_for_each(|&table| reader.add(table.clone()).map(|_| ()));
        added.and_then(|()| reader.finish()).unwrap_err().to_string()
    };
    assert_eq!(
        error(&[&corners]),
        "image 0.png: it has corners, but it is not in the `images` table"
    );
    assert_eq!(error(&[&rows, &rows]), "image 0.png: it is listed twice in the `images` table");
    let twice = error(&[&rows, &corners, &corners]);
    assert!(
        twice.starts_with("image 0.png: grids[0].corners[1]: another corner has the same row"),
        "{twice}"
    );

    // Corners that were omitted on purpose.
    let [few, _] = written(&all[..4], &target);
    let mut reader = Reader::new(Limits::default());
    reader.add(few).unwrap();
    reader.add(rows).unwrap();
    assert_eq!(reader.finish().unwrap().short, 8);
}

#[test]
fn no_table_takes_more_than_its_limit_or_makes_its_reader_panic() {
    let target = board();
    let good = written(&pictures(&target), &target);
    let mut small = Limits::default();
    small.max_bytes = 10_000;
    let result = Reader::new(small).add(good[0].clone());
    assert!(matches!(result, Err(TableError::Exceeded(_))), "{result:?}");

    let mut random = ChaCha8Rng::seed_from_u64(9);
    let (mut refused, mut read) = (0, 0);
    for round in 0..600 {
        let mut changed = good.clone();
        let table = &mut changed[round % 2];
        // The metadata of the table is at its end.
        let first = if round % 3 == 0 { table.len() - 2000 } else { 0 };
        for _ in 0..random.random_range(1..4) {
            let at = random.random_range(first..table.len());
            match random.random_range(0..4) {
                0 => table[at] ^= 1 << random.random_range(0..8),
                1 => table[at] = random.random(),
                2 => table[at] = [0, 0x7f, 0x80, 0xff][random.random_range(0..4)],
                _ if random.random_bool(0.2) => table.truncate(at.max(2000)),
                _ => drop(table.remove(at)),
            }
        }
        let mut reader = Reader::new(Limits::default());
        let added = changed.into_iter().try_for_each(|table| reader.add(table).map(|_| ()));
        match added.and_then(|()| reader.finish()) {
            Ok(tables) => {
                read += 1;
                let numbers =
                    tables.images.iter().filter_map(|picture| picture.found.as_ref().ok());
                let mut corners =
                    numbers.flat_map(|found| &found.grids).flat_map(|grid| &grid.corners);
                assert!(corners.all(|corner| corner.x.is_finite() && corner.y.is_finite()));
            }
            Err(error) => {
                refused += 1;
                let line = error.to_string();
                assert!(!line.contains('\n') && !line.is_empty(), "{line:?}");
            }
        }
    }
    assert!(refused > 300 && read > 10, "{refused} refused, {read} read");
}

#[test]
fn a_resumed_run_extends_its_tables_and_keeps_unreadable_ones() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let run = |args: &str| deltille(folder.path(), args);
    run("board --rows 6 --cols 7 --png --dpi 200 --name b --no-verify -o made").success();
    std::fs::create_dir(at("shots")).unwrap();
    std::fs::copy(at("made/b.png"), at("shots/1.png")).unwrap();
    std::fs::write(at("shots/2.png"), b"\x89PNG\r\n\x1a\n").unwrap();
    let detect = "detect shots --target made/b.json -o out --format parquet";
    run(detect).code(1);
    let pictures = || read(&at("out"));
    let first = pictures();
    let images: Vec<&str> = first.iter().map(|picture| picture.image.as_str()).collect();
    assert_eq!(images, ["1.png", "2.png"]);
    assert_eq!(first[0].found.as_ref().unwrap().grids[0].corners.len(), 42);
    assert!(first[0].tags > 0);
    assert!(
        first[1].found.as_ref().unwrap_err().contains("2.png: not a readable PNG"),
        "{first:?}"
    );

    // The first is complete; the second is tried again, and the third is new.
    std::fs::copy(at("made/b.png"), at("shots/2.png")).unwrap();
    std::fs::copy(at("made/b.png"), at("shots/3.png")).unwrap();
    let said = run(&format!("{detect} --skip-existing")).success();
    let said = String::from_utf8_lossy(&said.get_output().stderr).into_owned();
    assert!(said.contains("1 of 3 images skipped"), "{said}");
    let second = pictures();
    assert_eq!(second.len(), 3);
    assert!(second.contains(&first[0]));
    assert!(second.iter().all(|picture| picture.found.is_ok()));

    // A file that another program wrote under that name is kept.
    std::fs::write(at("out/images.parquet"), b"PAR1 of somebody PAR1").unwrap();
    let said = run(detect).code(2);
    let said = String::from_utf8_lossy(&said.get_output().stderr).into_owned();
    assert!(said.contains("images.parquet contains a Parquet, which would be lost"), "{said}");
}

fn read(folder: &Path) -> Vec<ImageRecord> {
    let mut reader = Reader::new(Limits::default());
    for name in ["corners.parquet", "images.parquet"] {
        reader.add(std::fs::read(folder.join(name)).unwrap()).unwrap();
    }
    let mut pictures = reader.finish().unwrap().images;
    pictures.sort_by(|one, other| one.image.cmp(&other.image));
    pictures
}
