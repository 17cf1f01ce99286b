//! Distances at which a camera can use a target.

use serde::Serialize;

use deltille_core::detection::MIN_UNTAGGED_EDGE_PX;
use deltille_core::targets::{Target, TargetSpec, UnknownCodes};

/// Size of a tag cell that leaves a reserve for tilt, blur and noise, px. Under ideal conditions half of this is
/// sufficient.
pub(super) const COMFORTABLE_BIT_PX: f64 = 2.0;

/// The same for the tile edge of a board without tags, px.
pub(super) const COMFORTABLE_EDGE_PX: f64 = 1.25 * MIN_UNTAGGED_EDGE_PX;

/// Smallest size of a tag cell at which boards are labelled in sharp images, px: half of the views of boards with four
/// tags are labelled at 0.95, nearly all at 5 % more. Tilted cells need the same area.
const MIN_BIT_PX: f64 = 1.05;

/// Number of bits that sets the penalty for boards with few tags. Boards with two tags, of 32 and 50 bits in total,
/// need 40 % and 10 % more pixels.
const FEW_BITS: f64 = 24.0;

/// Size and tags of a target, and the distances at which a camera can use it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Reach {
    /// Number of corners of all panels.
    pub corners: usize,
    /// Number of tags of all panels.
    pub tags: usize,
    /// Number of bits of all tags.
    pub bits: u32,
    /// Number of unused ids of the family after the highest id of this target.
    pub ids_left: usize,
    /// Smallest detail that must be resolved, mm: a tag cell, or the tile edge if the target has no tags.
    pub detail_mm: f64,
    /// Required length of that detail in an image, px.
    pub needed_px: f64,
    /// Longest side of the bounding box of all corners, mm.
    pub size_mm: f64,
}

impl Reach {
    /// Computes the reach of a target.
    ///
    /// # Errors
    /// Returns an error if the family of its tags is unknown.
    ///
    /// ```
    /// use deltille_layout::Reach;
    /// use deltille_core::targets::{BoardSpec, Target};
    ///
    /// let board = Target::new("desk", BoardSpec::deltille(10, 11, 20.0))?;
    /// let reach = Reach::of(&board)?;
    /// assert_eq!((reach.corners, reach.tags, reach.ids_left), (110, 11, 332));
    /// let [near, far] = reach.distances_mm(1000.0, 1000.0).unwrap();
    /// assert!((near - reach.size_mm).abs() < 1e-9 && (far - 1052.6).abs() < 0.1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of(target: &Target) -> Result<Self, UnknownCodes> {
        let family = target.family()?;
        let family_of = |kind| family.and_then(|family| family.of_tiling(kind));
        let tagged = || target.panels.iter().filter(|panel| !panel.tags.is_empty());
        let cells = tagged().filter_map(|panel| {
            let family = family_of(panel.kind)?;
            Some(panel.edge_mm / family.cells().width(panel.tag_inset_bits()))
        });
        let bits = tagged().map(|panel| {
            let bits = family_of(panel.kind).map_or(0, |family| family.dimension().bits());
            bits * panel.tags.len() as u32
        });
        // If the target uses two families, the smaller number counts.
        let left = target.tilings().filter_map(|kind| {
            let (_, ids) = target.tags_of_tiling(kind)?;
            let after = ids.into_iter().max().map_or(0, |id| id as usize + 1);
            Some(family_of(kind)?.len().saturating_sub(after))
        });
        let cell_mm = cells.reduce(f64::min);
        let edge_mm = target.panels.iter().map(|panel| panel.edge_mm).fold(f64::INFINITY, f64::min);
        let places = target.panels.iter().flat_map(|panel| &panel.corners).map(|c| c.target_mm);
        let box_mm = places.fold(None, |found: Option<[glam::DVec3; 2]>, at| {
            let [least, most] = found.unwrap_or([at; 2]);
            Some([least.min(at), most.max(at)])
        });
        let size_mm = match (&target.spec, box_mm) {
            // Single tags are viewed one at a time.
            (TargetSpec::Tags(spec), _) => spec.edge_mm,
            (_, Some([least, most])) => (most - least).max_element(),
            (_, None) => 0.0,
        };
        Ok(Self {
            corners: target.panels.iter().map(|panel| panel.corners.len()).sum(),
            bits: bits.sum(),
            tags: tagged().map(|panel| panel.tags.len()).sum(),
            ids_left: left.min().unwrap_or(0),
            detail_mm: cell_mm.unwrap_or(edge_mm),
            needed_px: if cell_mm.is_some() { COMFORTABLE_BIT_PX } else { MIN_UNTAGGED_EDGE_PX },
            size_mm,
        })
    }

    /// Returns the distance at which the target fills the width of the image, and the one at which its details are just
    /// large enough, mm. The focal length and the image width are in px. Returns `None` if the second distance is not
    /// larger than the first.
    pub fn distances_mm(&self, focal_px: f64, width_px: f64) -> Option<[f64; 2]> {
        let near = focal_px * self.size_mm / width_px;
        let far = focal_px * self.detail_mm / self.needed_px;
        (near < far).then_some([near, far])
    }

    /// Returns the distance up to which boards are labelled in sharp images, mm. `focal_px` is the focal length and
    /// `tilt_rad` the tilt of the board. Tagged boards are rarely labelled 10 % farther away; untagged boards often
    /// are.
    pub fn labelled_to_mm(&self, focal_px: f64, tilt_rad: f64) -> f64 {
        let needed_px = match self.bits {
            0 => COMFORTABLE_EDGE_PX,
            // With few bits, each must be read more reliably.
            bits => MIN_BIT_PX * (1.0 + (FEW_BITS / f64::from(bits)).powi(3)),
        };
        focal_px * self.detail_mm * shortening(self.tags > 0, tilt_rad) / needed_px
    }
}

/// Factor by which tilt shortens the labelling distance: tag cells must keep their area, untagged tiles their height.
pub(super) fn shortening(has_tags: bool, tilt_rad: f64) -> f64 {
    if has_tags { tilt_rad.cos().sqrt() } else { tilt_rad.cos() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::lattice::GridKind;
    use deltille_core::targets::BoardSpec;

    #[test]
    fn untagged_boards_are_limited_by_their_tiles() {
        let board = BoardSpec { tags: None, ..BoardSpec::new(GridKind::Checker, 7, 9, 30.0) };
        let reach = Reach::of(&Target::new("board", board).unwrap()).unwrap();
        assert_eq!((reach.corners, reach.tags, reach.ids_left), (63, 0, 0));
        assert_eq!((reach.detail_mm, reach.needed_px, reach.size_mm), (30.0, 7.0, 240.0));
        // 56 px are too few for eight tiles.
        assert_eq!(reach.distances_mm(100.0, 50.0), None);
        assert!(reach.distances_mm(100.0, 57.0).is_some());
    }

    #[test]
    fn ids_before_the_first_one_do_not_count_as_left() {
        let mut board = BoardSpec::deltille(10, 11, 20.0);
        board.tags.as_mut().unwrap().first_id = 300;
        let target = Target::new("board", board).unwrap();
        assert_eq!(Reach::of(&target).unwrap().ids_left, 32);
    }
}
