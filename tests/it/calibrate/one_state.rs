//! Views of a camera that changed, or of a board other than the described one: each case is
//! reported, and no other case is.

use std::sync::atomic::AtomicBool;

use deltille_lab::states::{Run, Scene, run};

fn runs(scenes: &[(Scene, usize)]) -> Vec<Run> {
    run(scenes, 5, &AtomicBool::new(false), &|| ()).unwrap()
}

#[test]
fn a_changed_camera_a_rolling_shutter_and_another_board_are_named() {
    for (scene, kind, figures) in [
        (Scene::Zoom, "changed_camera", 1.098..1.102),
        (Scene::Focus, "changed_camera", 1.003..1.007),
        (Scene::Shutter, "rolling_shutter", 1.0..30.0),
        (Scene::Stretch, "stretched_board", 1.048..1.052),
    ] {
        for run in runs(&[(scene, 3)]) {
            let [(said, figure)] = run.said[..] else { panic!("{run:?}") };
            assert!(said == kind && figures.contains(&figure), "{run:?}");
        }
    }
}

#[test]
fn unchanged_cameras_and_bent_boards_are_not_named() {
    for run in runs(&[(Scene::Clean, 12), (Scene::Curved, 3)]) {
        assert!(run.is_calibrated && run.said.is_empty(), "{run:?}");
    }
}

/// After a change of the focal length by 90 px, the observed standard deviation is tens of px, and
/// that from noise half a pixel.
#[test]
fn the_observed_sd_includes_a_change_between_halves_of_the_views() {
    for run in runs(&[(Scene::Zoom, 3)]) {
        let [_, noise, observed] = run.focal;
        assert!(noise < 2.0 && observed > 20.0 * noise, "{run:?}");
    }
}
