//! Diagnoses in words, for a terminal, a page and a file.

use super::diagnosis::Diagnosis;
use super::model_selection::{FOREIGN_PART, Instead, Remedy};
use super::one_state::{BoardStretch, CameraChange, ChangedIntrinsic, RollingShutter};
use crate::adjust::finding::{Finding, Moved, Shared};
use crate::adjust::lack_of_fit::LackOfFit;
use crate::estimate::target_map::LEAST_TO_MEASURE;
use crate::estimate::values::Estimate;
use crate::input::panel::PanelRef;
use crate::model::Model;
use crate::start::symmetry::LabelRotation;
use deltille_core::camera::Camera;
use deltille_core::setting::Setting::{
    CalibrateModel, CalibrationBoardShape, CalibrationMeasureTarget, CalibrationRefinePanels,
    SightingBend, SightingStretch,
};
use deltille_core::words::{counted, p_value, places};

/// A panel that is turned by less looks only moved.
const TURNED_DEG: f64 = 0.05;

const GIVEN_CAMERA: &str =
    "the camera that was given is another one, or has changed since (lens, focus, zoom, crop)";

/// Tells what is to be said about an estimate, in sentences without capital and full stop.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Words<'a> {
    /// What it is said about.
    pub estimate: &'a Estimate,
    /// How the print came out, where that was given.
    pub print_scale: Option<[f64; 2]>,
}

impl<'a> Words<'a> {
    /// What is to be said about an estimate, of a print that came out like this where that was given.
    pub fn new(estimate: &'a Estimate, print_scale: Option<[f64; 2]>) -> Self {
        Self { estimate, print_scale }
    }

    /// A diagnosis.
    pub fn sentence(&self, diagnosis: &Diagnosis) -> String {
        match diagnosis {
            Diagnosis::ForeignCamera { camera, rms_px } => self.of_camera(
                *camera,
                format!(
                    "with this camera corners are off by {rms_px:.1} px, more than {} % of the image's \
                     width: it did not take these pictures, or not with this lens, zoom or crop",
                    100.0 * FOREIGN_PART
                ),
            ),
            Diagnosis::AbsurdFit { camera, rms_px } => self.of_camera(
                *camera,
                does_not_fit(self.model(*camera), *rms_px),
            ),
            Diagnosis::ManyLeftOut { left_out, all } => self.many_left_out(*left_out, *all),
            Diagnosis::ManyPanelsLeftOut { left_out, all } => format!(
                "{left_out} of {all} corners were left out with their panels, more than a fifth: what was found is that \
                 of the others only; a board has another size or other labels than its description states: measure an \
                 edge of each"
            ),
            Diagnosis::OtherMinimum { camera, other, rms_px } => self.other_minimum(*camera, other, *rms_px),
            Diagnosis::Late { camera, frames } => self.late(*camera, *frames),
            Diagnosis::LabelsRotated { camera, rotation } => self.labels_rotated(*camera, rotation),
            Diagnosis::LabelsOpen { degrees } => format!(
                "the board has no tags and looks the same after a rotation by {degrees}°: what was found of its corners or \
                 its shape is right only if it was the same way round in all views"
            ),
            Diagnosis::ChangedCamera { camera, change } => {
                self.of_camera(*camera, changed(change))
            }
            Diagnosis::RollingShutter { camera, shutter } => {
                let views = self.estimate.cameras.get(*camera).map_or(0, |of| of.views.len());
                self.of_camera(*camera, rolling_shutter(shutter, views))
            }
            Diagnosis::StretchedBoard { stretch, .. } => stretched(stretch),
            Diagnosis::LensEnds { camera, end } => self.of_camera(*camera, end.to_string()),
            Diagnosis::GrossErrors(finding) => self.finding(finding),
            Diagnosis::Remedied { camera, remedy } => self.remedied(*camera, remedy),
            Diagnosis::LackOfFit(misfit) => self.lack_of_fit(misfit),
            Diagnosis::PoorFit { camera, rms_px } => self.of_camera(
                *camera,
                format!(
                    "corners are off by {rms_px:.1} px: {}, or labels are wrong",
                    other_lens(self.model(*camera))
                ),
            ),
            Diagnosis::IllConditioned { camera, parameters, sufficient } => {
                self.of_camera(*camera, cannot_tell_apart(parameters, *sufficient))
            }
        }
    }

    fn many_left_out(&self, left_out: usize, all: usize) -> String {
        let (what, lens) = match self.estimate.cameras.as_slice() {
            [only] => ("views", other_lens(only.model)),
            _ => ("frames", "a camera was moved, or pictures are not of one moment".to_owned()),
        };
        format!(
            "{left_out} of {all} {what} were left out, more than a fifth: what was found is that of the \
             others only; {lens}, or labels are wrong in so many"
        )
    }

    fn late(&self, camera: usize, frames: i32) -> String {
        let count = counted(frames.unsigned_abs() as usize, "frame");
        let (is, before) = match frames > 0 {
            true => ("late", "earlier"),
            false => ("ahead", "later"),
        };
        format!(
            "camera {} is {count} {is}: its pictures show what those of the others show {count} {before}, and were \
             put to these; mend the trigger or the numbering before the rig is used",
            self.estimate.cameras[camera].name
        )
    }

    fn labels_rotated(&self, camera: usize, rotation: &LabelRotation) -> String {
        let LabelRotation { degrees, frames, of, is_sure } = *rotation;
        let name = &self.estimate.cameras[camera].name;
        let board =
            format!("a board without tags that looks the same after a rotation by {degrees}°");
        let labels = match frames {
            0 => "were kept as detected".to_owned(),
            _ => format!("were rotated in {frames} of {}", counted(of, "frame")),
        };
        match is_sure {
            true => format!(
                "camera {name}: its labels of {board} {labels}: only so do the cameras agree on where the board is"
            ),
            false => format!(
                "camera {name}: its labels of {board} {labels}, but rotated otherwise they fit as well: the poses \
                 between the cameras may be wrong; tilt the board about different axes, or take one with tags"
            ),
        }
    }

    fn other_minimum(&self, camera: usize, other: &Camera, rms_px: f64) -> String {
        let found = &self.estimate.cameras[camera];
        let focal = |of: &Camera| of.focal_px.x;
        let text = format!(
            "another camera of the model explains the views nearly as well: fx {:.1} px leaves {rms_px:.4} px, fx \
             {:.1} px {:.4} px: a deviation is that around one of the two; parameters of the lens mean nothing by \
             themselves, take a model without a second minimum",
            focal(other),
            focal(&found.camera),
            found.inlier_rms_px()
        );
        self.of_camera(camera, text)
    }

    /// What outliers share.
    pub fn finding(&self, finding: &Finding) -> String {
        let Finding { shared, outliers, corners, left_out } = finding;
        let of = |camera: &usize, what: String| match self.estimate.camera_name(*camera) {
            Some(name) => format!("camera {name}, {what}"),
            None => what,
        };
        let count = match outliers {
            1 => format!("1 of {} is an outlier", counted(*corners, "corner")),
            n => format!("{n} of {} are outliers", counted(*corners, "corner")),
        };
        let text = match shared {
            Shared::Beyond { camera, view } => {
                let far = counted(*outliers, "corner");
                let who = of(camera, format!("view {view}"));
                return format!("{who}: {far} of {corners} far outside the picture, left out");
            }
            Shared::Panel { panel, moved } => {
                let why = match moved {
                    Some(Moved { by_mm, turned_rad }) => {
                        let degrees = turned_rad.to_degrees();
                        let turned = match degrees >= TURNED_DEG {
                            true => format!(" and turned by {degrees:.1}°"),
                            false => String::new(),
                        };
                        format!(
                            "it seems displaced by {by_mm:.2} mm{turned} from where the target's file has \
                             it ({CalibrationRefinePanels} finds where panels are)"
                        )
                    }
                    None => {
                        "no place of it explains them: wrong labels, a sheet that is not flat, or \
                             another print"
                            .to_owned()
                    }
                };
                format!("panel {panel}: {count}: {why}")
            }
            Shared::PanelInView { panel, camera, view, off_px } => {
                let who = of(camera, format!("view {view}, panel {panel}"));
                format!(
                    "{who}: its corners are off by {off_px:.1} px where the view's others fit: wrong labels, or \
                     it or another board has another size than its description states"
                )
            }
            Shared::View { camera, view } => {
                format!("{}: {count}: look at the picture", of(camera, format!("view {view}")))
            }
            Shared::Region { camera, from_px: from, to_px: to } => {
                let where_ =
                    format!("x {:.0} to {:.0}, y {:.0} to {:.0} px", from.x, to.x, from.y, to.y);
                format!(
                    "{}: {count}, in several views: the lens is not one of the model there, or \
                     something is before it",
                    of(camera, where_)
                )
            }
            Shared::Camera { camera } => {
                format!("{}: {count}", of(camera, "all views".to_owned()))
            }
        };
        if *left_out { text + "; left out" } else { text }
    }

    fn remedied(&self, camera: usize, Remedy { instead, from_px, to_px }: &Remedy) -> String {
        let model = self.model(camera);
        let (cause, found) = match *instead {
            Instead::Shape => (self.board(model), "the shape of the board".to_owned()),
            Instead::Panels => (self.moved_panels(None), "the place of every panel".to_owned()),
            Instead::Camera => (GIVEN_CAMERA.to_owned(), "the camera".to_owned()),
            Instead::Model(other) => (
                match model {
                    Some(model) => {
                        format!("the lens is not one of `{model}`: take {CalibrateModel} {other}")
                    }
                    None => GIVEN_CAMERA.to_owned(),
                },
                format!("a lens of `{other}`"),
            ),
        };
        self.of_camera(
            camera,
            format!(
                "corners are off by {from_px:.3} px, and by {to_px:.3} px where {found} is found: {cause}"
            ),
        )
    }

    fn lack_of_fit(&self, misfit: &LackOfFit) -> String {
        match *misfit {
            LackOfFit::Lens { camera, rms_px } => {
                let lens = other_lens(self.model(camera));
                let text =
                    format!("residuals leave a pattern of {rms_px:.3} px over the image: {lens}");
                self.of_camera(camera, text)
            }
            LackOfFit::Target { rms_px, rms_mm, panel } => {
                let board = self.board_among_targets(panel);
                let (where_, cause) = match board {
                    Some(name) => (
                        format!("target {name}"),
                        "its board, or that of another target, has another size or other labels than its \
                         description states, is not flat or not printed as stated: measure an edge of each"
                            .to_owned(),
                    ),
                    None if self.is_solid() => {
                        ("the target".to_owned(), self.moved_panels(Some(panel)))
                    }
                    None => ("the target".to_owned(), self.board(self.model(0))),
                };
                format!(
                    "corners lie {rms_mm:.2} mm beside their places on {where_}, in all views alike \
                     ({rms_px:.3} px): {cause}"
                )
            }
        }
    }

    fn moved_panels(&self, most: Option<PanelRef>) -> String {
        let most = most.map_or(String::new(), |panel| format!(", most of all panel {panel}"));
        if self.estimate.has_refined_panels() {
            return format!("panels are not flat or not printed as stated{most}");
        }
        format!(
            "panels are not where the target's file has them{most}: {CalibrationRefinePanels} finds \
             where they are"
        )
    }

    fn board(&self, model: Option<Model>) -> String {
        let scale = match self.print_scale {
            // The same scale both ways leaves nothing behind.
            Some([across, up]) if across != up => {
                format!("{SightingStretch} {across},{up} is not how it was printed, or ")
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
                "{scale}the board is not the same in all views: glue it on something flat, {bars}"
            ),
            (Some(_), _) => format!(
                "{scale}the board is bent in more ways than {CalibrationBoardShape} describes, or not \
                 the same in all views: {measuring}, glue it on something flat, {bars}"
            ),
            (None, Some(_)) => format!(
                "{scale}the board is not flat or not printed as stated: try \
                 {CalibrationBoardShape}, {measuring}, {bars}"
            ),
            (None, None) => format!(
                "{scale}the board is not flat or not printed as stated, or the camera that was given is \
                 another one: find its shape by a calibration with {CalibrationBoardShape}, \
                 and give it by {SightingBend}, {bars}"
            ),
        }
    }

    /// Whether there are views enough to find the place of every corner.
    fn measuring(&self) -> String {
        match self.estimate.views_of_a_corner() {
            views if views >= LEAST_TO_MEASURE => {
                format!("find the place of every corner by {CalibrationMeasureTarget}")
            }
            views => format!(
                "take at least {LEAST_TO_MEASURE} views of every corner, not {views}, to find their places by \
                 {CalibrationMeasureTarget}"
            ),
        }
    }

    /// The name of one of several targets that has this panel only, so that nothing moves on it.
    fn board_among_targets(&self, panel: PanelRef) -> Option<&str> {
        let targets = &self.estimate.targets;
        let of_panel = targets.iter().find(|target| target.panels.contains(&panel.index()))?;
        (targets.len() > 1 && of_panel.panels.len() == 1).then_some(of_panel.name.as_str())
    }

    /// Whether views show several panels, fixed to each other.
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

/// A camera of a model that does not fit the lens at all.
fn does_not_fit(model: Option<Model>, rms_px: f64) -> String {
    let of = model.map_or(String::new(), |model| format!("{model}, "));
    let richer = model.map_or(&[] as &[Model], Model::richer).iter().copied();
    // A lens of the other kind has a pupil that moves as often as not.
    let fisheye = model.filter(|model| model.is_perspective()).map(|_| Model::Pupil);
    let others: Vec<String> = richer.chain(fisheye).map(|model| model.to_string()).collect();
    let advice = match others.as_slice() {
        [] => "none of the richer models here does".to_owned(),
        others => format!("try {CalibrateModel} {}", others.join(" or ")),
    };
    format!(
        "the model does not fit the lens ({of}{rms_px:.1} px, more than {} % of the image's width): {advice}; or \
         labels are wrong",
        100.0 * FOREIGN_PART
    )
}

/// What keeps the principal point where it is.
const STABILISATION: &str = "switch image stabilisation off and fix the lens";

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
        "the views do not show one camera: {what} is {first:.digits$} px in the first {before} views and \
         {second:.digits$} px in the {after} from {from_view} on, a difference of {:.digits$} ± {sd_px:.digits$} px \
         ({}); what was found is neither: {lock}, and calibrate each group of views by itself",
        second - first,
        p_value(change.significance)
    )
}

fn rolling_shutter(shutter: &RollingShutter, all: usize) -> String {
    let RollingShutter { shear_px, views, significance, left_px } = shutter;
    format!(
        "rows are displaced against each other, by {shear_px:.1} px from the first to the last one, in {views} of {all} \
         views ({}; {left_px:.3} px are left where that is allowed for): the shutter reads row by row while board or \
         camera move; hold both still for each picture, or take a camera with a global shutter",
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
        "the board is {:.digits$} ± {:.digits$} % longer along {along} than described, compared with {other} ({}): it \
         is another board, its tiles have two different edges, or the print was fitted to its page; correct the \
         description, or measure both check bars for {SightingStretch}",
        100.0 * (ratio - 1.0),
        100.0 * sd,
        p_value(significance)
    )
}

/// What follows from parameters that the views leave open; `sufficient` is a smaller model that holds
/// the lens as well.
fn cannot_tell_apart(parameters: &[String], sufficient: Option<Model>) -> String {
    let advice = match sufficient {
        Some(model) => format!("take {CalibrateModel} {model}, which holds this lens as well"),
        None => "fill the corners of the image, or choose a model with fewer parameters".to_owned(),
    };
    format!(
        "the views cannot tell apart {}: their numbers mean nothing by themselves; where corners were \
         seen the camera is right, beyond them it may not be; {advice}",
        parameters.join(", ")
    )
}

fn other_lens(model: Option<Model>) -> String {
    let Some(model) = model else {
        return GIVEN_CAMERA.to_owned();
    };
    match model.richer().iter().map(|model| format!("`{model}`")).collect::<Vec<_>>().as_slice() {
        [] => format!("the lens is not one of `{model}`, nor of any richer model here"),
        models => format!(
            "the lens is not one of `{model}`: try {CalibrateModel} {}",
            models.join(" or ")
        ),
    }
}
