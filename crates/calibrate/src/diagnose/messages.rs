//! Sentences of diagnoses, for the terminal, the report page and files.

use super::diagnosis::Diagnosis;
use super::model_selection::{Alternative, FOREIGN_PART, Remedy};
use super::one_state::{BoardStretch, CameraChange, ChangedIntrinsic, RollingShutter};
use crate::adjust::finding::{Finding, Moved, OutlierPattern};
use crate::adjust::lack_of_fit::LackOfFit;
use crate::estimate::target_map::MIN_VIEWS_TO_MEASURE;
use crate::estimate::values::Estimate;
use crate::input::panel::PanelRef;
use crate::model::Model;
use crate::start::symmetry::LabelRotation;
use deltille_core::camera::Camera;
use deltille_core::setting::Setting::{
    CalibrateModel, CalibrationBoardShape, CalibrationCompensatedForTiming,
    CalibrationMeasureTarget, CalibrationRefinePanels, SightingBend, SightingStretch,
};
use deltille_core::words::{counted, p_value, places};

/// Smallest rotation of a panel that a sentence mentions, degrees.
const TURNED_DEG: f64 = 0.05;

const GIVEN_CAMERA: &str = "the camera file belongs to another camera, or the camera has changed since (lens, focus, zoom, crop)";

/// Formats the diagnoses of an estimate as sentences, without initial capital and final full stop.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Messages<'a> {
    /// The diagnosed estimate.
    pub estimate: &'a Estimate,
    /// The measured print scale along x and y, if it was given.
    pub print_scale: Option<[f64; 2]>,
}

impl<'a> Messages<'a> {
    /// Creates the formatter for an estimate and its print scale, if one was given.
    pub fn new(estimate: &'a Estimate, print_scale: Option<[f64; 2]>) -> Self {
        Self { estimate, print_scale }
    }

    /// Returns the sentence of a diagnosis.
    pub fn sentence(&self, diagnosis: &Diagnosis) -> String {
        match diagnosis {
            Diagnosis::WrongCamera { camera, rms_px } => self.of_camera(
                *camera,
                format!(
                    "with this camera the residuals are {rms_px:.1} px RMS, more than {} % of the image width: \
                     the images come from another camera, or were taken with another lens, zoom or crop",
                    100.0 * FOREIGN_PART
                ),
            ),
            Diagnosis::UnusableFit { camera, rms_px } => {
                let text = match self.wrong_constraint(*camera) {
                    Some(cause) => format!(
                        "the calibration does not fit the views ({rms_px:.1} px RMS, more than {} % of the image width): \
                         {cause}, or the model or the labels are wrong",
                        100.0 * FOREIGN_PART
                    ),
                    None => does_not_fit(self.model(*camera), *rms_px),
                };
                self.of_camera(*camera, text)
            }
            Diagnosis::ManyExcluded { excluded, all } => self.many_excluded(*excluded, *all),
            Diagnosis::ManyPanelsExcluded { excluded, all } => format!(
                "{excluded} of {all} corners (more than a fifth) were excluded with their panels, so the \
                 result depends only on the others; the size or the labels of a board differ from its description: measure an edge of \
                 each board"
            ),
            Diagnosis::SecondMinimum { camera, other, rms_px } => self.second_minimum(*camera, other, *rms_px),
            Diagnosis::DelayedCamera { camera, frames } => self.late(*camera, *frames),
            Diagnosis::LabelsRotated { camera, rotation } => self.labels_rotated(*camera, rotation),
            Diagnosis::AmbiguousLabels { degrees } => format!(
                "the board has no tags and looks the same after a rotation by {degrees}°: its estimated corners or shape \
                 are correct only if it had the same orientation in all views"
            ),
            Diagnosis::ChangedCamera { camera, change } => {
                self.of_camera(*camera, changed(change))
            }
            Diagnosis::RollingShutter { camera, shutter } => {
                let views = self.estimate.cameras.get(*camera).map_or(0, |of| of.views.len());
                let is_compensated = self.estimate.is_compensated;
                self.of_camera(*camera, rolling_shutter(shutter, views, is_compensated))
            }
            Diagnosis::StretchedBoard { stretch, .. } => stretched(stretch),
            Diagnosis::NonMonotonicLens { camera, end } => self.of_camera(*camera, end.to_string()),
            Diagnosis::CommonOutliers(finding) => self.finding(finding),
            Diagnosis::Remedied { camera, remedy } => self.remedied(*camera, remedy),
            Diagnosis::LackOfFit(misfit) => self.lack_of_fit(misfit),
            Diagnosis::PoorFit { camera, rms_px } => {
                let cause = self.wrong_constraint(*camera);
                let cause = cause.map_or(String::new(), |cause| cause + ", or ");
                let lens = other_lens(self.model(*camera));
                let text =
                    format!("residuals are {rms_px:.1} px RMS: {cause}{lens}, or the labels are wrong");
                self.of_camera(*camera, text)
            }
            Diagnosis::WrongConstraint { camera, constraint, deviations } => self.of_camera(
                *camera,
                format!(
                    "the views contradict the constraint {constraint}: without it, the estimate differs by {deviations:.1} \
                     standard deviations; the value or its standard deviation is wrong, or the lens or the board does not \
                     fit its description"
                ),
            ),
            Diagnosis::IllConditioned { camera, parameters, sufficient } => {
                let mut text = ill_conditioned(parameters, *sufficient);
                if let Some(cause) = self.wrong_constraint(*camera) {
                    text += &format!(". They may compensate for an error: check whether {cause}");
                }
                self.of_camera(*camera, text)
            }
        }
    }

    fn many_excluded(&self, excluded: usize, all: usize) -> String {
        let (what, lens) = match self.estimate.cameras.as_slice() {
            [only] => ("views", other_lens(only.model)),
            _ => ("frames", "a camera moved, or images were not taken at the same time".to_owned()),
        };
        format!(
            "{excluded} of {all} {what} (more than a fifth) were excluded, so the result depends only on the \
             others: {lens}, or the labels of the excluded {what} are wrong"
        )
    }

    fn late(&self, camera: usize, frames: i32) -> String {
        let count = counted(frames.unsigned_abs() as usize, "frame");
        let lags = if frames > 0 { "lags" } else { "leads" };
        format!(
            "camera {} {lags} by {count}; its frames were re-paired. Fix the trigger or the file numbering before \
             using the rig",
            self.estimate.cameras[camera].name
        )
    }

    fn labels_rotated(&self, camera: usize, rotation: &LabelRotation) -> String {
        let LabelRotation { degrees, frames, of, is_confirmed } = *rotation;
        let name = &self.estimate.cameras[camera].name;
        let board =
            format!("the board has no tags and looks the same after a rotation by {degrees}°");
        let labels = match frames {
            0 => "were kept as detected".to_owned(),
            _ => format!("were rotated in {frames} of {}", counted(of, "frame")),
        };
        match is_confirmed {
            true => format!(
                "camera {name}: {board}; its labels {labels}, because only then do the cameras agree on the pose of \
                 the board"
            ),
            false => format!(
                "camera {name}: {board}; its labels {labels}, but another rotation fits equally well, so the relative \
                 poses of the cameras may be wrong; tilt the board about different axes, or use one with tags"
            ),
        }
    }

    fn second_minimum(&self, camera: usize, other: &Camera, rms_px: f64) -> String {
        let found = &self.estimate.cameras[camera];
        let focal = |of: &Camera| of.focal_px.x;
        let text = format!(
            "the cost has a second minimum that fits the views almost equally well: fx {:.1} px leaves {rms_px:.4} px RMS, \
             fx {:.1} px leaves {:.4} px; standard deviations describe one minimum only, and individual lens \
             parameters are not meaningful on their own; use another model",
            focal(other),
            focal(&found.camera),
            found.inlier_rms_px()
        );
        self.of_camera(camera, text)
    }

    /// Returns the sentence of a finding: the panel, view, region or camera that outliers have in common.
    pub fn finding(&self, finding: &Finding) -> String {
        let Finding { pattern, outliers, corners, is_excluded } = finding;
        let of = |camera: &usize, what: String| match self.estimate.camera_name(*camera) {
            Some(name) => format!("camera {name}, {what}"),
            None => what,
        };
        let count = match outliers {
            1 => format!("1 of {} is an outlier", counted(*corners, "corner")),
            n => format!("{n} of {} are outliers", counted(*corners, "corner")),
        };
        let text = match pattern {
            OutlierPattern::OutsideImage { camera, view } => {
                let corners = counted(*corners, "corner");
                let who = of(camera, format!("view {view}"));
                return format!("{who}: {outliers} of {corners} far outside the image; excluded");
            }
            OutlierPattern::Panel { panel, moved } => {
                format!("panel {panel}: {count}: {}", moved_panel(moved.as_ref()))
            }
            OutlierPattern::PanelInView { panel, camera, view, off_px } => {
                let who = of(camera, format!("view {view}, panel {panel}"));
                format!(
                    "{who}: its corners are off by {off_px:.1} px, while the rest of the view fits: wrong labels, \
                     or the size of this or another board differs from its description"
                )
            }
            OutlierPattern::View { camera, view } => {
                format!("{}: {count}: inspect the image", of(camera, format!("view {view}")))
            }
            OutlierPattern::Region { camera, from_px: from, to_px: to } => {
                let where_ =
                    format!("x {:.0} to {:.0}, y {:.0} to {:.0} px", from.x, to.x, from.y, to.y);
                format!(
                    "{}: {count}, in several views: the model does not fit the lens there, or an object \
                     occludes the target",
                    of(camera, where_)
                )
            }
            OutlierPattern::Corner { panel, row, col, rms_px, is_held_out } => {
                let views = if *is_held_out { " in held-out views" } else { "" };
                let who = self.corner(*panel, *row, *col);
                let count = format!("{outliers} of {}", counted(*corners, "observation"));
                if *is_excluded {
                    return format!(
                        "{who}: not measured, because most of its observations are outliers ({count}, {rms_px:.3} px \
                         RMS) or fewer than two are usable: it keeps its planned position"
                    );
                }
                format!(
                    "{who}: {count}{views} are outliers ({rms_px:.3} px RMS), more than of other corners: the corner is \
                     damaged or covered, or only it reaches a part of the image in which the model does not fit the lens"
                )
            }
            OutlierPattern::Offset { panel, row, col, offset_mm } => {
                let usual = self.estimate.map.as_ref().map_or(0.0, |map| map.expected_mm[0]);
                format!(
                    "{}: displaced by {offset_mm:.3} mm, more than the {usual:.3} mm of the other corners explain: inspect \
                     the print there",
                    self.corner(*panel, *row, *col)
                )
            }
            OutlierPattern::Camera { camera } => {
                format!("{}: {count}", of(camera, "all views".to_owned()))
            }
        };
        if *is_excluded { text + "; excluded" } else { text }
    }

    /// The name of a corner of the target.
    fn corner(&self, panel: PanelRef, row: i32, col: i32) -> String {
        let of_panel = match self.estimate.panels.len() {
            1 => String::new(),
            _ => format!("panel {panel}, "),
        };
        format!("{of_panel}corner in row {row}, column {col}")
    }

    /// The constraints of a camera as a cause; `None` without any.
    fn wrong_constraint(&self, camera: usize) -> Option<String> {
        let constraints = self.estimate.cameras.get(camera)?.described_constraints()?;
        Some(format!("a constraint is wrong ({constraints})"))
    }

    fn remedied(&self, camera: usize, remedy: &Remedy) -> String {
        let Remedy { alternative, from_px, to_px, excluded_views } = remedy;
        let model = self.model(camera);
        let (cause, found) = match *alternative {
            Alternative::Shape => {
                (self.board(model), "estimating the shape of the board".to_owned())
            }
            Alternative::Panels => {
                (self.moved_panels(None), "estimating the pose of every panel".to_owned())
            }
            Alternative::Camera => {
                (GIVEN_CAMERA.to_owned(), "estimating the intrinsics".to_owned())
            }
            Alternative::Constraints => (
                self.wrong_constraint(camera).unwrap_or_default(),
                "estimating the parameters without constraints".to_owned(),
            ),
            Alternative::Model(other) => (
                match model {
                    Some(model) => {
                        format!("`{model}` does not fit the lens: use {CalibrateModel} {other}")
                    }
                    None => GIVEN_CAMERA.to_owned(),
                },
                format!("the model `{other}`"),
            ),
        };
        if *excluded_views > 0 {
            let views = counted(*excluded_views, "excluded view");
            let text =
                format!("{found} fits {views} as well as the others ({to_px:.3} px RMS): {cause}");
            return self.of_camera(camera, text);
        }
        self.of_camera(
            camera,
            format!("{found} lowers the residuals from {from_px:.3} to {to_px:.3} px RMS: {cause}"),
        )
    }

    fn lack_of_fit(&self, misfit: &LackOfFit) -> String {
        match *misfit {
            LackOfFit::Lens { camera, rms_px } => {
                let lens = other_lens(self.model(camera));
                let text = format!(
                    "residuals vary systematically over the image, by {rms_px:.3} px RMS: {lens}"
                );
                self.of_camera(camera, text)
            }
            LackOfFit::Target { rms_px, rms_mm, panel } => {
                let board = self.board_among_targets(panel);
                let (where_, cause) = match board {
                    Some(name) => (
                        format!("target {name}"),
                        "the size or the labels of its board or of another target's board differ from the \
                         description, or the board is not flat, or its print does not match the description: measure an edge of \
                         each board"
                            .to_owned(),
                    ),
                    None if self.is_solid() => {
                        ("the target".to_owned(), self.moved_panels(Some(panel)))
                    }
                    None => ("the target".to_owned(), self.board(self.model(0))),
                };
                format!(
                    "corners on {where_} are displaced by {rms_mm:.2} mm RMS ({rms_px:.3} px), the same way in \
                     all views: {cause}"
                )
            }
        }
    }

    fn moved_panels(&self, most: Option<PanelRef>) -> String {
        let most = most.map_or(String::new(), |panel| format!(", especially panel {panel}"));
        if self.estimate.has_refined_panels() {
            return format!(
                "panels are not flat, or the print does not match the description{most}"
            );
        }
        format!(
            "panels are displaced from their poses in the target file{most}: {CalibrationRefinePanels} estimates \
             their poses"
        )
    }

    fn board(&self, model: Option<Model>) -> String {
        let scale = match self.print_scale {
            // A scale that is equal along x and y leaves no residuals.
            Some([across, up]) if across != up => {
                format!(
                    "the print scale {across:.4},{up:.4} ({SightingStretch}) does not match the print, or "
                )
            }
            _ => String::new(),
        };
        let bars = match self.print_scale {
            Some(_) => "measure its check bars again".to_owned(),
            None => format!("measure its check bars for {SightingStretch}"),
        };
        let measuring = self.measuring();
        match (self.estimate.shape, model) {
            _ if self.estimate.map.is_some() => format!(
                "{scale}the board changed its shape between views: glue it to a flat surface, and {bars}"
            ),
            (Some(_), _) => format!(
                "{scale}the shape of the board is more complex than {CalibrationBoardShape} describes, or changed its \
                 shape between views: {measuring}, glue the board to a flat surface, or {bars}"
            ),
            (None, Some(_)) => format!(
                "{scale}the board is not flat, or the print does not match the description: try \
                 {CalibrationBoardShape}, {measuring}, or {bars}"
            ),
            (None, None) => format!(
                "{scale}the board is not flat, or the print does not match the description, or the camera file belongs to another camera: \
                 estimate the shape in a calibration with {CalibrationBoardShape} and pass it with \
                 {SightingBend}, or {bars}"
            ),
        }
    }

    /// Advice to measure the position of every corner, or to take more views first.
    fn measuring(&self) -> String {
        match self.estimate.views_of_a_corner() {
            views if views >= MIN_VIEWS_TO_MEASURE => {
                format!("measure the position of every corner with {CalibrationMeasureTarget}")
            }
            views => format!(
                "take at least {MIN_VIEWS_TO_MEASURE} views of every corner (now {views}) to measure their positions \
                 with {CalibrationMeasureTarget}"
            ),
        }
    }

    /// The name of the target that consists of this panel only, if there are several targets. Such a target has no
    /// panels that could have moved.
    fn board_among_targets(&self, panel: PanelRef) -> Option<&str> {
        let targets = &self.estimate.targets;
        let of_panel = targets.iter().find(|target| target.panels.contains(&panel.index()))?;
        (targets.len() > 1 && of_panel.panels.len() == 1).then_some(of_panel.name.as_str())
    }

    /// Whether a view shows several panels, fixed to each other.
    fn is_solid(&self) -> bool {
        let views = self.estimate.cameras.iter().flat_map(|camera| &camera.views);
        views.into_iter().any(|view| {
            let mut panels = view.corners.iter().map(|corner| corner.panel);
            let first = panels.next();
            panels.any(|panel| Some(panel) != first)
        })
    }

    fn model(&self, camera: usize) -> Option<Model> {
        self.estimate.cameras.get(camera)?.model
    }

    fn of_camera(&self, camera: usize, text: String) -> String {
        match self.estimate.camera_name(camera) {
            Some(name) => format!("camera {name}: {text}"),
            None => text,
        }
    }
}

/// Cause of outliers on a panel, which a displacement may explain.
fn moved_panel(moved: Option<&Moved>) -> String {
    let Some(Moved { by_mm, rotation_rad }) = moved else {
        return "no pose of the panel explains them: wrong labels, a sheet that is not flat, or a different print"
            .to_owned();
    };
    let degrees = rotation_rad.to_degrees();
    let turned = match degrees >= TURNED_DEG {
        true => format!(" and rotated by {degrees:.1}°"),
        false => String::new(),
    };
    format!(
        "the panel seems displaced by {by_mm:.2} mm{turned} from its pose in the target file ({CalibrationRefinePanels} \
         estimates the poses of panels)"
    )
}

/// Sentence for a model that does not fit the lens at all.
fn does_not_fit(model: Option<Model>, rms_px: f64) -> String {
    let of = model.map_or(String::new(), |model| format!("{model}, "));
    let richer = model.map_or(&[] as &[Model], Model::richer).iter().copied();
    // A fisheye often has a pupil that moves with the angle.
    let fisheye = model.filter(|model| model.is_perspective()).map(|_| Model::Pupil);
    let others: Vec<String> = richer.chain(fisheye).map(|model| model.to_string()).collect();
    let advice = match others.as_slice() {
        [] => "no richer model is available".to_owned(),
        others => format!("try {CalibrateModel} {}", others.join(" or ")),
    };
    format!(
        "the model does not fit the lens ({of}{rms_px:.1} px RMS, more than {} % of the image width): {advice}; or \
         the labels are wrong",
        100.0 * FOREIGN_PART
    )
}

/// Advice for a principal point that moved.
const STABILISATION: &str = "switch off image stabilisation and secure the lens";

fn changed(change: &CameraChange) -> String {
    let CameraChange {
        intrinsic,
        from_view,
        views: [before, after],
        value_px: [first, second],
        sd_px,
        ..
    } = change;
    let digits = places(*sd_px).clamp(1, 3);
    let (what, lock) = match intrinsic {
        ChangedIntrinsic::Focal => ("the focal length", "lock zoom and focus"),
        ChangedIntrinsic::CentreX => ("the principal point in x", STABILISATION),
        ChangedIntrinsic::CentreY => ("the principal point in y", STABILISATION),
    };
    format!(
        "the camera changed between views: {what} is {first:.digits$} px in the first {before} views and \
         {second:.digits$} px in the {after} views from {from_view} on, a difference of {:.digits$} ± \
         {sd_px:.digits$} px ({}); the result fits neither group: {lock}, and calibrate each group separately",
        second - first,
        p_value(change.significance)
    )
}

fn rolling_shutter(shutter: &RollingShutter, all: usize, is_compensated: bool) -> String {
    let RollingShutter { shear_px, views, significance, left_px } = shutter;
    let cause = match is_compensated {
        true => "after compensation for the readout: the target does not move smoothly between frames; move it without jerks, \
                 or record more frames per second"
            .to_owned(),
        false => format!(
            "because the board or the camera moved during readout; keep both still for each image, use a camera with a global \
             shutter, or calibrate from all frames of a recording with {CalibrationCompensatedForTiming}"
        ),
    };
    format!(
        "rolling shutter: rows are displaced by {shear_px:.1} px between the first and the last, in {views} of {all} \
         views ({}; modelling it leaves {left_px:.3} px RMS), {cause}",
        p_value(*significance)
    )
}

fn stretched(stretch: &BoardStretch) -> String {
    let BoardStretch { ratio, sd, significance, .. } = *stretch;
    let (along, other, ratio) = match ratio > 1.0 {
        true => ("its rows (x)", "its columns (y)", ratio),
        false => ("its columns (y)", "its rows (x)", ratio.recip()),
    };
    let digits = places(100.0 * sd).clamp(1, 3);
    format!(
        "relative to its description, the board is {:.digits$} ± {:.digits$} % longer along {along} than along {other} \
         ({}): it is another board, its tiles have two different edge lengths, or the print was scaled to fit the \
         page; correct the description, or measure both check bars for {SightingStretch}",
        100.0 * (ratio - 1.0),
        100.0 * sd,
        p_value(significance)
    )
}

/// Sentence for ill-conditioned parameters; `sufficient` is a smaller model that fits the lens equally well.
fn ill_conditioned(parameters: &[String], sufficient: Option<Model>) -> String {
    let advice = match sufficient {
        Some(model) => format!("use {CalibrateModel} {model}, which fits this lens equally well"),
        None => "place the board in the four corners of the image, or choose a model with fewer \
                 parameters"
            .to_owned(),
    };
    format!(
        "the views do not distinguish {} (ill-conditioned): their individual values are not meaningful; \
         projections are accurate where corners were detected, but may be wrong elsewhere; {advice}",
        parameters.join(", ")
    )
}

fn other_lens(model: Option<Model>) -> String {
    let Some(model) = model else {
        return GIVEN_CAMERA.to_owned();
    };
    match model.richer().iter().map(|model| format!("`{model}`")).collect::<Vec<_>>().as_slice() {
        [] => format!("`{model}` does not fit the lens, and no richer model is available"),
        models => {
            format!("`{model}` does not fit the lens: try {CalibrateModel} {}", models.join(" or "))
        }
    }
}
