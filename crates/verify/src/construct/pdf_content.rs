//! The operators of a PDF page that every viewer draws alike: black paths, filled by the even-odd
//! rule or stroked.

use glam::DVec2;
use kurbo::BezPath;

use super::ink::Ink;
use super::{Findings, OFF_PAGE, start};
use deltille_files::limits::{Exceeded, Limits};

const MM_PER_PT: f64 = 25.4 / 72.0;

/// Words that an operator with its operands has on the average.
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

/// Operators with the number of their operands.
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

/// Pure K.
const BLACK: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Coordinates beyond this are not held exactly by all viewers, points.
const FARTHEST_PT: f64 = 1e5;

/// Distance by which a path may reach over the edge of the page, points, by the number of digits.
const EDGE_SLACK_PT: f64 = 0.01;

/// Inspects the content of a page of that width and height in points: numbers and permitted
/// operators only, and all painted marks on the page, with the stated paint.
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
    size_pt: DVec2,
    /// Operators that tell what paths are painted with.
    said: Vec<&'static str>,
    /// Width of lines.
    width_pt: f64,
    /// Ends of the path that is being built: left, lower, right, upper.
    path: Option<[f64; 4]>,
    /// The same path, and all that was painted before.
    contours: BezPath,
    ink: Ink,
}

impl Painter {
    /// Takes an operator, and says whether what it paints is on the page; an error names what is not on the
    /// list.
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

    /// Fills a path, or draws it by a pen of some width.
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

/// The ends of a path that goes on by these points.
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
        // The thinnest line that a device has is not the same on all.
        "w" => operands.iter().all(|&width| width > 0.0),
        _ => operands.iter().all(|value| value.abs() < FARTHEST_PT),
    }
}
