//! A spline that images as another lens does, from which its search starts.

use glam::DVec2;
use nalgebra::{DMatrix, DVector};

use super::super::roughness::differences;
use crate::camera::{Camera, Lens, Spline, SplineGrid, stereographic_direction};

/// The grid reaches this much beyond the outermost corner: a search moves it by less.
const MARGIN: f64 = 1.02;

/// What the image shows beyond the outermost corner is covered as far as this part of that corner's angle: what lies
/// beyond, such as the black rim of a fisheye, would take the knots from where the corners are.
const BEYOND: f64 = 1.25;

/// Places along each border of the image that are looked at.
const ALONG: usize = 32;

/// Places from one knot to the next at which the two lenses are to agree.
const A_KNOT: usize = 3;

/// How second differences count beside these: only where there are none.
const SMOOTH: f64 = 1e-9;

/// The camera with a spline of a degree and so many knots, columns and rows, in place of its lens. `seen` are pixels at
/// which there are corners. `None` where the lens shows none of them.
pub(super) fn splined(
    camera: &Camera,
    seen: impl Iterator<Item = DVec2>,
    degree: usize,
    knots: [usize; 2],
) -> Option<Camera> {
    let grid = SplineGrid::over(degree, knots, reach(camera, seen)?);
    let spline = Spline::new(grid);
    let count = grid.count();
    let mut matrix = DMatrix::<f64>::zeros(count, count);
    let mut right = [0, 1].map(|_| DVector::<f64>::zeros(count));
    let (steps, most) = ([grid.columns, grid.rows].map(|n| A_KNOT * (n - degree)), grid.reach());
    for (i, j) in (0..=steps[1]).flat_map(|j| (0..=steps[0]).map(move |i| (i, j))) {
        let part = DVec2::new(i as f64 / steps[0] as f64, j as f64 / steps[1] as f64);
        let u = most * (2.0 * part - 1.0);
        let Some(pixel) = camera.project(stereographic_direction(u)) else { continue };
        let off = (pixel - camera.centre_px) / camera.focal_px - u;
        let touched: Vec<(usize, f64)> = spline.knots_at(u).iter().collect();
        for &(a, part) in &touched {
            right[0][a] += part * off.x;
            right[1][a] += part * off.y;
            touched.iter().for_each(|&(b, other)| matrix[(a, b)] += part * other);
        }
    }
    for difference in differences(&grid) {
        for (a, part) in difference {
            difference.iter().for_each(|&(b, other)| matrix[(a, b)] += SMOOTH * part * other);
        }
    }
    let root = matrix.cholesky()?;
    let [x, y] = right.map(|right| root.solve(&right));
    let knots = x.iter().zip(&y).map(|(&x, &y)| DVec2::new(x, y)).collect();
    Some(Camera { lens: Lens::Spline(spline.with_knots(knots)), ..camera.clone() })
}

/// The largest |u| along both axes that is to be covered.
fn reach(camera: &Camera, seen: impl Iterator<Item = DVec2>) -> Option<DVec2> {
    let place = |pixel: DVec2| {
        let ray = camera.unproject(pixel)?.direction;
        Some(2.0 * ray.truncate() / (1.0 + ray.z))
    };
    let seen: Vec<DVec2> = seen.filter_map(place).collect();
    let tangent = |u: DVec2| u.length() / 2.0;
    let widest = seen.iter().map(|&u| tangent(u).atan()).reduce(f64::max)?;
    let border = camera.border(ALONG).filter_map(place);
    let border = border.filter(|&u| tangent(u).atan() <= BEYOND * widest);
    let most = |places: &mut dyn Iterator<Item = DVec2>| {
        places.map(DVec2::abs).fold(DVec2::ZERO, DVec2::max)
    };
    let seen = MARGIN * most(&mut seen.iter().copied());
    Some(seen.max(most(&mut border.into_iter())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{BrownConrady, KannalaBrandt};

    #[test]
    fn a_spline_images_as_the_lens_that_it_starts_from() {
        let radial = [-0.25, 0.08, -0.01];
        for (lens, focal) in [
            (Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() }), 900.0),
            (Lens::KannalaBrandt(KannalaBrandt { k: vec![-0.02, 0.002, -1e-4, 1e-5] }), 297.0),
        ] {
            let camera = Camera::centred(1600, 1200, focal, lens);
            let seen = || (1..12).flat_map(|i| (1..12).map(move |j| DVec2::new(f64::from(i) * 130.0, f64::from(j) * 95.0)));
            for degree in [2, 3] {
                let made = splined(&camera, seen(), degree, [16, 12]).unwrap();
                for pixel in seen() {
                    let ray = camera.unproject(pixel).unwrap().direction;
                    let off = made.project(ray).unwrap().distance(pixel);
                    assert!(off < 0.1, "{degree}: {off} at {pixel}");
                    let back = made.unproject(pixel).unwrap().direction;
                    assert!(back.angle_between(ray) < 1e-3, "{degree}");
                }
            }
        }
    }
}
