//! Checks of the elements of an SVG before it is interpreted. Refuses elements that cannot be printed in black, and files that
//! `use` would expand too far.

use std::collections::HashMap;

use usvg::roxmltree::{Document, Node, NodeId};

use super::{LogoError, MAX_ELEMENTS};

/// Maximum nesting depth of elements, including `use`.
const MAX_DEPTH: usize = 100;

/// Elements without an outline to fill, and the remedy for each. Many files contain unused gradients, clips and filters;
/// `painted` refuses them where they are used.
const REFUSED: [(&str, &str); 8] = [
    ("text", "convert it to paths"),
    ("image", "trace it, or remove it"),
    ("foreignObject", "remove it"),
    ("marker", "convert strokes to paths"),
    ("mask", "cut the paths instead, or remove it"),
    ("pattern", "fill with a plain colour"),
    ("switch", "remove it"),
    ("animate", "remove it"),
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
    if elements > MAX_ELEMENTS {
        return Err(LogoError::Much { what: "elements", most: MAX_ELEMENTS });
    }
    Ok(())
}

/// The description of an element in a message.
pub(super) fn named(element: &str, id: &str) -> String {
    if id.is_empty() { format!("`{element}`") } else { format!("`{element}` with the id `{id}`") }
}

/// The description of an element whose name is lost, because the reader converts all elements to paths and groups.
pub(super) fn unnamed(id: &str) -> String {
    if id.is_empty() { "an element".to_owned() } else { format!("the element with the id `{id}`") }
}

/// The number of elements to which an element expands.
fn count<'a>(
    node: Node<'a, 'a>,
    by_id: &HashMap<&str, Node<'a, 'a>>,
    counts: &mut HashMap<NodeId, usize>,
    depth: usize,
) -> Result<usize, LogoError> {
    if depth > MAX_DEPTH {
        return Err(LogoError::Much { what: "levels of elements", most: MAX_DEPTH });
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
