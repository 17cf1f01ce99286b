//! Radial displacement of a lens relative to an ideal lens, against the angle from the axis.
//!
//! ```text
//!     displacement(θ) = mean over φ of |p(θ, φ) − c| − |i(θ, φ) − c|       px
//! ```
//!
//! p is the pixel of the camera for the direction at the angle θ from its axis and the azimuth φ; i is that of an ideal lens with
//! the same focal length near the axis; c is the principal point. The ideal lens is a pinhole, f tan θ, or equidistant, f θ, if
//! the field of view is too wide for a pinhole.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3};

use crate::report::measures::survey::Survey;
use deltille_core::camera::Camera;

/// Maximum angle from the axis at which a lens is compared with a pinhole, rad: there the radius is 2.7 times the focal length.
const PINHOLE_RAD: f64 = 70.0 / 180.0 * PI;

/// Maximum angle from the axis, rad: no lens sees more.
const MAX_RAD: f64 = 130.0 / 180.0 * PI;

/// Distance that stands for infinity, mm, and angle from the axis at which the focal length is measured, rad.
pub(in crate::report) const INFINITY_MM: f64 = 1e9;
const NEAR_AXIS_RAD: f64 = 1e-4;

/// Number of directions around the axis, and number of angles of the curve.
const AROUND: usize = 32;
const ANGLES: usize = 96;

/// Minimum difference, px, between projections of points at the distance of the corners and at infinity at which both curves
/// are drawn.
pub(in crate::report) const APART_PX: f64 = 0.05;

/// The ideal lens that serves as reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::report) struct Ideal {
    pub focal_px: DVec2,
    pub centre_px: DVec2,
    is_pinhole: bool,
}

/// The displacement of a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::report) struct Displacement {
    /// Angle from the axis, rad.
    pub angle_rad: f64,
    /// Mean, minimum and maximum around the axis, px.
    pub mean_px: f64,
    pub least_px: f64,
    pub most_px: f64,
}

impl Ideal {
    /// The ideal lens of a camera whose image reaches `widest_rad` from the axis.
    pub(crate) fn of(camera: &Camera, widest_rad: f64) -> Self {
        // The knots of a spline determine its axis, not cx and cy.
        let on_axis = camera.project(INFINITY_MM * DVec3::Z);
        let centre_px = on_axis.unwrap_or(camera.centre_px);
        let near = |axis: DVec3| {
            let direction = (DVec3::Z + NEAR_AXIS_RAD * axis).normalize();
            let at = camera.project(INFINITY_MM * direction)?;
            Some(at.distance(centre_px) / NEAR_AXIS_RAD)
        };
        let focal = near(DVec3::X).zip(near(DVec3::Y));
        let focal_px = focal.map_or(camera.focal_px, DVec2::from);
        Self { focal_px, centre_px, is_pinhole: widest_rad < PINHOLE_RAD }
    }

    /// The pixel of a direction; `None` behind a pinhole.
    pub(crate) fn pixel(&self, direction: DVec3) -> Option<DVec2> {
        let angle = direction.angle_between(DVec3::Z);
        let around = direction.truncate().try_normalize().unwrap_or(DVec2::ZERO);
        let radius = match self.is_pinhole {
            true if angle >= FRAC_PI_2 => return None,
            true => angle.tan(),
            false => angle,
        };
        Some(self.centre_px + self.focal_px * radius * around)
    }

    /// The direction of a pixel; `None` if the pixel has none.
    pub(crate) fn direction(&self, pixel: DVec2) -> Option<DVec3> {
        let flat = (pixel - self.centre_px) / self.focal_px;
        let angle = if self.is_pinhole { flat.length().atan() } else { flat.length() };
        let around = flat.try_normalize().unwrap_or(DVec2::ZERO);
        (angle < MAX_RAD).then(|| (around * angle.sin()).extend(angle.cos()))
    }

    /// The projection law, as the axis labels show it.
    pub(crate) fn law(&self) -> &'static str {
        if self.is_pinhole { "f · tan θ" } else { "f · θ" }
    }

    pub(crate) fn name(&self) -> &'static str {
        if self.is_pinhole { "a pinhole" } else { "an equidistant lens" }
    }
}

/// The angles from the axis at the limits of the image, rad: at its sides or its image circle, and in its corners.
pub(in crate::report) fn shown_rad(camera: &Camera, survey: &Survey) -> [f64; 2] {
    let angle = |pixel: DVec2| {
        let ray = camera.unproject(pixel)?;
        Some(ray.direction.angle_between(DVec3::Z).min(MAX_RAD))
    };
    let most = |pixels: Vec<DVec2>| pixels.into_iter().filter_map(angle).fold(0.0, f64::max);
    let DVec2 { x: w, y: h } = survey.size_px;
    let DVec2 { x, y } = camera.centre_px;
    let sides = [(-0.5, y), (w - 0.5, y), (x, -0.5), (x, h - 0.5)].map(DVec2::from).to_vec();
    let within = |pixel: &DVec2| survey.circle.is_none_or(|c| c.radius_of(*pixel) <= c.radius_px);
    let rim = survey.circle.map_or(0.0, |circle| {
        let around = (0..AROUND).map(|i| DVec2::from_angle(TAU * i as f64 / AROUND as f64));
        let on_rim = around.map(|at| circle.centre_px + circle.radius_px * at);
        most(on_rim.filter(|&pixel| camera.sees(pixel, 0.0)).collect())
    });
    let side = most(sides.into_iter().filter(within).collect()).max(rim);
    let corner = most(camera.corners_px().into_iter().filter(within).collect());
    [side, corner.max(side)]
}

/// The displacements of points at a distance, up to an angle.
pub(in crate::report) fn curve(
    camera: &Camera,
    ideal: &Ideal,
    distance_mm: f64,
    widest_rad: f64,
) -> Vec<Displacement> {
    let steady = camera.lens.monotonic_radius().unwrap_or(f64::INFINITY);
    let angles = (0..=ANGLES).map(|i| widest_rad * i as f64 / ANGLES as f64);
    let at = |angle_rad: f64| {
        let displacements = (0..AROUND).map(|i| {
            let around = DVec2::from_angle(TAU * i as f64 / AROUND as f64);
            let direction = (around * angle_rad.sin()).extend(angle_rad.cos());
            let pixel = camera.project(distance_mm * direction)?;
            // The model is not valid beyond the angle at which the radius decreases.
            let radius = ((pixel - camera.centre_px) / camera.focal_px).length();
            let centre_px = ideal.centre_px;
            let ideal = ideal.pixel(direction)?.distance(centre_px);
            (radius <= steady).then(|| pixel.distance(centre_px) - ideal)
        });
        let all: Vec<f64> = displacements.collect::<Option<_>>()?;
        Some(Displacement {
            angle_rad,
            mean_px: all.iter().sum::<f64>() / all.len() as f64,
            least_px: all.iter().copied().fold(f64::INFINITY, f64::min),
            most_px: all.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        })
    };
    angles.map_while(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::camera::{BrownConrady, KannalaBrandt, Lens, Pupil};

    const SIZE: [u32; 2] = [1600, 1200];

    fn camera(lens: Lens, focal_px: f64) -> Camera {
        Camera::centred(SIZE[0], SIZE[1], focal_px, lens)
    }

    #[test]
    fn the_curve_follows_the_lens_formulas() {
        let radial = [-0.2, 0.05, 0.01];
        let radtan = Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() });
        let camera_of_it = camera(radtan, 900.0);
        let ideal = Ideal::of(&camera_of_it, 0.8);
        for at in curve(&camera_of_it, &ideal, INFINITY_MM, 0.7) {
            let r = at.angle_rad.tan();
            let expected = 900.0 * r * (r * r * (-0.2 + r * r * (0.05 + r * r * 0.01)));
            assert!((at.mean_px - expected).abs() < 1e-2, "{at:?} {expected}");
            assert!(at.most_px - at.least_px < 1e-6);
        }
        let k = vec![-0.03, 0.004, 0.0, 0.0];
        let fisheye = camera(Lens::KannalaBrandt(KannalaBrandt { k }), 350.0);
        let ideal = Ideal::of(&fisheye, 1.9);
        for at in curve(&fisheye, &ideal, INFINITY_MM, 1.8) {
            let t = at.angle_rad;
            let expected = 350.0 * (-0.03 * t.powi(3) + 0.004 * t.powi(5));
            assert!((at.mean_px - expected).abs() < 1e-2, "{at:?} {expected}");
        }
    }

    #[test]
    fn near_and_far_curves_differ_for_a_moving_pupil() {
        let mut lens = Lens::Pupil(Pupil::default());
        let names = lens.names();
        let values = names.iter().map(|name| if name.starts_with('e') { 2.0 } else { 0.0 });
        lens = lens.with_parameters(&values.collect::<Vec<_>>());
        let camera = camera(lens, 350.0);
        let ideal = Ideal::of(&camera, 1.6);
        let [near, far] = [200.0, INFINITY_MM].map(|mm| curve(&camera, &ideal, mm, 1.4));
        let apart = near.iter().zip(&far).map(|(a, b)| (a.mean_px - b.mean_px).abs());
        assert!(apart.fold(0.0, f64::max) > APART_PX, "{names:?}");
    }

    #[test]
    fn ideal_lenses_unproject_their_projections() {
        for widest in [0.8, 1.8] {
            let ideal =
                Ideal::of(&camera(Lens::BrownConrady(BrownConrady::default()), 500.0), widest);
            let pixel = DVec2::new(300.0, 900.0);
            let back = ideal.pixel(ideal.direction(pixel).unwrap()).unwrap();
            assert!(back.abs_diff_eq(pixel, 1e-9), "{back}");
        }
    }
}
