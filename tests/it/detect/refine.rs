//! `deltille refine`: a table of refined positions, and clear errors for bad input.

use crate::common::page::Page;
use assert_cmd::Command;
use deltille::synth::SimulatedCorner;
use glam::DVec2;

fn refine(folder: &std::path::Path, args: &str) -> (Option<i32>, String, String) {
    let mut command = Command::cargo_bin("deltille").unwrap();
    let output =
        command.current_dir(folder).arg("refine").args(args.split_whitespace()).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// A folder with a corner of each kind at (20.3, 19.8), in 8 bits, and seeds around it.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (lines, name) in [(2, "checker.pgm"), (3, "deltille.pgm")] {
        let corner = SimulatedCorner::seen_from(lines, 0.4, 0.6, DVec2::new(20.3, 19.8), 1.0);
        let image = corner.render(41, 41);
        let mut pgm = b"P5 41 41 255\n".to_vec();
        pgm.extend(image.pixels().iter().map(|v| (v * 255.0 + 0.5) as u8));
        std::fs::write(folder.path().join(name), pgm).unwrap();
    }
    std::fs::write(folder.path().join("seeds.csv"), "x,y\n20,20\n 21, 19\n1,1\n").unwrap();
    std::fs::write(folder.path().join("bad.csv"), "20,20\n20;20\n").unwrap();
    folder
}

#[test]
fn seeds_are_refined_by_either_method() {
    let folder = folder();
    for kind in ["deltille", "checker"] {
        for (method, within_px) in [("model", 0.005), ("polynomial", 0.03)] {
            let args = format!("--kind {kind} --seeds seeds.csv {kind}.pgm --method {method}");
            let (code, table, errors) = refine(folder.path(), &args);
            assert_eq!(code, Some(0), "{errors}");
            let lines: Vec<&str> = table.lines().collect();
            assert_eq!((lines[0], lines.len()), ("x,y,cov_xx,cov_xy,cov_yy,status", 4));
            for line in &lines[1..3] {
                let fields: Vec<&str> = line.split(',').collect();
                let [x, y] = [0, 1].map(|i| fields[i].parse::<f64>().unwrap());
                assert!((x - 20.3).hypot(y - 19.8) < within_px, "{kind}, {method}: {line}");
                assert_eq!((fields[2].is_empty(), fields[5]), (method == "polynomial", "ok"));
            }
            assert_eq!(lines[3], "1,1,,,,failed");
        }
    }
}

#[test]
fn bad_input_gives_a_one_line_error() {
    let folder = folder();
    let mut page = Page::default();
    for args in [
        "--kind deltille --seeds bad.csv deltille.pgm",
        "--kind deltille --seeds none.csv deltille.pgm",
        "--kind deltille --seeds seeds.csv none.pgm",
        "--kind deltille --seeds seeds.csv deltille.pgm --window 20",
        "--kind squares --seeds seeds.csv deltille.pgm",
    ] {
        page.refused(folder.path(), &format!("deltille refine {args}"));
    }
    page.is("refine");
}
