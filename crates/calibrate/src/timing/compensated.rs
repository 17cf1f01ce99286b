//! Corners as a global shutter and synchronous clocks would have seen them.
//!
//! ```text
//!   x' = x − π(P(T)) + π(P(0))        T: time of the corner's row after the frame of the first camera, see `equations`
//! ```
//!
//! π is the projection of the corner, and P the path of the target about the frame. Since both projections are at almost the
//! same pixel, their errors cancel, and the covariance of the corner remains.

use std::collections::BTreeMap;

use super::equations::{Clock, Group, row};
use super::run::Solved;
use super::values::{TimedCamera, Timing, TimingError};
use crate::input::observation::{Sighting, View};
use deltille_core::camera::Pose;

/// The views of cameras, without the effects of their timing.
pub(crate) struct Compensated {
    pub timing: Timing,
    /// By camera: one view for each frame of the first camera with neighbours, and named after it.
    pub views: Vec<Vec<View>>,
    /// By frame: displacement of a corner in the images of the first camera until the next frame, RMS px.
    pub motion_px: BTreeMap<String, f64>,
}

impl Compensated {
    /// Estimates the timing of cameras, see [`timing`](super::run::timing), and compensates for what is significant of it.
    pub(crate) fn of(cameras: &[TimedCamera], panels: &[Pose]) -> Result<Self, TimingError> {
        let solved = Solved::of(cameras, panels)?;
        let clocks = significant(&solved.timing);
        let mut views = vec![Vec::new(); cameras.len()];
        let mut motion_px = BTreeMap::new();
        for group in solved.groups(&clocks) {
            let (Some((_, _, frame)), [first, ..]) = (group.images.first(), cameras) else {
                continue;
            };
            let moved_px = displacement(&group, first, panels, frame, solved.timing.interval_s);
            motion_px.extend(moved_px.map(|px| (frame.name.clone(), px)));
            for (index, of) in cameras.iter().enumerate() {
                let clock = &clocks[index];
                let images = group.images.iter().filter(|(camera, ..)| *camera == index);
                let late_s = |stamp_s: f64| (clock.middle_s(stamp_s) - group.time_s).abs();
                // A camera may take several images in the interval.
                let nearest = images.min_by(|a, b| late_s(a.1).total_cmp(&late_s(b.1)));
                let view = nearest
                    .and_then(|(_, at, view)| corrected(&group, of, clock, panels, *at, view));
                views[index].extend(view.map(|view| View { name: frame.name.clone(), ..view }));
            }
        }
        Ok(Self { timing: solved.timing, views, motion_px })
    }
}

/// The clocks of the cameras, with what is not significant set to zero.
fn significant(timing: &Timing) -> Vec<Clock> {
    let cameras = timing.cameras.iter().map(|of| {
        let [readout_s, offset_s, drift] = [of.readout_s, of.offset_s, of.drift]
            .map(|of| of.filter(|of| of.is_significant()).map_or(0.0, |of| of.value));
        Clock { readout_s, offset_s, drift }
    });
    cameras.collect()
}

/// The displacement of the corners of a view in a time after it, RMS px; `None` if a camera cannot image a corner.
fn displacement(
    group: &Group<'_>,
    of: &TimedCamera,
    panels: &[Pose],
    view: &View,
    time_s: f64,
) -> Option<f64> {
    let poses = [group.pose, group.motion.pose(&group.pose, time_s)];
    let (mut sum, mut count) = (0.0, 0.0);
    for Sighting { panel, observations } in &view.sightings {
        for seen in observations {
            let on_target = panels[panel.index()].apply(seen.panel_mm);
            let [now, then] = poses
                .map(|pose| of.camera.project(of.camera_from_rig.after(&pose).apply(on_target)));
            sum += now?.distance_squared(then?);
            count += 1.0;
        }
    }
    (count > 0.0).then(|| f64::sqrt(sum / count))
}

/// The view at the time of the frame; `None` if a camera cannot image a corner.
fn corrected(
    group: &Group<'_>,
    of: &TimedCamera,
    clock: &Clock,
    panels: &[Pose],
    stamp_s: f64,
    view: &View,
) -> Option<View> {
    let mut view = view.clone();
    for Sighting { panel, observations } in &mut view.sightings {
        let panel = &panels[panel.index()];
        for seen in observations {
            let time = clock.time_s(stamp_s, row(&of.camera, seen)) - group.time_s;
            let image = |pose: &Pose| {
                let on_target = panel.apply(seen.panel_mm);
                of.camera.project(of.camera_from_rig.after(pose).apply(on_target))
            };
            seen.pixel += image(&group.pose)? - image(&group.motion.pose(&group.pose, time))?;
        }
    }
    Some(view)
}
