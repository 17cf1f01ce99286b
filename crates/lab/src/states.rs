//! Simulation of the checks for a changed camera: detection and false-alarm rates.
//!
//! ```text
//!   clean     any camera, board, number of views, noise, tilts and order of the poses
//!   zoom      the focal length is 10 % longer from the middle of the views on
//!   focus     0.5 % longer, noise 0.1 px, 25 views
//!   centre    the principal point shifts by 3 px instead, in a random direction
//!   shutter   rows are read out one after the other in 30 ms while the board moves at 200 mm/s
//!   stretch   a board of 21 × 20 mm is assumed to have 20 mm in both directions
//!   curved    the board is bent by 1 mm, poses change slowly: the camera does not change
//! ```
//!
//! Corners are projected by a known camera and shifted by noise.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DQuat, DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use deltille::calibrate::{
    Calibration, ChangedIntrinsic, Diagnosis, Estimate, Model, Observation, PanelRef, Sighting,
    View,
};
use deltille::camera::{BrownConrady, Camera, DoubleSphere, KannalaBrandt, Lens, Pose};

/// Size of the images, px.
const SIZE_PX: [u32; 2] = [1280, 960];

/// Distance from the border below which corners are not found, px.
const MARGIN_PX: f64 = 4.0;

/// Factor of the focal length after a change of zoom, and of focus.
const ZOOM: f64 = 1.10;
const FOCUS: f64 = 1.005;

/// Shift of the principal point, px.
const CENTRE_PX: f64 = 3.0;

/// Readout time of the rolling shutter, s, and speed of the board, mm/s.
const READOUT_S: f64 = 0.03;
const SPEED_MM_S: f64 = 200.0;

/// Number of iterations that determine the readout time of a row.
const ROW_STEPS: usize = 8;

/// The fault in the views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// No fault.
    Clean,
    /// The focal length changes by 10 %.
    Zoom,
    /// The focal length changes by 0.5 %.
    Focus,
    /// The principal point shifts.
    Centre,
    /// Rows are read out one after the other while the board moves.
    Shutter,
    /// The board is longer in one direction than assumed.
    Stretch,
    /// The board is bent.
    Curved,
}

impl Scene {
    /// All scenes.
    pub const ALL: [Self; 7] = [
        Self::Clean,
        Self::Zoom,
        Self::Focus,
        Self::Centre,
        Self::Shutter,
        Self::Stretch,
        Self::Curved,
    ];

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::Zoom => "zoom",
            Self::Focus => "focus",
            Self::Centre => "centre",
            Self::Shutter => "shutter",
            Self::Stretch => "stretch",
            Self::Curved => "curved",
        }
    }
}

/// Result of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The simulated fault.
    pub scene: Scene,
    /// Number of the run.
    pub index: usize,
    /// The camera model.
    pub model: Model,
    /// Number of views.
    pub views: usize,
    /// Noise, px.
    pub noise_px: f64,
    /// Whether poses change slowly.
    pub is_slow: bool,
    /// Diagnoses of the camera and the board. Each has a kind and a figure: the ratio of focal lengths, the shift of
    /// the principal point in px, the shear in px, or the ratio of the board's lengths.
    pub said: Vec<(&'static str, f64)>,
    /// Whether the calibration succeeded.
    pub is_calibrated: bool,
    /// Focal length in x, its standard deviation from noise, and the observed standard deviation, px.
    pub focal: [f64; 3],
}

/// A camera, a board and its motion.
struct World {
    random: ChaCha8Rng,
    scene: Scene,
    camera: Camera,
    model: Model,
    rows: i32,
    columns: i32,
    edge_mm: f64,
    views: usize,
    noise_px: f64,
    tilt: f64,
    roll: f64,
    is_slow: bool,
}

impl World {
    fn new(scene: Scene, seed: u64, index: usize) -> Self {
        let number = seed.wrapping_mul(1_000_000).wrapping_add(index as u64);
        let mut random = ChaCha8Rng::seed_from_u64(number ^ (scene as u64) << 56);
        let [width, height] = SIZE_PX;
        let is_stated = scene != Scene::Clean && scene != Scene::Curved;
        let focal = if is_stated { 900.0 } else { random.random_range(700.0..1800.0) };
        let kind = if is_stated { 0 } else { random.random_range(0..5) };
        let brown = |radial: [f64; 3]| {
            let tangential = [0.0005, -0.0004];
            Lens::BrownConrady(BrownConrady { radial, tangential, ..BrownConrady::default() })
        };
        let (lens, model, focal) = match kind {
            0 => (brown([-0.2, 0.06, 0.0]), Model::Radtan, focal),
            1 => (brown([-0.25, 0.1, -0.02]), Model::Radtan5, focal),
            2 => (brown([-0.15, 0.04, 0.0]), Model::Rational, focal),
            3 => {
                let k = vec![-0.02, 0.004, -0.002, 0.0003];
                (Lens::KannalaBrandt(KannalaBrandt { k }), Model::KannalaBrandt(4), 0.4 * focal)
            }
            _ => {
                let lens = DoubleSphere { xi: -0.2, alpha: 0.58 };
                (Lens::DoubleSphere(lens), Model::DoubleSphere, 0.4 * focal)
            }
        };
        let mut camera = Camera::centred(width, height, focal, lens);
        camera.centre_px += DVec2::new(7.0, -11.0);
        let views = if is_stated { 25 } else { random.random_range(8..=40) };
        let noise_px = match is_stated {
            true => 0.1,
            false => 0.03 * 10f64.powf(random.random_range(0.0..1.0)),
        };
        let (rows, columns) = match is_stated {
            true => (8, 11),
            false => (random.random_range(6..12), random.random_range(7..14)),
        };
        let edge_mm = if is_stated { 20.0 } else { random.random_range(10.0..40.0) };
        let tilt = if is_stated { 0.7 } else { random.random_range(0.4..0.9) };
        let roll = if random.random() { PI } else { 0.25 };
        let is_slow = scene == Scene::Curved || random.random();
        Self {
            random,
            scene,
            camera,
            model,
            rows,
            columns,
            edge_mm,
            views,
            noise_px,
            tilt,
            roll,
            is_slow,
        }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }

    /// Returns poses of the board, in rings of increasing tilt or in random order.
    fn poses(&mut self) -> Vec<Pose> {
        let extent = self.edge_mm * f64::from(self.columns.max(self.rows));
        let size = DVec2::from(SIZE_PX.map(f64::from));
        let pose = |world: &mut Self, index: usize| loop {
            let part = (index as f64 + world.random.random::<f64>()) / world.views as f64;
            let at = 0.5 + 0.35 * DVec2::from([0; 2].map(|_| world.random.random_range(-1.0..1.0)));
            let Some(ray) = world.camera.unproject(at * size) else { continue };
            let (tilt, about) = match world.is_slow {
                true => (world.tilt * part, part * world.views as f64 / 12.0 * TAU),
                false => (
                    world.random.random_range(0.0..world.tilt),
                    world.random.random_range(0.0..TAU),
                ),
            };
            let fill = world.random.random_range(0.35..0.8);
            let distance = world.camera.focal_px.x * extent / (fill * size.x);
            let sight = ray.direction.normalize();
            let facing = DQuat::from_rotation_arc(DVec3::Z, sight) * DQuat::from_rotation_x(PI);
            let axis = DVec3::new(about.cos(), about.sin(), 0.0);
            let roll = world.random.random_range(-world.roll..world.roll);
            let rotation =
                facing * DQuat::from_axis_angle(axis, tilt) * DQuat::from_rotation_z(roll);
            let middle = world.edge_mm / 2.0
                * DVec3::new(f64::from(world.columns - 1), f64::from(world.rows - 1), 0.0);
            let pose = Pose { rotation, translation: distance * sight - rotation * middle };
            let quiet = world.seen(&pose, DVec3::ZERO, 0.0, false, 0);
            if 2 * quiet.corner_count() >= (world.rows * world.columns) as usize {
                return pose;
            }
        };
        (0..self.views).map(|index| pose(self, index)).collect()
    }

    /// Returns the view of a board that moves at `speed` mm/s, with a rolling shutter of `readout_s` seconds.
    fn seen(
        &mut self,
        pose: &Pose,
        speed: DVec3,
        readout_s: f64,
        is_noisy: bool,
        index: usize,
    ) -> View {
        let (rows, columns, edge) = (self.rows, self.columns, self.edge_mm);
        let camera = self.camera.clone();
        let height = f64::from(camera.height);
        let stretch = if self.scene == Scene::Stretch { 21.0 / 20.0 } else { 1.0 };
        let reach = edge * f64::from(columns) / 2.0;
        let mut observations = Vec::new();
        for (row, col) in (0..rows).flat_map(|row| (0..columns).map(move |col| (row, col))) {
            let panel_mm = edge * DVec3::new(f64::from(col), f64::from(row), 0.0);
            let mut made = panel_mm * DVec3::new(stretch, 1.0, 1.0);
            if self.scene == Scene::Curved {
                made.z = ((panel_mm.x - reach) / reach).powi(2);
            }
            let point = pose.apply(made);
            let mut at = camera.project(point);
            for _ in 0..ROW_STEPS {
                let time = at.map_or(0.0, |at| readout_s * ((at.y + 0.5) / height - 0.5));
                at = camera.project(point + speed * time);
            }
            let Some(at) = at.filter(|&at| camera.sees(at, MARGIN_PX)) else { continue };
            let noise_px = if is_noisy { self.noise_px } else { 0.0 };
            let pixel = at + noise_px * DVec2::new(self.normal(), self.normal());
            let variance = self.noise_px * self.noise_px;
            let cov = Some([variance, 0.0, variance]);
            observations.push(Observation { row, col, panel_mm, pixel, cov });
        }
        let (name, image) = (format!("{index:03}"), format!("{index:03}.png"));
        let sightings = vec![Sighting { panel: PanelRef::ONLY, observations }];
        View { name, image, size_px: SIZE_PX, sightings }
    }

    fn views(&mut self) -> Vec<View> {
        let poses = self.poses();
        let (plain, centre_px) = (self.camera.focal_px, self.camera.centre_px);
        let direction = DVec2::from_angle(self.random.random_range(0.0..TAU));
        let mut views = Vec::new();
        for (index, pose) in poses.iter().enumerate() {
            let longer = match self.scene {
                Scene::Zoom => ZOOM,
                Scene::Focus => FOCUS,
                _ => 1.0,
            };
            let by_px = if self.scene == Scene::Centre { CENTRE_PX } else { 0.0 };
            if 2 * index >= poses.len() {
                self.camera.focal_px = longer * plain;
                self.camera.centre_px = centre_px + by_px * direction;
            }
            let readout_s = if self.scene == Scene::Shutter { READOUT_S } else { 0.0 };
            let any = DVec3::new(self.normal(), self.normal(), self.normal());
            let view = self.seen(pose, SPEED_MM_S * any.normalize(), readout_s, true, index);
            views.push(view);
        }
        views
    }

    fn run(mut self, index: usize) -> Run {
        let views = self.views();
        let calibration = Calibration::new([Pose::IDENTITY]).camera("camera", views, self.model);
        let found = calibration.solve();
        let said = found.as_ref().map(|found| said(&calibration, found)).unwrap_or_default();
        Run {
            scene: self.scene,
            index,
            model: self.model,
            views: self.views,
            noise_px: self.noise_px,
            is_slow: self.is_slow,
            said,
            is_calibrated: found.is_ok(),
            focal: found.map_or([f64::NAN; 3], |found| {
                let camera = &found.cameras[0];
                let observed = camera.observed_sd().first().copied().flatten();
                let sd = camera.parameters[0].sd;
                [camera.camera.focal_px.x, sd.unwrap_or(f64::NAN), observed.unwrap_or(f64::NAN)]
            }),
        }
    }
}

/// Returns the diagnoses of the camera, the shutter and the board. For a bent board, a diagnosis of its shape is
/// legitimate.
fn said(calibration: &Calibration, found: &Estimate) -> Vec<(&'static str, f64)> {
    let kind = |said: &Diagnosis| match said {
        Diagnosis::ChangedCamera { change, .. } => {
            let [before, after] = change.value_px;
            let is_focal = change.intrinsic == ChangedIntrinsic::Focal;
            Some(("changed_camera", if is_focal { after / before } else { after - before }))
        }
        Diagnosis::RollingShutter { shutter, .. } => Some(("rolling_shutter", shutter.shear_px)),
        Diagnosis::StretchedBoard { stretch, .. } => Some(("stretched_board", stretch.ratio)),
        _ => None,
    };
    calibration.explain(found).iter().filter_map(kind).collect()
}

/// Performs runs of each scene; returns `None` if interrupted. `tick` is called after each run.
pub fn run(
    scenes: &[(Scene, usize)],
    seed: u64,
    interrupted: &AtomicBool,
    tick: &(dyn Fn() + Sync),
) -> Option<Vec<Run>> {
    let all = scenes.iter().flat_map(|&(scene, runs)| (0..runs).map(move |index| (scene, index)));
    let all: Vec<(Scene, usize)> = all.collect();
    let run = |(scene, index): (Scene, usize)| {
        if interrupted.load(Ordering::Relaxed) {
            return None;
        }
        let run = World::new(scene, seed, index).run(index);
        tick();
        Some(run)
    };
    all.into_par_iter().map(run).collect()
}

/// Formats the number of runs with each diagnosis as a table.
pub fn text(runs: &[Run]) -> String {
    let mut text =
        "scene     runs  calibrated  changed camera  rolling shutter  stretched board\n".to_owned();
    for scene in Scene::ALL {
        let of: Vec<&Run> = runs.iter().filter(|run| run.scene == scene).collect();
        if of.is_empty() {
            continue;
        }
        let calibrated = of.iter().filter(|run| run.is_calibrated).count();
        let count = |kind: &str| {
            of.iter().filter(|run| run.said.iter().any(|(said, _)| *said == kind)).count()
        };
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{:8}  {:4}  {calibrated:10}  {:14}  {:15}  {:15}",
            scene.name(),
            of.len(),
            count("changed_camera"),
            count("rolling_shutter"),
            count("stretched_board"),
        );
    }
    text
}

/// Formats every run as CSV, one per line.
pub fn csv(runs: &[Run]) -> String {
    let mut text = "scene,run,model,views,noise_px,slow,calibrated,fx_px,fx_sd_px,fx_observed_px,said,figures\n".to_owned();
    for run in runs {
        let Run { scene, index, model, views, noise_px, is_slow, said, is_calibrated, focal } = run;
        let kinds: Vec<&str> = said.iter().map(|(kind, _)| *kind).collect();
        let figures: Vec<String> = said.iter().map(|(_, figure)| format!("{figure:.4}")).collect();
        let _ = writeln!(
            text,
            "{},{index},{model},{views},{noise_px:.4},{is_slow},{is_calibrated},{:.3},{:.3},{:.3},{},{}",
            scene.name(),
            focal[0],
            focal[1],
            focal[2],
            kinds.join(" "),
            figures.join(" ")
        );
    }
    text
}
