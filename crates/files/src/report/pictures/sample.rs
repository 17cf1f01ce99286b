//! A photograph beside its undistorted version, in which lines through the corners of a row are straight.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use glam::{DVec2, DVec3};
use image::{DynamicImage, GrayImage};

use crate::remap::remapped;
use crate::report::html::{data_url, escaped};
use crate::report::pictures::thumbnail::{png, reduced};
use deltille_calibrate::{CameraEstimate, Corner, ViewEstimate};
use deltille_core::camera::{Field, Undistortion};
use deltille_core::raster::Gray;

/// Longest side of the images, px.
const SIDE: usize = 520;

/// Maximum field of view, rad: in a wider one, the stretched border would fill most of the image.
const WIDEST_RAD: f64 = 110.0 / 180.0 * std::f64::consts::PI;

/// Angle from the axis within which corners lie inside that field of view, rad.
const AHEAD_RAD: f64 = 45.0 / 180.0 * std::f64::consts::PI;

/// Minimum number of corners of a line.
const MIN_IN_LINE: usize = 3;

/// A photograph of a camera and its undistorted version.
#[derive(Clone, Debug)]
pub struct Sample {
    view: String,
    size_px: DVec2,
    photograph: Vec<u8>,
    undistorted: Vec<u8>,
    /// Size of the undistorted image, px.
    undistorted_px: DVec2,
    field_rad: f64,
    /// Chords from the first to the last corner of rows and columns, and the corners, in both images.
    lines: [Vec<[DVec2; 2]>; 2],
    corners: [Vec<DVec2>; 2],
}

impl Sample {
    /// Returns the view, among those that satisfy `is_meant`, whose corners cover most of the image
    /// within the field of view of a pinhole.
    pub fn best(
        camera: &CameraEstimate,
        is_meant: impl Fn(&&ViewEstimate) -> bool,
    ) -> Option<&ViewEstimate> {
        let area = |view: &ViewEstimate| {
            let pixels = || view.corners.iter().map(|corner| corner.pixel);
            let low = pixels().fold(DVec2::INFINITY, DVec2::min);
            let high = pixels().fold(DVec2::NEG_INFINITY, DVec2::max);
            let is_ahead = |pixel: &DVec2| {
                let ray = camera.camera.unproject(*pixel);
                ray.is_some_and(|ray| ray.direction.angle_between(DVec3::Z) < AHEAD_RAD)
            };
            let part = pixels().filter(is_ahead).count() as f64 / pixels().count().max(1) as f64;
            part.powi(4) * (high - low).element_product()
        };
        let mut views: Vec<&ViewEstimate> = camera.views.iter().collect();
        views.sort_by(|a, b| area(b).total_cmp(&area(a)));
        views.into_iter().find(is_meant)
    }

    /// Undistorts the photograph of a view. `None` if the camera has no ray along its axis, or the
    /// undistorted image cannot be made.
    pub fn of(camera: &CameraEstimate, view: &ViewEstimate, photograph: Gray<u8>) -> Option<Self> {
        let lens = &camera.camera;
        let distance_mm = view.pose.translation.length();
        let size = DVec2::new(f64::from(lens.width), f64::from(lens.height));
        let new_size = (size * (SIDE as f64 / size.max_element()).min(1.0)).round();
        let [width, height] = new_size.to_array().map(|side| side.max(1.0) as u32);
        let widest = Undistortion::new(lens, [width, height], Field::Whole).ok()?;
        let narrow = f64::from(width) / 2.0 / (WIDEST_RAD / 2.0).tan();
        let focal = widest.view().focal_px.x.max(narrow);
        let undistortion = widest.with_focal(focal).at_distance(distance_mm);
        let small = png(&reduced(&photograph, SIDE))?;
        let [w, h] = [photograph.width(), photograph.height()];
        let whole = GrayImage::from_raw(w as u32, h as u32, photograph.pixels().to_vec())?;
        let straight = remapped(&DynamicImage::ImageLuma8(whole), &undistortion.map());
        let straight = png(&straight.into_luma8())?;
        // A corner in the undistorted image.
        let place = |pixel: DVec2| {
            let ray = lens.unproject(pixel)?;
            let point: DVec3 = ray.origin + ray.direction * distance_mm;
            let at = undistortion.view_from_camera() * point;
            (at.z > 0.0).then(|| undistortion.view().project(at)).flatten()
        };
        let seen = |corner: &Corner| Some((corner.pixel, place(corner.pixel)?));
        let mut lines: [Vec<[DVec2; 2]>; 2] = Default::default();
        for along_rows in [true, false] {
            for line in lines_of(view, along_rows).into_values() {
                let ends = line.first().zip(line.last()).filter(|_| line.len() >= MIN_IN_LINE);
                let ends = ends.and_then(|(a, b)| Some([seen(a)?, seen(b)?]));
                let Some([(a, a_new), (b, b_new)]) = ends else { continue };
                lines[0].push([a, b]);
                lines[1].push([a_new, b_new]);
            }
        }
        let (before, after) = view.corners.iter().filter_map(seen).unzip();
        Some(Self {
            view: view.name.clone(),
            size_px: size,
            photograph: small,
            undistorted: straight,
            undistorted_px: new_size,
            field_rad: 2.0 * (f64::from(width) / 2.0 / focal).atan(),
            lines,
            corners: [before, after],
        })
    }

    /// The section with both images side by side.
    pub(crate) fn section(&self) -> String {
        let drawn = |index: usize, png: &[u8], size: DVec2, shows: &str| {
            let DVec2 { x: w, y: h } = size;
            // Lines have the same width in both images.
            let unit = w / SIDE as f64;
            let mut svg = format!(
                "<svg class=\"sample\" viewBox=\"-0.5 -0.5 {w} {h}\" width=\"{SIDE}\" role=\"img\" aria-label=\"{shows}\">\
                 <image href=\"{}\" x=\"-0.5\" y=\"-0.5\" width=\"{w}\" height=\"{h}\"/>",
                data_url(png)
            );
            for [a, b] in &self.lines[index] {
                let _ = write!(
                    svg,
                    "<path class=\"chord\" stroke-width=\"{:.2}\" d=\"M{:.1} {:.1}L{:.1} {:.1}\"/>",
                    0.9 * unit,
                    a.x,
                    a.y,
                    b.x,
                    b.y
                );
            }
            for at in &self.corners[index] {
                let _ = write!(
                    svg,
                    "<circle class=\"seen\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"{:.2}\"/>",
                    at.x,
                    at.y,
                    1.9 * unit
                );
            }
            svg + "</svg>"
        };
        let [photograph, straight] = [
            drawn(0, &self.photograph, self.size_px, "Original image"),
            drawn(1, &self.undistorted, self.undistorted_px, "Undistorted image"),
        ];
        format!(
            "<section><h2>Undistorted image</h2><div class=\"plots\"><figure>{photograph}<figcaption>View {}, original: \
             straight lines between the first and the last corner of rows and columns miss the corners \
             in between.</figcaption></figure><figure>{straight}<figcaption>The same view undistorted, {:.0}° wide: corners \
             lie on the lines if the calibration is correct.</figcaption></figure></div></section>\n",
            escaped(&self.view),
            self.field_rad.to_degrees()
        )
    }
}

/// The corners of each row, or of each column, in order.
fn lines_of(view: &ViewEstimate, along_rows: bool) -> BTreeMap<(usize, i32), Vec<&Corner>> {
    let mut lines: BTreeMap<(usize, i32), Vec<&Corner>> = BTreeMap::new();
    let of_line = |corner: &Corner| if along_rows { corner.row } else { corner.col };
    let in_line = |corner: &&Corner| if along_rows { corner.col } else { corner.row };
    for corner in view.corners.iter().filter(|corner| !corner.outlier) {
        lines.entry((corner.panel.index(), of_line(corner))).or_default().push(corner);
    }
    lines.values_mut().for_each(|line| line.sort_by_key(in_line));
    lines
}
