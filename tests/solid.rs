//! `deltille icosahedron` and its sisters: what they write, and what proves it.

use std::path::Path;

use assert_cmd::Command;
use deltille::export::dsc;
use deltille::target::Target;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

fn deltille(folder: &Path, args: &str) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("deltille").unwrap();
    command.current_dir(folder).args(args.split_whitespace()).assert()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn an_icosahedron_needs_no_option() {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path(), "icosahedron")
        .success()
        .stdout(contains("icosahedron.glb: verified, 20 faces, 720 corners in space within"));
    assert_eq!(names(folder.path()), ["icosahedron.glb", "icosahedron.json"]);
}

/// The description of the reference programs says the same: corners, tags, places in space.
#[test]
fn every_format_is_written_and_the_dsc_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let args = "tetrahedron --edge 8cm --tiles 7 --face-margin 4mm --obj --stl --gltf --svg --dsc \
                --per-face --name t -o new --first-id 9";
    deltille(folder.path(), args)
        .success()
        .stdout(contains("t.glb: verified, 4 faces").and(contains("t.obj: verified, 4 faces")));
    let out = folder.path().join("new");
    let expected = [
        "t-1.svg",
        "t-2.svg",
        "t-3.svg",
        "t-4.svg",
        "t-texture.png",
        "t.dsc",
        "t.glb",
        "t.json",
        "t.mtl",
        "t.obj",
        "t.stl",
    ];
    assert_eq!(names(&out), expected);
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let (target, listed) =
        (Target::from_json(&read("t.json")).unwrap(), dsc::read(&read("t.dsc"), "t").unwrap());
    for (a, b) in target.panels.iter().zip(&listed.panels) {
        assert_eq!((&a.corners, &a.tags), (&b.corners, &b.tags));
        let turned = a.pose.rotation.iter().zip(&b.pose.rotation).map(|(a, b)| (a - b).abs());
        assert!(turned.fold(0.0, f64::max) < 1e-9);
    }
    // Eighty bytes of header, a count, fifty bytes a triangle.
    assert_eq!(std::fs::metadata(out.join("t.stl")).unwrap().len(), 84 + 4 * 50);
}

/// Changes of an OBJ that an eye would not notice, and what is said of them.
#[test]
fn wrong_meshes_are_refused_with_the_cause() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    deltille(path, "tetrahedron --edge 80mm --tiles 7 --face-margin 4mm --obj --name t").success();
    let text = std::fs::read_to_string(path.join("t.obj")).unwrap();
    let change = |edit: &dyn Fn(&str) -> String| -> String {
        text.lines().map(|line| edit(line) + "\n").collect()
    };
    let numbers = |line: &str| -> Vec<f64> {
        line.split(' ').skip(1).map(|word| word.parse().unwrap()).collect()
    };
    let scaled = change(&|line| match line.strip_prefix("v ") {
        Some(_) => format!(
            "v {}",
            numbers(line).iter().map(|v| (v * 1.01).to_string()).collect::<Vec<_>>().join(" ")
        ),
        None => line.to_owned(),
    });
    let mirrored = change(&|line| match line.strip_prefix("v ") {
        Some(_) => {
            let v = numbers(line);
            format!("v {} {} {}", -v[0], v[1], v[2])
        }
        None => line.to_owned(),
    });
    let inside_out = change(&|line| {
        let words: Vec<&str> = line.split(' ').collect();
        if words[0] == "f" {
            format!("f {} {} {}", words[1], words[3], words[2])
        } else {
            line.to_owned()
        }
    });
    let first = text.lines().find(|line| line.starts_with("v ")).unwrap();
    let v = numbers(first);
    let dented = text.replacen(first, &format!("v {} {} {}", v[0] + 0.5, v[1], v[2]), 1);
    let untextured = text.replace("usemtl print\n", "");
    for (name, text, code, said) in [
        ("scaled", scaled, 1, "scale 1.0100"),
        ("mirrored", mirrored, 1, "not recognised"),
        ("inside-out", inside_out, 1, "wrong normals"),
        ("dented", dented, 1, "off by"),
        ("untextured", untextured, 2, "it has no texture"),
    ] {
        assert_ne!(text, std::fs::read_to_string(path.join("t.obj")).unwrap());
        std::fs::write(path.join(format!("{name}.obj")), text).unwrap();
        let result = deltille(path, &format!("verify t.json {name}.obj")).code(code);
        let output = result.get_output();
        let all = [&output.stdout[..], &output.stderr[..]].concat();
        let all = String::from_utf8_lossy(&all).into_owned();
        assert!(all.contains(said), "{name}: {all}");
    }
}

#[test]
fn what_cannot_be_made_is_refused_in_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for (args, said) in [
        ("dodecahedron", "unrecognized subcommand"),
        ("icosahedron --edge 20mm", "an --edge of at least 28 mm"),
        ("icosahedron --edge NaN", "--edge"),
        ("icosahedron --edge -150mm", "--edge"),
        ("icosahedron --tiles 3", "--tiles"),
        ("icosahedron --face-margin -1mm", "--face-margin"),
        ("icosahedron --first-id 300", "at most 223"),
        ("icosahedron --texture-dpi 100", "--texture-dpi"),
        ("icosahedron --texture-dpi 9000", "lower --texture-dpi"),
        ("icosahedron --pdf --per-face --edge 3m", "even A0"),
        ("icosahedron --pdf --per-face --paper A5", "an --edge of at most "),
        ("icosahedron -o /proc/nowhere", "-o: cannot write"),
    ] {
        let result = deltille(folder.path(), args).code(2);
        let stderr = String::from_utf8_lossy(&result.get_output().stderr).into_owned();
        assert!(stderr.starts_with("error: ") && stderr.lines().count() == 1, "{args}: {stderr}");
        assert!(stderr.contains(said), "{args}: {stderr}");
    }
    assert!(names(folder.path()).is_empty());
}
