//! Additions to the faces of a target: a back, printed tag ids, a guide page, a template.

use std::path::Path;

use crate::common::command::deltille;
use crate::common::folder::names;
use deltille::layout::Printing;
use glam::DVec3;

fn read(path: &Path) -> Printing {
    Printing::from_json(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Pages with ids in their white tiles are verified, and a wrong id is found.
#[test]
fn ids_in_small_type_are_verified_with_their_tiles() {
    let folder = tempfile::tempdir().unwrap();
    let args = "board --rows 6 --cols 7 --tag-ids --guide-page --svg --pdf";
    deltille(folder.path(), args).success();
    assert_eq!(names(folder.path()), ["board-1.svg", "board-2.svg", "board.json", "board.pdf"]);
    let json = folder.path().join("board.json");
    let mut target = read(&json);
    let texts = &mut target.sheets[0].texts;
    let id = texts.iter().rposition(|text| text.text.to_string() == "1").unwrap();
    texts[id].text = "7".to_owned().into();
    std::fs::write(&json, target.to_json()).unwrap();
    let said = deltille(folder.path(), "verify board.json").failure();
    let said = String::from_utf8(said.get_output().stdout.clone()).unwrap();
    assert!(said.contains(&format!("label {} differs from the description", id + 1)), "{said}");
}

#[test]
fn nets_with_ids_and_a_guide_are_still_folded() {
    let folder = tempfile::tempdir().unwrap();
    let args = "octahedron --edge 110mm --tiles 7 --pdf --tag-ids --guide-page";
    let said = deltille(folder.path(), args).success();
    let said = String::from_utf8(said.get_output().stdout.clone()).unwrap();
    assert!(said.contains("folds into the solid"), "{said}");
    let target = read(&folder.path().join("octahedron.json"));
    let (guide, nets) = target.sheets.split_last().unwrap();
    assert!(guide.placements.is_empty() && nets.iter().all(|net| !net.placements.is_empty()));
}

/// The corners of the back lie behind those of the front, in the same order seen from the front, on pages that match
/// when printed on both sides of a sheet.
#[test]
fn the_two_sides_of_a_board_are_back_to_back() {
    let folder = tempfile::tempdir().unwrap();
    let args =
        "board --rows 6 --cols 7 --edge 25mm --two-sided 4mm --pdf --gltf --save-template t.toml";
    deltille(folder.path(), args).success();
    let target = read(&folder.path().join("board.json"));
    let [front, back] = &target.target.panels[..] else { panic!("two panels") };
    let [left, lower, right, upper] = front.field_mm();
    for (corner, other) in front.corners.iter().zip(&back.corners) {
        let DVec3 { x, y, .. } = corner.target_mm;
        assert!(other.target_mm.distance(DVec3::new(left + right - x, y, -4.0)) < 1e-9);
    }
    let middle = |sheet: usize| {
        target.sheets[sheet].placements[0]
            .page_from_panel([left + right, lower + upper].map(|v| v / 2.0).into())
    };
    assert!((middle(0).x - target.sheets[0].width_mm / 2.0).abs() < 1e-9);
    assert_eq!(middle(0), middle(1));
    deltille(folder.path(), "board --template t.toml -o again --pdf --gltf").success();
    assert_eq!(target, read(&folder.path().join("again/board.json")));
}

/// From behind, the back is visible; both views give the same position of the target.
#[test]
fn a_board_with_two_sides_is_one_target_for_poses() {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path(), "board --rows 6 --cols 7 --edge 25mm --two-sided 4mm --pdf").success();
    let camera = Path::new(crate::common::REPOSITORY).join("templates/camera.yaml");
    std::fs::copy(camera, folder.path().join("camera.yaml")).unwrap();
    for (name, eye) in [("front", "60,-60,420"), ("back", "150,160,-420")] {
        let render =
            format!("render board.json --camera camera.yaml --eye {eye} --seed 3 -o {name}.png");
        deltille(folder.path(), &render).success();
    }
    let pose = "pose front.png back.png --camera camera.yaml --target board.json -o poses.ndjson";
    deltille(folder.path(), pose).success();
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let at = |text: &str| -> Vec<f64> {
        let value: serde_json::Value = serde_json::from_str(text).unwrap();
        serde_json::from_value(value["camera_from_target"]["translation_mm"].clone()).unwrap()
    };
    for (line, truth) in read("poses.ndjson").lines().zip(["front.json", "back.json"]) {
        let off = at(line).iter().zip(at(&read(truth))).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        assert!(off.sqrt() < 0.1, "{truth}: {} mm", off.sqrt());
    }
    std::fs::write(folder.path().join("text.png"), "text").unwrap();
    let pose = "pose front.png back.png text.png --camera camera.yaml --target board.json --all-images -o poses.csv";
    deltille(folder.path(), pose).code(1);
    let table = read("poses.csv");
    // Only the last cell, the reason, contains commas.
    let lines: Vec<Vec<&str>> = table.lines().map(|line| line.splitn(22, ',').collect()).collect();
    assert!(lines.iter().all(|cells| cells.len() == 22), "{table}");
    let column = |name: &str| lines[0].iter().position(|column| *column == name).unwrap();
    for (cells, line) in lines[1..].iter().zip(read("poses.ndjson").lines()) {
        let place = ["x_mm", "y_mm", "z_mm"];
        let place = place.map(|name| cells[column(name)].parse::<f64>().unwrap());
        assert_eq!(place.as_slice(), at(line));
    }
    assert_eq!((lines.len(), lines[3][column("x_mm")]), (4, ""));
    assert!(lines[3][column("reason")].starts_with("\"text.png: not a readable"), "{table}");
}

#[test]
fn a_template_reproduces_a_solid_and_options_override_it() {
    let folder = tempfile::tempdir().unwrap();
    let args = "tetrahedron --edge 12cm --tiles 7 --family d25h7 --per-face --pdf --skeleton --wall 5mm --name t \
                --save-template t.toml";
    deltille(folder.path(), args).success();
    deltille(folder.path(), "tetrahedron --template t.toml -o again").success();
    let first = read(&folder.path().join("t.json"));
    assert_eq!(first, read(&folder.path().join("again/t.json")));
    deltille(folder.path(), "tetrahedron --template t.toml --dense --svg -o other").success();
    let other = read(&folder.path().join("other/t.json"));
    assert_eq!(other.target.family.unwrap().name, "dense9");
    assert!(!names(&folder.path().join("other")).contains(&"t.pdf".to_owned()));
    let said = deltille(folder.path(), "octahedron --template t.toml").code(2);
    let said = String::from_utf8(said.get_output().stderr.clone()).unwrap();
    assert!(said.contains("was made for `tetrahedron`, not `octahedron`"), "{said}");
}

/// Every kind of target can carry a logo. It is verified in every format and drawn from the target file; the board is
/// the same without it.
#[test]
fn every_kind_of_target_carries_a_logo() {
    let folder = tempfile::tempdir().unwrap();
    let logo = Path::new(crate::common::REPOSITORY).join("docs/gallery/logo.svg");
    std::fs::copy(logo, folder.path().join("logo.svg")).unwrap();
    for args in [
        "board --rows 4 --cols 5 --edge 30mm --logo-height 15mm --pdf --svg --png",
        "board --rows 4 --cols 5 --edge 25mm --two-sided 3mm --guide-page --pdf",
        "board --rows 4 --cols 5 --edge 12mm --boards 4 --pack --paper A4 --pdf",
        "board --rows 4 --cols 5 --edge 30mm --paper A5 --poster --pdf",
        "checkerboard --rows 5 --cols 7 --tags t36h11 --mirrored --svg",
        "charuco --squares 8x6 --edge 30mm --marker 22mm --dictionary 5x5_100 --pdf",
        "aprilgrid --tags 4x4 --edge 30mm --pdf",
        "circles --circles 9x7 --spacing 20mm --pdf",
        "icosahedron --edge 90mm --pdf --guide-page",
        "tetrahedron --edge 110mm --tiles 7 --per-face --pdf",
    ] {
        let made = format!("{args} --logo logo.svg -o logo --force");
        deltille(folder.path(), &made).success();
        let plain = args.replace(" --logo-height 15mm", "");
        deltille(folder.path(), &format!("{plain} -o plain --force --no-verify")).success();
        let name = format!("{}.json", args.split(' ').next().unwrap());
        let [with, without] = ["logo", "plain"].map(|at| read(&folder.path().join(at).join(&name)));
        assert_eq!(with.target.panels, without.target.panels, "{args}");
        for (with, without) in with.sheets.iter().zip(&without.sheets) {
            assert_eq!(with.placements, without.placements, "{args}");
            let pages = with.pages.iter().map(|page| &page.marks);
            let logos = pages.chain([with]).map(|page| page.logos.len()).sum::<usize>();
            assert!(logos > 0, "{args}");
        }
    }
}

#[test]
fn a_template_keeps_the_logo_and_unprintable_logos_are_rejected_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, body: &str| {
        let svg = format!(r#"<svg xmlns="http://www.w3.org/2000/svg">{body}</svg>"#);
        std::fs::write(folder.path().join(name), svg).unwrap();
    };
    write("logo.svg", r#"<path d="M0 9H20L10 0Z"/>"#);
    write("text.svg", r#"<text id="name">deltille</text>"#);
    write("nothing.svg", "");
    let board = "board --rows 5 --cols 6 --edge 20mm";
    let saved = format!("{board} --logo logo.svg --logo-height 6.5mm --save-template t.toml");
    deltille(folder.path(), &saved).success();
    deltille(folder.path(), "board --template t.toml -o again").success();
    let first = read(&folder.path().join("board.json"));
    assert_eq!(first.sheets[0].logos[0].height_mm, 6.5);
    assert_eq!(first, read(&folder.path().join("again/board.json")));
    for (args, expected) in [
        (
            "--logo text.svg",
            "--logo: text.svg: `text` with the id `name` cannot be printed: convert it to paths",
        ),
        ("--logo nothing.svg", "--logo: the logo has no black area"),
        ("--logo missing.svg", "--logo: cannot read missing.svg"),
        (
            "--logo logo.svg --logo-height 90mm",
            "--logo-height: a logo 90 mm high does not fit beside the other marks",
        ),
        ("--logo-height 9mm", "--logo-height: needs a logo: add --logo"),
        ("--logo logo.svg --gltf", "--logo needs --pdf, --svg or --png"),
    ] {
        let said = deltille(folder.path(), &format!("{board} {args} -o refused")).code(2);
        let said = String::from_utf8(said.get_output().stderr.clone()).unwrap();
        assert!(said.contains(expected) && said.trim().lines().count() == 1, "{args}: {said}");
    }
}
