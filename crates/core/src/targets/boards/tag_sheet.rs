//! Single tags: each has a panel of one tile.

use serde::{Deserialize, Serialize};

use super::tag_spec::BORDER_BITS;
use crate::family::Family;
use crate::lattice::GridKind;
use crate::setting::Setting::{TagSheetBorderBits, TagSheetEdgeMm, TagSheetFamily, TagSheetIds};
use crate::targets::length::format_mm;
use crate::targets::{FamilyRef, Outline, Panel, PanelPose, TagPlacement, TagsIn, TargetError};

/// Single tags on sheets. Each has a panel of one tile without corners, whose id is that of the tag.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TagSheetSpec {
    /// Family name, or path of a family file.
    pub family: String,
    /// Tags in the order of printing, each at most once.
    pub ids: Vec<u32>,
    /// Length of a tag's edge, mm.
    pub edge_mm: f64,
    /// Width of the border, bit-widths, 0.6 to 10.
    pub border_bits: f64,
}

impl TagSheetSpec {
    /// Range of a tag's edge, mm: the resolution of office printers, and the size of the largest page.
    pub const EDGE_MM: std::ops::RangeInclusive<f64> = 5.0..=2000.0;
}

/// Returns a panel for each tag, and their family.
pub(in crate::targets) fn tagged(
    spec: &TagSheetSpec,
    family: &Family,
) -> Result<(Vec<Panel>, FamilyRef), TargetError> {
    check(spec, family)?;
    Ok((panels(spec), FamilyRef::of(family)))
}

/// Returns a panel for each tag id.
pub(in crate::targets) fn panels(spec: &TagSheetSpec) -> Vec<Panel> {
    let mut panels: Vec<Panel> = spec.ids.iter().map(|&id| panel(spec, id)).collect();
    panels.sort_by_key(|panel| panel.id);
    panels
}

fn check(spec: &TagSheetSpec, family: &Family) -> Result<(), TargetError> {
    if family.kind() != GridKind::Deltille {
        let problem =
            format!("{} has square tags, but a sheet needs triangular ones", family.name());
        return Err(TargetError::invalid(TagSheetFamily, problem));
    }
    if !TagSheetSpec::EDGE_MM.contains(&spec.edge_mm) {
        let problem = format!("{} is not between 5 mm and 2000 mm", format_mm(spec.edge_mm));
        return Err(TargetError::invalid(TagSheetEdgeMm, problem));
    }
    if !BORDER_BITS.contains(&spec.border_bits) {
        let problem = format!("{} is not between 0.6 and 10 bit-widths", spec.border_bits);
        return Err(TargetError::invalid(TagSheetBorderBits, problem));
    }
    if spec.ids.is_empty() {
        return Err(TargetError::invalid(TagSheetIds, "no tag to print: the list is empty"));
    }
    if let Some(id) = spec.ids.iter().find(|&&id| family.code(id).is_none()) {
        let last = family.len() - 1;
        let problem = format!("{} has no tag {id}; its ids are 0 to {last}", family.name());
        return Err(TargetError::invalid(TagSheetIds, problem));
    }
    Ok(())
}

/// Returns the panel of one tag: a tile without corners.
fn panel(spec: &TagSheetSpec, id: u32) -> Panel {
    Panel {
        id,
        kind: GridKind::Deltille,
        edge_mm: spec.edge_mm,
        border_bits: Some(spec.border_bits),
        tags_in: TagsIn::Black,
        tag_margin_bits: None,
        gap_edges: None,
        discs_mm: None,
        hole_mm: None,
        rim_mm: None,
        inverted: false,
        outline: Outline::Touching,
        matrix: [0, 0],
        pose: PanelPose::IDENTITY,
        corners: Vec::new(),
        tags: vec![TagPlacement { id, row: 0, col: 0 }],
    }
}
