//! What to do where a family has too few codes for a target.

use crate::family::{Family, smallest_shipped};
use crate::lattice::GridKind;
use crate::setting::Setting::{
    self, FamilyShippedNames, SolidSquareTagsFamily, SolidSquareTagsFirstId, TagFamily, TagFirstId,
    TagHoleMm, TagSpacing,
};
use crate::targets::{FamilyRef, TagSpec, TargetError};

/// Spacings beyond this are not proposed: a tag in twenty tiles is easily hidden.
const SPARSEST: u32 = 20;

/// What sets the family and the ids of tags.
#[derive(Clone, Copy)]
pub(in crate::targets) struct TagSettings {
    family: Setting,
    first_id: Setting,
}

impl TagSettings {
    /// Of all tags of a target.
    pub(crate) const TAGS: Self = Self { family: TagFamily, first_id: TagFirstId };

    /// Of square tags beside others.
    pub(crate) const SQUARE_TAGS: Self =
        Self { family: SolidSquareTagsFamily, first_id: SolidSquareTagsFirstId };

    /// Of the tags in tiles of a kind on a target of one or two tilings.
    pub(crate) fn of(kind: GridKind, has_both: bool) -> Self {
        if has_both && kind == GridKind::Checker { Self::SQUARE_TAGS } else { Self::TAGS }
    }

    /// What sets the first id.
    pub(crate) fn first_id(self) -> Setting {
        self.first_id
    }
}

/// Checks that a family has `count` codes from the first id on; `instead` says what else to change.
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

/// Checks that the family is there, for tiles of this kind, and has `needed` codes from the first
/// id on; `instead` lists
/// what other than ids and family to change, given how many codes there are from the first id on.
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
        let given = "and no family was given".to_owned();
        return Err(TargetError::Family { wanted: tags.family.clone(), given });
    };
    let family = family.of_tiling(kind).unwrap_or(family);
    if family.kind() != kind {
        let problem = match kind {
            GridKind::Deltille => format!(
                "has square tags, deltille tiles need triangular ones: take one of {FamilyShippedNames}"
            ),
            GridKind::Checker => {
                "has triangular tags, squares need one of aprilTag36h11, aprilTag25h9, aprilTag16h5"
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
            proposals.push(format!("take {} {name} with its {codes} codes", settings.family));
        }
        if proposals.is_empty() {
            proposals.push(
                "make a smaller target, or a larger family by `deltag gen-family`".to_owned(),
            );
        }
        proposals.join(", or ")
    })
}

/// Part of the free cells that a hole may take: around it there is a ring of black, so that its edge is seen, and a drill may
/// be a little off.
const HOLE_PART: f64 = 0.9;

/// Why there is no room for a hole in tags of a family on tiles of a size.
pub(in crate::targets) fn no_room_for_hole(
    family: &Family,
    edge_mm: f64,
    border_bits: f64,
    hole_mm: f64,
) -> Option<String> {
    let name = family.name();
    let Some(free) = family.rules().free else {
        return Some(format!(
            "the codes of {name} use the cells in the middle: make a family without them by `deltag gen-family --free centre`"
        ));
    };
    let bit_mm = edge_mm / family.cells().width(border_bits);
    let most = 2.0 * HOLE_PART * bit_mm * free.radius_bits(family.dimension());
    (hole_mm > most).then(|| {
        let most = (most * 100.0).floor() / 100.0;
        format!("the cells that {name} leaves free have room for a hole of at most {most} mm: larger tiles have more")
    })
}

/// The closest spacing above that of `tags` with which `count` tags are enough, as a proposal.
pub(in crate::targets) fn wider_spacing(
    tags: &TagSpec,
    available: u64,
    count: impl Fn(u32) -> u64,
) -> Option<String> {
    let spacing = (tags.spacing + 1..=SPARSEST).find(|&spacing| count(spacing) <= available)?;
    Some(format!("raise {TagSpacing} to at least {spacing}"))
}
