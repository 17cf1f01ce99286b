//! Advice on what would improve a calibration. Every rule has its reason; none depends on the kind
//! of camera. Every diagnosis is a warning, so that the page says no less than the program does.

use crate::report::content::Report;
use crate::report::measures::survey::Survey;
use deltille_calibrate::{CameraEstimate, Diagnosis, Excluded, Parameter};
use deltille_core::camera::Lens;
use deltille_core::setting::Setting::{CalibrationBoardShape, CalibrationRefinePanels, PrintScale};
use deltille_core::statistics::median;
use deltille_core::words::counted;

/// Importance of a piece of advice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Weight {
    /// A check that passed.
    Good,
    /// Better results are possible.
    Hint,
    /// The figures are not reliable before this is corrected.
    Warning,
}

/// A piece of advice.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Advice {
    /// Its importance.
    pub weight: Weight,
    /// The observation, and what to do about it.
    pub text: String,
}

/// Least tilt that separates focal length from distance, rad: at usual distances the near side of
/// the board is then seen larger than the far side by a tenth and more.
const TILTED_RAD: f64 = 0.35;
/// Least number of tilted views: about two axes, both ways.
const TILTED_VIEWS: usize = 4;

/// Least number of views: with fewer, a wrong one can hardly be identified.
const VIEWS: usize = 10;

/// Fraction of the cells of the image that should hold corners: distortion between them is
/// interpolated.
const COVERED: f64 = 0.75;
/// Least distance of the outermost corner from the middle, as a fraction of the half diagonal:
/// beyond it distortion is extrapolated, where polynomials diverge.
const REACH: f64 = 0.85;

/// A distortion parameter smaller than this many standard deviations may be zero.
const SIGNIFICANT: f64 = 2.0;

/// Parameters with a greater correlation cannot be separated in practice.
const CORRELATED: f64 = 0.99;

/// A pattern of mean residuals this many times as large as by chance is lack of fit of the model.
const PATTERN: f64 = 3.0;
/// Least size of such a pattern relative to the noise of a corner: a smaller one does not matter,
/// however significant it is.
const PATTERN_PART: f64 = 0.2;

/// A view whose RMS residual is this many times the median should be inspected.
const BAD_VIEW: f64 = 2.5;

/// Held-out views whose RMS residual is this many times larger show overfitting, or views that
/// differ.
const HOLDOUT: f64 = 1.25;

/// Advice on a calibration, the most important first; `surveys` are those of its cameras, in order.
pub fn advice(report: &Report, surveys: &[Survey]) -> Vec<Advice> {
    let mut found = Vec::new();
    let mut add = |weight, text: String| found.push(Advice { weight, text });
    told(report, &mut add, Topic::Whole);
    let cameras = || report.estimate.cameras.iter().zip(surveys).enumerate();
    for (index, (camera, survey)) in cameras() {
        let mut add = |weight, text: String| {
            found.push(Advice { weight, text: of_camera(report, camera, text) });
        };
        views(report, index, camera, survey, &mut add);
        coverage(report, camera, survey, &mut add);
        told(report, &mut add, Topic::Lens(index));
        superfluous(camera, &mut add);
        told(report, &mut add, Topic::Parameters(index));
        correlated(camera, &mut add);
    }
    let mut add = |weight, text: String| found.push(Advice { weight, text });
    left_out(report, &mut add, |out| report.is_rig() && out.camera.is_none());
    told(report, &mut add, Topic::Errors);
    told(report, &mut add, Topic::Cause);
    for (index, (camera, survey)) in cameras() {
        let mut add = |weight, text: String| {
            found.push(Advice { weight, text: of_camera(report, camera, text) });
        };
        residuals(report, index, survey, &mut add);
    }
    let mut add = |weight, text: String| found.push(Advice { weight, text });
    if report.estimate.shape.is_some_and(|shape| !shape.is_significant()) {
        let text =
            "The sheet's shape is no more than chance makes: take the calibration without it.";
        add(Weight::Hint, text.to_owned());
    }
    if let Some(shape) = report.estimate.shape.filter(|shape| shape.is_significant()) {
        let text = format!(
            "The sheet is bent by {:.2} mm and its corners lie up to {:.2} mm beside their places; that \
             is allowed for. Glue it on something flat.",
            shape.bent_mm, shape.stretched_mm
        );
        add(Weight::Hint, text);
    }
    let outliers = report.estimate.outlier_count();
    if outliers > 0 {
        let text = format!(
            "{outliers} of {} corners lie farther off than chance allows; they are drawn in red.",
            report.estimate.corner_count()
        );
        add(Weight::Hint, text);
    }
    if let Some(held_out) = &report.estimate.held_out {
        let (test, own) = (held_out.rms_px, report.estimate.rms_px);
        let figures = format!("{test:.4} px on views that took no part, {own:.4} px on its own");
        if test > HOLDOUT * own {
            let text = format!("{figures}: the model fits noise, or the views differ in kind.");
            add(Weight::Warning, text);
        } else {
            add(Weight::Good, format!("{figures}."));
        }
    }
    if report.print.scale.is_none() {
        let text = format!(
            "Distances are as true as the print: measure both check bars of the sheet and give {PrintScale}. Focal \
             lengths and distortion do not depend on it where both are off alike."
        );
        add(Weight::Hint, text);
    }
    found.sort_by_key(|advice| std::cmp::Reverse(advice.weight));
    found
}

/// A text about a camera, which is named where there are several.
fn of_camera(report: &Report, camera: &CameraEstimate, text: String) -> String {
    // The text of a diagnosis names its camera.
    let named = format!("Camera {}", camera.name);
    match report.is_rig() && !text.starts_with(&named) {
        true => format!("{named}: {text}"),
        false => text,
    }
}

/// What a diagnosis is about, which decides where among the advice it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Topic {
    /// The whole result, or anything without a topic of its own; it stands first.
    Whole,
    /// The lens of a camera, by its index.
    Lens(usize),
    /// The parameters of a camera, by its index.
    Parameters(usize),
    /// Corners that are wrong together.
    Errors,
    /// Why residuals are not noise.
    Cause,
}

impl Topic {
    fn of(diagnosis: &Diagnosis) -> Self {
        match diagnosis {
            Diagnosis::LensEnds { camera, .. } => Self::Lens(*camera),
            Diagnosis::IllConditioned { camera, .. } => Self::Parameters(*camera),
            Diagnosis::GrossErrors(_) => Self::Errors,
            Diagnosis::Remedied { .. }
            | Diagnosis::LackOfFit(_)
            | Diagnosis::PoorFit { .. }
            | Diagnosis::RollingShutter { .. }
            | Diagnosis::StretchedBoard { .. }
            | Diagnosis::OtherMinimum { .. } => Self::Cause,
            _ => Self::Whole,
        }
    }
}

/// Adds the diagnoses of a topic.
fn told(report: &Report, add: &mut impl FnMut(Weight, String), topic: Topic) {
    for diagnosis in report.diagnoses.iter().filter(|diagnosis| Topic::of(diagnosis) == topic) {
        add(Weight::Warning, sentence(&report.words().sentence(diagnosis)));
    }
}

fn views(
    report: &Report,
    index: usize,
    camera: &CameraEstimate,
    survey: &Survey,
    add: &mut impl FnMut(Weight, String),
) {
    let count = camera.views.len();
    if count < VIEWS {
        add(
            Weight::Warning,
            format!("Only {}: take at least {VIEWS}, better 20 to 50.", counted(count, "view")),
        );
    }
    if survey.planar {
        let tilted = survey.views.iter().filter_map(|view| view.tilt_rad);
        let tilted = tilted.filter(|&tilt| tilt > TILTED_RAD).count();
        if tilted < TILTED_VIEWS {
            add(
                Weight::Warning,
                format!(
                    "Only {tilted} of {count} views tilted by more than 20°: focal length and distance are \
                     hardly told apart. Tilt the {} by 30° to 50°, to all four sides.",
                    report.target_noun()
                ),
            );
        } else {
            add(Weight::Good, format!("{tilted} of {count} views are tilted by more than 20°."));
        }
    }
    left_out(report, add, |out| match &out.camera {
        Some(name) => *name == camera.name,
        None => !report.is_rig(),
    });
    let rms = camera.views.iter().map(|view| view.rms_px);
    let median = median(rms.collect()).unwrap_or_default();
    let bad = camera.views.iter().filter(|view| view.rms_px > BAD_VIEW * median);
    let bad: Vec<&str> = bad.map(|view| view.name.as_str()).collect();
    // Where the lens is not that of the model, or rows are displaced, photographs are not to blame.
    let is_other = |said: &Diagnosis| match said {
        Diagnosis::RollingShutter { camera, .. } => *camera == index,
        _ => said.misfit_of() == Some(index),
    };
    if !bad.is_empty() && !report.diagnoses.iter().any(is_other) {
        let bent =
            if report.has_panels() { "a panel that is bent or loose" } else { "a bent board" };
        let text = format!(
            "Much worse than the others: {}. Look for motion blur, {bent}, or reflections.",
            named(&bad)
        );
        add(Weight::Hint, text);
    }
}

/// Names the excluded views and panels.
fn left_out(
    report: &Report,
    add: &mut impl FnMut(Weight, String),
    is_meant: impl Fn(&Excluded) -> bool,
) {
    let excluded = report.estimate.excluded.iter().filter(|out| is_meant(out));
    let excluded: Vec<&str> = excluded.map(|out| out.view.as_str()).collect();
    if !excluded.is_empty() {
        let names = named(&excluded);
        let text = format!("Left out, because they do not fit the others or the target: {names}.");
        add(Weight::Warning, text);
    }
}

/// Some names, the first of many.
fn named(names: &[&str]) -> String {
    match names {
        [a, b, c, rest @ ..] if !rest.is_empty() => {
            format!("{a}, {b}, {c} and {} more", rest.len())
        }
        few => few.join(", "),
    }
}

fn coverage(
    report: &Report,
    camera: &CameraEstimate,
    survey: &Survey,
    add: &mut impl FnMut(Weight, String),
) {
    let (covered, reach) = (survey.covered(), survey.reach(camera));
    let of_what = if survey.circle.is_some() { "image circle" } else { "image" };
    if covered < COVERED {
        let text = format!(
            "Corners cover {:.0} % of the {of_what}: bring the {} to the empty cells of the map, \
             parts of it may lie outside.",
            100.0 * covered,
            report.target_noun()
        );
        add(Weight::Hint, text);
    } else {
        add(Weight::Good, format!("Corners cover {:.0} % of the {of_what}.", 100.0 * covered));
    }
    if reach < REACH {
        let (place, length) = match survey.circle {
            Some(_) => ("near the rim of the image circle", "radius"),
            None => ("in the corners of the image", "half diagonal"),
        };
        let text = format!(
            "No corner was seen {place}: beyond {:.0} % of its {length} the distortion is extrapolated.",
            100.0 * reach
        );
        add(Weight::Hint, text);
    }
}

/// The text as a sentence, with a capital letter and a full stop.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|letter| letter.to_ascii_uppercase());
    first.into_iter().chain(letters).chain(['.']).collect()
}

/// Parameters that a smaller model does without.
fn superfluous(camera: &CameraEstimate, add: &mut impl FnMut(Weight, String)) {
    if let Some(model) = camera.model
        && let Some(smaller) = model.smaller()
    {
        // What the smaller model does without.
        let there = smaller.free().into_iter().chain(std::iter::repeat(false));
        let more = model.free().into_iter().zip(there).zip(&camera.parameters);
        let more: Vec<_> =
            more.filter(|((here, there), _)| *here && !there).map(|(_, p)| p).collect();
        let weak = |p: &&Parameter| p.sd.is_some_and(|sd| p.value.abs() < SIGNIFICANT * sd);
        if more.iter().all(weak) {
            let names: Vec<&str> = more.iter().map(|p| p.name.as_str()).collect();
            let text = format!(
                "Not told from zero: {}. The model {smaller} does without, and is safer where there \
                 are no corners.",
                names.join(", ")
            );
            add(Weight::Hint, text);
        }
    }
}

fn correlated(camera: &CameraEstimate, add: &mut impl FnMut(Weight, String)) {
    // Correlations of neighbouring knots are of no interest.
    if matches!(camera.camera.lens, Lens::Spline(_)) {
        return;
    }
    let is_loose = |name: &str| camera.ill_conditioned.iter().any(|loose| loose == name);
    let names: Vec<&str> = camera.found().collect();
    let mut pairs = Vec::new();
    for i in 0..names.len() {
        for j in 0..i {
            let correlation = camera.correlation(i, j);
            // Square pixels tie the two focal lengths to each other; that is no loss.
            let focal = [names[j], names[i]] == ["fx", "fy"];
            let told = is_loose(names[i]) && is_loose(names[j]);
            if correlation.abs() > CORRELATED && !focal && !told {
                pairs.push(format!("{} with {}", names[j], names[i]));
            }
        }
    }
    if !pairs.is_empty() {
        let more =
            if pairs.len() > 3 { format!(" and {} more", pairs.len() - 3) } else { String::new() };
        pairs.truncate(3);
        let text = format!(
            "Correlated beyond ±{CORRELATED}: {}{more}. They are known together, neither of them \
             alone.",
            pairs.join(", ")
        );
        add(Weight::Hint, text);
    }
}

fn residuals(report: &Report, index: usize, survey: &Survey, add: &mut impl FnMut(Weight, String)) {
    let camera = &report.estimate.cameras[index];
    let means = survey.means_px.iter().flatten().map(|cell| cell.mean_px);
    let count = means.clone().count().max(1) as f64;
    let size = (means.map(|mean| mean.length_squared() / 2.0).sum::<f64>() / count).sqrt();
    let is_explained = report.diagnoses.iter().any(|of| Topic::of(of) == Topic::Cause);
    match survey.pattern().filter(|_| !is_explained) {
        Some(pattern) if pattern > PATTERN && size > PATTERN_PART * camera.rms_px => {
            let (target, remedy) = match report.has_panels() {
                true => (
                    "panels are not flat or not where the target's file has them",
                    CalibrationRefinePanels,
                ),
                false => ("the board is not flat", CalibrationBoardShape),
            };
            add(
                Weight::Hint,
                format!(
                    "Residuals leave a pattern over the image, {pattern:.1} times what chance makes and \
                     {size:.3} px strong: less than noise, but the model does not describe this lens \
                     wholly, or {target}. Try a richer model, or {remedy}."
                ),
            );
        }
        Some(_) => {
            add(Weight::Good, "Residuals leave no strong pattern over the image.".to_owned())
        }
        None => {}
    }
}

#[cfg(test)]
mod tests {
    use deltille_calibrate::Matrix;

    use super::*;
    use deltille_calibrate::{Estimate, LackOfFit, Model, PanelPlace, ViewEstimate};
    use deltille_core::camera::{Camera, Pose};

    /// What is advised where no parameter of the lens is told from zero.
    fn advised(model: Model) -> String {
        let camera = Camera::centred(640, 480, 500.0, model.lens());
        let values = camera.parameter_names().into_iter().zip(camera.parameters());
        let parameters = values.zip(model.free());
        let parameters: Vec<Parameter> = parameters
            .map(|((name, value), free)| Parameter { name, value, sd: free.then_some(1.0) })
            .collect();
        let count = model.free().into_iter().filter(|free| *free).count();
        let mut camera = CameraEstimate::given("camera", camera);
        (camera.model, camera.parameters) = (Some(model), parameters);
        camera.covariance = Matrix::from_fn(count, count, |i, j| f64::from(i == j));
        camera.rms_px = 0.1;
        let surveys = [Survey::new(&camera)];
        let mut estimate = Estimate::default();
        estimate.cameras = vec![camera];
        let report = Report::new("camera", &estimate);
        let advice = advice(&report, &surveys);
        advice.into_iter().map(|advice| advice.text + "\n").collect()
    }

    /// An estimate of so many cameras and panels, without views.
    fn estimate(cameras: usize, panels: usize) -> Estimate {
        let camera = |index: usize| {
            let camera = Camera::centred(640, 480, 500.0, Model::Radtan.lens());
            CameraEstimate::given(&format!("c{index}"), camera)
        };
        let place = PanelPlace { target_from_panel: Pose::IDENTITY, covariance: None };
        let mut estimate = Estimate::default();
        estimate.cameras = (0..cameras).map(camera).collect();
        estimate.panels = vec![place; panels];
        estimate
    }

    #[test]
    fn every_diagnosis_is_a_warning_once() {
        let estimate = estimate(2, 1);
        let other = estimate.cameras[0].camera.clone();
        let diagnoses = [
            Diagnosis::ForeignCamera { camera: 0, rms_px: 9.0 },
            Diagnosis::AbsurdFit { camera: 1, rms_px: 9.0 },
            Diagnosis::ManyLeftOut { left_out: 3, all: 9 },
            Diagnosis::Late { camera: 1, frames: 2 },
            Diagnosis::OtherMinimum { camera: 0, other, rms_px: 0.1 },
            Diagnosis::LackOfFit(LackOfFit::Lens { camera: 0, rms_px: 0.1 }),
            Diagnosis::PoorFit { camera: 1, rms_px: 2.0 },
            Diagnosis::IllConditioned {
                camera: 1,
                parameters: vec!["cx".to_owned()],
                sufficient: None,
            },
        ];
        let mut report = Report::new("rig", &estimate);
        report.diagnoses = &diagnoses;
        let surveys: Vec<Survey> = estimate.cameras.iter().map(Survey::new).collect();
        let found = advice(&report, &surveys);
        for diagnosis in &diagnoses {
            let text = sentence(&report.words().sentence(diagnosis));
            let told: Vec<&Advice> = found.iter().filter(|advice| advice.text == text).collect();
            assert_eq!(told.len(), 1, "{text}");
            assert_eq!(told[0].weight, Weight::Warning, "{text}");
        }
        // What is said of the whole result comes first.
        assert!(found[3].text.starts_with("Camera c1 lags by 2 frames"), "{found:?}");
    }

    /// Of a lens that is not that of the model some views are much worse than others.
    #[test]
    fn photographs_are_not_blamed_for_a_model_that_does_not_fit() {
        let mut estimate = estimate(1, 1);
        let view = |index: usize| ViewEstimate {
            name: format!("{index}"),
            image: String::new(),
            frame: index,
            pose: Pose::IDENTITY,
            rms_px: if index == 0 { 90.0 } else { 9.0 },
            corners: Vec::new(),
        };
        estimate.cameras[0].views = (0..12).map(view).collect();
        for (diagnosis, is_blamed) in [
            (None, true),
            (Some(Diagnosis::AbsurdFit { camera: 0, rms_px: 9.0 }), false),
            (Some(Diagnosis::LackOfFit(LackOfFit::Lens { camera: 0, rms_px: 9.0 })), false),
        ] {
            let diagnoses: Vec<Diagnosis> = diagnosis.into_iter().collect();
            let mut report = Report::new("camera", &estimate);
            report.diagnoses = &diagnoses;
            let found = advice(&report, &[Survey::new(&estimate.cameras[0])]);
            let blur = found.iter().any(|advice| advice.text.contains("motion blur"));
            assert_eq!(blur, is_blamed, "{diagnoses:?}");
        }
    }

    #[test]
    fn what_has_several_panels_is_no_board() {
        for (panels, noun, other) in [(1, "board", "target"), (20, "target", "board")] {
            let estimate = estimate(1, panels);
            let report = Report::new("camera", &estimate);
            let surveys = [Survey::new(&estimate.cameras[0])];
            let found = advice(&report, &surveys);
            let texts: String = found.into_iter().map(|advice| advice.text + "\n").collect();
            assert!(texts.contains(&format!("bring the {noun} to the empty cells")), "{texts}");
            assert!(!texts.contains(other), "{texts}");
        }
    }

    #[test]
    fn a_smaller_model_is_advised_where_there_is_one() {
        for (model, text) in [
            (Model::Radtan5, "Not told from zero: k3. The model radtan does without"),
            (Model::Rational, "Not told from zero: k4, k5, k6. The model radtan5 does without"),
            (Model::KannalaBrandt(5), "Not told from zero: k5. The model kannala-brandt does"),
        ] {
            assert!(advised(model).contains(text), "{}", advised(model));
        }
        for model in [Model::Pupil, Model::Radtan, Model::KannalaBrandt(4)] {
            assert!(!advised(model).contains("Not told from zero"), "{}", advised(model));
        }
    }
}
