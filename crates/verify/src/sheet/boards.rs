//! Verification of the panels of a page: detected corners against stated ones.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;

use crate::document::page::Page;
use crate::finding::any::Finding;
use crate::finding::board::BoardFinding;
use crate::panel::affine_map::AffineMap;
use crate::panel::alone::{MATCH_EDGES, detect_alone, outline_alone};
use crate::panel::placed::PlacedPanel;
use crate::panel::tones::wrong_tones;
use crate::verdict::SheetVerdict;
use crate::verifier::{TOLERANCE_MM, Verifier, detector_config};
use deltille_core::detection::{Detection, GridCorner};
use deltille_core::raster::Gray;
use deltille_core::targets::{Corner, Panel};
use deltille_detect::Detector;
use deltille_layout::SheetLayout;

/// Largest fraction of tiles of the wrong colour that are listed one by one; with more, the page does not show the
/// panel.
const MAX_WRONG_TILES: f64 = 0.25;

/// Largest fraction of missing or additional corners; with more, the page shows another board.
const MAX_MISSING: f64 = 0.25;

/// Positions of the detected corners on a sheet, mm in the frame of the sheet: by panel id, then by corner id.
pub(crate) type Seen = BTreeMap<u32, BTreeMap<u32, DVec2>>;

/// Compares all panels of a page. Returns the map from stated to found page positions of the first
/// panel, and the positions of the corners found.
pub(super) fn check(
    verifier: &Verifier,
    page: &Page,
    layout: &SheetLayout,
    verdict: &mut SheetVerdict,
) -> (AffineMap, Seen) {
    let blurred = page.blurred();
    let detection = verifier.detector.detect(&blurred, "page");
    // Detect the mirrored page only if necessary.
    let mut mirrored: Option<Detection> = None;
    let mut mirror = None;
    let mut placed = Vec::new();
    for placement in &layout.placements {
        let id = placement.panel;
        let Some(panel) = verifier.target().panels.iter().find(|panel| panel.id == id) else {
            verdict.findings.push(BoardFinding::PanelMissing { panel: id }.into());
            continue;
        };
        verdict.corners += panel.corners.len();
        verdict.tags += panel.tags.len();
        if !detection.grids.iter().any(|grid| grid.panel == Some(id)) {
            let mirrored = mirrored.get_or_insert_with(|| {
                verifier.detector.detect(&page.mirrored().blurred(), "mirror")
            });
            if mirrored.grids.iter().any(|grid| grid.panel == Some(id)) {
                verdict.findings.push(match verifier.printing.finish.mirrored {
                    true => BoardFinding::NotMirrored { panel: id }.into(),
                    false => BoardFinding::Mirrored { panel: id }.into(),
                });
                let linear = [[-1.0, 0.0], [0.0, 1.0]];
                mirror = Some(AffineMap { linear, shift: DVec2::X * page.width_mm });
                continue;
            }
        }
        let found_from_stated = AffineMap::IDENTITY;
        let panel = PlacedPanel::new(page, panel, placement, found_from_stated).among(layout);
        match wrong_tones(&panel) {
            Some(finding) => verdict.findings.push(finding),
            None => placed.push(panel),
        }
    }
    let mut seen = Seen::new();
    for panel in &mut placed {
        let found = check_panel(verifier, &blurred, &detection, panel, verdict);
        if !found.is_empty() {
            seen.insert(panel.panel.id, found);
        }
    }
    let here: BTreeSet<u32> = layout.placements.iter().map(|p| p.panel).collect();
    let foreign: BTreeSet<u32> =
        detection.grids.iter().filter_map(|g| g.panel).filter(|id| !here.contains(id)).collect();
    let foreign = foreign.into_iter().map(|panel| BoardFinding::PanelForeign { panel }.into());
    verdict.findings.extend(foreign);
    if verdict.corners_found > 0 {
        extra_corners(&detection, &placed, verdict);
    }
    another_board(verifier, page, verdict);
    let first = placed.first().map(|panel| panel.found_from_stated);
    (mirror.or(first).unwrap_or(AffineMap::IDENTITY), seen)
}

/// Adds a first finding that the corners are those of another board, if too few stated corners are found and their
/// number differs. All corners count, whether or not they are on the stated board.
fn another_board(verifier: &Verifier, page: &Page, verdict: &mut SheetVerdict) {
    let unknown = verdict.findings.iter().any(|finding| {
        use BoardFinding::{CornerExtra, PanelMissing};
        matches!(finding, Finding::Board(PanelMissing { .. } | CornerExtra { .. }))
    });
    let Some(kind) = verifier.target().panels.first().map(|panel| panel.kind).filter(|_| unknown)
    else {
        return;
    };
    let any_grid = Detector::for_grid(kind, None, detector_config());
    let grids = any_grid.detect(&page.blurred(), "page").grids;
    let found: usize = grids.iter().map(|grid| grid.corners.len()).sum();
    let stated = verdict.corners;
    let few = (verdict.corners_found as f64) < (1.0 - MAX_MISSING) * stated as f64;
    let more = found as f64 > (1.0 + MAX_MISSING) * stated as f64;
    if found > 0 && found != stated && (few || more) {
        verdict.findings.insert(0, BoardFinding::AnotherBoard { found, stated }.into());
    }
}

/// Compares one panel: first its corners, then its tiles and tags at the positions given by the corners. Returns the
/// positions of the corners found.
fn check_panel(
    verifier: &Verifier,
    blurred: &Gray<u16>,
    detection: &Detection,
    placed: &mut PlacedPanel,
    verdict: &mut SheetVerdict,
) -> BTreeMap<u32, DVec2> {
    let panel = placed.panel;
    let found = found_corners(blurred, detection, placed);
    if found.is_empty() {
        verdict.findings.push(BoardFinding::PanelMissing { panel: panel.id }.into());
    } else {
        verdict.corners_found += found.len();
        let missing = panel.corners.iter().filter(|corner| !found.contains_key(&corner.id));
        let missing: Vec<Finding> = missing
            .map(|&Corner { id, row, col, .. }| BoardFinding::CornerMissing { id, row, col }.into())
            .collect();
        check_positions(placed, &found, verdict);
        verdict.findings.extend(missing);
    }
    let report = placed.check_tiles(verifier.family());
    verdict.tags_exact += report.tags_exact;
    if report.wrong_tiles as f64 <= MAX_WRONG_TILES * report.tiles as f64 {
        verdict.findings.extend(report.findings.into_iter().map(Finding::from));
        extra_tags(detection, panel, verdict);
    } else if !found.is_empty() {
        verdict.findings.push(BoardFinding::PanelMissing { panel: panel.id }.into());
    }
    found
}

/// Returns the page positions of the stated corners that were found, by corner id.
///
/// The corners of a tagged panel must be labelled by its tags. The labels of an untagged panel
/// depend on its outline, which is useless once a corner is missing. Corners are then matched by
/// position.
fn found_corners(
    blurred: &Gray<u16>,
    detection: &Detection,
    placed: &PlacedPanel,
) -> BTreeMap<u32, DVec2> {
    let (page, panel) = (placed.page, placed.panel);
    let position = |corner: &GridCorner| page.page_from_px(corner.position());
    let ids: BTreeMap<(i32, i32), u32> =
        panel.corners.iter().map(|c| ((c.row, c.col), c.id)).collect();
    let labelled = detection.grids.iter().filter(|grid| grid.panel == Some(panel.id));
    let mut found: BTreeMap<u32, DVec2> = labelled
        .flat_map(|grid| &grid.corners)
        .filter_map(|corner| {
            let id = *ids.get(&(corner.row, corner.col))?;
            (corner.id == Some(id)).then(|| (id, position(corner)))
        })
        .collect();
    let near = |detection: &Detection| -> BTreeMap<u32, DVec2> {
        let unlabelled = detection.grids.iter().filter(|grid| grid.panel.is_none());
        let places = unlabelled.flat_map(|grid| &grid.corners).map(position);
        let near = |at: DVec2| {
            let (corner, distance) = nearest(placed, at)?;
            (distance < MATCH_EDGES * panel.edge_mm).then_some((corner.id, at))
        };
        places.filter_map(near).collect()
    };
    if panel.tags.is_empty() && found.is_empty() {
        found = near(detection);
    }
    if panel.tags.is_empty() && found.len() < panel.corners.len() {
        let outline = outline_alone(panel);
        let outline = outline.into_iter().map(|p| page.px_from_page(placed.page_from_panel(p)));
        let alone = detect_alone(panel, blurred.clone(), u16::MAX, &outline.collect::<Vec<_>>());
        let alone = near(&alone);
        found = if alone.len() > found.len() { alone } else { found };
    }
    found
}

/// Returns the stated corner nearest to a page position, and its distance, mm.
fn nearest<'a>(placed: &PlacedPanel<'a>, at: DVec2) -> Option<(&'a Corner, f64)> {
    let distance = |corner: &Corner| {
        let stated = placed.found_from_stated.apply(placed.page_from_panel(corner.panel_mm));
        stated.distance(at)
    };
    let corners = placed.panel.corners.iter();
    corners.map(|corner| (corner, distance(corner))).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Compares positions, and searches for a common cause if they differ.
fn check_positions(
    placed: &mut PlacedPanel,
    found: &BTreeMap<u32, DVec2>,
    verdict: &mut SheetVerdict,
) {
    let panel = placed.panel;
    let corners: Vec<(&Corner, DVec2, DVec2)> = panel
        .corners
        .iter()
        .filter_map(|c| Some((c, placed.page_from_panel(c.panel_mm), *found.get(&c.id)?)))
        .collect();
    let largest = |map: &AffineMap| {
        let offs = corners.iter().map(|&(_, stated, found)| map.apply(stated) - found);
        offs.map(|off| off.x.hypot(off.y)).fold(0.0, f64::max)
    };
    let raw = largest(&AffineMap::IDENTITY);
    verdict.max_deviation_mm = verdict.max_deviation_mm.max(raw);
    if raw <= TOLERANCE_MM {
        return;
    }
    let pairs: Vec<_> = corners.iter().map(|(_, stated, found)| (*stated, *found)).collect();
    let map = AffineMap::fit(&pairs).unwrap_or(AffineMap::IDENTITY);
    let causes = causes(panel, &map, &pairs);
    if !causes.is_empty() {
        verdict.findings.extend(causes.into_iter().map(Finding::from));
        placed.found_from_stated = map;
    }
    let map = placed.found_from_stated;
    for (corner, stated, found) in corners {
        let by_mm = found - map.apply(stated);
        if by_mm.length() > TOLERANCE_MM {
            let Corner { id, row, col, .. } = *corner;
            verdict.findings.push(BoardFinding::CornerOff { id, row, col, by_mm }.into());
        }
    }
}

/// Returns scale, rotation and shift of a whole panel, each if it alone moves a corner by more than the tolerance.
fn causes(panel: &Panel, map: &AffineMap, pairs: &[(DVec2, DVec2)]) -> Vec<BoardFinding> {
    let id = panel.id;
    let mean =
        |at: fn(&(DVec2, DVec2)) -> DVec2| pairs.iter().map(at).sum::<DVec2>() / pairs.len() as f64;
    let centre = mean(|(stated, _)| *stated);
    let by_mm = mean(|(_, found)| *found) - centre;
    let radius = pairs.iter().map(|(stated, _)| stated.distance(centre)).fold(0.0, f64::max);

    let mut causes = Vec::new();
    let [x, y] = map.scales();
    let scale = (x + y) / 2.0;
    if (x - y).abs() / 2.0 * radius > TOLERANCE_MM {
        causes.push(BoardFinding::Stretched { panel: id, scale: [x, y] });
    } else if (scale - 1.0).abs() * radius > TOLERANCE_MM {
        causes.push(BoardFinding::Scale { panel: id, scale });
    }
    let turn = map.rotation_rad();
    if turn.abs() * radius > TOLERANCE_MM {
        causes.push(BoardFinding::Turned { panel: id, angle_deg: turn.to_degrees() });
    }
    // Scaling or rotating a page also moves its middle.
    if causes.is_empty() && by_mm.length() > TOLERANCE_MM {
        causes.push(BoardFinding::Shifted { panel: id, by_mm });
    }
    causes
}

/// Reports tags that the detector reads where the panel has none or a different one.
fn extra_tags(detection: &Detection, panel: &Panel, verdict: &mut SheetVerdict) {
    let stated: BTreeSet<(u32, i32, i32)> =
        panel.tags.iter().map(|tag| (tag.id, tag.row, tag.col)).collect();
    let grids = detection.grids.iter().filter(|grid| grid.panel == Some(panel.id));
    let extra = grids
        .flat_map(|grid| &grid.tags)
        .filter(|tag| !stated.contains(&(tag.id, tag.row, tag.col)))
        .map(|tag| BoardFinding::TagExtra { id: tag.id, row: tag.row, col: tag.col }.into());
    verdict.findings.extend(extra);
}

/// Reports corners that belong to no panel of the page. The cells of a tag meet like small tiles, so the inside of a
/// tag's tile is checked cell by cell instead.
fn extra_corners(detection: &Detection, placed: &[PlacedPanel], verdict: &mut SheetVerdict) {
    for corner in detection.grids.iter().flat_map(|grid| &grid.corners) {
        let Some(page) = placed.first().map(|p| p.page) else { return };
        let at_mm = page.page_from_px(corner.position());
        let known = placed.iter().any(|panel| {
            let near = nearest(panel, at_mm)
                .is_some_and(|(_, distance)| distance < MATCH_EDGES * panel.panel.edge_mm);
            near || in_tag(panel, at_mm)
        });
        if !known {
            verdict.findings.push(BoardFinding::CornerExtra { at_mm }.into());
        }
    }
}

/// Whether a page position lies in a tile that carries a tag.
fn in_tag(placed: &PlacedPanel, at_mm: DVec2) -> bool {
    let panel = placed.panel;
    panel.tags.iter().any(|tag| {
        let vertices = panel.tag_tile(tag).vertices().map(|v| {
            let stated = placed.page_from_panel(panel.lattice_mm(v));
            placed.found_from_stated.apply(stated)
        });
        let left = |p: DVec2, q: DVec2| (q - p).perp_dot(at_mm - p) > 0.0;
        let next = vertices.clone().cycle().skip(1);
        vertices.zip(next).all(|(p, q)| left(p, q))
    })
}
