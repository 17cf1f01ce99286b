//! The photographed target, and the checks of detections against it: identity, panels, corners and tags.

use std::collections::BTreeMap;

use glam::DVec3;

use super::grid::{UntaggedGrid, assume_target};
use super::observation::{Observation, Sighting, View};
use super::panel::{PanelPrior, PanelRef};
use deltille_core::camera::Pose;
use deltille_core::detection::{Detection, Grid};
use deltille_core::lattice::LatticeMap;
use deltille_core::setting::Setting::UntaggedGridKind;
use deltille_core::targets::{Panel, Target, TargetIdentity};

/// Message for a board of the other tiling.
fn other_kind() -> String {
    format!(
        "the board in the image has the other tiling: set {UntaggedGridKind} to the tiling of the board"
    )
}

/// Conclusion from labels that are not on the target.
const OTHER_TARGET: &str = "; the detection shows another target";

/// Message for a detection that was made with one of several targets.
const OF_ONE_TARGET: &str =
    "it does not say which target its corners belong to: detect again with all targets at once";

/// Message for labels of an untagged grid that are not on the target.
const CUT_OFF: &str = "its rows and columns do not match the target: it shows another board, or only part of a board without \
                       tags (rows and columns are known only if the whole board is visible)";

/// The photographed target or board.
#[derive(Clone, Copy, Debug)]
pub enum Reference<'a> {
    /// A target with a description.
    Target(&'a Target),
    /// Several targets that are fixed to each other; each detection says which target a grid belongs to.
    Scene(&'a [Target]),
    /// An untagged board without a description.
    Grid(UntaggedGrid),
}

impl Reference<'_> {
    /// The poses of the panels on the target.
    pub fn panels(&self) -> Vec<PanelPrior> {
        match self {
            Self::Grid(_) => vec![Pose::IDENTITY.into()],
            Self::Target(_) | Self::Scene(_) => {
                let panels = self.targets().iter().flat_map(|target| &target.panels);
                panels.map(|panel| (&panel.pose).into()).collect()
            }
        }
    }

    /// The rotations of each panel's labels that look the same in an image, see [`Panel::label_symmetries`].
    pub fn label_symmetries(&self) -> Vec<Vec<LatticeMap>> {
        match self {
            Self::Grid(grid) => vec![grid.label_symmetries()],
            Self::Target(_) | Self::Scene(_) => {
                let panels = self.targets().iter().flat_map(|target| &target.panels);
                panels.map(Panel::label_symmetries).collect()
            }
        }
    }

    /// The ambiguity due to a rotation that looks the same in an image, as a sentence without
    /// initial capital and full stop; `None` if the labels are unambiguous.
    pub fn label_ambiguity(&self) -> Option<String> {
        let maps = self.label_symmetries();
        let of_most = maps.iter().max_by_key(|maps| maps.len()).filter(|maps| !maps.is_empty())?;
        let degrees = 360 / (of_most.len() + 1);
        Some(format!(
            "the board has no tags and looks the same after a rotation by {degrees}°, so its labels follow its \
             orientation in the image, and {} poses are possible",
            of_most.len() + 1
        ))
    }

    /// The described targets; empty for an untagged board without a description.
    pub fn targets(&self) -> &[Target] {
        match *self {
            Self::Grid(_) => &[],
            Self::Target(target) => std::slice::from_ref(target),
            Self::Scene(targets) => targets,
        }
    }

    /// Identities of the targets; for an untagged board of known size, the identity of the equivalent target.
    pub fn identities(&self) -> Vec<TargetIdentity> {
        match self {
            Self::Grid(grid) => {
                let made = grid.target("board").and_then(Result::ok);
                made.map(|target| target.identity()).into_iter().collect()
            }
            Self::Target(_) | Self::Scene(_) => {
                self.targets().iter().map(Target::identity).collect()
            }
        }
    }

    /// Finds a panel by its id (0 on an untagged board) and, if there are several targets, the name of its target.
    pub fn panel(&self, target: Option<&str>, id: u32) -> Option<PanelRef> {
        if let Self::Grid(_) = self {
            return (id == PanelRef::ONLY.id()).then_some(PanelRef::ONLY);
        }
        let mut first = 0;
        for of_scene in self.targets() {
            let is_it = target.is_none_or(|name| is_named(of_scene, name));
            let index = of_scene.panels.iter().position(|panel| is_it && panel.id == id);
            if let Some(index) = index {
                return Some(PanelRef::new(first + index, id));
            }
            first += of_scene.panels.len();
        }
        None
    }

    /// Whether the labels of a view are certainly those of the target: because of its tags, or because the whole board
    /// is visible.
    pub fn has_certain_labels(&self, view: &View) -> bool {
        if let Self::Grid(grid) = self {
            let whole = grid.size.map(|[rows, cols]| rows as usize * cols as usize);
            return whole.is_some_and(|count| view.corner_count() >= count);
        }
        let mut first = 0;
        self.targets().iter().all(|target| {
            let of_target = first..first + target.panels.len();
            first = of_target.end;
            let seen = view.sightings.iter().filter(|s| of_target.contains(&s.panel.index()));
            let seen: usize = seen.map(|sighting| sighting.observations.len()).sum();
            let is_tagged = target.panels.iter().all(|panel| !panel.tags.is_empty());
            let is_absent = seen == 0 && self.targets().len() > 1;
            let whole: usize = target.panels.iter().map(|panel| panel.corners.len()).sum();
            is_tagged || is_absent || seen >= whole
        })
    }

    /// Whether the labels of a view identify the corners of the board, except for a [symmetry](Self::label_symmetries).
    /// This is always true for targets. For an untagged board it is true if rows and columns are given and the view
    /// reaches from the first to the last of them.
    pub fn labels_are_of_board(&self, view: &View) -> bool {
        let Self::Grid(grid) = self else { return true };
        view.sightings.iter().all(|sighting| {
            let labels = sighting.observations.iter().map(|seen| (seen.row, seen.col));
            grid.is_spanned_by(&labels.collect())
        })
    }

    /// Whether its panels are boards that are not fixed to each other.
    pub fn is_loose(&self) -> bool {
        self.targets().iter().any(|target| target.is_loose())
    }

    /// Id of a panel; `None` on an untagged board.
    pub(super) fn panel_id(&self, panel: PanelRef) -> Option<u32> {
        match self {
            Self::Grid(_) => None,
            Self::Target(_) | Self::Scene(_) => Some(panel.id()),
        }
    }

    /// Returns the panels in a detection; or the wrong panel, and the reason. `identities` are those of the targets.
    pub(super) fn sightings(
        &self,
        detection: &Detection,
        identities: &[TargetIdentity],
    ) -> Result<Vec<Sighting>, (Option<u32>, String)> {
        match self {
            Self::Grid(board) => {
                let of_kind = detection.grids.iter().filter(|grid| grid.kind == board.kind);
                let Some(grid) = of_kind.max_by_key(|grid| grid.corners.len()) else {
                    return match detection.grids.first() {
                        Some(_) => Err((None, other_kind())),
                        None => Ok(Vec::new()),
                    };
                };
                let check = board.check_target(detection.target_of(grid));
                check.and_then(|()| board.check(grid)).map_err(|problem| (None, problem))?;
                let at = |row, col| board.place(row, col);
                Ok(vec![Sighting { panel: PanelRef::ONLY, observations: observations(grid, at) }])
            }
            Self::Target(_) | Self::Scene(_) => {
                let grids = detection.grids.iter();
                let found = grids.filter_map(|grid| {
                    let seen = detection.target_of(grid);
                    let index = self.target_of(grid, seen, identities);
                    let on_it = |index: Option<usize>| match index {
                        Some(index) => self.on_target(index, grid),
                        None => Ok(None),
                    };
                    index.and_then(on_it).map_err(|problem| (grid.panel, problem)).transpose()
                });
                found.collect()
            }
        }
    }
}

impl Reference<'_> {
    /// Checks the labels of a detected grid against the target: identity, panel, corners and tags.
    ///
    /// # Errors
    /// Returns a sentence that names the label that is not on the target.
    pub fn check_labels(&self, detection: &Detection, grid: &Grid) -> Result<(), String> {
        let identities = self.identities();
        match self.target_of(grid, detection.target_of(grid), &identities)? {
            Some(index) => self.on_target(index, grid).map(drop),
            None => Ok(()),
        }
    }

    /// Returns the index of the target that a grid belongs to. It is found by the identity of the
    /// target that was used for labelling, or by the name if the detection lacks the identity.
    /// `None` if the grid belongs to none of these targets.
    fn target_of(
        &self,
        grid: &Grid,
        seen: Option<&TargetIdentity>,
        identities: &[TargetIdentity],
    ) -> Result<Option<usize>, String> {
        let targets = self.targets();
        let Some(seen) = seen else {
            return match &grid.target {
                Some(name) => Ok(targets.iter().position(|target| is_named(target, name))),
                None if targets.len() == 1 => Ok(Some(0)),
                None if grid.panel.is_none() => Ok(None),
                None => Err(OF_ONE_TARGET.to_owned()),
            };
        };
        if let Some(index) = identities.iter().position(|own| own.is_same_print(seen)) {
            return Ok(Some(index));
        }
        // Other targets in the same image are ignored, unless they can be mistaken for these.
        let confusable = identities.iter().find(|own| own.is_confusable(seen));
        match confusable.or_else(|| identities.first().filter(|_| grid.target.is_none())) {
            Some(own) => Err(format!(
                "it was detected as {seen}, but the given target is {own}: {}",
                assume_target()
            )),
            None => Ok(None),
        }
    }

    /// Returns the corners of a grid on its panel of a target; `None` if the grid was not labelled.
    fn on_target(&self, index: usize, grid: &Grid) -> Result<Option<Sighting>, String> {
        let targets = self.targets();
        let first = targets[..index].iter().map(|target| target.panels.len()).sum();
        on_target(&targets[index], first, grid)
    }
}

/// Whether a target has this name; a measured target or one with refined panels is still the same target.
fn is_named(target: &Target, name: &str) -> bool {
    let of_print = |name: &str| -> String {
        let mut name = name;
        while let Some(shorter) =
            name.strip_suffix("-measured").or_else(|| name.strip_suffix("-refined"))
        {
            name = shorter;
        }
        name.to_owned()
    };
    of_print(&target.name) == of_print(name)
}

/// Returns the corners of a grid on its panel; panel indices start at `first`. `None` if the grid was not labelled
/// and the target has several panels.
fn on_target(target: &Target, first: usize, grid: &Grid) -> Result<Option<Sighting>, String> {
    let index = match grid.panel {
        Some(id) => target.panels.iter().position(|panel| panel.id == id),
        None if target.panels.len() == 1 && target.panels[0].tags.is_empty() => Some(0),
        None => return Ok(None),
    };
    let Some(index) = index else {
        let id = grid.panel.unwrap_or_default();
        return Err(format!("panel {id} is not on target {}{OTHER_TARGET}", target.name));
    };
    let panel = &target.panels[index];
    check_panel(target, panel, grid).map_err(|problem| problem + OTHER_TARGET)?;
    let from_target = panel.pose.to_pose().inverse();
    let places: BTreeMap<(i32, i32), DVec3> = panel
        .corners
        .iter()
        .map(|corner| {
            let place = from_target.apply(corner.target_mm) + corner.offset_mm();
            ((corner.row, corner.col), place)
        })
        .collect();
    let mut found = Vec::new();
    for corner in &grid.corners {
        match places.get(&(corner.row, corner.col)) {
            Some(&place) => found.push((corner.row, corner.col, place)),
            None if grid.panel.is_none() && corner.id.is_none() => {
                return Err(CUT_OFF.to_owned());
            }
            None => {
                let swapped = places.contains_key(&(corner.col, corner.row));
                let hint = if swapped { " (rows and columns swapped?)" } else { "" };
                return Err(format!(
                    "{} has no corner in row {}, column {}{hint}{OTHER_TARGET}",
                    target.name, corner.row, corner.col
                ));
            }
        }
    }
    let at = |row, col| places[&(row, col)];
    let panel = PanelRef::new(first + index, panel.id);
    Ok(Some(Sighting { panel, observations: observations(grid, at) }))
}

/// Checks the labels of a detected grid against its panel of the target.
fn check_panel(target: &Target, panel: &Panel, grid: &Grid) -> Result<(), String> {
    if panel.kind != grid.kind {
        return Err(format!("panel {} has a different tiling on {}", panel.id, target.name));
    }
    for corner in &grid.corners {
        let Some(id) = corner.id else { continue };
        let of_target = panel.corners.iter().find(|of_target| of_target.id == id);
        if let Some(of_target) = of_target
            && (of_target.row, of_target.col) != (corner.row, corner.col)
        {
            let swapped = (of_target.col, of_target.row) == (corner.row, corner.col);
            return Err(format!(
                "corner {id}: row {}, column {} in the detection, but row {}, column {} on {}{}",
                corner.row,
                corner.col,
                of_target.row,
                of_target.col,
                target.name,
                if swapped { " (rows and columns swapped?)" } else { "" }
            ));
        }
        if of_target.is_none() {
            return Err(format!("corner {id} is not on {}", target.name));
        }
    }
    for tag in &grid.tags {
        let same = panel.tags.iter().any(|t| (t.id, t.row, t.col) == (tag.id, tag.row, tag.col));
        let family = target.family.as_ref().map(|family| &*family.of_tiling(panel.kind).name);
        if !same || family != Some(tag.family.as_str()) {
            return Err(format!(
                "tag {} of {} in row {}, column {} is not on {}",
                tag.id, tag.family, tag.row, tag.col, target.name
            ));
        }
    }
    Ok(())
}

fn observations(grid: &Grid, at: impl Fn(i32, i32) -> DVec3) -> Vec<Observation> {
    let seen = grid.corners.iter().map(|corner| Observation {
        row: corner.row,
        col: corner.col,
        panel_mm: at(corner.row, corner.col),
        pixel: corner.position(),
        cov: corner.cov,
    });
    seen.collect()
}
