//! The pose of a panel on its target.

use glam::{DMat3, DQuat, DVec2, DVec3};
use nalgebra::{Matrix3, Vector3};

use serde::{Deserialize, Serialize};

use crate::camera::Pose;
use crate::quantity;
use crate::targets::Corner;

/// Pose of a panel: `target = rotation · panel + translation`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PanelPose {
    /// Rotation matrix, row-major.
    #[serde(deserialize_with = "quantity::cosine::de")]
    pub rotation: [f64; 9],
    /// Translation, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub translation_mm: DVec3,
    /// Covariance of a small rotation (rad) and translation (mm) along the target's axes, if the pose was measured.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::pose_covariance::de"
    )]
    pub covariance: Option<[[f64; 6]; 6]>,
}

/// Tolerance within which corners count as unrotated, relative to the panel's extent: the rounding
/// of numbers in the file of a flat target.
const FLAT: f64 = 1e-9;

/// Second singular value, relative to the first, below which points count as collinear.
const LINE: f64 = 1e-9;

impl PanelPose {
    /// The identity: the panel frame is the target frame.
    pub const IDENTITY: PanelPose = PanelPose {
        rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        translation_mm: DVec3::ZERO,
        covariance: None,
    };

    /// Creates a pose that was not measured.
    pub fn new(rotation: DMat3, translation_mm: DVec3) -> Self {
        let rotation = rotation.transpose().to_cols_array();
        Self { rotation, translation_mm, covariance: None }
    }

    /// Creates a pose from the motion target_from_panel, with its covariance if it was measured.
    pub fn from_pose(pose: &Pose, covariance: Option<[[f64; 6]; 6]>) -> Self {
        Self { covariance, ..Self::new(DMat3::from_quat(pose.rotation), pose.translation) }
    }

    /// Returns target_from_panel.
    pub fn to_pose(&self) -> Pose {
        let rotation = DQuat::from_mat3(&self.matrix()).normalize();
        Pose { rotation, translation: self.translation_mm }
    }

    /// Returns the rotation matrix.
    pub fn matrix(&self) -> DMat3 {
        DMat3::from_cols_array(&self.rotation).transpose()
    }

    /// Converts a point of the target to the panel frame, mm.
    pub fn panel_from_target(&self, point: DVec3) -> DVec3 {
        self.matrix().transpose() * (point - self.translation_mm)
    }

    /// Converts a point of the panel's plane to the target frame, mm.
    pub fn target_from_panel(&self, point: DVec2) -> DVec3 {
        let rotation = self.matrix();
        rotation.x_axis * point.x + rotation.y_axis * point.y + self.translation_mm
    }

    /// Fits the pose that maps panel positions to target positions by least squares. Returns `None` if the corners
    /// are collinear.
    ///
    /// With centred p and q, H = Σ q pᵀ = U S Vᵀ and R = U diag(1, 1, det U Vᵀ) Vᵀ (Kabsch 1976).
    pub fn fit(corners: &[Corner]) -> Option<PanelPose> {
        let n = corners.len() as f64;
        let panel = |c: &Corner| Vector3::new(c.panel_mm.x, c.panel_mm.y, 0.0);
        let target = |c: &Corner| Vector3::from(c.target_mm.to_array());
        let p0 = corners.iter().map(panel).sum::<Vector3<f64>>() / n;
        let q0 = corners.iter().map(target).sum::<Vector3<f64>>() / n;
        let moved = |c: &Corner| ((target(c) - q0) - (panel(c) - p0)).amax();
        let extent = corners.iter().map(|c| (panel(c) - p0).amax()).fold(0.0, f64::max);
        let flat = corners.iter().all(|c| moved(c) <= FLAT * extent);

        let h: Matrix3<f64> =
            corners.iter().map(|c| (target(c) - q0) * (panel(c) - p0).transpose()).sum();
        let svd = h.svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        let mut sizes: Vec<f64> = svd.singular_values.iter().copied().collect();
        sizes.sort_by(f64::total_cmp);
        if sizes[1] <= LINE * sizes[2] {
            return None;
        }
        // The smallest singular value belongs to the normal of the panel, so the sign goes there.
        let normal = svd.singular_values.imin();
        let mut signs = Vector3::repeat(1.0);
        signs[normal] = (u * v_t).determinant().signum();
        let r = if flat { Matrix3::identity() } else { u * Matrix3::from_diagonal(&signs) * v_t };
        let t = q0 - r * p0;
        let t = if flat { t.map(|v| if v.abs() <= FLAT * extent { 0.0 } else { v }) } else { t };
        let mut rotation = [0.0; 9];
        rotation.copy_from_slice(r.transpose().as_slice());
        Some(PanelPose { rotation, translation_mm: DVec3::new(t.x, t.y, t.z), covariance: None })
    }
}

#[cfg(test)]
mod tests {
    use glam::EulerRot;
    use proptest::prelude::*;

    use super::*;
    use crate::lattice::Vertex;

    proptest! {
        #[test]
        fn a_fit_recovers_any_pose(
            roll in -3.0f64..3.0, pitch in -1.5f64..1.5, yaw in -3.0f64..3.0,
            t in prop::array::uniform3(-500.0f64..500.0),
        ) {
            let r = DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll);
            let corners: Vec<Corner> = [(0, 0), (0, 3), (2, 1), (4, -2)]
                .into_iter()
                .map(|(row, col)| {
                    let panel_mm = Vertex::new(row, col).position() * 20.0;
                    let target_mm = r * panel_mm.extend(0.0) + DVec3::from(t);
                    Corner { id: 0, row, col, panel_mm, target_mm, measured: None }
                })
                .collect();
            let pose = PanelPose::fit(&corners).unwrap();
            for c in &corners {
                let off = pose.target_from_panel(c.panel_mm) - c.target_mm;
                prop_assert!(off.abs().max_element() < 1e-9, "{off}");
            }
            prop_assert!(PanelPose::fit(&corners[..2]).is_none());
        }
    }
}
