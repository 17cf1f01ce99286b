//! Selection of images from a stream: those in which the target is still and in a new position.

use std::collections::BTreeMap;

use glam::DVec2;

use crate::detection::Detection;

/// Movement since the previous image below which corners are still, as a fraction of the image width. It keeps blur
/// under two pixels in an image 1280 px wide that is exposed for half of the frame interval.
const STILL: f64 = 0.004;

/// Mean distance from the corner positions of every kept image above which the position is new, as
/// a fraction of the image width.
const ELSEWHERE: f64 = 0.08;

/// Fewest labelled corners of a kept image: enough for a homography with redundancy.
const MIN_CORNERS: usize = 12;

/// Watches a sequence of images.
///
/// ```
/// use deltille_core::detection::{Detection, Watch};
///
/// let mut watch = Watch::default();
/// let seen = watch.observe(&Detection::new("black", [640, 480], Vec::new()));
/// assert!(!seen.is_worth_keeping());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Watch {
    last: Positions,
    kept: Vec<Positions>,
}

/// Labelled corners by panel and id, in image widths.
type Positions = BTreeMap<(u32, u32), DVec2>;

/// Assessment of an image in a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FrameStatus {
    /// Number of labelled corners.
    pub corners: usize,
    /// Whether the corners have not moved since the previous image.
    pub is_still: bool,
    /// Whether the corner positions differ from those in every kept image.
    pub is_new: bool,
}

impl FrameStatus {
    /// Returns whether the image is worth keeping.
    pub fn is_worth_keeping(self) -> bool {
        self.corners >= MIN_CORNERS && self.is_still && self.is_new
    }
}

impl Watch {
    /// Assesses the next image. If it is worth keeping, later images are compared with it.
    pub fn observe(&mut self, found: &Detection) -> FrameStatus {
        let labelled = found.grids.iter().filter_map(|grid| Some((grid.panel?, grid)));
        let positions: Positions = labelled
            .flat_map(|(panel, grid)| {
                grid.corners.iter().filter_map(move |corner| {
                    let at = corner.position() / f64::from(found.width.max(1));
                    Some(((panel, corner.id?), at))
                })
            })
            .collect();
        let glance = FrameStatus {
            corners: positions.len(),
            is_still: moved(&positions, &self.last) < STILL,
            is_new: self.kept.iter().all(|kept| moved(&positions, kept) > ELSEWHERE),
        };
        if glance.is_worth_keeping() {
            self.kept.push(positions.clone());
        }
        self.last = positions;
        glance
    }
}

/// Returns the mean displacement of common corners; infinite if there are none.
fn moved(one: &Positions, other: &Positions) -> f64 {
    let distances = one.iter().filter_map(|(id, at)| Some(at.distance(*other.get(id)?)));
    let (count, sum) =
        distances.fold((0, 0.0), |(count, sum), distance| (count + 1, sum + distance));
    if count == 0 { f64::INFINITY } else { sum / f64::from(count) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::{Grid, GridCorner};
    use crate::lattice::GridKind;

    /// Creates an image 1000 px wide with `corners` corners of a panel, shifted to the right.
    fn picture(corners: u32, shift: f64, panel: Option<u32>) -> Detection {
        let corner = |id: u32| GridCorner {
            row: id as i32,
            col: 0,
            id: panel.map(|_| id),
            x: 300.0 + shift,
            y: 10.0 * f64::from(id),
            cov: None,
        };
        let grid = Grid {
            kind: GridKind::Deltille,
            target: None,
            panel,
            mirrored: false,
            corners: (0..corners).map(corner).collect(),
            tags: Vec::new(),
        };
        Detection::new("", [1000, 800], vec![grid])
    }

    #[test]
    fn images_are_kept_once_per_still_position() {
        let mut watch = Watch::default();
        let mut keeps = |corners, shift, panel| {
            watch.observe(&picture(corners, shift, panel)).is_worth_keeping()
        };
        // The first image has no predecessor; the third repeats the position of the second.
        let shifts = [0.0, 1.0, 2.0, 200.0, 230.0, 231.0, 120.0, 121.0];
        let kept = shifts.map(|shift| keeps(30, shift, Some(0)));
        assert_eq!(kept, [false, true, false, false, false, true, false, true]);
        // Too few corners, or no labels.
        assert_eq!([500.0, 501.0].map(|shift| keeps(11, shift, Some(0))), [false; 2]);
        assert_eq!([500.0, 501.0].map(|shift| keeps(30, shift, None)), [false; 2]);
    }
}
