//! From views with time stamps to the timing of cameras.

use nalgebra::{DMatrix, DVector};

use super::equations::{Clock, Group, OF_CAMERA, OfGroup, Scale};
use super::motion::{FRAMES, Motion, moved};
use super::values::{CameraTiming, Measured, TimedCamera, Timing, TimingError};
use crate::input::observation::View;
use crate::start::pose::estimate_pose;
use deltille_core::camera::Pose;
use deltille_core::statistics::median;

/// Minimum number of frames of the first camera with neighbours: below, the scatter between frames is too uncertain.
const MIN_FRAMES: usize = 20;

/// Largest interval between successive frames, in median intervals: beyond, a frame is missing, and the path between its
/// neighbours is not known.
const LARGEST_GAP: f64 = 1.5;

/// Standard deviations of the priors: readouts and offsets are of the order of an interval; clocks differ by less than
/// 1000 ppm.
const PRIOR_INTERVALS: f64 = 1.0;
const PRIOR_DRIFT: f64 = 1e-3;

/// A value is determined if its standard deviation is below this fraction of that of its prior.
const DETERMINED: f64 = 0.3;

/// Maximum number of iterations; five to eight suffice.
const MAX_ROUNDS: usize = 20;

/// Change of the unknowns, relative to the interval, that is small compared with any uncertainty.
const SETTLED: f64 = 1e-6;

/// Offsets are searched in half intervals, up to this number on both sides.
const SEARCHED: i32 = 8;

/// Largest RMS residual, relative to the longer side of the image: as in a check of a camera.
const FITS: f64 = 0.005;

/// Smallest mean motion from frame to frame, in standard deviations of a corner: below, velocities are mostly noise.
const MOVES: f64 = 10.0;

/// The ratio of the median of the length of a two-dimensional normal vector to its standard deviation per axis.
const MEDIAN_LENGTH: f64 = 1.177;

/// Frames of a camera in the order of their stamps, s after the middle of the recording.
type Stamped<'a> = Vec<(f64, &'a View)>;

/// Estimates readouts, offsets and drifts of cameras whose intrinsics and poses on the rig are known, from views of one moving
/// target; `panels` are the poses of its panels. Views in which the target is at rest contribute nothing.
///
/// # Errors
/// Returns an error if too few successive frames of the first camera show the target, or if the images do not fit any timing.
pub fn timing(cameras: &[TimedCamera], panels: &[Pose]) -> Result<Timing, TimingError> {
    Ok(Solved::of(cameras, panels)?.timing)
}

/// The timing of cameras, and the path of the target from which it was estimated.
pub(super) struct Solved<'a> {
    pub(super) timing: Timing,
    setting: Setting<'a>,
    path: Path<'a>,
}

/// The frames of the first camera: time stamp, pose of the target, view.
type Path<'a> = Vec<(f64, Pose, &'a View)>;

impl<'a> Solved<'a> {
    pub(super) fn of(cameras: &'a [TimedCamera], panels: &'a [Pose]) -> Result<Self, TimingError> {
        let too_few = |frames: usize| TimingError::TooFew {
            camera: cameras.first().map_or(String::new(), |of| of.name.clone()),
            frames,
            needed: MIN_FRAMES,
        };
        let first = cameras.first().ok_or_else(|| too_few(0))?;
        let frames = stamped(cameras);
        let rig_from_camera = first.camera_from_rig.inverse();
        let poses = frames[0].iter().filter_map(|(stamp_s, view)| {
            let pose = estimate_pose(&first.camera, panels, &view.sightings)?;
            Some((*stamp_s, rig_from_camera.after(&pose), *view))
        });
        let mut path: Path<'_> = poses.collect();
        let intervals = path.windows(2).map(|two| two[1].0 - two[0].0).collect();
        let interval_s = median(intervals).unwrap_or(0.0);
        let times: Vec<f64> = path.iter().map(|of| of.0).collect();
        let anchors = windows(&times, interval_s);
        if anchors.len() < MIN_FRAMES {
            return Err(too_few(anchors.len()));
        }
        let mut clocks = vec![Clock::default(); cameras.len()];
        let mut scale = Scale { common: 1.0, sigma: f64::INFINITY };
        let setting = Setting { cameras, panels, frames, anchors, interval_s };
        setting.search(&path, &mut clocks);
        for _ in 0..MAX_ROUNDS {
            let groups = setting.groups(&path, &clocks);
            let equations = setting.equations(&groups, &clocks, scale);
            scale = scaled(&equations);
            let Some(step) = setting.step(&equations, &clocks) else { break };
            for ((index, group), of) in groups.iter().zip(&equations) {
                if let Some(of) = of {
                    path[*index].1 = moved(&group.pose, &of.step(&step));
                }
            }
            for (clock, step) in clocks.iter_mut().zip(step.as_slice().chunks(OF_CAMERA)) {
                clock.readout_s += step[0];
                clock.offset_s += step[1];
                clock.drift += step[2];
            }
            if step.amax() < SETTLED * interval_s {
                break;
            }
        }
        let timing = setting.result(&setting.groups(&path, &clocks), &clocks, scale);
        let sides = cameras.iter().map(|of| of.camera.width.max(of.camera.height));
        if timing.rms_px > FITS * f64::from(sides.max().unwrap_or(0)) {
            return Err(TimingError::Fit { rms_px: timing.rms_px, searched: SEARCHED / 2 });
        }
        Ok(Self { timing, setting, path })
    }

    /// The frames of the first camera with neighbours, and the images of all cameras next to them in time.
    pub(super) fn groups(&self, clocks: &[Clock]) -> Vec<Group<'a>> {
        self.setting.groups(&self.path, clocks).into_iter().map(|(_, group)| group).collect()
    }
}

/// The frames of each camera, with times after the middle of the recording of the first one.
fn stamped(cameras: &[TimedCamera]) -> Vec<Stamped<'_>> {
    let stamps = cameras.iter().take(1).flat_map(|of| &of.views).map(|(ns, _)| *ns);
    let (earliest, latest) = (stamps.clone().min().unwrap_or(0), stamps.max().unwrap_or(0));
    let middle = earliest + (latest - earliest) / 2;
    let of_camera = |of: &'_ TimedCamera| {
        let views = of.views.iter().enumerate();
        let mut all: Vec<(f64, usize)> =
            views.map(|(index, (ns, _))| ((ns - middle) as f64 * 1e-9, index)).collect();
        all.sort_by(|one, other| one.0.total_cmp(&other.0));
        all.dedup_by(|one, other| one.0 == other.0);
        all
    };
    let frames = cameras.iter().map(|of| {
        of_camera(of).into_iter().map(|(stamp_s, index)| (stamp_s, &of.views[index].1)).collect()
    });
    frames.collect()
}

/// What does not change during the iterations.
struct Setting<'a> {
    cameras: &'a [TimedCamera],
    panels: &'a [Pose],
    /// The frames of each camera.
    frames: Vec<Stamped<'a>>,
    /// For each frame of the first camera with neighbours, its index, and the first of the five successive frames.
    anchors: Vec<[usize; 2]>,
    interval_s: f64,
}

impl<'a> Setting<'a> {
    /// The index of each frame of the first camera with neighbours, and the frame with the images of the other cameras that are nearest to them.
    fn groups(&self, path: &[(f64, Pose, &'a View)], clocks: &[Clock]) -> Vec<(usize, Group<'a>)> {
        let half_s = 0.5 * self.interval_s;
        let of = |&[i, first]: &[usize; 2]| {
            let (time_s, pose, view) = path[i];
            let window = (first..first + FRAMES).filter(|other| *other != i);
            let neighbours = window.map(|other| (path[other].0 - time_s, path[other].1));
            let motion = Motion::through(&pose, &neighbours.collect::<Vec<_>>())?;
            let mut images = vec![(0, time_s, view)];
            for (camera, frames) in self.frames.iter().enumerate().skip(1) {
                let clock = &clocks[camera];
                let first = frames.partition_point(|of| clock.middle_s(of.0) < time_s - half_s);
                let last = frames.partition_point(|of| clock.middle_s(of.0) < time_s + half_s);
                images.extend(
                    frames[first..last].iter().map(|(stamp, view)| (camera, *stamp, *view)),
                );
            }
            Some((i, Group { time_s, pose, motion, images }))
        };
        self.anchors.iter().filter_map(of).collect()
    }

    fn equations(
        &self,
        groups: &[(usize, Group<'_>)],
        clocks: &[Clock],
        scale: Scale,
    ) -> Vec<Option<OfGroup>> {
        groups
            .iter()
            .map(|(_, of)| of.equations(self.cameras, clocks, self.panels, scale))
            .collect()
    }

    /// Sets the offsets, in half intervals, with which the other cameras fit the path best.
    fn search(&self, path: &[(f64, Pose, &'a View)], clocks: &mut [Clock]) {
        for camera in 1..self.cameras.len() {
            let typical = |half: &i32| {
                let offset_s = f64::from(*half) * 0.5 * self.interval_s;
                let mut tried = vec![Clock::default(); clocks.len()];
                tried[camera].offset_s = offset_s;
                let mut groups = self.groups(path, &tried);
                for (_, group) in &mut groups {
                    group.images.retain(|(of, ..)| *of == camera);
                }
                groups.retain(|(_, group)| !group.images.is_empty());
                // The poses are those of the first camera.
                let scale = Scale { common: 1.0, sigma: f64::INFINITY };
                let equations = self.equations(&groups, &tried, scale);
                let off = equations.iter().flatten().flat_map(|of| of.raw.iter().map(|raw| raw.0));
                median(off.collect()).unwrap_or(f64::INFINITY)
            };
            let halves = (-SEARCHED..=SEARCHED).map(|half| (typical(&half), half));
            let best = halves.min_by(|one, other| one.0.total_cmp(&other.0));
            clocks[camera].offset_s =
                best.map_or(0.0, |(_, half)| f64::from(half) * 0.5 * self.interval_s);
        }
    }

    /// Standard deviations of the priors of the unknowns; zero for those that are not estimated.
    fn priors(&self) -> Vec<f64> {
        let near = PRIOR_INTERVALS * self.interval_s;
        let of =
            |camera: usize| if camera == 0 { [near, 0.0, 0.0] } else { [near, near, PRIOR_DRIFT] };
        (0..self.cameras.len()).flat_map(of).collect()
    }

    /// Information and score of the unknowns, with their priors.
    fn sum(&self, equations: &[Option<OfGroup>], clocks: &[Clock]) -> (DMatrix<f64>, DVector<f64>) {
        let count = OF_CAMERA * self.cameras.len();
        let (mut matrix, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
        for of in equations.iter().flatten() {
            matrix += &of.matrix;
            right += &of.right;
        }
        let values = clocks.iter().flat_map(|of| [of.readout_s, 0.0, of.drift]);
        for ((i, sd), value) in self.priors().into_iter().enumerate().zip(values) {
            if sd > 0.0 {
                matrix[(i, i)] += sd.powi(-2);
                right[i] -= value * sd.powi(-2);
            } else {
                matrix.row_mut(i).fill(0.0);
                matrix.column_mut(i).fill(0.0);
                (matrix[(i, i)], right[i]) = (1.0, 0.0);
            }
        }
        (matrix, right)
    }

    fn step(&self, equations: &[Option<OfGroup>], clocks: &[Clock]) -> Option<DVector<f64>> {
        let (matrix, right) = self.sum(equations, clocks);
        Some(matrix.cholesky()?.solve(&right))
    }

    /// The variances of the unknowns from the scatter of the scores of the frames. Scores of near frames are correlated,
    /// because they share poses and vibrations (Newey & West 1987).
    fn variances(
        &self,
        equations: &[Option<OfGroup>],
        clocks: &[Clock],
        sigma: f64,
    ) -> Option<Vec<f64>> {
        let (matrix, _) = self.sum(equations, clocks);
        let inverse = matrix.cholesky()?.inverse();
        let noise = &inverse * (sigma * sigma);
        let scores: Vec<&DVector<f64>> = equations.iter().flatten().map(|of| &of.right).collect();
        let lags = lags(scores.len());
        let mut scatter = DMatrix::zeros(inverse.nrows(), inverse.nrows());
        for (index, score) in scores.iter().enumerate() {
            scatter += *score * score.transpose();
            for lag in 1..=lags.min(index) {
                let weight = 1.0 - lag as f64 / (lags + 1) as f64;
                let both = *score * scores[index - lag].transpose();
                scatter += (&both + both.transpose()) * weight;
            }
        }
        let observed = &inverse * scatter * &inverse;
        // Images that are equal have no scatter.
        let variance = |i: usize| f64::max(observed[(i, i)], noise[(i, i)]);
        Some((0..inverse.nrows()).map(variance).collect())
    }

    fn result(&self, groups: &[(usize, Group<'_>)], clocks: &[Clock], scale: Scale) -> Timing {
        let equations = self.equations(groups, clocks, scale);
        let variances = self.variances(&equations, clocks, scale.sigma);
        let raw = || equations.iter().flatten().flat_map(|of| of.raw.iter());
        let squares: f64 = raw().map(|(squared, _)| squared).sum();
        let speeds = |camera: usize| {
            let of = equations.iter().flatten().map(move |of| of.speed_px_s[camera]);
            of.filter(|speed| *speed > 0.0).collect::<Vec<_>>()
        };
        let images = |camera: usize| {
            let images = groups.iter().flat_map(|(_, group)| &group.images);
            images.filter(|(of, ..)| *of == camera).count()
        };
        let speed_px_s = median(speeds(0)).unwrap_or(0.0);
        let variance = median(raw().map(|(_, variance)| *variance).collect());
        let corner_sd_px = variance.unwrap_or(0.0).sqrt();
        // Frames of a target at rest hardly count.
        let mean_px_s = speeds(0).iter().sum::<f64>() / speeds(0).len().max(1) as f64;
        let moves = mean_px_s * self.interval_s > MOVES * corner_sd_px;
        let unknowns = self.priors().iter().filter(|sd| **sd > 0.0).count();
        let determined = |value: f64, index: usize, prior: f64| {
            let few = few(images(index / OF_CAMERA), unknowns).filter(|_| moves)?;
            let sd = (variances.as_ref()?[index] * few).sqrt();
            (sd > 0.0 && sd < DETERMINED * prior).then_some(Measured { value, sd })
        };
        let near = PRIOR_INTERVALS * self.interval_s;
        let cameras = self.cameras.iter().zip(clocks).enumerate().map(|(index, (of, clock))| {
            let first = OF_CAMERA * index;
            let other = |value: f64, i: usize, prior: f64| {
                (index > 0).then(|| determined(value, first + i, prior)).flatten()
            };
            let readout_s = determined(clock.readout_s, first, near);
            let fastest = speeds(index).into_iter().fold(0.0, f64::max);
            CameraTiming {
                name: of.name.clone(),
                readout_s,
                height: of.camera.height,
                shear_px: fastest * readout_s.map_or(0.0, |of| of.value.abs()),
                offset_s: other(clock.offset_s, 1, near),
                drift: other(clock.drift, 2, PRIOR_DRIFT),
                frames: images(index),
                earlier_frames: of.earlier_frames(),
            }
        });
        Timing {
            cameras: cameras.collect(),
            frames: groups.len(),
            interval_s: self.interval_s,
            speed_px_s,
            rms_px: (squares / (2 * raw().count()).max(1) as f64).sqrt(),
            corner_sd_px,
        }
    }
}

/// For each frame with at least four successive neighbours, its index, and the first of the five frames around it.
fn windows(times: &[f64], interval_s: f64) -> Vec<[usize; 2]> {
    let runs = (0..times.len()).collect::<Vec<_>>();
    let runs = runs.chunk_by(|&a, &b| times[b] - times[a] <= LARGEST_GAP * interval_s);
    let runs = runs.filter(|run| run.len() >= FRAMES);
    let of_run = |run: &[usize]| {
        let (first, last) = (run[0], run[run.len() - FRAMES]);
        run.iter()
            .map(move |&i| [i, i.saturating_sub(FRAMES / 2).clamp(first, last)])
            .collect::<Vec<_>>()
    };
    runs.flat_map(of_run).collect()
}

/// Number of frames on each side whose scores are correlated with that of a frame, of all.
fn lags(frames: usize) -> usize {
    (frames as f64).cbrt().ceil() as usize
}

/// The factor of a variance from the scatter of few frames; `None` if there are too few.
fn few(frames: usize, unknowns: usize) -> Option<f64> {
    let lost = unknowns * (2 * lags(frames) + 1);
    (frames > lost).then(|| frames as f64 / (frames - lost) as f64)
}

/// The scale of residuals: the common variance, and the robust standard deviation of residuals that it whitens.
fn scaled(equations: &[Option<OfGroup>]) -> Scale {
    let all = || equations.iter().flatten();
    let per_axis = |squared: f64| squared / (MEDIAN_LENGTH * MEDIAN_LENGTH);
    let squared = median(all().flat_map(|of| of.raw.iter().map(|raw| raw.0)).collect());
    let variance = median(all().flat_map(|of| of.raw.iter().map(|raw| raw.1)).collect());
    let common = per_axis(squared.unwrap_or(1.0)) - variance.unwrap_or(0.0);
    let sigma = median(all().flat_map(|of| of.off.iter().copied()).collect());
    let sigma = sigma.unwrap_or(1.0) / MEDIAN_LENGTH;
    Scale { common: common.max(0.0), sigma: sigma.max(f64::MIN_POSITIVE) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::simulated::{NOISE_PX, filmed};
    use deltille_core::camera::Camera;

    #[test]
    fn readouts_offsets_and_drifts_are_found_within_their_uncertainty() {
        let truth = [[0.016, 0.0, 0.0], [-0.009, 0.0213, 2e-4]];
        let (mut squares, mut count) = (0.0, 0.0);
        for seed in 0..6 {
            let found =
                timing(&filmed(&Camera::pinhole(1280, 960, 1.0), truth, seed), &[Pose::IDENTITY])
                    .unwrap();
            assert!(found.rms_px < 1.2 * NOISE_PX, "{found:?}");
            for (of, [readout, offset, drift]) in found.cameras.iter().zip(truth) {
                let pairs = [(of.readout_s, readout), (of.offset_s, offset), (of.drift, drift)];
                for (measured, truth) in pairs {
                    let Some(measured) = measured else {
                        assert_eq!(of.name, "left");
                        continue;
                    };
                    let off = (measured.value - truth) / measured.sd;
                    assert!(off.abs() < 4.0, "{truth}: {measured:?}");
                    (squares, count) = (squares + off * off, count + 1.0);
                }
            }
            let sd = |of: Option<Measured>| of.map_or(f64::INFINITY, |of| of.sd);
            assert!(sd(found.cameras[1].readout_s) < 2e-4 && sd(found.cameras[1].offset_s) < 5e-5);
        }
        assert!((0.4..2.0).contains(&(squares / count)), "{}", squares / count);
    }

    #[test]
    fn global_shutters_and_synchronous_clocks_are_not_contradicted() {
        let mut significant = 0;
        for seed in 10..16 {
            let found = timing(
                &filmed(&Camera::pinhole(1280, 960, 1.0), [[0.0; 3]; 2], seed),
                &[Pose::IDENTITY],
            )
            .unwrap();
            let all = found.cameras.iter().flat_map(|of| [of.readout_s, of.offset_s, of.drift]);
            significant += all.flatten().filter(Measured::is_significant).count();
        }
        assert_eq!(significant, 0);
    }

    #[test]
    fn frames_without_neighbours_are_refused() {
        let [mut left, _] = filmed(&Camera::pinhole(1280, 960, 1.0), [[0.0; 3]; 2], 1);
        left.views.truncate(10);
        let error = timing(&[left], &[Pose::IDENTITY]).unwrap_err();
        assert!(error.to_string().starts_with("only 10 frames of left have neighbours"), "{error}");
    }
}
