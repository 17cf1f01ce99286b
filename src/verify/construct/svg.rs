//! The SVG elements, attributes and values that every viewer draws alike.

use kurbo::{BezPath, Shape as _};
use resvg::usvg::roxmltree::{Document, Error, Node, NodeType, ParsingOptions};

use super::{Findings, decimal, start, text};
use crate::verify::document::length_mm;

const NAMESPACE: &str = "http://www.w3.org/2000/svg";

/// The first lines that say no more than that this is XML in UTF-8.
const DECLARATIONS: [&str; 2] =
    ["<?xml version=\"1.0\" encoding=\"UTF-8\"?>", "<?xml version=\"1.0\"?>"];

/// Elements with their parents and attributes. An `id` is on the list since nothing that is could
/// refer to it.
const ELEMENTS: [(&str, &str, &[&str]); 6] = [
    ("svg", "", &["width", "height", "viewBox"]),
    ("title", "svg", &[]),
    ("desc", "svg", &[]),
    ("rect", "svg", &["width", "height", "fill"]),
    ("g", "svg", &["fill", "fill-rule"]),
    ("path", "g", &["d", "id", "fill", "stroke", "stroke-width"]),
];

/// Coordinates beyond this are drawn differently by arithmetic of different precision.
const FARTHEST: f64 = 1e5;

/// Goes through an SVG.
pub(super) fn check(bytes: &[u8]) -> Result<Findings, String> {
    let text = text(bytes)?;
    let mut found = Findings::default();
    let options = ParsingOptions { allow_dtd: false, ..Default::default() };
    let document = match Document::parse_with_options(text, options) {
        Ok(document) => document,
        Err(Error::DtdDetected) => {
            found.add("the head", "a document type declaration");
            return Ok(found);
        }
        Err(error) => return Err(format!("not a readable SVG ({error})")),
    };
    let declared = !text.trim_start_matches('\u{feff}').starts_with("<?xml")
        || DECLARATIONS.iter().any(|declaration| text.starts_with(declaration));
    found.unless(declared, "line 1", "an XML declaration other than of UTF-8");
    for node in document.root().descendants() {
        let constructs = match node.node_type() {
            NodeType::Element => element(&node),
            NodeType::Text => words(&node),
            NodeType::PI => {
                let target = node.pi().map_or("", |pi| pi.target);
                vec![format!("processing instruction <?{target}?>")]
            }
            NodeType::Root | NodeType::Comment => continue,
        };
        // Lines are counted from the first on, so only where they are asked for.
        if !constructs.is_empty() && !found.is_full() {
            let place = format!("line {}", document.text_pos_at(node.range().start).row);
            constructs.into_iter().for_each(|construct| found.add(&place, construct));
        }
    }
    paper(&document, &mut found);
    Ok(found)
}

/// Black marks are seen on white paper, and on nothing where a viewer has a dark background.
fn paper(document: &Document, found: &mut Findings) {
    let children = document.root_element().children().filter(Node::is_element);
    let drawn: Vec<&str> = children.map(|node| node.tag_name().name()).collect();
    let mut drawn = drawn.into_iter().filter(|name| !["title", "desc"].contains(name));
    found.unless(drawn.next() == Some("rect"), "the page", "no paper below the marks");
    found.unless(!drawn.any(|name| name == "rect"), "the page", "paper above the marks");
}

/// What of an element is not on the list.
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
    for attribute in node.attributes() {
        let (key, value) = (attribute.name(), attribute.value());
        if attribute.namespace().is_some() || !attributes.contains(&key) {
            constructs.push(format!("attribute {key} of <{name}>"));
        } else if !holds(name, key, value) {
            constructs.push(format!("{key}=\"{}\" of <{name}>", start(value, 40)));
        }
    }
    constructs
}

/// Only titles and descriptions have words.
fn words(node: &Node) -> Vec<String> {
    let parent = node.parent_element().map_or("", |parent| parent.tag_name().name());
    let blank = node.text().unwrap_or_default().trim().is_empty();
    if blank || ["title", "desc"].contains(&parent) {
        return Vec::new();
    }
    vec!["text between elements".to_owned()]
}

/// Whether the value of a listed attribute is one that all viewers understand alike.
fn holds(element: &str, key: &str, value: &str) -> bool {
    match (element, key) {
        ("svg", "width" | "height") => length_mm(value).is_some(),
        ("rect", "width" | "height") => value == "100%",
        (_, "viewBox") => {
            let numbers: Option<Vec<f64>> = value.split(' ').map(decimal).collect();
            numbers.is_some_and(|n| n.len() == 4 && n[2] > 0.0 && n[3] > 0.0)
        }
        ("rect", "fill") => value == "#fff",
        (_, "fill") => ["#000", "none"].contains(&value),
        (_, "stroke") => value == "#000",
        (_, "stroke-width") => decimal(value).is_some_and(|width| width > 0.0),
        (_, "fill-rule") => value == "evenodd",
        (_, "d") => is_path(value),
        (_, "id") => true,
        _ => false,
    }
}

/// Absolute moves, lines, curves and closings, without exponents or arcs.
fn is_path(data: &str) -> bool {
    let listed = |c: char| c.is_ascii_digit() || "MLQCZ .-".contains(c);
    if data.is_empty() || !data.chars().all(listed) {
        return false;
    }
    BezPath::from_svg(data).is_ok_and(|path| {
        let bounds = path.control_box().abs();
        [bounds.x0, bounds.y0, bounds.x1, bounds.y1].iter().all(|end| end.abs() < FARTHEST)
            && path.bounding_box().is_finite()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_data_is_absolute_and_complete() {
        for data in ["M1 2L3 4L5.5 -6Z", "M1 2Q3 4 5 6C1 2 3 4 5 6Z"] {
            assert!(is_path(data), "{data}");
        }
        for data in [
            "",
            "L1 2",
            "m1 2l3 4",
            "M1 2A3 4 0 0 0 5 6",
            "M1 2L3",
            "M1 2L3e9 4",
            "M1 2L99999999 4",
        ] {
            assert!(!is_path(data), "{data}");
        }
    }
}
