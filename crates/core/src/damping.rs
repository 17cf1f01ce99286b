//! Damping of Levenberg–Marquardt steps (Marquardt 1963).

/// Factors by which the damping falls after a step that lowered the cost, and grows after one that did not.
const EASE: f64 = 0.1;
const STIFFEN: f64 = 10.0;

/// Damping of steps: the fraction of the diagonal that is added to the diagonal.
#[derive(Clone, Copy, Debug)]
pub struct Damping {
    part: f64,
    least_eased: f64,
    least_stiffened: f64,
}

impl Damping {
    /// No damping: full steps.
    pub const NONE: Self = Self { part: 0.0, least_eased: 0.0, least_stiffened: 0.0 };

    /// Creates damping that starts with this fraction of the diagonal.
    pub fn from(part: f64) -> Self {
        Self { part, ..Self::NONE }
    }

    /// Sets lower limits of the damping after a step that lowered the cost, and after one that did not.
    #[must_use]
    pub fn at_least(self, least_eased: f64, least_stiffened: f64) -> Self {
        Self { least_eased, least_stiffened, ..self }
    }

    /// Returns the damping as a fraction of the diagonal.
    pub fn part(self) -> f64 {
        self.part
    }

    /// Returns a diagonal element with its damping added.
    pub fn grown(self, diagonal: f64) -> f64 {
        diagonal * (1.0 + self.part)
    }

    /// Reduces the damping after a step that lowered the cost.
    pub fn ease(&mut self) {
        self.part = (self.part * EASE).max(self.least_eased);
    }

    /// Raises the damping after a step that did not lower the cost.
    pub fn stiffen(&mut self) {
        self.part = (self.part * STIFFEN).max(self.least_stiffened);
    }
}
