//! From where a camera can use a target.

use serde::Serialize;

use deltille_core::detection::MIN_UNTAGGED_EDGE_PX;
use deltille_core::targets::{Target, TargetSpec, UnknownCodes};

/// A cell of a tag that is so long leaves room for tilt, blur and noise, px; without these half of it is read.
pub(super) const COMFORTABLE_BIT_PX: f64 = 2.0;

/// Likewise the edge of a tile of a board without tags.
pub(super) const COMFORTABLE_EDGE_PX: f64 = 1.25 * MIN_UNTAGGED_EDGE_PX;

/// A cell of a tag from which on boards are labelled where pictures are sharp, px: half of the views are at 1.25, nearly all
/// from a twentieth more on. Tilted cells need as large an area.
const LEAST_BIT_PX: f64 = 1.3;

/// Boards of two tags, of 32 and 50 bits, need two fifths and a tenth more px for each to be labelled.
const FEW_BITS: f64 = 24.0;

/// What a target offers, and from where a camera can use it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Reach {
    /// Corners of all panels.
    pub corners: usize,
    /// Tags of all panels.
    pub tags: usize,
    /// Bits of all tags.
    pub bits: u32,
    /// Ids of the family that are left for other targets after the last one of this.
    pub ids_left: usize,
    /// The smallest thing that must be seen, mm: a cell of a tag, or the edge of a tile where there are no tags.
    pub detail_mm: f64,
    /// How long that must be in a picture, px.
    pub needed_px: f64,
    /// The longest side of the box around all corners, mm.
    pub size_mm: f64,
}

impl Reach {
    /// What a target offers.
    ///
    /// # Errors
    /// Where the family of its tags is unknown.
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
        // Of two families the one that has fewer left.
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
            // Single tags are seen one by one.
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

    /// The distances at which it fills the width of the picture and at which its details are just large enough, mm, for a
    /// camera of a focal length and a width in px; `None` where there is no distance at which both are so.
    pub fn distances_mm(&self, focal_px: f64, width_px: f64) -> Option<[f64; 2]> {
        let near = focal_px * self.size_mm / width_px;
        let far = focal_px * self.detail_mm / self.needed_px;
        (near < far).then_some([near, far])
    }

    /// The distance up to which boards are labelled in sharp pictures of a camera of a focal length in px, tilted by an
    /// angle, mm. Tagged boards are hardly labelled a tenth farther away; those without tags often are.
    pub fn labelled_to_mm(&self, focal_px: f64, tilt_rad: f64) -> f64 {
        let needed_px = match self.bits {
            0 => COMFORTABLE_EDGE_PX,
            // Few bits must be the surer.
            bits => LEAST_BIT_PX * (1.0 + (FEW_BITS / f64::from(bits)).powi(3)),
        };
        focal_px * self.detail_mm * shortening(self.tags > 0, tilt_rad) / needed_px
    }
}

/// What is left, at a tilt, of how far a board is labelled: cells of tags must keep their area, tiles without their height.
pub(super) fn shortening(has_tags: bool, tilt_rad: f64) -> f64 {
    if has_tags { tilt_rad.cos().sqrt() } else { tilt_rad.cos() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::lattice::GridKind;
    use deltille_core::targets::BoardSpec;

    #[test]
    fn without_tags_tiles_must_be_seen() {
        let board = BoardSpec { tags: None, ..BoardSpec::new(GridKind::Checker, 7, 9, 30.0) };
        let reach = Reach::of(&Target::new("board", board).unwrap()).unwrap();
        assert_eq!((reach.corners, reach.tags, reach.ids_left), (63, 0, 0));
        assert_eq!((reach.detail_mm, reach.needed_px, reach.size_mm), (30.0, 7.0, 240.0));
        // 56 px are too few for eight tiles.
        assert_eq!(reach.distances_mm(100.0, 50.0), None);
        assert!(reach.distances_mm(100.0, 57.0).is_some());
    }

    #[test]
    fn ids_before_the_first_one_are_not_left() {
        let mut board = BoardSpec::deltille(10, 11, 20.0);
        board.tags.as_mut().unwrap().first_id = 300;
        let target = Target::new("board", board).unwrap();
        assert_eq!(Reach::of(&target).unwrap().ids_left, 32);
    }
}
