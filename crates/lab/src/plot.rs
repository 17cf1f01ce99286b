//! The plot of the corner experiment: a row of panels per kind, a column per sweep, errors on a logarithmic scale. Text
//! is drawn as outlines, so the plot looks the same everywhere.

use std::fmt::Write as _;

use glam::DVec2;
use kurbo::Affine;

use super::corners::{METHODS, Method, Row, Sweep, name};
use deltille::artwork::text;
use deltille::export::GENERATOR;
use deltille::export::kind::signed_png;
use deltille::lattice::GridKind;

/// Size of a panel's axes and the space around it, in user units.
const PANEL: DVec2 = DVec2::new(300.0, 230.0);
const MARGIN: DVec2 = DVec2::new(70.0, 78.0);
const HEAD: f64 = 56.0;

/// Range of the vertical axis, px.
const ERRORS_PX: [f64; 2] = [0.002, 0.1];

/// Errors at which guide lines are drawn, px.
const GUIDES_PX: [f64; 6] = [0.002, 0.005, 0.01, 0.02, 0.05, 0.1];

const BOUND_COLOUR: &str = "#000000";

fn colour(method: Method) -> &'static str {
    match method {
        Method::Polynomial(1) => "#9ecae1",
        Method::Polynomial(2) => "#4292c6",
        Method::Polynomial(_) => "#08519c",
        Method::Model => "#d94801",
        Method::ModelWithTone => "#238b45",
    }
}

/// Draws the plot as SVG.
pub fn svg(rows: &[Row]) -> String {
    let pitch = PANEL + MARGIN;
    let size = DVec2::new(Sweep::ALL.len() as f64 * pitch.x + 20.0, HEAD + 2.0 * pitch.y + 4.0);
    let mut body = String::new();
    legend(&mut body);
    for (j, kind) in [GridKind::Deltille, GridKind::Checker].into_iter().enumerate() {
        for (i, sweep) in Sweep::ALL.into_iter().enumerate() {
            let origin = DVec2::new(MARGIN.x, HEAD) + DVec2::new(i as f64, j as f64) * pitch;
            let rows: Vec<&Row> =
                rows.iter().filter(|row| row.kind == kind && row.sweep == sweep).collect();
            panel(&mut body, origin, kind, sweep, &rows);
        }
    }
    page(size, &body)
}

/// Places shapes on a white page.
pub(super) fn page(DVec2 { x: width, y: height }: DVec2, body: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\">\n<!-- {} -->\n<rect width=\"100%\" height=\"100%\" \
         fill=\"#fff\"/>\n{body}</svg>\n",
        GENERATOR
    )
}

/// Converts a plot made by [`svg()`] to PNG at twice its size; `None` if the text is not such a plot.
pub fn png(svg: &str) -> Option<Vec<u8>> {
    const SCALE: f32 = 2.0;
    let tree = resvg::usvg::Tree::from_str(svg, &resvg::usvg::Options::default()).ok()?;
    let size = tree.size().to_int_size().scale_by(SCALE)?;
    let mut pixmap = resvg::tiny_skia::Pixmap::new(size.width(), size.height())?;
    let scale = resvg::tiny_skia::Transform::from_scale(SCALE, SCALE);
    resvg::render(&tree, scale, &mut pixmap.as_mut());
    pixmap.encode_png().ok().map(signed_png)
}

fn legend(body: &mut String) {
    let mut at = DVec2::new(MARGIN.x, 20.0);
    let entries = METHODS.iter().map(|&m| (m.name(), colour(m), ""));
    for (label, colour, dash) in
        entries.chain([("Cramer–Rao bound".to_owned(), BOUND_COLOUR, "6 4")])
    {
        line(body, &[at, at + DVec2::X * 34.0], colour, 2.5, dash);
        at.x += 42.0 + write(body, &label, at + DVec2::new(42.0, 5.0), 0.0) + 30.0;
    }
}

fn panel(body: &mut String, origin: DVec2, kind: GridKind, sweep: Sweep, rows: &[&Row]) {
    let DVec2 { x: left, y: top } = origin;
    let DVec2 { x: right, y: bottom } = origin + PANEL;
    let [low, high] = ERRORS_PX.map(f64::ln);
    let last = sweep.values().last().copied().unwrap_or(1.0);
    let x = |value: f64| left + value / last * PANEL.x;
    let y = |error: f64| {
        let part = (error.max(ERRORS_PX[0]).ln() - low) / (high - low);
        top + (1.0 - part.clamp(0.0, 1.0)) * PANEL.y
    };
    for guide in GUIDES_PX {
        let ends = [left, right].map(|x| DVec2::new(x, y(guide)));
        line(body, &ends, "#cccccc", 0.8, "");
        write(body, &format!("{guide}"), ends[0] + DVec2::new(-8.0, 5.0), 1.0);
    }
    let step = match sweep {
        Sweep::Tilt => 15.0,
        Sweep::Blur | Sweep::Noise => 1.0,
        Sweep::Tone => 0.5,
    };
    for tick in (0..).map(|n| f64::from(n) * step).take_while(|&tick| tick <= last) {
        let foot = DVec2::new(x(tick), bottom);
        line(body, &[foot, foot + DVec2::Y * 5.0], "#444444", 1.0, "");
        write(body, &format!("{tick}"), foot + DVec2::Y * 19.0, 0.5);
    }
    let corner = DVec2::new(left, bottom);
    line(body, &[origin, corner, origin + PANEL], "#444444", 1.2, "");
    let axis = match sweep {
        Sweep::Blur => "blur, px",
        Sweep::Noise => "noise, percent",
        Sweep::Tilt => "tilt, °",
        Sweep::Tone => "gamma of the tone curve",
    };
    write(body, axis, corner + DVec2::new(PANEL.x / 2.0, 38.0), 0.5);
    write(body, &format!("{}: mean error, px", name(kind)), origin - DVec2::Y * 8.0, 0.0);
    let of = |method| rows.iter().filter(move |row| row.method == method);
    for method in METHODS {
        let points: Vec<DVec2> =
            of(method).map(|row| DVec2::new(x(row.value), y(row.error_px[0]))).collect();
        line(body, &points, colour(method), 2.2, "");
    }
    let bound: Vec<DVec2> =
        of(Method::Model).map(|row| DVec2::new(x(row.value), y(row.bound_px))).collect();
    line(body, &bound, BOUND_COLOUR, 1.6, "6 4");
}

/// Draws a line through points, in user units.
pub(super) fn line(body: &mut String, points: &[DVec2], colour: &str, width: f64, dash: &str) {
    let places: Vec<String> = points
        .iter()
        .filter(|point| point.y.is_finite())
        .map(|point| format!("{:.1},{:.1}", point.x, point.y))
        .collect();
    // Writing to a String cannot fail.
    let _ = writeln!(
        body,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" \
         stroke-dasharray=\"{dash}\" stroke-linejoin=\"round\"/>",
        places.join(" ")
    );
}

/// Writes text at a position; `anchor` selects the part of the text that lies there (0 start, 1 end). Returns its
/// width.
pub(super) fn write(body: &mut String, label: &str, DVec2 { x, y }: DVec2, anchor: f64) -> f64 {
    const SIZE: f64 = 14.0;
    let Ok((path, width)) = text::outline(label, SIZE) else { return 0.0 };
    let placed = Affine::new([1.0, 0.0, 0.0, -1.0, x - anchor * width, y]) * path;
    let _ = writeln!(body, "<path d=\"{}\" fill=\"#222222\"/>", placed.to_svg());
    width
}
