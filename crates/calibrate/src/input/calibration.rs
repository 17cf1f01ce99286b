//! The input of a calibration: cameras with their views, a target, and prior knowledge of both.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::constraint::{Constrained, Constraint};
use super::intrinsics::Intrinsics;
use super::loss::Loss;
use super::observation::{Sighting, View};
use super::order::in_order;
use super::panel::{PanelPrior, PanelRef};
use super::reference::Reference;
use super::weights::Weights;
use crate::cancel::Stop;
use crate::error::{CalibrationError, ConstraintError};
use deltille_core::camera::Pose;
use deltille_core::lattice::LatticeMap;
use deltille_core::targets::{Target, TargetIdentity};

/// A calibration of cameras that are fixed to each other, from their views of one rigid target, or of several targets
/// that are fixed to each other.
///
/// A single camera is a rig with one camera. [`solve`](Self::solve) estimates everything that is
/// not given: the intrinsics of the cameras, without a first guess, their relative poses, and the
/// pose of the target in each frame. On request it also estimates the poses of the panels on the
/// target and the shape of the board. With several targets, see [`of_targets`](Self::of_targets),
/// it also estimates the poses of the targets relative to each other.
///
/// ```
/// # use deltille_calibrate::{Calibration, CalibrationError, Estimate, Model, PanelPrior, View};
/// # fn calibrated(panels: Vec<PanelPrior>, left: Vec<View>, right: Vec<View>) -> Result<Estimate, CalibrationError> {
/// Calibration::new(panels)
///     .camera("left", left, Model::Radtan)
///     .camera("right", right, Model::KannalaBrandt(4))
///     .hold_out(Some(5))
///     .solve()
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// The panels of all targets, one target after the other.
    pub(crate) panels: Vec<PanelPrior>,
    pub(crate) targets: Vec<TargetPanels>,
    /// Identities of the targets that have a description.
    pub(crate) identities: Vec<TargetIdentity>,
    pub(crate) cameras: Vec<CameraViews>,
    pub(crate) loss: Loss,
    pub(crate) weights: Weights,
    pub(crate) refine_panels: bool,
    pub(crate) board_shape: bool,
    pub(crate) measure_target: bool,
    /// Standard deviation of a corner of the board from its planned position, mm; `None` for the
    /// standard deviation of an ordinary print.
    pub(crate) board_accuracy_mm: Option<f64>,
    pub(crate) hold_out: Option<usize>,
    pub(crate) distances_mm: Vec<f64>,
    pub(crate) covariance_of_all: bool,
    /// Whether the corners are compensated for the timing of their cameras.
    pub(crate) is_compensated: bool,
    /// Index of the initial lens of the model to use; `None` to use the best one.
    pub(crate) start: Option<usize>,
    /// Names of all frames in order, if this calibration contains only some of them.
    pub(crate) order: Vec<String>,
    /// Lag of each camera in frames, if it is known.
    pub(crate) delays: Option<Vec<i32>>,
    /// Rotations of the labels of each panel that look the same in an image; may be shorter than the list of panels.
    pub(crate) symmetries: Vec<Vec<LatticeMap>>,
    /// Flag that stops the calibration.
    pub(crate) stop: Stop,
}

/// A target of the scene: panels that move together.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TargetPanels {
    pub name: String,
    /// Range of its panels among all panels.
    pub panels: Range<usize>,
    /// Its pose in the scene, if it is known.
    pub scene_from_target: Option<Pose>,
}

/// The views of one camera, and prior knowledge of the camera.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraViews {
    /// Name of the camera in results and messages.
    pub name: String,
    /// Its views; views of the same name in different cameras were taken at the same time.
    pub views: Vec<View>,
    /// Prior knowledge of its intrinsics.
    pub intrinsics: Intrinsics,
    /// Constraints on its unknown parameters.
    pub constraints: Vec<Constraint>,
    /// Its pose on the rig, if it is known. Without a given pose, the frame of the first camera is the rig frame.
    pub camera_from_rig: Option<Pose>,
}

impl CameraViews {
    /// Creates a camera whose pose on the rig is estimated.
    pub fn new(name: &str, views: Vec<View>, intrinsics: impl Into<Intrinsics>) -> Self {
        let (name, intrinsics) = (name.to_owned(), intrinsics.into());
        Self { name, views, intrinsics, constraints: Vec::new(), camera_from_rig: None }
    }

    /// Its constraints.
    pub(crate) fn constrained(&self) -> Result<Constrained, ConstraintError> {
        let size_px = self.views.first().map_or([1, 1], |view| view.size_px);
        Constrained::of(&self.constraints, &self.intrinsics, size_px)
    }
}

impl Calibration {
    /// Creates a calibration with a target of these panels, see [`Reference::panels`](crate::Reference::panels), and
    /// without cameras.
    pub fn new(panels: impl IntoIterator<Item = impl Into<PanelPrior>>) -> Self {
        let panels = panels.into_iter().map(Into::into).collect();
        Self::of_targets([(String::new(), panels)])
    }

    /// Creates a calibration with several targets of these names and panels, which are fixed to each other in unknown
    /// poses. [`PanelRef::index`](crate::PanelRef::index) counts the panels of all targets, one target after the other.
    /// The frame of the first target is the scene frame.
    ///
    /// Two cameras need not see the same target. If each camera sees a different target, the motion
    /// of the rig determines the poses of the cameras and the targets. The rig must rotate about
    /// two axes.
    pub fn of_targets(targets: impl IntoIterator<Item = (String, Vec<PanelPrior>)>) -> Self {
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
            covariance_of_all: false,
            is_compensated: false,
            start: None,
            order: Vec::new(),
            delays: None,
            symmetries: Vec::new(),
            stop: Stop::default(),
        }
    }

    /// Creates a calibration of the photographed target or targets with these panel poses, listed one target after the
    /// other.
    pub fn of(reference: &Reference, panels: Vec<PanelPrior>) -> Self {
        let targets = reference.targets();
        // Uses the accuracy of the least accurate target.
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

    /// Adds a camera: a [`Model`](crate::Model) for an unknown lens, or a known [`Camera`](deltille_core::camera::Camera) that
    /// stays fixed.
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

    /// Replaces the intrinsics of the camera with this index.
    pub fn set_intrinsics(&mut self, camera: usize, intrinsics: impl Into<Intrinsics>) {
        self.cameras[camera].intrinsics = intrinsics.into();
    }

    /// Sets the constraints on the parameters of the camera with this index, see [`Constraint::check`]. They also apply to
    /// the models that [`Self::choose_model`] tries: models without a constrained parameter are omitted.
    pub fn set_constraints(&mut self, camera: usize, constraints: Vec<Constraint>) {
        self.cameras[camera].constraints = constraints;
    }

    /// Sets the robust loss for corners with large residuals; the default is [`Loss::Huber`].
    #[must_use]
    pub fn loss(self, loss: Loss) -> Self {
        Self { loss, ..self }
    }

    /// Sets the weights of the corners; the default is [`Weights::Covariance`].
    #[must_use]
    pub fn weights(self, weights: Weights) -> Self {
        Self { weights, ..self }
    }

    /// Sets whether the poses of the panels on the target are estimated. One panel remains fixed:
    /// of the panels that were never measured, the one that was seen most often. Earlier
    /// measurements of the other panels count as observations.
    #[must_use]
    pub fn refine_panels(self, refine_panels: bool) -> Self {
        Self { refine_panels, ..self }
    }

    /// Sets whether the shape of the board's sheet is estimated; for targets of one panel only.
    #[must_use]
    pub fn board_shape(self, board_shape: bool) -> Self {
        Self { board_shape, ..self }
    }

    /// Sets whether the position of every corner of the target is estimated, see
    /// [`Estimate::map`](crate::Estimate::map). Unless frames are [held out](Self::hold_out), a second calibration
    /// without every third frame provides [held-out residuals](crate::Estimate::held_out).
    #[must_use]
    pub fn measure_target(self, measure_target: bool) -> Self {
        Self { measure_target, ..self }
    }

    /// Sets the standard deviation of the board's corners from their positions in the file, mm per axis. The observed
    /// covariance of a camera includes the effect of these errors. Zero means an exact board. The default is 0.1 mm,
    /// the error of office printers, but at most 0.5 % of an edge. It has no effect if
    /// [`measure_target`](Self::measure_target) estimates the corners.
    #[must_use]
    pub fn board_accuracy_mm(self, board_accuracy_mm: Option<f64>) -> Self {
        Self { board_accuracy_mm, ..self }
    }

    /// Sets the targets that the detections name ([`Detection::targets`](deltille_core::detection::Detection)) when
    /// only the tiles of the target are known, see [`Estimate::calibrated_with`](crate::Estimate).
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

    /// Holds out every n-th frame (the n-th, the 2n-th, …); only the poses in these frames are estimated, see
    /// [`Estimate::held_out`](crate::Estimate::held_out).
    #[must_use]
    pub fn hold_out(self, hold_out: Option<usize>) -> Self {
        Self { hold_out, ..self }
    }

    /// Sets the distances, mm, at which the projection uncertainty is reported in addition to infinity; the default is
    /// the distance of the corners. A repeated distance counts once.
    #[must_use]
    pub fn distances_mm(self, distances_mm: Vec<f64>) -> Self {
        let mut once = Vec::new();
        for mm in distances_mm {
            if !once.contains(&mm) {
                once.push(mm);
            }
        }
        Self { distances_mm: once, ..self }
    }

    /// Sets whether [`Estimate::covariance`](crate::Estimate) contains the poses of frames and the offsets of measured corners, up to
    /// [`JointCovariance::MOST_UNKNOWNS`](crate::JointCovariance::MOST_UNKNOWNS) unknowns.
    #[must_use]
    pub fn covariance_of_all(self, covariance_of_all: bool) -> Self {
        Self { covariance_of_all, ..self }
    }

    /// Sets a flag that stops the calibration soon after it is raised; [`Self::solve`] then returns
    /// [`CalibrationError::Stopped`].
    #[must_use]
    pub fn cancelled_by(self, flag: Arc<AtomicBool>) -> Self {
        Self { stop: Stop::by(flag), ..self }
    }

    /// The cameras and their views.
    pub fn cameras(&self) -> &[CameraViews] {
        &self.cameras
    }

    /// The panels as they were given.
    pub fn panels(&self) -> &[PanelPrior] {
        &self.panels
    }

    /// Index of the target of a panel.
    pub(crate) fn target_of(&self, panel: PanelRef) -> usize {
        self.targets.partition_point(|target| target.panels.end <= panel.index())
    }

    /// The poses `target_from_panel` of all panels.
    pub(crate) fn panel_poses(&self) -> Vec<Pose> {
        self.panels.iter().map(|panel| panel.target_from_panel).collect()
    }

    /// Whether it has one camera and a target that is assumed to match its description.
    pub(crate) fn is_single(&self) -> bool {
        self.cameras.len() == 1 && self.targets.len() == 1 && !self.refine_panels
    }

    /// The same calibration with other cameras.
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

    /// The calibration of a single camera, with these panel poses. Each target in an image becomes
    /// a separate view.
    pub(crate) fn alone(&self, camera: usize, panels: &[PanelPrior]) -> Self {
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
            covariance_of_all: false,
            order: Vec::new(),
            delays: None,
            symmetries: self.symmetries.clone(),
            stop: self.stop.clone(),
            ..*self
        }
    }

    /// Splits a view into one view for each target.
    pub(crate) fn by_target(&self, view: &View) -> Vec<View> {
        let of_target = |(index, target): (usize, &TargetPanels)| {
            let is_of = |sighting: &&Sighting| self.target_of(sighting.panel) == index;
            let sightings: Vec<Sighting> = view.sightings.iter().filter(is_of).cloned().collect();
            let name = self.name_on(&view.name, target);
            (!sightings.is_empty()).then(|| View { name, sightings, ..view.clone() })
        };
        self.targets.iter().enumerate().filter_map(of_target).collect()
    }

    /// The name of a view of one of several targets.
    pub(crate) fn name_on(&self, view: &str, target: &TargetPanels) -> String {
        match self.targets.len() {
            1 => view.to_owned(),
            _ => format!("{view}, target {}", target.name),
        }
    }

    /// Names of all frames in the order of their numbers, including held-out frames.
    pub(crate) fn moments(&self) -> Vec<String> {
        match self.order.as_slice() {
            [] => {
                let views = self.cameras.iter().flat_map(|camera| &camera.views);
                in_order(views.map(|view| view.name.as_str()).collect())
            }
            order => order.to_vec(),
        }
    }

    /// Splits the calibration into its own frames and the held-out frames.
    ///
    /// # Errors
    /// Returns an error if there are too few frames to hold one out.
    pub(crate) fn split(&self) -> Result<(Cow<'_, Self>, Option<Self>), CalibrationError> {
        let Some(every) = self.hold_out else { return Ok((Cow::Borrowed(self), None)) };
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
        Ok((Cow::Owned(part(false)), Some(part(true))))
    }
}
