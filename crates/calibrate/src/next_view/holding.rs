//! Whether a board is in the proposed pose, still and in focus, so that a picture can be taken.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::guide::NextView;
use crate::input::observation::{Sighting, View};
use crate::input::panel::PanelRef;
use crate::start::pose::estimate_pose;
use deltille_core::camera::Pose;
use deltille_core::polygon::{area, clip, hull};
use deltille_core::statistics::median;

/// The part of both outlines together that they have in common where a board is where it is to be. Of squares of
/// equal size a shift by a ninth of the side leaves 0.8; a hand does hardly better, and a view that is off by as much
/// tells nearly the same.
const LEAST_OVERLAP: f64 = 0.7;

/// How far the normal may be from the proposed one, rad (12°), which tells a facing board from one that is tilted
/// by the least that is proposed.
const MOST_TURN_RAD: f64 = 0.21;

/// How much of an edge may be smeared by motion, px: the deviation of a box of this width is a tenth of a pixel,
/// which is small beside the blur of any lens.
const MOST_SMEAR_PX: f64 = 0.35;

/// How long an exposure is unless said otherwise, s: the longest of a webcam at 30 pictures a second.
const EXPOSURE_S: f64 = 1.0 / 30.0;

/// How long it is to be held still, s: longer than the rest at a turn of a motion.
const HELD_S: f64 = 0.4;

/// Detections that are farther apart than this say nothing of the motion between, s.
const FORGOTTEN_S: f64 = 1.0;

/// Largest blur at which corners are accepted, px (1σ): their error is then two and a half times that at a blur of 1 px
/// (`docs/benchmarks.md`, Corner accuracy).
const MOST_BLUR_PX: f64 = 3.0;

/// A corner that is known worse than this, px, shows a picture that is smeared or dark, where the blur is not told.
const MOST_SD_PX: f64 = 0.15;

/// What a board does, as live detections show it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Held {
    /// No corner of it is seen.
    Unseen,
    /// It is elsewhere.
    Elsewhere {
        /// The part of both outlines together that they have in common, 0 to 1.
        overlap: f64,
    },
    /// It is where it is to be, but tilted or turned otherwise.
    Turned {
        /// By how much, rad.
        off_rad: f64,
    },
    /// It moves.
    Moving {
        /// By how much a corner moves while the picture is exposed, px.
        smear_px: f64,
    },
    /// It is still, but not sharp.
    Blurred,
    /// It is as it is to be.
    Steady {
        /// Which part of the time has passed for which it is to be held, 0 to 1.
        part: f64,
    },
    /// It was held long enough: this picture is to be taken.
    Taken,
}

/// Watches whether a board is held as a view proposes it. The caller says at which time each picture was taken, on any
/// clock.
#[derive(Clone, Debug)]
pub struct Holding {
    next: NextView,
    hull: Vec<DVec2>,
    panels: Vec<Pose>,
    exposure_s: f64,
    held_s: f64,
    last: Option<(f64, Corners)>,
    since: Option<f64>,
}

type Corners = BTreeMap<(PanelRef, i32, i32), DVec2>;

impl Holding {
    /// Of a proposed view; `panels` are target_from_panel of the target's panels, see
    /// [`Reference::panels`](crate::Reference::panels).
    pub fn new(next: &NextView, panels: impl IntoIterator<Item = Pose>) -> Self {
        Self {
            hull: hull(next.corners.iter().map(|corner| corner.pixel).collect()),
            next: next.clone(),
            panels: panels.into_iter().collect(),
            exposure_s: EXPOSURE_S,
            held_s: HELD_S,
            last: None,
            since: None,
        }
    }

    /// With the exposure of the camera, s, where it is known: unless said otherwise a thirtieth of a second.
    #[must_use]
    pub fn exposure_s(self, exposure_s: f64) -> Self {
        Self { exposure_s, ..self }
    }

    /// With the time for which the board is to be held, s; unless said otherwise 0.4.
    #[must_use]
    pub fn held_s(self, held_s: f64) -> Self {
        Self { held_s, ..self }
    }

    /// Looks at what a picture shows that was taken at a time, s. `blur_px` is the deviation of its blur, where that
    /// was measured; otherwise the corners' covariances tell whether it is sharp.
    pub fn look(&mut self, time_s: f64, view: Option<&View>, blur_px: Option<f64>) -> Held {
        let Some(view) = view.filter(|view| view.corner_count() > 0) else {
            (self.last, self.since) = (None, None);
            return Held::Unseen;
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
                let part = (time_s - since) / self.held_s;
                match part >= 1.0 {
                    true => Held::Taken,
                    false => Held::Steady { part: part.max(0.0) },
                }
            }
            Some(held) => {
                self.since = None;
                held
            }
        }
    }

    /// What is amiss; `None` where nothing is.
    fn judge(
        &self,
        time_s: f64,
        view: &View,
        corners: &Corners,
        last: Option<(f64, Corners)>,
        blur_px: Option<f64>,
    ) -> Option<Held> {
        let seen = hull(corners.values().copied().collect());
        let overlap = overlap(&seen, &self.hull);
        if overlap < LEAST_OVERLAP {
            return Some(Held::Elsewhere { overlap });
        }
        let is_known = |s: &Sighting| s.panel.index() < self.panels.len();
        let pose = view.sightings.iter().all(is_known).then_some(());
        let pose =
            pose.and_then(|()| estimate_pose(&self.next.camera, &self.panels, &view.sightings));
        let off_rad = pose.map_or(0.0, |pose| {
            let [now, wanted] = [pose, self.next.camera_from_target].map(|pose| pose.rotation);
            // A turn in the plane of the board matters little, and without tags it is not known.
            let off = view.sightings.iter().filter_map(|sighting| {
                let normal = self.panels.get(sighting.panel.index())?.rotation * DVec3::Z;
                Some((now * normal).angle_between(wanted * normal))
            });
            off.fold(0.0, f64::max)
        });
        if off_rad > MOST_TURN_RAD {
            return Some(Held::Turned { off_rad });
        }
        let before = last.filter(|(before, _)| (0.0..=FORGOTTEN_S).contains(&(time_s - before)));
        let Some((before_s, before)) = before.filter(|(before, _)| *before < time_s) else {
            // One picture alone does not tell whether it moves.
            return Some(Held::Moving { smear_px: f64::INFINITY });
        };
        let moved = corners.iter().filter_map(|(key, at)| Some(at.distance(*before.get(key)?)));
        let speed = median(moved.collect())? / (time_s - before_s);
        let smear_px = speed * self.exposure_s;
        if smear_px > MOST_SMEAR_PX {
            return Some(Held::Moving { smear_px });
        }
        let observations = view.sightings.iter().flat_map(|sighting| &sighting.observations);
        let deviations =
            observations.filter_map(|o| o.cov).map(|[xx, _, yy]| (0.5 * (xx + yy)).sqrt());
        let is_blurred = match blur_px {
            Some(blur) => blur > MOST_BLUR_PX,
            None => median(deviations.collect()).is_some_and(|sd| sd > MOST_SD_PX),
        };
        is_blurred.then_some(Held::Blurred)
    }
}

/// The part of two convex polygons together that both have, 0 to 1.
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
