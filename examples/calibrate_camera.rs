//! Calibrates a camera from images of a target, reports problems, and writes the camera and a report.
//!
//! ```text
//! cargo run --release --example calibrate_camera -- desk.json photos/*.png
//! ```

use std::error::Error;

use deltille::calibrate::{Calibration, Messages, Model, Reference, views};
use deltille::detect::Detector;
use deltille::photograph;
use deltille::report::Report;
use deltille::targets::Target;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let target = args.next().ok_or("usage: calibrate_camera TARGET.json PHOTOGRAPHS…")?;
    let target = Target::from_json(&std::fs::read_to_string(target)?)?;
    let detector = Detector::new(&target)?;
    let mut found = Vec::new();
    for path in args {
        found.push(detector.detect(&photograph::read(&path)?, &path));
    }
    let target = Reference::Target(&target);
    let shown = views(&found, &target)?;
    // Every fifth view is held out to measure how well the calibration predicts it.
    let calibration = Calibration::new(target.panels())
        .camera("camera", shown.views, Model::Radtan)
        .hold_out(Some(5));
    let estimate = calibration.solve()?;
    let diagnoses = calibration.explain(&estimate);

    let camera = &estimate.cameras[0];
    for parameter in &camera.parameters {
        if let Some(sd) = parameter.sd {
            println!("{:5} {:12.5} ± {sd:.5}", parameter.name, parameter.value);
        }
    }
    println!("rms {:.4} px, {} corners", estimate.rms_px, estimate.corner_count());
    if let Some(held_out) = &estimate.held_out {
        println!("rms {:.4} px in {} views held out", held_out.rms_px, held_out.frames.len());
    }
    let words = Messages::new(&estimate, None);
    for diagnosis in &diagnoses {
        println!("warning: {}", words.sentence(diagnosis));
    }
    std::fs::write("camera.yaml", camera.camera.to_yaml())?;
    let mut report = Report::new("camera", &estimate);
    report.diagnoses = &diagnoses;
    std::fs::write("camera.html", report.html())?;
    Ok(())
}
