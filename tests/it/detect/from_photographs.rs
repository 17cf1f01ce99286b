//! From synthetic photographs to a calibrated camera: the whole pipeline, compared with the truth.

use crate::common::view::tilted;
use deltille::calibrate::{Calibration, Model, Reference, views};
use deltille::camera::{BrownConrady, Camera, KannalaBrandt, Lens};
use deltille::detect::{Detector, DetectorConfig};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::synth::{Light, scene_of_sheet};
use deltille::targets::{BoardSpec, TagSpec, TargetSpec};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// If all corners are off by 0.01 px in the same way, for example because the bend of the edges is ignored, these
/// parameters are off by 10σ.
#[test]
fn lenses_that_bend_edges_are_calibrated_within_4_sigma() {
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let spec = TargetSpec::Board(BoardSpec::new(GridKind::Deltille, 8, 9, 18.0));
    let paper = PaperSpec::default();
    let target = Printing::build("board", &spec, Some(&family), Some(&paper)).unwrap();
    let sheets = target.draw().unwrap().sheets;
    let scene = scene_of_sheet(&target, &sheets[0], 0);
    let detector = Detector::for_target(&target.target, DetectorConfig::default()).unwrap();

    let barrel = BrownConrady { radial: [-0.3, 0.1, 0.0], ..BrownConrady::default() };
    let fisheye = KannalaBrandt { k: vec![0.05, -0.01, 0.002, 0.0] };
    let cameras = [
        (Model::Radtan, Camera::centred(1280, 960, 800.0, Lens::BrownConrady(barrel))),
        (Model::KannalaBrandt(4), Camera::centred(1280, 960, 330.0, Lens::KannalaBrandt(fisheye))),
    ];
    for (model, camera) in cameras {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let seen = (0..14u32).map(|view| {
            let distance_mm = 0.3 * camera.focal_px.x + 8.0 * f64::from(view);
            let centre_mm = target.target.panels[0].middle_mm();
            let pose = tilted(&mut rng, centre_mm, distance_mm, 0.05 * f64::from(view));
            let light = Light::default().seed(view.into());
            let image = scene.render(&camera, &pose, &light).map(|v| (v * 255.0 + 0.5) as u8);
            (format!("{view:02}"), detector.detect(&image, "view.png"))
        });
        let seen: Vec<_> = seen.collect();
        let shown = views(&seen, &Reference::Target(&target.target)).unwrap();
        let panels = Reference::Target(&target.target).panels();
        let found = Calibration::new(panels).camera("", shown.views, model).solve().unwrap();
        assert!(found.rms_px < 0.006, "{model}: {} px", found.rms_px);
        assert!(found.frames.len() >= 13, "{model}: {} views", found.frames.len());
        for (parameter, truth) in found.cameras[0].parameters.iter().zip(camera.parameters()) {
            // Views of the image centre do not determine the last terms of a fisheye.
            let Some(sd) = parameter.sd else { continue };
            let off = (parameter.value - truth) / sd;
            println!("{model}: {} off by {off:.1}σ", parameter.name);
            assert!(off.abs() < 4.0, "{model}: {} is off by {off:.1}σ", parameter.name);
        }
    }
}
