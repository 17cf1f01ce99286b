//! Properties of every camera model.

use deltille::camera::{
    BrownConrady, Camera, DoubleSphere, ExtendedUnified, KannalaBrandt, Lens, Pupil, Spline,
    SplineGrid,
};
use glam::{DVec2, DVec3};
use proptest::prelude::*;

/// A camera of each model with a typical lens, and the largest tested angle from the axis, rad.
fn cameras() -> Vec<(Camera, f64)> {
    let rational = BrownConrady {
        radial: [0.4, -0.1, 0.002],
        tangential: [3e-4, -5e-4],
        denominator: [0.7, 0.05, 0.01],
        prism: [1e-3, -2e-4, -5e-4, 1e-4],
    };
    let radtan = BrownConrady {
        radial: [-0.2, 0.05, -0.004],
        tangential: [-4e-4, 3e-4],
        ..BrownConrady::default()
    };
    let fisheye = |k: &[f64]| Lens::KannalaBrandt(KannalaBrandt { k: k.to_vec() });
    let pupil = Pupil {
        k: [-0.02, 0.003, -5e-4, 1e-4, -1e-5],
        tangential: [2e-4, -3e-4],
        shift_mm: [0.8, -0.2, 0.05],
    };
    let lenses = [
        (Lens::BrownConrady(BrownConrady::default()), 1.2),
        (Lens::BrownConrady(radtan), 0.9),
        (Lens::BrownConrady(rational), 0.8),
        (fisheye(&[-0.02, 0.002, -1e-4, 1e-5]), 1.9),
        (fisheye(&[-0.02, 0.002, -1e-4, 1e-5, 1e-6, -1e-7]), 1.9),
        (Lens::ExtendedUnified(ExtendedUnified { alpha: 0.6, beta: 1.1 }), 1.9),
        (Lens::ExtendedUnified(ExtendedUnified { alpha: 0.4, beta: 0.9 }), 1.5),
        (Lens::DoubleSphere(DoubleSphere { xi: -0.2, alpha: 0.6 }), 1.9),
        (Lens::DoubleSphere(DoubleSphere { xi: 0.3, alpha: 0.3 }), 1.5),
        (Lens::Pupil(pupil), 1.9),
        (spline(3, [9, 9], 240), 1.9),
        (spline(2, [9, 9], 240), 1.9),
        (spline(3, [6, 6], 80), 0.6),
    ];
    let focal_px = DVec2::new(501.0, 497.0);
    let camera = |lens| Camera { focal_px, ..Camera::centred(1600, 1200, 1.0, lens) };
    lenses.into_iter().map(|(lens, reach)| (camera(lens), reach)).collect()
}

/// A spline whose knots are displaced by a tenth of their distance.
fn spline(degree: usize, knots: [usize; 2], fov_x_deg: u32) -> Lens {
    let grid = SplineGrid::new(degree, knots, fov_x_deg).unwrap();
    let bend = |i: usize| {
        let turn = 1.7 * i as f64;
        0.1 * grid.distance() * DVec2::new(turn.sin(), (1.3 * turn).cos())
    };
    Lens::Spline(Spline::new(grid).with_knots((0..grid.count()).map(bend).collect()))
}

/// A point at an angle from the axis, an azimuth, and a distance.
fn point(theta: f64, phi: f64, distance: f64) -> DVec3 {
    distance * DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

proptest! {
    #[test]
    fn derivatives_match_the_projection(
        part in 0.0f64..1.0, phi in -3.2f64..3.2, distance in 50.0f64..2000.0,
    ) {
        for (camera, reach) in cameras() {
            let point = point(part * reach, phi, distance);
            let at = camera.project_with_derivatives(point);
            prop_assert!(at.is_some(), "{camera:?}");
            let at = at.unwrap();
            prop_assert_eq!(Some(at.pixel), camera.project(point));
            // Central differences: a truncation error of h², and a rounding error of 1e-13/h. The curvature of curves
            // of degree 2 jumps at a knot, which adds an error of h if the two points lie on either side of it.
            let is_quadratic = matches!(&camera.lens, Lens::Spline(spline) if spline.grid().degree == 2);
            let limit = if is_quadratic { 1e-2 } else { 1e-4 };
            let differences = |high: Option<DVec2>, low: Option<DVec2>, h: f64| {
                ((high.unwrap() - low.unwrap()) / (2.0 * h)).to_array()
            };
            for axis in 0..3 {
                let h = 1e-5 * distance;
                let step = h * DVec3::AXES[axis];
                let expected =
                    differences(camera.project(point + step), camera.project(point - step), h);
                for (by, expected) in at.by_point.iter().zip(expected) {
                    let off = (by[axis] - expected).abs() * distance;
                    prop_assert!(off < limit, "{:?} axis {axis}: {off}", camera.lens);
                }
            }
            let values = camera.parameters();
            for (k, name) in camera.parameter_names().iter().enumerate() {
                let h = 1e-6 * values[k].abs().max(1.0);
                let moved = |by: f64| {
                    let mut values = values.clone();
                    values[k] += by;
                    camera.with_parameters(&values).project(point)
                };
                let expected = differences(moved(h), moved(-h), h);
                for (by, expected) in at.by_parameter(k).iter().zip(expected) {
                    let off = (by - expected).abs();
                    let size = 1.0 + expected.abs();
                    prop_assert!(off < 1e-5 * size, "{:?} {name}: {off}", camera.lens);
                }
            }
        }
    }

    #[test]
    fn the_ray_of_a_pixel_passes_through_its_point(
        part in 0.0f64..1.0, phi in -3.2f64..3.2, distance in 50.0f64..2000.0,
    ) {
        for (camera, reach) in cameras() {
            let point = point(part * reach, phi, distance);
            let ray = camera.unproject(camera.project(point).unwrap()).unwrap();
            let along = (point - ray.origin).dot(ray.direction);
            let off = (ray.origin + along * ray.direction - point).length();
            prop_assert!(along > 0.0 && off < 1e-9 * distance, "{:?}: {off} mm", camera.lens);
            prop_assert!((ray.direction.length() - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn points_outside_the_domain_have_no_projection() {
    for (camera, _) in cameras() {
        assert_eq!(camera.project(DVec3::new(0.0, 0.0, -100.0)), None, "{:?}", camera.lens);
        assert!(camera.project(DVec3::new(0.0, 0.0, 100.0)).is_some());
        assert!(camera.unproject(DVec2::splat(1e9)).is_none_or(|ray| ray.direction.is_finite()));
    }
}

/// (1 − 0.1q)(1 − q/q0) / (1 + 0.1q)(1 − q/q1): between q0 and q1 the factor is negative, elsewhere
/// the two zeros cancel.
#[test]
fn a_cancelled_pole_invalidates_only_the_narrow_band_between_its_zeros() {
    let product = |a: f64, zero: f64| [a - 1.0 / zero, -a / zero, 0.0];
    let lens = BrownConrady {
        radial: product(-0.1, 1.0),
        denominator: product(0.1, 1.0 + 1e-6),
        ..BrownConrady::default()
    };
    let camera = Camera::centred(1600, 1200, 600.0, Lens::BrownConrady(lens));
    let at = |radius: f64| DVec3::new(300.0 * radius, 0.0, 300.0);
    for step in 1..150 {
        let radius = 0.01 * f64::from(step) + 0.005;
        let seen = camera.project(at(radius)).unwrap();
        let ray = camera.unproject(seen).unwrap();
        assert!((ray.direction.cross(at(radius).normalize())).length() < 1e-9, "{radius}");
    }
    let between = at((1.0f64 + 0.5e-6).sqrt());
    assert_eq!(camera.project(between), None);
    assert!(camera.project_with_derivatives(between).is_some(), "a search crosses the gap");
}
