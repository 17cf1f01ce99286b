//! Errors of measured lengths against the length, with their expanded uncertainty and the limit.

use glam::DVec2;

use crate::report::plots::axes::Axes;
use deltille_calibrate::Acceptance;

/// Size of the frame, user units.
const FRAME: DVec2 = DVec2::new(444.0, 106.0);

/// Height of the legend, user units.
const FOOT: f64 = 22.0;

/// The plot.
pub(in crate::report) fn plot(found: &Acceptance) -> String {
    let longest = found.lengths.iter().map(|of| of.known_mm).fold(0.0, f64::max);
    let reach = |of: &deltille_calibrate::LengthError| {
        let limit = found.request.limit.map_or(0.0, |limit| limit.of(of.known_mm));
        (of.error_mm().abs() + of.budget.expanded_mm()).max(limit)
    };
    let highest = found.lengths.iter().map(reach).fold(f64::MIN_POSITIVE, f64::max);
    let right = 1.03 * longest.max(f64::MIN_POSITIVE);
    let mut axes = Axes::new(FRAME, [0.0, right], [-1.1 * highest, 1.1 * highest]);
    axes.within(|axes| {
        axes.line(&[DVec2::ZERO, DVec2::new(right, 0.0)], "guide");
        for of in &found.lengths {
            let (x, error, expanded) = (of.known_mm, of.error_mm(), of.budget.expanded_mm());
            axes.line(
                &[DVec2::new(x, error - expanded), DVec2::new(x, error + expanded)],
                "interval",
            );
        }
        for of in &found.lengths {
            axes.dot(DVec2::new(of.known_mm, of.error_mm()), 2.0, "dot");
        }
        if let Some(limit) = found.request.limit {
            for sign in [-1.0, 1.0] {
                let ends = [0.0, right].map(|x| DVec2::new(x, sign * limit.of(x)));
                axes.line(&ends, "limit");
            }
        }
    });
    let limit = match found.request.limit {
        Some(_) => {
            "<line class=\"limit\" x1=\"300\" x2=\"324\" y1=\"10\" y2=\"10\"/><text x=\"330\" y=\"14\">limit</text>"
        }
        None => "",
    };
    axes.foot(
        FOOT,
        format!(
            "<circle class=\"dot\" cx=\"10\" cy=\"10\" r=\"2\"/><text x=\"20\" y=\"14\">error</text>\
             <line class=\"interval\" x1=\"90\" x2=\"114\" y1=\"10\" y2=\"10\"/>\
             <text x=\"120\" y=\"14\">expanded uncertainty</text>{limit}"
        ),
    );
    axes.svg(["length (mm)", "error (mm)"], "Errors of the measured lengths")
}
