//! Distortion of a lens relative to an ideal lens: radial displacement against the angle from the axis, and a grid over the
//! image.

use glam::{DVec2, DVec3};

use crate::report::measures::displacement::{
    APART_PX, Displacement, INFINITY_MM, Ideal, curve, shown_rad,
};
use crate::report::measures::survey::Survey;
use crate::report::plots::axes::{Axes, frame};
use crate::report::plots::round_down::round_down;
use deltille_calibrate::CameraEstimate;

/// Bins in which corners are counted by their angle.
const BINS: usize = 40;

/// Number of grid lines over the longer side, and number of points per line.
const LINES: f64 = 14.0;
const POINTS: usize = 80;

/// Displacement, as a fraction of the image width, to which smaller displacements of the grid are enlarged.
const SEEN_PART: f64 = 0.03;

/// Height of the legend, user units.
const FOOT: f64 = 24.0;

/// The plot of the distortion curve and its caption.
pub(in crate::report) fn curve_plot(
    found: &CameraEstimate,
    survey: &Survey,
) -> Option<(String, String)> {
    let camera = &found.camera;
    let [side, corner] = shown_rad(camera, survey);
    let ideal = Ideal::of(camera, corner);
    let of_corners: Vec<f64> = found
        .corners()
        .filter_map(|at| Some(camera.unproject(at.pixel)?.direction.angle_between(DVec3::Z)))
        .collect();
    let farthest = of_corners.iter().copied().fold(0.0, f64::max);
    // The angles are the same at every distance.
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
    // Outside the corners, the curve is extrapolated.
    if farthest < widest {
        let low = DVec2::new(farthest.to_degrees(), y[0]);
        axes.bar(low, DVec2::new(widest.to_degrees(), y[1]), "beyond-corners", "");
    }
    count_bars(&mut axes, &of_corners, widest, y);
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
    axes.foot(FOOT, legend(near.map(|(mm, _)| mm)));
    let shown = axes.svg(
        ["angle from the axis, °", &format!("radius minus {}, px", ideal.law())],
        "Distortion curve",
    );
    let caption = format!(
        "Radial distance of a point in the image, minus that of {}, against its angle from the axis (below 0: closer to the \
         centre). Bars at the bottom count corners.",
        ideal.name()
    );
    Some((shown, caption))
}

/// Draws bars at the bottom of the axes from `y[0]` to `y[1]` that count corners by their angle.
fn count_bars(axes: &mut Axes, angles_rad: &[f64], widest_rad: f64, y: [f64; 2]) {
    let mut counts = [0usize; BINS];
    for angle in angles_rad {
        counts[((angle / widest_rad * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    let fullest = counts.into_iter().max().unwrap_or(0).max(1) as f64;
    for (bin, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let at = |bin: usize| (bin as f64 / BINS as f64 * widest_rad).to_degrees();
        let top = y[0] + 0.12 * (y[1] - y[0]) * count as f64 / fullest;
        axes.bar(DVec2::new(at(bin), y[0]), DVec2::new(at(bin + 1), top), "count-bar", "");
    }
}

/// The legend of the distortion curve, also for points at a finite distance if there is a curve for them.
fn legend(near_mm: Option<f64>) -> String {
    let key = |x: f64, class: &str, text: &str| {
        format!(
            "<path class=\"{class}\" d=\"M{x} 10H{}\"/><text x=\"{}\" y=\"14\">{text}</text>",
            x + 22.0,
            x + 28.0
        )
    };
    let far = key(0.0, "curve lens", "points at infinity");
    let near = near_mm.map(|mm| key(150.0, "curve second", &format!("{mm:.0} mm away")));
    far + &near.unwrap_or_default()
        + "<rect class=\"beyond-corners\" x=\"272\" y=\"4\" width=\"22\" height=\"12\"/>\
           <text x=\"300\" y=\"14\">beyond the corners</text>"
}

/// The straight grid of an ideal lens as distorted by this lens, and the caption.
pub(in crate::report) fn grid_plot(found: &CameraEstimate, survey: &Survey) -> (String, String) {
    let camera = &found.camera;
    let ideal = Ideal::of(camera, shown_rad(camera, survey)[1]);
    let steady = camera.lens.monotonic_radius().unwrap_or(f64::INFINITY);
    let warped = |pixel: DVec2| {
        let at = camera.project(INFINITY_MM * ideal.direction(pixel)?)?;
        let radius = ((at - camera.centre_px) / camera.focal_px).length();
        (radius <= steady).then_some(at)
    };
    let size = survey.size_px;
    let step = size.max_element() / LINES;
    // Lines beyond the image may be bent into it.
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
        true => format!(", with displacements enlarged {enlarged} times"),
        false => String::new(),
    };
    let caption = format!(
        "The straight grid as seen by {}, and the same grid as seen by this lens{times}. The largest displacement within the image is {}.",
        ideal.name(),
        match most < 0.1 {
            true => format!("{most:.3} px"),
            false => format!("{most:.1} px"),
        }
    );
    (shown, caption)
}
