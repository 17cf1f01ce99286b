//! Map of the measured corner offsets of a target: arrows show offsets in the plane, colours show
//! offsets out of the plane.

use std::fmt::Write as _;

use crate::report::plots::panels::{Mark, Panels};
use crate::report::plots::round_down::round_down;
use deltille_calibrate::{CornerOffset, TargetMap};
use deltille_core::statistics::quantile;

/// Width of the map, user units.
const WIDTH: f64 = 720.0;

/// Space beside the panels, and below them for the scales, user units.
const MARGIN: f64 = 26.0;
const SCALES: f64 = 44.0;

/// Length that nearly all arrows stay below, as a fraction of the corner spacing.
const ARROW_PART: f64 = 0.9;
const NEARLY_ALL: f64 = 0.95;

/// Colours of heights: below, in the plane, above. They remain distinguishable with red-green colour blindness.
const BELOW: [f64; 3] = [217.0, 119.0, 6.0];
const LEVEL: [f64; 3] = [235.0, 235.0, 235.0];
const ABOVE: [f64; 3] = [31.0, 111.0, 178.0];

/// Light and dark colours of a standalone SVG file. They match the style sheet of the HTML page.
const STYLE: &str = "\
.target-map text{font:11px system-ui,sans-serif;fill:#556}\
.target-map .offset{stroke:#c21f2b;stroke-width:1.6;fill:none;stroke-linecap:round}\
.target-map .chance{stroke:#99a;stroke-opacity:.7}\
.target-map .place{stroke:#667;stroke-width:.6}\
@media(prefers-color-scheme:dark){.target-map text{fill:#a9b2bd}.target-map .offset{stroke:#ff7b72}}";

/// The map as a standalone SVG file.
pub fn target_map_svg(map: &TargetMap) -> String {
    drawing(map, " xmlns=\"http://www.w3.org/2000/svg\"")
}

/// The map; `space` is the namespace attribute that standalone files need.
pub(in crate::report) fn drawing(map: &TargetMap, space: &str) -> String {
    let mut marks: Vec<Mark> = map.corners().iter().map(|corner| mark(map, corner)).collect();
    let panels = Panels::new(&marks, WIDTH, f64::INFINITY);
    let (scale, per_mm) = (Scale::of(map, panels.spacing_mm()), panels.per_mm());
    for (mark, corner) in marks.iter_mut().zip(map.corners()) {
        mark.colour = scale.colour(corner.offset_mm.z);
    }
    let panels = Panels::new(&marks, WIDTH, f64::INFINITY);
    let (mut body, below) = (panels.drawn(scale.enlarged), panels.height());
    body += &scale.drawn(per_mm, below);
    let total = below + SCALES;
    format!(
        "<svg{space} class=\"target-map\" viewBox=\"0 0 {WIDTH} {total:.1}\" width=\"{WIDTH}\" role=\"img\" \
         aria-label=\"Offsets of the target's corners\"><style>{STYLE}</style>{body}</svg>"
    )
}

fn mark(map: &TargetMap, corner: &CornerOffset) -> Mark {
    Mark {
        panel: corner.panel,
        row: corner.row,
        col: corner.col,
        at_mm: corner.panel_mm.truncate(),
        by_mm: corner.offset_mm.truncate(),
        is_confirmed: map.is_significant(corner),
        colour: String::new(),
        title: String::new(),
    }
}

/// Magnification of the arrows, and the height with full colour.
struct Scale {
    enlarged: f64,
    /// The offset shown in the legend, mm.
    example_mm: f64,
    height_mm: f64,
}

impl Scale {
    fn of(map: &TargetMap, spacing_mm: f64) -> Self {
        let corners = map.corners().iter();
        let mut lengths: Vec<f64> = corners.map(|c| c.offset_mm.truncate().length()).collect();
        let mut heights: Vec<f64> = map.corners().iter().map(|c| c.offset_mm.z.abs()).collect();
        let most = |values: &mut [f64]| quantile(values, NEARLY_ALL).unwrap_or(0.0).max(1e-6);
        let longest = most(&mut lengths);
        Self {
            enlarged: round_down(ARROW_PART * spacing_mm / longest),
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

    /// The legend of arrows and colours, starting at the height `top`.
    fn drawn(&self, per_mm: f64, top: f64) -> String {
        let (y, text) = (top + 14.0, top + 34.0);
        let end = MARGIN + self.example_mm * self.enlarged * per_mm;
        let mut drawn = format!(
            "<line class=\"offset\" x1=\"{MARGIN}\" y1=\"{y:.1}\" x2=\"{end:.1}\" y2=\"{y:.1}\"/>\
             <text x=\"{MARGIN}\" y=\"{text:.1}\">{} mm in the plane, enlarged {} times; grey: not \
             significant</text>",
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
