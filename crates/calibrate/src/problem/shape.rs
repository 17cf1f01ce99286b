//! The shape of a board's sheet as a deviation from a plane.

use glam::DVec3;

use crate::input::observation::Sighting;

/// Number of coefficients of a shape.
pub const COUNT: usize = 9;

/// Index of the coefficient a₁.
pub(crate) const STRETCH: usize = 7;

/// The deviation of a board's sheet from its plan: bent, stretched and sheared.
///
/// With u, v the position on the board from its centre, in units of the distance to the farthest
/// corner,
///
/// ```text
///     z  = b₁ u² + b₂ u v + b₃ v² + b₄ u³ + b₅ u² v + b₆ u v² + b₇ v³
///     dx = a₁ u + a₂ v
///     dy = a₂ u − a₁ v
/// ```
///
/// in mm. It contains no uniform scale, rotation or translation: the distances and poses of the views absorb them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// The centre of the board, in the panel frame.
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
    /// Reduction of the squared residuals per coefficient, in a-posteriori variances: about 1 if the sheet is as
    /// planned.
    pub f_ratio: f64,
    /// Height difference of the lowest and the highest corner of the sheet, mm, above the plane that fits the centre of
    /// the plan.
    pub bent_mm: f64,
    /// Largest displacement of a corner in the plane from its planned position, mm.
    pub stretched_mm: f64,
}

/// The 99.9 % quantile of the F distribution with 9 and many degrees of freedom: a ninth of that of χ²₉, 27.9.
const SIGNIFICANT_F: f64 = 3.1;

impl BoardShape {
    /// Whether the shape is significant: for a flat sheet, noise alone would seldom cause it.
    pub fn is_significant(&self) -> bool {
        self.f_ratio > SIGNIFICANT_F
    }
}

impl Shape {
    /// The shape of a flat sheet with these corners.
    pub(crate) fn flat(corners: impl Iterator<Item = DVec3> + Clone) -> Self {
        let count = corners.clone().count().max(1) as f64;
        let middle_mm = corners.clone().sum::<DVec3>() / count;
        let reach_mm = corners.map(|p| p.distance(middle_mm)).fold(0.0, f64::max);
        Self { middle_mm, reach_mm: reach_mm.max(f64::MIN_POSITIVE), coefficients_mm: [0.0; COUNT] }
    }

    /// The displacement of a planned point per unit of each coefficient.
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

    /// The displacement of a planned point.
    pub(crate) fn offset(&self, at: DVec3) -> DVec3 {
        let moved = self.directions(at).into_iter().zip(self.coefficients_mm);
        moved.map(|(direction, mm)| direction * mm).sum()
    }
}

impl Sighting {
    /// Moves the corners to their positions on a sheet of this shape.
    pub fn bend(&mut self, shape: &Shape) {
        for seen in &mut self.observations {
            seen.panel_mm += shape.offset(seen.panel_mm);
        }
    }
}
