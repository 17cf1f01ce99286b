//! A map of a target's corners as a picture: arrows for what is off in the plane, colours for what is above
//! or below it.

use std::fmt::Write as _;

use deltille_core::calibrate::{CornerOffset, PanelRef, TargetMap};
use deltille_core::statistics::{median, quantile};

/// Width of the picture, user units.
const WIDTH: f64 = 720.0;

/// Room around every panel, and below all of them for the scales, user units.
const MARGIN: f64 = 26.0;
const SCALES: f64 = 44.0;

/// Most panels beside each other.
const PANELS_IN_A_ROW: usize = 5;

/// Nearly all arrows are at most as long as this part of the distance between corners.
const ARROW_PART: f64 = 0.9;
const NEARLY_ALL: f64 = 0.95;

/// Colours of heights: below, in the plane, above; told apart by those who see no red or no green.
const BELOW: [f64; 3] = [217.0, 119.0, 6.0];
const LEVEL: [f64; 3] = [235.0, 235.0, 235.0];
const ABOVE: [f64; 3] = [31.0, 111.0, 178.0];

/// Colours for viewers in the light and in the dark; a page with its own overrides nothing here.
const STYLE: &str = "\
.target-map text{font:11px system-ui,sans-serif;fill:#556}\
.target-map .offset{stroke:#c21f2b;stroke-width:1.6;fill:none;stroke-linecap:round}\
.target-map .chance{stroke:#99a;stroke-opacity:.7}\
.target-map .place{stroke:#667;stroke-width:.6}\
@media(prefers-color-scheme:dark){.target-map text{fill:#a9b2bd}.target-map .offset{stroke:#ff7b72}}";

/// The picture as a file of its own.
pub fn target_map_svg(map: &TargetMap) -> String {
    drawing(map, " xmlns=\"http://www.w3.org/2000/svg\"")
}

/// The picture; `space` is an attribute that files of their own need.
pub(super) fn drawing(map: &TargetMap, space: &str) -> String {
    let scale = Scale::of(map);
    let panels: Vec<&[CornerOffset]> = map.corners().chunk_by(|a, b| a.panel == b.panel).collect();
    let in_a_row = panels.len().clamp(1, PANELS_IN_A_ROW);
    let cell = WIDTH / in_a_row as f64;
    // All panels at one scale, that of the largest.
    let sizes = panels.iter().map(|corners| size_mm(corners));
    let largest =
        sizes.fold([1.0f64; 2], |most, size| [most[0].max(size[0]), most[1].max(size[1])]);
    // Arrows may reach to where the next corner would be.
    let around = spacing_mm(map);
    let per_mm = (cell - 2.0 * MARGIN) / (largest[0] + 2.0 * around);
    let margin = MARGIN + around * per_mm;
    let height = largest[1] * per_mm + 2.0 * margin;
    let mut body = String::new();
    for (index, corners) in panels.iter().enumerate() {
        let at = [(index % in_a_row) as f64 * cell, (index / in_a_row) as f64 * height];
        let name = (panels.len() > 1).then(|| corners[0].panel);
        body +=
            &panel(corners, map, &scale, per_mm, [at[0] + margin, at[1] + height - margin], name);
    }
    let below = panels.len().div_ceil(in_a_row) as f64 * height;
    body += &scale.drawn(per_mm, below);
    let total = below + SCALES;
    format!(
        "<svg{space} class=\"target-map\" viewBox=\"0 0 {WIDTH} {total:.1}\" width=\"{WIDTH}\" role=\"img\" \
         aria-label=\"Offsets of the target's corners\"><style>{STYLE}</style>{body}</svg>"
    )
}

/// By how much arrows are enlarged, and which heights have full colours.
struct Scale {
    enlarged: f64,
    /// An offset to be shown below, mm.
    example_mm: f64,
    height_mm: f64,
}

impl Scale {
    fn of(map: &TargetMap) -> Self {
        let corners = map.corners().iter();
        let mut lengths: Vec<f64> = corners.map(|c| c.offset_mm.truncate().length()).collect();
        let mut heights: Vec<f64> = map.corners().iter().map(|c| c.offset_mm.z.abs()).collect();
        let most = |values: &mut [f64]| quantile(values, NEARLY_ALL).unwrap_or(0.0).max(1e-6);
        let longest = most(&mut lengths);
        Self {
            enlarged: round_down(ARROW_PART * spacing_mm(map) / longest),
            example_mm: round_down(longest),
            height_mm: round_down(1.3 * most(&mut heights)),
        }
    }

    /// The colour of a height.
    fn colour(&self, z: f64) -> String {
        let part = (z / self.height_mm).clamp(-1.0, 1.0);
        let end = if part < 0.0 { BELOW } else { ABOVE };
        let mix = |i: usize| (LEVEL[i] + (end[i] - LEVEL[i]) * part.abs()).round();
        format!("rgb({},{},{})", mix(0), mix(1), mix(2))
    }

    /// What an arrow and a colour mean, from a height of the picture on.
    fn drawn(&self, per_mm: f64, top: f64) -> String {
        let (y, text) = (top + 14.0, top + 34.0);
        let end = MARGIN + self.example_mm * self.enlarged * per_mm;
        let mut drawn = format!(
            "<line class=\"offset\" x1=\"{MARGIN}\" y1=\"{y:.1}\" x2=\"{end:.1}\" y2=\"{y:.1}\"/>\
             <text x=\"{MARGIN}\" y=\"{text:.1}\">{} mm in the plane, {} times enlarged; grey: no more than \
             chance</text>",
            self.example_mm, self.enlarged
        );
        let (left, steps) = (WIDTH - MARGIN - 210.0, 21);
        for step in 0..steps {
            let z = self.height_mm * (f64::from(step) / 10.0 - 1.0);
            let x = left + 10.0 * f64::from(step);
            let colour = self.colour(z);
            let top = y - 6.0;
            let _ = write!(
                drawn,
                "<rect x=\"{x:.1}\" y=\"{top:.1}\" width=\"10.2\" height=\"10\" fill=\"{colour}\"/>"
            );
        }
        let right = left + 210.0;
        let mm = self.height_mm;
        let _ = write!(
            drawn,
            "<text x=\"{left:.1}\" y=\"{text:.1}\">−{mm} mm</text>\
             <text x=\"{:.1}\" y=\"{text:.1}\" text-anchor=\"middle\">out of the plane</text>\
             <text x=\"{right:.1}\" y=\"{text:.1}\" text-anchor=\"end\">{mm} mm</text>",
            f64::midpoint(left, right)
        );
        drawn
    }
}

/// The corners of a panel whose lower left end is at a place of the picture.
fn panel(
    corners: &[CornerOffset],
    map: &TargetMap,
    scale: &Scale,
    per_mm: f64,
    [left, bottom]: [f64; 2],
    name: Option<PanelRef>,
) -> String {
    let [least, _] = extent_mm(corners);
    let radius = (0.16 * spacing_mm(map) * per_mm).clamp(1.2, 7.0);
    let mut drawn = String::new();
    for corner in corners {
        let x = left + (corner.panel_mm.x - least[0]) * per_mm;
        let y = bottom - (corner.panel_mm.y - least[1]) * per_mm;
        let by = corner.offset_mm * scale.enlarged * per_mm;
        let class = if map.is_significant(corner) { "offset" } else { "offset chance" };
        let _ = write!(
            drawn,
            "<circle class=\"place\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{}\"/>\
             <line class=\"{class}\" x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"/>",
            scale.colour(corner.offset_mm.z),
            x + by.x,
            y - by.y
        );
    }
    if let Some(name) = name {
        let _ =
            write!(drawn, "<text x=\"{left:.1}\" y=\"{:.1}\">panel {name}</text>", bottom + 20.0);
    }
    drawn
}

/// Least and largest places of corners, mm.
fn extent_mm(corners: &[CornerOffset]) -> [[f64; 2]; 2] {
    let places = corners.iter().map(|corner| [corner.panel_mm.x, corner.panel_mm.y]);
    places.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], [x, y]| {
        [[low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]]
    })
}

fn size_mm(corners: &[CornerOffset]) -> [f64; 2] {
    let [low, high] = extent_mm(corners);
    [high[0] - low[0], high[1] - low[1]]
}

/// The usual distance from a corner to the next in its row, mm.
fn spacing_mm(map: &TargetMap) -> f64 {
    let pairs = map.corners().windows(2).filter(|pair| {
        (pair[0].panel, pair[0].row, pair[0].col + 1) == (pair[1].panel, pair[1].row, pair[1].col)
    });
    median(pairs.map(|pair| pair[0].panel_mm.distance(pair[1].panel_mm)).collect()).unwrap_or(1.0)
}

/// The largest of 1, 2 and 5 times a power of ten that is no more.
pub(super) fn round_down(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    let digit = [5.0, 2.0].into_iter().find(|digit| digit * decade <= value * (1.0 + 1e-9));
    let rounded = digit.unwrap_or(1.0) * decade;
    // Without the digits that a power leaves.
    format!("{rounded:.6}").parse().unwrap_or(rounded)
}
