//! Names in the guide, in the types of the Python package and on the web page match the library.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use deltille::calibrate::Model;
use deltille::camera::LensKind;
use deltille::export::artifacts::What;
use deltille::export::named::Format;
use deltille::export::{CAMERA_FORMATS, DETECTION_FORMATS, RIG_FORMATS};
use deltille::layout::PaperSize;

fn read(path: &str) -> String {
    fs::read_to_string(Path::new(crate::common::REPOSITORY).join(path)).unwrap()
}

/// The quoted words after a text, up to the closing bracket.
fn quoted<'a>(page: &'a str, before: &str) -> BTreeSet<&'a str> {
    let (_, listed) = page.split_once(before).unwrap_or_else(|| panic!("there is no {before}"));
    listed.split(']').next().unwrap().split('"').skip(1).step_by(2).collect()
}

/// The row of a table whose first cells contain these texts.
fn row<'a>(page: &'a str, first: &str, second: &str) -> &'a str {
    let is_it = |line: &&str| {
        let mut cells = line.split('|').skip(1);
        let mut has =
            |name: &str| cells.next().is_some_and(|cell| cell.contains(&format!("`{name}`")));
        has(first) && has(second)
    };
    page.lines().find(is_it).unwrap_or_else(|| panic!("there is no row of {first} and {second}"))
}

#[test]
fn python_types_match_the_names_of_the_library() {
    let page = read("python/deltille/typing.py");
    let types = |name: &str| quoted(&page, &format!("{name}: TypeAlias = Literal["));
    assert_eq!(types("TargetFormat"), What::NAMED.map(|(name, _)| name).into());
    assert_eq!(types("CameraFormat"), CAMERA_FORMATS.iter().map(Format::name).collect());
    let of_files = LensKind::ALL.iter().map(|kind| kind.name());
    let models = of_files.chain(Model::named().map(|(name, _)| name));
    assert_eq!(types("CameraModel"), models.filter(|name| *name != "spline").collect());
    let of_image = DETECTION_FORMATS.iter().filter(|format| format.is_of_one_image());
    let of_image: BTreeSet<_> = of_image.map(Format::name).collect();
    let stubs = read("python/deltille/_core.pyi");
    let (_, of_detection) = stubs.split_once("class Detection:").unwrap();
    assert_eq!(quoted(of_detection, "format: Literal["), of_image);
    let (_, of_rig) = stubs.split_once("class Rig:").unwrap();
    let of_rig = quoted(of_rig, "format: Literal[");
    let files = RIG_FORMATS.iter().flat_map(|format| format.files);
    assert_eq!(of_rig, files.map(Format::name).chain(["json"]).collect());
    assert!(quoted(&read("web/src/see.ts"), "const RESULTS = [").is_subset(&of_image));
}

#[test]
fn the_guide_lists_models_and_formats_of_the_library() {
    let [formulation, calibration, recipes] =
        ["docs/formulation.md", "docs/calibration.md", "docs/recipes.md"].map(read);
    for (name, model) in Model::named() {
        let line = row(&formulation, name, model.kind().name());
        let names = model.lens().names()[..model.parameter_count()].join(" ");
        assert!(name == "spline" || line.contains(&names), "{line}: {names}");
        assert!(calibration.contains(&format!("`{name}`")), "{name}");
        if let [first, ..] = model.richer() {
            let line = row(&formulation, name, &first.to_string());
            let richer = model.richer().iter().map(|model| format!("`{model}`"));
            assert!(line.contains(&richer.collect::<Vec<_>>().join(", ")), "{line}");
        }
    }
    for format in CAMERA_FORMATS {
        let line = row(&recipes, format.name(), &format!("camera{}", format.end));
        let models = format.models().iter().map(|name| format!("`{name}`")).collect::<Vec<_>>();
        assert!(line.contains(&models.join(", ")), "{line}");
    }
    let page = read("web/src/words.ts");
    let (_, listed) = page.split_once("    models: {\n").unwrap();
    let listed =
        listed.split('}').next().unwrap().lines().filter_map(|line| line.split(':').next());
    let listed = listed.map(|name| name.trim().trim_matches('"')).filter(|name| !name.is_empty());
    assert!(listed.clone().count() > 4 && listed.clone().all(|name| name.parse::<Model>().is_ok()));
}

#[test]
fn paper_sizes_match_the_library() {
    let choice = PaperSize::choice();
    let (names, _) = choice.split_once(", or").unwrap();
    assert!(read("docs/printing.md").contains(names), "{names}");
    let page = read("web/src/make.ts");
    let listed = quoted(&page, "const papers = [");
    assert!(listed.len() > 4 && listed.iter().all(|name| name.parse::<PaperSize>().is_ok()));
}
