//! The uncertainty of the pose of a target that calibrated cameras estimate.
//!
//! The pose (ω, τ) of a target, a rotation about its centre and a translation, minimises the squares of the residuals
//! of its corners. With the same pixels, a change δu of the cameras (their parameters and poses) changes it by
//!
//! ```text
//!     δψ = −N⁻¹ Σ JᵀK δu,     N = Σ JᵀJ,  J = ∂π/∂ψ,  K = ∂π/∂u
//! ```
//!
//! and noise ε of the pixels by N⁻¹ Σ Jᵀ ε.

use std::f64::consts::FRAC_PI_4;

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{DMatrix, Matrix3, Matrix6, SMatrix};

use super::coverage::Coverage;
use super::on_rig::CameraOnRig;
use super::values::Estimate;
use crate::uncertainty::projection::{seen_at, solved};
use deltille_core::camera::Pose;
use deltille_core::targets::Target;

/// Tilt of the target against the direction in which it is seen, rad (30°). The rotation of a target that faces the camera is
/// much less certain.
const TILT: f64 = std::f64::consts::FRAC_PI_6;

/// Number of corners that determine a pose without doubt.
const LEAST_CORNERS: usize = 6;

/// The uncertainty of a pose: RMS values over positions at this distance at which the camera sees the whole target, tilted by 30°. The
/// centre of the target is where the corners of the calibration were detected.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PoseUncertainty {
    /// The camera, by its index. Other cameras of a rig contribute where they see the target too.
    pub camera: usize,
    /// Name of the target.
    pub target: String,
    /// Distance of the centre of the target from the camera, mm.
    pub distance_mm: f64,
    /// Standard deviations from the observed covariance of the calibration.
    pub calibration: PoseSd,
    /// Standard deviations for noise of the pixels of 1 px per coordinate.
    pub per_px: PoseSd,
}

/// Standard deviations of a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PoseSd {
    /// Of the rotation, rad: RMS of three axes.
    pub rotation_rad: f64,
    /// Of the position of the centre across the line of sight, mm: RMS of two directions.
    pub across_mm: f64,
    /// Of the position of the centre along the line of sight, mm.
    pub along_mm: f64,
}

impl Estimate {
    /// The uncertainty of the pose of a target, at a distance in mm of its centre from a camera. For a rig, this is the pose in the
    /// rig frame that all cameras estimate together. `None` if the observed covariance of the calibration is not known, or if the
    /// target is larger than the image of the camera at this distance.
    pub fn pose_uncertainty(
        &self,
        camera: usize,
        target: &Target,
        distance_mm: f64,
    ) -> Option<PoseUncertainty> {
        let (cameras, observed) = self.cameras_on_rig()?;
        let covariance = observed.covariance.inner();
        let of = cameras.get(camera)?;
        let body = Body::of(target)?;
        let mut sums = [Sum::default(), Sum::default()];
        let rig_from_camera = of.estimate.camera_from_rig.inverse();
        let positions = Coverage::of(of.estimate).blocks(of.estimate.size_px());
        for (index, (pixel, corners)) in positions.into_iter().enumerate() {
            let Some(centre) = seen_at(&of.estimate.camera, pixel, Some(distance_mm)) else {
                continue;
            };
            // Successive positions are tilted about different axes.
            let pose = body.facing(centre, TILT, FRAC_PI_4 * (index % 8) as f64);
            let seen = Seen::of(&cameras, camera, &body, &rig_from_camera.after(&pose));
            let Some(seen) = seen else { continue };
            let sight = (rig_from_camera.rotation * centre).normalize_or_zero();
            let by_calibration = &seen.by_cameras * covariance * seen.by_cameras.transpose();
            sums[0].add(&by_calibration, sight, corners);
            sums[1].add(&seen.noise, sight, corners);
        }
        let [calibration, per_px] = sums.map(|sum| sum.rms());
        Some(PoseUncertainty {
            camera,
            target: target.name.to_string(),
            distance_mm,
            calibration: calibration?,
            per_px: per_px?,
        })
    }

    /// The uncertainty of the poses of targets for all cameras, at the distances for which their projection uncertainty is reported.
    pub fn pose_uncertainties(&self, targets: &[Target]) -> Vec<PoseUncertainty> {
        let mut all = Vec::new();
        for (index, camera) in self.cameras.iter().enumerate() {
            let distances = camera.projection.iter().flat_map(|known| &known.distances_mm);
            for &mm in distances {
                let of_target = |target| self.pose_uncertainty(index, target, mm);
                all.extend(targets.iter().filter_map(of_target));
            }
        }
        all
    }
}

/// The corners of a target, with the normals of their panels, about its centre.
struct Body {
    corners: Vec<[DVec3; 2]>,
    centre: DVec3,
}

impl Body {
    /// `None` without corners.
    fn of(target: &Target) -> Option<Self> {
        let panels = target.panels.iter();
        let corners = panels.flat_map(|panel| {
            let normal = panel.pose.matrix().z_axis;
            panel.corners.iter().map(move |corner| [corner.target_mm, normal])
        });
        let corners: Vec<[DVec3; 2]> = corners.collect();
        let centre = corners.iter().map(|[place, _]| *place).sum::<DVec3>();
        let centre = centre / corners.len() as f64;
        centre.is_finite().then_some(Self { corners, centre })
    }

    /// The pose with its centre at a point of the camera's frame: its z axis points to the camera, then is tilted about an axis
    /// across the line of sight.
    fn facing(&self, centre: DVec3, tilt: f64, direction: f64) -> Pose {
        let back = -centre.normalize_or_zero();
        let up = (-DVec3::Y).reject_from_normalized(back).normalize_or(DVec3::X);
        let upright = DMat3::from_cols(up.cross(back), up, back);
        let axis = upright * DVec3::new(direction.cos(), direction.sin(), 0.0);
        let rotation = DQuat::from_axis_angle(axis, tilt) * DQuat::from_mat3(&upright);
        Pose { rotation, translation: centre - rotation * self.centre }
    }
}

/// How the pose of a target depends on its images.
struct Seen {
    /// Its derivatives with respect to the unknowns of all cameras.
    by_cameras: DMatrix<f64>,
    /// Its covariance for pixels with noise of 1 px.
    noise: DMatrix<f64>,
}

impl Seen {
    /// For a target at a pose in the frame of the rig; `None` if the first camera does not see the whole target, or if the
    /// images do not determine the pose.
    fn of(cameras: &[CameraOnRig], first: usize, body: &Body, pose: &Pose) -> Option<Self> {
        let unknowns = cameras.iter().map(CameraOnRig::unknowns).sum();
        let (mut normal, mut across) = (Matrix6::zeros(), DMatrix::zeros(6, unknowns));
        let mut visible = 0;
        let centre = pose.apply(body.centre);
        for (index, camera) in cameras.iter().enumerate() {
            let eye = camera.estimate.camera_from_rig.inverse().translation;
            let corners = body.corners.iter().map(|[place, up]| (pose.apply(*place), up));
            let facing =
                corners.filter(|(place, up)| (pose.rotation * **up).dot(eye - place) > 0.0);
            let (mut all, mut inside) = (0, 0);
            for (place, _) in facing {
                all += 1;
                let Some(seen) = camera.sight(place) else { continue };
                if !camera.estimate.camera.sees(seen.projection.pixel, 0.0) {
                    continue;
                }
                inside += 1;
                let arm = cross(place - centre);
                let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
                by_pose.fixed_columns_mut::<3>(0).copy_from(&(-seen.by_point * arm));
                by_pose.fixed_columns_mut::<3>(3).copy_from(&seen.by_point);
                normal += by_pose.transpose() * by_pose;
                let mut columns = across.columns_mut(camera.column, camera.unknowns());
                columns += by_pose.transpose() * &seen.by_camera;
            }
            if index == first && inside < all {
                return None;
            }
            visible += inside;
        }
        if visible < LEAST_CORNERS {
            return None;
        }
        let noise = solved(&normal, &DMatrix::identity(6, 6))?;
        Some(Self { by_cameras: -solved(&normal, &across)?, noise })
    }
}

/// The matrix [a]× with [a]× b = a × b.
fn cross(a: DVec3) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// A sum of variances over positions.
#[derive(Clone, Copy, Default)]
struct Sum {
    rotation: f64,
    across: f64,
    along: f64,
    weight: f64,
}

impl Sum {
    /// Adds the covariance of a pose whose centre is seen along a unit vector, with a weight.
    fn add(&mut self, covariance: &DMatrix<f64>, sight: DVec3, weight: f64) {
        let trace = |first: usize| (first..first + 3).map(|i| covariance[(i, i)]).sum::<f64>();
        let along = (0..9).map(|k| {
            let (i, j) = (k / 3, k % 3);
            sight[i] * covariance[(3 + i, 3 + j)] * sight[j]
        });
        let along: f64 = along.sum();
        self.rotation += weight * trace(0) / 3.0;
        self.across += weight * (trace(3) - along) / 2.0;
        self.along += weight * along;
        self.weight += weight;
    }

    /// `None` for an empty sum.
    fn rms(self) -> Option<PoseSd> {
        let rms = |sum: f64| (sum.max(0.0) / self.weight).sqrt();
        (self.weight > 0.0).then(|| PoseSd {
            rotation_rad: rms(self.rotation),
            across_mm: rms(self.across),
            along_mm: rms(self.along),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::on_rig::simulated::{changed, rig, set_covariance};
    use deltille_core::targets::BoardSpec;
    use glam::DVec2;

    fn board() -> Target {
        Target::new("board", BoardSpec::deltille(8, 10, 20.0)).unwrap()
    }

    /// The pose with the least squares for pixels of two cameras, from a start close to it.
    fn solved_pose(rig: &Estimate, body: &Body, pixels: &[[DVec2; 2]], start: Pose) -> Pose {
        let (cameras, _) = rig.cameras_on_rig().unwrap();
        let mut pose = start;
        for _ in 0..10 {
            let (mut normal, mut right) = (Matrix6::zeros(), DMatrix::zeros(6, 1));
            for ([place, _], pixels) in body.corners.iter().zip(pixels) {
                let arm = pose.rotation * (*place - body.centre);
                for (camera, pixel) in cameras.iter().zip(pixels) {
                    let seen = camera.sight(pose.apply(*place)).unwrap();
                    let off = *pixel - seen.projection.pixel;
                    let by = SMatrix::<f64, 2, 6>::from_fn(|i, j| {
                        let row = DVec3::new(
                            seen.by_point[(i, 0)],
                            seen.by_point[(i, 1)],
                            seen.by_point[(i, 2)],
                        );
                        if j < 3 { row.dot(DVec3::AXES[j].cross(arm)) } else { row[j - 3] }
                    });
                    normal += by.transpose() * by;
                    right += by.transpose() * nalgebra::Vector2::new(off.x, off.y);
                }
            }
            let step = solved(&normal, &right).unwrap();
            let turn = DQuat::from_scaled_axis(DVec3::new(step[0], step[1], step[2]));
            let centre = pose.apply(body.centre) + DVec3::new(step[3], step[4], step[5]);
            pose.rotation = turn * pose.rotation;
            pose.translation = centre - pose.rotation * body.centre;
        }
        pose
    }

    #[test]
    fn derivatives_equal_finite_differences() {
        let (rig, body) = (rig(2), Body::of(&board()).unwrap());
        let (cameras, _) = rig.cameras_on_rig().unwrap();
        let pose = body.facing(DVec3::new(30.0, -20.0, 600.0), TILT, 1.0);
        let found = Seen::of(&cameras, 0, &body, &pose).unwrap();
        let seen =
            |place: DVec3| [0, 1].map(|i: usize| cameras[i].sight(place).unwrap().projection.pixel);
        let pixels: Vec<_> =
            body.corners.iter().map(|[place, _]| seen(pose.apply(*place))).collect();
        for unknown in 0..14 {
            let step = if (8..11).contains(&unknown) { 1e-5 } else { 1e-2 };
            let [more, less] = [step, -step].map(|by| {
                let (camera, own) =
                    (usize::from(unknown >= 4), unknown - if unknown < 4 { 0 } else { 4 });
                let changed = changed(&rig, camera, own, by);
                solved_pose(&changed, &body, &pixels, pose)
            });
            let turn = (more.rotation * less.rotation.conjugate()).to_scaled_axis();
            let moved = more.apply(body.centre) - less.apply(body.centre);
            let expected = [turn, moved].map(|by| by / (2.0 * step));
            for axis in 0..6 {
                let (value, expected) =
                    (found.by_cameras[(axis, unknown)], expected[axis / 3][axis % 3]);
                let error = (value - expected).abs();
                assert!(
                    error < 1e-3 * expected.abs() + 1e-6,
                    "{unknown} {axis}: {value}, {expected}"
                );
            }
        }
    }

    /// A focal length that is 1 % longer makes distances 1 % longer, where perspective is weak.
    #[test]
    fn a_focal_length_acts_on_the_distance() {
        let mut only = rig(1);
        set_covariance(&mut only, |i, j| if i < 2 && j < 2 { 10_000.0 } else { 0.0 });
        only.cameras[0].camera.focal_px = DVec2::splat(10_000.0);
        let of = |mm: f64| only.pose_uncertainty(0, &board(), mm).unwrap();
        let [near, far] = [of(5000.0), of(10_000.0)];
        assert!((far.calibration.along_mm / 100.0 - 1.0).abs() < 0.03, "{far:?}");
        // Twice as far, noise across the line of sight acts twice and along it four times as strongly.
        assert!((far.per_px.across_mm / near.per_px.across_mm / 2.0 - 1.0).abs() < 0.1, "{far:?}");
        assert!((far.per_px.along_mm / near.per_px.along_mm / 4.0 - 1.0).abs() < 0.1, "{far:?}");
        assert_eq!(only.pose_uncertainty(0, &board(), 600.0), None);
    }
}
