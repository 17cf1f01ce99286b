//! Axes of a plot as SVG, in user units. All plots of a page have frames of equal width; plots of the same camera also have
//! equal height.
//!
//! ```text
//!     ┌──────────────────┐  ABOVE
//!   y │ frame: inset     │
//!     │ within the room  │
//!     └──────────────────┘
//!             x             BELOW
//!     legend of colours and arrows: foot
//! ```

use std::fmt::Write as _;

use glam::DVec2;

use crate::report::html::escaped;

/// Margins around the frame for the numbers and names of its axes, user units.
const LEFT: f64 = 64.0;
const BELOW: f64 = 40.0;
const ABOVE: f64 = 10.0;
const RIGHT: f64 = 12.0;

/// Width of the frames of all plots, and their minimum and maximum height, user units.
const FRAME: f64 = 444.0;
const FRAME_HEIGHTS: [f64; 2] = [240.0, 444.0];

/// Width of a digit, minimum gap between adjacent numbers, and height of a line, user units.
const DIGIT: f64 = 7.0;
const APART: f64 = 8.0;
const LINE: f64 = 16.0;

/// Maximum number of intervals between the ticks of an axis.
const STEPS: f64 = 7.0;

/// Number of powers of ten over which tick intervals are tried, in ascending order.
const DECADES: i32 = 4;

/// Width and height, user units, of the frame of every plot of a camera with this image size, px. The
/// frame has the aspect ratio of the image unless that is extreme.
pub(super) fn frame(image_px: DVec2) -> DVec2 {
    let [low, high] = FRAME_HEIGHTS;
    DVec2::new(FRAME, (FRAME * image_px.y / image_px.x).clamp(low, high).round())
}

/// A frame with axes for data. Points are given in the units of the axes; all
/// other lengths are user units of the SVG.
pub(super) struct Axes {
    /// Values of the axes at the left and at the right end of the frame.
    x: [f64; 2],
    /// Values at the lower and at the upper end; the first is larger if y runs downwards.
    y: [f64; 2],
    /// Size of the frame.
    size: DVec2,
    /// Size of the area around the centred frame, equal for all plots of a camera.
    room: DVec2,
    /// SVG elements drawn so far.
    body: String,
    /// Height of the legend below the axes, and its SVG elements.
    foot: (f64, String),
    /// Whether the frame, ticks and names are drawn.
    is_framed: bool,
}

impl Axes {
    /// A frame of this size, user units, with axes over two ranges; y grows upwards.
    pub(super) fn new(size: DVec2, x: [f64; 2], y: [f64; 2]) -> Self {
        let (body, foot) = (String::new(), (0.0, String::new()));
        Self { x, y, size, room: size, body, foot, is_framed: true }
    }

    /// A frame with the proportions of an image whose size is given in px. Its axes are pixel
    /// coordinates, which are integers at pixel centres; y runs downwards.
    pub(super) fn of_image(image_px: DVec2) -> Self {
        let room = frame(image_px);
        let size = image_px * (room / image_px).min_element();
        let far = image_px - 0.5;
        Self { room, ..Self::new(size, [-0.5, far.x], [far.y, -0.5]) }
    }

    /// The same area as [`Self::of_image`], without frame, ticks and names.
    pub(super) fn bare(image_px: DVec2) -> Self {
        Self { is_framed: false, ..Self::new(frame(image_px), [0.0, 1.0], [0.0, 1.0]) }
    }

    /// Upper left corner and size, user units, of the drawing area; without a frame it includes the
    /// margins that other plots use for numbers.
    pub(super) fn bounds(&self) -> [DVec2; 2] {
        match self.is_framed {
            true => [self.corner(), self.size],
            false => [DVec2::ZERO, self.room + DVec2::new(LEFT + RIGHT, ABOVE + BELOW)],
        }
    }

    /// The position in the SVG, user units, of a point given in the units of the axes.
    pub(super) fn at(&self, DVec2 { x, y }: DVec2) -> DVec2 {
        let part = |v: f64, [low, high]: [f64; 2]| (v - low) / (high - low);
        let parts = DVec2::new(part(x, self.x), 1.0 - part(y, self.y));
        self.corner() + parts * self.size
    }

    /// The upper left corner of the frame, user units.
    fn corner(&self) -> DVec2 {
        DVec2::new(LEFT, ABOVE) + ((self.room - self.size) / 2.0).floor()
    }

    /// User units per unit of the x axis and of the y axis.
    pub(super) fn scale(&self) -> DVec2 {
        self.size / DVec2::new(self.x[1] - self.x[0], self.y[1] - self.y[0]).abs()
    }

    /// Clips everything that `draw` adds to the frame.
    pub(super) fn within(&mut self, draw: impl FnOnce(&mut Self)) {
        let (DVec2 { x, y }, DVec2 { x: w, y: h }) = (self.corner(), self.size);
        let _ = write!(
            self.body,
            "<svg x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" \
             viewBox=\"{x:.1} {y:.1} {w:.1} {h:.1}\">"
        );
        draw(self);
        self.body.push_str("</svg>");
    }

    /// Sets the legend below the axes: its height, user units, and its SVG elements, whose origin is
    /// below the axes at the left end of the frame.
    pub(super) fn foot(&mut self, height: f64, elements: String) {
        self.foot = (height, elements);
    }

    /// Maximum width of the legend set by [`Self::foot`], user units.
    pub(super) fn foot_width(&self) -> f64 {
        self.room.x
    }

    /// Adds an SVG element whose coordinates are user units.
    pub(super) fn add(&mut self, element: &str) {
        self.body.push_str(element);
    }

    /// Adds a dot with a CSS class; the radius is in user units.
    pub(super) fn dot(&mut self, point: DVec2, radius: f64, class: &str) {
        let DVec2 { x: cx, y: cy } = self.at(point);
        let _ = write!(
            self.body,
            "<circle class=\"{class}\" cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"{radius}\"/>"
        );
    }

    /// Adds what `draw` adds, with a text that viewers show when the mouse points at it.
    pub(super) fn titled(&mut self, title: &str, draw: impl FnOnce(&mut Self)) {
        let _ = write!(self.body, "<g><title>{}</title>", escaped(title));
        draw(self);
        self.body += "</g>";
    }

    /// Adds text at a point, shifted by `by`, user units; `anchor` is a value of `text-anchor`.
    pub(super) fn text(&mut self, point: DVec2, by: DVec2, anchor: &str, text: &str) {
        let DVec2 { x, y } = self.at(point) + by;
        let _ = write!(
            self.body,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>"
        );
    }

    /// Adds a polyline with a CSS class.
    pub(super) fn line(&mut self, points: &[DVec2], class: &str) {
        let places = points.iter().map(|&point| {
            let DVec2 { x, y } = self.at(point);
            format!("{x:.1},{y:.1}")
        });
        let places: Vec<String> = places.collect();
        let _ = write!(self.body, "<polyline class=\"{class}\" points=\"{}\"/>", places.join(" "));
    }

    /// Adds a rectangle with a CSS class between two opposite corners; `style` contains further
    /// attributes.
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

    /// Returns the finished SVG with the names of the x and y axes; `shows` is the text for screen readers.
    pub(super) fn svg(self, names: [&str; 2], shows: &str) -> String {
        self.svg_with(names, shows, "", "")
    }

    /// Like [`Self::svg`], with further attributes of the `svg` element and a `style` element for a
    /// standalone file, which has no style sheet.
    pub(super) fn svg_with(
        self,
        names: [&str; 2],
        shows: &str,
        attributes: &str,
        style: &str,
    ) -> String {
        let (DVec2 { x: w, y: h }, DVec2 { x: left, y: top }) = (self.size, self.corner());
        let (width, end) = (LEFT + self.room.x + RIGHT, ABOVE + self.room.y + BELOW);
        let height = end + self.foot.0;
        let mut marks = format!(
            "<rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{w:.1}\" height=\"{h:.1}\"/>"
        );
        let side_by_side = |text: &str| DIGIT * text.chars().count() as f64 + APART;
        for (value, text) in ticks(self.x, w, side_by_side) {
            let DVec2 { x, y } = self.at(DVec2::new(value, self.y[0]));
            let _ = write!(
                marks,
                "<line class=\"tick\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{y:.1}\" y2=\"{:.1}\"/>\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{text}</text>",
                y + 4.0,
                y + 16.0
            );
        }
        for (value, text) in ticks(self.y, h, |_| LINE) {
            let DVec2 { x, y } = self.at(DVec2::new(self.x[0], value));
            let _ = write!(
                marks,
                "<line class=\"tick\" x1=\"{:.1}\" x2=\"{x:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
                x - 4.0,
                x - 7.0,
                y + 4.0
            );
        }
        let _ = write!(
            marks,
            "<text class=\"name\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
             <text class=\"name\" transform=\"translate({:.1} {:.1}) rotate(-90)\" \
             text-anchor=\"middle\">{}</text>",
            left + w / 2.0,
            top + h + BELOW - 6.0,
            names[0],
            left - LEFT + 14.0,
            top + h / 2.0,
            names[1]
        );
        if !self.is_framed {
            marks.clear();
        }
        let foot = match self.foot {
            (0.0, _) => String::new(),
            (_, elements) => format!("<g transform=\"translate({LEFT} {end:.1})\">{elements}</g>"),
        };
        format!(
            "<svg{attributes} viewBox=\"0 0 {width} {height:.1}\" width=\"{width}\" role=\"img\" \
             aria-label=\"{shows}\">{style}{marks}{}{foot}</svg>",
            self.body
        )
    }
}

/// Values and labels of the ticks in a range, at the smallest round interval at which the labels do
/// not touch. `length` is the length of the axis and `room` the length of a label along it, both in
/// user units.
fn ticks([low, high]: [f64; 2], length: f64, room: impl Fn(&str) -> f64) -> Vec<(f64, String)> {
    let (low, high) = (low.min(high), low.max(high));
    let rough = (high - low) / STEPS;
    let decade = rough.log10().floor() as i32;
    let decades = decade..decade.saturating_add(DECADES);
    let steps = decades.flat_map(|n| [1.0, 2.0, 5.0].map(|first| (first * 10f64.powi(n), n)));
    let mut ticks =
        steps.filter(|(step, _)| *step >= rough * (1.0 - 1e-9)).map(|(step, decade)| {
            let first = (low / step - 1e-9).ceil() as i64;
            let last = (high / step + 1e-9).floor() as i64;
            let values = (first..=last).map(|n| n as f64 * step);
            (step, values.map(|value| (value, number(value, decade))).collect::<Vec<_>>())
        });
    let fitting = ticks.find(|(step, ticks)| {
        let apart = step / (high - low) * length;
        ticks.len() < 2 || ticks.iter().all(|(_, text)| room(text) <= apart)
    });
    fitting.map_or_else(Vec::new, |(_, ticks)| ticks)
}

/// Label of a tick, with the decimal places that an interval of this power of ten needs.
fn number(value: f64, decade: i32) -> String {
    let places = (-decade).max(0) as usize;
    let text = format!("{value:.places$}");
    if value == 0.0 { "0".to_owned() } else { text.replace('-', "−") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(range: [f64; 2], length: f64) -> Vec<String> {
        let room = |text: &str| DIGIT * text.chars().count() as f64 + APART;
        ticks(range, length, room).into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn ticks_are_round_and_within_the_range() {
        assert_eq!(texts([0.0, 1600.0], 430.0), ["0", "500", "1000", "1500"]);
        assert_eq!(texts([-0.3, 0.3], 400.0), ["−0.3", "−0.2", "−0.1", "0", "0.1", "0.2", "0.3"]);
        assert_eq!(texts([0.0, 62.0], 330.0), ["0", "10", "20", "30", "40", "50", "60"]);
        assert_eq!(texts([0.0, 3e-5], 330.0), ["0", "0.00001", "0.00002", "0.00003"]);
    }

    #[test]
    fn adjacent_numbers_do_not_touch() {
        assert_eq!(texts([-0.07, 0.07], 250.0), ["−0.05", "0", "0.05"]);
        assert_eq!(texts([-0.0035, 0.0035], 250.0), ["−0.002", "0", "0.002"]);
    }
}
