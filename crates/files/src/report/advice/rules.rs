//! Advice on how to improve a calibration. Every rule states its reason, and none depends on the kind of camera. Every
//! diagnosis is a warning, so the page contains all warnings of the program.

use crate::report::advice::piece::{Advice, Weight};
use crate::report::advice::views_taken::{coverage, number_and_tilts};
use crate::report::content::Report;
use crate::report::measures::survey::Survey;
use deltille_calibrate::{CameraEstimate, Corner, Diagnosis, Excluded, Parameter, ViewEstimate};
use deltille_core::camera::Lens;
use deltille_core::setting::Setting::{
    CalibrateModel, CalibrationBoardShape, CalibrationRefinePanels, PrintScale,
};
use deltille_core::statistics::median;

/// Number of standard deviations below which a distortion parameter may be zero.
const SIGNIFICANT: f64 = 2.0;

/// Correlation above which two parameters cannot be separated in practice.
const CORRELATED: f64 = 0.99;

/// Ratio of mean residuals to their expected size from noise above which the model has lack of fit.
const PATTERN: f64 = 3.0;
/// Minimum size of a relevant pattern as a fraction of the corner noise: a smaller one does not matter, even if it is
/// significant.
const PATTERN_PART: f64 = 0.2;

/// Ratio to the median RMS residual above which a view should be inspected.
const BAD_VIEW: f64 = 2.5;

/// Ratio of held-out to training RMS residual above which the model overfits, or the views differ.
const HOLDOUT: f64 = 1.25;

/// Returns advice on a calibration, the most important first; `surveys` are those of its cameras, in order.
pub fn advice(report: &Report, surveys: &[Survey]) -> Vec<Advice> {
    let mut found = Vec::new();
    let mut add = |weight, text: String| found.push(Advice { weight, text });
    add_diagnoses(report, &mut add, Topic::Whole);
    let cameras = || report.estimate.cameras.iter().zip(surveys).enumerate();
    for (index, (camera, survey)) in cameras() {
        let mut add = |weight, text: String| {
            found.push(Advice { weight, text: of_camera(report, camera, text) });
        };
        views(report, index, camera, survey, &mut add);
        coverage(report, camera, survey, &mut add);
        add_diagnoses(report, &mut add, Topic::Lens(index));
        superfluous(camera, &mut add);
        add_diagnoses(report, &mut add, Topic::Parameters(index));
        correlated(camera, &mut add);
    }
    let mut add = |weight, text: String| found.push(Advice { weight, text });
    left_out(report, &mut add, |out| report.is_rig() && out.camera.is_none());
    add_diagnoses(report, &mut add, Topic::Errors);
    add_diagnoses(report, &mut add, Topic::Cause);
    for (index, (camera, survey)) in cameras() {
        let mut add = |weight, text: String| {
            found.push(Advice { weight, text: of_camera(report, camera, text) });
        };
        residuals(report, index, survey, &mut add);
    }
    let mut add = |weight, text: String| found.push(Advice { weight, text });
    if report.estimate.shape.is_some_and(|shape| !shape.is_significant()) {
        let text = "The estimated shape of the sheet is not significant: calibrate without it.";
        add(Weight::Hint, text.to_owned());
    }
    if let Some(shape) = report.estimate.shape.filter(|shape| shape.is_significant()) {
        let text = format!(
            "The sheet is bent by {:.2} mm, and its corners are up to {:.2} mm from their nominal positions. The \
             calibration corrects for this. Mount the sheet on a flat plate.",
            shape.bent_mm, shape.stretched_mm
        );
        add(Weight::Hint, text);
    }
    let outliers = report.estimate.outlier_count();
    if outliers > 0 {
        let text = format!(
            "{outliers} of {} corners are outliers: in red in the pictures of the views.",
            report.estimate.corner_count()
        );
        add(Weight::Hint, text);
    }
    if let Some(held_out) = &report.estimate.held_out {
        let (test, own) = (held_out.rms_px, report.estimate.rms_px);
        let figures = format!("RMS {test:.4} px on held-out views, {own:.4} px on training views");
        if test > HOLDOUT * own {
            let text = format!(
                "{figures}: the model overfits, or the held-out views differ systematically from the others."
            );
            add(Weight::Warning, text);
        } else {
            add(Weight::Good, format!("{figures}."));
        }
    }
    if report.print.scale.is_none() {
        let text = format!(
            "All distances scale with the print: measure both check bars of the sheet and set {PrintScale} to their \
             measured length divided by the nominal one. Focal lengths and distortion do not change if both bars have the \
             same scale error."
        );
        add(Weight::Hint, text);
    }
    found.sort_by_key(|advice| std::cmp::Reverse(advice.weight));
    found
}

impl Report<'_> {
    /// Returns the warnings about the number of views and their tilts, which are no diagnoses of the solution.
    pub fn view_warnings(&self) -> Vec<String> {
        let of_camera = |camera: &CameraEstimate| {
            let found = number_and_tilts(self, &Survey::new(camera)).into_iter();
            let warnings = found.filter(|piece| piece.weight == Weight::Warning);
            warnings.map(|piece| of_camera(self, camera, piece.text)).collect::<Vec<_>>()
        };
        let estimated = self.estimate.cameras.iter().filter(|camera| camera.model.is_some());
        estimated.flat_map(of_camera).collect()
    }

    /// Returns what to improve, the most important first: the warnings and hints of the page.
    pub fn remedies(&self) -> Vec<String> {
        let surveys: Vec<Survey> = self.estimate.cameras.iter().map(Survey::new).collect();
        let all = advice(self, &surveys).into_iter();
        all.filter(|piece| piece.weight != Weight::Good).map(|piece| piece.text).collect()
    }
}

/// A text about a camera, prefixed with its name if there are several cameras.
fn of_camera(report: &Report, camera: &CameraEstimate, text: String) -> String {
    // The text of a diagnosis names its camera.
    let named = format!("Camera {}", camera.name);
    match report.is_rig() && !text.starts_with(&named) {
        true => format!("{named}: {text}"),
        false => text,
    }
}

/// The topic of a diagnosis, which determines its position in the advice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Topic {
    /// The whole result, or anything without a more specific topic; comes first.
    Whole,
    /// The lens of a camera, by its index.
    Lens(usize),
    /// The parameters of a camera, by its index.
    Parameters(usize),
    /// Groups of corners that are outliers together.
    Errors,
    /// Causes of residuals that are not noise.
    Cause,
}

impl Topic {
    fn of(diagnosis: &Diagnosis) -> Self {
        match diagnosis {
            Diagnosis::NonMonotonicLens { camera, .. } => Self::Lens(*camera),
            Diagnosis::WrongConstraint { camera, .. }
            | Diagnosis::IllConditioned { camera, .. } => Self::Parameters(*camera),
            Diagnosis::CommonOutliers(_) => Self::Errors,
            Diagnosis::Remedied { .. }
            | Diagnosis::LackOfFit(_)
            | Diagnosis::PoorFit { .. }
            | Diagnosis::RollingShutter { .. }
            | Diagnosis::StretchedBoard { .. }
            | Diagnosis::SecondMinimum { .. } => Self::Cause,
            _ => Self::Whole,
        }
    }
}

/// Adds the diagnoses of a topic.
fn add_diagnoses(report: &Report, add: &mut impl FnMut(Weight, String), topic: Topic) {
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
    for Advice { weight, text } in number_and_tilts(report, survey) {
        add(weight, text);
    }
    left_out(report, add, |out| match &out.camera {
        Some(name) => *name == camera.name,
        None => !report.is_rig(),
    });
    let rms = camera.views.iter().map(|view| view.rms_px);
    let median = median(rms.collect()).unwrap_or_default();
    let limit_px = BAD_VIEW * median;
    let bad = camera.views.iter().filter(|view| view.rms_px > limit_px);
    // Photographs are not the cause if the lens model does not fit, or if the camera has a rolling shutter.
    let is_other = |said: &Diagnosis| match said {
        Diagnosis::RollingShutter { camera, .. } => *camera == index,
        _ => said.misfit_of() == Some(index),
    };
    if report.diagnoses.iter().any(is_other) {
        return;
    }
    let half_px = half_reach_px(camera);
    let (far, whole): (Vec<&ViewEstimate>, Vec<&ViewEstimate>) =
        bad.partition(|view| rms_within_px(camera, view, half_px) <= limit_px);
    let names = |views: &[&ViewEstimate]| {
        named(&views.iter().map(|view| view.name.as_str()).collect::<Vec<_>>())
    };
    let bent = if report.has_panels() { "a bent or loose panel" } else { "a bent board" };
    if !whole.is_empty() {
        let text = format!(
            "Views with much larger residuals than the others: {}. Check for motion blur, {bent}, or reflections.",
            names(&whole)
        );
        add(Weight::Hint, text);
    }
    if !far.is_empty() {
        let text = format!(
            "Views with much larger residuals than the others, but only far from the principal point: {}. The model may \
             not fit the lens there: try another one, for example {CalibrateModel} auto. If that does not help, check \
             for motion blur, {bent}, or reflections.",
            names(&far)
        );
        add(Weight::Hint, text);
    }
}

/// The distance from the principal point within which half of a camera's corners lie, px; 0 without corners.
fn half_reach_px(camera: &CameraEstimate) -> f64 {
    let corners = camera.views.iter().flat_map(|view| &view.corners);
    let reach = corners.map(|corner| corner.pixel.distance(camera.camera.centre_px));
    median(reach.collect()).unwrap_or_default()
}

/// The RMS residual per axis of the corners of a view within this distance from the principal point, px. 0 if all
/// its corners lie farther away; the RMS residual of the view if its corners are unknown.
fn rms_within_px(camera: &CameraEstimate, view: &ViewEstimate, reach_px: f64) -> f64 {
    if view.corners.is_empty() {
        return view.rms_px;
    }
    let is_within = |corner: &&Corner| corner.pixel.distance(camera.camera.centre_px) <= reach_px;
    let within = view.corners.iter().filter(is_within);
    let squares: Vec<f64> = within.map(|corner| corner.residual.length_squared()).collect();
    (squares.iter().sum::<f64>() / (2 * squares.len()).max(1) as f64).sqrt()
}

/// Adds a warning that lists the excluded views and panels.
fn left_out(
    report: &Report,
    add: &mut impl FnMut(Weight, String),
    is_meant: impl Fn(&Excluded) -> bool,
) {
    let excluded = report.estimate.excluded.iter().filter(|out| is_meant(out));
    let excluded: Vec<&str> = excluded.map(|out| out.view.as_str()).collect();
    if !excluded.is_empty() {
        let names = named(&excluded);
        let text = format!(
            "Excluded, because they are inconsistent with the other views or the target: {names}."
        );
        add(Weight::Warning, text);
    }
}

/// A list of names, shortened to the first three.
fn named(names: &[&str]) -> String {
    match names {
        [a, b, c, rest @ ..] if !rest.is_empty() => {
            format!("{a}, {b}, {c} and {} more", rest.len())
        }
        few => few.join(", "),
    }
}

/// The text as a sentence, with a capital letter and a full stop.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|letter| letter.to_ascii_uppercase());
    first.into_iter().chain(letters).chain(['.']).collect()
}

/// Advises a smaller model if the additional parameters are not significant.
fn superfluous(camera: &CameraEstimate, add: &mut impl FnMut(Weight, String)) {
    if let Some(model) = camera.model
        && let Some(smaller) = model.smaller()
    {
        // The parameters that the smaller model lacks.
        let there = smaller.free().into_iter().chain(std::iter::repeat(false));
        let more = model.free().into_iter().zip(there).zip(&camera.parameters);
        let more: Vec<_> =
            more.filter(|((here, there), _)| *here && !there).map(|(_, p)| p).collect();
        let weak = |p: &&Parameter| p.sd.is_some_and(|sd| p.value.abs() < SIGNIFICANT * sd);
        if more.iter().all(weak) {
            let names: Vec<&str> = more.iter().map(|p| p.name.as_str()).collect();
            let (verb, them) = if names.len() == 1 { ("does", "it") } else { ("do", "them") };
            let text = format!(
                "{} {verb} not differ significantly from zero: the simpler model {smaller}, without {them}, extrapolates \
                 more safely to regions without corners.",
                names.join(", ")
            );
            add(Weight::Hint, text);
        }
    }
}

fn correlated(camera: &CameraEstimate, add: &mut impl FnMut(Weight, String)) {
    // Neighbouring knots are always correlated.
    if matches!(camera.camera.lens, Lens::Spline(_)) {
        return;
    }
    let is_loose = |name: &str| camera.ill_conditioned.iter().any(|loose| loose == name);
    let names: Vec<&str> = camera.estimated_parameters().collect();
    let mut pairs = Vec::new();
    for i in 0..names.len() {
        for j in 0..i {
            let correlation = camera.correlation(i, j);
            // Square pixels couple the two focal lengths, which is harmless.
            let focal = [names[j], names[i]] == ["fx", "fy"];
            let is_reported = is_loose(names[i]) && is_loose(names[j]);
            if correlation.abs() > CORRELATED && !focal && !is_reported {
                pairs.push(format!("{} with {}", names[j], names[i]));
            }
        }
    }
    if !pairs.is_empty() {
        let more =
            if pairs.len() > 3 { format!(" and {} more", pairs.len() - 3) } else { String::new() };
        pairs.truncate(3);
        let text = format!(
            "Correlated beyond ±{CORRELATED}: {}{more}. Only their combination is determined, not the individual \
             values.",
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
                    "panels are bent or displaced from their poses in the target file",
                    CalibrationRefinePanels,
                ),
                false => ("the board is not flat", CalibrationBoardShape),
            };
            add(
                Weight::Hint,
                format!(
                    "Residuals show a pattern over the image, {pattern:.1} times larger than expected from noise, with an rms of \
                     {size:.3} px. It is smaller than the noise of a corner, but the model does not fully describe this lens, \
                     or {target}. Try a model with more parameters, or {remedy}."
                ),
            );
        }
        Some(_) => add(Weight::Good, "Residuals show no strong pattern over the image.".to_owned()),
        None => {}
    }
}

#[cfg(test)]
mod tests {
    use deltille_calibrate::Matrix;

    use super::*;
    use deltille_calibrate::{Estimate, LackOfFit, Model, PanelPrior};
    use deltille_core::camera::{Camera, Pose};

    /// The advice if no lens parameter differs significantly from zero.
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

    /// An estimate with the given numbers of cameras and panels, without views.
    fn estimate(cameras: usize, panels: usize) -> Estimate {
        let camera = |index: usize| {
            let camera = Camera::centred(640, 480, 500.0, Model::Radtan.lens());
            CameraEstimate::given(&format!("c{index}"), camera)
        };
        let place = PanelPrior { target_from_panel: Pose::IDENTITY, covariance: None };
        let mut estimate = Estimate::default();
        estimate.cameras = (0..cameras).map(camera).collect();
        estimate.panels = vec![place; panels];
        estimate
    }

    #[test]
    fn every_diagnosis_gives_exactly_one_warning() {
        let estimate = estimate(2, 1);
        let other = estimate.cameras[0].camera.clone();
        let diagnoses = [
            Diagnosis::WrongCamera { camera: 0, rms_px: 9.0 },
            Diagnosis::UnusableFit { camera: 1, rms_px: 9.0 },
            Diagnosis::ManyExcluded { excluded: 3, all: 9 },
            Diagnosis::DelayedCamera { camera: 1, frames: 2 },
            Diagnosis::SecondMinimum { camera: 0, other, rms_px: 0.1 },
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
            let same: Vec<&Advice> = found.iter().filter(|advice| advice.text == text).collect();
            assert_eq!(same.len(), 1, "{text}");
            assert_eq!(same[0].weight, Weight::Warning, "{text}");
        }
        // Diagnoses of the whole result come first.
        assert_eq!(found[3].text, sentence(&report.words().sentence(&diagnoses[3])), "{found:?}");
    }

    /// With the wrong lens model, some views have much larger residuals than others.
    #[test]
    fn photographs_are_not_blamed_for_a_wrong_model() {
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
            (Some(Diagnosis::UnusableFit { camera: 0, rms_px: 9.0 }), false),
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

    /// Residuals that are large only far from the principal point are due to the lens.
    #[test]
    fn photographs_are_not_blamed_for_residuals_that_grow_towards_the_rim() {
        for (large_beyond_px, is_of_lens) in [(150.0, true), (0.0, false)] {
            let mut estimate = estimate(1, 1);
            let view = |index: usize| {
                let corner = |radius: i32| {
                    let offset = glam::DVec2::new(10.0 * f64::from(radius), 0.0);
                    let is_large = index == 0 && offset.x > large_beyond_px;
                    Corner {
                        panel: deltille_calibrate::PanelRef::ONLY,
                        row: 0,
                        col: radius,
                        pixel: estimate.cameras[0].camera.centre_px + offset,
                        residual: glam::DVec2::new(0.0, if is_large { 2.0 } else { 0.1 }),
                        outlier: false,
                    }
                };
                let corners: Vec<Corner> = (0..30).map(corner).collect();
                let squares: f64 = corners.iter().map(|of| of.residual.length_squared()).sum();
                ViewEstimate {
                    name: format!("{index}"),
                    image: String::new(),
                    frame: index,
                    pose: Pose::IDENTITY,
                    rms_px: (squares / 60.0).sqrt(),
                    corners,
                }
            };
            estimate.cameras[0].views = (0..12).map(view).collect();
            let found =
                advice(&Report::new("camera", &estimate), &[Survey::new(&estimate.cameras[0])]);
            let said: Vec<&String> = found
                .iter()
                .map(|advice| &advice.text)
                .filter(|text| text.contains("much larger residuals"))
                .collect();
            let [said] = said[..] else { panic!("{said:?}") };
            assert_eq!(said.contains("may not fit the lens there"), is_of_lens, "{said}");
        }
    }

    #[test]
    fn only_targets_with_one_panel_are_called_boards() {
        for (panels, noun, other) in [(1, "board", "target"), (20, "target", "board")] {
            let estimate = estimate(1, panels);
            let report = Report::new("camera", &estimate);
            let surveys = [Survey::new(&estimate.cameras[0])];
            let found = advice(&report, &surveys);
            let texts: String = found.into_iter().map(|advice| advice.text + "\n").collect();
            assert!(texts.contains(&format!("move the {noun} to the empty cells")), "{texts}");
            assert!(!texts.contains(other), "{texts}");
        }
    }

    #[test]
    fn a_smaller_model_is_advised_if_one_exists() {
        for (model, text) in [
            (
                Model::Radtan5,
                "k3 does not differ significantly from zero: the simpler model radtan, without it,",
            ),
            (
                Model::Rational,
                "k4, k5, k6 do not differ significantly from zero: the simpler model radtan5, without",
            ),
            (
                Model::KannalaBrandt(5),
                "k5 does not differ significantly from zero: the simpler model kannala-brandt, ",
            ),
        ] {
            assert!(advised(model).contains(text), "{}", advised(model));
        }
        for model in [Model::Pupil, Model::Radtan, Model::KannalaBrandt(4)] {
            assert!(!advised(model).contains("from zero"), "{}", advised(model));
        }
    }
}
