//! Tracks a target with a calibrated camera: a loop over frames in existing buffers, without copying. The frames are
//! rendered here.
//!
//! ```text
//! cargo run --release --example pose_loop
//! ```

use std::error::Error;
use std::time::Instant;

use deltille::calibrate::{Calibration, Reference, views};
use deltille::camera::{Camera, Pose};
use deltille::detect::Detector;
use deltille::glam::DVec3;
use deltille::raster::{ImageView, View};
use deltille::synth::{Light, scene_of_target};
use deltille::targets::{BoardSpec, Target};

fn main() -> Result<(), Box<dyn Error>> {
    let board = Target::new("desk", BoardSpec::deltille(6, 7, 20.0))?;
    let camera = Camera::pinhole(1280, 960, 1.0);
    let scene = scene_of_target(&board)?;

    let detector = Detector::new(&board)?;
    let reference = Reference::Target(&board);
    for frame in 0..10 {
        let eye = DVec3::new(20.0 * f64::from(frame), -100.0, 300.0);
        let truth = Pose::looking_at(eye, DVec3::new(70.0, 50.0, 0.0), DVec3::Y);
        let image = scene.render(&camera, &truth, &Light::default());
        let bytes: Vec<u8> = image.pixels().iter().map(|grey| (255.0 * grey + 0.5) as u8).collect();

        // Rows of 1280 bytes, as in the buffer of a camera driver.
        let start = Instant::now();
        let frame_view = View::new(1280, 960, 1280, &bytes).ok_or("too few bytes")?;
        let name = format!("frame {frame}");
        let found = detector.detect(ImageView::from(frame_view), &name);
        let shown = views([&found], &reference)?;
        let estimate = Calibration::new(reference.panels())
            .camera("camera", shown.views, camera.clone())
            .solve()?;
        let milliseconds = 1e3 * start.elapsed().as_secs_f64();

        let Some(seen) = estimate.frames.first() else {
            println!("{name}: no board");
            continue;
        };
        let off = (seen.rig_from_target.translation - truth.translation).length();
        println!(
            "{name}: {:.1} mm away, error {off:.3} mm, RMS {:.4} px, {milliseconds:.0} ms",
            seen.rig_from_target.translation.length(),
            seen.rms_px
        );
    }
    Ok(())
}
