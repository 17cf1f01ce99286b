//! Run time of calibrations.

use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use super::{Row, SpeedError, timed};
use deltille::calibrate::{Calibration, Model, Observation, PanelRef, Sighting, View};
use deltille::camera::{BrownConrady, Camera, Lens, Pose};

/// Width of the board, mm.
const WIDTH_MM: f64 = 220.0;

/// Standard deviation of the corners per axis, px.
const NOISE_PX: f64 = 0.05;

/// Standard deviation of the positions on the board if they are measured, mm.
const OFF_MM: f64 = 0.05;

/// Minimum distance of corners from the border of the image, px.
const MARGIN_PX: f64 = 10.0;

/// Cameras from a hundred and from a thousand views.
pub(super) fn cameras(seed: u64) -> Result<Vec<Row>, SpeedError> {
    Ok(vec![camera(100, [10, 11], false, seed)?, camera(1000, [10, 11], false, seed)?])
}

/// A camera from five thousand views, and one from five hundred of a measured board of five thousand corners.
pub(super) fn large(seed: u64) -> Result<Vec<Row>, SpeedError> {
    Ok(vec![camera(5000, [10, 11], false, seed)?, camera(500, [50, 100], true, seed)?])
}

fn camera(
    count: usize,
    [rows, cols]: [i32; 2],
    is_measured: bool,
    seed: u64,
) -> Result<Row, SpeedError> {
    let views = views(count, [rows, cols], if is_measured { OFF_MM } else { 0.0 }, seed);
    let calibration = Calibration::new([Pose::IDENTITY]).camera("", views, Model::Radtan);
    let calibration = if is_measured { calibration.measure_target(true) } else { calibration };
    let (ms, estimate) = timed(|| calibration.solve());
    let estimate = estimate.map_err(|error| SpeedError::Wrong(error.to_string()))?;
    let measured = if is_measured { ", measured" } else { "" };
    let what = format!("calibrate {count} views of {} corners{measured}", rows * cols);
    Ok(Row::new(what, &[ms], format!("rms {:.4} px", estimate.cameras[0].rms_px)))
}

/// Returns views of a board that show all of it.
fn views(count: usize, [rows, cols]: [i32; 2], off_mm: f64, seed: u64) -> Vec<View> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let radial = [-0.2, 0.06, 0.0];
    let lens = Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() });
    let camera = Camera::centred(1600, 1200, 1000.0, lens);
    let [noise, off] =
        [NOISE_PX, off_mm].map(|sigma| Normal::new(0.0, sigma).expect("sigma is finite"));
    let edge_mm = WIDTH_MM / f64::from(cols);
    let corners = (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col)));
    let corners = corners.map(|(row, col)| {
        let panel_mm = edge_mm * DVec3::new(f64::from(col), f64::from(row), 0.0);
        let moved = DVec3::from_array([0; 3].map(|_| off.sample(&mut random)));
        (row, col, panel_mm, panel_mm + moved)
    });
    let corners: Vec<(i32, i32, DVec3, DVec3)> = corners.collect();
    let middle = edge_mm * DVec3::new(f64::from(cols - 1), f64::from(rows - 1), 0.0) / 2.0;
    let mut views = Vec::with_capacity(count);
    while views.len() < count {
        let mut any = |most: f64| random.random_range(-most..most);
        let turn = DVec3::new(any(0.7), any(0.7), any(0.5));
        let place = DVec3::new(any(180.0), any(130.0), 440.0 + any(160.0));
        let rotation = DQuat::from_scaled_axis(turn) * DQuat::from_rotation_x(PI);
        let pose = Pose { rotation, translation: place - rotation * middle };
        let seen = corners.iter().map(|&(row, col, panel_mm, true_mm)| {
            let at = camera.project(pose.apply(true_mm))?;
            let size = DVec2::new(camera.width.into(), camera.height.into());
            let is_inside = at.min(size - at).min_element() > MARGIN_PX;
            let pixel = at + DVec2::from_array([0; 2].map(|_| noise.sample(&mut random)));
            let cov = Some([NOISE_PX * NOISE_PX, 0.0, NOISE_PX * NOISE_PX]);
            is_inside.then_some(Observation { row, col, panel_mm, pixel, cov })
        });
        let Some(observations) = seen.collect() else {
            continue;
        };
        let name = format!("{:04}", views.len());
        let sightings = vec![Sighting { panel: PanelRef::new(0, 0), observations }];
        let size_px = [camera.width, camera.height];
        views.push(View { image: name.clone(), name, size_px, sightings });
    }
    views
}
