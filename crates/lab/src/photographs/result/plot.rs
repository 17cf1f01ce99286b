//! The plot of the experiment: a row per axis, and columns for recall, error, normalized error and time.

use glam::DVec2;

use super::table::Row;
use crate::photographs::axes::Axis;
use crate::plot::{line, page, write};

/// Size of a panel's axes and the space around it, in user units.
const PANEL: DVec2 = DVec2::new(250.0, 130.0);
const MARGIN: DVec2 = DVec2::new(72.0, 88.0);
const HEAD: f64 = 50.0;

/// Colours of the subjects, in order.
const COLOURS: [&str; 6] = ["#d94801", "#fdae6b", "#08519c", "#6baed6", "#238b45", "#756bb1"];

/// The quantity of a column.
struct Column {
    label: &'static str,
    /// Lowest and highest value; the scale is logarithmic unless the lowest is 0.
    range: [f64; 2],
    /// Values of the horizontal guide lines.
    guides: &'static [f64],
    value: fn(&Row) -> Option<f64>,
    /// A second value, drawn dashed.
    other: Option<fn(&Row) -> Option<f64>>,
}

const COLUMNS: [Column; 4] = [
    Column {
        label: "recall (dashed: found), %",
        range: [0.0, 100.0],
        guides: &[0.0, 25.0, 50.0, 75.0, 100.0],
        value: |row| Some(100.0 * row.recall),
        other: Some(|row| Some(100.0 * row.found)),
    },
    Column {
        label: "error, rms (dashed: p95), px",
        range: [0.002, 1.0],
        guides: &[0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0],
        value: |row| row.rms_px,
        other: Some(|row| row.p95_px),
    },
    Column {
        label: "error squared over variance",
        range: [0.1, 100.0],
        guides: &[0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0],
        value: |row| row.normalised,
        other: None,
    },
    Column {
        label: "time, ms",
        range: [1.0, 10_000.0],
        guides: &[1.0, 10.0, 100.0, 1000.0, 10_000.0],
        value: |row| Some(row.time_ms),
        other: None,
    },
];

/// Draws the plot as SVG.
pub fn svg(rows: &[Row]) -> String {
    let mut subjects: Vec<&str> = Vec::new();
    for row in rows {
        if !subjects.contains(&row.subject.as_str()) {
            subjects.push(&row.subject);
        }
    }
    let axes: Vec<Axis> = Axis::ALL
        .into_iter()
        .filter(|axis| rows.iter().any(|row| row.axis == axis.name()))
        .collect();
    let pitch = PANEL + MARGIN;
    let size =
        DVec2::new(COLUMNS.len() as f64 * pitch.x + 20.0, HEAD + axes.len() as f64 * pitch.y);
    let mut body = String::new();
    let mut at = DVec2::new(MARGIN.x, 18.0);
    for (subject, colour) in subjects.iter().zip(COLOURS.iter().cycle()) {
        line(&mut body, &[at, at + DVec2::X * 34.0], colour, 2.5, "");
        at.x += 42.0 + write(&mut body, subject, at + DVec2::new(42.0, 5.0), 0.0) + 30.0;
    }
    for (j, &axis) in axes.iter().enumerate() {
        for (i, column) in COLUMNS.iter().enumerate() {
            let origin = DVec2::new(MARGIN.x, HEAD) + DVec2::new(i as f64, j as f64) * pitch;
            let of = |subject: &str| -> Vec<&Row> {
                let wanted = |row: &&Row| row.axis == axis.name() && row.subject == subject;
                rows.iter().filter(wanted).collect()
            };
            let curves: Vec<(Vec<&Row>, &str)> =
                subjects.iter().zip(COLOURS.iter().cycle()).map(|(s, c)| (of(s), *c)).collect();
            panel(&mut body, origin, axis, column, &curves);
        }
    }
    page(size, &body)
}

fn panel(
    body: &mut String,
    origin: DVec2,
    axis: Axis,
    column: &Column,
    curves: &[(Vec<&Row>, &str)],
) {
    let left = origin.x;
    let DVec2 { x: right, y: bottom } = origin + PANEL;
    let [low, high] = column.range;
    let y = |value: f64| {
        let part = match low == 0.0 {
            true => value / high,
            false => (value.max(low) / low).ln() / (high / low).ln(),
        };
        bottom - part.clamp(0.0, 1.0) * PANEL.y
    };
    for &guide in column.guides {
        let ends = [left, right].map(|x| DVec2::new(x, y(guide)));
        line(body, &ends, "#cccccc", 0.8, "");
        write(body, &format!("{guide}"), ends[0] + DVec2::new(-8.0, 5.0), 1.0);
    }
    // Levels are evenly spaced, because some are not numbers and the numbers are rarely equidistant.
    let levels = axis.levels();
    let step = PANEL.x / levels.len() as f64;
    let x = |index: usize| left + (index as f64 + 0.5) * step;
    for (index, level) in levels.iter().enumerate() {
        let foot = DVec2::new(x(index), bottom);
        line(body, &[foot, foot + DVec2::Y * 4.0], "#444444", 1.0, "");
        // Long names would touch.
        let lower = if levels.len() > 6 && index % 2 == 1 { 13.0 } else { 0.0 };
        write(body, &level.name, foot + DVec2::Y * (17.0 + lower), 0.5);
    }
    let corner = DVec2::new(left, bottom);
    line(body, &[origin, corner, origin + PANEL], "#444444", 1.2, "");
    write(body, column.label, origin - DVec2::new(40.0, 9.0), 0.0);
    write(body, axis.label(), corner + DVec2::new(0.5 * PANEL.x, 48.0), 0.5);
    for (rows, colour) in curves {
        let mut curve = |value: fn(&Row) -> Option<f64>, width: f64, dash: &str| {
            let at = |row: &&Row| {
                let index = levels.iter().position(|level| level.name == row.level)?;
                Some(DVec2::new(x(index), y(value(row)?)))
            };
            let points: Vec<DVec2> = rows.iter().filter_map(at).collect();
            line(body, &points, colour, width, dash);
        };
        curve(column.value, 2.2, "");
        if let Some(other) = column.other {
            curve(other, 1.2, "5 3");
        }
    }
}
