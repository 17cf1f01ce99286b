//! Assembly of the HTML page: verdict, key figures and advice first, then the sections of each camera.

use std::fmt::Write as _;

use glam::DVec2;

use crate::report::advice::{Advice, Weight, advice};
use crate::report::content::Report;
use crate::report::html::{escaped, figures, section};
use crate::report::measures::survey::Survey;
use crate::report::pictures::sample::Sample;
use crate::report::plots::{distortion, scene, target_map};
use crate::report::sections::key_figures::{cells, of_camera, of_rig};
use crate::report::sections::{exactness, models, parameters, rig, views};
use deltille_calibrate::{CameraEstimate, Diagnosis, Source, TargetMap};
use deltille_core::words::counted;

const STYLE: &str = include_str!("page.css");

impl Report<'_> {
    /// Returns the page as one HTML file with embedded images.
    pub fn html(&self) -> String {
        html(self)
    }
}

/// The page as one HTML file.
fn html(report: &Report) -> String {
    let cameras = &report.estimate.cameras;
    let surveys: Vec<Survey> = cameras.iter().map(Survey::new).collect();
    let title = escaped(report.title);
    let mut page = format!(
        "<!DOCTYPE html>\n<!-- deltille {} -->\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title} – camera calibration</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <header><h1>{title}</h1>",
        env!("CARGO_PKG_VERSION"),
    );
    let advice = advice(report, &surveys);
    page += &verdict(report, &advice);
    page += &match cameras.as_slice() {
        [only] => cells(&of_camera(report, 0, only)),
        _ => cells(&of_rig(report)),
    };
    page += &calibrated_with(report);
    page += "</header>\n<section><h2>Summary</h2><ul class=\"advice\">";
    for piece in advice {
        let (class, sign) = class_and_sign(piece.weight);
        let _ = write!(
            page,
            "<li class=\"{class}\"><span class=\"sign\">{sign}</span><span>{}</span></li>",
            with_whole_options(&piece.text)
        );
    }
    page += "</ul></section>\n";
    if report.is_rig() {
        page += &rig::places(report);
        page += &rig::distances(report);
        page += &rig::targets(report);
        page += &shared(report);
    }
    for (index, (camera, survey)) in cameras.iter().zip(&surveys).enumerate() {
        if report.is_rig() {
            let cells = cells(&of_camera(report, index, camera));
            let _ = write!(page, "<h2 class=\"camera\">{}</h2>{cells}", escaped(&camera.name));
        }
        page +=
            &exactness::uncertainty(camera, report.poses.iter().filter(|of| of.camera == index));
        page += &exactness::residuals(report.estimate, camera, survey);
        if !report.is_rig() {
            page += &rig::targets(report);
            page += &shared(report);
        }
        page += &distortion(camera, survey);
        page += &report.samples.get(&index).map_or(String::new(), Sample::section);
        page += &report.models.get(index).map_or(String::new(), |of| models::section(camera, of));
        page += &parameters::section(camera);
        page += &views::section(report, index, survey);
    }
    if report.is_rig() {
        page += &rig::frames(report);
    }
    let _ = write!(
        page,
        "<footer>deltille {}. Residuals are observed minus predicted positions; rms is per axis, \
         √(Σ(dx² + dy²) / 2N). Standard deviations are scaled by the residuals.</footer>\n</body>\n\
         </html>\n",
        env!("CARGO_PKG_VERSION")
    );
    page
}

/// Sections that do not belong to one camera: the measured target, refined panels, and the scene in
/// space.
fn shared(report: &Report) -> String {
    let map = report.estimate.map.as_ref().map_or(String::new(), target);
    map + &rig::panels(report) + &in_space(report)
}

/// The section with the plots of the distortion of a lens.
fn distortion(camera: &CameraEstimate, survey: &Survey) -> String {
    let grid = distortion::grid_plot(camera, survey);
    let curve = distortion::curve_plot(camera, survey);
    section("Distortion", &figures(curve.into_iter().chain([grid])))
}

/// The section with the scene in space, in the frame of the cameras and in that of the target; empty if the target was not
/// seen.
fn in_space(report: &Report) -> String {
    let image_px = report.estimate.cameras.first().map(|of| [of.camera.width, of.camera.height]);
    let image_px = DVec2::from(image_px.unwrap_or([4, 3]).map(f64::from));
    let drawn = [scene::Fixed::Rig, scene::Fixed::Target].map(|fixed| {
        let svg = scene::drawing(report.estimate, fixed, image_px);
        let what = match (fixed, report.is_rig()) {
            (scene::Fixed::Rig, true) => "The cameras, and the poses of the target",
            (scene::Fixed::Rig, false) => "The camera, and the poses of the target",
            (scene::Fixed::Target, true) => "The target, and the poses of the cameras",
            (scene::Fixed::Target, false) => "The target, and the poses of the camera",
        };
        (svg, format!("{what}, in parallel projection. The view with the largest rms is red."))
    });
    if drawn.iter().all(|(svg, _)| svg.is_empty()) {
        return String::new();
    }
    section("3D view", &figures(drawn))
}

/// The verdict at the top of the page. The most serious piece of advice determines its text, colour
/// and symbol.
fn verdict(report: &Report, advice: &[Advice]) -> String {
    let is_failure = report.diagnoses.iter().any(Diagnosis::is_failure);
    let worst = advice.iter().map(|piece| piece.weight).max().unwrap_or(Weight::Good);
    let (class, own_sign) = class_and_sign(worst);
    let of_worst = advice.iter().filter(|piece| piece.weight == worst).count();
    let below = |thing: &str| match of_worst {
        1 => format!("the {thing} below"),
        n => format!("the {} below", counted(n, thing)),
    };
    let (sign, head, why) = match worst {
        _ if is_failure => ("✕", "Do not use", "The reasons are below.".to_owned()),
        Weight::Warning => (own_sign, "Use with care", format!("See {} first.", below("warning"))),
        Weight::Hint => {
            let verb = if of_worst == 1 { "shows" } else { "show" };
            let why = format!("No warnings; {} {verb} how to improve it.", below("hint"));
            (own_sign, "Usable", why)
        }
        Weight::Good => (own_sign, "Good", "No problems were found.".to_owned()),
    };
    let uncertainty = if is_failure { String::new() } else { uncertainty(report) };
    format!(
        "<p class=\"verdict {class}\"><span class=\"seal\">{sign}</span><span><b>{head}.</b> {why}{uncertainty}</span></p>\n"
    )
}

/// CSS class and symbol of a piece of advice by its weight.
fn class_and_sign(weight: Weight) -> (&'static str, &'static str) {
    match weight {
        Weight::Good => ("good", "✓"),
        Weight::Hint => ("hint", "→"),
        Weight::Warning => ("warning", "!"),
    }
}

/// Summary of the uncertainty of projections of a single camera.
fn uncertainty(report: &Report) -> String {
    let [camera] = report.estimate.cameras.as_slice() else { return String::new() };
    let distance = camera.projection.as_ref().and_then(|known| known.distances_mm.first().copied());
    let known = |mm: Option<f64>| {
        let sd = |source| camera.projection_sd_px(mm, source);
        sd(Source::Observed).or_else(|| sd(Source::Noise))
    };
    let at = distance.and_then(|mm| Some(format!("{:.3} px at {mm:.0} mm", known(Some(mm))?)));
    let far = known(None).map(|sd| format!("{sd:.3} px at infinity"));
    let at: Vec<String> = at.into_iter().chain(far).collect();
    if at.is_empty() {
        return String::new();
    }
    let covered = 100.0 * Survey::new(camera).covered();
    format!(
        " Standard deviation of projections, where corners were seen ({covered:.0} % of the image): {}.",
        at.join(", ")
    )
}

/// The targets, and the scale of their print.
fn calibrated_with(report: &Report) -> String {
    let targets = report.estimate.calibrated_with.iter().map(ToString::to_string);
    let targets: Vec<String> = targets.collect();
    if targets.is_empty() {
        return String::new();
    }
    let scale = report.print.scale.filter(|scale| *scale != [1.0; 2]);
    let scale = scale.map_or(String::new(), |[across, up]| {
        format!("; measured lengths of the print: {across:.5} across and {up:.5} up, times the nominal ones")
    });
    format!("<p class=\"note\">Calibrated with {}{scale}.</p>", escaped(&targets.join(", ")))
}

/// The section with the measured corners of the target.
fn target(map: &TargetMap) -> String {
    let [plane, out] = map.rms_mm();
    let cells = cells(&[
        (format!("{plane:.3} mm"), "in the plane, rms per axis".into()),
        (format!("{out:.3} mm"), "out of the plane, rms".into()),
        (
            format!("{} of {}", map.significant().count(), map.corners().len()),
            "significant offsets".into(),
        ),
    ]);
    let svg = target_map::drawing(map, "");
    let body = format!(
        "{cells}<figure class=\"wide\">{svg}<figcaption>Offsets of the corners from their nominal positions. Translation, \
         rotation and scale of the target are removed: poses and distances absorb them.</figcaption></figure>"
    );
    section("Measured target", &body)
}

/// Escaped text without line breaks in options such as `--board-shape`, and with the typeface of code between backticks.
fn with_whole_options(text: &str) -> String {
    let word = |word: &str| match word.starts_with("--") {
        true => format!("<span class=\"option\">{}</span>", escaped(word)),
        false => escaped(word),
    };
    let text = text.split(' ').map(word).collect::<Vec<_>>().join(" ");
    let part = |(index, part): (usize, &str)| match index % 2 {
        0 => part.to_owned(),
        _ => format!("<code>{part}</code>"),
    };
    text.split('`').enumerate().map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_calibrate::{Estimate, Model};
    use deltille_core::camera::Camera;

    #[test]
    fn the_most_serious_advice_determines_the_verdict() {
        let mut estimate = Estimate::default();
        let camera = Camera::centred(640, 480, 500.0, Model::Radtan.lens());
        estimate.cameras =
            ["left", "right"].map(|of| CameraEstimate::given(of, camera.clone())).into();
        let of = |weights: &[Weight], diagnoses: &[Diagnosis]| {
            let mut report = Report::new("rig", &estimate);
            report.diagnoses = diagnoses;
            let advice = |&weight| Advice { weight, text: String::new() };
            verdict(&report, &weights.iter().map(advice).collect::<Vec<_>>())
        };
        use Weight::{Good, Hint, Warning};
        let late = [Diagnosis::DelayedCamera { camera: 1, frames: 2 }];
        let many_out = [Diagnosis::ManyExcluded { excluded: 3, all: 9 }];
        for (weights, diagnoses, class, head, why) in [
            (&[Good, Good][..], &[][..], "good", "Good", "No problems were found."),
            (&[Hint, Good], &[], "hint", "Usable", "the hint below shows"),
            (&[Hint, Hint, Good], &[], "hint", "Usable", "the 2 hints below show"),
            (
                &[Warning, Hint, Good],
                &late,
                "warning",
                "Use with care",
                "See the warning below first.",
            ),
            (
                &[Warning, Warning, Good],
                &late,
                "warning",
                "Use with care",
                "See the 2 warnings below first.",
            ),
            (&[Warning, Good], &many_out, "warning", "Do not use", "The reasons are below."),
        ] {
            let html = of(weights, diagnoses);
            assert!(html.contains(&format!("class=\"verdict {class}\"")), "{html}");
            assert!(html.contains(&format!("<b>{head}.</b>")) && html.contains(why), "{html}");
        }
    }
}
