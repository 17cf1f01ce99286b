//! What a calibration starts from: cameras with their views, a target, and what of them is known.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::loss::Loss;
use super::observation::{Sighting, View};
use super::order::in_order;
use super::panel::{PanelPlace, PanelRef};
use super::reference::Reference;
use super::weights::Weights;
use crate::cancel::Stop;
use crate::error::CalibrationError;
use crate::model::Model;
use deltille_core::camera::{Camera, Pose};
use deltille_core::lattice::LatticeMap;
use deltille_core::targets::{Target, TargetIdentity};

/// Cameras that are fixed to each other, their views of one rigid target or of several that are fixed to each
/// other, and what of these is known.
///
/// A single camera is a rig of one. Everything that is not said to be known is found by
/// [`solve`](Self::solve): the cameras without any guess, the poses between them, and where the
/// target was in each frame; on request also where its panels are on it and how its board is bent. Where
/// there are several targets, see [`of_targets`](Self::of_targets), it is found where they are to each other.
///
/// ```
/// # use deltille_calibrate::{Calibration, CalibrationError, Estimate, Model, PanelPlace, View};
/// # fn calibrated(panels: Vec<PanelPlace>, left: Vec<View>, right: Vec<View>) -> Result<Estimate, CalibrationError> {
/// Calibration::new(panels)
///     .camera("left", left, Model::Radtan)
///     .camera("right", right, Model::KannalaBrandt(4))
///     .hold_out(Some(5))
///     .solve()
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Those of all targets, one after the other.
    pub(crate) panels: Vec<PanelPlace>,
    pub(crate) targets: Vec<TargetPanels>,
    /// Identities of the targets, where those are described.
    pub(crate) identities: Vec<TargetIdentity>,
    pub(crate) cameras: Vec<CameraViews>,
    pub(crate) loss: Loss,
    pub(crate) weights: Weights,
    pub(crate) refine_panels: bool,
    pub(crate) board_shape: bool,
    pub(crate) measure_target: bool,
    /// Standard deviation of a corner of the board from its plan, mm; that of a print where it is not known.
    pub(crate) board_accuracy_mm: Option<f64>,
    pub(crate) hold_out: Option<usize>,
    pub(crate) distances_mm: Vec<f64>,
    /// Which of the model's starts is taken; the best where none is said.
    pub(crate) start: Option<usize>,
    /// Names of all frames in their order, where only a part of them is here.
    pub(crate) order: Vec<String>,
    /// By how many frames each camera is late, where that is known.
    pub(crate) delays: Option<Vec<i32>>,
    /// Rotations of the labels of each panel that no picture shows; may be shorter than there are panels.
    pub(crate) symmetries: Vec<Vec<LatticeMap>>,
    /// Whether the work is to end.
    pub(crate) stop: Stop,
}

/// A target of the scene: panels that move together.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TargetPanels {
    pub name: String,
    /// Its panels among all.
    pub panels: Range<usize>,
    /// Its place in the scene, where that is known.
    pub scene_from_target: Option<Pose>,
}

/// What one camera saw, and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraViews {
    /// Name of the camera, by which results and messages call it.
    pub name: String,
    /// Its views; those of the same name in different cameras were taken at the same moment.
    pub views: Vec<View>,
    /// What is known of its intrinsics.
    pub intrinsics: Intrinsics,
    /// Its pose on the rig, where that is known. The frame of the first camera is the rig frame unless said
    /// otherwise.
    pub camera_from_rig: Option<Pose>,
}

/// What is known of the intrinsics of a camera.
#[derive(Clone, Debug, PartialEq)]
pub enum Intrinsics {
    /// Nothing but the model, whose parameters are estimated.
    Unknown(Model),
    /// All parameters, which are kept.
    Known(Camera),
    /// All parameters approximately: some are estimated, starting from the values that they have.
    Near {
        /// The camera.
        camera: Camera,
        /// Which parameters are found, in the order of [`Camera::parameter_names`].
        free: Vec<bool>,
    },
}

impl From<Model> for Intrinsics {
    fn from(model: Model) -> Self {
        Self::Unknown(model)
    }
}

impl From<Camera> for Intrinsics {
    fn from(camera: Camera) -> Self {
        Self::Known(camera)
    }
}

impl Intrinsics {
    /// The model that is to be found; `None` where a camera was given.
    pub fn model(&self) -> Option<Model> {
        match self {
            Self::Unknown(model) => Some(*model),
            Self::Known(_) | Self::Near { .. } => None,
        }
    }

    /// Which parameters are found.
    pub(crate) fn free(&self) -> Vec<bool> {
        match self {
            Self::Unknown(model) => model.free(),
            Self::Known(camera) => vec![false; camera.parameters().len()],
            Self::Near { free, .. } => free.clone(),
        }
    }
}

impl CameraViews {
    /// A camera whose pose on the rig is to be estimated.
    pub fn new(name: &str, views: Vec<View>, intrinsics: impl Into<Intrinsics>) -> Self {
        let (name, intrinsics) = (name.to_owned(), intrinsics.into());
        Self { name, views, intrinsics, camera_from_rig: None }
    }
}

impl Calibration {
    /// A calibration with a target of these panels, see
    /// [`Reference::panels`](crate::Reference::panels), without any camera yet.
    pub fn new(panels: impl IntoIterator<Item = impl Into<PanelPlace>>) -> Self {
        let panels = panels.into_iter().map(Into::into).collect();
        Self::of_targets([(String::new(), panels)])
    }

    /// A calibration with several targets, of these names and panels, that are fixed to each other, nobody knows
    /// how. [`PanelRef::index`](crate::PanelRef::index) counts the panels of all targets, one target after the
    /// other. The scene's frame is that of the first target.
    ///
    /// Two cameras need not see the same target: where each sees one of its own, the cameras and the targets are
    /// found from how the rig moves, which must turn about two axes.
    pub fn of_targets(targets: impl IntoIterator<Item = (String, Vec<PanelPlace>)>) -> Self {
        let (mut panels, mut of_targets) = (Vec::new(), Vec::new());
        for (name, of_target) in targets {
            let first = panels.len();
            panels.extend(of_target);
            let panels = first..panels.len();
            of_targets.push(TargetPanels { name, panels, scene_from_target: None });
        }
        Self {
            panels,
            targets: of_targets,
            identities: Vec::new(),
            cameras: Vec::new(),
            loss: Loss::default(),
            weights: Weights::default(),
            refine_panels: false,
            board_shape: false,
            measure_target: false,
            board_accuracy_mm: None,
            hold_out: None,
            distances_mm: Vec::new(),
            start: None,
            order: Vec::new(),
            delays: None,
            symmetries: Vec::new(),
            stop: Stop::default(),
        }
    }

    /// A calibration of what was photographed, with panels at these places: one target, or several with their panels one
    /// target after the other.
    pub fn of(reference: &Reference, panels: Vec<PanelPlace>) -> Self {
        let targets = reference.targets();
        // Of several targets the least accurate one.
        let accuracy_mm = targets.iter().map(Target::measured_sd_mm);
        let accuracy_mm = accuracy_mm.reduce(|one, other| Some(one?.max(other?))).flatten();
        let symmetries = reference.label_symmetries();
        let mut panels = panels.into_iter();
        let of_target = |target: &Target| {
            (target.name.to_string(), panels.by_ref().take(target.panels.len()).collect())
        };
        let calibration = match targets {
            [] | [_] => Self::new(panels),
            several => Self::of_targets(several.iter().map(of_target).collect::<Vec<_>>()),
        };
        let identities = reference.identities();
        Self { identities, symmetries, ..calibration.board_accuracy_mm(accuracy_mm) }
    }

    /// Adds a camera: of an unknown lens of a [`Model`], or a known [`Camera`] that is kept.
    #[must_use]
    pub fn camera(self, name: &str, views: Vec<View>, intrinsics: impl Into<Intrinsics>) -> Self {
        self.with(CameraViews::new(name, views, intrinsics))
    }

    /// Adds a camera.
    #[must_use]
    pub fn with(mut self, camera: CameraViews) -> Self {
        self.cameras.push(camera);
        self
    }

    /// Says something else of one of its cameras, by its index.
    pub fn set_intrinsics(&mut self, camera: usize, intrinsics: impl Into<Intrinsics>) {
        self.cameras[camera].intrinsics = intrinsics.into();
    }

    /// With a loss, by which corners with large residuals count less; it is [`Loss::Huber`] unless said otherwise.
    #[must_use]
    pub fn loss(self, loss: Loss) -> Self {
        Self { loss, ..self }
    }

    /// With weights of the corners; they are [`Weights::Covariance`] unless said otherwise.
    #[must_use]
    pub fn weights(self, weights: Weights) -> Self {
        Self { weights, ..self }
    }

    /// Whether the poses of the target's panels on it are found, too. One panel stays: that which was
    /// seen most of those that were never measured. What an earlier measurement says of the others
    /// counts as an observation.
    #[must_use]
    pub fn refine_panels(self, refine_panels: bool) -> Self {
        Self { refine_panels, ..self }
    }

    /// Whether the shape of the board's sheet is found, too; for targets of one panel.
    #[must_use]
    pub fn board_shape(self, board_shape: bool) -> Self {
        Self { board_shape, ..self }
    }

    /// Whether the place of every corner of the target is found, too, see [`Estimate::map`](crate::Estimate::map).
    #[must_use]
    pub fn measure_target(self, measure_target: bool) -> Self {
        Self { measure_target, ..self }
    }

    /// With the standard deviation of a coordinate of the board's corners from where its file has them, mm: what
    /// such errors do to a camera is in its observed covariance. Zero where the board is exact; unless said
    /// otherwise 0.1 mm, the error of office printers, and not more than half a percent of an edge. Where
    /// [`measure_target`](Self::measure_target) finds the corners it does not matter.
    #[must_use]
    pub fn board_accuracy_mm(self, board_accuracy_mm: Option<f64>) -> Self {
        Self { board_accuracy_mm, ..self }
    }

    /// With the targets that detections name ([`Detection::targets`](deltille_core::detection::Detection)), where nothing else is known of
    /// what was photographed than its tiles, see [`Estimate::calibrated_with`](crate::Estimate).
    #[must_use]
    pub fn named_by(mut self, targets: impl IntoIterator<Item = TargetIdentity>) -> Self {
        if self.identities.is_empty() {
            for target in targets {
                if !self.identities.contains(&target) {
                    self.identities.push(target);
                }
            }
        }
        self
    }

    /// Keeps every n-th frame (the n-th, the 2n-th, …) out of the calibration; only the poses in these are
    /// found, see [`Estimate::held_out`](crate::Estimate::held_out).
    #[must_use]
    pub fn hold_out(self, hold_out: Option<usize>) -> Self {
        Self { hold_out, ..self }
    }

    /// How far points are, mm, for which the uncertainty of projections is told beside that at infinity; unless
    /// said otherwise as far as the corners were.
    #[must_use]
    pub fn distances_mm(self, distances_mm: Vec<f64>) -> Self {
        Self { distances_mm, ..self }
    }

    /// With a flag that ends the work soon after it is raised: [`Self::solve`] returns
    /// [`CalibrationError::Stopped`] then.
    #[must_use]
    pub fn stopped_by(self, flag: Arc<AtomicBool>) -> Self {
        Self { stop: Stop::by(flag), ..self }
    }

    /// The cameras and their views.
    pub fn cameras(&self) -> &[CameraViews] {
        &self.cameras
    }

    /// The panels as they were given.
    pub fn panels(&self) -> &[PanelPlace] {
        &self.panels
    }

    /// Index of the target of a panel.
    pub(crate) fn target_of(&self, panel: PanelRef) -> usize {
        self.targets.partition_point(|target| target.panels.end <= panel.index())
    }

    /// Target_from_panel of every panel.
    pub(crate) fn panel_poses(&self) -> Vec<Pose> {
        self.panels.iter().map(|panel| panel.target_from_panel).collect()
    }

    /// Whether it is one camera with a target that is taken as it is stated.
    pub(crate) fn is_single(&self) -> bool {
        self.cameras.len() == 1 && self.targets.len() == 1 && !self.refine_panels
    }

    /// The same with other cameras.
    pub(crate) fn of_cameras(&self, cameras: Vec<CameraViews>) -> Self {
        let (panels, targets) = (self.panels.clone(), self.targets.clone());
        let identities = self.identities.clone();
        let (distances_mm, order) = (self.distances_mm.clone(), self.order.clone());
        let (delays, stop) = (self.delays.clone(), self.stop.clone());
        let symmetries = self.symmetries.clone();
        Self {
            panels,
            targets,
            identities,
            cameras,
            distances_mm,
            order,
            delays,
            symmetries,
            stop,
            ..*self
        }
    }

    /// One of its cameras by itself, with panels at these places. What it saw of each target is a view of its own.
    pub(crate) fn alone(&self, camera: usize, panels: &[PanelPlace]) -> Self {
        let mut camera = self.cameras[camera].clone();
        if self.targets.len() > 1 {
            camera.views = camera.views.iter().flat_map(|view| self.by_target(view)).collect();
        }
        let panels = panels.to_vec();
        let of_all = 0..panels.len();
        let all = TargetPanels { name: String::new(), panels: of_all, scene_from_target: None };
        Self {
            panels,
            targets: vec![all],
            identities: self.identities.clone(),
            cameras: vec![camera],
            refine_panels: false,
            hold_out: None,
            distances_mm: Vec::new(),
            order: Vec::new(),
            delays: None,
            symmetries: self.symmetries.clone(),
            stop: self.stop.clone(),
            ..*self
        }
    }

    /// What a view shows of each target, by itself.
    pub(crate) fn by_target(&self, view: &View) -> Vec<View> {
        let of_target = |(index, target): (usize, &TargetPanels)| {
            let is_of = |sighting: &&Sighting| self.target_of(sighting.panel) == index;
            let sightings: Vec<Sighting> = view.sightings.iter().filter(is_of).cloned().collect();
            let name = self.name_on(&view.name, target);
            (!sightings.is_empty()).then(|| View { name, sightings, ..view.clone() })
        };
        self.targets.iter().enumerate().filter_map(of_target).collect()
    }

    /// What a view of one of several targets is called.
    pub(crate) fn name_on(&self, view: &str, target: &TargetPanels) -> String {
        match self.targets.len() {
            1 => view.to_owned(),
            _ => format!("{view}, target {}", target.name),
        }
    }

    /// Names of all frames in the order of their numbers, also of those that are held out.
    pub(crate) fn moments(&self) -> Vec<String> {
        match self.order.as_slice() {
            [] => {
                let views = self.cameras.iter().flat_map(|camera| &camera.views);
                in_order(views.map(|view| view.name.as_str()).collect())
            }
            order => order.to_vec(),
        }
    }

    /// The frames that take part, and those that are held out.
    ///
    /// # Errors
    /// Where there are too few to hold one out.
    pub(crate) fn split(&self) -> Result<(Self, Option<Self>), CalibrationError> {
        let Some(every) = self.hold_out else { return Ok((self.clone(), None)) };
        let views = self.cameras.iter().flat_map(|camera| &camera.views);
        let names: BTreeSet<&str> = views.map(|view| view.name.as_str()).collect();
        let names: Vec<&str> = names.into_iter().collect();
        // Views of a single camera may have the same name.
        let (count, is_single) = match self.cameras.as_slice() {
            [only] => (only.views.len(), true),
            _ => (names.len(), false),
        };
        if every > count {
            return Err(CalibrationError::NothingHeldOut { is_rig: !is_single, every, all: count });
        }
        let is_held_out = |(index, view): (usize, &View)| {
            let of_rig = || names.partition_point(|name| *name < view.name.as_str());
            (if is_single { index } else { of_rig() } + 1).is_multiple_of(every)
        };
        let part = |held_out: bool| {
            let cameras = self.cameras.iter().map(|camera| {
                let views = camera.views.iter().enumerate();
                let views = views.filter(|&of| is_held_out(of) == held_out);
                CameraViews {
                    views: views.map(|(_, view)| view.clone()).collect(),
                    ..camera.clone()
                }
            });
            let order = self.moments();
            Self { hold_out: None, order, ..self.of_cameras(cameras.collect()) }
        };
        Ok((part(false), Some(part(true))))
    }
}
