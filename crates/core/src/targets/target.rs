//! A physical target.

use crate::family::Family;
use crate::lattice::GridKind;
use crate::targets::boards::capacity;
use crate::targets::family_ref::Codes;
use crate::targets::{
    FamilyRef, MeasuredPosition, Name, OtherFamily, Panel, PanelPose, TargetIdentity, TargetSpec,
    UnknownCodes,
};

/// A target: its panels with their corners and tags, independent of the paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Name of the target, the stem of its file names.
    pub name: Name,
    /// The specification that the target was made from.
    pub spec: TargetSpec,
    /// The family of the tags; `None` for an untagged target.
    pub family: Option<FamilyRef>,
    /// Planar pieces, by increasing id.
    pub panels: Vec<Panel>,
    /// Identity of the target as printed, if this one has measured corners or refined panels.
    pub plan: Option<TargetIdentity>,
    pub(in crate::targets) codes: Codes,
}

impl Target {
    /// Returns the target with measured panel poses; `poses` contains one per panel.
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

    /// Returns whether the panels are separate loose sheets. This includes listed boards without poses.
    pub fn is_loose(&self) -> bool {
        self.panels.len() > 1 && (!self.spec.is_rigid() || self.overlapping_boards().is_some())
    }

    /// Returns the ids of two listed boards that would overlap. Such lists describe each board in its own plane and
    /// contain no poses of the boards.
    pub fn overlapping_boards(&self) -> Option<[u32; 2]> {
        let is_list = matches!(self.spec, TargetSpec::Listed(_));
        let panels: &[Panel] = if is_list { &self.panels } else { &[] };
        let pairs =
            panels.iter().enumerate().flat_map(|(i, a)| panels[..i].iter().map(move |b| (b, a)));
        let mut pairs = pairs.filter(|(a, b)| a.overlaps(b));
        pairs.next().map(|(a, b)| [a.id, b.id])
    }

    /// Returns whether the panels have known poses in one scene. A list of several boards contains no information
    /// about their surroundings.
    pub fn is_one_scene(&self) -> bool {
        let is_list = matches!(self.spec, TargetSpec::Listed(_));
        self.panels.len() <= 1 || !(self.is_loose() || is_list)
    }

    /// Returns the tilings of the panels.
    pub fn tilings(&self) -> impl Iterator<Item = GridKind> {
        let has = |kind: &GridKind| self.panels.iter().any(|panel| panel.kind == *kind);
        [GridKind::Deltille, GridKind::Checker].into_iter().filter(has)
    }

    /// Returns the target reduced to its panels of one tiling.
    #[doc(hidden)]
    pub fn of_tiling(&self, kind: GridKind) -> Self {
        let panels = self.panels.iter().filter(|panel| panel.kind == kind).cloned().collect();
        Self { panels, ..self.clone() }
    }

    /// Returns the ids of the tags in tiles of a kind, and their family.
    #[doc(hidden)]
    pub fn tags_of_tiling(&self, kind: GridKind) -> Option<(&FamilyRef, Vec<u32>)> {
        let own = self.panels.iter().filter(|panel| panel.kind == kind);
        let ids = own.flat_map(|panel| &panel.tags).map(|tag| tag.id).collect();
        Some((self.family.as_ref()?.of_tiling(kind), ids))
    }

    /// Returns the family of the tags: the one it was made with or given, or the shipped one of that name. Returns
    /// `None` for an untagged target.
    ///
    /// # Errors
    /// Returns an error if no family was given and no shipped one has its codes.
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

    /// Sets the family of the tags. A target read from a file needs this if its family is not shipped. A target of
    /// both tilings needs a family with squares, see [`Family::with_squares`].
    ///
    /// # Errors
    /// Returns an error if the family is not the one that the target names.
    pub fn set_family(&mut self, family: &Family) -> Result<(), OtherFamily> {
        self.check_families(family)?;
        self.codes = Codes::of(Some(family));
        Ok(())
    }

    /// Calls [`Self::check_family`] for each tiling.
    fn check_families(&self, family: &Family) -> Result<(), OtherFamily> {
        let named = self.family.as_ref().ok_or(OtherFamily::NoTags)?;
        self.tilings().try_for_each(|kind| {
            let own = family.of_tiling(kind).unwrap_or(family);
            self.check_family(named.of_tiling(kind), own)
        })
    }

    /// Checks that a family is one that the target names: it has the
    /// fingerprint in the target, or an earlier, shorter version of it had this fingerprint and
    /// contained all tags of the target. Also checks that a hole fits.
    ///
    /// # Errors
    /// Returns why it is not.
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
        // A file from another program names a family without a fingerprint.
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

    /// Returns whether any corner positions were measured.
    pub fn is_measured(&self) -> bool {
        self.panels.iter().flat_map(|panel| &panel.corners).any(|corner| corner.measured.is_some())
    }

    /// Returns the uncertainty of the measured corner positions: standard deviation of a coordinate (1σ), RMS over
    /// the measured corners, mm. Returns `None` if none was measured.
    pub fn measured_sd_mm(&self) -> Option<f64> {
        let corners = self.panels.iter().flat_map(|panel| &panel.corners);
        let places = corners.filter_map(|corner| corner.measured);
        let variances =
            places.map(|MeasuredPosition { covariance_mm2: [xx, _, _, yy, _, zz], .. }| {
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

    /// A target made before its family grew stays valid if it has only earlier tags.
    #[test]
    fn grown_families_match_older_targets() {
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

    /// The file contains the name and fingerprint of a custom family; only a family with the same codes can be set.
    #[test]
    fn targets_from_files_need_their_own_family() {
        let shipped = Family::shipped("delTag16h5").unwrap();
        let of = |name: &str, codes: &[u64]| {
            let source = Construction::Imported { source: "a test".to_owned() };
            let dimension = shipped.dimension();
            Family::new(name, dimension, 5, codes.to_vec(), Rules::NONE, source).unwrap()
        };
        // The name does not matter, even if it is that of a shipped family.
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
