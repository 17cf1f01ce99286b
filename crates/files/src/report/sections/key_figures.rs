//! Key figures as a row of boxes.

use std::borrow::Cow;

use glam::{DVec2, DVec3};

use crate::report::content::Report;
use crate::report::html::escaped;
use crate::report::measures::displacement::Ideal;
use crate::report::sections::numbers::rounded;
use deltille_calibrate::CameraEstimate;
use deltille_core::camera::Camera;
use deltille_core::raster::CameraNotes;

/// A key figure with its unit, as HTML, and its label.
type Figure = (String, Cow<'static, str>);

/// The key figures of a camera.
pub(in crate::report) fn of_camera(
    report: &Report,
    index: usize,
    found: &CameraEstimate,
) -> Vec<Figure> {
    let camera = &found.camera;
    let model = found.model.map_or("fixed".to_owned(), |model| model.to_string());
    let mut cells = vec![
        (escaped(&model), "model".into()),
        (format!("{}\u{a0}×\u{a0}{}", camera.width, camera.height), "image, px".into()),
    ];
    cells.extend(focal_length(camera, report.notes.get(&index)));
    let field = field_of_view(camera).map(|[across, down]| {
        (
            format!("{:.1}°\u{a0}×\u{a0}{:.1}°", across.to_degrees(), down.to_degrees()),
            "field of view".into(),
        )
    });
    cells.extend(field);
    if found.outlier_count() > 0 {
        cells.push((format!("{:.4} px", found.inlier_rms_px()), "rms without outliers".into()));
    }
    cells.push((format!("{:.4} px", found.rms_px), "rms per axis".into()));
    if let Some(held_out) = report.held_out(index) {
        cells.push((format!("{:.4} px", held_out.rms_px), "rms on held-out views".into()));
    }
    cells.push((found.views.len().to_string(), "views".into()));
    cells.push((found.corner_count().to_string(), "corners".into()));
    cells.extend(of_print(report).filter(|_| !report.is_rig()));
    cells
}

/// Diagonal of a frame of 35 mm film, mm.
const FILM_DIAGONAL_MM: f64 = 43.267;

/// The focal length in px, and in mm: on the sensor if the metadata of the photographs determine its size, otherwise on 35 mm
/// film.
fn focal_length(camera: &Camera, notes: Option<&CameraNotes>) -> [Figure; 2] {
    // On the axis: some models scale their focal length, so that fx alone has no meaning.
    let [fx, fy] = Ideal::of(camera, 0.0).focal_px.to_array();
    let [fx_text, fy_text] = [fx, fy].map(|focal| format!("{focal:.1}"));
    let px = match fx_text == fy_text {
        true => format!("{fx_text}\u{a0}px"),
        false => format!("{fx_text}\u{a0}× {fy_text}\u{a0}px"),
    };
    let size_px = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    let in_diagonals = f64::midpoint(fx, fy) / size_px.length();
    let nominal = notes.and_then(|notes| notes.focal_mm.zip(notes.focal_35mm_mm));
    let mm = match nominal {
        Some((focal_mm, on_film_mm)) => {
            let diagonal_mm = FILM_DIAGONAL_MM * focal_mm / on_film_mm;
            let [width, height] = (size_px / size_px.length() * diagonal_mm).to_array();
            let label = format!(
                "focal length, if {width:.1} × {height:.1} mm of the sensor are imaged (EXIF)"
            );
            (format!("{:.2} mm", in_diagonals * diagonal_mm), label.into())
        }
        None => (
            format!("{:.1} mm", in_diagonals * FILM_DIAGONAL_MM),
            "focal length, 35 mm equivalent".into(),
        ),
    };
    [(px, "focal length".into()), mm]
}

/// The horizontal and the vertical field of view through the middle of the image, rad; `None` if the lens model does not reach
/// the edges.
fn field_of_view(camera: &Camera) -> Option<[f64; 2]> {
    let [width, height] = [camera.width, camera.height].map(|side| f64::from(side) - 0.5);
    let [x, y] = [width / 2.0, height / 2.0].map(|middle| middle - 0.25);
    // Beyond 180°, the angle between the two rays would be that on the other side.
    let from_axis = |x: f64, y: f64| {
        Some(camera.unproject(DVec2::new(x, y))?.direction.angle_between(DVec3::Z))
    };
    Some([from_axis(-0.5, y)? + from_axis(width, y)?, from_axis(x, -0.5)? + from_axis(x, height)?])
}

/// The key figures of all cameras together.
pub(in crate::report) fn of_rig(report: &Report) -> Vec<Figure> {
    let found = report.estimate;
    let mut cells = vec![
        (format!("{:.4} px", found.rms_px), "rms per axis".into()),
        (found.cameras.len().to_string(), "cameras".into()),
        (found.frames.len().to_string(), "frames".into()),
        (found.corner_count().to_string(), "corners".into()),
    ];
    if found.outlier_count() > 0 {
        cells
            .insert(1, (format!("{:.4} px", found.inlier_rms_px()), "rms without outliers".into()));
    }
    if let Some(held_out) = &found.held_out {
        cells.insert(1, (format!("{:.4} px", held_out.rms_px), "rms on held-out frames".into()));
    }
    cells.extend(of_print(report));
    cells
}

/// The ink spread of the print, if it was measured and is significant.
fn of_print(report: &Report) -> Option<Figure> {
    let measured = report.print.ink.and_then(|ink| ink.um.zip(ink.um_sd));
    let (um, deviation) = measured.filter(|(um, sd)| um.abs() > 2.0 * sd)?;
    let (um, deviation) = rounded(um, Some(deviation));
    Some((format!("{um} ± {deviation} µm"), "ink spread".into()))
}

/// Key figures as a row of boxes.
pub(in crate::report) fn cells(cells: &[Figure]) -> String {
    let cells = cells.iter().map(|(value, name)| format!("<div><b>{value}</b>{name}</div>"));
    format!("<div class=\"figures\">{}</div>", cells.collect::<String>())
}
