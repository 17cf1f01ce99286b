//! Which pictures of a stream are worth keeping: those in which the target is held still, somewhere new.

use std::collections::BTreeMap;

use glam::DVec2;

use crate::detection::Detection;

/// Corners that moved by less than this part of the picture's width since the picture before are still: less than a
/// blur of two pixels while a frame of 1280 pixels is exposed for half of the time.
const STILL: f64 = 0.004;

/// Corners that are further than this part of the width from where they were in any picture kept are somewhere new.
const ELSEWHERE: f64 = 0.08;

/// Fewest labelled corners of a picture that is kept: a homography and some to spare.
const FEWEST_CORNERS: usize = 12;

/// Looks at pictures one after the other.
///
/// ```
/// use deltille_core::detection::{Detection, Watch};
///
/// let mut watch = Watch::default();
/// let seen = watch.look(&Detection::new("black", [640, 480], Vec::new()));
/// assert!(!seen.is_worth_keeping());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Watch {
    last: Places,
    kept: Vec<Places>,
}

/// Labelled corners by panel and id, in widths of the picture.
type Places = BTreeMap<(u32, u32), DVec2>;

/// What a picture shows, after those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Glance {
    /// Labelled corners.
    pub corners: usize,
    /// Whether they are where they were a picture ago.
    pub is_still: bool,
    /// Whether they are elsewhere than in all pictures that were kept.
    pub is_new: bool,
}

impl Glance {
    /// Whether the picture is worth keeping.
    pub fn is_worth_keeping(self) -> bool {
        self.corners >= FEWEST_CORNERS && self.is_still && self.is_new
    }
}

impl Watch {
    /// What the next picture shows; where it is worth keeping, those to come are compared with it.
    pub fn look(&mut self, found: &Detection) -> Glance {
        let labelled = found.grids.iter().filter_map(|grid| Some((grid.panel?, grid)));
        let places: Places = labelled
            .flat_map(|(panel, grid)| {
                grid.corners.iter().filter_map(move |corner| {
                    let place = corner.position() / f64::from(found.width.max(1));
                    Some(((panel, corner.id?), place))
                })
            })
            .collect();
        let glance = Glance {
            corners: places.len(),
            is_still: moved(&places, &self.last) < STILL,
            is_new: self.kept.iter().all(|kept| moved(&places, kept) > ELSEWHERE),
        };
        if glance.is_worth_keeping() {
            self.kept.push(places.clone());
        }
        self.last = places;
        glance
    }
}

/// The mean way of corners that both have; infinite where there are none.
fn moved(one: &Places, other: &Places) -> f64 {
    let ways = one.iter().filter_map(|(id, at)| Some(at.distance(*other.get(id)?)));
    let (count, sum) = ways.fold((0, 0.0), |(count, sum), way| (count + 1, sum + way));
    if count == 0 { f64::INFINITY } else { sum / f64::from(count) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::{Grid, GridCorner};
    use crate::lattice::GridKind;

    /// A picture of 1000 px with so many corners of a panel, shifted.
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
    fn pictures_are_kept_once_where_the_target_is_still() {
        let mut watch = Watch::default();
        let mut keeps =
            |corners, shift, panel| watch.look(&picture(corners, shift, panel)).is_worth_keeping();
        // The first has none before it, the third is where the second was.
        let shifts = [0.0, 1.0, 2.0, 200.0, 230.0, 231.0, 120.0, 121.0];
        let kept = shifts.map(|shift| keeps(30, shift, Some(0)));
        assert_eq!(kept, [false, true, false, false, false, true, false, true]);
        // Too few corners, or none with a label.
        assert_eq!([500.0, 501.0].map(|shift| keeps(11, shift, Some(0))), [false; 2]);
        assert_eq!([500.0, 501.0].map(|shift| keeps(30, shift, None)), [false; 2]);
    }
}
