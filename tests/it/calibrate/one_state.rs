//! Views that do not show one camera in one state, or not the described board: each case is named, and no other is.

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

/// For a focal length that changed by 90 px, halves of the views show tens of px, and noise half a pixel.
#[test]
fn the_observed_sd_is_at_least_what_halves_of_the_views_show() {
    for run in runs(&[(Scene::Zoom, 3)]) {
        let [_, noise, observed] = run.focal;
        assert!(noise < 2.0 && observed > 20.0 * noise, "{run:?}");
    }
}
