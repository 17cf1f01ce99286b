//! A pair of axes in an SVG, in user units.

use std::fmt::Write as _;

use glam::DVec2;

/// Room around the axes for their numbers and names.
const LEFT: f64 = 64.0;
const BELOW: f64 = 40.0;
const ABOVE: f64 = 10.0;
const RIGHT: f64 = 12.0;

/// A frame with axes, to draw into.
pub(super) struct Axes {
    x: [f64; 2],
    y: [f64; 2],
    size: DVec2,
    body: String,
}

impl Axes {
    /// Axes over two ranges; `y` grows upwards.
    pub(super) fn new(size: DVec2, x: [f64; 2], y: [f64; 2]) -> Self {
        Self { x, y, size, body: String::new() }
    }

    /// Place of a point.
    pub(super) fn at(&self, DVec2 { x, y }: DVec2) -> DVec2 {
        let part = |v: f64, [low, high]: [f64; 2]| (v - low) / (high - low);
        let parts = DVec2::new(part(x, self.x), 1.0 - part(y, self.y));
        DVec2::new(LEFT, ABOVE) + parts * self.size
    }

    /// Adds an element of SVG.
    pub(super) fn add(&mut self, element: &str) {
        self.body.push_str(element);
    }

    /// A dot of a class.
    pub(super) fn dot(&mut self, point: DVec2, radius: f64, class: &str) {
        let DVec2 { x: cx, y: cy } = self.at(point);
        let _ = write!(
            self.body,
            "<circle class=\"{class}\" cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"{radius}\"/>"
        );
    }

    /// A broken line of a class.
    pub(super) fn line(&mut self, points: &[DVec2], class: &str) {
        let places = points.iter().map(|&point| {
            let DVec2 { x, y } = self.at(point);
            format!("{x:.1},{y:.1}")
        });
        let places: Vec<String> = places.collect();
        let _ = write!(self.body, "<polyline class=\"{class}\" points=\"{}\"/>", places.join(" "));
    }

    /// A rectangle between two corners, of a class.
    pub(super) fn bar(&mut self, low: DVec2, high: DVec2, class: &str, style: &str) {
        let (low, high) = (self.at(low), self.at(high));
        let (DVec2 { x, y }, size) = (low.min(high), (high - low).abs());
        let _ = write!(
            self.body,
            "<rect class=\"{class}\" {style} x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" \
             height=\"{:.1}\"/>",
            size.x, size.y
        );
    }

    /// The picture, with the names of its axes, for readers without eyes with what it shows.
    pub(super) fn svg(self, names: [&str; 2], shows: &str) -> String {
        let DVec2 { x: w, y: h } = self.size;
        let (width, height) = (LEFT + w + RIGHT, ABOVE + h + BELOW);
        let mut marks = format!(
            "<rect class=\"frame\" x=\"{LEFT}\" y=\"{ABOVE}\" width=\"{w}\" height=\"{h}\"/>"
        );
        for value in ticks(self.x) {
            let DVec2 { x, y } = self.at(DVec2::new(value, self.y[0]));
            let _ = write!(
                marks,
                "<line class=\"tick\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{y:.1}\" y2=\"{:.1}\"/>\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                y + 4.0,
                y + 16.0,
                number(value)
            );
        }
        for value in ticks(self.y) {
            let DVec2 { x, y } = self.at(DVec2::new(self.x[0], value));
            let _ = write!(
                marks,
                "<line class=\"tick\" x1=\"{:.1}\" x2=\"{x:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                x - 4.0,
                x - 7.0,
                y + 4.0,
                number(value)
            );
        }
        let _ = write!(
            marks,
            "<text class=\"name\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
             <text class=\"name\" transform=\"translate(12 {:.1}) rotate(-90)\" \
             text-anchor=\"middle\">{}</text>",
            LEFT + w / 2.0,
            height - 6.0,
            names[0],
            ABOVE + h / 2.0,
            names[1]
        );
        format!(
            "<svg viewBox=\"0 0 {width} {height}\" width=\"{width}\" role=\"img\" \
             aria-label=\"{shows}\">{marks}{}</svg>",
            self.body
        )
    }
}

/// Round numbers in a range, three to eight of them.
fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let (low, high) = (low.min(high), low.max(high));
    let rough = (high - low) / 7.0;
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|n| n * decade).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(decade);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|n| n as f64 * step).collect()
}

/// A tick's number, without the noise of its computation.
fn number(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within_the_range() {
        assert_eq!(ticks([0.0, 1600.0]), [0.0, 500.0, 1000.0, 1500.0]);
        assert_eq!(ticks([-0.3, 0.3]).len(), 7);
        assert_eq!(ticks([0.0, 62.0]), [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]);
        assert_eq!(number(ticks([-0.3, 0.3])[3]), "0");
    }
}
