//! Rigid motions of the paper and of faces in space.

use glam::{DMat3, DVec2, DVec3};

/// Largest accepted distance of a folded corner, or of an end of an edge, from its stated position, mm: the same as
/// for meshes, see [`MESH_TOLERANCE_MM`](crate::MESH_TOLERANCE_MM).
pub const FOLD_TOLERANCE_MM: f64 = 0.05;

/// A rigid motion of the plane, mm: `page = turn · panel + shift`, where `turn` is a unit complex
/// number.
#[derive(Clone, Copy)]
pub(super) struct Rigid {
    pub turn: DVec2,
    pub shift: DVec2,
}

impl Rigid {
    /// Returns the least-squares rigid motion that maps the first point of each pair to the second; `None` if the
    /// points do not determine the rotation. With p and q as complex numbers about their means, turn ∝ Σ p̄ q.
    pub(super) fn fit(pairs: &[(DVec2, DVec2)]) -> Option<Self> {
        let n = pairs.len() as f64;
        let p0 = pairs.iter().map(|(p, _)| *p).sum::<DVec2>() / n;
        let q0 = pairs.iter().map(|(_, q)| *q).sum::<DVec2>() / n;
        let conjugate = |p: DVec2| DVec2::new(p.x, -p.y);
        let sum: DVec2 = pairs.iter().map(|(p, q)| conjugate(*p - p0).rotate(*q - q0)).sum();
        let turn = sum.try_normalize()?;
        Some(Self { turn, shift: q0 - turn.rotate(p0) })
    }

    pub(super) fn apply(&self, p: DVec2) -> DVec2 {
        self.turn.rotate(p) + self.shift
    }
}

/// A pose of a plane in the target frame, mm: `space = linear · (x, y, 0) + shift` with a rotation `linear`. The
/// plane is that of the page or of a panel.
#[derive(Clone, Copy)]
pub(super) struct SpaceFromPage {
    pub linear: DMat3,
    pub shift: DVec3,
}

impl SpaceFromPage {
    pub(super) fn apply(&self, p: DVec2) -> DVec3 {
        self.linear * p.extend(0.0) + self.shift
    }

    /// Returns the pose followed by a rotation by an angle about the line from the first to the second of two points
    /// of the page.
    pub(super) fn folded(&self, [p, q]: [DVec2; 2], angle_rad: f64) -> Self {
        let (a, b) = (self.apply(p), self.apply(q));
        let turn = DMat3::from_axis_angle((b - a).normalize_or(DVec3::X), angle_rad);
        Self { linear: turn * self.linear, shift: turn * (self.shift - a) + a }
    }
}
