//! Plots of residuals and of the uncertainty of projections, over the image, the target and the
//! views.

use crate::report::html;
use crate::report::measures::survey::Survey;
use crate::report::plots::{board_residuals, field, residuals};
use deltille_calibrate::{CameraEstimate, Estimate, Source};

/// Residuals over the image, the target, the radius and the views, and the coverage of the image.
pub(in crate::report) fn residuals(
    estimate: &Estimate,
    camera: &CameraEstimate,
    survey: &Survey,
) -> String {
    let (arrows, caption) = residuals::residual_map(survey);
    let mut figures = vec![(arrows, caption)];
    figures.extend(board_residuals::plot(estimate, camera, survey));
    figures.push((
        residuals::scatter(camera, survey),
        "Residuals of all corners: a round cloud is noise, anything else is not. Rings on the rim lie beyond it."
            .to_owned(),
    ));
    figures.push((
        residuals::histogram(camera, survey),
        "How many residuals of a coordinate are how large, and the normal distribution of the same deviation."
            .to_owned(),
    ));
    figures.push((
        residuals::against_radius(camera, survey),
        "Errors of corners by their place in the image, and the rms of rings per coordinate, which should be level. \
         Rings on the rim lie beyond it."
            .to_owned(),
    ));
    figures.push((
        residuals::coverage(survey),
        "Corners in each part of the image. Where there are none (red) distortion is extrapolated."
            .to_owned(),
    ));
    figures.push((
        residuals::of_views(camera, survey),
        "The rms of each view in their order: steps show that something changed, peaks a bad picture.".to_owned(),
    ));
    let (place, caption) = residuals::against_place(camera, survey);
    figures.push((place, caption.to_owned()));
    html::section("Residuals and coverage", &html::figures(figures))
}

/// Uncertainty of projections over the image.
pub(in crate::report) fn uncertainty(camera: &CameraEstimate) -> String {
    let maps = camera.uncertainty_maps();
    if maps.is_empty() {
        return String::new();
    }
    let drawn = maps.iter().map(|map| (field::uncertainty(camera, map), field::caption(map)));
    let told = maps.iter().filter_map(|map| {
        let sd = camera.projection_sd_px(map.distance_mm, map.source)?;
        let source = match map.source {
            Source::Noise => "from noise",
            Source::Observed => "observed",
        };
        let distance = map.distance_mm.map_or("infinity".to_owned(), |mm| format!("{mm:.0} mm"));
        Some(format!(
            "<tr><td>{distance}</td><td>{source}</td><td class=\"number\">{sd:.4}</td></tr>"
        ))
    });
    let body = format!(
        "{}<div class=\"wide-table\"><table class=\"plain\"><tr><th>distance</th><th class=\"words\">deviation</th><th>px</th></tr>{}</table></div>\
         <p class=\"note\">Standard deviation of a coordinate where corners were, after the motion of the camera that explains \
         the corners best.</p>",
        html::figures(drawn),
        told.collect::<String>()
    );
    html::section("How sure projections are", &body)
}
