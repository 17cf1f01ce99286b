use crate::family::{Family, positions};
use crate::setting::Setting::{BoardBoardId, SolidBoardId, TargetName};
use crate::targets::boards::capacity::TagSettings;
use crate::targets::boards::{aprilgrid, board, charuco, circles, tag_sheet};
use crate::targets::error::Problem;
use crate::targets::family_ref::Codes;
use crate::targets::solids::solid;
use crate::targets::{
    FamilyRef, ListFormat, ListedSpec, Name, Panel, Target, TargetError, TargetSpec, json,
};

impl Target {
    /// Makes a target from `spec` with a shipped family.
    ///
    /// # Errors
    /// Returns an error if the name is not a valid file name, a number is out of its range, or the
    /// family is not shipped or
    /// has too few codes.
    ///
    /// ```
    /// use deltille_core::targets::{BoardSpec, Target};
    ///
    /// let board = Target::new("desk", BoardSpec::deltille(10, 11, 20.0))?;
    /// assert_eq!(board.panels[0].corners.len(), 110);
    /// # Ok::<(), deltille_core::targets::TargetError>(())
    /// ```
    pub fn new(name: &str, spec: impl Into<TargetSpec>) -> Result<Target, TargetError> {
        let spec = spec.into();
        Self::build(name, &spec, shipped_family(&spec)?.as_ref())
    }

    /// Makes a target from `spec`. `family` contains the codes of the tags; an untagged target needs none.
    ///
    /// # Errors
    /// Returns an error if a number is out of its range, or `family` is not the one that `spec` names or has too few
    /// codes.
    pub fn build(
        name: &str,
        spec: &TargetSpec,
        family: Option<&Family>,
    ) -> Result<Target, TargetError> {
        let name = Name::new(name).map_err(|problem| TargetError::invalid(TargetName, problem))?;
        let codes = Codes::of(family.filter(|_| spec.family().is_some()));
        let (panels, family) = match spec {
            TargetSpec::Board(spec) => {
                spec.check()?;
                board::panels(spec, family)?
            }
            TargetSpec::Solid(spec) => solid::panels(spec, family)?,
            TargetSpec::Tags(spec) => {
                let (panels, family) = tag_sheet::tagged(spec, needed(family, &spec.family)?)?;
                (panels, Some(family))
            }
            TargetSpec::Charuco(spec) => {
                spec.check()?;
                let (panels, family) = charuco::tagged(spec, needed(family, &spec.dictionary)?)?;
                (panels, Some(family))
            }
            TargetSpec::AprilGrid(spec) => {
                spec.check()?;
                let (panels, family) = aprilgrid::tagged(spec, needed(family, &spec.family)?)?;
                (panels, Some(family))
            }
            TargetSpec::Circles(spec) => (circles::untied_panels(spec)?, None),
            TargetSpec::Listed(_) => return Err(TargetError::Listed),
        };
        Ok(Target { name, spec: spec.clone(), family, panels, plan: None, codes })
    }

    /// Makes a target from a list of its corners, without a specification.
    ///
    /// # Errors
    /// Returns the invalid field and its problem.
    #[doc(hidden)]
    pub fn listed(
        name: Name,
        format: ListFormat,
        family: FamilyRef,
        panels: Vec<Panel>,
    ) -> Result<Target, Problem> {
        let spec = TargetSpec::Listed(ListedSpec { format });
        let (family, codes) = (Some(family), Codes::default());
        let target = Target { name, spec, family, panels, plan: None, codes };
        json::check(&target)?;
        Ok(target)
    }

    /// Checks that this target can be used together with another one: no two tags of the same family and no two
    /// boards have the same id.
    ///
    /// # Errors
    /// Returns an error with the shared ids and the first free one.
    pub fn check_beside(&self, other: &Target) -> Result<(), TargetError> {
        let overlap = |setting, what, own: &[u32], others: &[u32]| {
            let (Some([first, last]), Some([_, high])) = (range(own), range(others)) else {
                return Ok(());
            };
            if !own.iter().any(|id| others.contains(id)) {
                return Ok(());
            }
            let (other, free) = (other.name.to_string(), u64::from(high) + 1);
            Err(TargetError::Overlap { setting, what, first, last, other, free })
        };
        let boards = |target: &Target| target.panels.iter().map(|p| p.id).collect::<Vec<_>>();
        for kind in self.tilings() {
            if let (Some((family, ids)), Some((same, others))) =
                (self.tags_of_tiling(kind), other.tags_of_tiling(kind))
                && family.name == same.name
                // Position codes follow from the ids of boards.
                && family.name != positions::NAME
            {
                let settings = TagSettings::of(kind, self.tilings().count() > 1);
                overlap(settings.first_id(), "tag ids", &ids, &others)?;
            }
        }
        let board_id = match self.spec {
            TargetSpec::Solid(_) => SolidBoardId,
            _ => BoardBoardId,
        };
        overlap(board_id, "board ids", &boards(self), &boards(other))
    }
}

/// Returns the shipped family that a spec names; `None` without tags.
///
/// # Errors
/// Returns an error if the named family is not shipped.
pub fn shipped_family(spec: &TargetSpec) -> Result<Option<Family>, TargetError> {
    let shipped = |name: Option<&str>| name.map(Family::shipped).transpose();
    let family = shipped(spec.family())
        .and_then(|family| Ok(Family::paired(family, shipped(spec.square_family())?)));
    family.map_err(|error| TargetError::UnknownFamily(error.to_string()))
}

/// Returns the family of the requested tags.
fn needed<'a>(family: Option<&'a Family>, wanted: &str) -> Result<&'a Family, TargetError> {
    let none = || TargetError::Family {
        wanted: wanted.to_owned(),
        given: "but no family was given".to_owned(),
    };
    family.ok_or_else(none)
}

/// Returns the lowest and highest id.
fn range(ids: &[u32]) -> Option<[u32; 2]> {
    Some([*ids.iter().min()?, *ids.iter().max()?])
}
