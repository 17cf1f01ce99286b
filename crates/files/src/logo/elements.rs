//! The elements of an SVG before it is understood: what cannot be printed black is refused by its name, and what
//! would become too much when `use` repeats it.

use std::collections::HashMap;

use usvg::roxmltree::{Document, Node, NodeId};

use super::{LogoError, MOST_ELEMENTS};

/// Most levels of elements in each other, also by `use`.
const MOST_DEPTH: usize = 100;

/// Elements that have no outline to be filled, and what to do about them. Gradients, clips and filters stand in many
/// files unused; where they are used it is said of what.
const REFUSED: [(&str, &str); 8] = [
    ("text", "convert it to paths"),
    ("image", "trace it, or leave it out"),
    ("foreignObject", "leave it out"),
    ("marker", "convert strokes to paths"),
    ("mask", "cut the paths instead, or leave it out"),
    ("pattern", "fill with a plain colour"),
    ("switch", "leave it out"),
    ("animate", "leave it out"),
];

pub(super) fn check(xml: &Document) -> Result<(), LogoError> {
    for node in xml.descendants().filter(Node::is_element) {
        let name = node.tag_name().name();
        if let Some((_, remedy)) = REFUSED.iter().find(|(refused, _)| *refused == name) {
            let what = named(name, node.attribute("id").unwrap_or_default());
            return Err(LogoError::Element { what: format!("{what} cannot be printed"), remedy });
        }
    }
    let mut counts = HashMap::new();
    let by_id = xml.descendants().filter_map(|node| Some((node.attribute("id")?, node))).collect();
    let elements = count(xml.root_element(), &by_id, &mut counts, 0)?;
    if elements > MOST_ELEMENTS {
        return Err(LogoError::Much { what: "elements", most: MOST_ELEMENTS });
    }
    Ok(())
}

/// An element in words.
pub(super) fn named(element: &str, id: &str) -> String {
    if id.is_empty() { format!("`{element}`") } else { format!("`{element}` with the id `{id}`") }
}

/// An element whose name is not known any more: whatever it is, its reader makes paths and groups of it.
pub(super) fn unnamed(id: &str) -> String {
    if id.is_empty() { "something in it".to_owned() } else { format!("what has the id `{id}`") }
}

/// How many elements an element becomes.
fn count<'a>(
    node: Node<'a, 'a>,
    by_id: &HashMap<&str, Node<'a, 'a>>,
    counts: &mut HashMap<NodeId, usize>,
    depth: usize,
) -> Result<usize, LogoError> {
    if depth > MOST_DEPTH {
        return Err(LogoError::Much { what: "levels of elements", most: MOST_DEPTH });
    }
    if let Some(&known) = counts.get(&node.id()) {
        return Ok(known);
    }
    let mut elements = 1_usize;
    for child in node.children().filter(Node::is_element) {
        elements = elements.saturating_add(count(child, by_id, counts, depth + 1)?);
    }
    if node.tag_name().name() == "use" {
        let link = node.attributes().find(|attribute| attribute.name() == "href");
        let used = link.and_then(|link| by_id.get(link.value().trim().strip_prefix('#')?));
        if let Some(&used) = used {
            elements = elements.saturating_add(count(used, by_id, counts, depth + 1)?);
        }
    }
    counts.insert(node.id(), elements);
    Ok(elements)
}
