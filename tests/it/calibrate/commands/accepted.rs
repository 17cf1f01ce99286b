//! `deltille accept`: verdicts and exit codes, the certificate, and input that is refused.

use glam::DVec3;

use super::still_calibrated::{beside, views, write};
use super::{CALIBRATE, board, camera, detections, done, folder, json, output, refused};
use deltille::camera::Pose;
use deltille::export::acceptance;

#[test]
fn a_camera_and_a_rig_are_accepted_by_their_errors_of_length() {
    let target = board(8, 9);
    let folder = folder(&target, &detections(&target, 20, 0.7));
    let at = folder.path();
    done(at, &format!("{CALIBRATE} --board-accuracy 0"));
    let right = Pose { translation: DVec3::new(-60.0, 1.0, 2.0), ..Pose::IDENTITY };
    let many: Vec<f64> = (0..20).map(|index| 0.1 + 0.03 * f64::from(index)).collect();
    let few = [0.5, 0.6, 0.4, 0.7];
    for (name, tilts, seed) in [("rig", &many[..], 3), ("new", &few, 5)] {
        write(at, &format!("{name}/left"), &views(&target, &camera(), tilts, seed));
        write(at, &format!("{name}/right"), &beside(&target, &camera(), &right, tilts, seed + 1));
    }
    let rig = "--camera left=rig/left --camera right=rig/right";
    done(at, &format!("rig {rig} --target board.json --board-accuracy 0 -o ."));

    let corners = &target.panels[0].corners;
    let [first, last] = [corners[0], corners[corners.len() - 1]];
    let length = 1.018 * first.panel_mm.distance(last.panel_mm);
    let wrong = format!("{},{},{},{},{length},0.01", first.row, first.col, last.row, last.col);
    for (name, row) in [("wrong", wrong.as_str()), ("none", "1,4,6,99,90,0")] {
        let text = format!("row_a,col_a,row_b,col_b,length_mm,sd_mm\n{row}\n");
        std::fs::write(at.join(format!("{name}.csv")), text).unwrap();
    }
    let common = "--target board.json --board-accuracy 0";
    let new = "--camera left=new/left --camera right=new/right";
    for (input, method) in
        [("camera.json new/left", "plane"), (&format!("rig.json {new}"), "triangulation")]
    {
        // The given length of 230 mm is wrong by 4 mm.
        for (more, verdict, code) in [
            ("--limit 5mm+L/100", "conforms", 0),
            ("--limit 0.5mm --lengths wrong.csv", "fails", 1),
        ] {
            let args =
                format!("accept {input} {common} {more} -o {verdict}.json --report a.html --force");
            let result = output(at, &args);
            let text = String::from_utf8_lossy(&result.stdout).into_owned();
            assert_eq!(result.status.code(), Some(code), "{text}");
            let found = json(&at.join(format!("{verdict}.json")));
            assert_eq!((&found["verdict"], &found["method"]), (&verdict.into(), &method.into()));
            assert_eq!(
                (&found["frames"], found["measured"].as_array().unwrap().len()),
                (&4.into(), 4)
            );
            let file = input.split(' ').next().unwrap();
            let fingerprint = acceptance::fingerprint(&std::fs::read(at.join(file)).unwrap());
            assert_eq!(found["calibration"], file);
            assert_eq!(found["calibration_sha256"], fingerprint.as_str());
            let page = std::fs::read_to_string(at.join("a.html")).unwrap();
            assert!(page.contains("Uncertainty of the first of these"), "{page}");
            assert!(page.contains(&fingerprint), "{page}");
        }
        // A limit within the uncertainty of the largest error, with all errors below it.
        let found = json(&at.join("conforms.json"));
        let lengths = found["lengths"].as_array().unwrap();
        let of =
            |name: &'static str| lengths.iter().map(move |of| of[name].as_f64().unwrap().abs());
        let largest = of("error_mm").fold(0.0, f64::max);
        let args = format!("accept {input} {common} --limit {}mm", largest * 1.01);
        assert_eq!(output(at, &args).status.code(), Some(3));
        let inside = of("error_mm").zip(of("expanded_mm")).filter(|(e, u)| e <= u).count();
        assert!(inside as f64 > 0.85 * lengths.len() as f64, "{inside} of {}", lengths.len());
    }

    for (args, expected) in [
        ("camera.json corners --limit 1mm".to_owned(), "were used for the calibration"),
        ("camera.yaml new/left".to_owned(), "no observed covariance"),
        ("camera.json new/left --limit 0mm".to_owned(), "the limit must be positive"),
        ("camera.json new/left --limit 1mm+2".to_owned(), "such as 0.05mm+L/2000"),
        ("camera.json new/left --temperature 25".to_owned(), "--expansion"),
        (
            "camera.json new/left --temperature 25 --expansion 20".to_owned(),
            "scale from the target",
        ),
        (
            format!("rig.json {new} --lengths none.csv"),
            "none.csv: line 2: the target has no corner in row 6 and column 99",
        ),
    ] {
        refused(at, &format!("accept {args} {common}"), &[expected]);
    }
}
