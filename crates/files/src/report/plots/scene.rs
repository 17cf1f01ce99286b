//! Drawings of cameras and targets in space, in parallel projection: one in the frame of the cameras, one in the frame of the
//! target.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use glam::{DQuat, DVec2, DVec3};

use crate::report::html::escaped;
use crate::report::measures::corner_offsets::{camera_from_panel, on_plane};
use crate::report::plots::axes::Axes;
use deltille_calibrate::{CameraEstimate, Estimate, PanelRef, ViewEstimate};
use deltille_core::camera::{Camera, Pose};
use deltille_core::polygon::hull;
use deltille_core::statistics::median;

/// Margin of the drawing, user units.
const MARGIN: f64 = 36.0;

/// Maximum number of views drawn per camera, evenly sampled: more would hide each other.
const MAX_VIEWS: usize = 60;

/// Length of the pyramid of a camera as a fraction of the median distance of the target: for a fixed camera, and for one of
/// many poses around a fixed target.
const CAMERA_PART: f64 = 0.12;
const SMALL_CAMERA_PART: f64 = 0.07;

/// Number of views above which the target is drawn nearly transparent.
const FEW_VIEWS: usize = 12;

/// The frame in which a scene is drawn, and the direction from which it is viewed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) enum Fixed {
    /// The cameras are fixed; the viewer is above and behind the first.
    Rig,
    /// The target is fixed; the viewer is in front of and below it.
    Target,
}

impl Fixed {
    /// A point or direction, mm, in the axes of the viewer: x right, y down, z away from the viewer.
    fn turned(self, point: DVec3) -> DVec3 {
        match self {
            Self::Rig => DQuat::from_rotation_x(0.5) * (DQuat::from_rotation_y(0.6) * point),
            // A target has y up and z towards the camera.
            Self::Target => {
                let faced = DVec3::new(point.x, -point.y, -point.z);
                DQuat::from_rotation_x(0.9) * (DQuat::from_rotation_y(0.5) * faced)
            }
        }
    }
}

/// Maximum ratio of half the width of a drawn camera to its length, for a field of view of 90°. It also applies if the lens has
/// no forward ray at the corners of its image.
const WIDE: f64 = 1.0;

/// A polygon in space.
struct Shape {
    /// Its corners, mm, in the fixed frame: of the rig, or of the target.
    corners: Vec<DVec3>,
    /// CSS class.
    class: &'static str,
    /// Tooltip.
    title: String,
}

/// The scene as an SVG. It has the size of the other plots of a camera with this image size, px; empty if the target was
/// not seen.
pub(in crate::report) fn drawing(estimate: &Estimate, fixed: Fixed, image_px: DVec2) -> String {
    let [_, size_px] = Axes::bare(image_px).bounds();
    let (width, height) = (size_px.x, size_px.y);
    let depths = targets(estimate).iter().map(|shape| shape.middle().length()).collect();
    let Some(depth) = median(depths).filter(|depth| *depth > 0.0) else { return String::new() };
    let mut shapes = match fixed {
        Fixed::Rig => {
            let cameras = estimate.cameras.iter();
            let cameras =
                cameras.flat_map(|camera| pyramid(camera, &Pose::IDENTITY, CAMERA_PART * depth));
            targets(estimate).into_iter().chain(cameras).collect()
        }
        Fixed::Target => around_target(estimate, SMALL_CAMERA_PART * depth),
    };
    let turned = |point: DVec3| fixed.turned(point);
    // Far polygons come first, so near ones cover them.
    shapes.sort_by(|a, b| turned(b.middle()).z.total_cmp(&turned(a.middle()).z));
    let flat = |point: &DVec3| turned(*point).truncate();
    let all = || shapes.iter().flat_map(|shape| &shape.corners).map(flat);
    let low = all().fold(DVec2::INFINITY, DVec2::min);
    let size = all().fold(DVec2::NEG_INFINITY, DVec2::max) - low;
    let room = size_px - 2.0 * MARGIN;
    let scale = (room / size.max(DVec2::splat(1.0))).min_element();
    let aside = (room - scale * size) / 2.0;
    let place = |point: &DVec3| MARGIN + aside + scale * (flat(point) - low);
    let many = if estimate.frames.len() > FEW_VIEWS { " many" } else { "" };
    let mut svg = format!(
        "<svg class=\"scene{many}\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" role=\"img\" \
         aria-label=\"cameras and target in space\">"
    );
    for shape in &shapes {
        let points: Vec<String> = shape
            .corners
            .iter()
            .map(|corner| {
                let at = place(corner);
                format!("{:.1},{:.1}", at.x, at.y)
            })
            .collect();
        let (class, title) = (shape.class, escaped(&shape.title));
        // Writing to a String cannot fail.
        let _ = write!(
            svg,
            "<polygon class=\"{class}\" points=\"{}\"><title>{title}</title></polygon>",
            points.join(" ")
        );
    }
    let is_named = estimate.cameras.len() > 1 && fixed == Fixed::Rig;
    for camera in estimate.cameras.iter().filter(|_| is_named) {
        let at = place(&camera.camera_from_rig.inverse().translation);
        let (x, y, name) = (at.x - 6.0, at.y + 4.0, escaped(&camera.name));
        let _ = write!(
            svg,
            "<text class=\"name\" text-anchor=\"end\" x=\"{x:.1}\" y=\"{y:.1}\">{name}</text>"
        );
    }
    let (mm, y) = (round_length(0.25 * size.x.max(size.y)), height - 14.0);
    let (from, to) = (MARGIN, MARGIN + scale * mm);
    let _ = write!(
        svg,
        "<path class=\"scale\" d=\"M{from:.1} {y:.1}H{to:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\">{mm} mm</text></svg>",
        to + 6.0,
        y + 4.0
    );
    svg
}

/// The longest scale bar of 1, 2 or 5 times a power of ten, mm, that does not exceed `most`.
fn round_length(most: f64) -> f64 {
    let power = 10f64.powf(most.max(f64::MIN_POSITIVE).log10().floor());
    [5.0, 2.0, 1.0].map(|n| n * power).into_iter().find(|mm| *mm <= most).unwrap_or(power)
}

impl Shape {
    /// Mean of its corners, mm.
    fn middle(&self) -> DVec3 {
        self.corners.iter().sum::<DVec3>() / self.corners.len().max(1) as f64
    }
}

/// The field of view of a camera as a pyramid: four sides from the optical centre, and the base at
/// the distance `long`, mm, on its axis. `frame_from_rig` transforms it into the drawn frame.
fn pyramid(camera: &CameraEstimate, frame_from_rig: &Pose, long: f64) -> Vec<Shape> {
    let frame_from_camera = frame_from_rig.after(&camera.camera_from_rig.inverse());
    let base = corners_ahead(&camera.camera)
        .map(|corner| frame_from_camera.apply(long * corner.extend(1.0)));
    let top = frame_from_camera.translation;
    let shape = |corners: Vec<DVec3>, class| {
        let title = if camera.name.is_empty() { "camera" } else { camera.name.as_str() };
        Shape { corners, class, title: title.to_owned() }
    };
    let sides = (0..4).map(|i| shape(vec![top, base[i], base[(i + 1) % 4]], "camera-side"));
    sides.chain([shape(base.to_vec(), "camera-base")]).collect()
}

/// The scene in the target frame: every panel as outlined by the view with most of its corners, and all camera poses as
/// pyramids of length `long`, mm.
fn around_target(estimate: &Estimate, long: f64) -> Vec<Shape> {
    let worst = estimate.frames.iter().map(|frame| frame.rms_px).fold(0.0, f64::max);
    let mut widest: BTreeMap<PanelRef, (f64, Shape)> = BTreeMap::new();
    let mut cameras = Vec::new();
    for camera in &estimate.cameras {
        let step = camera.views.len().div_ceil(MAX_VIEWS).max(1);
        for view in camera.views.iter().step_by(step) {
            let target_from_rig = view.pose.inverse().after(&camera.camera_from_rig);
            for (panel, shape) in panels(estimate, camera, view, "board fixed") {
                let corners = shape.corners.iter().map(|at| target_from_rig.apply(*at)).collect();
                let shape = Shape { corners, title: "target".to_owned(), ..shape };
                let size = shape.corners.iter().map(|at| at.distance(shape.corners[0]));
                let size = size.fold(0.0, f64::max);
                match widest.get(&panel) {
                    Some((most, _)) if *most >= size => {}
                    _ => drop(widest.insert(panel, (size, shape))),
                }
            }
            let is_worst = view.rms_px >= worst && estimate.frames.len() > 1;
            let title = format!("{} {}, rms {:.3} px", camera.name, view.name, view.rms_px);
            let drawn = pyramid(camera, &target_from_rig, long).into_iter().map(|shape| Shape {
                class: if is_worst { "camera-side worst" } else { shape.class },
                title: title.clone(),
                ..shape
            });
            cameras.extend(drawn);
        }
    }
    widest.into_values().map(|(_, shape)| shape).chain(cameras).collect()
}

/// The corners of the image in order around it, projected onto the plane z = 1 of the camera frame.
fn corners_ahead(camera: &Camera) -> [DVec2; 4] {
    let [a, b, c, d] = camera.corners_px();
    [a, b, d, c].map(|corner| {
        let direction = camera.unproject(corner).map(|ray| ray.direction);
        let flat = direction.filter(|d| d.z > 0.0).map(|d| d.truncate() / d.z);
        let wide = (corner - camera.centre_px).signum() * WIDE;
        flat.filter(|flat| flat.abs().max_element() < WIDE).unwrap_or(wide)
    })
}

/// The outlines of the panels in all views, in the rig frame, limited to the corners that were seen.
fn targets(estimate: &Estimate) -> Vec<Shape> {
    let worst = estimate.frames.iter().map(|frame| frame.rms_px).fold(0.0, f64::max);
    let of_camera = |camera: &'_ CameraEstimate| {
        let step = camera.views.len().div_ceil(MAX_VIEWS).max(1);
        let views = camera.views.iter().step_by(step);
        let shapes = views.flat_map(|view| {
            let is_worst = view.rms_px >= worst && estimate.frames.len() > 1;
            let class = if is_worst { "board worst" } else { "board" };
            panels(estimate, camera, view, class).into_iter().map(|(_, shape)| shape)
        });
        shapes.collect::<Vec<Shape>>()
    };
    estimate.cameras.iter().flat_map(of_camera).collect()
}

/// The panels in a view, in the rig frame: the convex hull of the inliers of each panel, on the plane that follows from the
/// pose of the view.
fn panels(
    estimate: &Estimate,
    camera: &CameraEstimate,
    view: &ViewEstimate,
    class: &'static str,
) -> Vec<(PanelRef, Shape)> {
    let mut seen: Vec<PanelRef> = view.corners.iter().map(|corner| corner.panel).collect();
    seen.sort();
    seen.dedup();
    let shape = |panel: PanelRef| {
        let camera_from_panel = camera_from_panel(estimate, view, panel)?;
        let corners = view.corners.iter().filter(|c| c.panel == panel && !c.outlier);
        let flat = corners.filter_map(|c| on_plane(&camera.camera, &camera_from_panel, c.pixel));
        let outline = hull(flat.collect());
        let rig_from_panel = camera.camera_from_rig.inverse().after(&camera_from_panel);
        let corners = outline.into_iter().map(|at| rig_from_panel.apply(at.extend(0.0)));
        let title = format!("{}, rms {:.3} px", view.name, view.rms_px);
        Some((panel, Shape { corners: corners.collect(), class, title }))
    };
    seen.into_iter().filter_map(shape).filter(|(_, shape)| shape.corners.len() > 2).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_the_scale_are_round() {
        let lengths = [730.0, 38.0, 19.0, 1.2].map(round_length);
        assert_eq!(lengths, [500.0, 20.0, 10.0, 1.0]);
    }
}
