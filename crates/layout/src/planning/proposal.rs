//! Proposes a board for a camera and the distances from which it must be visible.

use super::reach::{COMFORTABLE_BIT_PX, COMFORTABLE_EDGE_PX, Reach, shortening};
use crate::{PaperSpec, largest_edge_mm};
use deltille_core::family::Family;
use deltille_core::lattice::{GridKind, ROW_HEIGHT};
use deltille_core::targets::{BoardSpec, TagSpec, Target, TargetError, TargetSpec};

/// Fraction of the image that a board may fill: a larger board held by hand easily leaves the image.
const FILLED: f64 = 0.9;

/// Rows and columns of corners of the smallest and the largest board that is proposed. Fewer corners constrain a camera
/// poorly, and larger boards cannot be held by hand.
const LEAST: [u32; 2] = [4, 5];
const MOST: u32 = 40;

/// Smallest cell size of a position code at which patches of three by four tiles are labelled in sharp images, px.
/// Measured on photographs of printed pages (docs/benchmarks.md). Tilted cells need the same height, because a patch has no
/// redundant cells.
const PATCH_BIT_PX: f64 = 1.1;

/// A camera, and the distances from which it must see a board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// Focal length, px.
    pub focal_px: f64,
    /// Width and height of its images, px.
    pub size_px: [u32; 2],
    /// Nearest and farthest distance, mm.
    pub distances_mm: [f64; 2],
    /// Tilt up to which the whole board must be readable at the farthest distance, rad.
    pub tilt_rad: f64,
}

/// A proposed board and its properties.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Proposal {
    /// The board.
    pub spec: BoardSpec,
    /// Its size, tags and distances.
    pub reach: Reach,
    /// Smallest distance at which a board facing the camera is entirely visible, mm. At shorter
    /// distances, parts of a tagged
    /// board are still labelled.
    pub whole_from_mm: f64,
}

impl Proposal {
    /// Returns the distance up to which a patch of three by four tiles of a position-code board is
    /// labelled in sharp
    /// images, mm. `focal_px` is the focal length and `tilt_rad` the tilt of the board. Returns `None` for other
    /// boards.
    pub fn patches_to_mm(&self, focal_px: f64, tilt_rad: f64) -> Option<f64> {
        let is_dense = self.spec.tags.as_ref().is_some_and(TagSpec::is_dense);
        let to_mm = focal_px * self.reach.detail_mm * tilt_rad.cos() / PATCH_BIT_PX;
        is_dense.then_some(to_mm)
    }
}

/// Reason why no board fits.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsuited {
    /// Tiles large enough for the farthest distance leave no room for a board in the image.
    #[error(
        "tiles must be {edge_mm:.0} mm long to be readable at {far_mm:.0} mm, but at this distance fewer than \
         4 × 5 corners fit into the image: use a camera with more pixels, a wider lens, less tilt or a shorter distance"
    )]
    Picture {
        /// Edge of a tile, mm.
        edge_mm: f64,
        /// The farthest distance, mm.
        far_mm: f64,
    },
    /// The tiles do not fit on the paper.
    #[error(
        "tiles must be {edge_mm:.0} mm long to be readable at {far_mm:.0} mm, but fewer than 4 × 5 corners fit \
         on the paper: use larger paper, or print a poster"
    )]
    Paper {
        /// Edge of a tile, mm.
        edge_mm: f64,
        /// The farthest distance, mm.
        far_mm: f64,
    },
    /// The board cannot be built.
    #[error(transparent)]
    Target(#[from] TargetError),
}

impl Situation {
    /// Returns the board with the most corners that fits on the paper and is readable at the farthest distance. Its
    /// tags, or its tiles if it has none, are large enough there. At the nearest distance the whole board is visible,
    /// provided the image shows 4 × 5 corners.
    ///
    /// ```
    /// use deltille_layout::Situation;
    /// use deltille_core::family::Family;
    /// use deltille_core::lattice::GridKind;
    /// use deltille_layout::PaperSpec;
    /// use deltille_core::targets::TagSpec;
    ///
    /// let webcam = Situation {
    ///     focal_px: 1000.0,
    ///     size_px: [1280, 720],
    ///     distances_mm: [300.0, 1000.0],
    ///     tilt_rad: 0.785,
    /// };
    /// let family = Family::shipped("delTag25h7")?;
    /// let tags = Some((TagSpec::default(), &family));
    /// let found = webcam.board(GridKind::Deltille, tags, &PaperSpec::default())?;
    /// assert_eq!((found.spec.rows, found.spec.cols, found.spec.edge_mm), (8, 13, 23.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Returns an error if no board fits.
    pub fn board(
        &self,
        kind: GridKind,
        tags: Option<(TagSpec, &Family)>,
        paper: &PaperSpec,
    ) -> Result<Proposal, Unsuited> {
        let [near_mm, far_mm] = self.distances_mm;
        let mut spec = BoardSpec::new(kind, LEAST[0], LEAST[1], 1.0);
        spec.tags = tags.as_ref().map(|(tags, _)| tags.clone());
        let family = tags.map(|(_, family)| family);
        // A board with tiles of one millimetre gives the size of the smallest detail in tile edges.
        let unit = Target::build("plan", &TargetSpec::Board(spec.clone()), family)?;
        let unit = Reach::of(&unit).map_err(TargetError::from)?;
        let comfortable = if family.is_some() { COMFORTABLE_BIT_PX } else { COMFORTABLE_EDGE_PX };
        let px_at_far = self.focal_px / far_mm * shortening(family.is_some(), self.tilt_rad);
        spec.edge_mm = (comfortable / (unit.detail_mm * px_at_far)).ceil();
        let edge_mm = spec.edge_mm;
        let sides = |distance: f64| {
            let seen =
                self.size_px.map(|px| FILLED * f64::from(px) * distance / self.focal_px / edge_mm);
            let (rows, cols) = match kind {
                GridKind::Deltille => (seen[1] / ROW_HEIGHT - 1.0, seen[0] - 1.5),
                GridKind::Checker => (seen[1] - 1.0, seen[0] - 1.0),
            };
            [rows, cols].map(|n| n.clamp(0.0, f64::from(MOST)) as u32)
        };
        let takes = |[rows, cols]: [u32; 2]| rows >= LEAST[0] && cols >= LEAST[1];
        // If the image at the nearest distance shows too few corners, the board is entirely visible only from farther
        // away.
        let steps =
            (0..=STEPS).map(|k| near_mm * (far_mm / near_mm).powf(f64::from(k) / f64::from(STEPS)));
        let whole =
            steps.map(|distance| (distance, sides(distance))).find(|&(_, sides)| takes(sides));
        let (whole_from_mm, most) = whole.ok_or(Unsuited::Picture { edge_mm, far_mm })?;
        let fits = |[rows, cols]: [u32; 2]| {
            let spec = BoardSpec { rows, cols, ..spec.clone() };
            largest_edge_mm(&spec, paper).is_some_and(|largest| largest >= edge_mm)
        };
        let smaller = (0..MOST).map(|less| {
            let part = 1.0 - f64::from(less) / f64::from(MOST);
            most.map(|n| (f64::from(n) * part).round() as u32)
        });
        let found = smaller.take_while(|&sides| takes(sides)).find(|&sides| fits(sides));
        [spec.rows, spec.cols] = found.ok_or(Unsuited::Paper { edge_mm, far_mm })?;
        let target = Target::build("plan", &TargetSpec::Board(spec.clone()), family)?;
        let reach = Reach::of(&target).map_err(TargetError::from)?;
        Ok(Proposal { spec, reach, whole_from_mm })
    }
}

/// Number of distances tried between the nearest and the farthest.
const STEPS: u32 = 60;
