//! The page itself.

use std::fmt::Write as _;

use base64::Engine as _;

use super::{
    Advice, Report, Survey, SurveyedView, Weight, advice, field, plots, rig, scene, target_map,
};
use deltille_core::calibrate::{
    CameraEstimate, Diagnosis, Excluded, Parameter, Source, TargetMap, ViewEstimate,
};
use deltille_core::camera::{Lens, SplineGrid};
use deltille_core::words::{counted, places};

/// Views in the table: all, or where there are more the worst ones.
pub(super) const MOST_VIEWS: usize = 300;

/// Views that are shown at once, the others unfold.
const UNFOLDED: usize = 12;

/// Correlations from here on are drawn in a blue on which white is read better than ink.
const STRONG: f64 = 0.85;

const STYLE: &str = include_str!("page.css");

pub(super) fn html(report: &Report) -> String {
    let cameras = &report.estimate.cameras;
    let surveys: Vec<Survey> = cameras.iter().map(Survey::new).collect();
    let title = escaped(report.title);
    let mut page = format!(
        "<!DOCTYPE html>\n<!-- deltille {} -->\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title} – camera calibration</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <header><h1>{title}</h1>{}</header>\n",
        env!("CARGO_PKG_VERSION"),
        match cameras.as_slice() {
            [only] => figures(&of_camera(report, 0, only)),
            _ => figures(&of_rig(report)),
        }
    );
    let advice = advice(report, &surveys);
    page += &verdict(report, &advice);
    page += "<section><h2>What to make of it</h2><ul class=\"advice\">";
    for piece in advice {
        let (class, sign) = match piece.weight {
            Weight::Good => ("good", "✓"),
            Weight::Hint => ("hint", "→"),
            Weight::Warning => ("warning", "!"),
        };
        let _ = write!(
            page,
            "<li class=\"{class}\"><span class=\"sign\">{sign}</span>{}</li>",
            escaped(&piece.text)
        );
    }
    page += "</ul></section>\n";
    if report.is_rig() {
        page += &rig::places(report);
    }
    page += &rig::targets(report);
    page += &in_space(report);
    page += &rig::panels(report);
    page += &report.estimate.map.as_ref().map_or(String::new(), target);
    for (index, (camera, survey)) in cameras.iter().zip(&surveys).enumerate() {
        if report.is_rig() {
            let figures = figures(&of_camera(report, index, camera));
            let _ = write!(page, "<h2 class=\"camera\">{}</h2>{figures}", escaped(&camera.name));
        }
        page += &parameters(camera);
        page += &uncertainty(camera);
        page += &drawings(camera, survey);
        page += &views(report, index, survey);
    }
    if report.is_rig() {
        page += &rig::frames(report);
    }
    let _ = write!(
        page,
        "<footer>deltille {}. Residuals are seen less predicted positions; rms is per coordinate, \
         √(Σ(dx² + dy²) / 2N). Standard deviations are scaled by the residuals.</footer>\n</body>\n\
         </html>\n",
        env!("CARGO_PKG_VERSION")
    );
    page
}

/// Cameras and targets in space.
fn in_space(report: &Report) -> String {
    let svg = scene::drawing(report.estimate);
    if svg.is_empty() {
        return String::new();
    }
    let what = match report.is_rig() {
        true => "The cameras, and where they saw the target",
        false => "The camera, and where it saw the target",
    };
    format!(
        "<section><h2>In space</h2><figure class=\"wide\">{svg}<figcaption>{what}, as far as corners were found; the view that fits \
         worst is red. Seen from the side and above, without perspective.</figcaption></figure></section>\n"
    )
}

/// Good or bad, at a glance.
fn verdict(report: &Report, advice: &[Advice]) -> String {
    let warnings = advice.iter().filter(|piece| piece.weight == Weight::Warning).count();
    if report.diagnoses.iter().any(Diagnosis::is_failure) {
        return "<p class=\"verdict warning\">Not to be used: see why below.</p>\n".to_owned();
    }
    let (class, text) = if warnings > 0 {
        let text = format!("To be used with care: {} below.", counted(warnings, "warning"));
        ("hint", text)
    } else {
        ("good", "Good: nothing speaks against it.".to_owned())
    };
    format!("<p class=\"verdict {class}\">{text}{}</p>\n", sureness(report))
}

/// How sure the projections of a single camera are.
fn sureness(report: &Report) -> String {
    let [camera] = report.estimate.cameras.as_slice() else { return String::new() };
    let distance = camera.projection.as_ref().and_then(|known| known.distances_mm.first().copied());
    let known = distance.and_then(|mm| {
        let sd = |source| camera.projection_sd_px(Some(mm), source);
        Some((mm, sd(Source::Observed).or_else(|| sd(Source::Noise))?))
    });
    known.map_or(String::new(), |(mm, sd)| {
        format!(" Where corners were, points {mm:.0} mm away are projected to ± {sd:.3} px.")
    })
}

/// A figure and what it is.
type Figure = (String, &'static str);

/// The figures of a camera that are looked for first.
fn of_camera(report: &Report, index: usize, found: &CameraEstimate) -> Vec<Figure> {
    let camera = &found.camera;
    let model = found.model.map_or("fixed".to_owned(), |model| model.to_string());
    let mut cells = vec![
        (format!("{:.4} px", found.rms_px), "rms of a coordinate"),
        (escaped(&model), "model"),
        (format!("{} × {}", camera.width, camera.height), "image, px"),
        (found.views.len().to_string(), "views"),
        (found.corner_count().to_string(), "corners"),
    ];
    if found.outlier_count() > 0 {
        cells.insert(1, (format!("{:.4} px", found.inlier_rms_px()), "rms without outliers"));
    }
    if let Some(held_out) = report.held_out(index) {
        let name = "rms on views held out";
        cells.insert(1, (format!("{:.4} px", held_out.rms_px), name));
    }
    cells.extend(of_print(report).filter(|_| !report.is_rig()));
    cells
}

/// The same of all cameras together.
fn of_rig(report: &Report) -> Vec<Figure> {
    let found = report.estimate;
    let mut cells = vec![
        (format!("{:.4} px", found.rms_px), "rms of a coordinate"),
        (found.cameras.len().to_string(), "cameras"),
        (found.frames.len().to_string(), "frames"),
        (found.corner_count().to_string(), "corners"),
    ];
    if found.outlier_count() > 0 {
        cells.insert(1, (format!("{:.4} px", found.inlier_rms_px()), "rms without outliers"));
    }
    if let Some(held_out) = &found.held_out {
        cells.insert(1, (format!("{:.4} px", held_out.rms_px), "rms on frames held out"));
    }
    cells.extend(of_print(report));
    cells
}

fn of_print(report: &Report) -> Option<Figure> {
    let (um, deviation) = report.print.ink.and_then(|ink| ink.um.zip(ink.um_deviation))?;
    let (um, deviation) = rounded(um, Some(deviation));
    Some((format!("{um} ± {deviation} µm"), "ink spread"))
}

fn figures(cells: &[Figure]) -> String {
    let cells = cells.iter().map(|(value, name)| format!("<div><b>{value}</b>{name}</div>"));
    format!("<div class=\"figures\">{}</div>", cells.collect::<String>())
}

/// What took no part, over so many columns beside its name.
pub(super) fn out_row(out: &Excluded, columns: usize) -> String {
    format!(
        "<td class=\"name\">{}</td><td colspan=\"{columns}\" class=\"out\">left out: {}</td></tr>",
        escaped(&out.view),
        escaped(&out.reason.to_string())
    )
}

fn parameters(camera: &CameraEstimate) -> String {
    if let Lens::Spline(spline) = &camera.camera.lens {
        let SplineGrid { degree, columns, rows, fov_x_deg } = spline.grid();
        return format!(
            "<p>The lens is a spline of degree {degree} with {columns} × {rows} knots over {fov_x_deg}° across. \
             Single knots mean nothing by themselves: see how sure projections are.</p>"
        );
    }
    let mut rows = String::new();
    let told = |(p, _): &(&Parameter, Option<f64>)| p.sd.is_some() || p.value != 0.0;
    let is_observed = camera.covariance_from(Source::Observed).is_some();
    for (parameter, observed) in camera.parameters.iter().zip(camera.observed_sd()).filter(told) {
        let (value, sd) = rounded(parameter.value, parameter.sd);
        let observed = match (is_observed, observed) {
            (false, _) => String::new(),
            (true, None) => "<td></td>".to_owned(),
            (true, Some(_)) => {
                format!("<td class=\"number\">{}</td>", rounded(parameter.value, observed).1)
            }
        };
        let _ = write!(
            rows,
            "<tr><td>{}</td><td class=\"number\">{value}</td><td class=\"number\">{sd}</td>{observed}</tr>",
            escaped(&parameter.name)
        );
    }
    let heads = match is_observed {
        true => "<th>± from noise</th><th>± observed</th>",
        false => "<th>± from noise</th>",
    };
    let names: Vec<&str> = camera.found().collect();
    let mut matrix = String::new();
    if !names.is_empty() {
        let heads = names.iter().map(|name| format!("<th>{}</th>", escaped(name)));
        let _ = write!(matrix, "<tr><th></th>{}</tr>", heads.collect::<String>());
        for (i, name) in names.iter().enumerate() {
            let cells = (0..names.len()).map(|j| {
                let c = camera.correlation(i, j);
                let hue = if c < 0.0 { "var(--below)" } else { "var(--above)" };
                // Ink is hard to read on the full blue.
                let strong = if c > STRONG { " class=\"strong\"" } else { "" };
                let share = (100.0 * c.abs()).round();
                format!(
                    "<td{strong} style=\"background:color-mix(in srgb,{hue} {share}%,transparent)\">{}</td>",
                    format!("{c:.2}").replace('-', "−")
                )
            });
            let _ =
                write!(matrix, "<tr><th>{}</th>{}</tr>", escaped(name), cells.collect::<String>());
        }
        matrix = format!(
            "<figure><table class=\"matrix\">{matrix}</table><figcaption>Correlations. Parameters \
             that are strongly correlated are known only together.</figcaption></figure>"
        );
    }
    format!(
        "<section><h2>Parameters</h2><div class=\"row\"><table class=\"plain\"><tr><th>name</th>\
         <th>value</th>{heads}</tr>{rows}</table>{matrix}</div></section>\n"
    )
}

/// A value with two digits of its deviation, and the deviation.
pub(super) fn rounded(value: f64, sd: Option<f64>) -> (String, String) {
    let sign = |text: String| text.replace('-', "−");
    match sd {
        Some(sd) if sd > 0.0 && sd.is_finite() => {
            let places = places(sd);
            // Nothing but zeros has no sign.
            let value = if 2.0 * value.abs() < 0.1_f64.powi(places as i32) { 0.0 } else { value };
            (sign(format!("{value:.places$}")), format!("{sd:.places$}"))
        }
        _ => (sign(value.to_string()), "kept".to_owned()),
    }
}

fn drawings(camera: &CameraEstimate, survey: &Survey) -> String {
    let (arrows, scale) = plots::residual_map(survey);
    let mut figures = vec![
        (
            arrows,
            format!(
                "Mean residual of each part of the image, {scale} times enlarged; pale where chance \
                 explains it."
            ),
        ),
        (plots::coverage(survey), "Corners in each part of the image.".to_owned()),
        (
            plots::scatter(camera),
            "Residuals of all corners; a round cloud is noise, anything else is not. Rings on the rim \
             lie beyond it."
                .to_owned(),
        ),
        (
            plots::histogram(camera),
            "Residuals of both coordinates, and the normal distribution of the same deviation."
                .to_owned(),
        ),
        (
            plots::against_radius(camera),
            "Errors of corners, and the rms of rings per coordinate. It should be level. Circles on \
             the rim lie beyond it."
                .to_owned(),
        ),
    ];
    if let Some(tilt) = plots::against_tilt(camera, survey) {
        figures
            .push((tilt, "The rms of each view. Steep views are blurred and coarse.".to_owned()));
    }
    let figures = figures
        .into_iter()
        .map(|(svg, caption)| format!("<figure>{svg}<figcaption>{caption}</figcaption></figure>"));
    format!(
        "<section><h2>Residuals and coverage</h2><div class=\"row\">{}</div></section>\n",
        figures.collect::<String>()
    )
}

/// How sure the camera is over its image.
fn uncertainty(camera: &CameraEstimate) -> String {
    let maps = camera.uncertainty_maps();
    if maps.is_empty() {
        return String::new();
    }
    let drawn = maps.iter().map(|map| {
        let (svg, caption) = (field::uncertainty(camera, map, ""), field::caption(map));
        format!("<figure>{svg}<figcaption>{caption}</figcaption></figure>")
    });
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
    format!(
        "<section><h2>How sure projections are</h2><p>Standard deviation of a coordinate where corners were, \
         after the motion of the camera that explains the corners best.</p><table class=\"plain\"><tr>\
         <th>distance</th><th>deviation</th><th>px</th></tr>{}</table><div class=\"row\">{}</div></section>\n",
        told.collect::<String>(),
        drawn.collect::<String>()
    )
}

/// The corners of the target that was measured.
fn target(map: &TargetMap) -> String {
    let [plane, out] = map.rms_mm();
    let figures = figures(&[
        (format!("{plane:.3} mm"), "in the plane, rms of a coordinate"),
        (format!("{out:.3} mm"), "out of the plane, rms"),
        (format!("{} of {}", map.significant().count(), map.corners().len()), "more than chance"),
    ]);
    let svg = target_map::drawing(map, "");
    format!(
        "<section><h2>The target, measured</h2>{figures}<figure>{svg}<figcaption>Where the corners are, \
         against the plan. Moves and turns of the target and its scale are not in it: poses and distances take \
         them up.</figcaption></figure></section>\n"
    )
}

fn views(report: &Report, index: usize, survey: &Survey) -> String {
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
    format!("<section><h2>Views, the worst first</h2>{note}{table}{folded}</section>\n")
}

fn table_of_views(rows: &str) -> String {
    format!(
        "<table class=\"plain views\"><tr><th></th><th>view</th><th>corners</th><th>rms, px</th>\
         <th>outliers</th><th>tilt</th><th>distance, mm</th></tr>{rows}</table>"
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
         <td class=\"number\">{:.4}<div class=\"meter\" style=\"width:{:.0}%\"></div></td>\
         <td class=\"number{}\">{outliers}</td><td class=\"number\">{tilt}</td>\
         <td class=\"number\">{:.0}</td></tr>",
        picture(report, camera, view),
        escaped(&view.name),
        view.corners.len(),
        view.rms_px,
        100.0 * view.rms_px / worst,
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
        let data = base64::engine::general_purpose::STANDARD.encode(png);
        format!(
            "<image href=\"data:image/png;base64,{data}\" width=\"{width}\" height=\"{height}\"/>"
        )
    });
    format!(
        "<svg class=\"picture\" viewBox=\"0 0 {width} {height}\">{image}{}</svg>",
        dots.collect::<String>()
    )
}

/// A text as it stands in HTML.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
