//! The offset of each corner on its panel that would explain its residuals, and the RMS of the residuals.
//!
//! An offset d of a corner in the plane of its panel causes the residual r = J d, with J the
//! derivative of the pixel with respect to the offset. The least-squares offset over all views of
//! the corner is
//!
//! ```text
//!     d = (Σ JᵀJ)⁻¹ Σ Jᵀ r      covariance σ² (Σ JᵀJ)⁻¹
//! ```
//!
//! Poses absorb common offsets of all corners of a panel. `Calibration::measure_target` also estimates heights and covariances;
//! this is a quick approximation from the remaining residuals.

use std::collections::BTreeMap;

use glam::{DMat2, DVec2};

use deltille_calibrate::{CameraEstimate, Estimate, PanelRef, ViewEstimate};
use deltille_core::camera::{Camera, Pose};

/// Maximum number of corners used, from evenly sampled views: more would not improve the result.
const MAX_CORNERS: usize = 200_000;

/// Threshold of a significant offset: χ² with two degrees of freedom at p = 0.001.
pub(in crate::report) const SURE: f64 = 13.8;

/// Minimum number of views of a corner.
const MIN_VIEWS: usize = 3;

/// Statistics of a corner of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::report) struct OfCorner {
    pub panel: PanelRef,
    pub row: i32,
    pub col: i32,
    /// Its position on the panel, mm.
    pub at_mm: DVec2,
    /// The least-squares offset d from that position, mm.
    pub move_mm: DVec2,
    /// Whether the offset is significant.
    pub is_confirmed: bool,
    /// RMS of its residuals per axis, px.
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

/// The corners that a camera saw, by panel, row and column. Outliers are excluded, unless a corner is an outlier in most of
/// its views: then the error is systematic, and all views count.
pub(in crate::report) fn of_corners(estimate: &Estimate, camera: &CameraEstimate) -> Vec<OfCorner> {
    let step = camera.corner_count().div_ceil(MAX_CORNERS).max(1);
    // Sums of the inliers, and of all.
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
    let seen = seen.filter(|(_, sums)| sums.views >= MIN_VIEWS);
    let of_corner = |((panel, row, col), sums): ((PanelRef, i32, i32), Sums)| {
        let move_mm = sums.normal.inverse() * sums.right;
        let views = sums.views;
        move_mm.is_finite().then(|| OfCorner {
            panel,
            row,
            col,
            at_mm: sums.at_mm / views as f64,
            move_mm,
            is_confirmed: sums.right.dot(move_mm) / variance > SURE,
            rms_px: (sums.squares / (2 * views) as f64).sqrt(),
            views,
        })
    };
    seen.filter_map(of_corner).collect()
}

/// The pose of a panel in a view.
pub(in crate::report) fn camera_from_panel(
    estimate: &Estimate,
    view: &ViewEstimate,
    panel: PanelRef,
) -> Option<Pose> {
    let target = estimate.targets.iter().find(|t| t.panels.contains(&panel.index()));
    let scene_from_target = target.map_or(Pose::IDENTITY, |target| target.scene_from_target);
    let place = estimate.panels.get(panel.index())?.target_from_panel;
    Some(view.pose.after(&scene_from_target).after(&place))
}

/// The point of a panel that a pixel sees, mm, and the derivative of the pixel with respect to an offset in the plane, px/mm.
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
pub(in crate::report) fn on_plane(
    camera: &Camera,
    camera_from_panel: &Pose,
    pixel: DVec2,
) -> Option<DVec2> {
    let ray = camera.unproject(pixel)?;
    let panel_from_camera = camera_from_panel.inverse();
    let (origin, direction) =
        (panel_from_camera.apply(ray.origin), panel_from_camera.rotation * ray.direction);
    let far = -origin.z / direction.z;
    (far.is_finite() && far > 0.0).then(|| (origin + far * direction).truncate())
}
