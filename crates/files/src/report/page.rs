//! The page itself.

use std::fmt::Write as _;

use base64::Engine as _;

use super::{Report, Survey, SurveyedView, Weight, advice, plots};
use deltille_core::calibrate::{Parameter, Solution, ViewSolution};

/// Views in the table: all, or where there are more the worst ones.
const MOST_VIEWS: usize = 300;

/// Correlations from here on are drawn in a blue on which white is read better than ink.
const STRONG: f64 = 0.85;

const STYLE: &str = include_str!("page.css");

pub(super) fn html(report: &Report) -> String {
    let solution = report.solution;
    let survey = Survey::new(solution);
    let title = escaped(report.title);
    let mut page = format!(
        "<!DOCTYPE html>\n<!-- deltille {} -->\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title} – camera calibration</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <header><h1>{title}</h1>{}</header>\n",
        env!("CARGO_PKG_VERSION"),
        figures(report)
    );
    page += "<section><h2>What to make of it</h2><ul class=\"advice\">";
    for piece in advice(report, &survey) {
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
    page += &parameters(solution);
    page += &drawings(solution, &survey);
    page += &views(report, &survey);
    let _ = write!(
        page,
        "<footer>deltille {}. Residuals are seen less predicted positions; rms is per coordinate, \
         √(Σ(dx² + dy²) / 2N). Standard deviations are scaled by the residuals.</footer>\n</body>\n\
         </html>\n",
        env!("CARGO_PKG_VERSION")
    );
    page
}

/// The figures that are looked for first.
fn figures(report: &Report) -> String {
    let solution = report.solution;
    let camera = &solution.camera;
    let mut cells = vec![
        (format!("{:.4} px", solution.rms_px), "rms of a coordinate"),
        (escaped(report.model), "model"),
        (format!("{} × {}", camera.width, camera.height), "image, px"),
        (solution.views.len().to_string(), "views"),
        (solution.corner_count().to_string(), "corners"),
    ];
    if solution.outlier_count() > 0 {
        cells.insert(1, (format!("{:.4} px", solution.inlier_rms_px()), "rms without outliers"));
    }
    if let Some(holdout) = report.holdout {
        let name = "rms on views held out";
        cells.insert(1, (format!("{:.4} px", holdout.rms_px), name));
    }
    if let Some((um, deviation)) = report.print.ink.and_then(|ink| ink.um.zip(ink.um_deviation)) {
        cells.push((
            format!("{um:.1} ± {deviation:.1} µm").replace('-', "−"),
            "growth of what is dark",
        ));
    }
    let cells = cells.iter().map(|(value, name)| format!("<div><b>{value}</b>{name}</div>"));
    format!("<div class=\"figures\">{}</div>", cells.collect::<String>())
}

fn parameters(solution: &Solution) -> String {
    let mut rows = String::new();
    let told = |p: &&Parameter| p.sd.is_some() || p.value != 0.0;
    for parameter in solution.parameters.iter().filter(told) {
        let (value, sd) = rounded(parameter.value, parameter.sd);
        let _ = write!(
            rows,
            "<tr><td>{}</td><td class=\"number\">{value}</td><td class=\"number\">{sd}</td></tr>",
            escaped(&parameter.name)
        );
    }
    let names: Vec<&str> = solution.found().collect();
    let mut matrix = String::new();
    if !names.is_empty() {
        let heads = names.iter().map(|name| format!("<th>{}</th>", escaped(name)));
        let _ = write!(matrix, "<tr><th></th>{}</tr>", heads.collect::<String>());
        for (i, name) in names.iter().enumerate() {
            let cells = (0..names.len()).map(|j| {
                let c = solution.correlation(i, j);
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
         <th>value</th><th>± standard deviation</th></tr>{rows}</table>{matrix}</div></section>\n"
    )
}

/// A value with two digits of its deviation, and the deviation.
fn rounded(value: f64, sd: Option<f64>) -> (String, String) {
    let sign = |text: String| text.replace('-', "−");
    match sd {
        Some(sd) if sd > 0.0 && sd.is_finite() => {
            let digits = (1.0 - sd.log10().floor()).clamp(0.0, 12.0) as usize;
            (sign(format!("{value:.digits$}")), format!("{sd:.digits$}"))
        }
        _ => (sign(value.to_string()), "kept".to_owned()),
    }
}

fn drawings(solution: &Solution, survey: &Survey) -> String {
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
            plots::scatter(solution),
            "Residuals of all corners; a round cloud is noise, anything else is not. Rings on the rim \
             lie beyond it."
                .to_owned(),
        ),
        (
            plots::histogram(solution),
            "Residuals of both coordinates, and the normal distribution of the same deviation."
                .to_owned(),
        ),
        (
            plots::against_radius(solution),
            "Errors of corners, and the rms of rings per coordinate. It should be level. Circles on \
             the rim lie beyond it."
                .to_owned(),
        ),
    ];
    if let Some(tilt) = plots::against_tilt(solution, survey) {
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

fn views(report: &Report, survey: &Survey) -> String {
    let solution = report.solution;
    let mut order: Vec<usize> = (0..solution.views.len()).collect();
    let all = order.len();
    if all > MOST_VIEWS {
        let rms = |index: usize| solution.views[index].rms_px;
        order.sort_by(|&a, &b| rms(b).total_cmp(&rms(a)));
        order.truncate(MOST_VIEWS);
        order.sort_unstable();
    }
    let held_out = report.holdout.map(|holdout| (holdout, Survey::new(holdout)));
    let of_test =
        held_out.iter().flat_map(|(holdout, survey)| holdout.views.iter().zip(&survey.views));
    let of_test: Vec<(&ViewSolution, &SurveyedView)> = of_test.collect();
    let every = solution.views.iter().chain(of_test.iter().map(|(view, _)| *view));
    let worst = every.map(|view| view.rms_px).fold(f64::MIN_POSITIVE, f64::max);
    let mut rows = String::new();
    for index in order {
        rows += &row(report, &solution.views[index], &survey.views[index], worst, "");
    }
    for (view, stands) in of_test {
        rows += &row(report, view, stands, worst, " (held out)");
    }
    let excluded = solution.excluded.iter().map(|out| {
        format!(
            "<tr><td></td><td class=\"name\">{}</td><td colspan=\"5\" class=\"out\">left out: {}\
             </td></tr>",
            escaped(&out.view),
            escaped(&out.reason)
        )
    });
    let excluded: String = excluded.collect();
    let note = match all > MOST_VIEWS {
        true => format!("<p>The worst {MOST_VIEWS} of {all} views.</p>"),
        false => String::new(),
    };
    format!(
        "<section><h2>Views</h2>{note}<table class=\"plain views\"><tr><th></th><th>view</th>\
         <th>corners</th><th>rms, px</th><th>outliers</th><th>tilt</th><th>distance, mm</th></tr>\
         {rows}{excluded}</table></section>\n"
    )
}

/// A view in the table; `worst` is the largest rms in it, px.
fn row(
    report: &Report,
    view: &ViewSolution,
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
        picture(report, view),
        escaped(&view.name),
        view.corners.len(),
        view.rms_px,
        100.0 * view.rms_px / worst,
        if outliers > 0 { " out" } else { "" },
        stands.distance_mm
    )
}

/// The small picture of a view with its corners; these alone where there is no picture.
fn picture(report: &Report, view: &ViewSolution) -> String {
    let camera = &report.solution.camera;
    let (width, height) = (camera.width, camera.height);
    let dots = view.corners.iter().map(|corner| {
        let class = if corner.outlier { "out" } else { "seen" };
        let [x, y] = corner.pixel;
        format!("<circle class=\"{class}\" cx=\"{x:.0}\" cy=\"{y:.0}\" r=\"{}\"/>", width / 160)
    });
    let image = report.thumbnails.get(&view.name).map_or(String::new(), |png| {
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
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
