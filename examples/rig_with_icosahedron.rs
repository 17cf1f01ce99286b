//! Calibrates two cameras with an icosahedron whose faces were glued on imprecisely: estimates the relative pose of the
//! cameras and the poses of the faces. The images are rendered here, so that the results can be compared with the
//! truth.
//!
//! ```text
//! cargo run --release --example rig_with_icosahedron
//! ```

use std::error::Error;

use deltille::calibrate::{Calibration, Model, Reference, views};
use deltille::camera::{Camera, Pose};
use deltille::detect::Detector;
use deltille::glam::{DQuat, DVec3};
use deltille::synth::{Light, scene_of_target};
use deltille::targets::{SolidShape, SolidSpec, Target};

fn main() -> Result<(), Box<dyn Error>> {
    let spec = SolidSpec { edge_mm: 100.0, ..SolidSpec::new(SolidShape::Icosahedron) };
    let target = Target::new("ico", spec)?;
    // The real solid: every face deviates slightly from its nominal position.
    let mut scene = scene_of_target(&target)?;
    for (face, surface) in scene.surfaces.iter_mut().enumerate() {
        let off = DVec3::new((face as f64).sin(), (face as f64).cos(), 0.5);
        surface.target_from_surface.translation += 0.1 * off;
    }
    // Two cameras of 1600 × 1200 px, a quarter of a metre apart, facing the same point.
    let camera = Camera::pinhole(1600, 1200, 0.5);
    let place = |x: f64| Pose::looking_at(DVec3::new(x, 0.0, 0.0), 700.0 * DVec3::Z, DVec3::NEG_Y);
    let places = [("left", place(-125.0)), ("right", place(125.0))];

    let detector = Detector::new(&target)?;
    let reference = Reference::Target(&target);
    let mut calibration = Calibration::new(reference.panels()).refine_panels(true);
    for (name, camera_from_world) in &places {
        let mut found = Vec::new();
        for frame in 0..15u32 {
            let i = f64::from(frame);
            let turn = DVec3::new((0.7 * i).sin(), (1.1 * i).cos(), (0.3 * i).sin()) * 3.0;
            let translation = DVec3::new(30.0 * i.sin(), 30.0 * i.cos(), 680.0 + 20.0 * i.sin());
            let world_from_target = Pose { rotation: DQuat::from_scaled_axis(turn), translation };
            let light = Light::default().seed(frame.into());
            let image = scene.render(&camera, &camera_from_world.after(&world_from_target), &light);
            let image = image.map(|grey| (255.0 * grey + 0.5) as u8);
            // Images of the same moment have the same name.
            found.push(detector.detect(&image, &format!("{frame:02}")));
        }
        calibration = calibration.camera(name, views(&found, &reference)?.views, Model::Radtan);
    }

    let estimate = calibration.solve()?;
    println!("RMS {:.4} px in {} frames", estimate.rms_px, estimate.frames.len());
    let right = &estimate.cameras[1];
    let [_, left, right_place] = [place(0.0), place(-125.0), place(125.0)];
    let truth = right_place.after(&left.inverse());
    let [turn, step] = right.camera_from_rig.off(&truth);
    println!("right camera: errors {:.3} mm and {:.4}°", step.length(), turn.length().to_degrees());
    if let Some(sd) = right.pose_sd {
        println!("reported uncertainty (1σ): {:.3} mm across, {:.3} mm along", sd[3], sd[5]);
    }
    std::fs::write("ico-refined.json", estimate.refined(&target).to_json())?;
    Ok(())
}
