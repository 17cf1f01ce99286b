//! Tag ids in small, human-readable type: each in a white tile beside its tag.

use std::collections::BTreeSet;

use glam::DVec2;

use crate::{Label, Placement, SheetLayout, SheetText};
use deltille_core::family::positions;
use deltille_core::lattice::{GridKind, Tile, Vertex};
use deltille_core::setting::Setting::PaperTagIds;
use deltille_core::targets::format_mm;
use deltille_core::targets::{Panel, TagPlacement, TagsIn, Target, TargetError};

/// Capital height in tile edges, and its maximum, mm: small compared with the region from which a corner is measured.
const CAP: (f64, f64) = (0.09, 1.8);

/// Mean advance of a digit, in capital heights.
const DIGIT_CAPS: f64 = 0.85;

/// Smallest capital height that is legible on paper, mm.
const MIN_CAP_MM: f64 = 0.7;

/// Adds the ids to all sheets of a target.
pub(crate) fn add(target: &Target, sheets: &mut [SheetLayout]) -> Result<(), TargetError> {
    let refused = |problem: String| Err(TargetError::invalid(PaperTagIds, problem));
    if target.panels.iter().all(|panel| panel.tags.is_empty()) {
        return refused(
            "the target has no tags whose ids could be printed: omit this setting".to_owned(),
        );
    }
    if target.family.as_ref().is_some_and(|family| family.name == positions::NAME) {
        return refused("position codes have no ids to print: omit this setting".to_owned());
    }
    for panel in &target.panels {
        if panel.inverted || panel.tags_in == TagsIn::White {
            return refused(
                "the tiles beside the tags are black, so ids cannot be printed: omit this setting"
                    .to_owned(),
            );
        }
        if CAP.0 * panel.edge_mm < MIN_CAP_MM {
            let least = (10.0 * MIN_CAP_MM / CAP.0).ceil() / 10.0;
            let edge = format_mm(panel.edge_mm);
            return refused(format!(
                "ids would be illegible on tiles of {edge}: use tiles of at least {least} mm"
            ));
        }
    }
    for sheet in sheets {
        for placement in &sheet.placements {
            let panel = target.panels.iter().find(|panel| panel.id == placement.panel);
            sheet.texts.extend(panel.into_iter().flat_map(|panel| of_panel(panel, placement)));
        }
    }
    Ok(())
}

/// Lays out the ids of a panel's tags on its sheet.
fn of_panel(panel: &Panel, placement: &Placement) -> Vec<SheetText> {
    let cap_height_mm = (CAP.0 * panel.edge_mm).min(CAP.1);
    let mut free: BTreeSet<Tile> =
        panel.tiles().into_iter().filter(|tile| !tile.is_dark()).collect();
    let text = |tag: &TagPlacement| {
        let tile = beside(panel.kind, tag).into_iter().find(|tile| free.remove(tile))?;
        let text = tag.id.to_string();
        let width = text.len() as f64 * DIGIT_CAPS * cap_height_mm;
        let vertices: Vec<DVec2> = tile.vertices().map(|vertex| panel.lattice_mm(vertex)).collect();
        let middle = vertices.iter().sum::<DVec2>() / vertices.len() as f64;
        Some(SheetText {
            text: Label::Words(text),
            at_mm: placement.page_from_panel(middle - DVec2::new(width, cap_height_mm) / 2.0),
            angle_rad: placement.angle_rad,
            cap_height_mm,
            max_width_mm: 1.1 * width,
        })
    };
    panel.tags.iter().filter_map(text).collect()
}

/// Returns the tiles that share an edge with the tile of a tag, the one to its right first.
fn beside(kind: GridKind, tag: &TagPlacement) -> Vec<Tile> {
    let own = Vertex::new(tag.row, tag.col);
    let at = |row: i32, col: i32| own + Vertex::new(row, col);
    match kind {
        GridKind::Deltille => [at(0, 0), at(0, -1), at(-1, 0)].map(Tile::inverted).to_vec(),
        GridKind::Checker => [at(0, 1), at(0, -1), at(1, 0), at(-1, 0)].map(Tile::square).to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::PaperSpec;
    use crate::Printing;
    use deltille_core::targets::{BoardSpec, SolidShape, SolidSpec, TargetSpec};

    fn target(spec: &TargetSpec) -> Result<Printing, TargetError> {
        let paper = PaperSpec { tag_ids: true, ..PaperSpec::default() };
        let family =
            spec.family().map(|name| deltille_core::family::Family::shipped(name).unwrap());
        Printing::build("target", spec, family.as_ref(), Some(&paper))
    }

    proptest! {
        /// Every tag has its id in a white tile that shares an edge with its own, and no tile has two ids.
        #[test]
        fn every_tag_has_its_id_beside_it(
            rows in 3u32..9, cols in 3u32..9, spacing in 1u32..4, squares: bool,
        ) {
            let kind = if squares { GridKind::Checker } else { GridKind::Deltille };
            let mut spec = BoardSpec::new(kind, rows, cols, 20.0);
            spec.tags.as_mut().unwrap().spacing = spacing;
            let target = target(&spec.into()).unwrap();
            let (sheet, panel) = (&target.sheets[0], &target.target.panels[0]);
            let placement = &sheet.placements[0];
            let ids: Vec<(String, Tile)> = sheet.texts.iter().rev().take(panel.tags.len()).map(|text| {
                let half = DVec2::new(text.max_width_mm / 1.1, text.cap_height_mm) / 2.0;
                let middle = placement.panel_from_page(text.at_mm) + half;
                (text.text.to_string(), panel.tile_at(middle / panel.edge_mm))
            }).collect();
            let tiles: BTreeSet<Tile> = ids.iter().map(|(_, tile)| *tile).collect();
            prop_assert_eq!(tiles.len(), panel.tags.len());
            for (tag, (text, tile)) in panel.tags.iter().rev().zip(&ids) {
                prop_assert_eq!(&tag.id.to_string(), text);
                prop_assert!(!tile.is_dark());
                let own: Vec<Vertex> = panel.tag_tile(tag).vertices().collect();
                prop_assert_eq!(tile.vertices().filter(|vertex| own.contains(vertex)).count(), 2);
            }
        }
    }

    #[test]
    fn illegible_ids_are_refused() {
        let board = |edge_mm| BoardSpec::deltille(5, 6, edge_mm);
        let said = |spec: BoardSpec| target(&spec.into()).unwrap_err().to_string();
        assert!(said(board(5.0)).contains("tiles of at least 7.8 mm"));
        assert!(said(BoardSpec { inverted: true, ..board(20.0) }).contains("are black"));
        assert!(said(BoardSpec { tags: None, ..board(20.0) }).contains("no tags"));
        assert!(target(&SolidSpec::new(SolidShape::Cube).into()).is_ok());
    }
}
