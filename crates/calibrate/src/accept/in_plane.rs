//! Corners that one camera measures in the plane of their panel.
//!
//! ```text
//!   B δq = ε − J δψ − K δu,   δψ = N⁻¹ Σ JᵀW (ε − K δu),   N = Σ JᵀWJ
//! ```
//!
//! q is the position of a corner in the plane, ψ the pose of the target from all corners of the image, and B, J and K are the
//! derivatives of the pixel with respect to q, ψ and the parameters of the camera. A displacement of a corner of the target acts
//! like the error ε of the pixel that it causes.

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{DMatrix, Matrix2, Matrix6, RowDVector, RowVector2, SMatrix, Vector2, Vector6};

use super::request::CornerLabel;
use super::sensitivity::{Measured, Point, Sensitivity, Variances};
use crate::estimate::on_rig::CameraOnRig;
use crate::input::observation::Observation;
use crate::uncertainty::projection::{by_motion, by_parameters};
use deltille_core::camera::{Pose, Projection};

/// Number of Gauss–Newton steps for the pose, which starts at the minimum for other weights.
const POSE_STEPS: usize = 8;

/// Number of Newton steps to the point of the plane that a pixel shows.
const STEPS: usize = 6;

/// The corners of an image.
pub(super) struct InPlane {
    points: Vec<Point>,
    corners: Vec<Corner>,
    /// The inverse of N.
    pose: Matrix6<f64>,
    /// RMS residual at the pose per axis, px.
    rms_px: f64,
}

/// The derivatives at a corner.
struct Corner {
    variances: Variances,
    information: Matrix2<f64>,
    /// J, K and the derivatives with respect to the position on the panel; the first two of these are B.
    by_pose: SMatrix<f64, 2, 6>,
    by_camera: DMatrix<f64>,
    by_panel: SMatrix<f64, 2, 3>,
    /// The inverse of B.
    into_plane: Matrix2<f64>,
    /// The axes x and y of the panel in the frame of the target.
    axes: [DVec3; 2],
}

/// A corner with its observation, its panel, and its variances.
pub(super) type Seen<'a> = (CornerLabel, &'a Observation, &'a Pose, Variances);

impl InPlane {
    /// `None` if the corners do not determine the pose, or the camera cannot image them.
    pub(super) fn of(camera: &CameraOnRig, seen: &[Seen], start: Pose) -> Option<Self> {
        let mut pose = start;
        for _ in 0..POSE_STEPS {
            let (normal, right) = normal(camera, seen, &pose)?;
            let step = normal.try_inverse()? * right;
            pose.rotation = glam::DQuat::from_scaled_axis(DVec3::new(step[0], step[1], step[2]))
                * pose.rotation;
            pose.translation += DVec3::new(step[3], step[4], step[5]);
        }
        let (normal, _) = normal(camera, seen, &pose)?;
        let (mut points, mut corners, mut squares) = (Vec::new(), Vec::new(), 0.0);
        for of in seen {
            let (at, _) = projected(camera, &pose, of.2.apply(of.1.panel_mm))?;
            squares += of.1.pixel.distance_squared(at.pixel);
            let (point, corner) = measured(camera, of, &pose)?;
            points.push(point);
            corners.push(corner);
        }
        let rms_px = (squares / (2 * seen.len()).max(1) as f64).sqrt();
        Some(Self { points, corners, pose: normal.try_inverse()?, rms_px })
    }
}

/// The projection of a point on the target at a pose, with the derivatives with respect to the pose.
fn projected(
    camera: &CameraOnRig,
    pose: &Pose,
    on_target: DVec3,
) -> Option<(Projection, SMatrix<f64, 2, 6>)> {
    let arm = pose.rotation * on_target;
    let seen = camera.estimate.camera.project_with_derivatives(arm + pose.translation)?;
    let by_pose = by_motion(&seen, arm);
    Some((seen, by_pose))
}

/// N and Σ JᵀW r.
fn normal(
    camera: &CameraOnRig,
    seen: &[Seen],
    pose: &Pose,
) -> Option<(Matrix6<f64>, Vector6<f64>)> {
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for (_, of, panel, variances) in seen {
        let (at, by_pose) = projected(camera, pose, panel.apply(of.panel_mm))?;
        let off = of.pixel - at.pixel;
        let pull = by_pose.transpose() * variances.information()?;
        normal += pull * by_pose;
        right += pull * Vector2::new(off.x, off.y);
    }
    Some((normal, right))
}

/// Measures a corner at a pose.
fn measured(
    camera: &CameraOnRig,
    &(label, of, panel, variances): &Seen,
    pose: &Pose,
) -> Option<(Point, Corner)> {
    let of_panel = DMat3::from_quat(panel.rotation);
    let axes = [of_panel.x_axis, of_panel.y_axis];
    let to_camera = DMat3::from_quat(pose.rotation) * of_panel;
    let by_panel = |at: &Projection| {
        let rows = at.by_point.map(|row| to_camera.transpose() * DVec3::from(row));
        SMatrix::<f64, 2, 3>::from_fn(|i, j| rows[i][j])
    };
    let mut q = DVec2::ZERO;
    for _ in 0..STEPS {
        let at = panel.apply(of.panel_mm + q.extend(0.0));
        let (seen, _) = projected(camera, pose, at)?;
        let by = by_panel(&seen).fixed_columns::<2>(0).into_owned();
        let off = of.pixel - seen.pixel;
        let step = by.try_inverse()? * Vector2::new(off.x, off.y);
        q += DVec2::new(step.x, step.y);
    }
    let known = panel.apply(of.panel_mm);
    let measured = panel.apply(of.panel_mm + q.extend(0.0));
    let (seen, by_pose) = projected(camera, pose, measured)?;
    let by_panel = by_panel(&seen);
    let corner = Corner {
        variances,
        information: variances.information()?,
        by_pose,
        by_camera: DMatrix::from_iterator(
            2,
            camera.free.len(),
            by_parameters(&seen, &camera.free).iter().copied(),
        ),
        by_panel,
        into_plane: by_panel.fixed_columns::<2>(0).into_owned().try_inverse()?,
        axes,
    };
    Some((Point { label, known, measured }, corner))
}

impl Measured for InPlane {
    fn points(&self) -> &[Point] {
        &self.points
    }

    fn rms_px(&self) -> f64 {
        self.rms_px
    }

    fn sensitivity(&self, ends: [usize; 2], is_known: bool) -> Sensitivity {
        let [a, b] = ends.map(|i| &self.points[i]);
        let along = (b.measured - a.measured).normalize_or_zero();
        // The derivatives of the length with respect to the pixels of its ends at a fixed pose.
        let direct = [-1.0, 1.0].map(|sign| along * sign);
        let direct: Vec<(usize, RowVector2<f64>)> = ends
            .into_iter()
            .zip(direct)
            .map(|(i, along)| {
                let corner = &self.corners[i];
                let [x, y] = corner.axes.map(|axis| axis.dot(along));
                (i, RowVector2::new(x, y) * corner.into_plane)
            })
            .collect();
        let by_pose: SMatrix<f64, 1, 6> =
            direct.iter().map(|(i, by)| by * self.corners[*i].by_pose).sum();
        let through = by_pose * self.pose;
        let mut found = Sensitivity {
            noise_mm2: 0.0,
            lens_mm2: 0.0,
            by_cameras: RowDVector::zeros(self.corners[0].by_camera.ncols()),
            by_target: Vec::new(),
        };
        for (i, corner) in self.corners.iter().enumerate() {
            let by_way_of_pose = through * corner.by_pose.transpose() * corner.information;
            let own: RowVector2<f64> =
                direct.iter().filter(|(end, _)| *end == i).map(|(_, by)| *by).sum();
            let by_pixel = own - by_way_of_pose;
            found.noise_mm2 += (by_pixel * corner.variances.noise * by_pixel.transpose())[0];
            found.lens_mm2 += by_pixel.norm_squared() * corner.variances.other;
            found.by_cameras -= by_pixel * &corner.by_camera;
            let of_target = if is_known { -by_way_of_pose } else { by_pixel };
            let by = of_target * corner.by_panel;
            found.by_target.push((self.points[i].label, DVec3::new(by[0], by[1], by[2])));
        }
        found
    }
}
