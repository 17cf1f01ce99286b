use glam::DVec3;

use super::consensus::agreeing;
use super::error::CalibrationError;
use super::excluded::Excluded;
use super::finding::Finding;
use super::gross::{Gross, Kept, WrongFrame, within_pictures};
use super::loss::Loss;
use super::minimise::{Minimum, Until, minimise};
use super::misfit::misfits;
use super::model::Model;
use super::normal::Covariances;
use super::pose::{blocks, estimate_pose, fixed};
use super::problem::{CameraUnknowns, Problem};
use super::settle::{Settled, scale, settle, variance};
use super::shape::{self, BoardShape, Shape};
use super::solution::{Corner, Parameter, Solution, ViewSolution, rms_px};
use super::start::first_camera;
use super::view::{MIRRORED, View};
use super::weights::Weights;
use crate::camera::{Camera, Lens, PROJECTION_PARAMETERS, Pose};
use crate::statistics::median;

/// Two views of a plane determine focal lengths and principal point if nothing is off; a third
/// shows whether something is.
const LEAST_VIEWS: usize = 3;

/// Boards whose normals differ by less count as parallel. A corner's noise of a twentieth of a
/// pixel on a board of 500 px already looks like a tilt of one degree.
const PARALLEL_RAD: f64 = 0.05;

/// Focal lengths and the principal point are not determined when a deviation is more than this part
/// of the focal length: equations that are linear near the solution, as deviations are computed from,
/// are then off by as much as they say, and the deviation means nothing.
const LOOSE_FOCAL: f64 = 0.1;

/// Why a view is left out that shows nothing but panels that are.
pub(super) const ONLY_WRONG_PANELS: &str =
    "it shows only panels that are not where the target's file has them";

/// How a camera is calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// What is to be found.
    pub model: Model,
    /// How corners far off count.
    pub loss: Loss,
    /// How corners are weighted.
    pub weights: Weights,
}

/// Finds a camera and the poses of its views; `panels` are the poses of the target's panels on it,
/// see [`Reference::panels`](super::Reference::panels).
pub fn calibrate(
    views: &[View],
    panels: &[Pose],
    options: Options,
) -> Result<Solution, CalibrationError> {
    calibrated(views, panels, options, false)
}

/// [`calibrate`], and finds how the sheet of the board, which is of one panel, differs from its plan.
pub fn calibrate_with_shape(
    views: &[View],
    panels: &[Pose],
    options: Options,
) -> Result<Solution, CalibrationError> {
    if panels.len() > 1 {
        return Err(CalibrationError::ShapeOfMany { panels: panels.len() });
    }
    calibrated(views, panels, options, true)
}

pub(super) fn calibrated(
    views: &[View],
    panels: &[Pose],
    options: Options,
    with_shape: bool,
) -> Result<Solution, CalibrationError> {
    let (views, beyond) = within_pictures(views, 0);
    let views = views.as_slice();
    enough(views.len(), views.len())?;
    let agreeing: Vec<View> = views.iter().map(agreeing).collect();
    let ideal = first_camera(&agreeing, options.model).ok_or(CalibrationError::NoStart)?;
    let [width, height] = views[0].size_px;
    let poses: Vec<Option<Pose>> =
        agreeing.iter().map(|view| estimate_pose(&ideal, panels, &view.sightings)).collect();
    let from = |(lens, scale): (Lens, f64)| {
        let camera = Camera::centred(width, height, scale * ideal.focal_px[0], lens);
        let agreeing = agreeing.clone();
        let mut search = Search { views, agreeing, panels, camera, poses: poses.clone() };
        search.adjust(options.model.coarse())?;
        search.adjust(options.model.free())?;
        search.look_again();
        search.adjust(options.model.free())?;
        Ok((search.error_px(), search))
    };
    // The best of all starts; an error where none leads anywhere.
    let found = options.model.starts().into_iter().map(from);
    let error = |found: &Result<(f64, Search), _>| found.as_ref().map_or(f64::INFINITY, |f| f.0);
    let best = found.min_by(|a, b| error(a).total_cmp(&error(b)));
    let (_, search) = best.ok_or(CalibrationError::NoStart)??;
    if panels.len() == 1 {
        check_tilts(&search.poses)?;
    }
    let solution =
        search.finish(options.model.free(), options.loss, options.weights, with_shape)?;
    check_focal(&solution)?;
    Ok(with_findings(solution, beyond))
}

/// The same with findings that were made before.
fn with_findings(mut solution: Solution, before: Vec<Finding>) -> Solution {
    solution.findings.splice(0..0, before);
    solution
}

/// Finds only the poses of the views of a known camera.
pub fn poses(
    views: &[View],
    panels: &[Pose],
    camera: &Camera,
    loss: Loss,
    weights: Weights,
) -> Result<Solution, CalibrationError> {
    let kept = vec![false; camera.parameters().len()];
    given(views, panels, camera, loss, weights, kept, false)
}

/// [`poses`], and the parameters of the camera that are `free`, and the shape of the board.
pub(super) fn given(
    views: &[View],
    panels: &[Pose],
    camera: &Camera,
    loss: Loss,
    weights: Weights,
    free: Vec<bool>,
    with_shape: bool,
) -> Result<Solution, CalibrationError> {
    if let Some(view) = views.iter().find(|view| view.size_px != [camera.width, camera.height]) {
        return Err(CalibrationError::MixedSizes {
            first: "the camera".to_owned(),
            first_px: [camera.width, camera.height],
            other: view.name.clone(),
            other_px: view.size_px,
        });
    }
    let (views, beyond) = within_pictures(views, 0);
    let agreeing: Vec<View> = views.iter().map(agreeing).collect();
    let pose = |view: &View| estimate_pose(camera, panels, &view.sightings);
    let poses = agreeing.iter().map(pose).collect();
    let search = Search { views: &views, agreeing, panels, camera: camera.clone(), poses };
    Ok(with_findings(search.finish(free, loss, weights, with_shape)?, beyond))
}

fn enough(found: usize, all: usize) -> Result<(), CalibrationError> {
    match found < LEAST_VIEWS {
        true => Err(CalibrationError::TooFewViews { found, all, needed: LEAST_VIEWS }),
        false => Ok(()),
    }
}

/// The camera and the poses on the way.
struct Search<'a> {
    views: &'a [View],
    /// The same with only those corners that agree with each other, from which poses start.
    agreeing: Vec<View>,
    panels: &'a [Pose],
    camera: Camera,
    /// `None` where a view has no pose that the camera can have seen, or does not belong.
    poses: Vec<Option<Pose>>,
}

impl Search<'_> {
    /// The views that have a pose and are within the camera's reach, and the problem of what is seen in
    /// them.
    fn problem(&self, views: &[View], free: Vec<bool>) -> (Vec<usize>, Problem) {
        let mut problem = Problem {
            cameras: vec![CameraUnknowns::alone(self.camera.clone(), free)],
            panels: fixed(self.panels),
            ..Problem::default()
        };
        let mut used = Vec::new();
        for (index, (view, pose)) in views.iter().zip(&self.poses).enumerate() {
            let Some(pose) = pose else { continue };
            problem.frames.push(*pose);
            let first = problem.blocks.len();
            problem.blocks.extend(blocks(&view.sightings, used.len()));
            if problem.blocks[first..].iter().all(|block| problem.residuals(block).is_some()) {
                used.push(index);
            } else {
                problem.blocks.truncate(first);
                problem.frames.pop();
            }
        }
        (used, problem)
    }

    /// Bundle adjustment in which wrong corners and wrong views hardly count.
    fn adjust(&mut self, free: Vec<bool>) -> Result<(), CalibrationError> {
        let (used, problem) = self.problem(&self.agreeing, free);
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

    /// Estimates the pose of every view anew, now that the camera is nearly known, and keeps the
    /// better one.
    fn look_again(&mut self) {
        for (view, pose) in self.agreeing.iter().zip(&mut self.poses) {
            let again = estimate_pose(&self.camera, self.panels, &view.sightings);
            let error = |pose: &Option<Pose>| {
                pose.map_or(f64::INFINITY, |pose| {
                    view_error_px(&self.camera, self.panels, view, pose)
                })
            };
            if error(&again) < error(pose) {
                *pose = again;
            }
        }
    }

    /// Median over all views of the median error of their corners, px.
    fn error_px(&self) -> f64 {
        let views = self.agreeing.iter().zip(&self.poses);
        let error = |(view, pose): (&View, &Option<Pose>)| {
            pose.map_or(f64::INFINITY, |pose| view_error_px(&self.camera, self.panels, view, pose))
        };
        median(views.map(error).collect()).unwrap_or(0.0)
    }

    /// Leaves out views that do not belong, and solves for what is asked.
    fn finish(
        &self,
        free: Vec<bool>,
        loss: Loss,
        weights: Weights,
        with_shape: bool,
    ) -> Result<Solution, CalibrationError> {
        let calibrating = free.contains(&true);
        let (used, all) = self.problem(self.views, free);
        let gross = Gross::of(all).ok_or(CalibrationError::NoStart)?;
        if calibrating {
            enough(used.len() - gross.frames.len(), self.views.len())?;
        }
        let (gross, mut settled) = gross.settled(weights, loss, |_| ())?;
        let kept: Vec<usize> = gross.belonging().map(|frame| used[frame]).collect();
        let excluded = self.views.iter().enumerate().filter(|(index, _)| !kept.contains(index));
        let excluded = excluded.map(|(index, view)| {
            let frame = used.iter().position(|used| *used == index);
            let why = match frame.and_then(|frame| gross.frames.get(&frame)) {
                Some(WrongFrame::Off { off_px, .. }) => format!(
                    "its corners are off by {off_px:.1} px where those of other views are by {:.2} px: \
                     wrong labels, or another target",
                    gross.usual_px
                ),
                Some(WrongFrame::Mirrored) => MIRRORED.to_owned(),
                Some(WrongFrame::Stranger { deviations }) => format!(
                    "it speaks for another camera than the other views do, and would move theirs by \
                     {deviations:.1} deviations: another zoom, focus or crop, or a board that was bent"
                ),
                Some(WrongFrame::OnlyWrongPanels) => ONLY_WRONG_PANELS.to_owned(),
                None => "no pose explains its corners: wrong labels, another target, or corners \
                         where the lens model has ended"
                    .to_owned(),
            };
            view.excluded(why)
        });
        let excluded = excluded.collect();

        let mut f_ratio = 0.0;
        if with_shape {
            let flat = settled.minimum.normal.cost;
            let mut problem = settled.minimum.problem;
            let observations = problem.blocks.iter().flat_map(|block| &block.observations);
            problem.shape = Some(Shape::flat(observations.map(|seen| seen.panel_mm)));
            // Compared under the same weights.
            let bent = minimise(problem, &settled.whitening, loss, Until::Fine)
                .ok_or(CalibrationError::NoStart)?;
            f_ratio = (flat - bent.normal.cost) / shape::COUNT as f64 / variance(&bent);
            let problem = settled.problem.at(&bent.problem);
            settled = settle(Kept { problem, ..gross.kept() }, weights, loss)?;
        }
        let findings = gross.findings(&settled, |frame| self.views[used[frame]].name.clone());
        let solution = self.solution(&kept, excluded, &settled, f_ratio)?;
        Ok(Solution { findings, ..solution })
    }

    fn solution(
        &self,
        kept: &[usize],
        excluded: Vec<Excluded>,
        settled: &Settled,
        f_ratio: f64,
    ) -> Result<Solution, CalibrationError> {
        let Settled { minimum, whitening, problem: all, outliers } = settled;
        let Minimum { problem, normal, layout, steps } = minimum;
        let CameraUnknowns { camera, free, .. } = &problem.cameras[0];
        let names = camera.parameter_names();
        let open = || CalibrationError::Undetermined { parameters: "the poses".to_owned() };
        let Covariances { shared, frames, loose, tied } = normal.covariances().ok_or_else(open)?;
        let loose = layout.parameters[0].iter().filter(|(i, column)| {
            loose.contains(column) || *i >= PROJECTION_PARAMETERS.len() && tied.contains(column)
        });
        let loose = loose.map(|&(i, _)| names[i].clone()).collect();
        let variance = variance(minimum);
        let covariance = shared * variance;
        let shape = problem.shape.zip(layout.shape).map(|(shape, first)| {
            let at = problem.blocks.iter().flat_map(|b| &b.observations).map(|o| o.panel_mm);
            let offsets = at.map(|at| shape.offset(at));
            let (low, high, beside) = offsets.fold((0.0, 0.0, 0.0), |(low, high, beside), d| {
                (d.z.min(low), d.z.max(high), d.truncate().length().max(beside))
            });
            BoardShape {
                shape,
                sd_mm: std::array::from_fn(|i| covariance[(first + i, first + i)].sqrt()),
                f_ratio,
                bent_mm: high - low,
                stretched_mm: beside,
            }
        });
        let found = layout.parameters[0].len();
        let covariance = covariance.view((0, 0), (found, found)).into_owned();
        let mut sds = (0..found).map(|i| covariance[(i, i)].sqrt());
        let values = camera.parameters();
        let parameters = names.iter().zip(values).zip(free).map(|((name, value), &free)| {
            let sd = if free { sds.next() } else { None };
            Parameter { name: name.clone(), value, sd }
        });
        let parameters = parameters.collect();

        let mut views: Vec<ViewSolution> = kept
            .iter()
            .zip(&problem.frames)
            .zip(&frames)
            .map(|((&index, pose), covariance)| ViewSolution {
                name: self.views[index].name.clone(),
                image: self.views[index].image.clone(),
                pose: *pose,
                pose_sd: std::array::from_fn(|i| (covariance[(i, i)] * variance).sqrt()),
                rms_px: 0.0,
                corners: Vec::new(),
            })
            .collect();
        for (block, outliers) in all.blocks.iter().zip(outliers) {
            let corners = block.observations.iter().zip(outliers);
            views[block.frame].corners.extend(corners.filter_map(|(seen, &outlier)| {
                let (row, col, pixel) = (seen.row, seen.col, seen.pixel);
                let residual = all.residual(block, seen)?;
                Some(Corner { panel: block.panel, row, col, pixel, residual, outlier })
            }));
        }
        for view in &mut views {
            view.rms_px = rms_px(view.corners.iter().map(|corner| &corner.residual));
        }
        let seen = views.iter().flat_map(|view| &view.corners);
        let rms_px = rms_px(seen.map(|corner| &corner.residual));
        Ok(Solution {
            camera: camera.clone(),
            parameters,
            covariance,
            rms_px,
            views,
            excluded,
            common_px: whitening.common_px,
            sigma: variance.sqrt(),
            loose,
            shape,
            misfits: misfits(problem, whitening),
            findings: Vec::new(),
            steps: *steps,
        })
    }
}

/// Median error of a view's corners at a pose, px.
fn view_error_px(camera: &Camera, panels: &[Pose], view: &View, pose: Pose) -> f64 {
    let errors = view.sightings.iter().flat_map(|sighting| {
        let camera_from_panel = pose.after(&panels[sighting.panel.index()]);
        sighting.observations.iter().map(move |seen| {
            match camera.project(camera_from_panel.apply(seen.panel_mm)) {
                Some([x, y]) => (seen.pixel[0] - x).hypot(seen.pixel[1] - y),
                None => f64::INFINITY,
            }
        })
    });
    median(errors.collect()).unwrap_or(0.0)
}

/// Refuses views of a board that was never tilted.
fn check_tilts(poses: &[Option<Pose>]) -> Result<(), CalibrationError> {
    let normals = || poses.iter().flatten().map(|pose| pose.rotation * DVec3::Z);
    let mean = normals().sum::<DVec3>().normalize_or(DVec3::Z);
    let spread = normals().map(|normal| normal.angle_between(mean)).fold(0.0, f64::max);
    match spread < PARALLEL_RAD {
        true => Err(CalibrationError::Parallel { spread_deg: spread.to_degrees() }),
        false => Ok(()),
    }
}

/// Refuses a camera that the views leave open. Parameters of the lens that cannot be told apart are
/// no reason: within the image they make the same camera.
fn check_focal(solution: &Solution) -> Result<(), CalibrationError> {
    let of_every_lens = &solution.parameters[..PROJECTION_PARAMETERS.len()];
    let loose = of_every_lens.iter().filter(|p| {
        let focal = if p.name.starts_with('f') { p.value } else { solution.camera.focal_px[0] };
        solution.loose.contains(&p.name) || p.sd.is_some_and(|sd| sd > LOOSE_FOCAL * focal)
    });
    let loose: Vec<&str> = loose.map(|p| p.name.as_str()).collect();
    match loose.is_empty() {
        true => Ok(()),
        false => Err(CalibrationError::Undetermined { parameters: loose.join(", ") }),
    }
}
