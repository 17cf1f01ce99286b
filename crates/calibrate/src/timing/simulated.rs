//! Recordings of a waved board by cameras with rolling shutters and clocks of their own, for tests.

use glam::{DQuat, DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::values::TimedCamera;
use crate::input::observation::{Observation, Sighting, View};
use crate::input::panel::PanelRef;
use deltille_core::camera::{Camera, Pose};

/// Standard deviation of a corner per axis.
pub(crate) const NOISE_PX: f64 = 0.05;

const SECONDS: f64 = 10.0;

/// The path of a board that a hand moves.
fn pose(time: f64) -> Pose {
    let wave = |hertz: f64, phase: f64| (std::f64::consts::TAU * hertz * time + phase).sin();
    let turn = DVec3::new(0.4 * wave(0.31, 0.0), 0.4 * wave(0.23, 1.0), 0.2 * wave(0.17, 2.0));
    let place = DVec3::new(60.0 * wave(0.41, 0.5), 40.0 * wave(0.37, 1.5), 60.0 * wave(0.19, 2.5));
    let rotation = DQuat::from_scaled_axis(turn) * DQuat::from_rotation_x(std::f64::consts::PI);
    Pose { rotation, translation: place + DVec3::new(-80.0, 80.0, 450.0) }
}

/// How far along its path a board is at a time.
pub(crate) type Progress = fn(f64) -> f64;

/// Without rests.
fn steady(time: f64) -> f64 {
    time
}

/// Rests of a second between movements of half a second.
pub(crate) fn resting(time: f64) -> f64 {
    let (whole, part) = ((time / 1.5).floor(), (time / 1.5).fract());
    let moved = ((part - 2.0 / 3.0) * 3.0).max(0.0);
    // Smooth up to the second derivative.
    1.5 * (whole + moved.powi(3) * (10.0 - moved * (15.0 - 6.0 * moved)))
}

/// An image whose middle row is exposed at this time.
fn view(
    of: &TimedCamera,
    [time, readout]: [f64; 2],
    progress: Progress,
    random: &mut ChaCha8Rng,
) -> Option<View> {
    let mut observations = Vec::new();
    for (row, col) in (0..7).flat_map(|row| (0..8).map(move |col| (row, col))) {
        let panel_mm = DVec3::new(20.0 * f64::from(col), 20.0 * f64::from(row), 0.0);
        let at = |time: f64| {
            let rig_from_board = pose(progress(time));
            of.camera.project(of.camera_from_rig.after(&rig_from_board).apply(panel_mm))
        };
        let mut pixel = at(time)?;
        for _ in 0..5 {
            pixel = at(time + readout * ((pixel.y + 0.5) / f64::from(of.camera.height) - 0.5))?;
        }
        let mut noise = || NOISE_PX * (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        pixel += DVec2::new(noise(), noise());
        let cov = Some([NOISE_PX * NOISE_PX, 0.0, NOISE_PX * NOISE_PX]);
        observations.push(Observation { row, col, panel_mm, pixel, cov });
    }
    let sightings = vec![Sighting { panel: PanelRef::ONLY, observations }];
    let size_px = [of.camera.width, of.camera.height];
    Some(View { name: String::new(), image: String::new(), size_px, sightings })
}

/// The pose of the right camera.
pub(crate) fn right_from_left() -> Pose {
    let translation = DVec3::new(-60.0, 2.0, 1.0);
    Pose { rotation: DQuat::from_rotation_y(0.1), translation }
}

/// Two cameras with these readouts, offsets and drifts, which film at 30 and 25 frames a second for 10 s. Each seed has another
/// motion and other noise.
pub(crate) fn filmed(camera: &Camera, clocks: [[f64; 3]; 2], seed: u64) -> [TimedCamera; 2] {
    filmed_in(camera, clocks, seed, steady)
}

/// The same with another progress along the path.
pub(crate) fn filmed_in(
    camera: &Camera,
    clocks: [[f64; 3]; 2],
    seed: u64,
    progress: Progress,
) -> [TimedCamera; 2] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let start = 13.7 * seed as f64;
    [(Pose::IDENTITY, 30.0, "left"), (right_from_left(), 25.0, "right")].map(
        |(camera_from_rig, rate, name)| {
            let (name, camera, views) = (name.to_owned(), camera.clone(), Vec::new());
            let mut of = TimedCamera { name, camera, camera_from_rig, views };
            let [readout, offset, drift] = clocks[usize::from(of.name == "right")];
            // Between the first and the last frame of the left camera.
            let middle = 0.5 * (SECONDS - 1.0 / 30.0);
            for index in 0..(SECONDS * rate) as usize {
                let stamp = index as f64 / rate;
                let time = start + stamp + offset + drift * (stamp - middle);
                if let Some(view) = view(&of, [time, readout], progress, &mut random) {
                    let image = format!("{}-{index:06}", of.name);
                    let view = View { name: image.clone(), image, ..view };
                    of.views.push(((stamp * 1e9) as i64 + 1_000_000_000_000, view));
                }
            }
            of
        },
    )
}
