//! How the corners of a grid get absolute labels: by tags, by an outline, or not at all.
//!
//! A picture may show a board as in a mirror, flopped by a scanner, a projector or the camera's driver. Its grid
//! is a right-handed lattice like any other, but lies on the panel with rows and columns exchanged. Labels
//! of such a grid belong to no view of the print, so they are given only where they are asked for.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use super::placement::labeller::{Budget, Labelled, TagLabeller};
use super::why;
use crate::config::DetectorConfig;
use crate::grid::outline::{WholeBoard, fit_outline, fit_rectangle};
use crate::grid::saddle_grid::{SaddleGrid, mirror_image, mirrored};
use deltille_core::detection::{DecodedTag, Grid, GridCorner};
use deltille_core::detection::{Reason, ReasonKind};
use deltille_core::family::Family;
use deltille_core::lattice::{GridKind, LatticeMap, Vertex};
use deltille_core::raster::ImageView;
use deltille_core::targets::{Target, board_vertices};

/// A grid of corners without labels, and its tiling.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FoundGrid<'a> {
    pub kind: GridKind,
    pub corners: &'a SaddleGrid,
}

/// How corners get absolute labels.
#[derive(Clone, Debug)]
pub(crate) struct Labels {
    source: Source,
    /// The board, where one alone is looked for.
    whole: Option<WholeBoard>,
    allow_mirrored: bool,
}

#[derive(Clone, Debug)]
enum Source {
    /// They do not.
    None,
    /// By the outline of a board that is seen whole.
    Outline(BTreeSet<Vertex>),
    /// By the rows and columns of a checkerboard that is seen whole.
    Rectangle([u32; 2]),
    /// By the tags of a target, or by the outlines of its untagged panels.
    Target { tags: Option<Box<TagLabeller>>, panels: Vec<TargetPanel> },
    /// By whichever of several targets a grid belongs to, by their names.
    Scene(Vec<(String, Labels)>),
}

/// What the detector must know of a panel.
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

/// More corners than any board has: of 140 × 140 every one would have 14 px in a picture of 4 megapixels. Fabrics and
/// grids on screens have more, and made-up pictures so many that to refine them takes minutes.
pub(crate) const MOST_CORNERS: usize = 20_000;

impl Labels {
    /// By the rows and columns of an untagged board, where they are known.
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

    /// By the tags of a target, and the outlines of its untagged panels.
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
        let source = Source::Target { tags: tags.map(Box::new), panels: panels.collect() };
        Self { source, whole, allow_mirrored: config.allow_mirrored }
    }

    /// By the tags and outlines of several targets that can be told apart, each with its name.
    pub(crate) fn of_scene(targets: Vec<(String, Self)>) -> Self {
        let allow_mirrored = targets.iter().any(|(_, labels)| labels.allow_mirrored);
        Self { source: Source::Scene(targets), whole: None, allow_mirrored }
    }

    /// The panels in a grid; the grid itself with relative labels where there are none, and why there are
    /// none.
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
                vec![self.on_outline(found, outline.len(), size, fit)]
            }
            Source::Rectangle([rows, cols]) => {
                let fit = |grid: &SaddleGrid| fit_rectangle(grid, [*rows, *cols], false);
                let expected = *rows as usize * *cols as usize;
                vec![self.on_outline(found, expected, size, fit)]
            }
            Source::Scene(targets) => in_scene(targets, image, found, budget),
            Source::Target { tags, panels } => {
                let evidence = tags.as_ref().map(|tags| tags.label(image, grid, budget));
                let labelled = evidence.as_ref().map_or(&[][..], |evidence| &evidence.found);
                if labelled.is_empty() {
                    if let Some(by_outline) = on_untagged_panel(found, panels, false) {
                        return vec![(by_outline, None)];
                    }
                    if let Some(in_a_mirror) = on_untagged_panel(found, panels, true) {
                        let allowed = self.allow_mirrored;
                        return vec![if allowed { (in_a_mirror, None) } else { in_mirror(found) }];
                    }
                    let why = match &evidence {
                        Some(evidence) => why::no_labels(evidence, grid, size),
                        None if are_alike(panels, grid) => {
                            Reason::new(ReasonKind::Ambiguous, [("corners", grid.len() as f64)])
                        }
                        None => why::no_outline(grid, largest(panels), size),
                    };
                    return vec![(unlabelled(found), Some(why))];
                }
                if !self.allow_mirrored && labelled.iter().any(|labelled| labelled.mirrored) {
                    return vec![in_mirror(found)];
                }
                // What hangs on to labelled panels without being part of one is not reported.
                labelled.iter().map(|l| (on_panel(found, &panels[l.panel], l), None)).collect()
            }
        }
    }

    /// The board, where one alone is looked for.
    pub(crate) fn whole(&self) -> Option<&WholeBoard> {
        self.whole.as_ref()
    }

    /// Whether labels are looked for.
    pub(crate) fn are_wanted(&self) -> bool {
        !matches!(self.source, Source::None)
    }

    /// Corners of the largest thing that is looked for. What has more, and no tag that vouches for it, is another
    /// thing: a halftone, a fabric or a tiled floor is as regular as a board, but seldom as small.
    pub(crate) fn most_corners(&self) -> usize {
        match &self.source {
            Source::None => MOST_CORNERS,
            Source::Outline(outline) => outline.len(),
            Source::Rectangle([rows, cols]) => *rows as usize * *cols as usize,
            Source::Target { panels, .. } => {
                // Faces without tags may be seen side by side as one grid.
                let untagged = panels.iter().filter(|panel| !panel.tagged);
                let together = untagged.map(|panel| panel.corner_ids.len()).sum();
                largest(panels).max(together)
            }
            Source::Scene(targets) => {
                targets.iter().map(|(_, labels)| labels.most_corners()).max().unwrap_or(0)
            }
        }
    }

    /// A grid on the outline of an untagged board, which a mirror image may fit as well.
    fn on_outline(
        &self,
        found: FoundGrid,
        expected: usize,
        size: [usize; 2],
        fit: impl Fn(&SaddleGrid) -> Option<LatticeMap>,
    ) -> (Grid, Option<Reason>) {
        if let Some(map) = fit(found.corners) {
            let label = |v| Some((map.apply(v), None));
            return (relabelled(found, label, None, Vec::new()), None);
        }
        let Some(map) = fit(&mirror_image(found.corners)) else {
            return (unlabelled(found), Some(why::no_outline(found.corners, expected, size)));
        };
        if !self.allow_mirrored {
            return in_mirror(found);
        }
        let label = |v| Some((map.apply(mirrored(v)), None));
        (Grid { mirrored: true, ..relabelled(found, label, None, Vec::new()) }, None)
    }
}

/// The panels in a grid, of the first target that has it: no two have the same tags. Where none has, what a target says
/// whose tags were read.
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

/// A grid seen as in a mirror, which gets no labels.
fn in_mirror(found: FoundGrid) -> (Grid, Option<Reason>) {
    let why = Reason::new(ReasonKind::Mirrored, [("corners", found.corners.len() as f64)]);
    (Grid { mirrored: true, ..unlabelled(found) }, Some(why))
}

/// Leaves out of grids of one panel what a larger one, which comes before, has already: beside a tag of
/// few pixels corners may be found twice, a pixel apart. What is a whole edge apart is told.
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

/// Corners of the largest panel.
fn largest(panels: &[TargetPanel]) -> usize {
    panels.iter().map(|panel| panel.corner_ids.len()).max().unwrap_or(0)
}

/// Whether a grid has all corners of several untagged panels, such as those of a solid, which nothing tells apart.
fn are_alike(panels: &[TargetPanel], grid: &SaddleGrid) -> bool {
    let is_full = |panel: &&TargetPanel| !panel.tagged && panel.corner_ids.len() == grid.len();
    panels.iter().filter(is_full).count() > 1
}

/// The grid, as it is seen or in a mirror, on the one untagged panel whose outline it fills.
fn on_untagged_panel(found: FoundGrid, panels: &[TargetPanel], is_mirrored: bool) -> Option<Grid> {
    let turned = if is_mirrored { mirror_image(found.corners) } else { found.corners.clone() };
    let mut fitting = panels.iter().filter(|panel| !panel.tagged).filter_map(|panel| {
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

/// A grid with new labels, ordered by them; corners without a label are left out.
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
