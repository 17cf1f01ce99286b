//! The shape of a board's sheet as a deviation from a plane.

use glam::DVec3;

use crate::input::observation::Sighting;

/// Coefficients of a shape.
pub const COUNT: usize = 9;

/// Index of the coefficient a₁.
pub(crate) const STRETCH: usize = 7;

/// How a board's sheet differs from its plan: bent, stretched and sheared.
///
/// With u, v the place on the board from its middle, of which the farthest corner is 1 away,
///
/// ```text
///     z  = b₁ u² + b₂ u v + b₃ v² + b₄ u³ + b₅ u² v + b₆ u v² + b₇ v³
///     dx = a₁ u + a₂ v
///     dy = a₂ u − a₁ v
/// ```
///
/// in mm. A uniform scale, turns and moves are left out: distance and pose of the views take them up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// The middle of the board, in the panel frame.
    pub middle_mm: DVec3,
    /// Distance of its farthest corner from there, more than zero.
    pub reach_mm: f64,
    /// The coefficients b₁ … b₇ and a₁, a₂ of the formula, mm.
    pub coefficients_mm: [f64; COUNT],
}

/// The estimated shape of a board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardShape {
    /// The shape.
    pub shape: Shape,
    /// Standard deviations of the coefficients of the shape, mm.
    pub sd_mm: [f64; COUNT],
    /// By how much the residuals fall for each coefficient, in a-posteriori variances: about 1 where
    /// the sheet is as planned.
    pub f_ratio: f64,
    /// How far apart the lowest and the highest corner of the sheet are, mm, in the plane that fits
    /// the plan's middle.
    pub bent_mm: f64,
    /// The most that a corner lies beside its place in the plan, mm.
    pub stretched_mm: f64,
}

/// Of the F distribution with 9 and many degrees of freedom one in a thousand is larger: χ²₉ reaches
/// 27.9 so seldom, and F is a ninth of it.
const SIGNIFICANT_F: f64 = 3.1;

impl BoardShape {
    /// Whether chance alone would seldom make so much of a flat sheet.
    pub fn is_significant(&self) -> bool {
        self.f_ratio > SIGNIFICANT_F
    }
}

impl Shape {
    /// The shape of a sheet as planned, with these corners.
    pub(crate) fn flat(corners: impl Iterator<Item = DVec3> + Clone) -> Self {
        let count = corners.clone().count().max(1) as f64;
        let middle_mm = corners.clone().sum::<DVec3>() / count;
        let reach_mm = corners.map(|p| p.distance(middle_mm)).fold(0.0, f64::max);
        Self { middle_mm, reach_mm: reach_mm.max(f64::MIN_POSITIVE), coefficients_mm: [0.0; COUNT] }
    }

    /// What each coefficient moves a point of the plan by, in its own units.
    pub(crate) fn directions(&self, at: DVec3) -> [DVec3; COUNT] {
        let DVec3 { x: u, y: v, .. } = (at - self.middle_mm) / self.reach_mm;
        let up = |z: f64| DVec3::new(0.0, 0.0, z);
        [
            up(u * u),
            up(u * v),
            up(v * v),
            up(u * u * u),
            up(u * u * v),
            up(u * v * v),
            up(v * v * v),
            DVec3::new(u, -v, 0.0),
            DVec3::new(v, u, 0.0),
        ]
    }

    /// How far a point of the plan is moved.
    pub(crate) fn offset(&self, at: DVec3) -> DVec3 {
        let moved = self.directions(at).into_iter().zip(self.coefficients_mm);
        moved.map(|(direction, mm)| direction * mm).sum()
    }
}

impl Sighting {
    /// Moves the corners to where a sheet of this shape has them.
    pub fn bend(&mut self, shape: &Shape) {
        for seen in &mut self.observations {
            seen.panel_mm += shape.offset(seen.panel_mm);
        }
    }
}
