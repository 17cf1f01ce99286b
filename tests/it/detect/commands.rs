//! `deltille detect`: results in every format, overlays, and unreadable images.

use std::path::Path;

use crate::common::command::deltille;
use crate::common::page::Page;
use assert_cmd::Command;
use assert_cmd::assert::Assert;
use deltille::detect::ReasonKind;
use deltille::export::detection;
use deltille::layout::Printing;

/// A folder with a board as `board.json`, `board.dsc` and `sheet/board.png`.
fn board() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path(), "board --rows 6 --cols 7 --png --dsc --dpi 200 -o sheet").success();
    for name in ["board.json", "board.dsc"] {
        std::fs::rename(folder.path().join("sheet").join(name), folder.path().join(name)).unwrap();
    }
    folder
}

/// Returns the position of a corner of the target in the image of its sheet, px.
fn image_of(target: &Printing, corner: usize, dpi: f64) -> [f64; 2] {
    let (placement, sheet) = (&target.sheets[0].placements[0], &target.sheets[0]);
    let place = placement.origin_mm + target.target.panels[0].corners[corner].panel_mm;
    [place.x / 25.4 * dpi - 0.5, (sheet.height_mm - place.y) / 25.4 * dpi - 0.5]
}

#[test]
fn a_rendered_sheet_is_found_with_every_label_in_every_format() {
    let folder = board();
    let path = |name: &str| folder.path().join(name);
    for target in ["board.json", "board.dsc"] {
        let args = format!(
            "detect --target {target} sheet/board.png -o out --format json,orpc,csv --overlay -j 1"
        );
        deltille(folder.path(), &args).success();

        let json = std::fs::read_to_string(path("out/board.json")).unwrap();
        let found = detection::read(&json).unwrap();
        assert_eq!(detection::write(&found), json);
        let target = Printing::from_json(&std::fs::read_to_string(path("board.json")).unwrap());
        let target = target.unwrap();
        let identity = target.target.identity();
        assert_eq!(found.targets, std::slice::from_ref(&identity));
        assert_eq!((found.grids.len(), found.grids[0].panel), (1, Some(0)));
        assert_eq!(found.grids[0].corners.len(), 42);
        for (i, corner) in found.grids[0].corners.iter().enumerate() {
            assert_eq!(corner.id, Some(i as u32));
            let [x, y] = image_of(&target, i, 200.0);
            assert!((corner.x - x).hypot(corner.y - y) < 0.1, "{corner:?} at {x}, {y}");
        }

        let orpc = std::fs::read_to_string(path("out/board.orpc")).unwrap();
        let lines: Vec<&str> = orpc.lines().collect();
        assert_eq!(lines[0], "filename: board.png");
        assert_eq!(lines[3..5], ["num_corners: 42", "encoding: ascii"]);
        // Matrix of 9 columns: rows 0 and 1 start in column 2, rows 2 and 3 in column 1.
        assert!(lines[5].starts_with("0,2,1,") && lines[12].starts_with("0,11,1,"));
        assert!(lines[19].starts_with("0,19,1,") && lines.len() == 48);
        assert_eq!(lines[47], format!("# target {} {}", identity.fingerprint, identity));

        let csv = std::fs::read_to_string(path("out/board.csv")).unwrap();
        assert_eq!(csv.lines().count(), 43);
        assert!(csv.lines().nth(1).unwrap().starts_with("0,deltille,0,0,2,0,"));

        let overlay = deltille::photograph::read(path("out/board.overlay.jpg")).unwrap();
        // The sheet has large tiles, so the overlay is reduced.
        let reduced = found.width as usize / overlay.width();
        assert!((1..=4).contains(&reduced), "{reduced}");
    }
}

#[test]
fn a_plain_checkerboard_is_found_and_numbered_by_rows() {
    let folder = tempfile::tempdir().unwrap();
    // 3 × 4 corners of squares of 40 px; the square up and right of the lower left corner is dark.
    let corner = |row: usize, col: usize| [79.5 + 40.0 * col as f64, 159.5 - 40.0 * row as f64];
    let board = deltille::raster::Gray::<u8>::from_fn(280, 240, |x, y| {
        let inside = (40..240).contains(&x) && (40..200).contains(&y);
        if inside && (x / 40 + y / 40) % 2 == 1 { 30 } else { 220 }
    });
    let pixels = image::GrayImage::from_raw(280, 240, board.pixels().to_vec()).unwrap();
    pixels.save(folder.path().join("board.png")).unwrap();
    let args = "detect --grid checker --rows 3 --cols 4 board.png --format json,orpc --overlay";
    deltille(folder.path(), args).success();
    let json = std::fs::read_to_string(folder.path().join("board.json")).unwrap();
    let found = detection::read(&json).unwrap();
    assert_eq!((found.grids.len(), found.grids[0].corners.len()), (1, 12));
    for (i, found) in found.grids[0].corners.iter().enumerate() {
        let [x, y] = corner(i / 4, i % 4);
        assert_eq!((found.row, found.col), (i as i32 / 4, i as i32 % 4));
        assert!((found.x - x).hypot(found.y - y) < 0.05, "{found:?} at {x}, {y}");
    }
    let orpc = std::fs::read_to_string(folder.path().join("board.orpc")).unwrap();
    assert!(orpc.lines().nth(16).unwrap().starts_with("-1,11,0,"), "{orpc}");
}

/// Mirrored sheets of a tagged and of an untagged target, and of an untagged board of known size.
/// They are reported, and on request labelled as on the print.
#[test]
fn mirrored_boards_are_reported_and_labelled_on_request() {
    let folder = board();
    deltille(folder.path(), "board --rows 6 --cols 7 --untagged --png --dpi 200 -o plain")
        .success();
    let flop = |from: &str, to: &str| {
        let page = image::open(folder.path().join(from)).unwrap();
        page.fliph().save(folder.path().join(to)).unwrap();
    };
    flop("sheet/board.png", "tagged.png");
    flop("plain/board.png", "untagged.png");
    for (what, image, printed) in [
        ("--target board.json", "tagged", "board.json"),
        ("--target plain/board.json", "untagged", "plain/board.json"),
        ("--grid deltille --rows 6 --cols 7", "untagged", "plain/board.json"),
    ] {
        let detected = |options: &str| {
            let args = format!("detect {what} {image}.png -o out {options}");
            let is_labelled = !what.contains("target") || !options.is_empty();
            deltille(folder.path(), &args).code(i32::from(!is_labelled));
            let json = std::fs::read_to_string(folder.path().join(format!("out/{image}.json")));
            detection::read(&json.unwrap()).unwrap()
        };
        let found = detected("");
        let is_reported = found.reasons.iter().any(|reason| reason.kind == ReasonKind::Mirrored);
        assert!(is_reported, "{what}: {:?}", found.reasons);
        assert!(found.grids[0].mirrored && found.grids[0].panel.is_none(), "{what}");
        assert!(found.grids[0].corners.iter().all(|corner| corner.id.is_none()), "{what}");

        let found = detected("--allow-mirrored");
        let target = folder.path().join(printed);
        let target = Printing::from_json(&std::fs::read_to_string(target).unwrap()).unwrap();
        assert!(found.grids[0].mirrored && found.grids[0].corners.len() == 42, "{what}");
        assert_eq!(found.grids[0].panel.is_some(), what.contains("target"), "{what}");
        for (i, corner) in found.grids[0].corners.iter().enumerate() {
            let on_print = &target.target.panels[0].corners[i];
            assert_eq!((corner.row, corner.col), (on_print.row, on_print.col), "{what}");
            let [x, y] = image_of(&target, i, 200.0);
            let x = f64::from(found.width) - 1.0 - x;
            assert!((corner.x - x).hypot(corner.y - y) < 0.2, "{what}: {corner:?} at {x}, {y}");
        }
    }
}

#[test]
fn folders_patterns_and_lists_run_in_order_and_finished_images_are_skipped() {
    let folder = board();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("day")).unwrap();
    for name in ["b.png", "a.PNG", "c.png"] {
        std::fs::copy(path("sheet/board.png"), path("day").join(name)).unwrap();
    }
    std::fs::write(path("day/notes.txt"), "not a photograph").unwrap();
    let detect = |args: &str| deltille(folder.path(), &format!("detect --grid deltille {args}"));
    let names = |result: &Assert| {
        let said = String::from_utf8_lossy(&result.get_output().stdout);
        said.lines().map(|l| l.split(':').next().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(names(&detect("day -o out")), ["day/a.PNG", "day/b.png", "day/c.png"]);
    assert_eq!(names(&detect("day/*.png -o out2")), ["day/b.png", "day/c.png"]);

    std::fs::remove_file(path("out/b.json")).unwrap();
    assert_eq!(names(&detect("day -o out --skip-existing")), ["day/b.png"]);

    let mut listed = Command::cargo_bin("deltille").unwrap();
    listed.current_dir(folder.path()).args(["detect", "--grid", "deltille", "-", "--stream"]);
    let listed = listed.write_stdin("day/c.png\n\nday/missing.png\nday/b.png\n").output().unwrap();
    assert_eq!(listed.status.code(), Some(1));
    let lines = String::from_utf8(listed.stdout).unwrap();
    let found: Vec<_> = lines.lines().map(|line| detection::read(line).unwrap()).collect();
    assert_eq!(found.iter().map(|f| f.image.as_str()).collect::<Vec<_>>(), ["c.png", "b.png"]);
    assert!(found.iter().all(|f| f.grids[0].corners.len() == 42));
    assert!(!path("c.json").exists(), "a stream writes no files");
}

#[test]
fn a_benchmark_reports_every_stage() {
    let folder = board();
    let result = deltille(folder.path(), "bench detect --target board.json sheet --repeat 2");
    let said = String::from_utf8(result.success().get_output().stdout.clone()).unwrap();
    assert!(said.starts_with("1 images, 3.87 Mpx and 42.0 corners on average"), "{said}");
    for stage in ["pyramid", "coarse", "refine", "all"] {
        assert!(said.contains(&format!("\n{stage} ")), "{said}");
    }
    let result = deltille(folder.path(), "bench detect --grid deltille sheet --repeat 1");
    let said = String::from_utf8(result.success().get_output().stdout.clone()).unwrap();
    for stage in ["pyramid", "saddles", "grids", "labels", "refine", "all"] {
        assert!(said.contains(&format!("\n{stage} ")), "{said}");
    }
}

#[test]
fn messages_of_detect() {
    let folder = board();
    let at = folder.path();
    let sheet = std::fs::read(at.join("sheet/board.png")).unwrap();
    let json = std::fs::read_to_string(at.join("board.json")).unwrap();
    std::fs::write(at.join("cut.json"), &json[..json.len() / 2]).unwrap();
    std::fs::write(at.join("cut.png"), &sheet[..sheet.len() / 2]).unwrap();
    std::fs::write(at.join("empty.png"), "").unwrap();
    std::fs::write(at.join("empty.dsc"), "").unwrap();
    std::fs::write(at.join("found.yaml"), "%YAML:1.0").unwrap();
    std::fs::create_dir(at.join("other")).unwrap();
    std::fs::write(at.join("other/board.png"), sheet).unwrap();
    let more = "board --rows 9 --cols 10 --edge 10 --untagged --png --dpi 200 -o more";
    deltille(at, more).success();
    let page = image::open(at.join("sheet/board.png")).unwrap().into_luma8();
    let (width, height) = page.dimensions();
    let mut two = image::GrayImage::new(2 * width, height);
    for x in [0, width] {
        image::imageops::replace(&mut two, &page, x.into(), 0);
    }
    two.save(at.join("two.png")).unwrap();
    image::imageops::flip_horizontal(&page).save(at.join("flopped.png")).unwrap();
    image::GrayImage::from_pixel(300, 200, image::Luma([128])).save(at.join("grey.png")).unwrap();

    let mut page = Page::default();
    page.title("Images with and without the target");
    for images in [
        "sheet/board.png",
        "two.png",
        "more/board.png",
        "flopped.png",
        "grey.png",
        "grey.png two.png",
    ] {
        page.run(at, &format!("deltille detect --target board.json {images} -o out"));
    }
    page.run(at, "deltille detect --grid deltille two.png flopped.png -o out --skip-existing");
    page.title("Unreadable images");
    page.run(at, "deltille detect --grid deltille cut.png empty.png sheet/board.png -o left");
    assert_eq!(crate::common::folder::names(&at.join("left")), ["board.json"]);
    page.title("Invalid options");
    for args in [
        "sheet/board.png",
        "--target board.json",
        "--target cut.json sheet/board.png",
        "--target empty.dsc sheet/board.png",
        "--target missing.json sheet/board.png",
        "--target sheet/board.png sheet/board.png",
        "--target other sheet/board.png",
        "--target found.yaml sheet/board.png",
        "--target board.json sheet/board.png",
        "--target board.json sheet/board.png --max-errors 9",
        "--target board.json sheet/board.png --rows 3 --cols 3",
        "--target board.json sheet/board.png --family delTag25h9",
        "--grid hexagons sheet/board.png",
        "--grid deltille sheet/board.png --allow-mirrored",
        "--grid deltille sheet/board.png --rows 0 --cols 4",
        "--grid deltille sheet/board.png --rows -3 --cols 4",
        "--grid deltille sheet/board.png -j 0",
        "--grid deltille sheet/board.png other/board.png",
        "--grid deltille sheet/board.png missing.png -o left",
        "--grid deltille empty.dsc",
        "--grid deltille other/*.jpg",
        "--grid deltille - -",
        "--grid deltille -",
        "--grid deltille sheet --stream --skip-existing",
        "--target board.json sheet/board.png -o out --max-bytes 100",
        "--grid deltille sheet/board.png -o out --max-pixels 1M",
        "--grid deltille sheet/board.png -o out --max-pixels 10",
        "--grid deltille sheet/board.png -o out --max-pixels 0",
    ] {
        page.refused(at, &format!("deltille detect {args}"));
    }
    page.is("detect");
}

/// Frames in which a board is followed have the corners of single images.
#[test]
fn a_board_is_followed_through_a_video() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(crate::common::REPOSITORY);
    for i in 0..3 {
        let photograph = root.join("tests/photographs/robot-hand-0108.png");
        std::fs::copy(photograph, folder.path().join(format!("{i}.png"))).unwrap();
    }
    let detect = |how: &str, folder_of: &str| -> Vec<serde_json::Value> {
        let args = format!(
            "detect --grid deltille --rows 10 --cols 11 --ink none --timing {how} -o {folder_of} *.png"
        );
        deltille(folder.path(), &args).success();
        let read = |i: i32| std::fs::read(folder.path().join(format!("{folder_of}/{i}.json")));
        (0..3).map(|i| serde_json::from_slice(&read(i).unwrap()).unwrap()).collect()
    };
    let (followed, alone) = (detect("--track", "followed"), detect("", "alone"));
    let is_followed = |found: &serde_json::Value| found["timing_ms"].get("follow").is_some();
    assert_eq!(followed.iter().map(is_followed).collect::<Vec<_>>(), [false, true, true]);
    for (found, alone) in followed.iter().zip(&alone) {
        let corners = |found: &serde_json::Value| found["grids"][0]["corners"].clone();
        let (found, alone) = (corners(found), corners(alone));
        let pairs = found.as_array().unwrap().iter().zip(alone.as_array().unwrap());
        for (corner, other) in pairs {
            assert_eq!((&corner["row"], &corner["col"]), (&other["row"], &other["col"]));
            for axis in ["x", "y"] {
                let off_px = corner[axis].as_f64().unwrap() - other[axis].as_f64().unwrap();
                assert!(off_px.abs() < 0.01, "{corner} {other}");
            }
        }
        assert_eq!(found.as_array().unwrap().len(), 110);
    }
}

/// A stream prints each image before it has read the others, so it does not use the ink estimate of all.
#[test]
fn a_stream_notes_that_files_would_have_other_corners() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(crate::common::REPOSITORY);
    for name in ["a.png", "b.png", "c.png"] {
        let photograph = root.join("tests/photographs/robot-hand-0108.png");
        std::fs::copy(photograph, folder.path().join(name)).unwrap();
    }
    let detect = |images: &str, how: &str| {
        let args = format!("detect --grid deltille --rows 10 --cols 11 {how} {images}");
        let result = deltille(folder.path(), &args).success();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (text(&result.get_output().stdout), text(&result.get_output().stderr))
    };
    let (lines, notes) = detect("*.png", "--stream");
    assert!(
        notes.contains("note: --stream used a separate ink estimate for each image"),
        "{notes}"
    );
    assert!(lines.lines().all(|line| line.contains("\"images\": 1}")));
    assert!(!detect("a.png", "--stream").1.contains("note:"));
    assert!(!detect("*.png", "--stream --ink none").1.contains("note:"));
    assert!(!detect("*.png", "-o corners").1.contains("note:"));
}
