//! A first camera without a guess.
//!
//! The candidates are ideal perspective and equidistant cameras of all focal lengths with a central
//! principal point. The search selects the one for which the views fit planes best. Up to half of
//! the views may be wrong.

use super::pose::planar_pose;
use crate::input::observation::{Observation, View};
use crate::input::sample::evenly;
use crate::model::Model;
use deltille_core::camera::{BrownConrady, Camera, KannalaBrandt, Lens, Pose};
use deltille_core::statistics::median;

/// Trial focal lengths, in image widths: from all-round lenses to those with a field of view of one
/// degree.
const SHORTEST: f64 = 0.12;
const LONGEST: f64 = 60.0;

/// Ratio of successive trial focal lengths; bundle adjustment converges from much larger errors.
const RATIO: f64 = 1.1;

/// Number of views used, evenly spaced over the sequence, and number of corners used in each.
const MAX_VIEWS: usize = 15;
const MAX_CORNERS: usize = 40;

/// Finds the ideal camera that explains the views best.
pub(super) fn first_camera(views: &[View], model: Model) -> Option<Camera> {
    let [width, height] = views.first()?.size_px;
    let samples: Vec<Vec<Observation>> =
        evenly(views, MAX_VIEWS).filter_map(largest_panel).collect();
    let perspective = Lens::BrownConrady(BrownConrady::default());
    let equidistant = Lens::KannalaBrandt(KannalaBrandt::default());
    // A strongly distorted perspective lens is closer to an equidistant one.
    let lenses =
        if model.is_perspective() { vec![perspective, equidistant] } else { vec![equidistant] };
    let mut best: Option<(f64, Camera)> = None;
    for lens in lenses {
        let mut part = SHORTEST;
        while part < LONGEST {
            let camera = Camera::centred(width, height, part * f64::from(width), lens.clone());
            let errors = samples.iter().map(|view| error_px(&camera, view)).collect();
            let error = median(errors).unwrap_or(0.0);
            if error.is_finite() && best.as_ref().is_none_or(|(least, _)| error < *least) {
                best = Some((error, camera));
            }
            part *= RATIO;
        }
    }
    best.map(|(_, camera)| camera)
}

/// RMS residual of a view under a camera, px.
fn error_px(camera: &Camera, view: &[Observation]) -> f64 {
    let Some(pose) = planar_pose(camera, view) else { return f64::INFINITY };
    let squares = view.iter().map(|seen| squared_px(camera, &pose, seen));
    (squares.sum::<f64>() / view.len() as f64).sqrt()
}

fn squared_px(camera: &Camera, pose: &Pose, seen: &Observation) -> f64 {
    let at = camera.project(pose.apply(seen.panel_mm));
    at.map_or(f64::INFINITY, |at| seen.pixel.distance_squared(at))
}

fn largest_panel(view: &View) -> Option<Vec<Observation>> {
    let largest = view.sightings.iter().max_by_key(|sighting| sighting.observations.len())?;
    Some(evenly(&largest.observations, MAX_CORNERS).copied().collect())
}
