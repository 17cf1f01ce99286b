//! Areas of the plane within closed outlines, and their unions, differences and intersections.

use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::simplify::SimplifyShape;
use i_overlay::float::single::SingleFloatOverlay;

/// The colour of an area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tone {
    /// Ink.
    Black,
    /// Bare paper.
    White,
}

/// Closed outlines of straight lines, and their fill rule.
pub(super) struct Straight {
    pub outlines: Vec<Vec<[f64; 2]>>,
    pub rule: FillRule,
}

impl Straight {
    pub(super) fn area(&self) -> Area {
        Area::within(&self.outlines, self.rule)
    }
}

/// An area. Its outlines do not cross; outer outlines and holes have opposite orientations.
#[derive(Clone, Debug, Default)]
pub(super) struct Area {
    outlines: Vec<Vec<[f64; 2]>>,
}

impl Area {
    /// The area within outlines that may cross.
    pub(super) fn within(outlines: &[Vec<[f64; 2]>], rule: FillRule) -> Self {
        Self::of(outlines.to_vec().simplify_shape(rule))
    }

    /// The union of several areas.
    pub(super) fn union<'a>(areas: impl IntoIterator<Item = &'a Self>) -> Self {
        let outlines: Vec<_> = areas.into_iter().flat_map(|area| area.outlines.clone()).collect();
        Self::within(&outlines, FillRule::NonZero)
    }

    /// The difference of this area and another.
    pub(super) fn without(&self, other: &Self) -> Self {
        self.combined(other, OverlayRule::Difference)
    }

    /// The intersection of this area and another.
    pub(super) fn common(&self, other: &Self) -> Self {
        self.combined(other, OverlayRule::Intersect)
    }

    fn combined(&self, other: &Self, rule: OverlayRule) -> Self {
        Self::of(self.outlines.overlay(&other.outlines, rule, FillRule::NonZero))
    }

    fn of(shapes: Vec<Vec<Vec<[f64; 2]>>>) -> Self {
        Self { outlines: shapes.into_iter().flatten().collect() }
    }

    /// Its outlines.
    pub(super) fn into_outlines(self) -> Vec<Vec<DVec2>> {
        let outline = |outline: Vec<[f64; 2]>| outline.into_iter().map(DVec2::from).collect();
        self.outlines.into_iter().map(outline).collect()
    }
}
