//! Table of the parameters of a camera, with standard deviations and correlations.

use std::fmt::Write as _;

use crate::report::html::{self, escaped};
use crate::report::sections::numbers::{aligned, rounded};
use deltille_calibrate::{CameraEstimate, Parameter, Source};
use deltille_core::camera::{Lens, SplineGrid};

/// Number of parameters above which correlations are in small print.
const FEW: usize = 12;

/// Correlation above which the cell is so blue that white text is more legible than dark text.
const STRONG: f64 = 0.85;

/// The section with the parameters, their standard deviations and their correlations.
pub(in crate::report) fn section(camera: &CameraEstimate) -> String {
    if let Lens::Spline(spline) = &camera.camera.lens {
        let SplineGrid { degree, columns, rows, fov_x_deg } = spline.grid();
        let text = format!(
            "<p>The lens is a spline of degree {degree} with {columns} × {rows} knots over a horizontal field of view of {fov_x_deg}°. \
             Individual knots have no physical meaning: see the projection uncertainty instead.</p>"
        );
        return html::section("Parameters", &text);
    }
    let is_shown = |(p, _): &(&Parameter, Option<f64>)| p.sd.is_some() || p.value != 0.0;
    let is_observed = camera.covariance_from(Source::Observed).is_some();
    let (mut names, mut columns) = (Vec::new(), [Vec::new(), Vec::new(), Vec::new()]);
    for (parameter, observed) in camera.parameters.iter().zip(camera.observed_sd()).filter(is_shown)
    {
        let (value, sd) = rounded(parameter.value, parameter.sd);
        let observed = observed.map(|_| rounded(parameter.value, observed).1);
        names.push(escaped(&parameter.name));
        for (column, text) in columns.iter_mut().zip([value, sd, observed.unwrap_or_default()]) {
            column.push(text);
        }
    }
    let columns = columns.map(|column| aligned(&column));
    let shown = if is_observed { &columns[..] } else { &columns[..2] };
    let rows = names.iter().enumerate().map(|(row, name)| {
        let cells = shown.iter().map(|column| column[row].as_str());
        format!("<tr><td>{name}</td>{}</tr>", cells.collect::<String>())
    });
    let rows: String = rows.collect();
    let heads = match is_observed {
        true => "<th>1σ from noise</th><th>1σ observed</th>",
        false => "<th>1σ from noise</th>",
    };
    let names: Vec<&str> = camera.estimated_parameters().collect();
    let mut matrix = String::new();
    if !names.is_empty() {
        let heads = names.iter().map(|name| format!("<th>{}</th>", escaped(name)));
        let _ = write!(matrix, "<tr><th></th>{}</tr>", heads.collect::<String>());
        for (i, name) in names.iter().enumerate() {
            let cells = (0..names.len()).map(|j| {
                let c = camera.correlation(i, j);
                let hue = if c < 0.0 { "var(--below)" } else { "var(--above)" };
                // Dark text is hard to read on full blue.
                let strong = if c > STRONG { " class=\"strong\"" } else { "" };
                let share = (100.0 * c.abs()).round();
                format!(
                    "<td{strong} style=\"background:color-mix(in srgb,{hue} {share}%,transparent)\">{}</td>",
                    // Avoids a negative zero.
                    format!("{:.2}", if c.abs() < 0.005 { 0.0 } else { c }).replace('-', "−")
                )
            });
            let _ =
                write!(matrix, "<tr><th>{}</th>{}</tr>", escaped(name), cells.collect::<String>());
        }
        let many = if names.len() > FEW { " many" } else { "" };
        matrix = format!(
            "<figure><div class=\"wide-table\"><table class=\"matrix{many}\">{matrix}</table></div><figcaption>Correlations. \
             Strongly correlated parameters are determined only in combination.</figcaption></figure>"
        );
    }
    let table = format!(
        "<div class=\"wide-table\"><table class=\"plain\"><tr><th>name</th><th>value</th>{heads}</tr>{rows}</table></div>"
    );
    let constrained = match camera.described_constraints() {
        Some(text) => format!("<p>Constraints: {}.</p>", escaped(&text)),
        None => String::new(),
    };
    html::section("Parameters", &format!("{constrained}<div class=\"plots\">{table}{matrix}</div>"))
}
