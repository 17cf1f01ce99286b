//! Key figures as a row of boxes.

use crate::report::content::Report;
use crate::report::html::escaped;
use crate::report::sections::numbers::rounded;
use deltille_calibrate::CameraEstimate;

/// A key figure with its unit, as HTML, and its label.
type Figure = (String, &'static str);

/// The key figures of a camera.
pub(in crate::report) fn of_camera(
    report: &Report,
    index: usize,
    found: &CameraEstimate,
) -> Vec<Figure> {
    let camera = &found.camera;
    let model = found.model.map_or("fixed".to_owned(), |model| model.to_string());
    let mut cells = vec![
        (format!("{:.4} px", found.rms_px), "rms per axis"),
        (escaped(&model), "model"),
        (format!("{}\u{a0}×\u{a0}{}", camera.width, camera.height), "image, px"),
        (found.views.len().to_string(), "views"),
        (found.corner_count().to_string(), "corners"),
    ];
    if found.outlier_count() > 0 {
        cells.insert(1, (format!("{:.4} px", found.inlier_rms_px()), "rms without outliers"));
    }
    if let Some(held_out) = report.held_out(index) {
        let name = "rms on held-out views";
        cells.insert(1, (format!("{:.4} px", held_out.rms_px), name));
    }
    cells.extend(of_print(report).filter(|_| !report.is_rig()));
    cells
}

/// The key figures of all cameras together.
pub(in crate::report) fn of_rig(report: &Report) -> Vec<Figure> {
    let found = report.estimate;
    let mut cells = vec![
        (format!("{:.4} px", found.rms_px), "rms per axis"),
        (found.cameras.len().to_string(), "cameras"),
        (found.frames.len().to_string(), "frames"),
        (found.corner_count().to_string(), "corners"),
    ];
    if found.outlier_count() > 0 {
        cells.insert(1, (format!("{:.4} px", found.inlier_rms_px()), "rms without outliers"));
    }
    if let Some(held_out) = &found.held_out {
        cells.insert(1, (format!("{:.4} px", held_out.rms_px), "rms on held-out frames"));
    }
    cells.extend(of_print(report));
    cells
}

/// The ink spread of the print, if it was measured together with its standard deviation.
fn of_print(report: &Report) -> Option<Figure> {
    let (um, deviation) = report.print.ink.and_then(|ink| ink.um.zip(ink.um_sd))?;
    let (um, deviation) = rounded(um, Some(deviation));
    Some((format!("{um} ± {deviation} µm"), "ink spread"))
}

/// Key figures as a row of boxes.
pub(in crate::report) fn cells(cells: &[Figure]) -> String {
    let cells = cells.iter().map(|(value, name)| format!("<div><b>{value}</b>{name}</div>"));
    format!("<div class=\"figures\">{}</div>", cells.collect::<String>())
}
