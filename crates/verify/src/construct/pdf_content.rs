//! The operators of a PDF page that every viewer draws alike: black paths, filled by the even-odd
//! rule or stroked.

use glam::DVec2;
use kurbo::BezPath;

use super::ink::Ink;
use super::{Findings, OFF_PAGE, start};
use deltille_files::limits::{Exceeded, Limits};

/// Millimetres per point of 1/72 inch.
const MM_PER_PT: f64 = 25.4 / 72.0;

/// Usual number of words of an operator with its operands, by which words are counted as nodes.
const WORDS: usize = 3;

/// The effect of an operator on the current path.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    /// Sets what paths are painted with, between paths.
    State,
    /// Begins a contour.
    Begin,
    /// Continues a contour.
    GoOn,
    /// Paints the path, which is then gone.
    Paint,
}

/// The permitted operators with the number of their operands: fill and stroke colour in CMYK, line
/// width, move, line, curve, close, even-odd fill and stroke.
const OPERATORS: [(&str, usize, Role); 9] = [
    ("k", 4, Role::State),
    ("K", 4, Role::State),
    ("w", 1, Role::State),
    ("m", 2, Role::Begin),
    ("l", 2, Role::GoOn),
    ("c", 6, Role::GoOn),
    ("h", 0, Role::GoOn),
    ("f*", 0, Role::Paint),
    ("S", 0, Role::Paint),
];

/// Black ink alone: cyan, magenta, yellow, black.
const BLACK: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Greatest coordinate, points: larger ones are not exact in all viewers.
const FARTHEST_PT: f64 = 1e5;

/// Distance by which a path may reach over the edge of the page, points: coordinates are rounded.
const EDGE_SLACK_PT: f64 = 0.01;

/// Inspects the content of a page of this width and height, points: there are numbers and permitted
/// operators only, colour and width are set before they are used, and all marks are on the page.
/// `page` is its name in findings.
///
/// # Errors
///
/// There are more operators than the limits allow.
pub(super) fn check(
    content: &[u8],
    size_pt: DVec2,
    page: &str,
    limits: &Limits,
    found: &mut Findings,
) -> Result<(), Exceeded> {
    let Ok(content) = std::str::from_utf8(content) else {
        found.add(page, "content other than numbers and operators");
        return Ok(());
    };
    let mut painter = Painter {
        size_pt,
        said: Vec::new(),
        width_pt: 0.0,
        path: None,
        contours: BezPath::new(),
        ink: Ink::new(size_pt, MM_PER_PT),
    };
    let mut count = 0;
    let mut operands: Vec<f64> = Vec::new();
    for (line, text) in content.lines().enumerate() {
        for word in text.split_ascii_whitespace() {
            count += 1;
            limits.check_nodes(count / WORDS)?;
            if let Some(number) = super::decimal(word) {
                operands.push(number);
                continue;
            }
            let place = || format!("{page}, line {}", line + 1);
            match painter.operator(word, &operands) {
                Ok(on_page) => found.unseen_unless(on_page, place(), OFF_PAGE),
                Err(construct) => found.add(place(), construct),
            }
            if !painter.ink.is_drawable() {
                found.add(page, "more lines and areas than any target has");
                return Ok(());
            }
            operands.clear();
        }
    }
    let ended = operands.is_empty() && painter.path.is_none();
    found.unless(ended, page, "content that ends within a path");
    Ok(())
}

/// The graphics state of a page.
struct Painter {
    /// Width and height of the page, points.
    size_pt: DVec2,
    /// Operators so far that set colour or line width.
    said: Vec<&'static str>,
    /// Line width, points.
    width_pt: f64,
    /// Left, lower, right and upper end of the path that is being built, points; `None` between paths.
    path: Option<[f64; 4]>,
    /// The same path.
    contours: BezPath,
    /// All marks that were painted.
    ink: Ink,
}

impl Painter {
    /// Executes an operator; returns whether what it paints, if anything, is on the page.
    ///
    /// # Errors
    ///
    /// The construct, where the operator, its operands or its place are not permitted.
    fn operator(&mut self, word: &str, operands: &[f64]) -> Result<bool, String> {
        let listed = OPERATORS.iter().find(|(name, ..)| *name == word);
        let Some(&(name, count, role)) = listed else {
            return Err(format!("operator {}", start(word, 20)));
        };
        let fits = match role {
            Role::State => self.path.is_none(),
            Role::Begin => true,
            Role::GoOn | Role::Paint => self.path.is_some(),
        };
        let path = self.path;
        match role {
            Role::Begin | Role::GoOn => self.path = Some(reach(path, operands)),
            Role::Paint => self.path = None,
            Role::State => self.said.push(name),
        }
        if operands.len() != count {
            return Err(format!("operator {word} with {} operands", operands.len()));
        }
        if !is_listed(word, operands) {
            return Err(format!("operator {word} with {operands:?}"));
        }
        if !fits {
            return Err(format!("operator {word} in this place"));
        }
        let has_begun = !self.contours.elements().is_empty();
        match (name, operands) {
            ("m", &[x, y]) => self.contours.move_to((x, y)),
            ("l", &[x, y]) if has_begun => self.contours.line_to((x, y)),
            ("c", &[a, b, c, d, x, y]) if has_begun => {
                self.contours.curve_to((a, b), (c, d), (x, y));
            }
            ("h", []) if has_begun => self.contours.close_path(),
            ("w", &[width]) => self.width_pt = width,
            ("f*", _) => return self.paint(&["k"], path, None),
            ("S", _) => return self.paint(&["K", "w"], path, Some(self.width_pt)),
            _ => {}
        }
        Ok(true)
    }

    /// Fills the path, or strokes it with a pen of this width, points; `needed` are the operators that
    /// must have set the colour and width. Returns whether the mark is on the page.
    fn paint(
        &mut self,
        needed: &[&str],
        path: Option<[f64; 4]>,
        pen: Option<f64>,
    ) -> Result<bool, String> {
        let contours = std::mem::take(&mut self.contours);
        let problem = self.ink.add(&contours, pen);
        if let Some(unsaid) = needed.iter().find(|needed| !self.said.contains(needed)) {
            return Err(format!("a mark before any operator {unsaid}"));
        }
        if let Some(problem) = problem {
            return Err(problem.to_owned());
        }
        let [left, lower, right, upper] = path.unwrap_or_default();
        let DVec2 { x: width, y: height } = self.size_pt;
        let half = pen.unwrap_or_default() / 2.0;
        Ok(left - half > -EDGE_SLACK_PT
            && lower - half > -EDGE_SLACK_PT
            && right + half < width + EDGE_SLACK_PT
            && upper + half < height + EDGE_SLACK_PT)
    }
}

/// Left, lower, right and upper end of a path after further points, given as x, y, x, y, …
fn reach(path: Option<[f64; 4]>, points: &[f64]) -> [f64; 4] {
    let none = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    points.as_chunks::<2>().0.iter().fold(path.unwrap_or(none), |ends, &[x, y]| {
        [ends[0].min(x), ends[1].min(y), ends[2].max(x), ends[3].max(y)]
    })
}

/// Whether the operands of a listed operator are ones that all viewers draw alike.
fn is_listed(operator: &str, operands: &[f64]) -> bool {
    match operator {
        "k" | "K" => operands == BLACK,
        // A width of zero is the thinnest line of a device, which differs from one to another.
        "w" => operands.iter().all(|&width| width > 0.0),
        _ => operands.iter().all(|value| value.abs() < FARTHEST_PT),
    }
}
