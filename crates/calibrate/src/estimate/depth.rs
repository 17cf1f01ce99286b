//! The uncertainty of distances that two cameras of a rig measure by triangulation.
//!
//! A point P is seen at the pixels π(T P; θ) of both cameras. With the same pixels, a change δu of the cameras (their
//! parameters and poses) moves the triangulated point by
//!
//! ```text
//!     δP = −(Σ JᵀJ)⁻¹ Σ JᵀK δu,     J = ∂π/∂P,  K = ∂π/∂u
//! ```
//!
//! and noise of the pixels by (Σ JᵀJ)⁻¹ Σ Jᵀ ε. The distance is that from the first of the two cameras.

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{DMatrix, Matrix3, RowDVector, SMatrix, Vector3};

use super::coverage::Coverage;
use super::on_rig::CameraOnRig;
use super::values::Estimate;
use crate::uncertainty::projection::seen_at;
use deltille_core::camera::Pose;

/// The uncertainty of a triangulated distance: RMS values over points at this distance from the first camera that both cameras
/// see, where the first one detected the corners of the calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DepthUncertainty {
    /// The distance from the first camera, mm.
    pub distance_mm: f64,
    /// Standard deviation from the observed covariance of the calibration, mm.
    pub sd_mm: f64,
    /// Standard deviation from noise of the pixels, mm for each px of noise per coordinate.
    pub mm_per_px: f64,
}

impl Estimate {
    /// The uncertainty of distances that two cameras measure by triangulation; `None` if the observed covariance of the rig
    /// is not known, or if the cameras see no common point at this distance.
    pub fn depth_uncertainty(
        &self,
        cameras: [usize; 2],
        distance_mm: f64,
    ) -> Option<DepthUncertainty> {
        let (all, observed) = self.cameras_on_rig()?;
        let covariance = observed.covariance.inner();
        let pair = [all.get(cameras[0])?, all.get(cameras[1])?];
        let (mut variance, mut noise, mut count) = (0.0, 0.0, 0.0);
        let first = pair[0].estimate;
        for (pixel, corners) in Coverage::of(first).blocks(first.size_px()) {
            let change = Change::of(pair, pixel, distance_mm, covariance.nrows());
            let Some(change) = change else { continue };
            let of_calibration = &change.by_unknowns * covariance * change.by_unknowns.transpose();
            variance += corners * of_calibration[0];
            noise += corners * change.noise_mm2;
            count += corners;
        }
        (count > 0.0).then(|| DepthUncertainty {
            distance_mm,
            sd_mm: (variance / count).sqrt(),
            mm_per_px: (noise / count).sqrt(),
        })
    }

    /// The uncertainty of all pairs of cameras that saw the target together, at the distances for which the projection
    /// uncertainty of the first one is reported; the pairs are indices of cameras.
    pub fn depth_uncertainties(&self) -> Vec<([usize; 2], DepthUncertainty)> {
        let overlaps = self.overlaps();
        let pairs = overlaps.iter().enumerate().flat_map(|(first, others)| {
            others.iter().filter(move |&&second| second > first).map(move |&second| [first, second])
        });
        let at_distances = pairs.flat_map(|pair| {
            let distances = self.cameras[pair[0]].projection.iter();
            let distances = distances.flat_map(|known| &known.distances_mm);
            distances.filter_map(move |&mm| Some((pair, self.depth_uncertainty(pair, mm)?)))
        });
        at_distances.collect()
    }
}

/// How a triangulated distance changes.
struct Change {
    /// Its derivatives with respect to the unknowns of all cameras.
    by_unknowns: RowDVector<f64>,
    /// Its variance for pixels with noise of 1 px, mm².
    noise_mm2: f64,
}

impl Change {
    /// For the point at a distance that the first camera sees at a pixel; `None` if the second one does not see it.
    fn of(
        [first, second]: [&CameraOnRig; 2],
        pixel: DVec2,
        distance_mm: f64,
        unknowns: usize,
    ) -> Option<Self> {
        let rig_from_first = first.estimate.camera_from_rig.inverse();
        let place = seen_at(&first.estimate.camera, pixel, Some(distance_mm))?;
        let point = rig_from_first.apply(place);
        let sight = (point - rig_from_first.translation).normalize_or_zero();
        let sight = Vector3::from(sight.to_array());
        let mut normal = Matrix3::zeros();
        let mut across = DMatrix::zeros(3, unknowns);
        for camera in [first, second] {
            let seen = camera.sight(point)?;
            if !camera.estimate.camera.sees(seen.projection.pixel, 0.0) {
                return None;
            }
            normal += seen.by_point.transpose() * seen.by_point;
            let mut columns = across.columns_mut(camera.column, camera.unknowns());
            columns.copy_from(&(seen.by_point.transpose() * &seen.by_camera));
        }
        let inverse = normal.try_inverse()?;
        let pull = inverse * sight;
        let mut by_unknowns = -(pull.transpose() * across);
        if first.estimate.pose_sd.is_some() {
            let of_place = sight.transpose() * by_place(&first.estimate.camera_from_rig);
            let mut columns = by_unknowns.columns_mut(first.column + first.free.len(), 6);
            columns -= of_place;
        }
        Some(Self { by_unknowns, noise_mm2: sight.dot(&pull) })
    }
}

/// The derivatives of the place −Rᵀt of a camera on the rig with respect to (ω, τ) of its pose.
fn by_place(camera_from_rig: &Pose) -> SMatrix<f64, 3, 6> {
    let back = DMat3::from_quat(camera_from_rig.rotation.conjugate());
    let t = camera_from_rig.translation;
    let turned = DVec3::AXES.map(|axis| back * axis.cross(t));
    let moved = DVec3::AXES.map(|axis| -(back * axis));
    let columns = turned.into_iter().chain(moved).flat_map(|column| column.to_array());
    SMatrix::from_iterator(columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::on_rig::simulated::{changed, rig, set_covariance};
    use crate::estimate::values::CameraEstimate;
    use deltille_core::camera::{BrownConrady, Camera, Lens};
    use glam::DQuat;

    /// The distance from the first of two cameras of the point that projects to two pixels with the least squares.
    fn triangulated(pair: [&CameraEstimate; 2], pixels: [DVec2; 2], start: DVec3) -> f64 {
        let mut point = start;
        for _ in 0..20 {
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for (camera, pixel) in pair.into_iter().zip(pixels) {
                let at =
                    |point| camera.camera.project(camera.camera_from_rig.apply(point)).unwrap();
                let off = pixel - at(point);
                let by = DVec3::AXES
                    .map(|axis| (at(point + 1e-3 * axis) - at(point - 1e-3 * axis)) / 2e-3);
                let by = SMatrix::<f64, 2, 3>::from_fn(|i, j| by[j][i]);
                normal += by.transpose() * by;
                right += by.transpose()
                    * Vector3::from_fn(|i, _| if i < 2 { off[i] } else { 0.0 }).fixed_rows::<2>(0);
            }
            let step = normal.try_inverse().unwrap() * right;
            point += DVec3::new(step[0], step[1], step[2]);
        }
        point.distance(pair[0].camera_from_rig.inverse().translation)
    }

    #[test]
    fn derivatives_equal_finite_differences() {
        for [first, second] in [[0, 1], [1, 2]] {
            let rig = rig(3);
            let (all, observed) = rig.cameras_on_rig().unwrap();
            let pixel = DVec2::new(700.0, 300.0);
            let pair = [&all[first], &all[second]];
            let found = Change::of(pair, pixel, 900.0, observed.covariance.rows()).unwrap();
            let point = rig.cameras[first].camera_from_rig.inverse();
            let point =
                point.apply(seen_at(&rig.cameras[first].camera, pixel, Some(900.0)).unwrap());
            let pixels = [first, second].map(|index| {
                let of = &rig.cameras[index];
                of.camera.project(of.camera_from_rig.apply(point)).unwrap()
            });
            for index in [first, second] {
                let start = all[index].column;
                for unknown in 0..all[index].unknowns() {
                    let distance = |by: f64| {
                        let changed = changed(&rig, index, unknown, by);
                        triangulated(
                            [&changed.cameras[first], &changed.cameras[second]],
                            pixels,
                            point,
                        )
                    };
                    let step = if (4..7).contains(&unknown) { 1e-5 } else { 1e-3 };
                    let expected = (distance(step) - distance(-step)) / (2.0 * step);
                    let value = found.by_unknowns[start + unknown];
                    let error = (value - expected).abs();
                    assert!(
                        error < 1e-4 * (1.0 + expected.abs()),
                        "{index} {unknown}: {value}, {expected}"
                    );
                }
            }
        }
    }

    /// For parallel cameras the distance d along the axis has the error d² ε / (f b) for a disparity that is off by ε px.
    #[test]
    fn noise_is_that_of_a_disparity() {
        let mut rig = rig(2);
        let pinhole =
            Camera::centred(1280, 960, 1000.0, Lens::BrownConrady(BrownConrady::default()));
        for camera in &mut rig.cameras {
            camera.camera = pinhole.clone();
            camera.camera_from_rig.rotation = DQuat::IDENTITY;
        }
        rig.cameras[1].camera_from_rig.translation = DVec3::new(-100.0, 0.0, 0.0);
        set_covariance(&mut rig, |_, _| 0.0);
        let (all, observed) = rig.cameras_on_rig().unwrap();
        let (columns, unknowns) = (all[1].column, observed.covariance.rows());
        let pair = [&all[0], &all[1]];
        let found = Change::of(pair, pinhole.centre_px, 2000.0, unknowns).unwrap();
        let expected = 2f64.sqrt() * 2000.0 * 2000.0 / (1000.0 * 100.0);
        assert!(
            (found.noise_mm2.sqrt() / expected - 1.0).abs() < 0.01,
            "{}",
            found.noise_mm2.sqrt()
        );
        // A base that is 1 % longer makes distances 1 % longer.
        let by_base = found.by_unknowns[columns + 4 + 3];
        assert!((by_base + 2000.0 / 100.0).abs() < 0.2, "{by_base}");
        set_covariance(&mut rig, |i, j| f64::from(i == j && i == columns + 7));
        let found = rig.depth_uncertainty([0, 1], 2000.0).unwrap();
        assert!((found.sd_mm / 20.0 - 1.0).abs() < 0.1, "{found:?}");
    }
}
