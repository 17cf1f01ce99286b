//! Diagnoses of an estimate: its problems, their causes and remedies.

use std::collections::{BTreeMap, BTreeSet};

use super::model_selection::{Alone, Alternative, FOREIGN_PART, Remedy, is_absurd, is_explained};
use super::one_state::{BoardStretch, CameraChange, RollingShutter, State};
use crate::adjust::finding::{Finding, OutlierPattern};
use crate::adjust::lack_of_fit::LackOfFit;
use crate::estimate::lens_limit::LensLimit;
use crate::estimate::values::{CameraEstimate, Estimate};
use crate::excluded::Excluded;
use crate::input::calibration::Calibration;
use crate::input::constraint::Constraint;
use crate::input::order::in_order;
use crate::input::panel::PanelRef;
use crate::model::Model;
use crate::problem::shape::STRETCH;
use crate::start::symmetry::LabelRotation;
use deltille_core::camera::Camera;

/// RMS residual beyond which a lens does not match its model, px: corners are accurate to a few
/// hundredths of a pixel.
const POOR_RMS_PX: f64 = 1.0;

/// Fraction of the views that a calibration may exclude.
const MAX_EXCLUDED: f64 = 0.2;

/// Minimum difference between the focal lengths of two minima, in standard deviations.
const APART_SIGMA: f64 = 10.0;
const NEARLY: f64 = 1.5;

/// A diagnosis of an estimate. Cameras are indices.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Diagnosis {
    /// The given intrinsics of a camera do not match the images; the estimate is unusable.
    WrongCamera {
        /// The camera.
        camera: usize,
        /// RMS residual per axis without outliers, px.
        rms_px: f64,
    },
    /// The residuals of an estimated camera are so large that the estimate is unusable.
    UnusableFit {
        /// The camera.
        camera: usize,
        /// RMS residual per axis without outliers, px.
        rms_px: f64,
    },
    /// More than a fifth of the views (of the frames, for a rig) were excluded, so the result
    /// depends only on the others.
    ManyExcluded {
        /// Number of excluded views or frames.
        excluded: usize,
        /// Number of all views or frames.
        all: usize,
    },
    /// More than a fifth of the corners were excluded with their panels, in views whose other
    /// panels were kept, so the result depends only on the others.
    ManyPanelsExcluded {
        /// Number of excluded corners.
        excluded: usize,
        /// Number of all corners.
        all: usize,
    },
    /// Another set of parameters of the same model fits the views equally or almost equally well.
    SecondMinimum {
        /// The camera.
        camera: usize,
        /// The other camera.
        other: Camera,
        /// RMS residual per axis of the other camera without outliers, px.
        rms_px: f64,
    },
    /// A camera that lags behind the others by some frames; its frames were matched again with
    /// theirs.
    DelayedCamera {
        /// The camera.
        camera: usize,
        /// Lag in frames; negative if the camera leads.
        frames: i32,
    },
    /// The board looks the same after a rotation, and the labels of a camera in a rig were rotated
    /// so that the cameras agree on the board's pose, or both labellings fit.
    LabelsRotated {
        /// The camera.
        camera: usize,
        /// The rotation, the number of frames, and whether it is certain.
        rotation: LabelRotation,
    },
    /// The shape or the corners of a board were estimated, but the board looks the same after a
    /// rotation, so views may show it in either orientation.
    AmbiguousLabels {
        /// The smallest rotation after which it looks the same, degrees.
        degrees: u32,
    },
    /// The camera changed between views: its focal length or principal point differs after some
    /// view.
    ChangedCamera {
        /// The camera.
        camera: usize,
        /// The change and its view.
        change: CameraChange,
    },
    /// Rows were read one after the other while the board or the camera moved.
    RollingShutter {
        /// The camera.
        camera: usize,
        /// The displacement of rows.
        shutter: RollingShutter,
    },
    /// The board is stretched in one direction relative to its description.
    StretchedBoard {
        /// The camera whose views show it.
        camera: usize,
        /// The stretch.
        stretch: BoardStretch,
    },
    /// The lens model folds back or has a pole within the image.
    NonMonotonicLens {
        /// The camera.
        camera: usize,
        /// The radius and the extent of corners and image.
        end: LensLimit,
    },
    /// Outliers have something in common.
    CommonOutliers(Finding),
    /// Estimating a quantity that was assumed to be known explains the residuals.
    Remedied {
        /// The camera whose views show it.
        camera: usize,
        /// The quantity and its effect.
        remedy: Remedy,
    },
    /// Residuals are not noise, and none of the tested alternatives explains them.
    LackOfFit(LackOfFit),
    /// Residuals are large.
    PoorFit {
        /// The camera.
        camera: usize,
        /// RMS residual per axis without outliers, px.
        rms_px: f64,
    },
    /// A constraint that the views contradict.
    WrongConstraint {
        /// The camera.
        camera: usize,
        /// The constraint.
        constraint: Constraint,
        /// Difference between the constraint and the estimate without it, in standard deviations of this difference.
        deviations: f64,
    },
    /// Parameters that the views do not distinguish.
    IllConditioned {
        /// The camera.
        camera: usize,
        /// Names of the parameters.
        parameters: Vec<String>,
        /// A smaller model that fits the lens equally well, if there is one.
        sufficient: Option<Model>,
    },
}

impl Diagnosis {
    /// Whether the estimate must not be used.
    pub fn is_failure(&self) -> bool {
        matches!(
            self,
            Self::WrongCamera { .. }
                | Self::UnusableFit { .. }
                | Self::ManyExcluded { .. }
                | Self::ManyPanelsExcluded { .. }
                | Self::ChangedCamera { .. }
        )
    }

    /// Whether it says that a given camera did not take the images.
    pub(crate) fn blames_camera(&self) -> bool {
        match self {
            Self::WrongCamera { .. } => true,
            Self::Remedied { remedy, .. } => remedy.alternative == Alternative::Camera,
            _ => false,
        }
    }

    /// The camera whose lens the model does not fit according to this diagnosis, so that no view is to blame for its
    /// residuals.
    pub fn misfit_of(&self) -> Option<usize> {
        match *self {
            Self::UnusableFit { camera, .. }
            | Self::PoorFit { camera, .. }
            | Self::LackOfFit(LackOfFit::Lens { camera, .. }) => Some(camera),
            Self::Remedied { camera, remedy } if remedy.alternative.is_of_lens() => Some(camera),
            _ => None,
        }
    }

    /// The camera whose state this diagnosis describes, and the RMS residual with it modelled, px.
    fn of_state(&self) -> Option<(usize, f64)> {
        match self {
            Self::ChangedCamera { camera, change } => Some((*camera, change.left_px)),
            Self::RollingShutter { camera, shutter } => Some((*camera, shutter.left_px)),
            Self::StretchedBoard { camera, stretch } => Some((*camera, stretch.left_px)),
            _ => None,
        }
    }

    /// Whether this diagnosis explains the residuals of its camera at least as well as a remedy
    /// does.
    fn explains(&self, (camera, remedy): &(usize, Remedy)) -> bool {
        let is_shape =
            matches!(self, Self::StretchedBoard { .. }) && remedy.alternative == Alternative::Shape;
        let is_better = |(of, left_px)| of == *camera && (is_shape || left_px <= remedy.to_px);
        self.of_state().is_some_and(is_better)
    }
}

impl Calibration {
    /// Returns the diagnoses of [`Estimate::diagnose`] for an estimate from [`solve`](Self::solve) with their causes,
    /// the most serious first. If residuals are not noise, alternatives are calibrated on a part of
    /// the views: other models, the shape of the board, and the poses of panels.
    pub fn explain(&self, found: &Estimate) -> Vec<Diagnosis> {
        // `solve` had split off the held-out frames.
        let split = self.split();
        let own = split.as_ref().map_or(self, |(own, _)| own);
        let alone = own.each_alone(found);
        let mut said = said(found, &alone);
        if own.is_single() {
            said.iter_mut().for_each(|said| own.refine(found, said));
        }
        // Everything else may be due to a wrong constraint.
        let failures = said.iter().take_while(|said| said.is_failure()).count();
        said.splice(failures..failures, own.contradicted_constraints(found));
        said.extend(own.open_labels());
        if let (true, Some((other, rms_px))) = (own.is_single(), own.second_minimum(found)) {
            said.push(Diagnosis::SecondMinimum { camera: 0, other, rms_px });
        }
        said
    }

    /// The diagnosis that the estimated shape or corners depend on the orientation in which the
    /// board was seen.
    fn open_labels(&self) -> Option<Diagnosis> {
        let is_of_place = self.board_shape || self.measure_target;
        let maps = self.symmetries.iter().flatten().filter(|_| is_of_place);
        let degrees = maps.map(|map| map.angle_rad().to_degrees().round() as u32).min()?;
        Some(Diagnosis::AmbiguousLabels { degrees })
    }

    /// Replaces the values of a change or a stretch from one linear step by those of a full calibration.
    fn refine(&self, found: &Estimate, said: &mut Diagnosis) {
        match said {
            Diagnosis::ChangedCamera { change, .. } => {
                let order =
                    in_order(found.frames.iter().map(|frame| frame.name.as_str()).collect());
                let (before, after) = order
                    .split_at(order.iter().position(|name| *name == change.from_view).unwrap_or(0));
                let value_px = [before, after].map(|names| {
                    let views = self.cameras[0].views.iter();
                    let views = views.filter(|view| names.contains(&view.name)).cloned().collect();
                    let found = self.of_views(views).adjusted().ok()?;
                    Some(change.intrinsic.of(&found.cameras[0].camera))
                });
                if let [Some(before), Some(after)] = value_px {
                    change.value_px = [before, after];
                }
            }
            Diagnosis::StretchedBoard { stretch, .. } if self.panels.len() == 1 => {
                let bent = self.clone().board_shape(true).adjusted().ok();
                if let Some(shape) = bent.and_then(|bent| bent.shape).map(|bent| bent.shape) {
                    let part = shape.coefficients_mm[STRETCH] / shape.reach_mm;
                    stretch.ratio = (1.0 + part) / (1.0 - part);
                }
            }
            _ => {}
        }
    }

    /// The camera of another minimum with only slightly larger residuals, if the model has several minima.
    fn second_minimum(&self, found: &Estimate) -> Option<(Camera, f64)> {
        let model = self.cameras[0].intrinsics.model()?;
        let own = found.cameras.first()?;
        let starts = 0..model.starts().len();
        let others = starts.filter(|_| model.starts().len() > 1).filter_map(|start| {
            let other = Self { start: Some(start), ..self.clone() }.adjusted().ok()?;
            let is_whole = other.frames.len() == found.frames.len();
            let sd = own.parameters.first()?.sd?.max(other.cameras[0].parameters.first()?.sd?);
            let off = other.cameras[0].camera.focal_px.x - own.camera.focal_px.x;
            let rms_px = other.inlier_rms_px();
            let is_other = off.abs() > APART_SIGMA * sd && rms_px < NEARLY * found.inlier_rms_px();
            (is_whole && is_other).then(|| (other.cameras[0].camera.clone(), rms_px))
        });
        others.min_by(|(_, one), (_, other)| one.total_cmp(other))
    }

    /// The separate calibration of every camera; `None` if it fails or is not needed.
    fn each_alone(&self, found: &Estimate) -> Vec<Alone> {
        let is_good = is_explained(found);
        let alone = found.cameras.iter().enumerate().map(|(index, camera)| {
            let is_own =
                |out: &Excluded| out.camera.as_ref().is_none_or(|name| *name == camera.name);
            let mut excluded = found.excluded.iter().filter(|out| is_own(out));
            let has_question = !is_good
                || !camera.ill_conditioned.is_empty()
                || excluded.any(Excluded::may_be_of_lens);
            has_question.then(|| self.and_alone(index, found)).flatten()
        });
        alone.collect()
    }
}

impl Estimate {
    /// Returns the diagnoses that follow from the estimate itself, the most serious first; no other
    /// calibration is run. See [`Calibration::explain`].
    pub fn diagnose(&self) -> Vec<Diagnosis> {
        said(self, &vec![None; self.cameras.len()])
    }
}

fn said(found: &Estimate, alone: &[Alone]) -> Vec<Diagnosis> {
    let cameras = || found.cameras.iter().enumerate();
    let foreign = cameras().filter(|(_, camera)| {
        let is_known = camera.model.is_none() && camera.estimated_parameters().next().is_none();
        is_known && camera.inlier_rms_px() > FOREIGN_PART * f64::from(camera.camera.width)
    });
    let foreign =
        foreign.map(|(camera, of)| Diagnosis::WrongCamera { camera, rms_px: of.inlier_rms_px() });
    let absurd = cameras().filter(|(_, camera)| camera.model.is_some() && is_absurd(camera));
    let absurd =
        absurd.map(|(camera, of)| Diagnosis::UnusableFit { camera, rms_px: of.inlier_rms_px() });
    let ends = cameras().filter_map(|(camera, of)| {
        Some(Diagnosis::NonMonotonicLens { camera, end: of.lens_limit()? })
    });
    let late = cameras().filter(|(_, of)| of.delay != 0);
    let late = late.map(|(camera, of)| Diagnosis::DelayedCamera { camera, frames: of.delay });
    let rotated = cameras().filter_map(|(camera, of)| {
        Some(Diagnosis::LabelsRotated { camera, rotation: of.label_rotation? })
    });
    let late = late.chain(rotated);
    let gross = found.findings.iter().cloned().map(Diagnosis::CommonOutliers);
    let open = cameras().zip(alone).filter(|((_, of), _)| !of.ill_conditioned.is_empty());
    let open = open.map(|((camera, of), alone)| Diagnosis::IllConditioned {
        camera,
        parameters: of.ill_conditioned.clone(),
        sufficient: alone.as_ref().and_then(|(alone, found)| alone.sufficient(found)),
    });
    let mut states = states(found);
    let causes = causes(found, alone, &mut states);
    let failures: Vec<Diagnosis> = foreign
        .chain(absurd)
        .chain(many_excluded(found))
        .chain(many_panels_excluded(found))
        .collect();
    // If the model does not fit the lens, neither single images nor objects in front of the target are to blame.
    let misfits: BTreeSet<usize> =
        failures.iter().chain(&causes).filter_map(Diagnosis::misfit_of).collect();
    let is_of_lens = |said: &Diagnosis| match said {
        Diagnosis::CommonOutliers(Finding {
            pattern: OutlierPattern::View { camera, .. } | OutlierPattern::Region { camera, .. },
            is_excluded,
            ..
        }) => misfits.contains(camera) && !is_excluded,
        _ => false,
    };
    let gross = gross.filter(|said| !is_of_lens(said));
    let before = failures.into_iter().chain(late).chain(states);
    before.chain(ends).chain(gross).chain(causes).chain(open).collect()
}

/// The diagnoses of changed cameras, rolling shutters and stretched boards.
fn states(found: &Estimate) -> Vec<Diagnosis> {
    let of_camera = |(camera, of): (usize, &CameraEstimate)| {
        let equations = found.states.get(camera)?.as_ref()?;
        let State { change, shutter, stretch } =
            State::of(equations, &of.camera, |frame| found.frames[frame].name.clone());
        let change = change.map(|change| Diagnosis::ChangedCamera { camera, change });
        let shutter = shutter.map(|shutter| Diagnosis::RollingShutter { camera, shutter });
        let stretch = stretch.map(|stretch| Diagnosis::StretchedBoard { camera, stretch });
        let said = change.into_iter().chain(shutter).chain(stretch);
        // A state that still leaves an absurd fit explains nothing.
        let most_px = FOREIGN_PART * f64::from(of.camera.width);
        let explains = |said: &Diagnosis| said.of_state().is_some_and(|(_, px)| px < most_px);
        Some(said.filter(explains).collect::<Vec<_>>())
    };
    found.cameras.iter().enumerate().filter_map(of_camera).flatten().collect()
}

/// Whether a state leaves patterns in the residuals.
fn leaves_patterns(state: &Diagnosis) -> bool {
    matches!(state, Diagnosis::RollingShutter { .. } | Diagnosis::StretchedBoard { .. })
}

/// The diagnosis that too many views of estimated cameras were excluded.
fn many_excluded(found: &Estimate) -> Option<Diagnosis> {
    let frames: BTreeSet<&str> = found.frames.iter().map(|frame| frame.name.as_str()).collect();
    let whole = found.excluded.iter().filter(|out| out.panel.is_none());
    let is_rig = found.cameras.len() > 1;
    let excluded = match is_rig {
        true => {
            let names: BTreeSet<&str> = whole.map(|out| out.view.as_str()).collect();
            names.difference(&frames).count()
        }
        false => whole.count(),
    };
    let all = found.frames.len() + excluded;
    let is_sought = found.cameras.iter().any(|camera| camera.model.is_some());
    let is_many = excluded as f64 > MAX_EXCLUDED * all as f64;
    (is_sought && is_many).then_some(Diagnosis::ManyExcluded { excluded, all })
}

/// The diagnosis that too many corners were excluded with their panels, for example because one of
/// several boards has another size.
fn many_panels_excluded(found: &Estimate) -> Option<Diagnosis> {
    let of_panels = found.excluded.iter().filter(|out| out.panel.is_some());
    let on_panels: usize = of_panels.map(|out| out.corners).sum();
    let (mut outliers, mut all) = (0, on_panels);
    for view in found.cameras.iter().flat_map(|camera| &camera.views) {
        let mut of_panels: BTreeMap<PanelRef, (usize, usize)> = BTreeMap::new();
        for corner in &view.corners {
            let (seen, out) = of_panels.entry(corner.panel).or_default();
            (*seen, *out) = (*seen + 1, *out + usize::from(corner.outlier));
        }
        all += view.corners.len();
        // A few corners may fit by coincidence.
        let is_whole = |(seen, out): &&(usize, usize)| 10 * out >= 9 * seen;
        // With one panel only, the whole view would have been excluded.
        let several = of_panels.values().filter(|_| of_panels.len() > 1);
        outliers += several.filter(is_whole).map(|(seen, _)| seen).sum::<usize>();
    }
    let excluded = on_panels + outliers;
    let is_many = excluded as f64 > MAX_EXCLUDED * all as f64;
    is_many.then_some(Diagnosis::ManyPanelsExcluded { excluded, all })
}

/// The causes of residuals that are not noise. Removes the states that a remedy explains better.
fn causes(found: &Estimate, alone: &[Alone], states: &mut Vec<Diagnosis>) -> Vec<Diagnosis> {
    let remedies = alone.iter().enumerate().filter_map(|(camera, alone)| {
        let (alone, found) = alone.as_ref()?;
        Some((camera, alone.remedy(found)?))
    });
    let mut remedies: Vec<(usize, Remedy)> = remedies.collect();
    let of = |alternative: Alternative| {
        move |(_, remedy): &(usize, Remedy)| remedy.alternative == alternative
    };
    // A wrong camera shifts everything else too.
    if remedies.iter().any(of(Alternative::Camera)) {
        remedies.retain(of(Alternative::Camera));
    }
    let is_of_lens = |(_, remedy): &&(usize, Remedy)| remedy.alternative.is_of_lens();
    states.retain(|state| {
        let is_worse = |of: &(usize, Remedy)| {
            state.of_state().is_some_and(|(camera, px)| camera == of.0 && px > of.1.to_px)
        };
        !remedies.iter().filter(is_of_lens).any(is_worse)
    });
    remedies.retain(|remedy| !states.iter().any(|state| state.explains(remedy)));
    // Report the one board and the one target only once.
    let mut seen = Vec::new();
    remedies.retain(|(_, Remedy { alternative, .. })| {
        let is_shared = matches!(alternative, Alternative::Shape | Alternative::Panels);
        let is_first = !seen.contains(alternative);
        seen.push(*alternative);
        is_first || !is_shared
    });
    let is_of_target = |misfit: &&LackOfFit| matches!(misfit, LackOfFit::Target { .. });
    let of_target: Vec<&LackOfFit> = found.lack_of_fit.iter().filter(is_of_target).collect();
    // If panels are displaced, their corners account for most of the pattern.
    let panels = remedies.iter().any(of(Alternative::Panels)) && !of_target.is_empty();
    if panels {
        remedies.retain(|remedy| !of(Alternative::Panels)(remedy));
    }
    let misfits: Vec<&LackOfFit> = match (panels, remedies.is_empty()) {
        (true, _) => of_target,
        (false, true) if states.iter().any(leaves_patterns) => Vec::new(),
        (false, true) => found.lack_of_fit.iter().collect(),
        (false, false) => Vec::new(),
    };
    let is_named = |camera: usize| {
        let poor_px = found.cameras[camera].inlier_rms_px();
        // A target that causes most of the error biases the cameras, too.
        let is_cause = |misfit: &&LackOfFit| match **misfit {
            LackOfFit::Lens { camera: of, .. } => of == camera,
            LackOfFit::Target { rms_px, .. } => rms_px > 0.5 * poor_px,
        };
        // For a single camera, every diagnosis refers to it.
        let is_single = found.cameras.len() == 1 && !(misfits.is_empty() && remedies.is_empty());
        let is_of_state = |state: &Diagnosis| state.of_state().is_some_and(|(of, _)| of == camera);
        is_single
            || states.iter().any(is_of_state)
            || remedies.iter().any(|(of, _)| *of == camera)
            || misfits.iter().any(is_cause)
    };
    let is_poor = |(index, camera): &(usize, &CameraEstimate)| {
        camera.inlier_rms_px() > POOR_RMS_PX && !is_absurd(camera) && !is_named(*index)
    };
    let poor = found.cameras.iter().enumerate().filter(is_poor);
    let poor: Vec<Diagnosis> = poor
        .map(|(camera, of)| Diagnosis::PoorFit { camera, rms_px: of.inlier_rms_px() })
        .collect();
    let remedied = remedies.iter().map(|&(camera, remedy)| Diagnosis::Remedied { camera, remedy });
    let misfits = misfits.into_iter().copied().map(Diagnosis::LackOfFit);
    remedied.chain(misfits).chain(poor).collect()
}
