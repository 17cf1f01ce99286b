//! Advice on the views: their number, the tilts of the target in them, and the parts of the image that it covers.

use glam::DVec2;

use crate::report::advice::piece::{Advice, Weight};
use crate::report::content::Report;
use crate::report::measures::survey::Survey;
use deltille_calibrate::CameraEstimate;
use deltille_core::words::counted;

/// Minimum tilt that separates focal length from distance, rad: at usual distances the near side of
/// the board then appears at least 10 % larger than the far side.
const TILTED_RAD: f64 = 0.35;
/// Minimum number of tilted views: about two axes, in both directions.
const TILTED_VIEWS: usize = 4;
/// Minimum of the sum over the tilted views of sin² of the angle between their direction and the most frequent one: one
/// view at a right angle to the others.
const ACROSS: f64 = 1.0;

/// Minimum number of views: with fewer, an inconsistent view is hard to identify.
const VIEWS: usize = 10;

/// Fraction of the cells of the image that should contain corners: distortion between them is interpolated.
const COVERED: f64 = 0.75;
/// Minimum distance of the outermost corner from the image centre, as a fraction of the half diagonal.
/// Beyond it, distortion is extrapolated, and polynomials diverge.
const REACH: f64 = 0.85;

/// Advice on the tilts of a planar target in the views, and on their number.
pub(super) fn number_and_tilts(report: &Report, survey: &Survey) -> Vec<Advice> {
    let mut found = Vec::new();
    let mut add = |weight, text| found.push(Advice { weight, text });
    let count = survey.views.len();
    if survey.planar {
        let tilted = survey.views.iter().filter(|view| view.tilt_rad > Some(TILTED_RAD));
        let directions = tilted.clone().filter_map(|view| view.tilt_direction_rad);
        // Opposite directions have the same axis, and the same double angle.
        let doubled: DVec2 = directions.map(|at| DVec2::from_angle(2.0 * at)).sum();
        let tilted = tilted.count();
        let across = (tilted as f64 - doubled.length()) / 2.0;
        // If all of few views are tilted, their number is the only cause.
        if tilted < TILTED_VIEWS.min(count) {
            let few = match tilted {
                0 => "No view is".to_owned(),
                1 => "Only 1 view is".to_owned(),
                _ => format!("Only {tilted} views are"),
            };
            add(
                Weight::Warning,
                format!(
                    "{few} tilted by more than 20°, so focal length and distance are hard to separate. Tilt the {} by \
                     30° to 50° in all four directions.",
                    report.target_noun()
                ),
            );
        } else if across < ACROSS {
            add(
                Weight::Warning,
                format!(
                    "{tilted} of {count} views are tilted by more than 20°, but all about the same axis of the image, so \
                     focal length and principal point are uncertain: also tilt the {}, or turn the camera by 90°, about the other one.",
                    report.target_noun()
                ),
            );
        } else {
            let text =
                format!("{tilted} of {count} views are tilted by more than 20°, about both axes.");
            add(Weight::Good, text);
        }
    }
    if count < VIEWS {
        add(
            Weight::Warning,
            format!("Only {}: take at least {VIEWS}, preferably 20 to 50.", counted(count, "view")),
        );
    }
    found
}

/// Adds advice on the coverage of the image.
pub(super) fn coverage(
    report: &Report,
    camera: &CameraEstimate,
    survey: &Survey,
    add: &mut impl FnMut(Weight, String),
) {
    let (covered, reach) = (survey.covered(), survey.reach(camera));
    let of_what = if survey.circle.is_some() { "image circle" } else { "image" };
    if covered < COVERED {
        let text = format!(
            "Corners cover {:.0} % of the {of_what}: move the {} to the empty cells of the coverage map. \
             It may extend beyond the image.",
            100.0 * covered,
            report.target_noun()
        );
        add(Weight::Hint, text);
    } else {
        add(Weight::Good, format!("Corners cover {:.0} % of the {of_what}.", 100.0 * covered));
    }
    if reach < REACH {
        let (place, length) = match survey.circle {
            Some(_) => ("near the edge of the image circle", "radius"),
            None => ("near the four corners of the image", "half diagonal"),
        };
        let text = format!(
            "No corner of the {} was seen {place}: distortion is extrapolated beyond {:.0} % of the {length}.",
            report.target_noun(),
            100.0 * reach
        );
        add(Weight::Hint, text);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use deltille_calibrate::{Estimate, Model};
    use deltille_core::camera::Camera;

    use super::*;
    use crate::report::measures::survey::SurveyedView;

    #[test]
    fn tilts_about_one_axis_are_not_enough() {
        let camera = Camera::centred(640, 480, 500.0, Model::Radtan.lens());
        let camera = CameraEstimate::given("camera", camera);
        let estimate = Estimate::default();
        let report = Report::new("camera", &estimate);
        let is_one_axis = |directions: &[f64]| {
            let mut survey = Survey::new(&camera);
            survey.planar = true;
            let view = |&direction| SurveyedView {
                tilt_rad: Some(0.6),
                tilt_direction_rad: Some(direction),
                distance_mm: 500.0,
            };
            survey.views = directions.iter().map(view).collect();
            let advice = number_and_tilts(&report, &survey);
            advice.iter().any(|piece| piece.text.contains("about the same axis"))
        };
        assert!(is_one_axis(&[0.0, 0.1, PI, PI - 0.1, -0.1]));
        assert!(!is_one_axis(&[0.0, FRAC_PI_2, PI, -FRAC_PI_2]));
        assert!(!is_one_axis(&[0.0, 0.0, 0.0, FRAC_PI_2]));
    }

    #[test]
    fn few_parallel_views_have_one_first_cause() {
        let camera =
            CameraEstimate::given("", Camera::centred(640, 480, 500.0, Model::Radtan.lens()));
        let estimate = Estimate::default();
        let warnings = |tilt_rad: f64| {
            let mut survey = Survey::new(&camera);
            survey.planar = true;
            let view = |direction: f64| SurveyedView {
                tilt_rad: Some(tilt_rad),
                tilt_direction_rad: Some(direction),
                distance_mm: 500.0,
            };
            survey.views = [0.0, FRAC_PI_2, PI].map(view).to_vec();
            let advice = number_and_tilts(&Report::new("", &estimate), &survey).into_iter();
            let of_weight = advice.filter(|piece| piece.weight == Weight::Warning);
            of_weight.map(|piece| piece.text).collect::<Vec<_>>()
        };
        let parallel = warnings(0.1);
        assert!(parallel[0].starts_with("No view is tilted"), "{parallel:?}");
        let tilted = warnings(0.6);
        assert!(tilted.len() == 1 && tilted[0].starts_with("Only 3 views:"), "{tilted:?}");
    }
}
