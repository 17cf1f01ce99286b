//! Marks along the lower and the right margin of a sheet: check bars with their texts, and the label.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

/// Capital height of the text on a check bar, mm: 7 pt, small but easily legible.
pub(super) const BAR_CAP_MM: f64 = 1.8;
/// Capital height of the label, mm.
pub(super) const LABEL_CAP_MM: f64 = 2.2;
/// Length of a bar's end strokes, across the bar, mm: long enough to align a ruler, short enough to leave room for the
/// text.
pub const CHECK_BAR_STROKE_MM: f64 = 2.0;
/// Depth of descenders, for example of g, below the baseline, in capital heights.
const DESCENT_CAPS: f64 = 0.33;
/// Gap between the ends of a bar and its text, mm.
pub(super) const BAR_INDENT_MM: f64 = 3.0;
/// Step of the lengths of check bars, mm: a round number is easy to read off a ruler.
pub(super) const BAR_STEP_MM: f64 = 10.0;
/// Average advance of a character in the built-in font, in capital heights. Long texts are used only if they fit by
/// this estimate.
pub(crate) const ADVANCE_CAPS: f64 = 0.76;

/// A check bar, with or without the label, along a margin: distances inwards from the margin, mm.
#[derive(Clone, Copy)]
pub(super) struct Marks {
    pub(super) label: bool,
    pub(super) gap: f64,
}

impl Marks {
    /// Baseline of the label.
    pub(super) const LABEL: f64 = LABEL_CAP_MM * DESCENT_CAPS;

    /// Returns the baseline of the text on the bar.
    pub(super) fn words(self) -> f64 {
        let label = if self.label { Self::LABEL + LABEL_CAP_MM + self.gap } else { 0.0 };
        label + BAR_CAP_MM * DESCENT_CAPS
    }

    /// Returns the position of the line of the bar.
    pub(super) fn line(self) -> f64 {
        self.words() + BAR_CAP_MM + self.gap
    }

    /// Returns the depth of all marks together.
    pub(super) fn depth(self) -> f64 {
        self.line() + CHECK_BAR_STROKE_MM / 2.0
    }
}

/// A strip along the lower margin or, rotated counter-clockwise, along the right margin.
pub(super) struct Strip {
    /// Outer corner of the strip: lower left, or lower right.
    pub(super) start: DVec2,
    pub(super) turned: bool,
    pub(super) length: f64,
}

impl Strip {
    /// Returns the page position `along` the strip and `inwards` from the margin.
    pub(super) fn at(&self, along: f64, inwards: f64) -> DVec2 {
        let way = DVec2::new(along, inwards);
        self.start + if self.turned { way.perp() } else { way }
    }

    /// Returns the length of the check bar along the strip, mm.
    pub(super) fn bar_mm(&self) -> f64 {
        (self.length / BAR_STEP_MM).floor() * BAR_STEP_MM
    }

    pub(super) fn angle(&self) -> f64 {
        if self.turned { FRAC_PI_2 } else { 0.0 }
    }
}

/// Returns how to measure a check bar and what to do if its length is wrong, in as much detail as fits.
pub(super) fn bar_words(length_mm: f64) -> String {
    let texts = [
        format!(
            "Measure between the outer ends of this line: {length_mm} mm. If not, print again at \
             100 % without \"fit to page\", or multiply all lengths by measured / {length_mm}."
        ),
        format!(
            "{length_mm} mm between the outer ends. If not: print at 100 %, no \"fit to page\", \
             or scale by measured / {length_mm}."
        ),
        format!("{length_mm} mm end to end. If not: print at 100 %."),
    ];
    let room = length_mm - 2.0 * BAR_INDENT_MM;
    let width = |text: &str| text.chars().count() as f64 * ADVANCE_CAPS * BAR_CAP_MM;
    let fitting = texts.into_iter().find(|text| width(text) <= room);
    fitting.unwrap_or_else(|| format!("{length_mm} mm"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_bars_on_a4_explain_measuring_and_scaling() {
        for length in [150.0, 190.0, 270.0] {
            let words = bar_words(length);
            assert!(words.contains("outer ends") && words.contains("measured / "), "{words}");
        }
    }
}
