//! The views of a camera: the worst as images, all of them in a table.

use std::fmt::Write as _;

use crate::report::content::Report;
use crate::report::html::{self, data_url, escaped, meter, out_row};
use crate::report::measures::survey::{Survey, SurveyedView};
use crate::report::plots::round_down::round_down;
use deltille_calibrate::{CameraEstimate, Excluded, ViewEstimate};
use deltille_core::statistics::quantile;
use deltille_core::words::counted;

/// Maximum number of views in the table; with more views, the worst are listed.
pub(super) const MAX_VIEWS: usize = 300;

/// Number of views shown as images.
const IN_PICTURES: usize = 8;

/// Length that nearly all residual arrows stay below, as a fraction of the image width.
const ARROW_PART: f64 = 0.05;
const NEARLY_ALL: f64 = 0.95;

/// The views of a camera that the page shows, ordered by decreasing RMS residual.
pub fn shown_views(camera: &CameraEstimate) -> Vec<&ViewEstimate> {
    order(camera).into_iter().map(|index| &camera.views[index]).collect()
}

/// Indices of the views that are shown, ordered by decreasing RMS residual.
fn order(camera: &CameraEstimate) -> Vec<usize> {
    let mut order: Vec<usize> = (0..camera.views.len()).collect();
    let rms = |index: usize| camera.views[index].rms_px;
    order.sort_by(|&a, &b| rms(b).total_cmp(&rms(a)));
    order.truncate(MAX_VIEWS);
    order
}

/// The section about the views of a camera: the worst as images with enlarged residuals, and all,
/// including held-out views, in a collapsible table.
pub(in crate::report) fn section(report: &Report, index: usize, survey: &Survey) -> String {
    let camera = &report.estimate.cameras[index];
    let (order, all) = (order(camera), camera.views.len());
    let held_out = report.held_out(index).map(|held_out| (held_out, Survey::new(held_out)));
    let of_test =
        held_out.iter().flat_map(|(held_out, survey)| held_out.views.iter().zip(&survey.views));
    let of_test: Vec<(&ViewEstimate, &SurveyedView)> = of_test.collect();
    let every = camera.views.iter().chain(of_test.iter().map(|(view, _)| *view));
    let worst = every.map(|view| view.rms_px).fold(f64::MIN_POSITIVE, f64::max);
    let in_pictures: Vec<usize> = order.iter().copied().take(IN_PICTURES).collect();
    let enlarged = enlarged(camera, &in_pictures);
    let cards = in_pictures.iter().map(|&of_view| {
        let (view, stands) = (&camera.views[of_view], &survey.views[of_view]);
        let shown = Shown::First { id: id(index, of_view), enlarged };
        card(report, index, view, stands, worst, shown)
    });
    let cards: String = cards.collect();
    let rows = order.into_iter().map(|of_view| {
        let (view, stands) = (&camera.views[of_view], &survey.views[of_view]);
        let shown = match in_pictures.contains(&of_view) {
            true => Shown::Again(id(index, of_view)),
            false => Shown::Only,
        };
        row(report, index, view, stands, worst, shown, "")
    });
    let tests = of_test
        .iter()
        .map(|(view, stands)| row(report, index, view, stands, worst, Shown::Only, " (held out)"));
    let rows: String = rows.chain(tests).collect();
    let is_here = |out: &&Excluded| match &out.camera {
        Some(name) => *name == camera.name,
        None => !report.is_rig(),
    };
    let excluded = report.estimate.excluded.iter().filter(is_here);
    let excluded: String = excluded.map(|out| format!("<tr>{}", out_row(out, 1))).collect();
    let excluded = match excluded.as_str() {
        "" => excluded,
        rows => {
            format!("<div class=\"wide-table\"><table class=\"plain out\">{rows}</table></div>")
        }
    };
    let what = match all > MAX_VIEWS {
        true => format!("The worst {MAX_VIEWS} of {all} views in a table"),
        false => format!("All {} in a table", counted(all + of_test.len(), "view")),
    };
    let bent = match report.has_panels() {
        true => "panels are bent or displaced",
        false => "a bent board",
    };
    let arrows = format!(
        "<p class=\"note\">Arrows are residuals, enlarged {enlarged} times; outliers are red. Arrows in one direction indicate \
         motion of the camera or of the {}. Radial or alternating arrows indicate the lens model or {bent}.</p>",
        report.target_noun()
    );
    let body = format!(
        "{excluded}<div class=\"cards\">{cards}</div>{arrows}<details><summary>{what}</summary><div class=\"wide-table\">\
         <table class=\"plain views\"><tr><th></th><th>view</th><th>corners</th><th>rms, px</th><th>outliers</th>\
         <th>tilt</th><th>distance, mm</th></tr>{rows}</table></div></details>"
    );
    html::section("Views, worst first", &body)
}

/// The common magnification of the residuals in the images of these views, a round number.
fn enlarged(camera: &CameraEstimate, views: &[usize]) -> f64 {
    let corners = views.iter().flat_map(|&index| &camera.views[index].corners);
    let corners = corners.filter(|corner| !corner.outlier);
    let mut lengths: Vec<f64> = corners.map(|corner| corner.residual.length()).collect();
    let longest = quantile(&mut lengths, NEARLY_ALL).unwrap_or(1.0).max(1e-9);
    round_down(ARROW_PART * f64::from(camera.camera.width) / longest).max(1.0)
}

/// The image of a view with its key figures; `worst` is the largest RMS of any view, px.
fn card(
    report: &Report,
    camera: usize,
    view: &ViewEstimate,
    stands: &SurveyedView,
    worst: f64,
    shown: Shown,
) -> String {
    let outliers = match view.outlier_count() {
        0 => String::new(),
        n => format!(", <span class=\"out\">{}</span>", counted(n, "outlier")),
    };
    let tilt =
        stands.tilt_rad.map_or(String::new(), |t| format!(", tilted {:.0}°", t.to_degrees()));
    format!(
        "<figure class=\"card\">{}<figcaption><span class=\"head\"><b class=\"name\">{}</b><span class=\"number\">{:.4} px{}\
         </span></span>{}{outliers}{tilt}, {:.0} mm</figcaption></figure>",
        picture(report, camera, view, shown),
        escaped(&view.name),
        view.rms_px,
        meter(view.rms_px / worst),
        counted(view.corners.len(), "corner"),
        stands.distance_mm
    )
}

/// A row of the table; `worst` is the largest RMS of any view, px, and `note` follows the name.
fn row(
    report: &Report,
    camera: usize,
    view: &ViewEstimate,
    stands: &SurveyedView,
    worst: f64,
    shown: Shown,
    note: &str,
) -> String {
    let tilt = stands.tilt_rad.map_or("–".to_owned(), |t| format!("{:.0}°", t.to_degrees()));
    let outliers = view.outlier_count();
    format!(
        "<tr><td>{}</td><td class=\"name\">{}{note}</td><td class=\"number\">{}</td>\
         <td class=\"number\">{:.4}{}</td>\
         <td class=\"number{}\">{outliers}</td><td class=\"number\">{tilt}</td>\
         <td class=\"number\">{:.0}</td></tr>",
        picture(report, camera, view, shown),
        escaped(&view.name),
        view.corners.len(),
        view.rms_px,
        meter(view.rms_px / worst),
        if outliers > 0 { " out" } else { "" },
        stands.distance_mm
    )
}

/// Where the image of a view is shown. An image that is shown twice is embedded once.
enum Shown {
    /// Only in the table.
    Only,
    /// In a card, with an id for its image, and residuals enlarged by a factor.
    First { id: String, enlarged: f64 },
    /// In the table, reusing the image of the card with this id.
    Again(String),
}

/// Id of the image in the card of a view, by the indices of camera and view.
fn id(camera: usize, of_view: usize) -> String {
    format!("picture-{camera}-{of_view}")
}

/// The thumbnail of a view with its corners and their enlarged residuals; only corners and residuals if there is no
/// thumbnail.
fn picture(report: &Report, index: usize, view: &ViewEstimate, shown: Shown) -> String {
    let camera = &report.estimate.cameras[index].camera;
    let (width, height) = (camera.width, camera.height);
    let unit = f64::from(width) / 240.0;
    let mut drawn = String::new();
    for corner in &view.corners {
        let (x, y) = corner.pixel.into();
        let class = if corner.outlier { "out" } else { "seen" };
        match shown {
            Shown::First { enlarged, .. } => {
                let to = corner.pixel + enlarged * corner.residual;
                let _ = write!(
                    drawn,
                    "<path class=\"{class}-arrow\" stroke-width=\"{:.1}\" d=\"M{x:.0} {y:.0}L{:.0} {:.0}\"/>\
                     <circle class=\"{class}\" cx=\"{x:.0}\" cy=\"{y:.0}\" r=\"{:.1}\"/>",
                    1.1 * unit,
                    to.x,
                    to.y,
                    0.9 * unit
                );
            }
            Shown::Only | Shown::Again(_) => {
                let _ = write!(
                    drawn,
                    "<circle class=\"{class}\" cx=\"{x:.0}\" cy=\"{y:.0}\" r=\"{:.1}\"/>",
                    1.5 * unit
                );
            }
        }
    }
    let image =
        report.thumbnails.get(&(index, view.name.clone())).map_or(
            String::new(),
            |png| match &shown {
                Shown::Again(id) => format!("<use href=\"#{id}\"/>"),
                Shown::Only | Shown::First { .. } => {
                    let id = match &shown {
                        Shown::First { id, .. } => format!(" id=\"{id}\""),
                        _ => String::new(),
                    };
                    let url = data_url(png);
                    format!("<image{id} href=\"{url}\" width=\"{width}\" height=\"{height}\"/>")
                }
            },
        );
    format!(
        "<svg class=\"picture\" role=\"img\" aria-label=\"corners of the view\" viewBox=\"0 0 {width} {height}\">{image}\
         {drawn}</svg>"
    )
}
