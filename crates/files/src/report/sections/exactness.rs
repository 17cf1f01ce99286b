//! Plots of residuals and of projection uncertainty over the image, the target and the views.

use crate::report::html;
use crate::report::measures::survey::Survey;
use crate::report::plots::{board_residuals, field, residuals};
use deltille_calibrate::{CameraEstimate, Estimate, PoseSd, PoseUncertainty, Source};

/// The section with residuals by image position, target corner, radius and view, and the coverage of the image.
pub(in crate::report) fn residuals(
    estimate: &Estimate,
    camera: &CameraEstimate,
    survey: &Survey,
) -> String {
    let (arrows, caption) = residuals::residual_map(camera, survey);
    let mut figures = vec![(arrows, caption)];
    figures.extend(board_residuals::plot(estimate, camera, survey));
    figures.push((
        residuals::scatter(camera, survey),
        "Residuals of all corners. A round cloud is noise; any other shape is a systematic error. Rings on the border are \
        corners outside the plot."
            .to_owned(),
    ));
    figures.push((
        residuals::histogram(camera, survey),
        "Histogram of the residuals per axis, and the normal distribution with the same standard deviation."
            .to_owned(),
    ));
    figures.push((
        residuals::against_radius(camera, survey),
        "Residuals of corners against the distance from the principal point, and the rms per axis of concentric rings, which \
         should be constant. Rings on the border are corners outside the plot."
            .to_owned(),
    ));
    figures.push((
        residuals::coverage(survey),
        "Number of corners in each cell of the image. In empty cells (red) distortion is extrapolated."
            .to_owned(),
    ));
    figures.push((
        residuals::of_views(camera, survey),
        "The rms of each view, in order, and of all views (line). A step means that something changed; a peak means a bad image. \
         Point at a bar for the name of its view.".to_owned(),
    ));
    let (place, caption) = residuals::against_place(camera, survey);
    figures.push((place, caption.to_owned()));
    html::section("Residuals and coverage", &html::figures(figures))
}

/// Uncertainty of projections over the image, and of poses of the target.
pub(in crate::report) fn uncertainty<'a>(
    camera: &CameraEstimate,
    poses: impl Iterator<Item = &'a PoseUncertainty>,
) -> String {
    let maps = camera.uncertainty_maps();
    if maps.is_empty() {
        return String::new();
    }
    let drawn = maps.iter().map(|map| (field::uncertainty(camera, map), field::caption(map)));
    let rows = maps.iter().filter_map(|map| {
        let sd = camera.projection_sd_px(map.distance_mm, map.source)?;
        let source = match map.source {
            Source::Noise => "corner noise",
            Source::Observed => "observed",
        };
        let distance = map.distance_mm.map_or("infinity".to_owned(), |mm| format!("{mm:.0} mm"));
        Some(format!(
            "<tr><td>{distance}</td><td>{source}</td><td class=\"number\">{sd:.4}</td></tr>"
        ))
    });
    let body = format!(
        "{}<div class=\"wide-table\"><table class=\"plain\"><tr><th>distance</th><th class=\"words\">source</th><th>1σ, px</th></tr>{}</table></div>\
         <p class=\"note\">Standard deviation per axis within the region with corners, after the camera motion that fits the \
         corners best.</p>",
        html::figures(drawn),
        rows.collect::<String>()
    );
    html::section("Projection uncertainty", &(body + &pose_table(poses)))
}

/// The uncertainty of poses of the target at the distances of interest.
fn pose_table<'a>(poses: impl Iterator<Item = &'a PoseUncertainty>) -> String {
    let row = |of: &PoseUncertainty, source: &str, sd: PoseSd| {
        format!(
            "<tr><td class=\"words\">{}</td><td>{:.0} mm</td><td class=\"words\">{source}</td><td class=\"number\">{:.4}</td>\
             <td class=\"number\">{:.4}</td><td class=\"number\">{:.4}</td></tr>",
            html::escaped(&of.target),
            of.distance_mm,
            sd.rotation_rad.to_degrees(),
            sd.across_mm,
            sd.along_mm
        )
    };
    let rows: String = poses
        .map(|of| row(of, "calibration", of.calibration) + &row(of, "1 px of noise", of.per_px))
        .collect();
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<div class=\"wide-table\"><table class=\"plain\"><tr><th class=\"words\">pose of</th><th>distance</th>\
         <th class=\"words\">source</th><th>rotation, °</th><th>across, mm</th><th>along, mm</th></tr>{rows}</table></div>\
         <p class=\"note\">Standard deviation of a pose estimated with this calibration, where corners were seen: the rotation per axis, \
         and the position across and along the line of sight. Errors from noise are proportional to the noise of the corners.</p>"
    )
}
