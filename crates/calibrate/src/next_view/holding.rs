//! Detects when a board is in the proposed pose, still and in focus, so that an image can be taken.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::guide::NextView;
use crate::input::observation::{Sighting, View};
use crate::input::panel::PanelRef;
use crate::start::pose::estimate_pose;
use deltille_core::camera::Pose;
use deltille_core::polygon::{area, clip, hull};
use deltille_core::statistics::median;

/// Minimum overlap of the proposed and the detected outline (intersection over union). For equal
/// squares, a shift by a ninth of the side leaves 0.8. A person is seldom more accurate, and the
/// view then carries nearly the same information.
const MIN_OVERLAP: f64 = 0.7;

/// Largest angle between the normal and the proposed one, rad (12°). It distinguishes a facing
/// board from one at the smallest proposed tilt.
const MAX_ROTATION_RAD: f64 = 0.21;

/// Largest motion blur of an edge, px. The standard deviation of a box of this width is a tenth of
/// a pixel, which is small compared with the blur of any lens.
const MAX_SMEAR_PX: f64 = 0.35;

/// Default exposure time, s: the longest of a webcam at 30 frames per second.
const EXPOSURE_S: f64 = 1.0 / 30.0;

/// Default time for which the board must be held still, s: longer than the pause when a motion reverses.
const HELD_S: f64 = 0.4;

/// Largest interval between detections from which motion is computed, s.
const FORGOTTEN_S: f64 = 1.0;

/// Largest accepted blur (standard deviation), px: corners then have three times the standard
/// deviation of corners at a blur of one pixel (`docs/benchmarks.md`, refined corners).
const MAX_BLUR_PX: f64 = 3.0;

/// Largest standard deviation of corners, px, if the blur is not given: beyond it the image is smeared or dark.
const MAX_SD_PX: f64 = 0.15;

/// The state of a board in live detections.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum HoldStatus {
    /// No corner is visible.
    Unseen,
    /// The board is at another position.
    Elsewhere {
        /// Overlap of both outlines (intersection over union), 0 to 1.
        overlap: f64,
    },
    /// The board is at the proposed position, but tilted differently.
    Turned {
        /// Angle to the proposed normal, rad.
        off_rad: f64,
    },
    /// The board moves.
    Moving {
        /// Motion of a corner during the exposure, px.
        smear_px: f64,
    },
    /// The board is still, but not sharp.
    Blurred,
    /// The board is in the proposed pose.
    Steady {
        /// Fraction of the holding time that has passed, 0 to 1.
        part: f64,
    },
    /// The board was held long enough: take this image.
    Taken,
}

/// Monitors whether a board is held in the proposed pose. The caller passes the time of each image,
/// from any clock.
#[derive(Clone, Debug)]
pub struct HoldTracker {
    next: NextView,
    hull: Vec<DVec2>,
    panels: Vec<Pose>,
    exposure_s: f64,
    hold_s: f64,
    last: Option<(f64, Corners)>,
    since: Option<f64>,
}

type Corners = BTreeMap<(PanelRef, i32, i32), DVec2>;

impl HoldTracker {
    /// Creates the monitor of a proposed view; `panels` are the poses `target_from_panel` of the
    /// target's panels, see [`Reference::panels`](crate::Reference::panels).
    pub fn new(next: &NextView, panels: impl IntoIterator<Item = Pose>) -> Self {
        Self {
            hull: hull(next.corners.iter().map(|corner| corner.pixel).collect()),
            next: next.clone(),
            panels: panels.into_iter().collect(),
            exposure_s: EXPOSURE_S,
            hold_s: HELD_S,
            last: None,
            since: None,
        }
    }

    /// Sets the exposure time of the camera, s; the default is 1/30 s.
    #[must_use]
    pub fn exposure_s(self, exposure_s: f64) -> Self {
        Self { exposure_s, ..self }
    }

    /// Sets the time for which the board must be held, s; the default is 0.4 s.
    #[must_use]
    pub fn hold_s(self, hold_s: f64) -> Self {
        Self { hold_s, ..self }
    }

    /// Evaluates an image that was taken at time `time_s`, s. `blur_px` is the standard deviation
    /// of its blur, if it was measured; otherwise the covariances of the corners show whether it is
    /// sharp.
    pub fn observe(
        &mut self,
        time_s: f64,
        view: Option<&View>,
        blur_px: Option<f64>,
    ) -> HoldStatus {
        let Some(view) = view.filter(|view| view.corner_count() > 0) else {
            (self.last, self.since) = (None, None);
            return HoldStatus::Unseen;
        };
        let corners = view.sightings.iter().flat_map(|sighting| {
            sighting.observations.iter().map(|o| ((sighting.panel, o.row, o.col), o.pixel))
        });
        let corners: Corners = corners.collect();
        let last = self.last.replace((time_s, corners.clone()));
        let held = self.judge(time_s, view, &corners, last, blur_px);
        match held {
            None => {
                let since = *self.since.get_or_insert(time_s);
                let part = (time_s - since) / self.hold_s;
                match part >= 1.0 {
                    true => HoldStatus::Taken,
                    false => HoldStatus::Steady { part: part.max(0.0) },
                }
            }
            Some(held) => {
                self.since = None;
                held
            }
        }
    }

    /// The first problem; `None` if there is none.
    fn judge(
        &self,
        time_s: f64,
        view: &View,
        corners: &Corners,
        last: Option<(f64, Corners)>,
        blur_px: Option<f64>,
    ) -> Option<HoldStatus> {
        let seen = hull(corners.values().copied().collect());
        let overlap = overlap(&seen, &self.hull);
        if overlap < MIN_OVERLAP {
            return Some(HoldStatus::Elsewhere { overlap });
        }
        let is_known = |s: &Sighting| s.panel.index() < self.panels.len();
        let pose = view.sightings.iter().all(is_known).then_some(());
        let pose =
            pose.and_then(|()| estimate_pose(&self.next.camera, &self.panels, &view.sightings));
        let off_rad = pose.map_or(0.0, |pose| {
            let [now, wanted] = [pose, self.next.camera_from_target].map(|pose| pose.rotation);
            // A rotation in the plane of the board has little effect, and is unknown without tags.
            let off = view.sightings.iter().filter_map(|sighting| {
                let normal = self.panels.get(sighting.panel.index())?.rotation * DVec3::Z;
                Some((now * normal).angle_between(wanted * normal))
            });
            off.fold(0.0, f64::max)
        });
        if off_rad > MAX_ROTATION_RAD {
            return Some(HoldStatus::Turned { off_rad });
        }
        let before = last.filter(|(before, _)| (0.0..=FORGOTTEN_S).contains(&(time_s - before)));
        let Some((before_s, before)) = before.filter(|(before, _)| *before < time_s) else {
            // A single image does not show motion.
            return Some(HoldStatus::Moving { smear_px: f64::INFINITY });
        };
        let moved = corners.iter().filter_map(|(key, at)| Some(at.distance(*before.get(key)?)));
        let speed = median(moved.collect())? / (time_s - before_s);
        let smear_px = speed * self.exposure_s;
        if smear_px > MAX_SMEAR_PX {
            return Some(HoldStatus::Moving { smear_px });
        }
        let observations = view.sightings.iter().flat_map(|sighting| &sighting.observations);
        let deviations =
            observations.filter_map(|o| o.cov).map(|[xx, _, yy]| (0.5 * (xx + yy)).sqrt());
        let is_blurred = match blur_px {
            Some(blur) => blur > MAX_BLUR_PX,
            None => median(deviations.collect()).is_some_and(|sd| sd > MAX_SD_PX),
        };
        is_blurred.then_some(HoldStatus::Blurred)
    }
}

/// Overlap of two convex polygons (intersection over union), 0 to 1.
fn overlap(a: &[DVec2], b: &[DVec2]) -> f64 {
    let mut common = a.to_vec();
    for (i, &from) in b.iter().enumerate() {
        let along = b[(i + 1) % b.len()] - from;
        common = clip(&common, |place| along.perp_dot(place - from));
    }
    let shared = area(&common);
    let all = area(a) + area(b) - shared;
    if all > 0.0 { (shared / all).clamp(0.0, 1.0) } else { 0.0 }
}
