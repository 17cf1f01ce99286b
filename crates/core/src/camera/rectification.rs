//! Rectification of two cameras of a rig to side-by-side views with parallel axes. A point then has the same row in
//! both images, or the same column if one camera is above the other. Both images have the orientation of the first
//! camera, even if the second one is mounted upside down or on its side.

use glam::{DMat3, DMat4, DQuat, DVec3};

use super::undistortion::{Field, Undistortion, UndistortionError};
use super::{Camera, Pose};

/// Smallest angle between the baseline and the axes, rad. Below it, there is no common side-by-side view.
const MIN_ANGLE_RAD: f64 = 0.1;

/// Why two cameras cannot be rectified. Messages contain the remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RectificationError {
    /// The cameras have no baseline.
    #[error("both cameras are at the same position")]
    Coincident,
    /// The viewing directions of the cameras differ too much.
    #[error(
        "the viewing directions differ by {degrees:.0}°, so no rectified view covers their common field of view"
    )]
    Apart {
        /// Angle between the axes, degrees.
        degrees: f64,
    },
    /// The cameras are one behind the other.
    #[error("one camera is in front of the other, so the pair cannot be rectified")]
    Behind,
    /// A rectified view is not possible.
    #[error(transparent)]
    View(#[from] UndistortionError),
}

/// Rectified views of two cameras, with the same size and focal length.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Rectification {
    /// The view of each camera.
    pub views: [Undistortion; 2],
    /// Position of the second view's camera in the frame of the first view, mm: along x, or along y if one camera is
    /// above the other.
    pub baseline_mm: DVec3,
}

impl Rectification {
    /// Rectifies two cameras with poses camera_from_rig. Four rotations about the optical axis align rows or columns
    /// with the baseline. Both views use the one closest to the first camera's orientation. OpenCV's `stereoRectify`
    /// uses the orientation midway between both cameras, and rotates both images by 90° if one is
    /// upside down.
    ///
    /// # Errors
    /// Returns an error if there is no common side-by-side view.
    ///
    /// ```
    /// use deltille_core::camera::{Camera, Field, Pose, Rectification};
    /// use glam::{DQuat, DVec3};
    ///
    /// let camera = Camera::pinhole(640, 480, 1.0);
    /// let translation = DVec3::new(-120.0, 3.0, 2.0);
    /// let second = Pose { rotation: DQuat::from_rotation_y(0.05), translation };
    /// let made = Rectification::new([(&camera, Pose::IDENTITY), (&camera, second)], [640, 480], Field::Inside)?;
    /// assert!((made.baseline_mm.x - translation.length()).abs() < 1e-9 && made.baseline_mm.y.abs() < 1e-9);
    /// # Ok::<(), deltille_core::camera::RectificationError>(())
    /// ```
    pub fn new(
        cameras: [(&Camera, Pose); 2],
        size_px: [u32; 2],
        field: Field,
    ) -> Result<Self, RectificationError> {
        let poses = cameras.map(|(_, pose)| pose);
        let (view_from_rig, baseline_mm) = common_frame(poses)?;
        let view = |(camera, pose): (&Camera, Pose), field: Field| {
            let turn = view_from_rig * pose.rotation.conjugate();
            Undistortion::rotated(camera, turn, size_px, field)
        };
        let [first, second] = cameras;
        let focal = [view(first, field)?, view(second, field)?].map(|v| v.view().focal_px.x);
        // The field of view inside both images, or the one that contains both images.
        let common = match field {
            Field::Whole => focal[0].min(focal[1]),
            _ => focal[0].max(focal[1]),
        };
        let field = Field::Focal(common);
        Ok(Self { views: [view(first, field)?, view(second, field)?], baseline_mm })
    }

    /// Returns the matrix Q that maps x, y, disparity, 1 (px, in the first view) to homogeneous
    /// coordinates X, Y, Z, W of a point in the frame of the first view, mm. The disparity is x of
    /// the first view minus x of the second, or the
    /// same with y.
    pub fn depth_matrix(&self) -> DMat4 {
        let view = self.views[0].view();
        let (focal, centre) = (view.focal_px.x, view.centre_px);
        let along = self.baseline_mm.x + self.baseline_mm.y;
        let rows = [
            [1.0, 0.0, 0.0, -centre.x],
            [0.0, 1.0, 0.0, -centre.y],
            [0.0, 0.0, 0.0, focal],
            [0.0, 0.0, along.recip(), 0.0],
        ];
        DMat4::from_cols_array_2d(&rows).transpose()
    }
}

/// Returns the rotation from the rig frame to the frame in which both cameras face forward side by
/// side. Also returns the position of the second camera relative to the first.
fn common_frame(poses: [Pose; 2]) -> Result<(DQuat, DVec3), RectificationError> {
    let [from, to] = poses.map(|pose| pose.inverse().translation);
    let rotations = poses.map(|pose| pose.rotation.conjugate());
    let axes = rotations.map(|rotation| rotation * DVec3::Z);
    let angle = axes[0].angle_between(axes[1]);
    if angle > std::f64::consts::FRAC_PI_2 {
        return Err(RectificationError::Apart { degrees: angle.to_degrees() });
    }
    let forward = (axes[0] + axes[1]).normalize();
    // The first camera, rotated by the smallest angle to look forward. The second may be upside down.
    let upright = DQuat::from_rotation_arc(axes[0], forward) * rotations[0];
    let [right, down] = [DVec3::X, DVec3::Y].map(|axis| upright * axis);
    let apart = to - from;
    let along = apart.try_normalize().ok_or(RectificationError::Coincident)?;
    let to_axis = along.angle_between(forward);
    if to_axis.min(std::f64::consts::PI - to_axis) < MIN_ANGLE_RAD {
        return Err(RectificationError::Behind);
    }
    let is_beside = along.dot(right).abs() >= along.dot(down).abs();
    let [x, y, z] = if is_beside {
        let x = along * along.dot(right).signum();
        let z = (forward - forward.dot(x) * x).normalize();
        [x, z.cross(x), z]
    } else {
        let y = along * along.dot(down).signum();
        let z = (forward - forward.dot(y) * y).normalize();
        [y.cross(z), y, z]
    };
    let rig_from_view = DMat3::from_cols(x, y, z);
    let view_from_rig = DQuat::from_mat3(&rig_from_view).normalize().conjugate();
    let mut baseline_mm = view_from_rig * apart;
    // Aligned exactly with an axis.
    baseline_mm = if is_beside { baseline_mm * DVec3::X } else { baseline_mm * DVec3::Y };
    Ok((view_from_rig, baseline_mm))
}

#[cfg(test)]
mod tests {
    use glam::DVec4;

    use super::*;
    use crate::camera::{BrownConrady, KannalaBrandt, Lens};

    #[test]
    fn points_share_a_row_and_the_depth_is_correct() {
        let radial = [-0.2, 0.05, 0.0];
        let lens = Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() });
        let left = Camera::centred(800, 600, 600.0, lens);
        let k = vec![0.02, -0.003, 0.0, 0.0];
        let right = Camera::centred(900, 700, 640.0, Lens::KannalaBrandt(KannalaBrandt { k }));
        for (towards, is_beside) in
            [(DVec3::X, true), (DVec3::NEG_X, true), (DVec3::Y, false), (DVec3::NEG_Y, false)]
        {
            let rotation = DQuat::from_scaled_axis(DVec3::new(0.05, -0.08, 0.03));
            let at = 150.0 * towards + DVec3::new(4.0, -6.0, 9.0);
            let second = Pose { rotation, translation: -(rotation * at) };
            let cameras = [(&left, Pose::IDENTITY), (&right, second)];
            let made = Rectification::new(cameras, [640, 480], Field::Inside).unwrap();
            let view_from_rig = made.views[0].view_from_camera();
            for point in [DVec3::new(30.0, -40.0, 900.0), DVec3::new(-100.0, 60.0, 1500.0)] {
                let first = view_from_rig * point;
                let second = first - made.baseline_mm;
                let [a, b] = [(0, first), (1, second)]
                    .map(|(view, point)| made.views[view].view().project(point).unwrap());
                let off = a - b;
                let (same, disparity) = if is_beside { (off.y, off.x) } else { (off.x, off.y) };
                assert!(same.abs() < 1e-9, "{off}");
                let found = made.depth_matrix() * DVec4::new(a.x, a.y, disparity, 1.0);
                assert!((found.truncate() / found.w).distance(first) < 1e-6);
                // The maps give the positions at which the cameras image the point.
                for (index, (camera, pose), pixel) in [(0, cameras[0], a), (1, cameras[1], b)] {
                    let seen = camera.project(pose.apply(point)).unwrap();
                    assert!(made.views[index].source(pixel).unwrap().distance(seen) < 1e-6);
                }
            }
        }
    }

    #[test]
    fn views_are_as_upright_as_the_first_camera() {
        let camera = Camera::pinhole(640, 480, 1.0);
        let tilt = DQuat::from_scaled_axis(DVec3::new(0.03, -0.02, 0.01));
        for degrees in [0.0, 90.0, 180.0, 270.0_f64] {
            let rotation = tilt * DQuat::from_rotation_z(degrees.to_radians());
            for at in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y] {
                let second = Pose { rotation, translation: -(rotation * (120.0 * at)) };
                let cameras = [(&camera, Pose::IDENTITY), (&camera, second)];
                let made = Rectification::new(cameras, [640, 480], Field::Inside).unwrap();
                let turned = made.views[0].view_from_camera().to_scaled_axis().length();
                assert!(turned < 0.05, "{degrees}°, second at {at}: rotated by {turned} rad");
                assert!(made.baseline_mm.normalize().distance(at) < 1e-9);
            }
        }
    }

    #[test]
    fn cameras_without_a_common_view_are_rejected() {
        let camera = Camera::pinhole(640, 480, 1.0);
        let made = |rotation: DQuat, translation: DVec3| {
            let second = Pose { rotation, translation };
            Rectification::new(
                [(&camera, Pose::IDENTITY), (&camera, second)],
                [640, 480],
                Field::Inside,
            )
        };
        let sideways = DVec3::new(-100.0, 0.0, 0.0);
        assert_eq!(made(DQuat::IDENTITY, DVec3::ZERO), Err(RectificationError::Coincident));
        assert_eq!(made(DQuat::IDENTITY, DVec3::Z), Err(RectificationError::Behind));
        let apart = made(DQuat::from_rotation_y(3.0), sideways).unwrap_err();
        assert!(matches!(apart, RectificationError::Apart { .. }));
    }
}
