//! Corners that several cameras of a rig see at the same time.
//!
//! ```text
//!   X minimises Σ |W(x − π(T X))|²,   δX = N⁻¹ Σ JᵀW (ε − K δu),   N = Σ JᵀWJ,  J = ∂π/∂X,  K = ∂π/∂u
//! ```
//!
//! for errors ε of the corners and errors δu of the cameras.

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{Matrix3, Matrix3xX, Vector2, Vector3};

use super::request::CornerLabel;
use super::sensitivity::{Measured, Point, Sensitivity, Variances};
use crate::estimate::on_rig::{CameraOnRig, Sight};
use crate::input::panel::PanelRef;
use deltille_core::camera::Pose;

/// Number of Gauss–Newton steps: the start is off by a thousandth of the distance, and the problem is nearly linear.
const STEPS: usize = 6;

/// A corner in the image of a camera.
#[derive(Clone, Copy)]
pub(super) struct Image<'a> {
    pub camera: &'a CameraOnRig<'a>,
    pub pixel: DVec2,
    pub variances: Variances,
}

/// The triangulated corners of a frame.
pub(super) struct Triangulated {
    points: Vec<Point>,
    /// For each point: covariances from noise and from other errors, mm², and the derivatives with respect to the cameras.
    covariances: Vec<[Matrix3<f64>; 2]>,
    by_cameras: Vec<Matrix3xX<f64>>,
    /// Sum of the squares of the residuals, px², and their number.
    residuals: (f64, f64),
    /// For each panel, by its index, the rotation from its frame to that of the target.
    panels: Vec<DMat3>,
}

impl Triangulated {
    pub(super) fn new(panels: &[Pose]) -> Self {
        let panels = panels.iter().map(|pose| DMat3::from_quat(pose.rotation)).collect();
        Self {
            points: Vec::new(),
            covariances: Vec::new(),
            by_cameras: Vec::new(),
            residuals: (0.0, 0.0),
            panels,
        }
    }

    /// Adds a corner of the target at `known`, near `start` in the frame of the rig; `unknowns` counts those of all cameras.
    /// `None` if the images do not determine its position.
    pub(super) fn add(
        &mut self,
        label: CornerLabel,
        known: DVec3,
        start: DVec3,
        images: &[Image],
        unknowns: usize,
    ) -> Option<()> {
        let mut at = start;
        for _ in 0..STEPS {
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for image in images {
                let (off, Sight { by_point, .. }) = image.linear(at)?;
                let pull = by_point.transpose() * image.variances.information()?;
                normal += pull * by_point;
                right += pull * off;
            }
            let step = normal.try_inverse()? * right;
            at += DVec3::new(step.x, step.y, step.z);
        }
        let (mut normal, mut squares) = (Matrix3::zeros(), 0.0);
        let (mut noise, mut other) = (Matrix3::zeros(), Matrix3::zeros());
        let mut across = Matrix3xX::zeros(unknowns);
        for image in images {
            let (off, Sight { by_point, by_camera, .. }) = image.linear(at)?;
            squares += off.norm_squared();
            let pull = by_point.transpose() * image.variances.information()?;
            normal += pull * by_point;
            noise += pull * image.variances.noise * pull.transpose();
            other += pull * pull.transpose() * image.variances.other;
            let mut columns = across.columns_mut(image.camera.column, by_camera.ncols());
            columns += pull * by_camera;
        }
        let inverse = normal.try_inverse()?;
        self.residuals.0 += squares;
        self.residuals.1 += 2.0 * images.len() as f64;
        self.points.push(Point { label, known, measured: at });
        self.covariances.push([noise, other].map(|of| inverse * of * inverse));
        self.by_cameras.push(-(inverse * across));
        Some(())
    }
}

impl Image<'_> {
    /// The residual at a point in the frame of the rig, and the derivatives of the pixel.
    fn linear(&self, at: DVec3) -> Option<(Vector2<f64>, Sight)> {
        let seen = self.camera.sight(at)?;
        let off = self.pixel - seen.projection.pixel;
        Some((Vector2::new(off.x, off.y), seen))
    }
}

impl Measured for Triangulated {
    fn points(&self) -> &[Point] {
        &self.points
    }

    fn rms_px(&self) -> f64 {
        (self.residuals.0 / self.residuals.1).sqrt()
    }

    fn sensitivity(&self, [a, b]: [usize; 2], is_known: bool) -> Sensitivity {
        let points = [a, b].map(|i| &self.points[i]);
        let along = (points[1].measured - points[0].measured).normalize_or_zero();
        let e = Vector3::from(along.to_array());
        let [noise_mm2, lens_mm2] = [0, 1].map(|kind| {
            e.dot(&((self.covariances[a][kind] + self.covariances[b][kind]) * e)).max(0.0)
        });
        let by_cameras = e.transpose() * (&self.by_cameras[b] - &self.by_cameras[a]);
        let of_target = (points[1].known - points[0].known).normalize_or_zero();
        let of_panel = |panel: PanelRef| self.panels[panel.index()].transpose() * of_target;
        let ends = points.into_iter().zip([-1.0, 1.0]);
        let by_target = ends
            .filter(|_| !is_known)
            .map(|(point, sign)| (point.label, sign * of_panel(point.label.panel)));
        let by_target = by_target.collect();
        Sensitivity { noise_mm2, lens_mm2, by_cameras, by_target }
    }
}
