//! Absolute labels for the corners of a grid: by tags, by an outline, or none.
//!
//! An image may show a board mirrored by a scanner, a projector or the camera's driver. A mirrored grid is still a
//! right-handed lattice, but it lies on the panel with rows and columns exchanged. No direct view
//! of the print yields these labels, so they are given only on request.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use super::other_settings::SettingsFinder;
use super::placement::labeller::{Budget, Labelled, TagLabeller};
use super::why;
use crate::config::DetectorConfig;
use crate::grid::outline::{WholeBoard, fit_outline, fit_rectangle};
use crate::grid::saddle_grid::{SaddleGrid, mirror_image, mirrored};
use crate::grid::untagged::beyond::is_seen_to_end;
use crate::grid::untagged::tile_shape::is_of_squares;
use deltille_core::detection::{DecodedTag, Grid, GridCorner};
use deltille_core::detection::{OtherSettings, Reason, ReasonKind};
use deltille_core::family::Family;
use deltille_core::lattice::{GridKind, LatticeMap, Tile, Vertex};
use deltille_core::raster::ImageView;
use deltille_core::targets::{Target, board_vertices};

/// A grid of corners without labels, and its tiling.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FoundGrid<'a> {
    pub kind: GridKind,
    pub corners: &'a SaddleGrid,
}

/// Labels for the corners of grids.
#[derive(Clone, Debug)]
pub(crate) struct Labels {
    source: Source,
    /// The board, if it is the only target.
    whole: Option<WholeBoard>,
    allow_mirrored: bool,
}

#[derive(Clone, Debug)]
enum Source {
    /// No absolute labels.
    None,
    /// By the outline of an entirely visible board.
    Outline(BTreeSet<Vertex>),
    /// By the rows and columns of an entirely visible checkerboard.
    Rectangle([u32; 2]),
    /// By the tags of a target, or by the outlines of its untagged panels.
    Target {
        tags: Option<Box<TagLabeller>>,
        panels: Vec<TargetPanel>,
        others: Option<Box<SettingsFinder>>,
    },
    /// By the target, among several, to which a grid belongs; each with its name.
    Scene(Vec<(String, Labels)>),
}

/// Properties of a panel that the detector needs.
#[derive(Clone, Debug)]
struct TargetPanel {
    id: u32,
    kind: GridKind,
    /// Rows and columns.
    size: [u32; 2],
    inverted: bool,
    tagged: bool,
    corner_ids: BTreeMap<Vertex, u32>,
}

/// The lattice of a panel.
pub(crate) struct PanelShape {
    pub corners: BTreeSet<Vertex>,
    /// Tiles with a tag.
    pub tagged: Vec<Tile>,
    /// Whether black and white are exchanged.
    pub inverted: bool,
}

/// Maximum number of corners of a board. A board of 140 × 140 corners has edges of 14 px in an image of 4
/// megapixels. Fabrics and grids on screens have more, and synthetic images so many that refinement takes minutes.
pub(crate) const MAX_CORNERS: usize = 20_000;

impl Labels {
    /// Creates labels by the rows and columns of an untagged board, if they are known.
    pub(crate) fn of_size(
        kind: GridKind,
        size: Option<(u32, u32)>,
        config: &DetectorConfig,
    ) -> Self {
        let outline = size.map(|(rows, cols)| board_vertices(kind, rows, cols));
        let whole = outline.clone().map(|outline| WholeBoard::new(kind, outline));
        let source = match (size, kind) {
            (Some(_), GridKind::Deltille) => {
                Source::Outline(outline.into_iter().flatten().collect())
            }
            (Some((rows, cols)), GridKind::Checker) => Source::Rectangle([rows, cols]),
            (None, _) => Source::None,
        };
        Self { source, whole, allow_mirrored: config.allow_mirrored }
    }

    /// Creates labels by the tags of a target and the outlines of its untagged panels.
    pub(crate) fn of_target(
        target: &Target,
        family: Option<&Family>,
        config: &DetectorConfig,
    ) -> Self {
        let tags =
            family.and_then(|family| TagLabeller::new(target, family, config.max_bit_errors));
        let whole = match &target.panels[..] {
            [only] => {
                let vertices = only.corners.iter().map(|c| Vertex::new(c.row, c.col));
                Some(WholeBoard::new(only.kind, vertices))
            }
            _ => None,
        };
        let panels = target.panels.iter().map(|panel| TargetPanel {
            id: panel.id,
            kind: panel.kind,
            size: [panel.matrix[1], panel.matrix[0]],
            inverted: panel.inverted,
            tagged: !panel.tags.is_empty(),
            corner_ids: panel.corners.iter().map(|c| (Vertex::new(c.row, c.col), c.id)).collect(),
        });
        let others =
            family.and_then(|family| SettingsFinder::new(target, family, config.max_bit_errors));
        let (tags, others) = (tags.map(Box::new), others.map(Box::new));
        let source = Source::Target { tags, panels: panels.collect(), others };
        Self { source, whole, allow_mirrored: config.allow_mirrored }
    }

    /// Creates labels by the tags and outlines of several distinguishable targets, each with its name.
    pub(crate) fn of_scene(targets: Vec<(String, Self)>) -> Self {
        let allow_mirrored = targets.iter().any(|(_, labels)| labels.allow_mirrored);
        Self { source: Source::Scene(targets), whole: None, allow_mirrored }
    }

    /// Returns the panels in a grid. If there are none, returns the grid with relative labels, and the reason.
    pub(crate) fn label(
        &self,
        image: ImageView,
        found: FoundGrid,
        budget: &mut Budget,
    ) -> Vec<(Grid, Option<Reason>)> {
        let grid = found.corners;
        let size = [image.width(), image.height()];
        match &self.source {
            Source::None => vec![(unlabelled(found), None)],
            Source::Outline(outline) => {
                let fit = |grid: &SaddleGrid| fit_outline(grid, outline, false);
                vec![self.on_outline(found, outline.len(), image, fit)]
            }
            Source::Rectangle([rows, cols]) => {
                let fit = |grid: &SaddleGrid| fit_rectangle(grid, [*rows, *cols], false);
                let expected = *rows as usize * *cols as usize;
                vec![self.on_outline(found, expected, image, fit)]
            }
            Source::Scene(targets) => in_scene(targets, image, found, budget),
            Source::Target { tags, panels, .. } => {
                let evidence = tags.as_ref().map(|tags| tags.label(image, grid, budget));
                let labelled = evidence.as_ref().map_or(&[][..], |evidence| &evidence.found);
                if labelled.is_empty() {
                    if let Some(by_outline) = on_untagged_panel(found, panels, false)
                        .or_else(|| on_only_panel(found, panels, image))
                    {
                        return vec![(by_outline, None)];
                    }
                    if let Some(in_a_mirror) = on_untagged_panel(found, panels, true) {
                        let allowed = self.allow_mirrored;
                        return vec![if allowed { (in_a_mirror, None) } else { in_mirror(found) }];
                    }
                    let why = match &evidence {
                        Some(evidence) => why::no_labels(evidence, grid, size),
                        None if have_equal_size(panels, grid) => {
                            Reason::new(ReasonKind::Ambiguous, [("corners", grid.len() as f64)])
                        }
                        None => why::no_outline(grid, largest(panels), size),
                    };
                    return vec![(unlabelled(found), Some(why))];
                }
                if !self.allow_mirrored && labelled.iter().any(|labelled| labelled.mirrored) {
                    return vec![in_mirror(found)];
                }
                // Corners that are joined to a labelled panel but belong to none are not reported.
                labelled.iter().map(|l| (on_panel(found, &panels[l.panel], l), None)).collect()
            }
        }
    }

    /// Returns the settings of a target with which the tags in a grid fit, if they contradict the target itself.
    pub(crate) fn other_settings(
        &self,
        image: ImageView,
        grid: &SaddleGrid,
    ) -> Option<OtherSettings> {
        match &self.source {
            Source::Target { others, .. } => others.as_ref()?.find(image, grid),
            Source::Scene(targets) => {
                targets.iter().find_map(|(_, labels)| labels.other_settings(image, grid))
            }
            Source::None | Source::Outline(_) | Source::Rectangle(_) => None,
        }
    }

    /// Returns the panel that a labelled grid shows.
    pub(crate) fn panel_of(&self, grid: &Grid) -> Option<PanelShape> {
        let untagged = |corners| Some(PanelShape { corners, tagged: Vec::new(), inverted: false });
        match &self.source {
            Source::None => None,
            Source::Outline(outline) => untagged(outline.clone()),
            Source::Rectangle([rows, cols]) => {
                let vertices = (0..*rows).flat_map(|row| (0..*cols).map(move |col| (row, col)));
                untagged(vertices.map(|(row, col)| Vertex::new(row as i32, col as i32)).collect())
            }
            Source::Scene(targets) => {
                let is_own = |(name, _): &&(String, Self)| grid.target.as_ref() == Some(name);
                targets.iter().find(is_own)?.1.panel_of(grid)
            }
            Source::Target { tags, panels, .. } => {
                let index = panels.iter().position(|panel| Some(panel.id) == grid.panel)?;
                let panel = &panels[index];
                let tagged = tags.iter().flat_map(|tags| tags.tagged_tiles(index)).collect();
                let corners = panel.corner_ids.keys().copied().collect();
                Some(PanelShape { corners, tagged, inverted: panel.inverted })
            }
        }
    }

    /// Returns the board, if it is the only target.
    pub(crate) fn whole(&self) -> Option<&WholeBoard> {
        self.whole.as_ref()
    }

    /// Returns whether absolute labels are requested.
    pub(crate) fn are_wanted(&self) -> bool {
        !matches!(self.source, Source::None)
    }

    /// Returns the number of corners of the largest target. A larger grid without a tag is not a
    /// target: a halftone, a fabric or a tiled floor can be regular, too, but seldom has so few
    /// corners.
    pub(crate) fn most_corners(&self) -> usize {
        match &self.source {
            Source::None => MAX_CORNERS,
            Source::Outline(outline) => outline.len(),
            Source::Rectangle([rows, cols]) => *rows as usize * *cols as usize,
            Source::Target { panels, .. } => {
                // Untagged faces may appear side by side as one grid.
                let untagged = panels.iter().filter(|panel| !panel.tagged);
                let together = untagged.map(|panel| panel.corner_ids.len()).sum();
                largest(panels).max(together)
            }
            Source::Scene(targets) => {
                targets.iter().map(|(_, labels)| labels.most_corners()).max().unwrap_or(0)
            }
        }
    }

    /// Labels a grid by the outline of an untagged board. The mirror image of a whole board may also
    /// fit.
    fn on_outline(
        &self,
        found: FoundGrid,
        expected: usize,
        image: ImageView,
        fit: impl Fn(&SaddleGrid) -> Option<LatticeMap>,
    ) -> (Grid, Option<Reason>) {
        let is_whole = found.corners.len() == expected;
        if let Some(map) = fit(found.corners) {
            let label = |v| Some((map.apply(v), None));
            let labelled = relabelled(found, label, None, Vec::new());
            if is_whole || is_all_there_is(image, &labelled) {
                return (labelled, None);
            }
        }
        let in_mirror_image = is_whole.then(|| fit(&mirror_image(found.corners))).flatten();
        let Some(map) = in_mirror_image else {
            let size = [image.width(), image.height()];
            return (unlabelled(found), Some(why::no_outline(found.corners, expected, size)));
        };
        if !self.allow_mirrored {
            return in_mirror(found);
        }
        let label = |v| Some((map.apply(mirrored(v)), None));
        (Grid { mirrored: true, ..relabelled(found, label, None, Vec::new()) }, None)
    }
}

/// Returns the panels of the first target that is found in a grid; no two targets share tags. If no
/// target fits, returns the result of a target whose tags were read.
fn in_scene(
    targets: &[(String, Labels)],
    image: ImageView,
    found: FoundGrid,
    budget: &mut Budget,
) -> Vec<(Grid, Option<Reason>)> {
    let mut without = Vec::new();
    for (name, labels) in targets {
        let mut grids = labels.label(image, found, budget);
        let is_of_target =
            |(grid, _): &(Grid, Option<Reason>)| grid.panel.is_some() || grid.mirrored;
        if grids.iter().any(is_of_target) {
            grids.iter_mut().for_each(|(grid, _)| grid.target = Some(name.clone()));
            return grids;
        }
        without.extend(grids);
    }
    let of_tags_read = |(_, reason): &(Grid, Option<Reason>)| {
        reason.as_ref().is_some_and(|reason| reason.kind.is_of_tags_read())
    };
    let first = without.iter().position(of_tags_read).unwrap_or_default();
    without.into_iter().skip(first).take(1).collect()
}

/// Returns a mirrored grid without labels, and the reason.
fn in_mirror(found: FoundGrid) -> (Grid, Option<Reason>) {
    let why = Reason::new(ReasonKind::Mirrored, [("corners", found.corners.len() as f64)]);
    (Grid { mirrored: true, ..unlabelled(found) }, Some(why))
}

/// Removes corners and tags that a larger grid of the same panel, earlier in the list, already
/// contains. Next to a tag that is only a few pixels wide, a corner may be found twice, 1 px apart.
/// Returns a reason if copies are a whole edge apart.
pub(crate) fn report_once(grids: &mut Vec<(Grid, Option<Reason>)>) -> Option<Reason> {
    let (mut corners, mut tags) = (BTreeMap::new(), BTreeSet::new());
    let mut elsewhere = 0;
    grids.retain_mut(|(grid, _)| {
        if let Some(panel) = grid.panel {
            let panel = (grid.target.clone(), panel);
            let edge_px = grid.edge_px().unwrap_or(f64::INFINITY);
            grid.corners.retain(|&GridCorner { row, col, x, y, .. }| {
                let [x0, y0] = match corners.entry((panel.clone(), row, col)) {
                    Entry::Vacant(entry) => {
                        entry.insert([x, y]);
                        return true;
                    }
                    Entry::Occupied(entry) => *entry.get(),
                };
                elsewhere += usize::from((x - x0).hypot(y - y0) > edge_px);
                false
            });
            grid.tags.retain(|tag| tags.insert((panel.clone(), tag.row, tag.col)));
        }
        !grid.corners.is_empty()
    });
    (elsewhere > 0).then(|| Reason::new(ReasonKind::SeenTwice, [("corners", elsewhere as f64)]))
}

fn unlabelled(found: FoundGrid) -> Grid {
    relabelled(found, |v| Some((v, None)), None, Vec::new())
}

fn on_panel(found: FoundGrid, panel: &TargetPanel, labelled: &Labelled) -> Grid {
    let label = |v: Vertex| {
        let vertex = *labelled.vertices.get(&v)?;
        Some((vertex, panel.corner_ids.get(&vertex).copied()))
    };
    let labels = relabelled(found, label, Some(panel.id), labelled.tags.clone());
    Grid { mirrored: labelled.mirrored, ..labels }
}

/// Returns the number of corners of the largest panel.
fn largest(panels: &[TargetPanel]) -> usize {
    panels.iter().map(|panel| panel.corner_ids.len()).max().unwrap_or(0)
}

/// Returns whether the number of corners of a grid equals that of several untagged panels that
/// cannot be distinguished, for example the faces of a solid.
fn have_equal_size(panels: &[TargetPanel], grid: &SaddleGrid) -> bool {
    let is_full = |panel: &&TargetPanel| !panel.tagged && panel.corner_ids.len() == grid.len();
    panels.iter().filter(is_full).count() > 1
}

/// Returns whether a labelled grid with missing corners shows a board that does not continue beyond its outline.
fn is_all_there_is(image: ImageView, grid: &Grid) -> bool {
    is_seen_to_end(image, grid) && is_of_squares(image, grid, 0.0, false)
}

/// Returns the grid, direct or mirrored, on the only untagged panel whose outline it fills.
fn on_untagged_panel(found: FoundGrid, panels: &[TargetPanel], is_mirrored: bool) -> Option<Grid> {
    let filled = panels.iter().filter(|panel| panel.corner_ids.len() == found.corners.len());
    on_one_of(found, filled, is_mirrored)
}

/// Returns a grid with missing corners on the only untagged panel that it fits, if the image shows its ends.
fn on_only_panel(found: FoundGrid, panels: &[TargetPanel], image: ImageView) -> Option<Grid> {
    on_one_of(found, panels.iter(), false).filter(|grid| is_all_there_is(image, grid))
}

/// Returns the grid, direct or mirrored, on the only untagged one of these panels that it fits.
fn on_one_of<'a>(
    found: FoundGrid,
    panels: impl Iterator<Item = &'a TargetPanel>,
    is_mirrored: bool,
) -> Option<Grid> {
    let turned = if is_mirrored { mirror_image(found.corners) } else { found.corners.clone() };
    let alike = panels.filter(|panel| !panel.tagged && panel.kind == found.kind);
    let mut fitting = alike.filter_map(|panel| {
        let map = match panel.kind {
            GridKind::Deltille => {
                let outline = panel.corner_ids.keys().copied().collect();
                fit_outline(&turned, &outline, panel.inverted)
            }
            GridKind::Checker => fit_rectangle(&turned, panel.size, panel.inverted),
        };
        Some((panel, map?))
    });
    let (panel, map) = fitting.next()?;
    if fitting.next().is_some() {
        return None;
    }
    let label = |v| {
        let vertex = map.apply(if is_mirrored { mirrored(v) } else { v });
        Some((vertex, panel.corner_ids.get(&vertex).copied()))
    };
    let labels = relabelled(found, label, Some(panel.id), Vec::new());
    Some(Grid { mirrored: is_mirrored, ..labels })
}

/// Returns a grid with new labels, sorted by them. Corners without a label are omitted.
fn relabelled(
    found: FoundGrid,
    label: impl Fn(Vertex) -> Option<(Vertex, Option<u32>)>,
    panel: Option<u32>,
    tags: Vec<DecodedTag>,
) -> Grid {
    let mut corners: Vec<GridCorner> = found
        .corners
        .iter()
        .filter_map(|(&vertex, placed)| {
            let (Vertex { row, col }, id) = label(vertex)?;
            let (x, y) = placed.position.into();
            Some(GridCorner { row, col, id, x, y, cov: None })
        })
        .collect();
    corners.sort_by_key(|corner| (corner.row, corner.col));
    Grid { kind: found.kind, target: None, panel, mirrored: false, corners, tags }
}
