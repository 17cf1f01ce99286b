//! The SVG elements, attributes and values that every viewer draws the same way: a white page, and black paths with
//! absolute coordinates.

use glam::DVec2;
use kurbo::BezPath;
use resvg::usvg::roxmltree::{Document, Error, Node, NodeType, ParsingOptions};

use crate::syntax::findings::Findings;
use crate::syntax::pages::ink::{Ink, OFF_PAGE};
use crate::syntax::text::{decimal, start, text};
use crate::syntax::words::{Words, is_creator};
use deltille_files::limits::{Kind, Limits};

/// The XML namespace of SVG.
const NAMESPACE: &str = "http://www.w3.org/2000/svg";

/// The XML declaration before the drawing.
const DECLARATION: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>";

/// Permitted elements with their parents and attributes. An `id` is harmless because nothing permitted can refer to
/// it.
const ELEMENTS: [(&str, &str, &[&str]); 6] = [
    ("svg", "", &["width", "height", "viewBox"]),
    ("title", "svg", &[]),
    ("desc", "svg", &[]),
    ("rect", "svg", &["width", "height", "fill"]),
    ("g", "svg", &["fill", "fill-rule"]),
    ("path", "g", &["d", "id", "fill", "stroke", "stroke-width"]),
];

/// Largest coordinate, units of the drawing: beyond it, viewers that calculate in single precision draw something
/// else.
const FARTHEST: f64 = 1e5;

/// Distance by which a path may extend beyond the page, and by which the proportions of the drawing may differ from
/// those of the page: coordinates are rounded.
const EDGE_SLACK_MM: f64 = 1e-3;

/// Maximum number of attributes of an element: readers compare each with all others.
const MAX_ATTRIBUTES: usize = 1000;

/// Inspects an SVG for constructs that are not allowed.
///
/// # Errors
///
/// Returns an error if the file is not a readable SVG or exceeds the limits.
pub(in crate::syntax) fn check(
    bytes: &[u8],
    words: &Words,
    limits: &Limits,
) -> Result<Findings, String> {
    let text = text(bytes)?;
    if text.split('<').any(|tag| tag.matches('=').count() > MAX_ATTRIBUTES) {
        return Err(format!("an element with more than {MAX_ATTRIBUTES} attributes"));
    }
    let mut found = Findings::default();
    head(text, &mut found);
    if !found.0.is_empty() {
        return Ok(found);
    }
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: u32::try_from(limits.max_nodes).unwrap_or(u32::MAX),
        ..Default::default()
    };
    let document = match Document::parse_with_options(text, options) {
        Ok(document) => document,
        Err(Error::DtdDetected) => {
            found.add("the header", "a document type declaration");
            return Ok(found);
        }
        Err(Error::NodesLimitReached) => return Err(limits.exceeded(Kind::Nodes).to_string()),
        Err(error) => return Err(format!("not a readable SVG ({error})")),
    };
    let view = View::of(&document.root_element());
    found.unless(
        view.is_some(),
        "the page",
        "width, height and viewBox that do not describe a page in mm",
    );
    let view = view.unwrap_or_default();
    let mut ink = Ink::new(view.size(), view.unit_mm);
    for node in document.root().descendants() {
        let mut constructs = match node.node_type() {
            NodeType::Element => element(&node),
            NodeType::Text => loose_text(&node),
            NodeType::PI => {
                let target = node.pi().map_or("", |pi| pi.target);
                vec![format!("processing instruction <?{target}?>")]
            }
            NodeType::Comment if is_writer(&node) => continue,
            NodeType::Comment => vec!["a comment".to_owned()],
            NodeType::Root => continue,
        };
        if let ("path", []) = (node.tag_name().name(), &constructs[..]) {
            constructs.extend(add(&node, &mut ink).map(str::to_owned));
        }
        let on_page = !node.is_element() || is_on_page(&node, &view);
        let is_listed = constructs.is_empty() && on_page;
        // Counting lines starts at the first line of the file, so line numbers are computed only
        // for findings.
        if !is_listed && !found.is_full() {
            let place = format!("line {}", document.text_pos_at(node.range().start).row);
            constructs.into_iter().for_each(|construct| found.add(&place, construct));
            found.unseen_unless(on_page, place, OFF_PAGE);
        }
    }
    // A page without a size has already been reported.
    let drawable = !found.0.is_empty() || ink.is_drawable();
    found.unless(drawable, "the page", "more lines and areas than any target has");
    let packed = text.contains("<![CDATA[");
    found.unless(!packed, "the file", "a CDATA section");
    paper(&document, &mut found);
    title(&document, words, &mut found);
    Ok(found)
}

/// Checks that the file begins with the declaration of XML 1.0 in UTF-8.
fn head(text: &str, found: &mut Findings) {
    if text.starts_with('\u{feff}') {
        return found.add("the header", "a byte order mark");
    }
    if !text.starts_with(DECLARATION) {
        let line = start(text.lines().next().unwrap_or_default(), 60);
        found.add("line 1", format!("`{line}` instead of {DECLARATION}"));
    }
}

/// Whether a comment is the first node of the file and names this program.
fn is_writer(comment: &Node) -> bool {
    let words = comment.text().and_then(|text| text.strip_prefix(' ')?.strip_suffix(' '));
    let first = comment.prev_sibling().is_none() && comment.parent_element().is_none();
    first && words.is_some_and(is_creator)
}

/// Adds the mark of a path. Returns the problem if viewers may draw it differently.
fn add(node: &Node, ink: &mut Ink) -> Option<&'static str> {
    let path = BezPath::from_svg(node.attribute("d").unwrap_or_default()).ok()?;
    let pen = node.attribute("stroke").map(|_| {
        let width = node.attribute("stroke-width").and_then(decimal);
        width.unwrap_or(1.0)
    });
    ink.add(&path, pen)
}

/// Checks that title and description are those of the target: viewers show them and read them aloud.
fn title(document: &Document, words: &Words, found: &mut Findings) {
    for (name, stated, problem) in [
        ("title", &*words.title, "a title other than the target's name"),
        ("desc", &words.subject, "a desc that does not describe the target"),
    ] {
        let all = document.root_element().children().filter(|node| node.has_tag_name(name));
        let texts: Vec<&str> = all.map(|node| node.text().unwrap_or_default()).collect();
        found.unseen_unless(texts == [stated], "the page", problem);
    }
}

/// The area of the drawing that is the page.
#[derive(Default)]
struct View {
    /// Left, upper, right and lower bound, units of the drawing; y down.
    ends: [f64; 4],
    /// Millimetres per unit of the drawing.
    unit_mm: f64,
}

impl View {
    /// Returns the view of an SVG. Returns `None` if its size is not in mm, or if the `viewBox` has
    /// a different aspect ratio from the page, so that viewers would have to choose a scale.
    fn of(svg: &Node) -> Option<Self> {
        let [width, height] = ["width", "height"].map(|key| length(svg.attribute(key)?));
        let ends = svg.attribute("viewBox")?.split(' ').map(decimal).collect::<Option<Vec<_>>>()?;
        let &[x, y, across, down] = ends.as_slice() else { return None };
        let same = (across * (height? / width?) - down).abs() < EDGE_SLACK_MM;
        let ends = [x, y, x + across, y + down];
        (across > 0.0 && down > 0.0 && same).then_some(Self { ends, unit_mm: width? / across })
    }

    /// Returns width and height, units of the drawing.
    fn size(&self) -> DVec2 {
        let [x0, y0, x1, y1] = self.ends;
        DVec2::new(x1 - x0, y1 - y0)
    }

    /// Whether a mark with these left, upper, right and lower bounds is on the page.
    fn contains(&self, [left, upper, right, lower]: [f64; 4]) -> bool {
        let [x0, y0, x1, y1] = self.ends;
        left >= x0 - EDGE_SLACK_MM
            && upper >= y0 - EDGE_SLACK_MM
            && right <= x1 + EDGE_SLACK_MM
            && lower <= y1 + EDGE_SLACK_MM
    }
}

/// Parses a positive length in millimetres, such as `210mm`.
fn length(value: &str) -> Option<f64> {
    decimal(value.strip_suffix("mm")?).filter(|&length| length > 0.0)
}

/// Checks that a white rectangle lies below all marks: without it, black marks are invisible in a viewer with a dark
/// background.
fn paper(document: &Document, found: &mut Findings) {
    let children = document.root_element().children().filter(Node::is_element);
    let drawn: Vec<&str> = children.map(|node| node.tag_name().name()).collect();
    let mut drawn = drawn.into_iter().filter(|name| !["title", "desc"].contains(name));
    found.unless(drawn.next() == Some("rect"), "the page", "no paper below the marks");
    found.unless(!drawn.any(|name| name == "rect"), "the page", "paper above the marks");
}

/// Returns the constructs of an element that are not allowed.
fn element(node: &Node) -> Vec<String> {
    let name = node.tag_name().name();
    let parent = node.parent_element().map_or("", |parent| parent.tag_name().name());
    let listed = ELEMENTS.iter().find(|(listed, ..)| *listed == name);
    let Some((_, within, attributes)) =
        listed.filter(|_| node.tag_name().namespace() == Some(NAMESPACE))
    else {
        return vec![format!("element <{name}>")];
    };
    let mut constructs = Vec::new();
    if *within != parent {
        constructs.push(format!("element <{name}> within <{parent}>"));
    }
    let has = |key: &str| node.has_attribute(key);
    // A stroked path states fill, stroke and width; a filled one inherits them from its group.
    let needed = |key: &&&str| match (name, **key) {
        ("path", "stroke" | "stroke-width") => has("stroke") || has("stroke-width"),
        ("path", "fill") => has("stroke") || has("stroke-width"),
        _ => true,
    };
    for key in attributes.iter().filter(needed).filter(|key| !has(key)) {
        constructs.push(format!("no {key} of <{name}>"));
    }
    if name == "path" && node.attribute("fill") == Some("none") && !has("stroke") {
        constructs.push("a path that is not painted".to_owned());
    }
    for attribute in node.attributes() {
        let (key, value) = (attribute.name(), attribute.value());
        if attribute.namespace().is_some() || !attributes.contains(&key) {
            constructs.push(format!("attribute {key} of <{name}>"));
        } else if !is_permitted_value(name, key, value) {
            constructs.push(format!("{key}=\"{}\" of <{name}>", start(value, 40)));
        } else if node.document().input_text()[attribute.range_value()] != *value {
            constructs.push(format!("{key} of <{name}> that is not as deltille writes it"));
        }
    }
    constructs
}

/// Whether a path, including the width of its pen, is on the page. Other elements pass, and so do paths with data
/// that are not allowed.
fn is_on_page(node: &Node, view: &View) -> bool {
    let width = node.attribute("stroke-width").and_then(decimal).unwrap_or_default();
    let ends = node.attribute("d").and_then(path_ends);
    ends.is_none_or(|[left, upper, right, lower]| {
        let half = width / 2.0;
        view.contains([left - half, upper - half, right + half, lower + half])
    })
}

/// Returns the construct of a text outside title and description.
fn loose_text(node: &Node) -> Vec<String> {
    let parent = node.parent_element().map_or("", |parent| parent.tag_name().name());
    let blank = node.text().unwrap_or_default().trim().is_empty();
    if blank || ["title", "desc"].contains(&parent) {
        return Vec::new();
    }
    vec!["text between elements".to_owned()]
}

/// Whether all viewers interpret the value of a permitted attribute the same way.
fn is_permitted_value(element: &str, key: &str, value: &str) -> bool {
    match (element, key) {
        ("svg", "width" | "height") => length(value).is_some(),
        ("rect", "width" | "height") => value == "100%",
        (_, "viewBox") => {
            let numbers: Option<Vec<f64>> = value.split(' ').map(decimal).collect();
            numbers.is_some_and(|n| n.len() == 4 && n[2] > 0.0 && n[3] > 0.0)
        }
        ("rect", "fill") => value == "#fff",
        ("g", "fill") => value == "#000",
        (_, "fill") => ["#000", "none"].contains(&value),
        (_, "stroke") => value == "#000",
        (_, "stroke-width") => decimal(value).is_some_and(|width| width > 0.0),
        (_, "fill-rule") => value == "evenodd",
        (_, "d") => path_ends(value).is_some(),
        (_, "id") => true,
        _ => false,
    }
}

/// Returns the left, upper, right and lower bound of the control points of path data, units of the drawing. Returns
/// `None` unless the data consist of absolute moves, lines, curves and closings, with plain decimals.
fn path_ends(data: &str) -> Option<[f64; 4]> {
    let mut ends = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let mut rest = data;
    let mut in_path = false;
    while let Some(letter) = rest.chars().next() {
        let count = match letter {
            'M' | 'L' => 2,
            'Q' => 4,
            'C' => 6,
            'Z' => 0,
            _ => return None,
        };
        if !in_path && letter != 'M' {
            return None;
        }
        in_path = letter != 'Z';
        let body = &rest[1..];
        let end = body.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(body.len());
        let (words, after) = body.split_at(end);
        let numbers: Vec<f64> = match words {
            "" => Vec::new(),
            _ => words.split(' ').map(decimal).collect::<Option<_>>()?,
        };
        if numbers.len() != count {
            return None;
        }
        for &[x, y] in numbers.as_chunks::<2>().0 {
            ends = [ends[0].min(x), ends[1].min(y), ends[2].max(x), ends[3].max(y)];
        }
        rest = after;
    }
    ends.iter().all(|end| end.abs() < FARTHEST).then_some(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_data_is_absolute_and_complete() {
        for data in ["M1 2L3 4L5.5 -6Z", "M1 2Q3 4 5 6C1 2 3 4 5 6ZM7 8L9 9"] {
            assert!(path_ends(data).is_some(), "{data}");
        }
        for data in [
            "",
            "L1 2",
            "m1 2l3 4",
            "M1 2A3 4 0 0 0 5 6",
            "M1 2L3",
            "M1 2L3e9 4",
            "M1 2L99999999 4",
            "M1 2 L3 4",
            "M1,2L3 4",
            "M1 2ZL3 4",
        ] {
            assert!(path_ends(data).is_none(), "{data}");
        }
    }
}
