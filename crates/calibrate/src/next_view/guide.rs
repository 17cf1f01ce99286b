//! Which view of a target to take next: the one after which projections are known best.
//!
//! ```text
//!   no camera yet ─→ a first set: facing, then tilted to three sides
//!   an estimate ─→ what is known so far ─→ candidates (place × size × tilt × turn) ─→ the best, refined
//!                                              │ what each would tell, its own pose eliminated
//!                                              └→ projection uncertainty over the image with it
//! ```
//!
//! Nothing here opens a file or asks a clock: estimates go in, and a pose with its outline, figures and a sentence
//! comes out. Whether somebody holds the board there is told by [`Holding`](super::holding::Holding).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DMat3, DVec2};
use rayon::prelude::*;

use super::body::Body;
use super::gain::Gain;
use super::place::Placing;
use crate::error::CalibrationError;
use crate::estimate::values::Estimate;
use crate::input::calibration::{Calibration, Intrinsics};
use crate::input::observation::View;
use crate::input::panel::PanelRef;
use crate::input::reference::Reference;
use deltille_core::camera::{Camera, Lens, Pose};
use deltille_core::targets::Target;

/// Horizontal fields of view that are assumed before anything is known: of a webcam or telephone, and of a lens
/// whose model is that of a fisheye, rad.
const ASSUMED_RAD: f64 = 1.15;
const ASSUMED_FISHEYE_RAD: f64 = 2.0;

/// Where the middle of the board may be, parts of the image's sides.
const AT: [f64; 5] = [0.14, 0.32, 0.5, 0.68, 0.86];

/// Parts of the image that a board fills along the side that it fills more.
const FILLS: [f64; 3] = [0.4, 0.65, 0.95];

/// Tilts, rad: 30° and 50°, of which the last is as far as a hand still gets right.
const TILTS: [f64; 2] = [0.52, 0.87];

/// Unless said otherwise no board is held nearer than this many times its reach, half of a board's diagonal: nearer
/// the camera shades it, and few lenses are in focus.
const NEAREST: f64 = 1.0;

/// Directions of a tilt.
const DIRECTIONS: usize = 8;

/// Candidates from which the search goes on, and what each first step is: in parts of the image, of the logarithm
/// of the distance, and rad.
const KEPT: usize = 4;
const STEP: [f64; 6] = [0.08, 0.08, 0.18, 0.15, 0.3, 0.4];

/// Times that steps are halved.
const HALVINGS: usize = 2;

/// Tilts beyond this are neither held nor found well, rad (55°).
const MOST_TILT: f64 = 0.96;

/// A view that would lower the uncertainty by less than this part is hardly worth the trouble: of pictures that
/// are all as good the fifteenth does.
const LEAST_GAIN: f64 = 0.03;

/// Proposes views of one camera, one after the other.
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
    /// The camera as it is assumed to be before there is an estimate.
    assumed: Camera,
    distances_mm: [f64; 2],
    refused: Vec<Placing>,
}

/// A view that is proposed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct NextView {
    /// The pose of the target: from the target frame to the camera frame, mm.
    pub camera_from_target: Pose,
    /// The camera by which it is drawn: as it is known so far, or assumed.
    pub camera: Camera,
    /// Outlines of the panels that are seen from the front, px: polygons without their first point again, which may
    /// reach beyond the image. Of a board it is one.
    pub outlines: Vec<Vec<DVec2>>,
    /// From the middle of the board towards its upper side, px: the way its labels stand. `None` where the lens does not
    /// see there.
    pub upwards: Option<[DVec2; 2]>,
    /// The corners that are expected to be found.
    pub corners: Vec<ProposedCorner>,
    /// Where the middle of the board is, in parts of the image from its upper left corner.
    pub at: DVec2,
    /// How far the middle of the board is from the camera, mm.
    pub distance_mm: f64,
    /// The angle between the board's normal and the line of sight, rad.
    pub tilt_rad: f64,
    /// The direction in the image towards which the tilted board is farther away, rad from right towards below.
    pub away_rad: f64,
    /// By how much the board is turned in its plane, rad, counterclockwise as seen; 0 where its rows are level.
    pub roll_rad: f64,
    /// How sure projections at infinity are so far, px: the root mean square over the whole image of the deviation
    /// of a coordinate, as [`ProjectionUncertainty`](crate::ProjectionUncertainty) has it from noise. `None` before
    /// there is an estimate.
    pub now_px: Option<f64>,
    /// How sure they are expected to be with this view. `None` before there is an estimate.
    pub expected_px: Option<f64>,
}

/// A corner where it is expected.
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

/// What views are worth so far, and which one to take next.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Guided {
    /// What the views say of the camera, or why they do not say it yet.
    pub estimate: Result<Estimate, CalibrationError>,
    /// The next view.
    pub next: NextView,
}

impl Guide {
    /// A guide to views of a target by a camera of which nothing is known but its model, or which is known nearly.
    /// A camera that is known is calibrated anew with all parameters that it has.
    ///
    /// `None` where there is nothing to propose: a target without corners, an image without pixels, or a spline,
    /// whose knots need corners everywhere; take its pictures by another model.
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
        let distances_mm = [NEAREST * body.reach_mm(), f64::INFINITY];
        let refused = Vec::new();
        (!is_spline && is_image).then_some(Self {
            body,
            intrinsics,
            assumed,
            distances_mm,
            refused,
        })
    }

    /// With the nearest and the farthest distance, mm, at which boards can be held and are in focus; unless said
    /// otherwise from half of the board's diagonal on, and as far as corners are found.
    #[must_use]
    pub fn within_mm(self, nearest: Option<f64>, farthest: Option<f64>) -> Self {
        let [near, far] = self.distances_mm;
        let distances_mm = [nearest.unwrap_or(near), farthest.unwrap_or(far)];
        Self { distances_mm, ..self }
    }

    /// Without views like these, which cannot be taken: a wall is in the way, or an arm too short.
    #[must_use]
    pub fn avoiding<'a>(self, refused: impl IntoIterator<Item = &'a NextView>) -> Self {
        let placings = refused.into_iter().map(|view| Placing {
            at: view.at,
            distance_mm: view.distance_mm,
            tilt: view.tilt_rad,
            away: view.away_rad,
            roll: view.roll_rad,
        });
        Self { refused: placings.collect(), ..self }
    }

    /// Width and height of the pictures, px.
    pub fn size_px(&self) -> [u32; 2] {
        [self.assumed.width, self.assumed.height]
    }

    /// What so many views are worth, and which one to take next. It finds the camera anew, which takes longer than
    /// [`Self::next`]; with few views, or views that are too much alike, there is no camera yet.
    pub fn after(&self, reference: &Reference, views: &[View]) -> Guided {
        let calibration = Calibration::of(reference, reference.panels());
        let calibration = calibration.camera("camera", views.to_vec(), self.intrinsics.clone());
        let estimate = calibration.solve();
        let next = self.next(views.len(), estimate.as_ref().ok());
        Guided { estimate, next }
    }

    /// The view to take next after so many. The estimate is what was found from them, of one camera with the model of
    /// this guide; without one, and where it does not tell enough, the view is one of the first set.
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
                let turn = number - 1;
                // Right, below, left, above, and between these the next time round.
                let away = FRAC_PI_2 * (turn % 4) as f64 + 0.25 * PI * (turn / 4 % 2) as f64;
                let aside = if turn < 3 { 0.0 } else { 0.2 };
                (DVec2::splat(0.5) - aside * DVec2::from_angle(away), FIRST_TILT, away)
            }
        };
        let placing = Placing { at, distance_mm: 1.0, tilt, away, roll: 0.0 };
        let placing = placing.filling(FIRST_FILL, camera, &self.body);
        let placing = placing.map(|placing| Placing {
            distance_mm: placing.distance_mm.max(self.distances_mm[0]).min(self.distances_mm[1]),
            ..placing
        });
        placing.and_then(|placing| self.view(camera, placing)).unwrap_or_else(|| {
            // In the middle of an image any lens sees.
            let [nearest, farthest] = self.distances_mm;
            let distance_mm = 1000.0f64.max(nearest).min(farthest);
            let placing = Placing { distance_mm, ..UPRIGHT };
            let camera_from_target = placing.pose(camera, &self.body).unwrap_or(Pose::IDENTITY);
            self.described(camera, camera_from_target, placing)
        })
    }

    /// The candidate after which projections are surest, and how sure they are then.
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
        // They were judged by some corners; a board without tags needs all.
        refined.into_iter().find(|(placing, _)| {
            let pose = placing.pose(&gain.camera, &self.body);
            pose.is_some_and(|pose| self.body.seen(&gain.camera, &pose, true).is_some())
        })
    }

    /// How sure projections are with a view; `None` where the board cannot be held or found there.
    fn judge(&self, gain: &Gain, placing: &Placing) -> Option<f64> {
        let [nearest, farthest] = self.distances_mm;
        let is_far_enough = (nearest..=farthest).contains(&placing.distance_mm);
        let is_in_image = placing.at.cmpge(DVec2::ZERO).all() && placing.at.cmple(DVec2::ONE).all();
        let is_refused = self.refused.iter().any(|refused| placing.is_like(refused));
        if is_refused
            || !is_far_enough
            || !is_in_image
            || !(0.0..=MOST_TILT).contains(&placing.tilt)
        {
            return None;
        }
        let pose = placing.pose(&gain.camera, &self.body)?;
        let seen = self.body.seen(&gain.camera, &pose, false)?;
        gain.with_px(&self.body, &seen, &DMat3::from_quat(pose.rotation))
    }

    /// Places over the image, sizes, tilts and turns.
    fn candidates(&self, camera: &Camera) -> Vec<Placing> {
        let mut all = Vec::new();
        for (y, x) in AT.into_iter().flat_map(|y| AT.map(|x| (y, x))) {
            let upright = Placing { at: DVec2::new(x, y), ..UPRIGHT };
            for fill in FILLS {
                // Tilted boards are as near as one that faces the camera.
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

    /// The best near a candidate, after which projections are this sure, by steps along one coordinate after the other.
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

    /// A view with all that is told of it; `None` where the board is not found there.
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
            away_rad: turned(placing.away),
            roll_rad: turned(placing.roll),
            now_px: None,
            expected_px: None,
        }
    }
}

/// Facing the camera in the middle.
const UPRIGHT: Placing =
    Placing { at: DVec2::splat(0.5), distance_mm: 1.0, tilt: 0.0, away: 0.0, roll: 0.0 };

/// Of the first views: large, but so that a field of view that was guessed wrong does not cut the board off; tilted
/// by 40°, as focal lengths show by perspective alone.
const FIRST_FILL: f64 = 0.7;
const FIRST_TILT: f64 = 0.7;

impl NextView {
    /// The part by which the uncertainty is expected to fall; `None` before there is an estimate.
    pub fn gain(&self) -> Option<f64> {
        Some(1.0 - self.expected_px? / self.now_px?)
    }

    /// Whether no more views are needed: projections are as sure as asked for, px; where nothing is asked for,
    /// whether this view would lower their uncertainty by less than 3 %.
    pub fn is_enough(&self, until_px: Option<f64>) -> bool {
        match until_px {
            Some(until) => self.now_px.is_some_and(|now| now <= until),
            None => self.gain().is_some_and(|gain| gain < LEAST_GAIN),
        }
    }
}
