//! The normal equations of one frame for the timing of the cameras.
//!
//! ```text
//!   T = s − tᵢ + δ + ρ (s − t̄) + r (y/h − ½)        time of a row y after frame i of the first camera
//! ```
//!
//! s is the time stamp of the image, δ the offset of its camera, ρ the drift and r the readout. A corner is predicted at the
//! pose of the target at T; its derivative with respect to T is that of the pose times the velocity. The pose of frame i is
//! eliminated.

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use super::motion::Motion;
use super::values::TimedCamera;
use crate::input::observation::{Observation, View};
use deltille_core::camera::{Camera, Pose, Projection};

/// Unknowns of each camera: readout, offset and drift.
pub(super) const OF_CAMERA: usize = 3;

/// Whitened residual beyond which a corner has less influence, in robust standard deviations (Huber).
const HUBER: f64 = 2.0;

/// The timing of a camera while it is estimated.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clock {
    pub readout_s: f64,
    pub offset_s: f64,
    pub drift: f64,
}

/// A frame of the first camera, and the images of all cameras next to it in time.
pub(super) struct Group<'a> {
    /// Its time after the middle of the recording, s.
    pub time_s: f64,
    pub pose: Pose,
    pub motion: Motion,
    /// Index of the camera, time stamp after the middle of the recording, and view.
    pub images: Vec<(usize, f64, &'a View)>,
}

/// What weighs the residuals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// Variance that is added to those of the corners, px².
    pub common: f64,
    /// Robust standard deviation of whitened residuals.
    pub sigma: f64,
}

/// The equations of a group.
pub(super) struct OfGroup {
    /// Information and score of the unknowns of the cameras, without the pose.
    pub matrix: DMatrix<f64>,
    pub right: DVector<f64>,
    /// The step of the pose, and its change by that of the unknowns.
    step: Vector6<f64>,
    by_shared: DMatrix<f64>,
    /// Whitened residuals.
    pub off: Vec<f64>,
    /// Squared residuals, px², and variances of the corners.
    pub raw: Vec<(f64, f64)>,
    /// Largest speed of a corner in the image of each camera, px/s.
    pub speed_px_s: Vec<f64>,
}

/// A corner at the pose of its row: residual, and derivatives of the image with respect to pose and time.
struct Predicted {
    off: DVec2,
    by_pose: [Vector6<f64>; 2],
    by_time: DVec2,
    /// Of the row: y/h − ½.
    row: f64,
}

/// The row of a corner: y/h − ½.
pub(super) fn row(camera: &Camera, seen: &Observation) -> f64 {
    (seen.pixel.y + 0.5) / f64::from(camera.height) - 0.5
}

impl Clock {
    /// The time of a row after the middle of the recording.
    pub(super) fn time_s(&self, stamp_s: f64, row: f64) -> f64 {
        stamp_s + self.offset_s + self.drift * stamp_s + self.readout_s * row
    }

    /// The time of the middle row.
    pub(super) fn middle_s(&self, stamp_s: f64) -> f64 {
        self.time_s(stamp_s, 0.0)
    }
}

impl Group<'_> {
    /// `None` if a camera cannot image a corner, or the pose is undetermined.
    pub(super) fn equations(
        &self,
        cameras: &[TimedCamera],
        clocks: &[Clock],
        panels: &[Pose],
        scale: Scale,
    ) -> Option<OfGroup> {
        let count = OF_CAMERA * cameras.len();
        let (mut own, mut right) = (Matrix6::zeros(), Vector6::zeros());
        let mut cross = DMatrix::zeros(6, count);
        let (mut matrix, mut score) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let (mut off, mut raw) = (Vec::new(), Vec::new());
        let mut speed_px_s = vec![0.0; cameras.len()];
        for &(index, stamp_s, view) in &self.images {
            for sighting in &view.sightings {
                let panel = &panels[sighting.panel.index()];
                for seen in &sighting.observations {
                    let of = &cameras[index];
                    let found = self.predicted(of, &clocks[index], panel, stamp_s, seen)?;
                    let speed = found.by_time.length();
                    speed_px_s[index] = f64::max(speed_px_s[index], speed);
                    let variance = seen.cov.map_or(0.0, |[xx, _, yy]| 0.5 * (xx + yy));
                    let information = 1.0 / (variance + scale.common).max(f64::MIN_POSITIVE);
                    let whitened = found.off.length() * information.sqrt();
                    let weight = information * (HUBER * scale.sigma / whitened).min(1.0);
                    off.push(whitened);
                    raw.push((found.off.length_squared(), variance));
                    let columns = [found.row, 1.0, stamp_s];
                    for axis in 0..2 {
                        let (e, by, time) =
                            (found.off[axis], found.by_pose[axis], found.by_time[axis]);
                        own += by * by.transpose() * weight;
                        right += by * (weight * e);
                        for (i, factor) in columns.iter().enumerate() {
                            let (row, d) = (OF_CAMERA * index + i, factor * time);
                            let mut of_row = cross.column_mut(row);
                            of_row += by * (weight * d);
                            score[row] += weight * d * e;
                            for (j, other) in columns.iter().enumerate() {
                                matrix[(row, OF_CAMERA * index + j)] += weight * d * other * time;
                            }
                        }
                    }
                }
            }
        }
        let factor = own.cholesky()?;
        let (step, by_shared) = (factor.solve(&right), factor.solve(&cross));
        Some(OfGroup {
            matrix: matrix - cross.transpose() * &by_shared,
            right: score - cross.transpose() * DVector::from_column_slice(step.as_slice()),
            step,
            by_shared,
            off,
            raw,
            speed_px_s,
        })
    }

    fn predicted(
        &self,
        of: &TimedCamera,
        clock: &Clock,
        panel: &Pose,
        stamp_s: f64,
        seen: &Observation,
    ) -> Option<Predicted> {
        let row = row(&of.camera, seen);
        let time = clock.time_s(stamp_s, row) - self.time_s;
        let pose = self.motion.pose(&self.pose, time);
        let on_target = panel.apply(seen.panel_mm);
        let arm = pose.rotation * on_target;
        let at = of.camera_from_rig.apply(arm + pose.translation);
        let mut image = Projection::EMPTY;
        of.camera.project_into(at, &mut image)?;
        let back = DMat3::from_quat(of.camera_from_rig.rotation).transpose();
        let by_pose = image.by_point.map(|by| {
            let by = back * DVec3::from(by);
            let turn = arm.cross(by);
            Vector6::new(turn.x, turn.y, turn.z, by.x, by.y, by.z)
        });
        let velocity = self.motion.velocity(time);
        let by_time = DVec2::new(by_pose[0].dot(&velocity), by_pose[1].dot(&velocity));
        Some(Predicted { off: seen.pixel - image.pixel, by_pose, by_time, row })
    }
}

impl OfGroup {
    /// The step of the pose for a step of the unknowns of the cameras.
    pub(super) fn step(&self, shared: &DVector<f64>) -> Vector6<f64> {
        let by = &self.by_shared * shared;
        self.step - Vector6::from_column_slice(by.as_slice())
    }
}
