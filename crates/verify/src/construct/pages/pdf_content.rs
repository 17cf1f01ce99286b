//! The operators of a PDF page that every viewer draws alike: black paths, filled by the even-odd
//! rule or stroked. Where spot colours are stated, the white fills the page before anything else is drawn, lines are in that
//! of the contour, and everything overprints.

use glam::DVec2;
use kurbo::{BezPath, Shape as _};

use crate::construct::findings::Findings;
use crate::construct::pages::ink::{Ink, OFF_PAGE};
use crate::construct::text::{decimal, start};
use deltille_files::export::pdf::{CONTOUR, OVERPRINT, WHITE};
use deltille_files::limits::{Exceeded, Limits};
use deltille_layout::Finish;

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
/// width, move, line, curve, close, even-odd fill and stroke; graphics state, spaces of spot colours and how much of these.
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

/// What a page is.
pub(super) struct Content<'a> {
    /// Width and height, points.
    pub size_pt: DVec2,
    /// How it should be printed.
    pub finish: &'a Finish,
    /// Number of its lines to cut along, each of which is in the colour of the contour if there is one.
    pub cut_lines: usize,
    /// Its name in findings.
    pub page: &'a str,
}

/// Inspects the content of a page: there are numbers and permitted operators only, colour and width are set before they are
/// used, all marks are on the page, and spot colours are used as they should be.
///
/// # Errors
///
/// There are more operators than the limits allow.
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
        said: Vec::new(),
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
    let has_white = finish.white.is_none() || painter.said.contains(&WHITE);
    found.unless(has_white, page, "no white beneath it");
    let has_contour = finish.contour.is_none() || painter.contours_drawn == cut_lines;
    found.unless(has_contour, page, "lines to cut along that are not in the colour of the contour");
    Ok(())
}

/// The graphics state of a page.
struct Painter<'a> {
    /// Width and height of the page, points.
    size_pt: DVec2,
    /// How the page should be printed.
    finish: &'a Finish,
    /// The name before an operator.
    resource: Option<String>,
    /// Whether areas are filled, and lines drawn, in a spot colour.
    spots: [bool; 2],
    /// Number of marks so far.
    marks: usize,
    /// Number of these that are lines in the colour of the contour.
    contours_drawn: usize,
    /// Operators so far that set colour or line width, and the white once it is there.
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

impl Painter<'_> {
    /// Executes an operator; returns whether what it paints, if anything, is on the page.
    ///
    /// # Errors
    ///
    /// The construct, where the operator, its operands or its place are not permitted.
    fn operator(&mut self, word: &str, operands: &[f64]) -> Result<bool, String> {
        let listed = OPERATORS.iter().find(|(name, ..)| *name == word);
        let Some(&(name, count, role)) = listed.filter(|(name, ..)| self.is_of_finish(name)) else {
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
        let resource = self.resource.take();
        if resource.as_deref() != self.needed(name) {
            let resource = resource.unwrap_or_default();
            return Err(format!("operator {word} with name `{}`", start(&resource, 20)));
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
            ("scn", _) if !self.spots[0] => return Err("operator scn in this place".to_owned()),
            ("SCN", _) if !self.spots[1] => return Err("operator SCN in this place".to_owned()),
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
                return Err("a line that is not in the colour of the contour".to_owned());
            }
            ("S", _) => return self.paint(&["K", "w"], path, Some(self.width_pt)),
            _ => {}
        }
        Ok(true)
    }

    /// Whether an operator has anything to do on a page that is printed so.
    fn is_of_finish(&self, operator: &str) -> bool {
        match operator {
            "gs" => self.finish.spots().next().is_some(),
            "cs" | "scn" => self.finish.white.is_some(),
            "CS" | "SCN" => self.finish.contour.is_some(),
            _ => true,
        }
    }

    /// The name that an operator must have before it.
    fn needed(&self, operator: &str) -> Option<&'static str> {
        match operator {
            "gs" => Some(OVERPRINT),
            "cs" => Some(WHITE),
            "CS" => Some(CONTOUR),
            _ => None,
        }
    }

    /// Checks that the white is the first mark, and as large as the page.
    fn white(&mut self, path: Option<[f64; 4]>) -> Result<(), String> {
        let DVec2 { x: width, y: height } = self.size_pt;
        let page = [0.0, 0.0, width, height];
        let ends = path.unwrap_or_default();
        let is_page = ends.iter().zip(page).all(|(end, page)| (end - page).abs() < EDGE_SLACK_PT);
        let area = self.contours.area().abs();
        // A rectangle of four corners has no other outline of its area.
        let is_full = self.contours.elements().len() == 5
            && (area - width * height).abs() < EDGE_SLACK_PT * (width + height);
        match self.marks == 0 && is_page && is_full {
            true => {
                self.said.push(WHITE);
                Ok(())
            }
            false => Err("white that is not all of the page, beneath all marks".to_owned()),
        }
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
        self.marks += 1;
        if self.finish.spots().next().is_some() && !self.said.contains(&"gs") {
            return Err("a mark that does not overprint".to_owned());
        }
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
        "scn" | "SCN" => operands == [1.0],
        // A width of zero is the thinnest line of a device, which differs from one to another.
        "w" => operands.iter().all(|&width| width > 0.0),
        _ => operands.iter().all(|value| value.abs() < FARTHEST_PT),
    }
}
