//! Lists of names in the guide, in the types of the Python package and on the web page are those of the library.
//!
//! Each list stands between a comment `list: <name>` and a comment `end of list`. To write all of them after a change of
//! the library: `UPDATE_LISTS=1 cargo test --release -p deltille-cli --test it lists`.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use deltille::calibrate::Model;
use deltille::camera::LensKind;
use deltille::export::artifacts::What;
use deltille::export::named::Format;
use deltille::export::{CAMERA_FORMATS, DETECTION_FORMATS, RIG_FORMATS};
use deltille::layout::PaperSize;

/// Number of parameters of a lens from which only the first ones are listed.
const MANY_PARAMETERS: usize = 16;

fn path(file: &str) -> PathBuf {
    Path::new(crate::common::REPOSITORY).join(file)
}

fn read(file: &str) -> String {
    fs::read_to_string(path(file)).unwrap()
}

/// Compares a list in a file with that of the library, or replaces it if `UPDATE_LISTS` is set.
fn compare(file: &str, name: &str, list: &str) {
    let page = read(file);
    let begin =
        page.find(&format!("list: {name}")).unwrap_or_else(|| panic!("{file}: no list {name}"));
    let (before, rest) = page.split_at(begin);
    // The comment ends with its line, or within it.
    let begin = rest.find("-->").map_or(usize::MAX, |at| at + 3).min(rest.find('\n').unwrap());
    let end = rest.find("end of list").unwrap_or_else(|| panic!("{file}: list {name} has no end"));
    let end = rest[..end].rfind(['<', '#', '/']).unwrap();
    let end = rest[..end].trim_end_matches('/').len();
    let (found, after) = (&rest[begin..end], &rest[end..]);
    if env::var_os("UPDATE_LISTS").is_some() {
        fs::write(path(file), [before, &rest[..begin], list, after].concat()).unwrap();
    } else {
        assert_eq!(found, list, "{file}, list {name}: run with UPDATE_LISTS=1");
    }
}

/// A type of Python with these values.
fn literal<'a>(name: &str, values: impl IntoIterator<Item = &'a str>) -> String {
    let values = values.into_iter().map(|value| format!("    \"{value}\",\n"));
    format!("{name}: TypeAlias = Literal[\n{}]\n", values.collect::<String>())
}

/// Names as code, separated by commas.
fn code(names: impl IntoIterator<Item = impl std::fmt::Display>) -> String {
    let names = names.into_iter().map(|name| format!("`{name}`"));
    names.collect::<Vec<_>>().join(", ")
}

/// A table in Markdown.
fn table(head: &str, rows: impl Iterator<Item = String>) -> String {
    let rule = "|---".repeat(head.matches('|').count() - 1);
    format!("\n{head}\n{rule}|\n{}", rows.map(|row| row + "\n").collect::<String>())
}

/// The quoted words after a text, up to the closing bracket.
fn quoted<'a>(page: &'a str, before: &str) -> BTreeSet<&'a str> {
    let (_, listed) = page.split_once(before).unwrap_or_else(|| panic!("there is no {before}"));
    listed.split(']').next().unwrap().split('"').skip(1).step_by(2).collect()
}

#[test]
fn lists_are_those_of_the_library() {
    let of_files = LensKind::ALL.iter().map(|kind| kind.name()).filter(|name| *name != "spline");
    let of_image: Vec<_> = DETECTION_FORMATS
        .iter()
        .filter(|format| format.is_of_one_image())
        .map(Format::name)
        .collect();
    let of_rigs = RIG_FORMATS.iter().flat_map(|format| format.files).map(Format::name);
    let mut models: Vec<_> = of_files.collect();
    for (name, _) in Model::named().filter(|(name, _)| *name != "spline") {
        if !models.contains(&name) {
            models.push(name);
        }
    }
    let types = [
        literal("TargetFormat", What::NAMED.map(|(name, _)| name)),
        literal("DetectionFormat", of_image.iter().copied()),
        literal("CameraFormat", CAMERA_FORMATS.iter().map(Format::name)),
        literal("RigFormat", ["json"].into_iter().chain(of_rigs)),
        literal("CameraModel", models),
    ];
    compare("python/deltille/typing.py", "names", &format!("\n{}", types.concat()));

    let formats = CAMERA_FORMATS.iter().map(|format| {
        let of_rigs = RIG_FORMATS.iter().find(|rigs| rigs.name() == format.name());
        let files =
            of_rigs.map_or_else(String::new, |rigs| code(rigs.files.iter().map(|file| file.file)));
        let models = if format.is_own() { "all".to_owned() } else { code(format.models()) };
        format!("| `{}` | `camera{}` | {files} | {models} |", format.name(), format.end)
    });
    let head = "| format | file of a camera | files of a rig | supported models |";
    compare("docs/recipes.md", "camera formats", &table(head, formats));

    let models = Model::named().map(|(name, model)| {
        let (lens, count) = (model.lens(), model.parameter_count());
        let names = if count < MANY_PARAMETERS {
            lens.names()[..count].join(" ")
        } else {
            format!("{} …", lens.names()[..2].join(" "))
        };
        format!("| `{name}` | `{}` | `{names}` | {} |", model.kind().name(), code(model.richer()))
    });
    let calibration = read("docs/calibration.md");
    for (name, _) in Model::named() {
        assert!(calibration.contains(&format!("`{name}`")), "{name}");
    }
    let head =
        "| `--model` | `model` in `camera.yaml` | estimated lens parameters | richer models |";
    compare("docs/formulation.md", "models", &table(head, models));

    compare("docs/printing.md", "papers", &PaperSize::choice().replace("297x420mm", "`297x420mm`"));
    let papers = PaperSize::all().map(|size| format!("{:?}", size.name())).collect::<Vec<_>>();
    let papers = format!("\nconst papers = [{}];\n", papers.join(", "));
    compare("web/src/target-form.ts", "papers", &papers);
}

#[test]
fn the_page_offers_models_and_formats_of_the_library() {
    let of_image = DETECTION_FORMATS.iter().filter(|format| format.is_of_one_image());
    assert!(
        quoted(&read("web/src/see.ts"), "const RESULTS = [")
            .is_subset(&of_image.map(Format::name).collect())
    );
    let page = read("web/src/words.ts");
    let (_, listed) = page.split_once("    models: {\n").unwrap();
    let listed =
        listed.split('}').next().unwrap().lines().filter_map(|line| line.split(':').next());
    let listed = listed.map(|name| name.trim().trim_matches('"')).filter(|name| !name.is_empty());
    assert!(listed.clone().count() > 4 && listed.clone().all(|name| name.parse::<Model>().is_ok()));
}
