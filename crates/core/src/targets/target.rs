//! A target: what exists in the world.

use crate::family::Family;
use crate::lattice::GridKind;
use crate::targets::boards::capacity;
use crate::targets::family_ref::Codes;
use crate::targets::{
    FamilyRef, MeasuredPlace, Name, OtherFamily, Panel, PanelPose, TargetIdentity, TargetSpec,
    UnknownCodes,
};

/// A target: its panels with their corners and tags, whatever they are printed on.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Name of the target, which is the stem of the names of its files.
    pub name: Name,
    /// The specification that the target was made from.
    pub spec: TargetSpec,
    /// The family of its tags; `None` on an untagged target.
    pub family: Option<FamilyRef>,
    /// Planar pieces, by ascending id.
    pub panels: Vec<Panel>,
    /// Identity of the target as printed, where this one has measured corners or refined panels.
    pub plan: Option<TargetIdentity>,
    pub(in crate::targets) codes: Codes,
}

impl Target {
    /// The same target with its panels in other places, as they were measured; `poses` are as many
    /// as it has panels.
    pub fn with_poses(&self, poses: &[PanelPose]) -> Self {
        let mut target = self.clone();
        for (panel, pose) in target.panels.iter_mut().zip(poses) {
            panel.pose = *pose;
            for corner in &mut panel.corners {
                corner.target_mm = pose.target_from_panel(corner.panel_mm);
            }
        }
        target
    }

    /// Whether its panels are sheets that lie about, each for itself; also boards of a list that has no poses of them.
    pub fn is_loose(&self) -> bool {
        self.panels.len() > 1 && (!self.spec.is_rigid() || self.overlapping_boards().is_some())
    }

    /// Ids of two boards of a list that would be in one place: each is listed in a plane of its own, and the list has no
    /// poses of the boards.
    pub fn overlapping_boards(&self) -> Option<[u32; 2]> {
        let is_list = matches!(self.spec, TargetSpec::Listed(_));
        let panels: &[Panel] = if is_list { &self.panels } else { &[] };
        let pairs =
            panels.iter().enumerate().flat_map(|(i, a)| panels[..i].iter().map(move |b| (b, a)));
        let mut pairs = pairs.filter(|(a, b)| a.overlaps(b));
        pairs.next().map(|(a, b)| [a.id, b.id])
    }

    /// Whether its panels have places in one scene, as far as is known: a list tells nothing of what is around several.
    pub fn is_one_scene(&self) -> bool {
        let is_list = matches!(self.spec, TargetSpec::Listed(_));
        self.panels.len() <= 1 || !(self.is_loose() || is_list)
    }

    /// The tilings of its panels.
    pub fn tilings(&self) -> impl Iterator<Item = GridKind> {
        let has = |kind: &GridKind| self.panels.iter().any(|panel| panel.kind == *kind);
        [GridKind::Deltille, GridKind::Checker].into_iter().filter(has)
    }

    /// Its panels of a tiling alone.
    #[doc(hidden)]
    pub fn of_tiling(&self, kind: GridKind) -> Self {
        let panels = self.panels.iter().filter(|panel| panel.kind == kind).cloned().collect();
        Self { panels, ..self.clone() }
    }

    /// The ids of its tags in tiles of a kind, and their family.
    #[doc(hidden)]
    pub fn tags_of_tiling(&self, kind: GridKind) -> Option<(&FamilyRef, Vec<u32>)> {
        let own = self.panels.iter().filter(|panel| panel.kind == kind);
        let ids = own.flat_map(|panel| &panel.tags).map(|tag| tag.id).collect();
        Some((self.family.as_ref()?.of_tiling(kind), ids))
    }

    /// The family of its tags: the one that it was made with or given, else the shipped one of that name. `None` on an
    /// untagged target.
    ///
    /// # Errors
    /// Where none was given, and no shipped one has its codes.
    pub fn family(&self) -> Result<Option<&Family>, UnknownCodes> {
        let Some(named) = &self.family else { return Ok(None) };
        if let Some(codes) = self.codes.get() {
            return Ok(Some(codes));
        }
        let shipped = |named: &FamilyRef| Family::shipped(&named.name).ok();
        let squares = named.squares.as_deref().and_then(shipped);
        let found = Family::paired(shipped(named), squares);
        let found = found.filter(|family| self.check_families(family).is_ok());
        let unknown = || {
            let squares = named.squares.iter().map(|squares| format!(" and {}", squares.name));
            let family = squares.fold(named.name.clone(), |names, name| names + &name);
            UnknownCodes { target: self.name.to_string(), family }
        };
        found.map(|family| Some(self.codes.or(family))).ok_or_else(unknown)
    }

    /// Sets the family of its tags, which a target that was read from a file needs where that is not shipped. A target of
    /// both tilings needs a family with squares, see [`Family::with_squares`].
    ///
    /// # Errors
    /// Where this is not the family that the target names.
    pub fn set_family(&mut self, family: &Family) -> Result<(), OtherFamily> {
        self.check_families(family)?;
        self.codes = Codes::of(Some(family));
        Ok(())
    }

    /// [`Self::check_family`] of each tiling.
    fn check_families(&self, family: &Family) -> Result<(), OtherFamily> {
        let named = self.family.as_ref().ok_or(OtherFamily::NoTags)?;
        self.tilings().try_for_each(|kind| {
            let own = family.of_tiling(kind).unwrap_or(family);
            self.check_family(named.of_tiling(kind), own)
        })
    }

    /// Whether a family is one that the target names: it has the fingerprint, or had it before it grew, and all tags
    /// of the target then.
    ///
    /// # Errors
    /// Why it is not.
    #[doc(hidden)]
    pub fn check_family(&self, named: &FamilyRef, family: &Family) -> Result<(), OtherFamily> {
        let of_family = self.panels.iter().filter(|panel| panel.kind == family.kind());
        for panel in of_family {
            let (Some(hole_mm), Some(border)) = (panel.hole_mm, panel.border_bits) else {
                continue;
            };
            if let Some(problem) =
                capacity::no_room_for_hole(family, panel.edge_mm, border, hole_mm)
            {
                return Err(OtherFamily::Hole { hole_mm, problem });
            }
        }
        // A file from elsewhere names a family without a fingerprint.
        if named.fingerprint.is_empty() || family.fingerprint() == named.fingerprint {
            return Ok(());
        }
        let (name, wanted) = (named.name.clone(), named.fingerprint.clone());
        let Some(codes) = family.codes_under(&wanted) else {
            return Err(OtherFamily::Codes {
                name,
                wanted,
                found: family.fingerprint().to_owned(),
            });
        };
        let ids = self.tags_of_tiling(family.kind()).map_or_else(Vec::new, |(_, ids)| ids);
        match ids.into_iter().find(|&id| id as usize >= codes) {
            Some(id) => Err(OtherFamily::Id { name, wanted, id, codes }),
            None => Ok(()),
        }
    }

    /// Whether places of its corners were measured.
    pub fn is_measured(&self) -> bool {
        self.panels.iter().flat_map(|panel| &panel.corners).any(|corner| corner.measured.is_some())
    }

    /// How well the measured places of its corners are known: standard deviation of a coordinate, root mean
    /// square over the corners that were measured, mm. `None` where none was.
    pub fn measured_sd_mm(&self) -> Option<f64> {
        let corners = self.panels.iter().flat_map(|panel| &panel.corners);
        let places = corners.filter_map(|corner| corner.measured);
        let variances =
            places.map(|MeasuredPlace { covariance_mm2: [xx, _, _, yy, _, zz], .. }| {
                (xx + yy + zz) / 3.0
            });
        let (sum, count) = variances.fold((0.0, 0), |(sum, count), v| (sum + v, count + 1));
        (count > 0).then(|| (sum / f64::from(count)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::{Construction, Rules};
    use crate::targets::{BoardSpec, TagSpec};

    /// A target that was made before its family grew is still one of it, as long as it has only tags of then.
    #[test]
    fn families_that_grew_are_those_of_older_targets() {
        let codes = Family::shipped("delTag16h5").unwrap().codes().to_vec();
        let dimension = crate::lattice::Dimension::from_bits(16).unwrap();
        let of = |codes: &[u64]| {
            let source = Construction::Imported { source: "a test".to_owned() };
            Family::new("grown", dimension, 5, codes.to_vec(), Rules::NONE, source).unwrap()
        };
        let then = of(&codes[..20]);
        let now = of(&codes).extending(&then).unwrap();
        let tags = TagSpec { family: "grown".to_owned(), ..TagSpec::default() };
        let spec = BoardSpec { tags: Some(tags), ..BoardSpec::deltille(8, 10, 20.0) };
        let mut board = Target::build("old", &TargetSpec::Board(spec), Some(&then)).unwrap();
        assert_eq!(board.family(), Ok(Some(&then)));
        let named = board.family.clone().unwrap();
        assert_eq!(board.check_family(&named, &then), Ok(()));
        assert_eq!(board.check_family(&named, &now), Ok(()));
        let other = of(&codes[..21]);
        assert!(matches!(board.check_family(&named, &other), Err(OtherFamily::Codes { .. })));
        board.panels[0].tags[0].id = 20;
        let why = board.check_family(&named, &now).unwrap_err();
        assert!(matches!(why, OtherFamily::Id { id: 20, codes: 20, .. }), "{why}");
    }

    /// Of one's own families a file has the name and the fingerprint; the codes are set, and no others can be.
    #[test]
    fn a_target_that_was_read_needs_its_own_family() {
        let shipped = Family::shipped("delTag16h5").unwrap();
        let of = |name: &str, codes: &[u64]| {
            let source = Construction::Imported { source: "a test".to_owned() };
            let dimension = shipped.dimension();
            Family::new(name, dimension, 5, codes.to_vec(), Rules::NONE, source).unwrap()
        };
        // Whatever it is called: one that is shipped has that name, too.
        for name in ["own", "delTag16h5"] {
            let own = of(name, &shipped.codes()[1..]);
            let tags = TagSpec { family: name.to_owned(), ..TagSpec::default() };
            let spec = BoardSpec { tags: Some(tags), ..BoardSpec::deltille(8, 10, 20.0) };
            let board = Target::build("board", &TargetSpec::Board(spec), Some(&own)).unwrap();
            let mut read = Target::from_json(&board.to_json()).unwrap();
            assert_eq!(read, board);
            let (target, family) = ("board".to_owned(), name.to_owned());
            assert_eq!(read.family(), Err(UnknownCodes { target, family }));
            assert!(matches!(read.set_family(&shipped), Err(OtherFamily::Codes { .. })));
            read.set_family(&own).unwrap();
            assert_eq!(read.clone().family(), Ok(Some(&own)));
        }
        let mut plain =
            Target::new("plain", BoardSpec { tags: None, ..BoardSpec::deltille(8, 10, 20.0) })
                .unwrap();
        assert_eq!(plain.family(), Ok(None));
        assert_eq!(plain.set_family(&shipped), Err(OtherFamily::NoTags));
    }
}
