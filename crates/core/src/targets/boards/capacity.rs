//! Remedies for families with too few codes for a target.

use crate::family::{Family, smallest_shipped};
use crate::lattice::GridKind;
use crate::setting::Setting::{
    self, FamilyShippedNames, SolidSquareTagsFamily, SolidSquareTagsFirstId, TagFamily, TagFirstId,
    TagHoleMm, TagSpacing,
};
use crate::targets::{FamilyRef, TagSpec, TargetError};

/// Largest spacing that messages propose: a single tag among twenty tiles is easily hidden.
const SPARSEST: u32 = 20;

/// The settings of the family and ids of tags.
#[derive(Clone, Copy)]
pub(in crate::targets) struct TagSettings {
    family: Setting,
    first_id: Setting,
}

impl TagSettings {
    /// Settings for all tags of a target.
    pub(crate) const TAGS: Self = Self { family: TagFamily, first_id: TagFirstId };

    /// Settings for square tags beside triangular ones.
    pub(crate) const SQUARE_TAGS: Self =
        Self { family: SolidSquareTagsFamily, first_id: SolidSquareTagsFirstId };

    /// Returns the settings for tags in tiles of a kind, on a target of one or two tilings.
    pub(crate) fn of(kind: GridKind, has_both: bool) -> Self {
        if has_both && kind == GridKind::Checker { Self::SQUARE_TAGS } else { Self::TAGS }
    }

    /// Returns the setting of the first id.
    pub(crate) fn first_id(self) -> Setting {
        self.first_id
    }
}

/// Checks that a family has `count` codes starting at the first id; `instead` names other remedies.
pub(in crate::targets) fn check_ids(
    settings: TagSettings,
    first: u32,
    count: u64,
    family: &Family,
    instead: impl FnOnce() -> String,
) -> Result<FamilyRef, TargetError> {
    let (there, end) = (family.len() as u64, u64::from(first) + count);
    if end <= there {
        return Ok(FamilyRef::of(family));
    }
    Err(TargetError::IdsRunOut {
        setting: settings.first_id,
        first,
        last: end - 1,
        family: family.name().to_owned(),
        end: there - 1,
        instead: instead(),
    })
}

/// Checks that the family exists, fits tiles of this kind, and has `needed` codes starting at the
/// first id. `instead` lists remedies other than ids and family, given the number of codes starting
/// at the first id.
pub(in crate::targets) fn check_family(
    kind: GridKind,
    tags: &TagSpec,
    edge_mm: f64,
    family: Option<&Family>,
    needed: u64,
    settings: TagSettings,
    instead: impl FnOnce(u64) -> Vec<String>,
) -> Result<FamilyRef, TargetError> {
    let Some(family) = family else {
        let given = "but no family was given".to_owned();
        return Err(TargetError::Family { wanted: tags.family.clone(), given });
    };
    let family = family.of_tiling(kind).unwrap_or(family);
    if family.kind() != kind {
        let problem = match kind {
            GridKind::Deltille => format!(
                "has square tags, but deltille tiles need triangular ones: use one of {FamilyShippedNames}"
            ),
            GridKind::Checker => {
                "has triangular tags, but squares need square ones: use aprilTag36h11, aprilTag25h9 or aprilTag16h5"
                    .to_owned()
            }
        };
        return Err(TargetError::invalid(settings.family, format!("{} {problem}", family.name())));
    }
    if let Some(hole_mm) = tags.hole_mm
        && let Some(problem) = no_room_for_hole(family, edge_mm, tags.border_bits, hole_mm)
    {
        return Err(TargetError::invalid(TagHoleMm, problem));
    }
    check_ids(settings, tags.first_id, needed, family, || {
        let (there, first) = (family.len() as u64, u64::from(tags.first_id));
        let mut proposals = Vec::new();
        if let Some(highest) = there.checked_sub(needed) {
            proposals.push(format!("lower it to at most {highest}"));
        }
        proposals.extend(instead(there.saturating_sub(first)));
        if let Some(larger) = smallest_shipped(kind, first + needed, 0) {
            let (name, codes) = (larger.name, larger.codes);
            proposals.push(format!("use {} {name} with its {codes} codes", settings.family));
        }
        if proposals.is_empty() {
            proposals.push(
                "make a smaller target, or generate a larger family with `deltag gen-family`"
                    .to_owned(),
            );
        }
        proposals.join(", or ")
    })
}

/// Usable fraction of the free cells for a hole: a ring of black around it keeps its edge visible and tolerates an
/// inaccurate drill.
const HOLE_PART: f64 = 0.9;

/// Returns why a hole does not fit the tags of a family on tiles of a size; `None` if it fits.
pub(in crate::targets) fn no_room_for_hole(
    family: &Family,
    edge_mm: f64,
    border_bits: f64,
    hole_mm: f64,
) -> Option<String> {
    let name = family.name();
    let Some(free) = family.rules().free else {
        return Some(format!(
            "the codes of {name} use the central cells: generate a family that leaves them free with `deltag gen-family --free centre`"
        ));
    };
    let bit_mm = edge_mm / family.cells().width(border_bits);
    let most = 2.0 * HOLE_PART * bit_mm * free.radius_bits(family.dimension());
    (hole_mm > most).then(|| {
        let most = (most * 100.0).floor() / 100.0;
        format!("the free cells of {name} fit a hole of at most {most} mm; larger tiles fit a larger hole")
    })
}

/// Proposes the smallest spacing above that of `tags` that needs at most `count` tags.
pub(in crate::targets) fn wider_spacing(
    tags: &TagSpec,
    available: u64,
    count: impl Fn(u32) -> u64,
) -> Option<String> {
    let spacing = (tags.spacing + 1..=SPARSEST).find(|&spacing| count(spacing) <= available)?;
    Some(format!("raise {TagSpacing} to at least {spacing}"))
}
