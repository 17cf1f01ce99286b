//! Occlusion between surfaces.
//!
//! Seen from an eye, a plane convex surface hides everything inside the view pyramid over its outline and beyond its
//! plane. On another plane, each side of that shadow is a straight line. So the visible part of a polygon results from
//! clipping along lines, which is exact for every lens.

use glam::{DVec2, DVec3};

use super::Surface;
use deltille_core::polygon::clip;

/// A surface must rise above a plane by more than this to hide part of it, mm: faces that meet in an edge do not.
const ABOVE_MM: f64 = 1e-6;

/// The half-plane on which n·p + c ≥ 0.
#[derive(Clone, Copy, Debug)]
struct Half {
    n: DVec2,
    c: f64,
}

impl Half {
    fn at(&self, p: DVec2) -> f64 {
        self.n.dot(p) + self.c
    }
}

/// The shadow of one surface on the plane of another: the intersection of all half-planes.
#[derive(Clone, Debug)]
pub(super) struct Shadow {
    halves: Vec<Half>,
}

impl Shadow {
    /// Returns the shadow of `before` on the plane of `behind`, both facing the eye (in the target frame); `None` if
    /// `before` does not rise above that plane.
    pub(super) fn of(before: &Surface, behind: &Surface, eye: DVec3) -> Option<Self> {
        let surface_from_target = behind.target_from_surface.inverse();
        let outline: Vec<DVec3> = before
            .paper_mm
            .iter()
            .map(|p| before.target_from_surface.apply(p.extend(0.0)))
            .map(|p| surface_from_target.apply(p))
            .collect();
        if outline.iter().all(|p| p.z <= ABOVE_MM) {
            return None;
        }
        let eye = surface_from_target.apply(eye);
        let half =
            |normal: DVec3, through: DVec3| Half { n: normal.truncate(), c: -normal.dot(through) };
        // The outline is counter-clockwise as seen from the eye.
        let n = outline.len();
        let sides = (0..n).map(|i| half((outline[(i + 1) % n] - eye).cross(outline[i] - eye), eye));
        let front = surface_from_target.rotation * before.target_from_surface.rotation * DVec3::Z;
        let beyond = half(-front, outline[0]);
        Some(Self { halves: sides.chain([beyond]).collect() })
    }

    /// Returns whether a point of the plane is hidden.
    pub(super) fn hides(&self, p: DVec2) -> bool {
        self.halves.iter().all(|half| half.at(p) > 0.0)
    }

    /// Returns the parts of a polygon outside the shadow. An outline and its holes may be cut separately: extra area
    /// that a cut adds to one is also added to the other.
    pub(super) fn cut(&self, polygon: Vec<DVec2>) -> Vec<Vec<DVec2>> {
        let mut visible = Vec::new();
        let mut rest = polygon;
        for half in &self.halves {
            let outside = clip(&rest, |p| -half.at(p));
            rest = clip(&rest, |p| half.at(p));
            visible.extend((outside.len() > 2).then_some(outside));
            if rest.len() < 3 {
                break;
            }
        }
        visible
    }
}
