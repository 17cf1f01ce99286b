//! Plots of the residuals of a camera by image position, radius and view, each as an SVG.
//!
//! Outliers are drawn in red and excluded from ranges, means and ring averages. A corner whose residual exceeds the range of a
//! plot appears as a ring on the border of the plot.

use glam::DVec2;

use crate::report::measures::survey::Survey;
use crate::report::plots::axes::{Axes, frame};
use crate::report::plots::round_down::round_down;
use deltille_calibrate::{CameraEstimate, Corner, ViewEstimate};

/// Height of the legend below a map, user units.
const FOOT: f64 = 58.0;

/// Maximum number of dots in a scatter plot: more only enlarge the file.
const MAX_DOTS: usize = 6000;

/// Radius of the ring that marks a corner outside a plot, user units.
const BEYOND: f64 = 3.0;

/// Bins of the histogram on either side of zero.
const BINS: usize = 20;

/// Maximum number of bars in the plot of views; with more views, each bar is the worst of several.
const MAX_BARS: usize = 200;

/// Bins of the radial curve.
const RINGS: usize = 12;

/// Length of the longest arrow of the residual map, cells.
const ARROW_CELLS: f64 = 1.2;

/// Range of the plots of residuals, px: four times the RMS of the inliers, so that noise fills a
/// plot.
fn range_px(camera: &CameraEstimate) -> f64 {
    let inliers = || camera.corners().filter(|corner| !corner.outlier);
    let sum: f64 = inliers().flat_map(|corner| corner.residual.to_array()).map(|r| r * r).sum();
    let rms = (sum / (2 * inliers().count()).max(1) as f64).sqrt();
    (4.0 * rms).max(1e-6)
}

/// Every n-th corner of a camera, where n leaves at most [`MAX_DOTS`].
fn thinned(camera: &CameraEstimate) -> impl Iterator<Item = &Corner> {
    let step = camera.corner_count().div_ceil(MAX_DOTS).max(1);
    camera.corners().step_by(step)
}

/// Scatter plot of the residuals of all corners, px.
pub(in crate::report) fn scatter(camera: &CameraEstimate, survey: &Survey) -> String {
    let size = frame(survey.size_px);
    // The scale is equal in both directions, independent of the aspect ratio of the frame.
    let range = range_px(camera) * size / size.min_element();
    let mut axes = Axes::new(size, [-range.x, range.x], [-range.y, range.y]);
    for axis in [DVec2::X, DVec2::Y] {
        axes.line(&[-range * axis, range * axis], "guide");
    }
    // In the image, residuals point down; in the plot, up.
    let up = |corner: &Corner| corner.residual * DVec2::new(1.0, -1.0);
    for corner in thinned(camera) {
        if (corner.residual / range).abs().max_element() <= 1.0 {
            axes.dot(up(corner), 1.3, if corner.outlier { "dot out" } else { "dot" });
        }
    }
    for corner in camera.corners() {
        // The point at which the line from the centre leaves the plot.
        let beyond = (corner.residual / range).abs().max_element();
        if beyond > 1.0 {
            axes.dot(up(corner) / beyond, BEYOND, "beyond");
        }
    }
    axes.svg(["residual in x, px", "residual upwards, px"], "Residuals of all corners")
}

/// Histogram of the residuals of both axes, px, with the normal distribution of the same standard
/// deviation.
pub(in crate::report) fn histogram(camera: &CameraEstimate, survey: &Survey) -> String {
    let range = range_px(camera);
    let width = range / BINS as f64;
    let mut counts = vec![0usize; 2 * BINS];
    let mut total = 0;
    for value in camera.corners().flat_map(|corner| corner.residual.to_array()) {
        total += 1;
        let bin = ((value + range) / width).floor();
        if (0.0..counts.len() as f64).contains(&bin) {
            counts[bin as usize] += 1;
        }
    }
    let part = |count: usize| 100.0 * count as f64 / f64::from(total.max(1));
    let sigma = range / 4.0;
    let normal = |x: f64| {
        let density =
            (-x * x / (2.0 * sigma * sigma)).exp() / (sigma * (2.0 * std::f64::consts::PI).sqrt());
        100.0 * density * width
    };
    let highest = counts.iter().map(|&count| part(count)).fold(normal(0.0), f64::max);
    let mut axes = Axes::new(frame(survey.size_px), [-range, range], [0.0, 1.08 * highest]);
    for (bin, &count) in counts.iter().enumerate() {
        let x = bin as f64 * width - range;
        axes.bar(DVec2::new(x, 0.0), DVec2::new(x + width, part(count)), "bar", "");
    }
    let curve = (0..=100).map(|i| f64::from(i) / 50.0 * range - range);
    let curve: Vec<DVec2> = curve.map(|x| DVec2::new(x, normal(x))).collect();
    axes.line(&curve, "curve");
    axes.svg(["residual per axis, px", "% of residuals"], "Histogram of residuals")
}

/// Number of columns and of rows of the maps.
fn cells(survey: &Survey) -> DVec2 {
    survey.cells.map(|count| count as f64).into()
}

/// Pixel coordinates of the middle of a cell, by its index in the maps.
fn middle(survey: &Survey, index: usize) -> DVec2 {
    let columns = survey.cells[0];
    let at = DVec2::new((index % columns) as f64, (index / columns) as f64);
    (at + 0.5) / cells(survey) * survey.size_px - 0.5
}

/// The arrow from a pixel, px, shortened so that it ends within the image.
fn within(survey: &Survey, from: DVec2, arrow: DVec2) -> DVec2 {
    let room = |i: usize| match arrow[i] {
        v if v > 0.0 => (survey.size_px[i] - 0.5 - from[i]) / v,
        v if v < 0.0 => (-0.5 - from[i]) / v,
        _ => 1.0,
    };
    room(0).min(room(1)).min(1.0) * arrow
}

/// Map of the mean residuals over the image, enlarged, and of the outliers, with its caption.
pub(in crate::report) fn residual_map(
    camera: &CameraEstimate,
    survey: &Survey,
) -> (String, String) {
    let cell = survey.size_px.x / survey.cells[0] as f64;
    let means = || survey.means_px.iter().flatten();
    let longest = means().map(|cell| cell.mean_px.length()).fold(0.0, f64::max);
    // Round numbers for the caption and the legend.
    let enlarged =
        if longest > 0.0 { round_down(ARROW_CELLS * cell / longest).max(1.0) } else { 1.0 };
    let mut axes = Axes::of_image(survey.size_px);
    for (index, mean) in survey.means_px.iter().enumerate() {
        let Some(mean) = mean else { continue };
        let foot = middle(survey, index);
        let arrow = within(survey, foot, mean.mean_px * enlarged);
        // Means that noise explains are pale.
        let chance = mean.mean_px.length() < 3.0 * mean.sd_px;
        axes.line(&[foot, foot + arrow], if chance { "arrow pale" } else { "arrow" });
        axes.dot(foot, 1.6, "foot");
    }
    for outlier in camera.corners().filter(|corner| corner.outlier) {
        axes.dot(outlier.pixel, 1.6, "dot out");
    }
    if longest > 0.0 {
        let example = round_down(longest);
        let end = example * enlarged * axes.scale().x;
        let key = format!(
            "<path class=\"arrow\" d=\"M0 13H{end:.1}\"/><text x=\"0\" y=\"31\">{example} px</text>\
             <path class=\"arrow pale\" d=\"M110 13H{:.1}\"/><text x=\"110\" y=\"31\">not significant</text>",
            110.0 + end
        );
        axes.foot(FOOT, key);
    }
    let outliers = match camera.outlier_count() {
        0 => "",
        _ => " Red dots are outliers, which the means do not contain.",
    };
    let caption = format!(
        "Mean residual (observed minus predicted) in each cell of the image, enlarged {enlarged} times. A pattern of long \
         arrows shows distortion that the model does not describe.{outliers}"
    );
    (axes.svg(["x, px", "y, px"], "Mean residuals over the image"), caption)
}

/// Map of the number of corners in each cell of the image.
pub(in crate::report) fn coverage(survey: &Survey) -> String {
    let most = survey.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    let mut axes = Axes::of_image(survey.size_px);
    for (index, &count) in survey.counts.iter().enumerate() {
        let middle = middle(survey, index);
        let half = survey.size_px / cells(survey) / 2.0;
        let class = if count == 0 { "empty" } else { "cell" };
        let strength = (count as f64 / most).sqrt();
        let style = format!("fill-opacity=\"{:.2}\"", 0.1 + 0.9 * strength);
        axes.bar(middle - half, middle + half, class, &style);
        if count > 0 {
            let DVec2 { x: px, y: py } = axes.at(middle);
            let text = if strength > 0.55 { "count light" } else { "count" };
            axes.add(&format!(
                "<text class=\"{text}\" x=\"{px:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{count}\
                 </text>",
                py + 3.0
            ));
        }
    }
    axes.svg(["x, px", "y, px"], "Number of corners over the image")
}

/// Length of each residual, px, against the distance of its corner from the principal point, px,
/// and the RMS per axis of concentric rings.
pub(in crate::report) fn against_radius(camera: &CameraEstimate, survey: &Survey) -> String {
    let radius = |corner: &Corner| camera.camera.radius_px(corner.pixel);
    let error = |corner: &Corner| corner.residual.x.hypot(corner.residual.y);
    let farthest = camera.corners().map(radius).fold(1.0, f64::max);
    let top = range_px(camera);
    let mut axes = Axes::new(frame(survey.size_px), [0.0, farthest], [0.0, top]);
    for corner in thinned(camera) {
        let point = DVec2::new(radius(corner), error(corner));
        if point.y <= top {
            axes.dot(point, 1.1, if corner.outlier { "dot out" } else { "dot" });
        }
    }
    for corner in camera.corners() {
        if error(corner) > top {
            axes.dot(DVec2::new(radius(corner), top), BEYOND, "beyond");
        }
    }
    let mut rings = [(0.0, 0usize); RINGS];
    for corner in camera.corners().filter(|corner| !corner.outlier) {
        let ring = (radius(corner) / farthest * RINGS as f64) as usize;
        let (sum, count) = &mut rings[ring.min(RINGS - 1)];
        *sum += corner.residual.length_squared() / 2.0;
        *count += 1;
    }
    let curve = rings.iter().enumerate().filter(|(_, (_, count))| *count > 3);
    let curve: Vec<DVec2> = curve
        .map(|(i, (sum, count))| {
            let radius = (i as f64 + 0.5) / RINGS as f64 * farthest;
            DVec2::new(radius, (sum / *count as f64).sqrt())
        })
        .collect();
    axes.line(&curve, "curve");
    axes.svg(["distance from the principal point, px", "error, px"], "Error against radius")
}

/// Returns the plot of the RMS of each view, px, against the tilt of the board, degrees, and its
/// caption. For solids, whose faces have many tilts at
/// once, the RMS is drawn against the distance of the target, mm.
pub(in crate::report) fn against_place(
    camera: &CameraEstimate,
    survey: &Survey,
) -> (String, &'static str) {
    let tilts = survey.views.iter().map(|view| view.tilt_rad.map(f64::to_degrees));
    let (places, least, name, shows, caption) = match tilts.collect::<Option<Vec<f64>>>() {
        Some(tilts) => (
            tilts,
            10.0,
            "tilt of the board, °",
            "Error against tilt",
            "The rms of each view against its tilt. Steeply tilted views have fewer pixels per cell and more blur; the views \
            should cover all tilts.",
        ),
        None => (
            survey.views.iter().map(|view| view.distance_mm).collect(),
            1.0,
            "distance of the target, mm",
            "Error against distance",
            "The rms of each view against the distance of the target. The views should cover short and long distances.",
        ),
    };
    let farthest = places.iter().copied().fold(least, f64::max);
    let worst = camera.views.iter().map(|view| view.rms_px).fold(1e-6, f64::max);
    let ranges = [[0.0, 1.05 * farthest], [0.0, 1.1 * worst]];
    let mut axes = Axes::new(frame(survey.size_px), ranges[0], ranges[1]);
    for (view, place) in camera.views.iter().zip(&places) {
        let at = DVec2::new(*place, view.rms_px);
        axes.titled(&named(view), |axes| axes.dot(at, 3.0, "view"));
    }
    (axes.svg([name, "rms of the view, px"], shows), caption)
}

/// The name and the RMS of a view.
fn named(view: &ViewEstimate) -> String {
    format!("{}: {:.4} px", view.name, view.rms_px)
}

/// RMS of each view, px, in order, with the overall RMS as a line.
pub(in crate::report) fn of_views(camera: &CameraEstimate, survey: &Survey) -> String {
    let views = &camera.views;
    let worst = views.iter().map(|view| view.rms_px).fold(1e-6, f64::max);
    let mut axes =
        Axes::new(frame(survey.size_px), [0.5, views.len() as f64 + 0.5], [0.0, 1.1 * worst]);
    // With many views, each bar is the worst of several.
    let step = views.len().div_ceil(MAX_BARS).max(1);
    for (bar, views) in views.chunks(step).enumerate() {
        let worst = views.iter().max_by(|a, b| a.rms_px.total_cmp(&b.rms_px));
        let Some(worst) = worst else { continue };
        let first = (bar * step) as f64 + 0.5;
        let gap = 0.1 * step as f64;
        let high = DVec2::new(first + views.len() as f64 - gap, worst.rms_px);
        let low = DVec2::new(first + gap, 0.0);
        axes.titled(&named(worst), |axes| axes.bar(low, high, "bar", ""));
    }
    let all = DVec2::new(views.len() as f64 + 0.5, camera.rms_px);
    axes.line(&[DVec2::new(0.5, camera.rms_px), all], "curve");
    axes.svg(["view, in order", "rms of the view, px"], "Error of each view")
}
