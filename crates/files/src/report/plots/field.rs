//! Maps over an image as SVG: colours for magnitudes, an outline around the region with corners, and arrows.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use glam::DVec2;

use crate::report::plots::axes::Axes;
use crate::report::plots::round_down::round_down;
use deltille_calibrate::{CameraEstimate, Comparison, Source, UncertaintyMap};
use deltille_core::statistics::quantile;

/// Height reserved for the scales below the map, user units.
const SCALES: f64 = 58.0;

/// Maximum width of a colour in the scale, user units.
const WIDEST: f64 = 46.0;

/// Limits between colours, px, in ascending order.
const LEVELS: [f64; 10] = [0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0];

/// The colours between these limits, from light (small) to dark. They remain distinguishable with red-green colour blindness.
pub(super) const COLOURS: [&str; 11] = [
    "#ffffe5", "#f0f9c8", "#d5eeb3", "#a9ddb7", "#73c9bd", "#45b4c2", "#2897bf", "#2073b2",
    "#234da0", "#1e2f88", "#081d58",
];

/// The colours of observed uncertainties, so that their maps are not taken for those from noise.
const OBSERVED: [&str; 11] = [
    "#fcfbfd", "#f1eff6", "#e2e2ef", "#cecee5", "#b6b6d8", "#9e9ac8", "#8683bd", "#705eaa",
    "#5c3696", "#4a1486", "#2f0461",
];

/// Length that nearly all arrows stay below, as a fraction of the distance between them.
const ARROW_PART: f64 = 0.9;
const NEARLY_ALL: f64 = 0.95;

/// Maximum number of arrows in a row.
const ARROWS: usize = 20;

/// Light and dark colours of a standalone SVG file; the HTML page has its own style sheet.
const STYLE: &str = "<style>\
.field text{font:11px system-ui,sans-serif;fill:#556}\
.field .frame,.field .tick{stroke:#99a;fill:none}\
.field .outline{stroke:#c21f2b;stroke-width:1.5;fill:none}\
.field .arrow{stroke:#c21f2b;stroke-width:1.4;fill:none;stroke-linecap:round}\
.field .foot{fill:#c21f2b}\
.field .none{fill:#888;fill-opacity:.25}\
@media(prefers-color-scheme:dark){.field text{fill:#a9b2bd}}</style>";

/// Values over an image, row by row.
struct Field {
    size: DVec2,
    columns: usize,
    values: Vec<Option<f64>>,
    /// Cells inside the outline.
    outlined: Vec<bool>,
    /// Meaning of the outline, shown in the legend.
    outline: &'static str,
    colours: &'static [&'static str; 11],
    arrows: Vec<(DVec2, DVec2)>,
}

/// The uncertainty map of a camera as a standalone SVG file: standard deviation of projections
/// over the image, px.
pub fn uncertainty_svg(camera: &CameraEstimate, map: &UncertaintyMap) -> String {
    of_uncertainty(camera, map).by_itself(UNCERTAIN)
}

/// The comparison of two cameras as a standalone SVG file: differences of projections over an
/// image of `size_px`, px.
pub fn comparison_svg(size_px: [u32; 2], found: &Comparison) -> String {
    let places = found.positions.iter();
    let values = places.map(|place| Some(place.as_ref()?.by.length()));
    let outlined = found.positions.iter().map(|place| place.is_some_and(|place| place.is_compared));
    let every = (found.columns / ARROWS).max(1);
    let is_drawn = |index: usize| {
        let (row, column) = (index / found.columns, index % found.columns);
        row % every == every / 2 && column % every == every / 2
    };
    let arrows = found.positions.iter().enumerate().filter(|(index, _)| is_drawn(*index));
    let field = Field {
        size: DVec2::from(size_px.map(f64::from)),
        columns: found.columns,
        values: values.collect(),
        outlined: outlined.collect(),
        outline: "outlined: compared region",
        colours: &COLOURS,
        arrows: arrows
            .filter_map(|(_, place)| place.map(|place| (place.pixel, place.by)))
            .collect(),
    };
    field.by_itself("Differences of two cameras over the image")
}

const UNCERTAIN: &str = "Projection uncertainty over the image";

/// The uncertainty map of a camera for a page.
pub(in crate::report) fn uncertainty(camera: &CameraEstimate, map: &UncertaintyMap) -> String {
    of_uncertainty(camera, map).axes().svg(NAMES, UNCERTAIN)
}

fn of_uncertainty(camera: &CameraEstimate, map: &UncertaintyMap) -> Field {
    let size = DVec2::new(f64::from(camera.camera.width), f64::from(camera.camera.height));
    let parts = DVec2::new(map.columns as f64, map.rows as f64);
    let seen: BTreeSet<[i64; 2]> = camera
        .corners()
        .map(|corner| {
            let at = ((corner.pixel + 0.5) / size * parts).floor();
            [at.x as i64, at.y as i64]
        })
        .collect();
    let places = 0..map.columns * map.rows;
    let is_seen =
        |place: usize| seen.contains(&[(place % map.columns) as i64, (place / map.columns) as i64]);
    Field {
        size,
        columns: map.columns,
        values: map.sd_px.clone(),
        outlined: places.map(is_seen).collect(),
        outline: "outlined: region with corners",
        colours: match map.source {
            Source::Noise => &COLOURS,
            Source::Observed => &OBSERVED,
        },
        arrows: Vec::new(),
    }
}

/// The caption of an uncertainty map.
pub(in crate::report) fn caption(map: &UncertaintyMap) -> String {
    let (head, source) = match map.source {
        Source::Noise => ("Predicted", "from the noise of corners alone"),
        Source::Observed => {
            ("Observed", "from the scatter between views and the accuracy of the board")
        }
    };
    let distance = match map.distance_mm {
        Some(mm) => format!("of points {mm:.0} mm away"),
        None => "of points at infinity".to_owned(),
    };
    format!(
        "<b>{head}.</b> Standard deviation of projections {distance} in the worst direction, {source}."
    )
}

const NAMES: [&str; 2] = ["x, px", "y, px"];

impl Field {
    /// As a standalone SVG file.
    fn by_itself(&self, shows: &str) -> String {
        let attributes = " xmlns=\"http://www.w3.org/2000/svg\" class=\"field\"";
        self.axes().svg_with(NAMES, shows, attributes, STYLE)
    }

    fn axes(&self) -> Axes {
        let mut axes = Axes::of_image(self.size);
        for (index, value) in self.values.iter().enumerate() {
            let [low, high] = self.sides(index);
            match value {
                Some(value) => {
                    let fill = format!("fill=\"{0}\" stroke=\"{0}\"", self.colours[level(*value)]);
                    axes.bar(low, high, "value", &fill);
                }
                None => axes.bar(low, high, "none", ""),
            }
        }
        let outline = self.outline_lines(&axes);
        axes.add(&outline);
        let enlarged = self.enlarged();
        for &(pixel, by) in &self.arrows {
            axes.line(&[pixel, pixel + by * enlarged], "arrow");
            axes.dot(pixel, 1.2, "foot");
        }
        let said = match self.arrows.is_empty() {
            true => self.outline.to_owned(),
            false => format!("arrows enlarged {enlarged} times; {}", self.outline),
        };
        let foot = levels(&self.values, self.colours, axes.foot_width());
        axes.foot(SCALES, format!("{foot}<text x=\"0\" y=\"50\">{said}</text>"));
        axes
    }

    /// Two opposite corners of a cell, px.
    fn sides(&self, index: usize) -> [DVec2; 2] {
        let rows = self.values.len().div_ceil(self.columns.max(1));
        let side = self.size / DVec2::new(self.columns as f64, rows as f64);
        let place = DVec2::new((index % self.columns) as f64, (index / self.columns) as f64);
        [place * side - 0.5, (place + 1.0) * side - 0.5]
    }

    /// Lines between outlined cells and the others.
    fn outline_lines(&self, axes: &Axes) -> String {
        let rows = self.values.len() / self.columns.max(1);
        let is_in = |row: i64, column: i64| {
            let is_there =
                (0..rows as i64).contains(&row) && (0..self.columns as i64).contains(&column);
            is_there && self.outlined[row as usize * self.columns + column as usize]
        };
        let mut path = String::new();
        for index in (0..self.outlined.len()).filter(|&index| self.outlined[index]) {
            let (row, column) = ((index / self.columns) as i64, (index % self.columns) as i64);
            let [low, high] = self.sides(index).map(|corner| axes.at(corner));
            let sides = [
                (is_in(row - 1, column), low, DVec2::new(high.x, low.y)),
                (is_in(row + 1, column), DVec2::new(low.x, high.y), high),
                (is_in(row, column - 1), low, DVec2::new(low.x, high.y)),
                (is_in(row, column + 1), DVec2::new(high.x, low.y), high),
            ];
            for (_, from, to) in sides.iter().filter(|(is_in, _, _)| !is_in) {
                let _ = write!(path, "M{:.1} {:.1}L{:.1} {:.1}", from.x, from.y, to.x, to.y);
            }
        }
        format!("<path class=\"outline\" d=\"{path}\"/>")
    }

    /// Magnification of the arrows.
    fn enlarged(&self) -> f64 {
        let mut lengths: Vec<f64> = self.arrows.iter().map(|(_, by)| by.length()).collect();
        let longest = quantile(&mut lengths, NEARLY_ALL).unwrap_or(0.0).max(1e-6);
        let apart = self.size.max_element() / ARROWS as f64;
        round_down(ARROW_PART * apart / longest)
    }
}

/// Index in [`COLOURS`] of the colour of a value.
fn level(value: f64) -> usize {
    LEVELS.iter().filter(|&&level| value >= level).count()
}

/// The legend of the colours that occur, drawn over `width`.
fn levels(values: &[Option<f64>], colours: &[&str; 11], width: f64) -> String {
    let found = values.iter().flatten().map(|&value| level(value));
    let (first, last) = found.fold((usize::MAX, 0), |(low, high), at| (low.min(at), high.max(at)));
    let mut drawn = String::new();
    let shown: Vec<usize> = (first.min(last)..=last).collect();
    let width = ((width - 30.0) / shown.len() as f64).min(WIDEST);
    for (place, &at) in shown.iter().enumerate() {
        let x = place as f64 * width;
        let _ = write!(
            drawn,
            "<rect x=\"{x:.1}\" y=\"8\" width=\"{width:.1}\" height=\"10\" fill=\"{}\" stroke=\"#888\" \
             stroke-width=\".4\"/>",
            colours[at]
        );
        if let Some(limit) = LEVELS.get(at).filter(|_| place + 1 < shown.len()) {
            let x = x + width;
            let _ =
                write!(drawn, "<text x=\"{x:.1}\" y=\"31\" text-anchor=\"middle\">{limit}</text>");
        }
    }
    let end = shown.len() as f64 * width + 8.0;
    let _ = write!(drawn, "<text x=\"{end:.1}\" y=\"17\">px</text>");
    drawn
}
