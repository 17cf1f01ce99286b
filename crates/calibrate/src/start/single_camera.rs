//! The start of a single camera: its lens, and the poses of its views.

use glam::DVec3;

use super::consensus::agreeing;
use super::first_camera::first_camera;
use super::frames::{Frame, Start};
use super::pose::{blocks, estimate_pose, fixed, median_off_px};
use super::splined::splined;
use crate::equations::minimise::{Until, minimise};
use crate::error::CalibrationError;
use crate::excluded::Reason;
use crate::input::calibration::{Calibration, CameraViews};
use crate::input::constraint::Constrained;
use crate::input::intrinsics::Intrinsics;
use crate::input::loss::Loss;
use crate::input::observation::View;
use crate::model::Model;
use crate::problem::bundle::Problem;
use crate::problem::roughness::Roughness;
use crate::problem::unknowns::{CameraUnknowns, TargetUnknowns};
use crate::problem::whitening::scale;
use deltille_core::camera::{Camera, Lens, Pose};
use deltille_core::statistics::median;

/// Minimum number of views: two views of a plane determine focal length and principal point if
/// there are no errors; a third view reveals errors.
const MIN_VIEWS: usize = 3;

/// Parametric lenses from which a spline may start: a fisheye and a perspective lens.
const FORERUNNERS: [Model; 2] = [Model::KannalaBrandt(4), Model::Radtan5];

/// Largest angle between the normals of boards that count as parallel. Corner noise of a twentieth
/// of a pixel on a board of 500 px already causes an apparent tilt of one degree.
const PARALLEL_RAD: f64 = 0.05;

pub(crate) fn start(calibration: &Calibration) -> Result<Start, CalibrationError> {
    let CameraViews { views, intrinsics, .. } = &calibration.cameras[0];
    let panels = calibration.panel_poses();
    let by = calibration.cameras[0].constrained()?;
    let search = match intrinsics {
        Intrinsics::Unknown(model) => {
            Search::without_guess(views, &panels, &by, *model, calibration.start)?
        }
        Intrinsics::Known(camera) | Intrinsics::Near { camera, .. } => {
            Search::with_camera(views, &panels, &by, camera)?
        }
    };
    let (used, problem) = search.problem(views, by.free.clone());
    let out = (0..views.len()).filter(|index| !used.contains(index));
    let excluded = out.map(|index| (index, views[index].excluded(Reason::NoPose))).collect();
    let frame =
        |view: usize| Frame { name: views[view].name.clone(), place: view, views: vec![(0, view)] };
    let frames = used.into_iter().map(frame).collect();
    Ok(Start { problem, frames, excluded, delays: vec![0], rotations: vec![None] })
}

/// Returns an error if there are too few views for a calibration.
pub(crate) fn enough(found: usize, all: usize) -> Result<(), CalibrationError> {
    match found < MIN_VIEWS {
        true => Err(CalibrationError::TooFewViews { found, all, needed: MIN_VIEWS }),
        false => Ok(()),
    }
}

/// The current camera and poses.
struct Search<'a> {
    /// The views, with only those corners that agree with each other.
    views: Vec<View>,
    panels: &'a [Pose],
    by: Constrained,
    camera: Camera,
    /// The prior of the knots of a spline that started from another lens.
    roughness: Option<Roughness>,
    /// The pose of each view; `None` if no pose fits the view.
    poses: Vec<Option<Pose>>,
}

impl<'a> Search<'a> {
    /// Finds a camera of a model that explains the views.
    fn without_guess(
        views: &[View],
        panels: &'a [Pose],
        by: &Constrained,
        model: Model,
        start: Option<usize>,
    ) -> Result<Self, CalibrationError> {
        if let Model::Spline { degree, knots } = model {
            return Self::of_spline(views, panels, by, degree, knots);
        }
        enough(views.len(), views.len())?;
        let agreeing: Vec<View> = views.iter().map(agreeing).collect();
        let ideal = first_camera(&agreeing, model).ok_or(CalibrationError::NoStart)?;
        let [width, height] = views[0].size_px;
        let poses: Vec<Option<Pose>> =
            agreeing.iter().map(|view| estimate_pose(&ideal, panels, &view.sightings)).collect();
        let from = |(lens, scale): (Lens, f64)| {
            let camera = Camera::centred(width, height, scale * ideal.focal_px.x, lens);
            let (views, poses) = (agreeing.clone(), poses.clone());
            let mut search =
                Search { views, panels, by: by.clone(), camera, roughness: None, poses };
            let free = &by.free;
            let coarse = model.coarse().into_iter().zip(free).map(|(coarse, free)| coarse && *free);
            search.adjust(coarse.collect())?;
            search.adjust(free.clone())?;
            search.reestimate_poses();
            search.adjust(free.clone())?;
            Ok((search.error_px(), search))
        };
        // The best of all starts; an error if all fail.
        let starts = model.starts().into_iter().enumerate();
        let starts = starts.filter(|(index, _)| start.is_none_or(|start| start == *index));
        let found = starts.map(|(_, start)| from(start));
        let error = |found: &Result<(f64, Search), CalibrationError>| {
            found.as_ref().map_or(f64::INFINITY, |f| f.0)
        };
        let best = found.min_by(|a, b| error(a).total_cmp(&error(b)));
        let (_, search) = best.ok_or(CalibrationError::NoStart)??;
        // A given focal length determines the distance.
        if panels.len() == 1 && by.free[..2] == [true, true] {
            check_tilts(&search.poses)?;
        }
        Ok(search)
    }

    /// A spline that starts as the parametric lens that explains the views best.
    fn of_spline(
        views: &[View],
        panels: &'a [Pose],
        by: &Constrained,
        degree: usize,
        knots: Option<[usize; 2]>,
    ) -> Result<Self, CalibrationError> {
        let found = FORERUNNERS.map(|model| {
            let free = Constrained { free: model.free(), ..Constrained::default() };
            let search = Search::without_guess(views, panels, &free, model, None)?;
            Ok((search.error_px(), search.splined(by, model, degree, knots)))
        });
        let error = |found: &Result<(f64, Option<Self>), CalibrationError>| {
            found.as_ref().map_or(f64::INFINITY, |(error, _)| *error)
        };
        let best = found.into_iter().min_by(|a, b| error(a).total_cmp(&error(b)));
        best.ok_or(CalibrationError::NoStart)??.1.ok_or(CalibrationError::NoStart)
    }

    /// The same search with the lens replaced by an equivalent spline.
    fn splined(
        self,
        by: &Constrained,
        model: Model,
        degree: usize,
        knots: Option<[usize; 2]>,
    ) -> Option<Self> {
        let sightings = self.views.iter().flat_map(|view| &view.sightings);
        let seen = sightings.flat_map(|sighting| &sighting.observations).map(|seen| seen.pixel);
        let (camera, roughness) = splined(&self.camera, &model.free(), seen, degree, knots)?;
        Some(Self { camera, by: by.clone(), roughness: Some(roughness), ..self })
    }

    /// Computes the poses of the views of a camera.
    fn with_camera(
        views: &[View],
        panels: &'a [Pose],
        by: &Constrained,
        camera: &Camera,
    ) -> Result<Self, CalibrationError> {
        let size_px = [camera.width, camera.height];
        if let Some(view) = views.iter().find(|view| view.size_px != size_px) {
            return Err(CalibrationError::OtherSize {
                camera_px: size_px,
                view: view.name.clone(),
                view_px: view.size_px,
            });
        }
        let views: Vec<View> = views.iter().map(agreeing).collect();
        let camera = by.apply(camera);
        let pose = |view: &View| estimate_pose(&camera, panels, &view.sightings);
        let poses = views.iter().map(pose).collect();
        Ok(Self { views, panels, by: by.clone(), camera, roughness: None, poses })
    }

    /// The views that have a pose and that the camera can image, and the problem that consists of
    /// their observations.
    fn problem(&self, views: &[View], free: Vec<bool>) -> (Vec<usize>, Problem) {
        let mut camera = CameraUnknowns::constrained(&self.camera, free, &self.by);
        if let Some(roughness) = &self.roughness {
            camera.roughness = Some(roughness.clone());
        }
        let mut problem = Problem {
            cameras: vec![camera],
            targets: vec![TargetUnknowns::SCENE],
            panels: fixed(self.panels),
            ..Problem::default()
        };
        let mut used = Vec::new();
        for (index, (view, pose)) in views.iter().zip(&self.poses).enumerate() {
            let Some(pose) = pose else { continue };
            problem.frames.push(*pose);
            let first = problem.blocks.len();
            problem.blocks.extend(blocks(&view.sightings, used.len()));
            if problem.blocks[first..]
                .iter()
                .all(|block| problem.residuals(block).all(|off| off.is_some()))
            {
                used.push(index);
            } else {
                problem.blocks.truncate(first);
                problem.frames.pop();
            }
        }
        (used, problem)
    }

    /// Adjusts the bundle with a loss that gives wrong corners and views almost no influence.
    fn adjust(&mut self, free: Vec<bool>) -> Result<(), CalibrationError> {
        let (used, problem) = self.problem(&self.views, free);
        enough(used.len(), self.views.len())?;
        let whitening = scale(&problem);
        let minimum = minimise(problem, &whitening, Loss::Cauchy, Until::Rough)
            .ok_or(CalibrationError::NoStart)?;
        self.camera = minimum.problem.cameras[0].camera.clone();
        for (index, pose) in used.into_iter().zip(minimum.problem.frames) {
            self.poses[index] = Some(pose);
        }
        Ok(())
    }

    /// Re-estimates the pose of every view with the nearly known camera, and keeps the better pose.
    fn reestimate_poses(&mut self) {
        for (view, pose) in self.views.iter().zip(&mut self.poses) {
            let again = estimate_pose(&self.camera, self.panels, &view.sightings);
            let error = |pose: &Option<Pose>| {
                pose.map_or(f64::INFINITY, |pose| {
                    median_off_px(&self.camera, self.panels, &view.sightings, &pose)
                })
            };
            if error(&again) < error(pose) {
                *pose = again;
            }
        }
    }

    /// Median over all views of the median residual of their corners, px.
    fn error_px(&self) -> f64 {
        let views = self.views.iter().zip(&self.poses);
        let error = |(view, pose): (&View, &Option<Pose>)| {
            pose.map_or(f64::INFINITY, |pose| {
                median_off_px(&self.camera, self.panels, &view.sightings, &pose)
            })
        };
        median(views.map(error).collect()).unwrap_or(0.0)
    }
}

/// Returns an error if the board was never tilted.
fn check_tilts(poses: &[Option<Pose>]) -> Result<(), CalibrationError> {
    let normals = || poses.iter().flatten().map(|pose| pose.rotation * DVec3::Z);
    let mean = normals().sum::<DVec3>().normalize_or(DVec3::Z);
    let spread = normals().map(|normal| normal.angle_between(mean)).fold(0.0, f64::max);
    match spread < PARALLEL_RAD {
        true => Err(CalibrationError::Parallel { spread_deg: spread.to_degrees() }),
        false => Ok(()),
    }
}
