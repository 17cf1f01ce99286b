//! Simulation of §4.4 of the paper: a rig of four cameras, calibrated with an icosahedron of deltille boards and with a
//! cube of checkerboards. The panels of both were glued on imprecisely.
//!
//! ```text
//!        c2 ──── c3       Four cameras at the corners of a square of 0.5 m, all facing the target
//!         │      │        at 0.8 m. They are 20° wide and take their images simultaneously.
//!        c0 ──── c1
//! ```
//!
//! Every image is rendered, and its corners are detected. The rig is then calibrated twice: with the panels at their
//! nominal poses, and with their poses as unknowns.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DMat3, DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use deltille::artwork::ArtworkError;
use deltille::calibrate::{Calibration, CalibrationError, Estimate, Model, Reference, views};
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::lattice::GridKind;
use deltille::synth::{Light, Scene, scene_of_target};
use deltille::targets::{
    BoardSpec, ListFormat, ListedSpec, PanelPose, SolidShape, SolidSpec, Target, TargetError,
    TargetSpec, UnknownCodes,
};

/// Number of cameras of the rig.
pub const CAMERAS: usize = 4;

/// Horizontal field of view, rad (20°).
const FIELD_RAD: f64 = 0.349_065_850_398_865_9;
/// Distance of the target from the cameras, and half the distance between the cameras, mm.
const DISTANCE_MM: f64 = 800.0;
const BASE_MM: f64 = 250.0;
/// Range of motion of the target, sideways and in depth, mm: it stays in the field of view, which
/// is 280 mm wide.
const MOVED_MM: [f64; 2] = [12.0, 40.0];
/// Standard deviations of the position and the orientation of a panel, mm and rad (0.1°).
const PLACED_MM: f64 = 0.1;
const PLACED_RAD: f64 = 0.001_745_329_251_994_33;
/// Edge of the icosahedron and of the cube, mm: both have circumscribed spheres of the same size.
const ICOSAHEDRON_MM: f64 = 100.0;
const CUBE_MM: f64 = 110.0;
/// Number of squares along the edge of the cube, and the quiet zone around them, mm.
const SQUARES: u32 = 10;
const QUIET_MM: f64 = 5.0;

/// Parameters of the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setup {
    /// Width of the images, px; the height is three quarters of it.
    pub width: u32,
    /// Number of frames; in each, every camera takes an image.
    pub frames: usize,
    /// Seed of all random choices.
    pub seed: u64,
}

/// The calibration object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Object {
    /// Twenty faces with DelTags.
    Icosahedron,
    /// Six faces with checkerboards and square tags.
    Cube,
}

impl Object {
    /// Both objects.
    pub const ALL: [Object; 2] = [Self::Icosahedron, Self::Cube];

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Icosahedron => "icosahedron",
            Self::Cube => "cube",
        }
    }
}

/// Result of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The calibration object.
    pub object: Object,
    /// Whether the poses of the panels were refined.
    pub refined: bool,
    /// RMS reprojection error per axis, px.
    pub rms_px: f64,
    /// RMS reprojection error per axis of each frame, px.
    pub frames_px: Vec<f64>,
    /// Number of excluded frames.
    pub left_out: usize,
    /// Number of detected corners.
    pub corners: usize,
    /// RMS errors over the cameras: focal length, relative; principal point, px.
    pub focal: f64,
    /// See `focal`.
    pub centre_px: f64,
    /// RMS errors of the cameras' positions and orientations relative to the first camera, mm and rad.
    pub position_mm: f64,
    /// See `position_mm`.
    pub rotation_rad: f64,
}

/// Reason why an experiment failed.
#[derive(Debug, thiserror::Error)]
pub enum RigExperimentError {
    /// The target cannot be built.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// The codes of its tags are unknown.
    #[error(transparent)]
    Family(#[from] UnknownCodes),
    /// The target cannot be drawn.
    #[error(transparent)]
    Artwork(#[from] ArtworkError),
    /// The calibration failed, for example because of too few frames.
    #[error("{}: {error}", object.name())]
    Calibration {
        /// Calibration object.
        object: Object,
        /// Reason.
        error: CalibrationError,
    },
}

/// The true rig and target.
struct World {
    camera: Camera,
    camera_from_world: Vec<Pose>,
    world_from_target: Vec<Pose>,
}

impl World {
    fn new(setup: Setup) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(setup.seed);
        let (width, height) = (setup.width, setup.width * 3 / 4);
        let focal = f64::from(width) / 2.0 / (FIELD_RAD / 2.0).tan();
        let lens = BrownConrady { radial: [-0.1, 0.05, 0.0], ..BrownConrady::default() };
        let mut camera = Camera::centred(width, height, focal, Lens::BrownConrady(lens));
        camera.centre_px += 0.01 * f64::from(width);
        let depth = (DISTANCE_MM * DISTANCE_MM - 2.0 * BASE_MM * BASE_MM).sqrt();
        let camera_from_world = (0..CAMERAS).map(|index| {
            let side = |bit: usize| if index & bit == 0 { -BASE_MM } else { BASE_MM };
            Pose::looking_at(DVec3::new(side(1), side(2), depth), DVec3::ZERO, DVec3::Y)
        });
        let camera_from_world = camera_from_world.collect();
        let world_from_target = (0..setup.frames).map(|_| {
            let [x, y, z, w] = [0; 4].map(|_| StandardNormal.sample(&mut random));
            let [aside, deep] = MOVED_MM;
            let moved = [aside, aside, deep].map(|mm| random.random_range(-mm..mm));
            Pose {
                rotation: DQuat::from_xyzw(x, y, z, w).normalize(),
                translation: DVec3::from(moved),
            }
        });
        let world_from_target = world_from_target.collect();
        Self { camera, camera_from_world, world_from_target }
    }

    fn camera_from_rig(&self, index: usize) -> Pose {
        self.camera_from_world[index].after(&self.camera_from_world[0].inverse())
    }
}

/// Renders, detects and calibrates; returns `None` if interrupted. `tick` is called after every
/// image; each camera and frame has two images, one per object.
///
/// # Errors
/// Returns an error if a target cannot be built, or a calibration fails.
pub fn run(
    setup: Setup,
    interrupted: &AtomicBool,
    tick: &(dyn Fn() + Sync),
) -> Result<Option<Vec<Outcome>>, RigExperimentError> {
    let world = World::new(setup);
    let mut outcomes = Vec::new();
    for object in Object::ALL {
        let stated = target(object)?;
        let scene = scene_of_target(&misplaced(&stated, setup.seed))?;
        let detector = Detector::for_target(&stated, DetectorConfig::default())?;
        let images: Vec<(usize, usize)> = (0..CAMERAS)
            .flat_map(|camera| (0..setup.frames).map(move |frame| (camera, frame)))
            .collect();
        let found: Option<Vec<(usize, String, Detection)>> = images
            .into_par_iter()
            .map(|(camera, frame)| {
                if interrupted.load(Ordering::Relaxed) {
                    return None;
                }
                let detection =
                    render_and_detect(&world, &scene, &detector, camera, frame, setup.seed);
                tick();
                Some((camera, format!("{frame:04}"), detection))
            })
            .collect();
        let Some(found) = found else { return Ok(None) };
        let failed = |error| RigExperimentError::Calibration { object, error };
        let reference = Reference::Target(&stated);
        let mut calibration = Calibration::new(reference.panels());
        for index in 0..CAMERAS {
            let of_camera = found.iter().filter(|(camera, ..)| *camera == index);
            let of_camera: Vec<(String, Detection)> =
                of_camera.map(|(_, name, detection)| (name.clone(), detection.clone())).collect();
            let views = views(&of_camera, &reference).map_err(failed)?.views;
            calibration = calibration.camera(&format!("c{index}"), views, Model::Radtan);
        }
        for refined in [false, true] {
            let found = calibration.clone().refine_panels(refined).solve().map_err(failed)?;
            outcomes.push(Outcome::new(object, refined, &world, &found));
        }
    }
    Ok(Some(outcomes))
}

fn render_and_detect(
    world: &World,
    scene: &Scene,
    detector: &Detector,
    camera: usize,
    frame: usize,
    seed: u64,
) -> Detection {
    let pose = world.camera_from_world[camera].after(&world.world_from_target[frame]);
    let number = (camera * world.world_from_target.len() + frame) as u64;
    let light = Light::default().seed(seed.wrapping_add(number));
    let image = scene.render(&world.camera, &pose, &light);
    detector.detect(&image.map(|v| (v * 255.0 + 0.5) as u8), "")
}

/// Returns the nominal target.
fn target(object: Object) -> Result<Target, RigExperimentError> {
    let spec = match object {
        Object::Icosahedron => TargetSpec::Solid(SolidSpec {
            edge_mm: ICOSAHEDRON_MM,
            ..SolidSpec::new(SolidShape::Icosahedron)
        }),
        Object::Cube => {
            let edge_mm = (CUBE_MM - 2.0 * QUIET_MM) / f64::from(SQUARES);
            let board = BoardSpec::new(GridKind::Checker, SQUARES - 1, SQUARES - 1, edge_mm);
            TargetSpec::Board(BoardSpec { boards: 6, ..board })
        }
    };
    let target = Target::new(object.name(), spec)?;
    if object == Object::Icosahedron {
        return Ok(target);
    }
    let faces: Vec<PanelPose> =
        (0..6).map(|face| cube_face(face, target.panels[face].field_mm())).collect();
    // Its boards are no longer independent: they have a common frame.
    let spec = TargetSpec::Listed(ListedSpec { format: ListFormat::DscFork });
    let mut cube = target.with_poses(&faces);
    cube.spec = spec;
    Ok(cube)
}

/// Returns the pose of a board of `field_mm` on a face of the cube: ±x, ±y, ±z.
fn cube_face(face: usize, [left, lower, right, upper]: [f64; 4]) -> PanelPose {
    let sign = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    let normal = sign * DVec3::AXES[face / 2];
    let along = DVec3::AXES[(face / 2 + 1) % 3];
    let up = normal.cross(along);
    let middle = along * (left + right) / 2.0 + up * (lower + upper) / 2.0;
    PanelPose::new(DMat3::from_cols(along, up, normal), normal * CUBE_MM / 2.0 - middle)
}

/// Returns the target with its panels as they were glued on.
fn misplaced(target: &Target, seed: u64) -> Target {
    let mut random = ChaCha8Rng::seed_from_u64(!seed);
    let mut normal = |sd: f64| {
        let [x, y, z]: [f64; 3] = [0; 3].map(|_| StandardNormal.sample(&mut random));
        sd * DVec3::new(x, y, z)
    };
    let poses = target.panels.iter().map(|panel| {
        let turn = DMat3::from_quat(DQuat::from_scaled_axis(normal(PLACED_RAD)));
        // A panel is rotated about its own centre.
        let middle = panel.middle_mm();
        let arm = panel.pose.translation_mm - middle;
        PanelPose::new(turn * panel.pose.matrix(), middle + turn * arm + normal(PLACED_MM))
    });
    target.with_poses(&poses.collect::<Vec<_>>())
}

impl Outcome {
    fn new(object: Object, refined: bool, world: &World, found: &Estimate) -> Self {
        let rms = |errors: Vec<f64>| {
            (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt()
        };
        let truth = &world.camera;
        let cameras = || found.cameras.iter();
        let focal = cameras().flat_map(|c| (c.camera.focal_px / truth.focal_px - 1.0).to_array());
        let centre = cameras().flat_map(|c| (c.camera.centre_px - truth.centre_px).to_array());
        let off = cameras().enumerate().skip(1).map(|(index, camera)| {
            let truth = world.camera_from_rig(index);
            let place = camera.camera_from_rig.inverse().translation - truth.inverse().translation;
            (place.length(), camera.camera_from_rig.rotation.angle_between(truth.rotation))
        });
        let (places, rotations): (Vec<f64>, Vec<f64>) = off.unzip();
        Self {
            object,
            refined,
            rms_px: found.rms_px,
            frames_px: found.frames.iter().map(|frame| frame.rms_px).collect(),
            left_out: found.excluded.len(),
            corners: found.corner_count(),
            focal: rms(focal.collect()),
            centre_px: rms(centre.collect()),
            position_mm: rms(places),
            rotation_rad: rms(rotations),
        }
    }
}

/// Formats the outcomes as a table.
pub fn text(outcomes: &[Outcome]) -> String {
    let mut text = "target       panels   corners  rms px  worst frame  focal %  centre px  position mm  rotation °\n"
        .to_owned();
    for outcome in outcomes {
        let worst = outcome.frames_px.iter().copied().fold(0.0, f64::max);
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{:12} {:8} {:7}  {:.4}  {worst:11.4}  {:7.4}  {:9.3}  {:11.4}  {:10.5}{}",
            outcome.object.name(),
            if outcome.refined { "refined" } else { "stated" },
            outcome.corners,
            outcome.rms_px,
            100.0 * outcome.focal,
            outcome.centre_px,
            outcome.position_mm,
            outcome.rotation_rad.to_degrees(),
            match outcome.left_out {
                0 => String::new(),
                n => format!("  ({n} excluded)"),
            }
        );
    }
    text
}

/// Formats the error of every frame as CSV, as in Fig. 8 of the paper.
pub fn csv(outcomes: &[Outcome]) -> String {
    let mut text = "target,panels,frame,rms_px\n".to_owned();
    for outcome in outcomes {
        let panels = if outcome.refined { "refined" } else { "stated" };
        for (frame, rms_px) in outcome.frames_px.iter().enumerate() {
            let _ = writeln!(text, "{},{panels},{frame},{rms_px:.6}", outcome.object.name());
        }
    }
    text
}
