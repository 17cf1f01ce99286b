//! `deltille detect`: results in every format, overlays, and images that cannot be read.

use crate::common::command::{deltille, refused};
use assert_cmd::Command;
use assert_cmd::assert::Assert;
use deltille::export::detection;
use deltille::targets::Target;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

/// A folder with a board as `board.json`, `board.dsc` and `sheet/board.png`.
fn board() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path(), "board --rows 6 --cols 7 --png --dsc --dpi 200 -o sheet").success();
    for name in ["board.json", "board.dsc"] {
        std::fs::rename(folder.path().join("sheet").join(name), folder.path().join(name)).unwrap();
    }
    folder
}

/// Where a corner of the target lies in the image of its sheet, px.
fn image_of(target: &Target, corner: usize, dpi: f64) -> [f64; 2] {
    let (placement, sheet) = (&target.sheets[0].placements[0], &target.sheets[0]);
    let place = placement.origin_mm + target.panels[0].corners[corner].panel_mm;
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
        deltille(folder.path(), &args).success().stdout(contains("1 grid, 42 corners"));

        let json = std::fs::read_to_string(path("out/board.json")).unwrap();
        let found = detection::read(&json).unwrap();
        assert_eq!(detection::write(&found), json);
        let target = Target::from_json(&std::fs::read_to_string(path("board.json")).unwrap());
        let target = target.unwrap();
        assert_eq!(found.grids[0].panel, Some(0));
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
        assert!(lines[19].starts_with("0,19,1,") && lines.len() == 47);

        let csv = std::fs::read_to_string(path("out/board.csv")).unwrap();
        assert_eq!(csv.lines().count(), 43);
        assert!(csv.lines().nth(1).unwrap().starts_with("0,deltille,0,0,2,0,"));

        let overlay = deltille::photograph::read(path("out/board.overlay.png")).unwrap();
        assert!(overlay.width() as u32 >= found.width);
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
    deltille(folder.path(), args).success().stdout(contains("1 grid, 12 corners"));
    let json = std::fs::read_to_string(folder.path().join("board.json")).unwrap();
    let found = detection::read(&json).unwrap();
    for (i, found) in found.grids[0].corners.iter().enumerate() {
        let [x, y] = corner(i / 4, i % 4);
        assert_eq!((found.row, found.col), (i as i32 / 4, i as i32 % 4));
        assert!((found.x - x).hypot(found.y - y) < 0.05, "{found:?} at {x}, {y}");
    }
    let orpc = std::fs::read_to_string(folder.path().join("board.orpc")).unwrap();
    assert!(orpc.lines().nth(16).unwrap().starts_with("-1,11,0,"), "{orpc}");
}

/// Flopped sheets of a tagged and of an untagged target, and of an untagged board of known size: told, and
/// labelled as on the print where that is asked for.
#[test]
fn mirrored_boards_are_told_and_labelled_where_that_is_allowed() {
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
            let said = deltille(folder.path(), &args).code(i32::from(!is_labelled));
            let said = String::from_utf8(said.get_output().stdout.clone()).unwrap();
            let json = std::fs::read_to_string(folder.path().join(format!("out/{image}.json")));
            (said, detection::read(&json.unwrap()).unwrap())
        };
        let (said, found) = detected("");
        assert!(said.contains("42 corners") && said.contains("mirror"), "{what}: {said}");
        assert!(found.grids[0].mirrored && found.grids[0].panel.is_none(), "{what}");
        assert!(found.grids[0].corners.iter().all(|corner| corner.id.is_none()), "{what}");

        let (_, found) = detected("--allow-mirrored");
        let target = folder.path().join(printed);
        let target = Target::from_json(&std::fs::read_to_string(target).unwrap()).unwrap();
        assert!(found.grids[0].mirrored && found.grids[0].corners.len() == 42, "{what}");
        assert_eq!(found.grids[0].panel.is_some(), what.contains("target"), "{what}");
        for (i, corner) in found.grids[0].corners.iter().enumerate() {
            let on_print = &target.panels[0].corners[i];
            assert_eq!((corner.row, corner.col), (on_print.row, on_print.col), "{what}");
            let [x, y] = image_of(&target, i, 200.0);
            let x = f64::from(found.width) - 1.0 - x;
            assert!((corner.x - x).hypot(corner.y - y) < 0.2, "{what}: {corner:?} at {x}, {y}");
        }
    }
}

#[test]
fn what_is_left_out_is_told_and_finding_nothing_is_no_success() {
    let folder = board();
    deltille(
        folder.path(),
        "board --rows 9 --cols 10 --edge 10 --untagged --png --dpi 200 -o more",
    )
    .success();
    let page = image::open(folder.path().join("sheet/board.png")).unwrap().into_luma8();
    let (width, height) = page.dimensions();
    let mut two = image::GrayImage::new(2 * width, height);
    for x in [0, width] {
        image::imageops::replace(&mut two, &page, x.into(), 0);
    }
    two.save(folder.path().join("two.png")).unwrap();
    let detected = |image: &str| {
        deltille(folder.path(), &format!("detect --target board.json {image} -o out"))
    };
    detected("two.png")
        .success()
        .stdout(contains("1 grid, 42 corners").and(contains("42 corners left out")));
    detected("more/board.png")
        .code(1)
        .stdout(contains("a grid of 90 corners is not the whole board of 42"));
    let grey = image::GrayImage::from_pixel(300, 200, image::Luma([128]));
    grey.save(folder.path().join("grey.png")).unwrap();
    detected("grey.png").code(1).stdout(contains("nothing in the picture looks like a corner"));
    detected("grey.png two.png").success();
}

#[test]
fn unreadable_images_are_counted_and_the_rest_go_on() {
    let folder = board();
    let png = std::fs::read(folder.path().join("sheet/board.png")).unwrap();
    std::fs::write(folder.path().join("cut.png"), &png[..png.len() / 2]).unwrap();
    std::fs::write(folder.path().join("empty.png"), "").unwrap();
    let args = "detect --grid deltille cut.png empty.png sheet/board.png missing.png -o out";
    let result = deltille(folder.path(), args).code(1);
    let said = String::from_utf8_lossy(&result.get_output().stderr);
    for name in ["cut.png", "empty.png", "missing.png", "3 of 4 images failed"] {
        assert_eq!(said.matches(name).count(), 1, "{said}");
    }
    let written: Vec<_> = std::fs::read_dir(folder.path().join("out")).unwrap().collect();
    assert_eq!(written.len(), 1);
}

#[test]
fn folders_patterns_and_lists_are_taken_in_order_and_what_is_done_is_skipped() {
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
    let rest = detect("day -o out --skip-existing");
    assert_eq!(names(&rest), ["day/b.png"]);
    rest.stderr(contains("2 of 3 images skipped"));

    let mut listed = Command::cargo_bin("deltille").unwrap();
    listed.current_dir(folder.path()).args(["detect", "--grid", "deltille", "-", "--stream"]);
    let listed = listed.write_stdin("day/c.png\n\nday/missing.png\nday/b.png\n").output().unwrap();
    assert_eq!(listed.status.code(), Some(1));
    assert!(String::from_utf8(listed.stderr).unwrap().contains("missing.png"));
    let lines = String::from_utf8(listed.stdout).unwrap();
    let found: Vec<_> = lines.lines().map(|line| detection::read(line).unwrap()).collect();
    assert_eq!(found.iter().map(|f| f.image.as_str()).collect::<Vec<_>>(), ["c.png", "b.png"]);
    assert!(found.iter().all(|f| f.grids[0].corners.len() == 42));
    assert!(!path("c.json").exists(), "a stream writes no files by itself");
}

#[test]
fn a_benchmark_tells_every_stage() {
    let folder = board();
    let result = deltille(folder.path(), "bench detect --target board.json sheet --repeat 2");
    let said = String::from_utf8(result.success().get_output().stdout.clone()).unwrap();
    assert!(said.starts_with("1 images, 3.87 Mpx and 42.0 corners each"), "{said}");
    for stage in ["pyramid", "saddles", "grids", "labels", "refine", "all"] {
        assert!(said.contains(&format!("\n{stage} ")), "{said}");
    }
}

#[test]
fn bad_input_is_one_line_and_exit_code_2() {
    let folder = board();
    let json = std::fs::read_to_string(folder.path().join("board.json")).unwrap();
    std::fs::write(folder.path().join("cut.json"), &json[..json.len() / 2]).unwrap();
    std::fs::write(folder.path().join("empty.dsc"), "").unwrap();
    std::fs::create_dir(folder.path().join("other")).unwrap();
    std::fs::copy(folder.path().join("sheet/board.png"), folder.path().join("other/board.png"))
        .unwrap();
    for (args, words) in [
        ("detect sheet/board.png", "--target FILE, or --grid"),
        ("detect --target board.json", "<IMAGE>"),
        ("detect --target cut.json sheet/board.png", "cut.json"),
        ("detect --target empty.dsc sheet/board.png", "empty.dsc"),
        ("detect --target missing.json sheet/board.png", "missing.json"),
        ("detect --target sheet/board.png sheet/board.png", "sheet/board.png"),
        ("detect --target board.json sheet/board.png --max-errors 9", "--max-errors"),
        ("detect --target board.json sheet/board.png --rows 3 --cols 3", "--rows"),
        ("detect --target board.json sheet/board.png --family delTag25h9", "fingerprint"),
        ("detect --target board.json sheet/board.png", "board.json holds deltille/target/1, which"),
        ("detect --grid hexagons sheet/board.png", "hexagons"),
        ("detect --grid deltille sheet/board.png --allow-mirrored", "--rows and --cols"),
        ("detect --grid deltille sheet/board.png --rows 0 --cols 4", "--rows"),
        ("detect --grid deltille sheet/board.png -j 0", "-j"),
        ("detect --grid deltille sheet/board.png other/board.png", "board.json"),
        ("detect --grid deltille empty.dsc", "empty.dsc"),
        ("detect --grid deltille other/*.jpg", "other/*.jpg"),
        ("detect --grid deltille - -", "named twice"),
        ("detect --grid deltille sheet --stream --skip-existing", "--skip-existing"),
    ] {
        let said = refused(folder.path(), args);
        assert!(said.contains(words), "{args}: {said}");
    }
}
