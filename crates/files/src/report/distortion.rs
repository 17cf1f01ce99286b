//! Distortion of a lens: its radial displacement over the angle from the axis, and a grid over the
//! image, both compared with an ideal lens.
//!
//! ```text
//!     displacement(θ) = mean over φ of |p(θ, φ) − c| − |i(θ, φ) − c|       px
//! ```
//!
//! p is the pixel of the camera for the direction at the angle θ from its axis and the azimuth φ, i
//! that of an ideal lens with the same focal length near the axis: a pinhole, f tan θ, or for
//! images that show more than a pinhole represents well, equidistant, f θ; c is the principal
//! point.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3};

use super::axes::{Axes, frame};
use super::panels::round_down;
use super::survey::Survey;
use deltille_calibrate::CameraEstimate;
use deltille_core::camera::Camera;

/// Widest field for which a lens is compared with a pinhole, rad from the axis: there its radius is
/// 2.7 times the focal length.
const PINHOLE_RAD: f64 = 70.0 / 180.0 * PI;

/// Widest field that is considered, rad from the axis: no lens sees more.
const MOST_RAD: f64 = 130.0 / 180.0 * PI;

/// How far away what is seen at infinity is, mm; how near the axis the focal length is taken, rad.
const INFINITY_MM: f64 = 1e9;
const NEAR_AXIS_RAD: f64 = 1e-4;

/// Directions around the axis, and angles of the curve.
const AROUND: usize = 32;
const ANGLES: usize = 96;

/// Bins in which corners are counted by their angle.
const BINS: usize = 40;

/// Least difference, px, between the projections of points at the distance of the corners and at
/// infinity for which both have a curve.
const APART_PX: f64 = 0.05;

/// Lines of the grid over the longer side, and points of each.
const LINES: f64 = 14.0;
const POINTS: usize = 80;

/// A grid that is displaced by less than this part of the image's width is drawn with its displacements enlarged to it.
const SEEN_PART: f64 = 0.03;

/// Room for what lines mean, user units.
const FOOT: f64 = 24.0;

/// The ideal lens with which a lens is compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ideal {
    focal_px: DVec2,
    centre_px: DVec2,
    is_pinhole: bool,
}

/// The displacement of a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Displacement {
    /// From the axis, rad.
    pub angle_rad: f64,
    /// Mean, least and most around the axis, px.
    pub mean_px: f64,
    pub least_px: f64,
    pub most_px: f64,
}

impl Ideal {
    /// Of a camera whose image shows so much, rad from the axis.
    pub(super) fn of(camera: &Camera, widest_rad: f64) -> Self {
        // A spline has the axis where its knots say, not at cx and cy.
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
    fn pixel(&self, direction: DVec3) -> Option<DVec2> {
        let angle = direction.angle_between(DVec3::Z);
        let around = direction.truncate().try_normalize().unwrap_or(DVec2::ZERO);
        let radius = match self.is_pinhole {
            true if angle >= FRAC_PI_2 => return None,
            true => angle.tan(),
            false => angle,
        };
        Some(self.centre_px + self.focal_px * radius * around)
    }

    /// The direction of a pixel; `None` where there is none.
    fn direction(&self, pixel: DVec2) -> Option<DVec3> {
        let flat = (pixel - self.centre_px) / self.focal_px;
        let angle = if self.is_pinhole { flat.length().atan() } else { flat.length() };
        let around = flat.try_normalize().unwrap_or(DVec2::ZERO);
        (angle < MOST_RAD).then(|| (around * angle.sin()).extend(angle.cos()))
    }

    /// Its law, as the axes name it.
    fn law(&self) -> &'static str {
        if self.is_pinhole { "f · tan θ" } else { "f · θ" }
    }

    fn name(&self) -> &'static str {
        if self.is_pinhole { "a pinhole" } else { "an equidistant lens" }
    }
}

/// The angle from the axis that the image shows, rad: at its sides or its image circle, and in its
/// corners.
pub(super) fn shown_rad(camera: &Camera, survey: &Survey) -> [f64; 2] {
    let angle = |pixel: DVec2| {
        let ray = camera.unproject(pixel)?;
        Some(ray.direction.angle_between(DVec3::Z).min(MOST_RAD))
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

/// The displacements of points so far away, up to an angle.
pub(super) fn curve(
    camera: &Camera,
    ideal: &Ideal,
    distance_mm: f64,
    widest_rad: f64,
) -> Vec<Displacement> {
    let steady = camera.lens.steady_radius().unwrap_or(f64::INFINITY);
    let angles = (0..=ANGLES).map(|i| widest_rad * i as f64 / ANGLES as f64);
    let at = |angle_rad: f64| {
        let displacements = (0..AROUND).map(|i| {
            let around = DVec2::from_angle(TAU * i as f64 / AROUND as f64);
            let direction = (around * angle_rad.sin()).extend(angle_rad.cos());
            let pixel = camera.project(distance_mm * direction)?;
            // Beyond the point where the radius decreases it is no lens.
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

/// The curve as a picture, and in words what it is.
pub(super) fn curve_plot(found: &CameraEstimate, survey: &Survey) -> Option<(String, String)> {
    let camera = &found.camera;
    let [side, corner] = shown_rad(camera, survey);
    let ideal = Ideal::of(camera, corner);
    let of_corners: Vec<f64> = found
        .corners()
        .filter_map(|at| Some(camera.unproject(at.pixel)?.direction.angle_between(DVec3::Z)))
        .collect();
    let farthest = of_corners.iter().copied().fold(0.0, f64::max);
    // At the same angles at every distance.
    let most = corner.max(farthest);
    let far = curve(camera, &ideal, INFINITY_MM, most);
    let widest = far.last().filter(|last| last.angle_rad > 0.0)?.angle_rad;
    let distance_mm = found.projection.as_ref().and_then(|p| p.distances_mm.first().copied());
    let near = distance_mm.map(|mm| (mm, curve(camera, &ideal, mm, most)));
    let near = near.map(|(mm, near)| (mm, near.into_iter().take(far.len()).collect::<Vec<_>>()));
    let near = near.filter(|(_, near)| {
        near.iter().zip(&far).any(|(a, b)| (a.mean_px - b.mean_px).abs() > APART_PX)
    });
    let all = || far.iter().chain(near.iter().flat_map(|(_, near)| near));
    let low = all().map(|at| at.least_px).fold(0.0, f64::min);
    let high = all().map(|at| at.most_px).fold(0.0, f64::max);
    let margin = 0.08 * (high - low).max(0.1);
    let y = [low - margin, high + margin];
    let mut axes = Axes::new(frame(survey.size_px), [0.0, widest.to_degrees()], y);
    // Where no corner was the curve is extrapolated.
    if farthest < widest {
        let low = DVec2::new(farthest.to_degrees(), y[0]);
        axes.bar(low, DVec2::new(widest.to_degrees(), y[1]), "beyond-corners", "");
    }
    let mut counts = [0usize; BINS];
    for angle in of_corners {
        counts[((angle / widest * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    let fullest = counts.into_iter().max().unwrap_or(0).max(1) as f64;
    for (bin, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let at = |bin: usize| (bin as f64 / BINS as f64 * widest).to_degrees();
        let top = y[0] + 0.12 * (y[1] - y[0]) * count as f64 / fullest;
        axes.bar(DVec2::new(at(bin), y[0]), DVec2::new(at(bin + 1), top), "count-bar", "");
    }
    axes.line(&[DVec2::ZERO, DVec2::new(widest.to_degrees(), 0.0)], "guide");
    for (angle, name) in [(side, "side"), (corner, "corner")] {
        let is_apart = name == "corner" || corner - side > 0.06 * widest;
        if angle <= widest * (1.0 + 1e-9) && is_apart {
            let at = angle.to_degrees();
            axes.line(&[DVec2::new(at, y[0]), DVec2::new(at, y[1])], "guide dashed");
            axes.text(DVec2::new(at, y[1]), DVec2::new(-4.0, 14.0), "end", name);
        }
    }
    let points = |of: &[Displacement], px: fn(&Displacement) -> f64| -> Vec<DVec2> {
        of.iter().map(|at| DVec2::new(at.angle_rad.to_degrees(), px(at))).collect()
    };
    let around = points(&far, |at| at.least_px).into_iter();
    let around: Vec<DVec2> =
        around.chain(points(&far, |at| at.most_px).into_iter().rev()).collect();
    axes.line(&around, "band");
    if let Some((_, near)) = &near {
        axes.line(&points(near, |at| at.mean_px), "curve second");
    }
    axes.line(&points(&far, |at| at.mean_px), "curve lens");
    let key = |x: f64, class: &str, text: &str| {
        format!(
            "<path class=\"{class}\" d=\"M{x} 10H{}\"/><text x=\"{}\" y=\"14\">{text}</text>",
            x + 22.0,
            x + 28.0
        )
    };
    let mut foot = key(0.0, "curve lens", "points at infinity");
    if let Some((mm, _)) = &near {
        foot += &key(150.0, "curve second", &format!("{mm:.0} mm away"));
    }
    foot += "<rect class=\"beyond-corners\" x=\"272\" y=\"4\" width=\"22\" height=\"12\"/>\
             <text x=\"300\" y=\"14\">beyond the corners</text>";
    axes.foot(FOOT, foot);
    let shown = axes.svg(
        ["angle from the axis, °", &format!("radius less {}, px", ideal.law())],
        "Distortion curve",
    );
    let caption = format!(
        "How much farther from the middle than {} the lens has a point at an angle from its axis (below 0: nearer); bars \
         below count corners.",
        ideal.name()
    );
    Some((shown, caption))
}

/// The grid of an ideal lens, as this one has it, and in words what it is.
pub(super) fn grid_plot(found: &CameraEstimate, survey: &Survey) -> (String, String) {
    let camera = &found.camera;
    let ideal = Ideal::of(camera, shown_rad(camera, survey)[1]);
    let steady = camera.lens.steady_radius().unwrap_or(f64::INFINITY);
    let warped = |pixel: DVec2| {
        let at = camera.project(INFINITY_MM * ideal.direction(pixel)?)?;
        let radius = ((at - camera.centre_px) / camera.focal_px).length();
        (radius <= steady).then_some(at)
    };
    let size = survey.size_px;
    let step = size.max_element() / LINES;
    // As much beyond the image as may be bent into it.
    let beyond = LINES.ceil() as i64;
    let lines = |along: DVec2, across: DVec2| {
        (-beyond..=beyond).map(move |line| {
            let reach = size.max_element() * 1.2;
            let points = (0..=POINTS).map(move |i| 2.0 * i as f64 / POINTS as f64 - 1.0);
            let middle = ideal.centre_px + across * line as f64 * step;
            points.map(move |t| middle + along * t * reach).collect::<Vec<DVec2>>()
        })
    };
    let lines: Vec<Vec<DVec2>> =
        lines(DVec2::X, DVec2::Y).chain(lines(DVec2::Y, DVec2::X)).collect();
    let moves = lines.iter().flatten().filter(|at| camera.sees(**at, 0.0));
    let moves = moves.filter_map(|&at| Some((warped(at)? - at).length()));
    let most = moves.fold(0.0, f64::max);
    let enlarged = match most {
        most if most < 1e-6 => 1.0,
        most => round_down(SEEN_PART * size.x / most).max(1.0),
    };
    let mut axes = Axes::of_image(size);
    axes.within(|axes| {
        for line in &lines {
            axes.line(line, "grid ideal");
        }
        for line in &lines {
            let bent = line.iter().map(|&at| Some(at + enlarged * (warped(at)? - at)));
            let bent: Vec<Option<DVec2>> = bent.collect();
            for part in bent.split(Option::is_none).filter(|part| part.len() > 1) {
                let part: Vec<DVec2> = part.iter().flatten().copied().collect();
                axes.line(&part, "grid bent");
            }
        }
    });
    axes.dot(ideal.centre_px, 3.0, "view");
    axes.foot(
        FOOT,
        format!(
            "<path class=\"grid ideal\" d=\"M0 10H22\"/><text x=\"28\" y=\"14\">{}</text>\
             <path class=\"grid bent\" d=\"M165 10H187\"/><text x=\"193\" y=\"14\">this lens</text>\
             <circle class=\"view\" cx=\"300\" cy=\"10\" r=\"3\"/><text x=\"308\" y=\"14\">principal point</text>",
            ideal.name()
        ),
    );
    let shown = axes.svg(["x, px", "y, px"], "Distortion over the image");
    let times = match enlarged > 1.0 {
        true => format!(", with its displacements {enlarged} times enlarged"),
        false => String::new(),
    };
    let caption = format!(
        "The straight grid that {} would show, and what this lens makes of it{times}; at most {} within the image.",
        ideal.name(),
        match most < 0.1 {
            true => format!("{most:.3} px"),
            false => format!("{most:.1} px"),
        }
    );
    (shown, caption)
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
    fn the_curve_has_the_formulas_of_the_lenses() {
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
    fn a_pupil_that_moves_has_other_curves_near_and_far() {
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
    fn ideal_lenses_take_their_directions_back() {
        for widest in [0.8, 1.8] {
            let ideal =
                Ideal::of(&camera(Lens::BrownConrady(BrownConrady::default()), 500.0), widest);
            let pixel = DVec2::new(300.0, 900.0);
            let back = ideal.pixel(ideal.direction(pixel).unwrap()).unwrap();
            assert!(back.abs_diff_eq(pixel, 1e-9), "{back}");
        }
    }
}
