//! The next view of a target: the one that reduces the projection uncertainty most.
//!
//! ```text
//!   no camera yet ─→ a first set: facing, then tilted to three sides
//!   an estimate ─→ information so far ─→ candidates (position × size × tilt × roll) ─→ the best, refined
//!                                              │ information of each, its own pose eliminated
//!                                              └→ projection uncertainty over the image with it
//! ```
//!
//! This module opens no file and reads no clock: it takes estimates and returns a pose with its
//! outline, numbers and a sentence. [`HoldTracker`](super::holding::HoldTracker) detects when a person
//! holds the board there.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DMat3, DVec2};
use rayon::prelude::*;

use super::body::Body;
use super::gain::Gain;
use super::place::Placing;
use crate::error::CalibrationError;
use crate::estimate::values::Estimate;
use crate::input::calibration::Calibration;
use crate::input::intrinsics::Intrinsics;
use crate::input::observation::View;
use crate::input::panel::PanelRef;
use crate::input::reference::Reference;
use deltille_core::camera::{Camera, Lens, Pose};
use deltille_core::targets::Target;

/// Horizontal fields of view assumed before the first estimate, rad: those of a webcam or a phone,
/// and of a fisheye model.
const ASSUMED_RAD: f64 = 1.15;
const ASSUMED_FISHEYE_RAD: f64 = 2.0;

/// Candidate positions of the board's centre, as fractions of the image sides.
const AT: [f64; 5] = [0.14, 0.32, 0.5, 0.68, 0.86];

/// Candidate sizes of the board: fractions of the image along the side that it fills more.
const FILLS: [f64; 3] = [0.4, 0.65, 0.95];

/// Candidate tilts, rad: 30° and 50°, the largest that a person holds accurately.
const TILTS: [f64; 2] = [0.52, 0.87];

/// Default nearest distance, in multiples of the reach of the board (half of its diagonal): the
/// camera casts a shadow on nearer boards, and few lenses focus at this distance.
const NEAREST: f64 = 1.0;

/// Corners may be nearer and farther by this factor than those seen so far: these were in focus, and nothing is known about
/// other distances. Each view extends the range.
const FOCUS: f64 = 1.1;

/// Number of directions of a tilt.
const DIRECTIONS: usize = 8;

/// Number of candidates that are refined, and the first step in each coordinate: fractions of the image, the logarithm
/// of the distance, and rad.
const KEPT: usize = 4;
const STEP: [f64; 6] = [0.08, 0.08, 0.18, 0.15, 0.3, 0.4];

/// Number of times that steps are halved.
const HALVINGS: usize = 2;

/// Largest tilt, rad (55°). Beyond it, boards are hard to hold and to detect.
const MAX_TILT: f64 = 0.96;

/// Minimum reduction of the uncertainty that is worth another view, as a fraction. The fifteenth of
/// a series of equally good images achieves it.
const MIN_GAIN: f64 = 0.03;

/// Proposes views for the calibration of one camera, one after the other.
///
/// ```
/// use deltille_calibrate::{Guide, Model};
/// use deltille_core::targets::{BoardSpec, Target};
///
/// let board = Target::new("desk", BoardSpec::deltille(9, 12, 20.0))?;
/// let guide = Guide::new(&board, [1280, 720], Model::Radtan5).unwrap();
/// let first = guide.next(0, None);
/// assert!(first.expected_px.is_none(), "nothing is known before the first views");
/// println!("{first}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Guide {
    body: Body,
    intrinsics: Intrinsics,
    /// The camera assumed before there is an estimate.
    assumed: Camera,
    /// The given nearest and farthest distance.
    distances_mm: [Option<f64>; 2],
    refused: Vec<Placing>,
}

/// A proposed view.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct NextView {
    /// The pose of the target: from the target frame to the camera frame, mm.
    pub camera_from_target: Pose,
    /// The camera used for drawing it: the estimate so far, or an assumed camera.
    pub camera: Camera,
    /// Outlines of the panels seen from the front, px: polygons without repeated first point, which may reach beyond
    /// the image. A board has one.
    pub outlines: Vec<Vec<DVec2>>,
    /// Arrow from the centre of the board towards its upper side (according to its labels), px.
    /// `None` if the lens does not image it.
    pub upwards: Option<[DVec2; 2]>,
    /// The corners that are expected to be found.
    pub corners: Vec<ProposedCorner>,
    /// Position of the board's centre, in fractions of the image from its upper left corner.
    pub at: DVec2,
    /// Distance of the board's centre from the camera, mm.
    pub distance_mm: f64,
    /// The angle between the board's normal and the line of sight, rad.
    pub tilt_rad: f64,
    /// Direction in the image in which the tilted board recedes, rad, clockwise from right.
    pub tilt_direction_rad: f64,
    /// Rotation of the board in its plane, rad, counter-clockwise in the image; 0 if its rows are
    /// level.
    pub roll_rad: f64,
    /// Projection uncertainty at infinity so far, px: the RMS over the whole image of the standard deviation per axis
    /// from noise, see [`ProjectionUncertainty`](crate::ProjectionUncertainty). `None` before there is an estimate.
    pub now_px: Option<f64>,
    /// Projection uncertainty expected with this view, px. `None` before there is an estimate.
    pub expected_px: Option<f64>,
}

/// A corner at its expected position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProposedCorner {
    /// The panel that it lies on.
    pub panel: PanelRef,
    /// Lattice row.
    pub row: i32,
    /// Lattice column.
    pub col: i32,
    /// Position, px.
    pub pixel: DVec2,
}

/// The estimate from the views so far, and the next view.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Guided {
    /// The estimate from the views, or the reason why there is none yet.
    pub estimate: Result<Estimate, CalibrationError>,
    /// The next view.
    pub next: NextView,
}

impl Guide {
    /// Creates a guide for views of a target by a camera with a given model, or one that is known approximately. A
    /// known camera is recalibrated with all its parameters.
    ///
    /// `None` if there is nothing to propose: a target without corners, an image without pixels, or
    /// a spline, whose knots need corners everywhere. To take images for a spline, use a guide with
    /// another model.
    pub fn new(
        target: &Target,
        [width, height]: [u32; 2],
        intrinsics: impl Into<Intrinsics>,
    ) -> Option<Self> {
        let body = Body::new(target)?;
        let intrinsics = match intrinsics.into() {
            Intrinsics::Known(camera) => {
                let free = vec![true; camera.parameters().len()];
                Intrinsics::Near { camera, free }
            }
            other => other,
        };
        let assumed = match &intrinsics {
            Intrinsics::Unknown(model) => {
                let lens = model.lens();
                let focal = if lens.is_perspective() {
                    f64::from(width) / 2.0 / (ASSUMED_RAD / 2.0).tan()
                } else {
                    f64::from(width) / ASSUMED_FISHEYE_RAD
                };
                Camera::centred(width, height, focal, lens)
            }
            Intrinsics::Near { camera, .. } | Intrinsics::Known(camera) => camera.clone(),
        };
        let is_spline = matches!(assumed.lens, Lens::Spline(_));
        let is_image =
            width > 0 && height > 0 && [assumed.width, assumed.height] == [width, height];
        let (distances_mm, refused) = ([None; 2], Vec::new());
        (!is_spline && is_image).then_some(Self {
            body,
            intrinsics,
            assumed,
            distances_mm,
            refused,
        })
    }

    /// Sets the nearest and the farthest distance of corners, mm, at which they are in focus. By default, a corner may be up to
    /// 10 % nearer or farther than all corners of the views so far, and the board is not nearer than half of its diagonal.
    #[must_use]
    pub fn within_mm(self, nearest: Option<f64>, farthest: Option<f64>) -> Self {
        Self { distances_mm: [nearest, farthest], ..self }
    }

    /// The nearest and the farthest distance of the board's centre, mm.
    fn of_centre_mm(&self) -> [f64; 2] {
        let [nearest, farthest] = self.distances_mm;
        let nearest = nearest.unwrap_or_else(|| NEAREST * self.body.reach_mm());
        [nearest, farthest.unwrap_or(f64::INFINITY)]
    }

    /// The nearest and the farthest distance of corners that are in focus, mm: as given, or as seen so far.
    fn in_focus_mm(&self, gain: &Gain) -> [f64; 2] {
        let [nearest, farthest] = self.distances_mm;
        let [least, most] = gain.distances_mm;
        [nearest.unwrap_or(least / FOCUS), farthest.unwrap_or(most * FOCUS)]
    }

    /// Avoids views similar to these, which cannot be taken, for example because a wall is in the
    /// way or an arm is too short.
    #[must_use]
    pub fn avoiding<'a>(self, refused: impl IntoIterator<Item = &'a NextView>) -> Self {
        let placings = refused.into_iter().map(|view| Placing {
            at: view.at,
            distance_mm: view.distance_mm,
            tilt: view.tilt_rad,
            away: view.tilt_direction_rad,
            roll: view.roll_rad,
        });
        Self { refused: placings.collect(), ..self }
    }

    /// Width and height of the images, px.
    pub fn size_px(&self) -> [u32; 2] {
        [self.assumed.width, self.assumed.height]
    }

    /// Calibrates the camera from these views and proposes the next one. This takes longer than
    /// [`Self::next`]; with too few or too similar views, there is no estimate yet.
    pub fn after(&self, reference: &Reference, views: &[View]) -> Guided {
        let calibration = Calibration::of(reference, reference.panels());
        let calibration = calibration.camera("camera", views.to_vec(), self.intrinsics.clone());
        let estimate = calibration.solve();
        let next = self.next(views.len(), estimate.as_ref().ok());
        Guided { estimate, next }
    }

    /// Proposes the next view after `taken` views. The estimate from them is of one camera with the model of this
    /// guide. If it is missing or not informative enough, the next view of the first set is
    /// proposed.
    pub fn next(&self, taken: usize, estimate: Option<&Estimate>) -> NextView {
        let gain = estimate.and_then(|estimate| Gain::of(estimate, &self.body));
        let best = gain.as_ref().and_then(|gain| self.best(gain));
        match (&gain, best) {
            (Some(gain), Some((placing, expected_px))) => {
                let view = self.view(&gain.camera, placing);
                let now_px = gain.now_px();
                view.map_or_else(
                    || self.first(taken),
                    |view| NextView { now_px, expected_px: Some(expected_px), ..view },
                )
            }
            (gain, _) => {
                let now_px = gain.as_ref().and_then(Gain::now_px);
                NextView { now_px, ..self.first(taken) }
            }
        }
    }

    /// A view of the first set: facing, then tilted to three sides, then around the image.
    fn first(&self, taken: usize) -> NextView {
        let camera = &self.assumed;
        let (at, tilt, away) = match taken + self.refused.len() {
            0 => (DVec2::splat(0.5), 0.0, 0.0),
            number => {
                let step = number - 1;
                // Right, below, left, above, then the directions between them.
                let away = FRAC_PI_2 * (step % 4) as f64 + 0.25 * PI * (step / 4 % 2) as f64;
                let aside = if step < 3 { 0.0 } else { 0.2 };
                (DVec2::splat(0.5) - aside * DVec2::from_angle(away), FIRST_TILT, away)
            }
        };
        let placing = Placing { at, distance_mm: 1.0, tilt, away, roll: 0.0 };
        let placing = placing.filling(FIRST_FILL, camera, &self.body);
        let [nearest, farthest] = self.of_centre_mm();
        let placing = placing.map(|placing| Placing {
            distance_mm: placing.distance_mm.max(nearest).min(farthest),
            ..placing
        });
        placing.and_then(|placing| self.view(camera, placing)).unwrap_or_else(|| {
            // Every lens images the centre of the image.
            let distance_mm = 1000.0f64.max(nearest).min(farthest);
            let placing = Placing { distance_mm, ..UPRIGHT };
            let camera_from_target = placing.pose(camera, &self.body).unwrap_or(Pose::IDENTITY);
            self.described(camera, camera_from_target, placing)
        })
    }

    /// The candidate with the least projection uncertainty, and that uncertainty.
    fn best(&self, gain: &Gain) -> Option<(Placing, f64)> {
        let candidates = self.candidates(&gain.camera);
        let judged: Vec<Option<f64>> =
            candidates.par_iter().map(|placing| self.judge(gain, placing)).collect();
        let judged = candidates.into_iter().zip(judged);
        let mut judged: Vec<(Placing, f64)> =
            judged.filter_map(|(placing, px)| Some((placing, px?))).collect();
        judged.sort_by(|a, b| a.1.total_cmp(&b.1));
        judged.truncate(KEPT);
        let refined = judged.into_par_iter().map(|(start, px)| self.refined(gain, start, px));
        let mut refined: Vec<(Placing, f64)> = refined.collect();
        refined.sort_by(|a, b| a.1.total_cmp(&b.1));
        // Candidates were evaluated with some of the corners, but a board without tags needs all of
        // them.
        refined.into_iter().find(|(placing, _)| {
            let pose = placing.pose(&gain.camera, &self.body);
            pose.is_some_and(|pose| self.body.seen(&gain.camera, &pose, true).is_some())
        })
    }

    /// The projection uncertainty with an additional view; `None` if the board cannot be held or
    /// found there.
    fn judge(&self, gain: &Gain, placing: &Placing) -> Option<f64> {
        let [nearest, farthest] = self.of_centre_mm();
        let is_far_enough = (nearest..=farthest).contains(&placing.distance_mm);
        let is_in_image = placing.at.cmpge(DVec2::ZERO).all() && placing.at.cmple(DVec2::ONE).all();
        let is_refused = self.refused.iter().any(|refused| placing.is_like(refused));
        if is_refused || !is_far_enough || !is_in_image || !(0.0..=MAX_TILT).contains(&placing.tilt)
        {
            return None;
        }
        let pose = placing.pose(&gain.camera, &self.body)?;
        let seen = self.body.seen(&gain.camera, &pose, false)?;
        let [nearest, farthest] = self.in_focus_mm(gain);
        if !seen.iter().all(|seen| (nearest..=farthest).contains(&seen.point.length())) {
            return None;
        }
        gain.with_px(&self.body, &seen, &DMat3::from_quat(pose.rotation))
    }

    /// Candidates over positions, sizes, tilts and rotations.
    fn candidates(&self, camera: &Camera) -> Vec<Placing> {
        let mut all = Vec::new();
        for (y, x) in AT.into_iter().flat_map(|y| AT.map(|x| (y, x))) {
            let upright = Placing { at: DVec2::new(x, y), ..UPRIGHT };
            for fill in FILLS {
                // Tilted boards have the same distance as a facing one.
                let Some(facing) = upright.filling(fill, camera, &self.body) else { continue };
                for roll in [0.0, FRAC_PI_2] {
                    all.push(Placing { roll, ..facing });
                    for tilt in TILTS {
                        all.extend((0..DIRECTIONS).map(|k| {
                            let away = TAU * k as f64 / DIRECTIONS as f64;
                            Placing { roll, tilt, away, ..facing }
                        }));
                    }
                }
            }
        }
        all
    }

    /// Refines a candidate and its uncertainty by steps along one coordinate at a time.
    fn refined(&self, gain: &Gain, start: Placing, px: f64) -> (Placing, f64) {
        let mut best = (start, px);
        for halving in 0..=HALVINGS {
            let size = 0.5f64.powi(halving as i32);
            for (coordinate, step) in STEP.into_iter().enumerate() {
                for step in [size * step, -size * step] {
                    let moved = best.0.moved(coordinate, step);
                    if let Some(px) = self.judge(gain, &moved).filter(|px| *px < best.1) {
                        best = (moved, px);
                        break;
                    }
                }
            }
        }
        best
    }

    /// The view with all its numbers; `None` if the lens does not image the board there.
    fn view(&self, camera: &Camera, placing: Placing) -> Option<NextView> {
        let pose = placing.pose(camera, &self.body)?;
        Some(self.described(camera, pose, placing))
    }

    fn described(&self, camera: &Camera, pose: Pose, placing: Placing) -> NextView {
        let seen = self.body.seen(camera, &pose, true).unwrap_or_default();
        let corners = seen.iter().map(|seen| {
            let panel = &self.body.panels[seen.panel];
            let corner = &panel.corners[seen.corner];
            let (row, col) = (corner.row, corner.col);
            ProposedCorner { panel: panel.panel, row, col, pixel: seen.at.pixel }
        });
        let turned = |angle: f64| (angle + PI).rem_euclid(TAU) - PI;
        NextView {
            camera_from_target: pose,
            outlines: self.body.outlines(camera, &pose, 1),
            upwards: self.body.upwards(camera, &pose),
            corners: corners.collect(),
            camera: camera.clone(),
            at: placing.at,
            distance_mm: placing.distance_mm,
            tilt_rad: placing.tilt,
            tilt_direction_rad: turned(placing.away),
            roll_rad: turned(placing.roll),
            now_px: None,
            expected_px: None,
        }
    }
}

/// A board in the centre that faces the camera.
const UPRIGHT: Placing =
    Placing { at: DVec2::splat(0.5), distance_mm: 1.0, tilt: 0.0, away: 0.0, roll: 0.0 };

/// Size and tilt of the first views: large, but small enough that an incorrectly assumed field of
/// view does not cut off the board; tilted by 40°, because only perspective reveals the focal
/// length.
const FIRST_FILL: f64 = 0.7;
const FIRST_TILT: f64 = 0.7;

impl NextView {
    /// The expected relative reduction of the uncertainty; `None` before there is an estimate.
    pub fn gain(&self) -> Option<f64> {
        Some(1.0 - self.expected_px? / self.now_px?)
    }

    /// Whether no more views are needed: the uncertainty has reached `until_px`, or, without it, this view would reduce
    /// the uncertainty by less than 3 %.
    pub fn is_enough(&self, until_px: Option<f64>) -> bool {
        match until_px {
            Some(until) => self.now_px.is_some_and(|now| now <= until),
            None => self.gain().is_some_and(|gain| gain < MIN_GAIN),
        }
    }
}
