//! The views of a camera in a table, with small pictures.

use super::page::{self, data_url, escaped, meter, out_row};
use super::{Report, Survey, SurveyedView};
use deltille_core::calibrate::{Excluded, ViewEstimate};
use deltille_core::words::counted;

/// Views in the table: all, or where there are more the worst ones.
pub(super) const MOST_VIEWS: usize = 300;

/// Views that are shown at once, the others unfold.
const UNFOLDED: usize = 12;

/// The views, the worst first, most of them folded.
pub(super) fn section(report: &Report, index: usize, survey: &Survey) -> String {
    let camera = &report.estimate.cameras[index];
    let mut order: Vec<usize> = (0..camera.views.len()).collect();
    let all = order.len();
    let rms = |index: usize| camera.views[index].rms_px;
    order.sort_by(|&a, &b| rms(b).total_cmp(&rms(a)));
    order.truncate(MOST_VIEWS);
    let held_out = report.held_out(index).map(|held_out| (held_out, Survey::new(held_out)));
    let of_test =
        held_out.iter().flat_map(|(held_out, survey)| held_out.views.iter().zip(&survey.views));
    let of_test: Vec<(&ViewEstimate, &SurveyedView)> = of_test.collect();
    let every = camera.views.iter().chain(of_test.iter().map(|(view, _)| *view));
    let worst = every.map(|view| view.rms_px).fold(f64::MIN_POSITIVE, f64::max);
    let rows = order.into_iter().map(|of_view| {
        row(report, index, &camera.views[of_view], &survey.views[of_view], worst, "")
    });
    let mut rows: Vec<String> = rows.collect();
    for (view, stands) in of_test {
        rows.push(row(report, index, view, stands, worst, " (held out)"));
    }
    let is_here = |out: &&Excluded| match &out.camera {
        Some(name) => *name == camera.name,
        None => !report.is_rig(),
    };
    let excluded = report.estimate.excluded.iter().filter(is_here);
    let excluded = excluded.map(|out| format!("<tr><td></td>{}", out_row(out, 5)));
    let excluded: String = excluded.collect();
    let note = match all > MOST_VIEWS {
        true => format!("<p>The worst {MOST_VIEWS} of {all} views.</p>"),
        false => String::new(),
    };
    let folded = rows.split_off(rows.len().min(UNFOLDED));
    let folded = match folded.len() {
        0 => String::new(),
        n => format!(
            "<details><summary>{} that fit better</summary>{}</details>",
            counted(n, "view"),
            table_of_views(&folded.concat())
        ),
    };
    let table = table_of_views(&(excluded + &rows.concat()));
    page::section("Views, the worst first", &(note + &table + &folded))
}

fn table_of_views(rows: &str) -> String {
    format!(
        "<div class=\"wide-table\"><table class=\"plain views\"><tr><th></th><th>view</th><th>corners</th><th>rms, px</th>\
         <th>outliers</th><th>tilt</th><th>distance, mm</th></tr>{rows}</table></div>"
    )
}

/// A view in the table; `worst` is the largest rms in it, px.
fn row(
    report: &Report,
    camera: usize,
    view: &ViewEstimate,
    stands: &SurveyedView,
    worst: f64,
    note: &str,
) -> String {
    let tilt = stands.tilt_rad.map_or("–".to_owned(), |t| format!("{:.0}°", t.to_degrees()));
    let outliers = view.outlier_count();
    format!(
        "<tr><td>{}</td><td class=\"name\">{}{note}</td><td class=\"number\">{}</td>\
         <td class=\"number\">{:.4}{}</td>\
         <td class=\"number{}\">{outliers}</td><td class=\"number\">{tilt}</td>\
         <td class=\"number\">{:.0}</td></tr>",
        picture(report, camera, view),
        escaped(&view.name),
        view.corners.len(),
        view.rms_px,
        meter(view.rms_px / worst),
        if outliers > 0 { " out" } else { "" },
        stands.distance_mm
    )
}

/// The small picture of a view with its corners; these alone where there is no picture.
fn picture(report: &Report, index: usize, view: &ViewEstimate) -> String {
    let camera = &report.estimate.cameras[index].camera;
    let (width, height) = (camera.width, camera.height);
    let dots = view.corners.iter().map(|corner| {
        let class = if corner.outlier { "out" } else { "seen" };
        let (x, y) = corner.pixel.into();
        format!("<circle class=\"{class}\" cx=\"{x:.0}\" cy=\"{y:.0}\" r=\"{}\"/>", width / 160)
    });
    let image = report.thumbnails.get(&(index, view.name.clone())).map_or(String::new(), |png| {
        let url = data_url(png);
        format!("<image href=\"{url}\" width=\"{width}\" height=\"{height}\"/>")
    });
    format!(
        "<svg class=\"picture\" role=\"img\" aria-label=\"corners of the view\" viewBox=\"0 0 {width} {height}\">{image}{}</svg>",
        dots.collect::<String>()
    )
}

