//! Templates record everything that determines the product: for every option, the saved template reproduces the same
//! files without it.

use std::collections::BTreeSet;
use std::path::Path;

use crate::common::command::deltille;
use crate::common::folder::names;

use super::holes::holed;

/// Options about output locations, inputs and reporting: they belong to a run, not to a target.
const OF_A_RUN: [&str; 17] = [
    "template",
    "save-template",
    "with",
    "output",
    "force",
    "no-verify",
    "json",
    "quiet",
    "verbose",
    "help",
    "progress",
    "max-bytes",
    "max-depth",
    "max-nodes",
    "max-pixels",
    "max-pixels-per-byte",
    "max-seconds",
];

/// Returns the options of a command, as shown in its help.
fn options(command: &str) -> BTreeSet<String> {
    let folder = tempfile::tempdir().unwrap();
    let said = deltille(folder.path(), &format!("{command} --help")).success();
    let said = String::from_utf8(said.get_output().stdout.clone()).unwrap();
    let option = |line: &str| {
        let line = line.trim_start();
        let line = line.split_once(", --").map_or(line, |(_, long)| long);
        let name = line.trim_start_matches("--");
        let end = name.find(|c: char| !(c.is_ascii_alphanumeric() || c == '-'));
        let is_option = line.len() > name.len() || said.contains(&format!(", --{name}"));
        is_option.then(|| name[..end.unwrap_or(name.len())].to_owned())
    };
    // The help text of an option may continue with the name of another option, farther to the right.
    let is_shown = |line: &&str| {
        let name = line.trim_start();
        name.starts_with('-') && (1..=6).contains(&(line.len() - name.len()))
    };
    said.lines().filter(is_shown).filter_map(option).collect()
}

/// Generates the target of each case, and again from its template. Returns the options that were given.
fn made_twice(command: &str, cases: &[&str]) -> BTreeSet<String> {
    let mut given = BTreeSet::new();
    for case in cases {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("prism.obj"), PRISM).unwrap();
        std::fs::write(folder.path().join("logo.svg"), LOGO).unwrap();
        if case.contains("holed.json") {
            holed(folder.path());
        }
        let first = format!("{command} {case} --save-template t.toml -o first --no-verify");
        deltille(folder.path(), &first).success();
        let again =
            format!("{command} --template t.toml --save-template u.toml -o again --no-verify");
        deltille(folder.path(), &again).success();
        let bytes = |at: &Path| std::fs::read(at).unwrap();
        let [first, again] = ["first", "again"].map(|name| folder.path().join(name));
        assert_eq!(names(&first), names(&again), "{case}");
        for name in names(&first) {
            assert!(bytes(&first.join(&name)) == bytes(&again.join(&name)), "{case}: {name}");
        }
        let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(text("t.toml"), text("u.toml"), "{case}");
        given.extend(case.split(' ').filter_map(|word| word.strip_prefix("--").map(str::to_owned)));
    }
    given
}

/// A disc.
const LOGO: &str =
    "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 2 2'><circle cx='1' cy='1' r='1'/></svg>";

/// Three rectangles between two triangles.
const PRISM: &str = "v 0 0 0\nv 120 0 0\nv 60 103.923048454 0\nv 0 0 150\nv 120 0 150\nv 60 103.923048454 150\n\
                     f 1 3 2\nf 4 5 6\nf 1 2 5 4\nf 2 3 6 5\nf 3 1 4 6\n";

/// Checks that the cases give every option of the command.
fn are_all(command: &str, given: &BTreeSet<String>) {
    let of_run: BTreeSet<String> = OF_A_RUN.map(str::to_owned).into();
    let forgotten: Vec<_> = options(command)
        .into_iter()
        .filter(|o| !given.contains(o) && !of_run.contains(o))
        .collect();
    assert!(forgotten.is_empty(), "no case of {command} gives {forgotten:?}");
}

#[test]
fn every_option_of_a_board_is_in_its_template() {
    let boards = [
        "--rows 4 --cols 5 --edge 0.8in --family d36h9 --tag-spacing 2 --tag-border 1.2 --first-id 4 --tag-ids",
        "--rows 4 --cols 5 --edge 20mm --name desk --note Lab-3 --board-id 7 --invert --guide-page --orientation landscape",
        "--rows 4 --cols 5 --paper A5 --margin 8mm --svg --png --dpi 250 --dsc --dsc-dialect fork",
        "--rows 4 --cols 5 --untagged --edge 60mm --paper A4 --poster",
        "--rows 4 --cols 5 --dense --boards 4 --pack --edge 8mm --contour CutContour",
        "--rows 4 --cols 5 --two-sided 3mm --pdf --gltf --textures 2",
        "--rows 4 --cols 5 --pdf --logo logo.svg --logo-height 4mm",
        "--rows 4 --cols 5 --mirrored --white White --contour Cut --pdf --laser dxf,svg --kerf 0.2mm",
        "--rows 4 --cols 5 --gltf --obj --sdf --urdf --mjcf --usd --texture 900 --plate 5mm",
        "--rows 4 --cols 5 --3mf --inlay 0.6mm --plate 0.2in --bed 180x180 --nozzle 0.6mm --gltf --texture-dpi 150",
        "--rows 4 --cols 5 --laser svg",
        "--rows 4 --cols 5 --edge 40mm --paper A3 --family families/holed.json --hole 1.6mm --laser dxf",
    ];
    let squares = [
        "--rows 4 --cols 5 --family aprilTag36h11 --tags-in white --tag-spacing 2 --pdf --laser dxf --kerf 0.1mm",
        "--rows 4 --cols 5 --tags aprilTag25h9 --mirrored --white White --usd --pdf",
    ];
    let given = &made_twice("board", &boards) | &made_twice("checkerboard", &squares);
    are_all("board", &given);
    are_all("checkerboard", &given);
}

#[test]
fn every_option_of_a_solid_is_in_its_template() {
    let solids = [
        "--edge 12cm --tiles 7 --family d36h9 --tag-spacing 2 --tag-border 1.2 --first-id 4 --tag-ids --pdf --board-id 3",
        "--edge 120mm --dense --svg --png --dpi 210 --per-face --note Lab-3 --name t --guide-page",
        "--pdf --paper A3 --pages 2 --orientation portrait --margin 9mm --dsc --dsc-dialect original",
        "--pdf --paper A5 --allow-seams --dxf --stl",
        "--skeleton --panel-thickness 2mm --wall 5mm --rib 9mm --face-margin 12mm --3mf --inlay 0.3mm --bed 400x400 --nozzle 0.2mm",
        "--gltf --obj --sdf --urdf --mjcf --usd --texture 1500",
        "--edge 100mm",
        "--edge 100mm --untagged --invert --pdf --logo logo.svg --logo-height 4mm --gltf --textures 2",
        "--laser dxf,svg --kerf 0.2mm",
        "--edge 240mm --tiles 6 --family families/holed.json --hole 1.6mm --laser dxf",
    ];
    let cuboids = ["--size 80x60x50mm --pdf --laser dxf", "--size 8x6x5cm --edge 7cm --gltf"];
    let meshes = [
        "--mesh prism.obj --allow-skew --tiles 6 --square-family aprilTag25h9 --first-square-id 4 --gltf --texture-dpi 200",
        "--mesh prism.obj --scale 1.2 --pdf --laser svg",
    ];
    let of_all = &made_twice("tetrahedron", &solids) | &made_twice("solid", &meshes);
    are_all("tetrahedron", &of_all);
    are_all("solid", &of_all);
    are_all("cuboid", &(&of_all | &made_twice("cuboid", &cuboids)));
}

#[test]
fn options_override_the_meshes_lasers_and_inks_of_a_template() {
    let folder = tempfile::tempdir().unwrap();
    let made = |args: &str, files: &[&str]| {
        deltille(folder.path(), &format!("{args} -o made --no-verify")).success();
        assert_eq!(names(&folder.path().join("made")), files, "{args}");
        std::fs::remove_dir_all(folder.path().join("made")).unwrap();
    };
    let all = "board --rows 4 --cols 5 --pdf --white White --gltf --texture-dpi 150 --plate 5mm --laser dxf --kerf 0.1mm";
    let saved = ["board-laser.dxf", "board.glb", "board.json", "board.pdf"];
    made(&format!("{all} --save-template t.toml"), &saved);
    made("board --template t.toml", &saved);
    // Pages without spot colours, a different texture size, drawing format and thickness.
    let other = "board --template t.toml --svg --texture 900 --laser svg --two-sided 4mm";
    made(other, &["board-1.svg", "board-2.svg", "board-laser.svg", "board.glb", "board.json"]);

    for (text, said) in [
        ("rows = 4\ncols = 5\ngltf = true\n", "line 3, `gltf`: unknown field `gltf`"),
        ("rows = 4\ncols = 5\n[meshes]\nglb = true\n", "line 4, `glb`: unknown field `glb`"),
        (
            "rows = 4\ncols = 5\n[laser]\nformats = [\"png\"]\n",
            "line 4, `formats`: unknown value `png` (known: `dxf` or `svg`)",
        ),
        ("rows = 4\ncols = 5\n[meshes]\ngltf = true\ntexture = 3\n", "--texture: 3 is not between"),
        (
            "rows = 4\ncols = 5\n[meshes]\nusd = true\ntexture-dpi = 0.0\n",
            "--texture-dpi: 0 is not between",
        ),
        ("rows = 4\ncols = 5\n[laser]\nformats = [\"dxf\"]\nkerf = \"much\"\n", "--kerf: "),
        ("rows = 4\ncols = 5\n[laser]\nkerf = \"1mm\"\n", "--kerf needs"),
        ("rows = 4\ncols = 5\nplate = \"3mm\"\n", "--plate needs"),
        ("rows = 4\ncols = 5\n[finishing]\nwhite = \"Black\"\n", "--white: `Black`"),
        ("rows = 4\n[plate]\nmm = 3\n", "line 2, `plate`: expected a string, found an object"),
        (
            "rows = 4\ncols = 5\nuntagged = true\nfamily = \"d25h7\"\n",
            "--untagged conflicts with --family; remove one of them",
        ),
        (
            "rows = 4\ncols = 5\nuntagged = true\ntag-spacing = 4\n",
            "--untagged conflicts with --tag-spacing; remove one of them",
        ),
    ] {
        std::fs::write(folder.path().join("own.toml"), text).unwrap();
        let error = deltille(folder.path(), "board --template own.toml").code(2);
        let error = String::from_utf8(error.get_output().stderr.clone()).unwrap();
        assert!(error.contains(said) && error.lines().count() == 1, "{error}");
    }
}

/// The tags are specified as a whole: options replace what a template says about them, and must be compatible with
/// what remains.
#[test]
fn given_tags_replace_those_of_a_template() {
    let folder = tempfile::tempdir().unwrap();
    let (tagged, bare, dense) =
        ("family = \"d36h9\"\ntag-spacing = 2\n", "untagged = true\n", "dense = true\n");
    for (command, board) in
        [("board", "rows = 5\ncols = 6\n"), ("tetrahedron", "tiles = 8\nstl = true\n")]
    {
        for (template, option, result) in [
            (tagged, "", Ok("d36h9 ids")),
            (tagged, "--untagged", Ok("")),
            (tagged, "--dense", Ok("dense9")),
            (tagged, "--family d25h7", Ok("d25h7 ids")),
            (bare, "", Ok("")),
            (bare, "--family d25h7", Ok("d25h7 ids")),
            (bare, "--first-id 3", Ok("delTag25h7 ids 3")),
            (bare, "--dense", Ok("dense9")),
            (dense, "--untagged", Ok("")),
            (dense, "--family d25h7", Ok("d25h7 ids")),
            (
                dense,
                "--tag-spacing 4",
                Err(
                    "--dense conflicts with --tag-spacing (position codes replace tags); remove one of them",
                ),
            ),
        ] {
            std::fs::write(folder.path().join("t.toml"), format!("{board}{template}")).unwrap();
            let args = format!("{command} --template t.toml {option} -o made --force --no-verify");
            let run = deltille(folder.path(), &args);
            let output = run.get_output().clone();
            let [said, refused] =
                [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
            match result {
                Ok("") => {
                    assert!(!said.contains("ids") && !said.contains("dense9"), "{args}: {said}")
                }
                Ok(tags) => assert!(said.contains(tags), "{args}: {said} {refused}"),
                Err(problem) => assert_eq!(refused, format!("error: {problem}\n")),
            }
        }
    }
    std::fs::write(folder.path().join("f.toml"), "[finishing]\nmirrored = true\n").unwrap();
    let error = deltille(folder.path(), "cube --template f.toml").code(2);
    let error = String::from_utf8(error.get_output().stderr.clone()).unwrap();
    assert!(error.contains("line 1, `finishing`: unknown field `finishing`"), "{error}");
}
