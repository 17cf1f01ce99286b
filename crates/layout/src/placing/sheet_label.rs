//! The label of a sheet, with everything needed to reproduce it.

use deltille_core::family::positions;
use deltille_core::lattice::GridKind;
use deltille_core::targets::format_mm;
use deltille_core::targets::{BoardSpec, FamilyRef, Fingerprint, Panel, TagsIn};

/// Returns the end of a label: the target that the sheet belongs to, and the program that made it.
pub(crate) fn imprint(target: Fingerprint) -> String {
    format!("target {} · deltille {}", target.short(), env!("CARGO_PKG_VERSION"))
}

/// Returns the label of a sheet of boards, with everything needed to reproduce them.
pub(crate) fn label(
    name: &str,
    spec: &BoardSpec,
    panels: &[Panel],
    family: Option<&FamilyRef>,
    target: Fingerprint,
) -> String {
    let mut parts = size_in_words(name, spec);
    let mut tags = panels.iter().flat_map(|panel| &panel.tags);
    if let (Some(family), Some(first)) = (family, tags.next()) {
        let last = tags.next_back().unwrap_or(first);
        parts.push(tag_range(&family.name, first.id, last.id));
        if panels[0].tags_in == TagsIn::White {
            parts.push("tags in white squares".to_owned());
        }
    }
    parts.extend(match panels {
        [] => None,
        [only] if spec.two_sided_mm.is_some() => {
            let side = if only.id == spec.board_id { "front" } else { "back" };
            Some(format!("board {}, {side}", only.id))
        }
        [only] => Some(format!("board {}", only.id)),
        [first, .., last] => Some(format!("boards {}–{}", first.id, last.id)),
    });
    parts.push(imprint(target));
    parts.join(" · ")
}

/// Returns the label that distinguishes a board from the others on its sheet.
pub(crate) fn label_of_one(spec: &BoardSpec, panel: &Panel, family: Option<&FamilyRef>) -> String {
    let mut parts = size_in_words(&format!("board {}", panel.id), spec);
    if let (Some(family), [first, .., last] | [first @ last]) = (family, panel.tags.as_slice()) {
        parts.push(tag_range(&family.name, first.id, last.id));
    }
    parts.join(" · ")
}

/// Returns the name, the number of corners and the edge length.
fn size_in_words(name: &str, spec: &BoardSpec) -> Vec<String> {
    let corners = format!("{} × {} corners", spec.rows, spec.cols);
    vec![
        name.to_owned(),
        match spec.grid {
            GridKind::Deltille => corners,
            GridKind::Checker => format!("checkerboard {corners}"),
        },
        format!("edge {}", format_mm(spec.edge_mm)),
    ]
}

/// Describes tags in words: `d25h7 id 3`, `d25h7 ids 3–7`. Position codes, whose ids are positions, are described by their
/// family alone.
pub fn tag_range(family: &str, first: u32, last: u32) -> String {
    match (family, first == last) {
        (positions::NAME, _) => family.to_owned(),
        (_, true) => format!("{family} id {first}"),
        (_, false) => format!("{family} ids {first}–{last}"),
    }
}
