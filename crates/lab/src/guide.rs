//! Simulation that compares views proposed one after the other with random views.
//!
//! ```text
//!   guided:  Guide::after(views) ─→ proposed pose ─→ hand-held pose, off by cm and degrees ─→ view ─┐
//!              ↑ 15 times                                                                          │
//!              └───────────────────────────────────────────────────────────────────────────────────┘
//!   random:  60 poses with the whole board in the image ─→ views ─→ Calibration
//!   cut off: the same with at least half of the board in the image
//! ```
//!
//! Corners are either projected by a known camera and shifted by noise, or every image is rendered and its corners are
//! detected. The error of a calibration is measured as in `deltille compare`: against the true
//! camera, over the whole image, at infinity. It is the RMS per axis after the rotation that
//! explains most of the difference.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DQuat, DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use deltille::artwork::ArtworkError;
use deltille::calibrate::{
    Calibration, CalibrationError, CameraEstimate, Comparison, Estimate, Guide, Guided, Model,
    NextView, Observation, PanelRef, Reference, Region, Sighting, Source, View, views,
};
use deltille::camera::{BrownConrady, Camera, KannalaBrandt, Lens, Pose};
use deltille::detect::Detector;
use deltille::synth::{Light, Scene, scene_of_target};
use deltille::targets::{BoardSpec, Target, TargetError, UnknownCodes};
use deltille_core::statistics::median;

/// The board: 9 rows of 12 corners, 20 mm, about A4.
const BOARD: (u32, u32, f64) = (9, 12, 20.0);

/// Limits of the detector within the image: tilts up to 70°, edges of at least 12 px, and this distance of corners from
/// the border, px.
const FOUND_TILT_COS: f64 = 0.342;
const FOUND_EDGE_PX: f64 = 12.0;
const FOUND_MARGIN_PX: f64 = 5.0;

/// Number of corners below which the view is taken again.
const MIN_CORNERS: usize = 20;

/// Smallest visible fraction of a board that may be cut off in a random image.
const MIN_PART: f64 = 0.5;

/// Blur and noise of rendered images, those of a good webcam: standard deviations in px and as a fraction of full
/// scale.
const BLUR_PX: f64 = 0.8;
const NOISE: f64 = 0.01;

/// Standard deviations of a hand-held pose: rotation about each axis, rad (4°), sideways shift as a fraction of the
/// distance (2 cm at 0.5 m), and shift in depth.
const HAND_RAD: f64 = 0.07;
const HAND_ASIDE: f64 = 0.04;
const HAND_DEEP: f64 = 0.06;

/// Random poses: range of the board width as a fraction of the image width, maximum tilt, rad (45°), and standard
/// deviation of the in-plane rotation, rad (15°).
const RANDOM_FILL: [f64; 2] = [0.25, 0.8];
const RANDOM_TILT: f64 = 0.785;
const RANDOM_ROLL: f64 = 0.26;

/// Parameters of the simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Number of guided views.
    pub guided: usize,
    /// Number of random views.
    pub random: usize,
    /// Number of runs with each camera, each with its own noise, hand-held errors and random poses.
    pub runs: usize,
    /// Standard deviation of a corner coordinate, px; `None` to render images and detect corners.
    pub noise_px: Option<f64>,
    /// Seed of all random choices.
    pub seed: u64,
}

/// A camera to be calibrated, and its model.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject {
    /// Its name.
    pub name: &'static str,
    /// The true camera.
    pub camera: Camera,
    /// The model.
    pub model: Model,
}

/// Quality of the calibration from a number of views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worth {
    /// Number of views.
    pub views: usize,
    /// Difference from the true camera over the image at infinity, px, RMS per axis.
    pub off_px: f64,
    /// The same for points at the median distance of the corners, where a shift of the camera is compensated, too.
    pub error_near_px: f64,
    /// Uncertainty due to noise that the estimate reports over the image at infinity, px, RMS per
    /// axis.
    pub said_px: f64,
    /// Uncertainty that the guide predicted for the last view, px.
    pub expected_px: Option<f64>,
}

/// One run with a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Name of the camera.
    pub subject: &'static str,
    /// Quality after each guided view, from the first one that permits a calibration.
    pub guided: Vec<Worth>,
    /// Quality after the same number of random views as guided views, and after all random views.
    pub random: Vec<Worth>,
    /// The same for boards that may be cut off by the image border.
    pub cut_off: Vec<Worth>,
}

/// Reason why a run failed.
#[derive(Debug, thiserror::Error)]
pub enum GuideExperimentError {
    /// The board cannot be built.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// A calibration failed.
    #[error("{subject}, {views} views: {error}")]
    Calibration {
        /// Name of the camera.
        subject: &'static str,
        /// Number of views.
        views: usize,
        /// Reason.
        error: CalibrationError,
    },
    /// The guide does not support the camera model.
    #[error("{0}: the guide does not support this camera model")]
    NoGuide(&'static str),
    /// The board cannot be drawn.
    #[error(transparent)]
    Artwork(#[from] ArtworkError),
    /// The board cannot be detected.
    #[error(transparent)]
    Detector(#[from] UnknownCodes),
}

/// Returns the simulated cameras: a webcam, a fisheye 150° wide, and a long lens of 12°.
pub fn subjects() -> Vec<Subject> {
    let perspective = |width: u32, height: u32, angle: f64, radial: [f64; 3], tangential| {
        let lens = BrownConrady { radial, tangential, ..BrownConrady::default() };
        let focal = f64::from(width) / 2.0 / (angle / 2.0).tan();
        let mut camera = Camera::centred(width, height, focal, Lens::BrownConrady(lens));
        camera.centre_px += DVec2::new(0.012, -0.017) * f64::from(width);
        camera.focal_px.y *= 1.002;
        camera
    };
    let lens = KannalaBrandt { k: vec![-0.02, 0.004, -0.002, 0.0003] };
    let mut fisheye = Camera::centred(1280, 960, 489.0, Lens::KannalaBrandt(lens));
    fisheye.centre_px += DVec2::new(-9.0, 14.0);
    let webcam = perspective(1280, 720, 1.13, [-0.28, 0.11, -0.02], [0.0008, -0.0006]);
    let long = perspective(1920, 1200, 0.21, [-0.1, 0.6, 0.0], [0.0005, 0.001]);
    vec![
        Subject { name: "webcam", camera: webcam, model: Model::Radtan5 },
        Subject { name: "fisheye", camera: fisheye, model: Model::KannalaBrandt(4) },
        Subject { name: "long", camera: long, model: Model::Radtan },
    ]
}

/// Performs all runs; returns `None` if interrupted. `tick` is called after each of the [`Setup::runs`] runs of each
/// camera.
///
/// # Errors
/// Returns an error if a calibration from all views fails.
pub fn run(
    setup: Setup,
    subjects: &[Subject],
    interrupted: &AtomicBool,
    tick: &(dyn Fn() + Sync),
) -> Result<Option<Vec<Run>>, GuideExperimentError> {
    let (rows, columns, edge_mm) = BOARD;
    let board = Target::new("board", BoardSpec::deltille(rows, columns, edge_mm))?;
    let renderer = match setup.noise_px {
        Some(_) => None,
        None => {
            let scene = scene_of_target(&board)?;
            Some((scene, Detector::new(&board)?))
        }
    };
    let all: Vec<(&Subject, u64)> = subjects
        .iter()
        .flat_map(|subject| (0..setup.runs as u64).map(move |run| (subject, run)))
        .collect();
    let runs = all.into_par_iter().map(|(subject, index)| {
        if interrupted.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let random = ChaCha8Rng::seed_from_u64(setup.seed.wrapping_mul(1000).wrapping_add(index));
        let run = {
            let (board, renderer) = (&board, renderer.as_ref());
            World { subject, board, noise_px: setup.noise_px, renderer, random }.run(setup)
        };
        tick();
        run.map(Some)
    });
    runs.collect()
}

/// A camera, a board, and a random generator.
struct World<'a> {
    subject: &'a Subject,
    board: &'a Target,
    noise_px: Option<f64>,
    renderer: Option<&'a (Scene, Detector)>,
    random: ChaCha8Rng,
}

impl World<'_> {
    fn run(mut self, setup: Setup) -> Result<Run, GuideExperimentError> {
        let name = self.subject.name;
        let failed =
            |views: usize, error| GuideExperimentError::Calibration { subject: name, views, error };
        let reference = Reference::Target(self.board);
        let camera = &self.subject.camera;
        let guide = Guide::new(self.board, [camera.width, camera.height], self.subject.model);
        let guide = guide.ok_or(GuideExperimentError::NoGuide(name))?;
        let (mut views, mut guided, mut next) = (Vec::new(), Vec::new(), guide.next(0, None));
        for count in 1..=setup.guided {
            views.push(self.hand_held(&next, count));
            let Guided { estimate, next: after, .. } = guide.after(&reference, &views);
            let expected_px = next.expected_px;
            match estimate {
                Ok(estimate) => guided.push(self.worth(&estimate, count, expected_px)),
                Err(error) if count == setup.guided => return Err(failed(count, error)),
                Err(_) => {}
            }
            next = after;
        }
        let [random, cut_off] = [true, false].map(|whole| {
            let views: Vec<View> = (0..setup.random).map(|i| self.unguided(i, whole)).collect();
            let mut worths = Vec::new();
            for count in [setup.guided.min(setup.random), setup.random] {
                let calibration = Calibration::new(reference.panels());
                let of = views[..count].to_vec();
                match calibration.camera("camera", of, self.subject.model).solve() {
                    Ok(estimate) => worths.push(self.worth(&estimate, count, None)),
                    Err(error) if count == setup.random => return Err(failed(count, error)),
                    Err(_) => {}
                }
            }
            Ok(worths)
        });
        Ok(Run { subject: name, guided, random: random?, cut_off: cut_off? })
    }

    fn normal(&mut self, sd: f64) -> DVec3 {
        let [x, y, z]: [f64; 3] = [0; 3].map(|_| StandardNormal.sample(&mut self.random));
        sd * DVec3::new(x, y, z)
    }

    /// Returns the view that results when a user holds the board over an outline by hand.
    fn hand_held(&mut self, next: &NextView, index: usize) -> View {
        let pose = self.over(next);
        loop {
            let turn = DQuat::from_scaled_axis(self.normal(HAND_RAD));
            let middle = pose.apply(self.board.panels[0].middle_mm());
            let off = self.normal(middle.length()) * DVec3::new(HAND_ASIDE, HAND_ASIDE, HAND_DEEP);
            let hand = Pose { rotation: turn, translation: middle - turn * middle + off };
            let view = self.view(&hand.after(&pose), index);
            if view.corner_count() >= MIN_CORNERS {
                return view;
            }
        }
    }

    /// Returns the pose at which the board covers a proposed outline in the image of the true camera.
    fn over(&self, next: &NextView) -> Pose {
        let panel = &self.board.panels[0];
        let corners = next.corners.iter().filter_map(|corner| {
            let place =
                panel.corners.iter().find(|of| (of.row, of.col) == (corner.row, corner.col))?;
            let panel_mm = place.panel_mm.extend(0.0);
            let (row, col, pixel) = (corner.row, corner.col, corner.pixel);
            Some(Observation { row, col, panel_mm, pixel, cov: None })
        });
        let view = self.of_corners(corners.collect(), 0);
        let calibration = Calibration::new(Reference::Target(self.board).panels());
        let camera = self.subject.camera.clone();
        let found = calibration.camera("true", vec![view], camera).solve();
        found.map_or(next.camera_from_target, |found| found.frames[0].rig_from_target)
    }

    /// Returns a view taken without a guide that shows the whole board, or at least half of it.
    fn unguided(&mut self, index: usize, whole: bool) -> View {
        let part = if whole { 1.0 } else { MIN_PART };
        let least = (part * self.board.panels[0].corners.len() as f64).ceil() as usize;
        let camera = self.subject.camera.clone();
        let panel = &self.board.panels[0];
        let size = DVec2::new(camera.width.into(), camera.height.into());
        let [left, _, right, _] = panel.bounds_mm();
        loop {
            let at = DVec2::new(self.random.random(), self.random.random()) * size;
            let Some(ray) = camera.unproject(at) else { continue };
            let fill = self.random.random_range(RANDOM_FILL[0]..RANDOM_FILL[1]);
            let distance = camera.focal_px.x * (right - left) / (fill * size.x);
            let sight = ray.direction.normalize();
            let facing = DQuat::from_rotation_arc(DVec3::Z, sight) * DQuat::from_rotation_x(PI);
            let about = self.random.random_range(0.0..TAU);
            let tilt = self.random.random_range(0.0..RANDOM_TILT);
            let axis = DVec3::new(about.cos(), about.sin(), 0.0);
            let roll = self.normal(RANDOM_ROLL).x;
            let rotation =
                facing * DQuat::from_axis_angle(axis, tilt) * DQuat::from_rotation_z(roll);
            let translation = distance * sight - rotation * panel.middle_mm();
            let pose = Pose { rotation, translation };
            // Users do not take images without the board.
            if self.projected(&pose, index).corner_count() < least {
                continue;
            }
            let view = self.view(&pose, index);
            if view.corner_count() >= MIN_CORNERS {
                return view;
            }
        }
    }

    /// Returns the corners detected on the board at a pose, from a rendered image if images are
    /// rendered.
    fn view(&mut self, pose: &Pose, index: usize) -> View {
        let Some((scene, detector)) = self.renderer else { return self.projected(pose, index) };
        let camera = &self.subject.camera;
        let light = Light::default().blur_px(BLUR_PX).noise(NOISE).seed(self.random.random());
        let image = scene.render(camera, pose, &light).map(|v| (v * 255.0 + 0.5) as u8);
        let name = format!("{index:03}");
        let found = [(name.clone(), detector.detect(&image, &format!("{name}.png")))];
        let shown = views(&found, &Reference::Target(self.board)).ok();
        let view = shown.and_then(|shown| shown.views.into_iter().next());
        view.unwrap_or_else(|| self.of_corners(Vec::new(), index))
    }

    /// Returns the corners that a detector would find at a pose, shifted by noise.
    fn projected(&mut self, pose: &Pose, index: usize) -> View {
        let camera = self.subject.camera.clone();
        let noise_px = self.noise_px.unwrap_or_default();
        let panel = &self.board.panels[0];
        let size = DVec2::new(camera.width.into(), camera.height.into());
        let normal = pose.rotation * DVec3::Z;
        let (along, up) = (pose.rotation * DVec3::X, pose.rotation * DVec3::Y);
        let mut observations = Vec::new();
        for corner in &panel.corners {
            let panel_mm = corner.panel_mm.extend(0.0);
            let point = pose.apply(panel_mm);
            let Some(pixel) = camera.project(point) else { continue };
            let edge_px = [along, up].map(|direction| {
                let next = camera.project(point + panel.edge_mm * direction);
                next.map_or(0.0, |next| next.distance(pixel))
            });
            let is_found = -normal.dot(point) > FOUND_TILT_COS * point.length()
                && edge_px[0].min(edge_px[1]) > FOUND_EDGE_PX
                && pixel.cmpge(DVec2::splat(FOUND_MARGIN_PX)).all()
                && pixel.cmple(size - 1.0 - FOUND_MARGIN_PX).all();
            let noise = self.normal(noise_px).truncate();
            if is_found {
                let (row, col) = (corner.row, corner.col);
                let variance = noise_px * noise_px;
                let cov = Some([variance, 0.0, variance]);
                observations.push(Observation { row, col, panel_mm, pixel: pixel + noise, cov });
            }
        }
        self.of_corners(observations, index)
    }

    fn of_corners(&self, observations: Vec<Observation>, index: usize) -> View {
        let Camera { width, height, .. } = self.subject.camera;
        let (name, image) = (format!("{index:03}"), format!("{index:03}.png"));
        let panel = PanelRef::new(0, self.board.panels[0].id);
        let sightings = vec![Sighting { panel, observations }];
        View { name, image, size_px: [width, height], sightings }
    }

    /// Measures the quality of an estimate.
    fn worth(&self, estimate: &Estimate, views: usize, expected_px: Option<f64>) -> Worth {
        let found = &estimate.cameras[0];
        let truth = CameraEstimate::given("true", self.subject.camera.clone());
        let off = |distance: Option<f64>| {
            let compared = Comparison::of(&truth, found, distance, Region::Image);
            compared.map_or(f64::INFINITY, |compared| compared.rms_px)
        };
        let near = found.projection.as_ref().and_then(|known| known.distances_mm.first().copied());
        Worth {
            views,
            off_px: off(None),
            error_near_px: off(near),
            said_px: over_image(found).unwrap_or(f64::INFINITY),
            expected_px,
        }
    }
}

/// Returns the uncertainty that an estimate reports over the image at infinity: RMS per axis, px.
fn over_image(found: &CameraEstimate) -> Option<f64> {
    let Camera { width, height, .. } = found.camera;
    let places = (0..48).map(|i| DVec2::new(f64::from(i % 8) + 0.5, f64::from(i / 8) + 0.5));
    let size = DVec2::new(width.into(), height.into());
    let places = places.map(|at| at / DVec2::new(8.0, 6.0) * size - 0.5);
    let variances = places.filter_map(|at| {
        let [[xx, _], [_, yy]] = found.projection_covariance(at, None, Source::Noise)?;
        Some(0.5 * (xx + yy))
    });
    let variances: Vec<f64> = variances.collect();
    let count = variances.len() as f64;
    (count > 0.0).then(|| (variances.iter().sum::<f64>() / count).sqrt())
}

fn middle<'a>(runs: &[&'a Run], of: impl Fn(&'a Run) -> Option<f64>) -> f64 {
    median(runs.iter().filter_map(|run| of(run)).collect()).unwrap_or(f64::NAN)
}

/// Formats medians over the runs of each camera as tables.
pub fn text(setup: Setup, runs: &[Run]) -> String {
    let mut text = String::new();
    let mut names: Vec<&str> = runs.iter().map(|run| run.subject).collect();
    names.dedup();
    let line = "camera    views            error, px  error near, px  reported, px\n";
    text += line;
    for name in &names {
        let of: Vec<&Run> = runs.iter().filter(|run| run.subject == *name).collect();
        let last = |run: &Run| run.guided.last().copied();
        let few = |of: &[Worth]| of.first().copied().filter(|_| of.len() > 1);
        let wins = |random: fn(&Run) -> &[Worth]| {
            let is_as_good = |run: &&&Run| {
                let both = last(run).zip(random(run).last().copied());
                both.is_some_and(|(guided, random)| guided.off_px <= random.off_px)
            };
            format!(
                "guided is at least as good in {} of {} runs",
                of.iter().filter(is_as_good).count(),
                of.len()
            )
        };
        type Which<'a> = (&'a str, usize, &'a dyn Fn(&Run) -> Option<Worth>, String);
        let rows: [Which; 5] = [
            ("guided", setup.guided, &last, String::new()),
            ("random", setup.guided, &|run| few(&run.random), String::new()),
            ("random", setup.random, &|run| run.random.last().copied(), wins(|run| &run.random)),
            ("cut off", setup.guided, &|run| few(&run.cut_off), String::new()),
            ("cut off", setup.random, &|run| run.cut_off.last().copied(), wins(|run| &run.cut_off)),
        ];
        for (kind, views, which, note) in rows {
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "{name:9} {views:3} {kind:10}   {:9.4}  {:14.4}  {:12.4}  {note}",
                middle(&of, |run| which(run).map(|worth| worth.off_px)),
                middle(&of, |run| which(run).map(|worth| worth.error_near_px)),
                middle(&of, |run| which(run).map(|worth| worth.said_px)),
            );
        }
    }
    text += "\ncamera    view  expected, px  reported, px  error, px  reported / expected\n";
    for name in &names {
        let of: Vec<&Run> = runs.iter().filter(|run| run.subject == *name).collect();
        for view in 1..=setup.guided {
            let at = |run: &Run| run.guided.iter().find(|worth| worth.views == view).copied();
            if of.iter().all(|run| at(run).is_none()) {
                continue;
            }
            let known =
                of.iter().any(|run| at(run).is_some_and(|worth| worth.expected_px.is_some()));
            let shown = |value: f64, places: usize| match known {
                true => format!("{value:.places$}"),
                false => String::new(),
            };
            let expected = shown(middle(&of, |run| at(run)?.expected_px), 4);
            let ratio = middle(&of, |run| Some(at(run)?.said_px / at(run)?.expected_px?));
            let ratio = shown(ratio, 2);
            let _ = writeln!(
                text,
                "{name:9} {view:4}  {expected:>12}  {:12.4}  {:9.4}  {ratio:>19}",
                middle(&of, |run| Some(at(run)?.said_px)),
                middle(&of, |run| Some(at(run)?.off_px)),
            );
        }
    }
    text
}

/// Formats every run and number of views as CSV, for plots.
pub fn csv(runs: &[Run]) -> String {
    let mut text = "camera,run,kind,views,off_px,error_near_px,stated_px,expected_px\n".to_owned();
    let mut run_of: (&str, usize) = ("", 0);
    for run in runs {
        run_of = (run.subject, if run_of.0 == run.subject { run_of.1 + 1 } else { 0 });
        for (kind, worths) in
            [("guided", &run.guided), ("random", &run.random), ("cut off", &run.cut_off)]
        {
            for worth in worths {
                let expected = worth.expected_px.map_or(String::new(), |px| format!("{px:.6}"));
                let Worth { views, off_px, error_near_px, said_px, .. } = worth;
                let _ = writeln!(
                    text,
                    "{},{},{kind},{views},{off_px:.6},{error_near_px:.6},{said_px:.6},{expected}",
                    run.subject, run_of.1
                );
            }
        }
    }
    text
}
