//! Residuals by corner of the target: the offset on its panel that would explain them, and their
//! RMS.
//!
//! An offset d of a corner in the plane of its panel causes the residual r = J d, with J the
//! derivative of the pixel by the offset. The least-squares offset over all views of the corner is
//!
//! ```text
//!     d = (Σ JᵀJ)⁻¹ Σ Jᵀ r      covariance σ² (Σ JᵀJ)⁻¹
//! ```
//!
//! Poses absorb what all corners of a panel have in common. `Calibration::measure_target` estimates
//! heights and covariances of offsets as well; this is a quick approximation from the residuals
//! that are left.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use glam::{DMat2, DVec2};

use super::axes::Axes;
use super::field::COLOURS;
use super::panels::{Mark, Panels, round_down};
use super::survey::Survey;
use deltille_calibrate::{CameraEstimate, Estimate, PanelRef, ViewEstimate};
use deltille_core::camera::{Camera, Pose};
use deltille_core::statistics::quantile;

/// Corners that are taken into account, of views evenly over all: more say no more.
const MOST_CORNERS: usize = 200_000;

/// Threshold of a significant offset (χ² of two coordinates, exceeded by chance once in a thousand
/// times).
const SURE: f64 = 13.8;

/// Fewest views of a corner.
const LEAST_VIEWS: usize = 3;

/// Nearly all arrows are at most as long as this part of the distance between corners.
const ARROW_PART: f64 = 0.8;
const NEARLY_ALL: f64 = 0.95;

/// Room for scales below, user units, and parts of the scale of colours.
const FOOT: f64 = 58.0;
const STEPS: usize = 22;

/// Statistics of a corner of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OfCorner {
    pub panel: PanelRef,
    pub row: i32,
    pub col: i32,
    /// Its position on the panel, mm.
    pub at_mm: DVec2,
    /// The least-squares offset d from that position, mm.
    pub move_mm: DVec2,
    /// Whether the offset is significant.
    pub is_sure: bool,
    /// Root mean square of its residuals, of a coordinate, px.
    pub rms_px: f64,
    pub views: usize,
}

/// Sums over the views of a corner.
#[derive(Default)]
struct Sums {
    at_mm: DVec2,
    normal: DMat2,
    right: DVec2,
    squares: f64,
    views: usize,
}

/// The corners that a camera saw, by panel, row and column. Outliers are excluded; but where a
/// corner is an outlier in most of its views, this is no accident, and all of them count.
pub(super) fn of_corners(estimate: &Estimate, camera: &CameraEstimate) -> Vec<OfCorner> {
    let step = camera.corner_count().div_ceil(MOST_CORNERS).max(1);
    // Of those that are no outliers, and of all.
    let mut sums: BTreeMap<(PanelRef, i32, i32), [Sums; 2]> = BTreeMap::new();
    for view in camera.views.iter().step_by(step) {
        let mut places: BTreeMap<PanelRef, Option<Pose>> = BTreeMap::new();
        for corner in &view.corners {
            let place = places.entry(corner.panel);
            let place = place.or_insert_with(|| camera_from_panel(estimate, view, corner.panel));
            let Some(camera_from_panel) = place else { continue };
            let seen = at_corner(&camera.camera, camera_from_panel, corner.pixel - corner.residual);
            let Some((at_mm, by_move)) = seen else { continue };
            let sums = sums.entry((corner.panel, corner.row, corner.col)).or_default();
            for sums in &mut sums[usize::from(corner.outlier)..] {
                sums.at_mm += at_mm;
                sums.normal += by_move.transpose() * by_move;
                sums.right += by_move.transpose() * corner.residual;
                sums.squares += corner.residual.length_squared();
                sums.views += 1;
            }
        }
    }
    let variance = camera.inlier_rms_px().powi(2).max(f64::MIN_POSITIVE);
    let seen = sums.into_iter().map(|(corner, [inliers, all])| {
        (corner, if 2 * inliers.views >= all.views { inliers } else { all })
    });
    let seen = seen.filter(|(_, sums)| sums.views >= LEAST_VIEWS);
    let of_corner = |((panel, row, col), sums): ((PanelRef, i32, i32), Sums)| {
        let move_mm = sums.normal.inverse() * sums.right;
        let views = sums.views;
        move_mm.is_finite().then(|| OfCorner {
            panel,
            row,
            col,
            at_mm: sums.at_mm / views as f64,
            move_mm,
            is_sure: sums.right.dot(move_mm) / variance > SURE,
            rms_px: (sums.squares / (2 * views) as f64).sqrt(),
            views,
        })
    };
    seen.filter_map(of_corner).collect()
}

/// The pose of a panel in a view.
pub(super) fn camera_from_panel(
    estimate: &Estimate,
    view: &ViewEstimate,
    panel: PanelRef,
) -> Option<Pose> {
    let target = estimate.targets.iter().find(|t| t.panels.contains(&panel.index()));
    let scene_from_target = target.map_or(Pose::IDENTITY, |target| target.scene_from_target);
    let place = estimate.panels.get(panel.index())?.target_from_panel;
    Some(view.pose.after(&scene_from_target).after(&place))
}

/// The point of a panel that a pixel sees, mm, and the derivative of the pixel by an offset in the
/// plane, px/mm.
fn at_corner(camera: &Camera, camera_from_panel: &Pose, pixel: DVec2) -> Option<(DVec2, DMat2)> {
    let at_mm = on_plane(camera, camera_from_panel, pixel)?;
    let point = camera_from_panel.apply(at_mm.extend(0.0));
    let [by_x, by_y] = camera.project_with_derivatives(point)?.by_point.map(glam::DVec3::from);
    let [across, up] =
        [glam::DVec3::X, glam::DVec3::Y].map(|axis| camera_from_panel.rotation * axis);
    let column = |axis: glam::DVec3| DVec2::new(by_x.dot(axis), by_y.dot(axis));
    Some((at_mm, DMat2::from_cols(column(across), column(up))))
}

/// The point of the plane of a panel that a pixel sees, mm.
pub(super) fn on_plane(camera: &Camera, camera_from_panel: &Pose, pixel: DVec2) -> Option<DVec2> {
    let ray = camera.unproject(pixel)?;
    let panel_from_camera = camera_from_panel.inverse();
    let (origin, direction) =
        (panel_from_camera.apply(ray.origin), panel_from_camera.rotation * ray.direction);
    let far = -origin.z / direction.z;
    (far.is_finite() && far > 0.0).then(|| (origin + far * direction).truncate())
}

/// The corners as a picture, and in words what it is; `None` where no corner was seen often enough.
pub(super) fn plot(
    estimate: &Estimate,
    camera: &CameraEstimate,
    survey: &Survey,
) -> Option<(String, String)> {
    let corners = of_corners(estimate, camera);
    let mut errors: Vec<f64> = corners.iter().map(|corner| corner.rms_px).collect();
    let most_px = quantile(&mut errors, 1.0)?.max(1e-9);
    let colour = |px: f64| {
        // The darkest would hide the arrows' feet.
        let place = (px / most_px * (COLOURS.len() - 2) as f64) as usize;
        COLOURS[place.min(COLOURS.len() - 2)]
    };
    let marks = corners.iter().map(|corner| Mark {
        panel: corner.panel,
        row: corner.row,
        col: corner.col,
        at_mm: corner.at_mm,
        by_mm: corner.move_mm,
        is_sure: corner.is_sure,
        colour: colour(corner.rms_px).to_owned(),
        title: format!(
            "row {}, column {}: rms {:.4} px, ({:.4}, {:.4}) mm, {} views",
            corner.row, corner.col, corner.rms_px, corner.move_mm.x, corner.move_mm.y, corner.views
        ),
    });
    let marks: Vec<Mark> = marks.collect();
    // Within a frame as large as that of the other plots.
    let mut axes = Axes::bare(survey.size_px);
    let [origin, room] = axes.bounds();
    let panels = Panels::new(&marks, room.x, room.y);
    let mut lengths: Vec<f64> = corners.iter().map(|corner| corner.move_mm.length()).collect();
    let longest = quantile(&mut lengths, NEARLY_ALL)?.max(1e-9);
    let enlarged = round_down(ARROW_PART * panels.spacing_mm() / longest).max(1.0);
    let down = origin.y + (room.y - panels.height()).max(0.0) / 2.0;
    axes.add(&format!(
        "<g class=\"target-map\" transform=\"translate({:.1} {down:.1})\">{}</g>",
        origin.x,
        panels.drawn(enlarged)
    ));
    axes.foot(FOOT, scales(most_px, &colour, round_down(longest), enlarged * panels.per_mm()));
    let svg = axes.svg(["", ""], "Residuals of each corner of the target");
    let sure = corners.iter().filter(|corner| corner.is_sure).count();
    let caption = format!(
        "Residuals of each corner of the target over all views: colour is their rms, arrows show where on its panel they \
         would have the corner, {enlarged} times enlarged; {sure} of {} by more than chance makes (the others are grey).",
        corners.len()
    );
    Some((svg, caption))
}

/// What colours and arrows mean.
fn scales(
    most_px: f64,
    colour: &impl Fn(f64) -> &'static str,
    example_mm: f64,
    per_mm: f64,
) -> String {
    let mut drawn = String::new();
    let wide = 10.0;
    for step in 0..STEPS {
        let px = most_px * (step as f64 + 0.5) / STEPS as f64;
        let (x, fill) = (wide * step as f64, colour(px));
        let _ = write!(
            drawn,
            "<rect x=\"{x:.1}\" y=\"8\" width=\"{:.1}\" height=\"10\" fill=\"{fill}\"/>",
            wide + 0.3
        );
    }
    let end = wide * STEPS as f64;
    let _ = write!(
        drawn,
        "<text x=\"0\" y=\"31\">0</text><text x=\"{end}\" y=\"31\" text-anchor=\"middle\">{most_px:.3}</text>\
         <text x=\"{:.1}\" y=\"17\">rms, px</text>",
        end + 8.0
    );
    let (from, to) = (310.0, 310.0 + example_mm * per_mm);
    let _ = write!(
        drawn,
        "<g class=\"target-map\"><line class=\"offset\" x1=\"{from}\" y1=\"13\" x2=\"{to:.1}\" y2=\"13\"/></g>\
         <text x=\"{from}\" y=\"31\">{example_mm} mm</text>"
    );
    drawn
}
