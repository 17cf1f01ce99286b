//! Other settings of a target with which the tags in a grid fit, if they contradict the target itself: swapped sides,
//! another spacing, another pattern, another first id, another family of the same number of bits.
//!
//! A tag of the grid and a place in a layout give a motion of the lattice and a first id. The settings on which most
//! tags agree are tried first. They count only if the labeller would label the grid with them, so the evidence of all
//! tiles decides, as for a given target.

use std::cmp::Reverse;
use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, OnceLock};

use super::placement::labeller::{Budget, TagLabeller};
use super::placement::motion::panel_from_grid;
use super::tags::{Read, TagPlace, TagReader};
use crate::grid::saddle_grid::SaddleGrid;
use deltille_core::detection::OtherSettings;
use deltille_core::family::{Decoder, Family, dictionary, dictionary_names, shipped_families};
use deltille_core::lattice::{GridKind, LatticeMap, Tile};
use deltille_core::raster::ImageView;
use deltille_core::targets::{AprilGridSpec, CharucoSpec, Target, TargetSpec};

/// Minimum number of tags that agree on settings. A single tag fits every layout.
const MIN_TAGS: usize = 2;

/// Maximum number of tiles that are read; as many as a recogniser reads.
const MAX_TILES: usize = 600;

/// Maximum number of settings for which the whole grid is weighed, those of most tags. Where the outer
/// tiles are not read, the tags of a grid fit about three first ids in each of four layouts.
const MAX_WEIGHED: usize = 12;

/// Largest tag spacing that is tried, as by a recogniser.
const WIDEST_SPACING: u32 = 8;

/// Finds the settings of a target with which the tags in a grid fit.
#[derive(Clone, Debug)]
pub(crate) struct SettingsFinder {
    /// The target's settings, with the name of its family.
    spec: TargetSpec,
    family: Family,
    max_errors: Option<u32>,
    /// The family, and the shipped families of as many bits. Most images need none of them.
    families: OnceLock<Arc<Vec<(Family, Decoder)>>>,
}

/// A tag that was read.
struct Seen {
    /// Its tile in the grid.
    tile: Tile,
    id: u32,
    rotations: u8,
}

impl SettingsFinder {
    /// Creates a finder for a target with tags of a family; `None` if it has no other settings.
    pub(crate) fn new(target: &Target, family: &Family, max_errors: Option<u32>) -> Option<Self> {
        let has_settings = matches!(
            target.spec,
            TargetSpec::Board(_) | TargetSpec::Charuco(_) | TargetSpec::AprilGrid(_)
        );
        let spec = target.spec.clone();
        let spec = with_tags(spec.clone(), first_id(&spec)?, family.name());
        (has_settings && !family.is_position_family()).then(|| Self {
            spec,
            family: family.clone(),
            max_errors,
            families: OnceLock::new(),
        })
    }

    /// Returns the settings that differ from those of the target, if the tags in a grid fit other ones.
    pub(crate) fn find(&self, image: ImageView, grid: &SaddleGrid) -> Option<OtherSettings> {
        let own = Target::build("own", &self.spec, Some(&self.family)).ok()?;
        let panel = own.panels.first()?;
        let reader = TagReader::new(&self.family, TagPlace::of(panel));
        let read = reader.read(image, grid, &SaddleGrid::new(), panel.inverted, MAX_TILES);
        let families = self.families.get_or_init(|| Arc::new(self.families_alike()));
        let mut found: Vec<(usize, TargetSpec, &Family)> = Vec::new();
        for (family, decoder) in families.iter() {
            let seen = decoded(&read, family, decoder, reader.plain_word());
            if seen.len() < MIN_TAGS {
                continue;
            }
            for layout in layouts(&self.spec) {
                let first = with_tags(layout.clone(), 0, family.name());
                let Ok(of_layout) = Target::build("other", &first, Some(family)) else { continue };
                let (tags, first_ids) = agreeing(&of_layout, &seen);
                found.extend(first_ids.into_iter().map(|first_id| {
                    (tags, with_tags(layout.clone(), first_id, family.name()), family)
                }));
            }
        }
        // The target itself was weighed before. Other settings that place fewer tags do not explain its tags better.
        let of_own = found.iter().find(|(_, spec, _)| *spec == self.spec).map_or(0, |own| own.0);
        found.retain(|(tags, spec, _)| *tags >= of_own.max(MIN_TAGS) && *spec != self.spec);
        // Sorting is stable: the target's own family and layout come first.
        let own_id = first_id(&self.spec);
        found.sort_by_key(|(tags, spec, _)| (Reverse(*tags), first_id(spec) != own_id));
        let fits = |(_, spec, family): &(usize, TargetSpec, &Family)| {
            let target = Target::build("other", spec, Some(family)).ok()?;
            let labeller = TagLabeller::new(&target, family, self.max_errors)?;
            let evidence = labeller.label(image, grid, &mut Budget::default());
            evidence.found.iter().any(|found| !found.mirrored).then(|| changes(&self.spec, spec))
        };
        found.iter().take(MAX_WEIGHED).find_map(fits)
    }

    /// The family itself, then the shipped ones with as many bits. Families with fewer codes come first.
    fn families_alike(&self) -> Vec<(Family, Decoder)> {
        let (kind, dimension) = (self.family.kind(), self.family.dimension());
        let is_charuco = matches!(self.spec, TargetSpec::Charuco(_));
        let shipped = shipped_families()
            .filter(|family| !is_charuco && family.kind == kind && family.bits == dimension.bits())
            .map(|family| family.name);
        let is_alike = |name: &&str| {
            kind == GridKind::Checker && dictionary(name).is_some_and(|(_, own)| own == dimension)
        };
        let others = shipped.chain(dictionary_names().filter(is_alike));
        let others = others.filter(|name| *name != self.family.name());
        let others = others.filter_map(|name| Family::shipped(name).ok());
        let all = std::iter::once(self.family.clone()).chain(others);
        let with_decoder = |family: Family| {
            let decoder = Decoder::new(&family);
            (family, decoder)
        };
        all.map(with_decoder).collect()
    }
}

/// The tags of a family among the tiles that were read.
fn decoded(read: &Read, family: &Family, decoder: &Decoder, plain: u64) -> Vec<Seen> {
    let tiles = read.readings.iter().filter(|reading| reading.word() != plain);
    let seen = tiles.filter_map(|reading| {
        let found = decoder.decode(reading.word(), family.correctable() / 2)?;
        Some(Seen { tile: reading.tile, id: found.id, rotations: found.rotations })
    });
    seen.collect()
}

/// The first ids with which most tags have their place on a target whose first id is 0, and the number of these tags.
/// Several places may fit the tags alone.
fn agreeing(target: &Target, seen: &[Seen]) -> (usize, BTreeSet<u32>) {
    let mut counts: HashMap<(usize, LatticeMap, u32), usize> = HashMap::new();
    for (index, panel) in target.panels.iter().enumerate() {
        for (tag, seen) in panel.tags.iter().flat_map(|tag| seen.iter().map(move |s| (tag, s))) {
            let Some(first_id) = seen.id.checked_sub(tag.id) else { continue };
            let map = panel_from_grid(seen.tile, panel.tag_tile(tag), seen.rotations);
            *counts.entry((index, map, first_id)).or_default() += 1;
        }
    }
    let most = counts.values().copied().max().unwrap_or_default();
    let of_most = counts.into_iter().filter(|(_, tags)| *tags == most);
    (most, of_most.map(|((.., first_id), _)| first_id).collect())
}

/// The layouts that are tried: the given one, then those of other settings.
fn layouts(spec: &TargetSpec) -> Vec<TargetSpec> {
    let swapped = |[a, b]: [u32; 2]| [b, a];
    match spec {
        TargetSpec::Board(board) => {
            let own = board.tags.as_ref().map_or(1, |tags| tags.spacing);
            let others = (1..=WIDEST_SPACING).filter(move |&spacing| spacing != own);
            let of_spacing = std::iter::once(own).chain(others).flat_map(|spacing| {
                [[board.rows, board.cols], [board.cols, board.rows]].map(|[rows, cols]| {
                    let mut other = board.clone();
                    (other.rows, other.cols) = (rows, cols);
                    other.tags.iter_mut().for_each(|tags| tags.spacing = spacing);
                    TargetSpec::Board(other)
                })
            });
            of_spacing.collect()
        }
        TargetSpec::Charuco(charuco) => {
            let sizes = [charuco.squares, swapped(charuco.squares)];
            let all = sizes.into_iter().flat_map(|squares| {
                [charuco.legacy, !charuco.legacy].map(|legacy| {
                    TargetSpec::Charuco(CharucoSpec { squares, legacy, ..charuco.clone() })
                })
            });
            all.collect()
        }
        TargetSpec::AprilGrid(grid) => [grid.tags, swapped(grid.tags)]
            .map(|tags| TargetSpec::AprilGrid(AprilGridSpec { tags, ..grid.clone() }))
            .to_vec(),
        _ => Vec::new(),
    }
}

/// The first id of a board with tags.
fn first_id(spec: &TargetSpec) -> Option<u32> {
    match spec {
        TargetSpec::Board(board) => board.tags.as_ref().map(|tags| tags.first_id),
        TargetSpec::Charuco(charuco) => Some(charuco.first_id),
        TargetSpec::AprilGrid(grid) => Some(grid.first_id),
        _ => None,
    }
}

/// The settings with another first id and family.
fn with_tags(mut spec: TargetSpec, first_id: u32, family: &str) -> TargetSpec {
    let family = family.to_owned();
    match &mut spec {
        TargetSpec::Board(board) => board
            .tags
            .iter_mut()
            .for_each(|tags| (tags.first_id, tags.family) = (first_id, family.clone())),
        TargetSpec::Charuco(charuco) => (charuco.first_id, charuco.dictionary) = (first_id, family),
        TargetSpec::AprilGrid(grid) => (grid.first_id, grid.family) = (first_id, family),
        _ => {}
    }
    spec
}

/// Columns and rows, as the settings count them.
fn size(spec: &TargetSpec) -> Option<[u32; 2]> {
    match spec {
        TargetSpec::Board(board) => Some([board.cols, board.rows]),
        TargetSpec::Charuco(charuco) => Some(charuco.squares),
        TargetSpec::AprilGrid(grid) => Some(grid.tags),
        _ => None,
    }
}

/// The settings in which `other` differs from `own`.
fn changes(own: &TargetSpec, other: &TargetSpec) -> OtherSettings {
    let spacing = |spec: &TargetSpec| match spec {
        TargetSpec::Board(board) => board.tags.as_ref().map(|tags| tags.spacing),
        _ => None,
    };
    let legacy = |spec: &TargetSpec| match spec {
        TargetSpec::Charuco(charuco) => Some(charuco.legacy),
        _ => None,
    };
    let mut found = OtherSettings::default();
    found.size = size(other).filter(|_| size(own) != size(other));
    found.spacing = spacing(other).filter(|_| spacing(own) != spacing(other));
    found.legacy = legacy(other).filter(|_| legacy(own) != legacy(other));
    found.first_id = first_id(other).filter(|_| first_id(own) != first_id(other));
    found.family = other.family().filter(|_| own.family() != other.family()).map(str::to_owned);
    found
}
