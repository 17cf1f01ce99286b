//! Views that are not of one camera in one state, or not of the board that is described: each is named, and nothing is
//! where nothing is wrong.

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
fn nothing_is_named_where_camera_and_board_are_as_described_or_bent() {
    for run in runs(&[(Scene::Clean, 12), (Scene::Curved, 3)]) {
        assert!(run.is_calibrated && run.said.is_empty(), "{run:?}");
    }
}

/// Of a focal length that changed by 90 px the halves of the views show tens of px, and noise half a pixel.
#[test]
fn an_observed_deviation_is_not_below_what_halves_of_the_views_show() {
    for run in runs(&[(Scene::Zoom, 3)]) {
        let [_, noise, observed] = run.focal;
        assert!(noise < 2.0 && observed > 20.0 * noise, "{run:?}");
    }
}
