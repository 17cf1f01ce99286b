//! The operators of a PDF page that every viewer draws the same way: black paths, filled by the even-odd rule or
//! stroked. With spot colours, white fills the page before anything else, cut lines have the contour colour, and
//! everything overprints.

use glam::DVec2;
use kurbo::{BezPath, Shape as _};

use crate::syntax::findings::Findings;
use crate::syntax::pages::ink::{Ink, OFF_PAGE};
use crate::syntax::text::{decimal, start};
use deltille_files::export::pdf::{CONTOUR, OVERPRINT, WHITE};
use deltille_files::limits::{Exceeded, Limits};
use deltille_layout::Finish;

/// Millimetres per point of 1/72 inch.
const MM_PER_PT: f64 = 25.4 / 72.0;

/// Usual number of words of an operator with its operands, which converts words to nodes.
const WORDS: usize = 3;

/// The effect of an operator on the current path.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    /// Sets the colour or line width of later paths; allowed only between paths.
    State,
    /// Begins a contour.
    Begin,
    /// Continues a contour.
    Continue,
    /// Paints and clears the path.
    Paint,
}

/// The permitted operators with their number of operands: fill and stroke colour in CMYK, line width, move, line,
/// curve, close, even-odd fill and stroke; graphics state, spot colour spaces and their tints.
const OPERATORS: [(&str, usize, Role); 14] = [
    ("k", 4, Role::State),
    ("K", 4, Role::State),
    ("w", 1, Role::State),
    ("gs", 0, Role::State),
    ("cs", 0, Role::State),
    ("CS", 0, Role::State),
    ("scn", 1, Role::State),
    ("SCN", 1, Role::State),
    ("m", 2, Role::Begin),
    ("l", 2, Role::Continue),
    ("c", 6, Role::Continue),
    ("h", 0, Role::Continue),
    ("f*", 0, Role::Paint),
    ("S", 0, Role::Paint),
];

/// Black ink alone: cyan, magenta, yellow, black.
const BLACK: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Largest coordinate, points: larger ones are not exact in all viewers.
const FARTHEST_PT: f64 = 1e5;

/// Distance by which a path may extend beyond the page, points: coordinates are rounded.
const EDGE_SLACK_PT: f64 = 0.01;

/// The properties that the content of a page must have.
pub(super) struct Content<'a> {
    /// Width and height, points.
    pub size_pt: DVec2,
    /// How the page should be printed.
    pub finish: &'a Finish,
    /// Number of cut lines on the page, each in the contour colour if there is one.
    pub cut_lines: usize,
    /// Name of the page in findings.
    pub page: &'a str,
}

/// Inspects the content of a page. It may have only numbers and permitted operators, colour and width must be set
/// before use, all marks must lie on the page, and spot colours must be used as the finish requires.
///
/// # Errors
///
/// Returns an error if there are more operators than the limits allow.
pub(super) fn check(
    content: &[u8],
    &Content { size_pt, finish, cut_lines, page }: &Content,
    limits: &Limits,
    found: &mut Findings,
) -> Result<(), Exceeded> {
    let Ok(content) = std::str::from_utf8(content) else {
        found.add(page, "content other than numbers and operators");
        return Ok(());
    };
    let mut painter = Painter {
        size_pt,
        finish,
        resource: None,
        spots: [false; 2],
        marks: 0,
        contours_drawn: 0,
        set: Vec::new(),
        width_pt: 0.0,
        path: None,
        contours: BezPath::new(),
        ink: Ink::new(size_pt, MM_PER_PT),
    };
    let has_spots = finish.spots().next().is_some();
    let mut count = 0;
    let mut operands: Vec<f64> = Vec::new();
    for (line, text) in content.lines().enumerate() {
        for word in text.split_ascii_whitespace() {
            count += 1;
            limits.check_nodes(count / WORDS)?;
            if let Some(number) = decimal(word) {
                operands.push(number);
                continue;
            }
            let place = || format!("{page}, line {}", line + 1);
            if let Some(name) = word.strip_prefix('/').filter(|_| has_spots) {
                if painter.resource.replace(name.to_owned()).is_some() || !operands.is_empty() {
                    found.add(place(), format!("name {}", start(name, 20)));
                }
                continue;
            }
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
    let ended = operands.is_empty() && painter.path.is_none() && painter.resource.is_none();
    found.unless(ended, page, "content that ends within a path");
    let has_white = finish.white.is_none() || painter.set.contains(&WHITE);
    found.unless(has_white, page, "no white layer below the marks");
    let has_contour = finish.contour.is_none() || painter.contours_drawn == cut_lines;
    found.unless(has_contour, page, "cut lines that are not in the contour colour");
    Ok(())
}

/// The graphics state of a page.
struct Painter<'a> {
    /// Width and height of the page, points.
    size_pt: DVec2,
    /// How the page should be printed.
    finish: &'a Finish,
    /// The name given before an operator.
    resource: Option<String>,
    /// Whether areas are filled, and lines drawn, in a spot colour.
    spots: [bool; 2],
    /// Number of marks so far.
    marks: usize,
    /// Number of marks that are lines in the contour colour.
    contours_drawn: usize,
    /// Operators so far that set colour or line width, and the white layer once it is drawn.
    set: Vec<&'static str>,
    /// Line width, points.
    width_pt: f64,
    /// Left, lower, right and upper bound of the path under construction, points; `None` between paths.
    path: Option<[f64; 4]>,
    /// The path under construction.
    contours: BezPath,
    /// All painted marks.
    ink: Ink,
}

impl Painter<'_> {
    /// Executes an operator. Returns whether the mark that it paints, if any, is on the page.
    ///
    /// # Errors
    ///
    /// Returns the construct if the operator, its operands or its position is not allowed.
    fn operator(&mut self, word: &str, operands: &[f64]) -> Result<bool, String> {
        let listed = OPERATORS.iter().find(|(name, ..)| *name == word);
        let Some(&(name, count, role)) = listed.filter(|(name, ..)| self.is_of_finish(name)) else {
            return Err(format!("operator {}", start(word, 20)));
        };
        let fits = match role {
            Role::State => self.path.is_none(),
            Role::Begin => true,
            Role::Continue | Role::Paint => self.path.is_some(),
        };
        let path = self.path;
        match role {
            Role::Begin | Role::Continue => self.path = Some(reach(path, operands)),
            Role::Paint => self.path = None,
            Role::State => self.set.push(name),
        }
        if operands.len() != count {
            return Err(format!("operator {word} with {} operands", operands.len()));
        }
        if !is_listed(word, operands) {
            return Err(format!("operator {word} with {operands:?}"));
        }
        let resource = self.resource.take();
        if resource.as_deref() != self.needed(name) {
            let resource = resource.unwrap_or_default();
            return Err(format!("operator {word} with name `{}`", start(&resource, 20)));
        }
        if !fits {
            return Err(format!("misplaced operator {word}"));
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
            ("scn", _) if !self.spots[0] => return Err("misplaced operator scn".to_owned()),
            ("SCN", _) if !self.spots[1] => return Err("misplaced operator SCN".to_owned()),
            ("cs", _) => self.spots[0] = true,
            ("CS", _) => self.spots[1] = true,
            ("k", _) => self.spots[0] = false,
            ("K", _) => self.spots[1] = false,
            ("f*", _) if self.spots[0] => {
                self.white(path)?;
                return self.paint(&["cs", "scn"], path, None);
            }
            ("f*", _) => return self.paint(&["k"], path, None),
            ("S", _) if self.spots[1] => {
                self.contours_drawn += 1;
                return self.paint(&["CS", "SCN", "w"], path, Some(self.width_pt));
            }
            ("S", _) if self.finish.contour.is_some() => {
                return Err("a line that is not in the contour colour".to_owned());
            }
            ("S", _) => return self.paint(&["K", "w"], path, Some(self.width_pt)),
            _ => {}
        }
        Ok(true)
    }

    /// Whether pages with this finish use an operator.
    fn is_of_finish(&self, operator: &str) -> bool {
        match operator {
            "gs" => self.finish.spots().next().is_some(),
            "cs" | "scn" => self.finish.white.is_some(),
            "CS" | "SCN" => self.finish.contour.is_some(),
            _ => true,
        }
    }

    /// Returns the name that must precede an operator.
    fn needed(&self, operator: &str) -> Option<&'static str> {
        match operator {
            "gs" => Some(OVERPRINT),
            "cs" => Some(WHITE),
            "CS" => Some(CONTOUR),
            _ => None,
        }
    }

    /// Checks that the white layer is the first mark and covers the page.
    fn white(&mut self, path: Option<[f64; 4]>) -> Result<(), String> {
        let DVec2 { x: width, y: height } = self.size_pt;
        let page = [0.0, 0.0, width, height];
        let ends = path.unwrap_or_default();
        let is_page = ends.iter().zip(page).all(|(end, page)| (end - page).abs() < EDGE_SLACK_PT);
        let area = self.contours.area().abs();
        // A rectangle of four corners has no other outline with this area.
        let is_full = self.contours.elements().len() == 5
            && (area - width * height).abs() < EDGE_SLACK_PT * (width + height);
        match self.marks == 0 && is_page && is_full {
            true => {
                self.set.push(WHITE);
                Ok(())
            }
            false => Err("a white layer that does not cover the page below all marks".to_owned()),
        }
    }

    /// Fills the path, or strokes it with a pen of this width, points. `needed` are the operators that must have set
    /// colour and width. Returns whether the mark is on the page.
    fn paint(
        &mut self,
        needed: &[&str],
        path: Option<[f64; 4]>,
        pen: Option<f64>,
    ) -> Result<bool, String> {
        let contours = std::mem::take(&mut self.contours);
        self.marks += 1;
        if self.finish.spots().next().is_some() && !self.set.contains(&"gs") {
            return Err("a mark that does not overprint".to_owned());
        }
        let problem = self.ink.add(&contours, pen);
        if let Some(unset) = needed.iter().find(|needed| !self.set.contains(needed)) {
            return Err(format!("a mark before any operator {unset}"));
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

/// Extends the left, lower, right and upper bound of a path by further points, given as x, y, x, y, …
fn reach(path: Option<[f64; 4]>, points: &[f64]) -> [f64; 4] {
    let none = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    points.as_chunks::<2>().0.iter().fold(path.unwrap_or(none), |ends, &[x, y]| {
        [ends[0].min(x), ends[1].min(y), ends[2].max(x), ends[3].max(y)]
    })
}

/// Whether the operands of a permitted operator are ones that all viewers draw the same way.
fn is_listed(operator: &str, operands: &[f64]) -> bool {
    match operator {
        "k" | "K" => operands == BLACK,
        "scn" | "SCN" => operands == [1.0],
        // A width of zero means the thinnest line of a device, which differs between devices.
        "w" => operands.iter().all(|&width| width > 0.0),
        _ => operands.iter().all(|value| value.abs() < FARTHEST_PT),
    }
}
