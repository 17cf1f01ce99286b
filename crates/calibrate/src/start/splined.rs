//! The initial spline equivalent to a parametric lens, and its derivatives with respect to the parameters of that lens.

use glam::DVec2;
use nalgebra::{DMatrix, DVector};

use crate::problem::roughness::{Roughness, differences};
use deltille_core::camera::{
    Camera, Lens, PROJECTION_PARAMETERS, Spline, SplineGrid, stereographic_direction,
};

/// Extent of the grid relative to the outermost corner. The optimisation moves that corner by less
/// than the margin.
const MARGIN: f64 = 1.02;

/// Extent of the grid towards the image border, relative to the angle of the outermost corner.
/// Areas beyond, for example the black rim of a fisheye image, would take knots from the area with
/// corners.
const BEYOND: f64 = 1.25;

/// Default knot spacing at the image centre, as a fraction of the longer side: the
/// deviation of a lens from its polynomial changes little from one knot to the next.
const APART: f64 = 1.0 / 12.0;

/// Number of sample positions along each border of the image.
const ALONG: usize = 32;

/// Number of sample positions per knot at which the two lenses are matched.
const A_KNOT: usize = 3;

/// Weight of second differences relative to these positions. They matter only where there are no
/// positions.
const SMOOTH: f64 = 1e-9;

/// Replaces the lens of a camera by a spline of a degree, with this number of knots (columns and
/// rows), or with as many knots as the lens needs. `seen` are the pixels of corners. The prior of
/// the knots expects a lens of the same kind with free parameters `free`. `None` if the lens cannot
/// image the pixels.
pub(super) fn splined(
    camera: &Camera,
    free: &[bool],
    seen: impl Iterator<Item = DVec2>,
    degree: usize,
    knots: Option<[usize; 2]>,
) -> Option<(Camera, Roughness)> {
    let reach = reach(camera, seen)?;
    let longer = f64::from(camera.width.max(camera.height));
    let grid = match knots {
        Some(knots) => SplineGrid::over(degree, knots, reach),
        None => SplineGrid::dense(degree, APART * longer / camera.focal_px.max_element(), reach),
    };
    let spline = Spline::new(grid);
    let count = grid.count();
    let mut matrix = DMatrix::<f64>::zeros(count, count);
    // For the lens, and for its derivatives with respect to each parameter.
    let of_lens = PROJECTION_PARAMETERS.len()..free.len().max(PROJECTION_PARAMETERS.len());
    let terms: Vec<usize> = of_lens.filter(|&parameter| free[parameter]).collect();
    let mut right = vec![[0, 1].map(|_| DVector::<f64>::zeros(count)); 1 + terms.len()];
    let (steps, most) = ([grid.columns, grid.rows].map(|n| A_KNOT * (n - degree)), grid.reach());
    for (i, j) in (0..=steps[1]).flat_map(|j| (0..=steps[0]).map(move |i| (i, j))) {
        let part = DVec2::new(i as f64 / steps[0] as f64, j as f64 / steps[1] as f64);
        let u = most * (2.0 * part - 1.0);
        let direction = stereographic_direction(u);
        let Some(pixel) = camera.project(direction) else { continue };
        let Some(at) = camera.project_with_derivatives(direction) else { continue };
        let off = (pixel - camera.centre_px) / camera.focal_px - u;
        let by = terms.iter().map(|&term| DVec2::from(at.by_parameter(term)) / camera.focal_px);
        let values: Vec<DVec2> = std::iter::once(off).chain(by).collect();
        let touched: Vec<(usize, f64)> = spline.knots_at(u).iter().collect();
        for &(a, part) in &touched {
            for (right, value) in right.iter_mut().zip(&values) {
                right[0][a] += part * value.x;
                right[1][a] += part * value.y;
            }
            touched.iter().for_each(|&(b, other)| matrix[(a, b)] += part * other);
        }
    }
    for difference in differences(&grid) {
        for (a, part) in difference {
            difference.iter().for_each(|&(b, other)| matrix[(a, b)] += SMOOTH * part * other);
        }
    }
    let root = matrix.cholesky()?;
    let knots = right.into_iter().map(|right| -> Vec<DVec2> {
        let [x, y] = right.map(|right| root.solve(&right));
        x.iter().zip(&y).map(|(&x, &y)| DVec2::new(x, y)).collect()
    });
    let mut knots: Vec<Vec<DVec2>> = knots.collect();
    let family = knots.split_off(1);
    let spline = spline.with_knots(knots.pop()?);
    let roughness = Roughness::around(&spline, &family);
    Some((Camera { lens: Lens::Spline(spline), ..camera.clone() }, roughness))
}

/// The largest |u| along both axes that the grid must cover.
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
    use deltille_core::camera::{BrownConrady, KannalaBrandt};

    #[test]
    fn a_spline_projects_like_the_lens_that_it_starts_from() {
        let radial = [-0.25, 0.08, -0.01];
        for (lens, focal) in [
            (Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() }), 900.0),
            (Lens::KannalaBrandt(KannalaBrandt { k: vec![-0.02, 0.002, -1e-4, 1e-5] }), 297.0),
        ] {
            let camera = Camera::centred(1600, 1200, focal, lens);
            // As far as boards reach: 2 rad from the axis.
            let near = |pixel: &DVec2| {
                let ray = camera.unproject(*pixel).unwrap().direction;
                ray.angle_between(glam::DVec3::Z) < 2.0
            };
            let places = (1..12).flat_map(|i| (1..12).map(move |j| (f64::from(i), f64::from(j))));
            let places = places.map(|(i, j)| DVec2::new(i * 130.0, j * 95.0)).filter(near);
            let places: Vec<DVec2> = places.collect();
            let seen = || places.iter().copied();
            for degree in [2, 3] {
                let (made, _) = splined(&camera, &[], seen(), degree, None).unwrap();
                for pixel in seen() {
                    let ray = camera.unproject(pixel).unwrap().direction;
                    let off = made.project(ray).unwrap().distance(pixel);
                    let most = if degree == 2 { 0.3 } else { 0.1 };
                    assert!(off < most, "{degree}: {off} at {pixel}");
                    let back = made.unproject(made.project(ray).unwrap()).unwrap().direction;
                    assert!(back.angle_between(ray) < 1e-6, "{degree}");
                }
            }
        }
    }
}
