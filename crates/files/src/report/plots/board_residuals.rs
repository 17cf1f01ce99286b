//! Residuals of each target corner, drawn on the panels.

use std::fmt::Write as _;

use crate::report::measures::corner_offsets::of_corners;
use crate::report::measures::survey::Survey;
use crate::report::plots::axes::Axes;
use crate::report::plots::field::COLOURS;
use crate::report::plots::panels::{Mark, Panels};
use crate::report::plots::round_down::round_down;
use deltille_calibrate::{CameraEstimate, Estimate};
use deltille_core::statistics::quantile;

/// Length that nearly all arrows stay below, as a fraction of the corner spacing.
const ARROW_PART: f64 = 0.8;
const NEARLY_ALL: f64 = 0.95;

/// Height reserved for the scales below the plot, user units, and number of steps of the colour scale.
const FOOT: f64 = 58.0;
const STEPS: usize = 22;

/// Returns the plot and its caption; `None` if no corner was seen in enough views.
pub(in crate::report) fn plot(
    estimate: &Estimate,
    camera: &CameraEstimate,
    survey: &Survey,
) -> Option<(String, String)> {
    let corners = of_corners(estimate, camera);
    let mut errors: Vec<f64> = corners.iter().map(|corner| corner.rms_px).collect();
    let most_px = quantile(&mut errors, 1.0)?.max(1e-9);
    let colour = |px: f64| {
        // The darkest colour would hide the start of the arrows.
        let place = (px / most_px * (COLOURS.len() - 2) as f64) as usize;
        COLOURS[place.min(COLOURS.len() - 2)]
    };
    let marks = corners.iter().map(|corner| Mark {
        panel: corner.panel,
        row: corner.row,
        col: corner.col,
        at_mm: corner.at_mm,
        by_mm: corner.move_mm,
        is_confirmed: corner.is_confirmed,
        colour: colour(corner.rms_px).to_owned(),
        title: format!(
            "row {}, column {}: rms {:.4} px, offset ({:.4}, {:.4}) mm, {} views",
            corner.row, corner.col, corner.rms_px, corner.move_mm.x, corner.move_mm.y, corner.views
        ),
    });
    let marks: Vec<Mark> = marks.collect();
    // The frame has the size of the other plots.
    let mut axes = Axes::bare(survey.size_px);
    let [origin, room] = axes.bounds();
    let panels = Panels::new(&marks, room.x, room.y);
    let mut lengths: Vec<f64> = corners.iter().map(|corner| corner.move_mm.length()).collect();
    let longest = quantile(&mut lengths, NEARLY_ALL)?.max(1e-9);
    let enlarged = round_down(ARROW_PART * panels.spacing_mm() / longest).max(1.0);
    let down = origin.y + (room.y - panels.height()).max(0.0) / 2.0;
    axes.add(&format!(
        "<g class=\"target-map\" transform=\"translate({:.1} {down:.1})\">{}</g>",
        origin.x,
        panels.drawn(enlarged)
    ));
    axes.foot(FOOT, scales(most_px, &colour, round_down(longest), enlarged * panels.per_mm()));
    let svg = axes.svg(["", ""], "Residuals of each corner of the target");
    let sure = corners.iter().filter(|corner| corner.is_confirmed).count();
    let caption = format!(
        "Residuals of each target corner over all views. The colour is their rms. Arrows show the offset on the panel that \
         would explain them, enlarged {enlarged} times; {sure} of {} offsets are significant (the others are grey).",
        corners.len()
    );
    Some((svg, caption))
}

/// The legend of colours and arrows.
fn scales(
    most_px: f64,
    colour: &impl Fn(f64) -> &'static str,
    example_mm: f64,
    per_mm: f64,
) -> String {
    let mut drawn = String::new();
    let wide = 10.0;
    for step in 0..STEPS {
        let px = most_px * (step as f64 + 0.5) / STEPS as f64;
        let (x, fill) = (wide * step as f64, colour(px));
        let _ = write!(
            drawn,
            "<rect x=\"{x:.1}\" y=\"8\" width=\"{:.1}\" height=\"10\" fill=\"{fill}\"/>",
            wide + 0.3
        );
    }
    let end = wide * STEPS as f64;
    let _ = write!(
        drawn,
        "<text x=\"0\" y=\"31\">0</text><text x=\"{end}\" y=\"31\" text-anchor=\"middle\">{most_px:.3}</text>\
         <text x=\"{:.1}\" y=\"17\">rms, px</text>",
        end + 8.0
    );
    let (from, to) = (310.0, 310.0 + example_mm * per_mm);
    let _ = write!(
        drawn,
        "<g class=\"target-map\"><line class=\"offset\" x1=\"{from}\" y1=\"13\" x2=\"{to:.1}\" y2=\"13\"/></g>\
         <text x=\"{from}\" y=\"31\">{example_mm} mm</text>"
    );
    drawn
}
