//! How far Levenberg–Marquardt steps are shortened (Marquardt 1963).

/// By which the damping falls after a step that lowered the cost, and grows after one that did not.
const EASE: f64 = 0.1;
const STIFFEN: f64 = 10.0;

/// The damping of steps, as a part of the diagonal that is added to it.
#[derive(Clone, Copy, Debug)]
pub struct Damping {
    part: f64,
    least_eased: f64,
    least_stiffened: f64,
}

impl Damping {
    /// None: whole steps.
    pub const NONE: Self = Self { part: 0.0, least_eased: 0.0, least_stiffened: 0.0 };

    /// Damping that starts with this part of the diagonal.
    pub fn from(part: f64) -> Self {
        Self { part, ..Self::NONE }
    }

    /// With parts that it does not fall below after a step that lowered the cost, and after one that did not.
    #[must_use]
    pub fn at_least(self, least_eased: f64, least_stiffened: f64) -> Self {
        Self { least_eased, least_stiffened, ..self }
    }

    /// The part of the diagonal.
    pub fn part(self) -> f64 {
        self.part
    }

    /// A diagonal element with its damping.
    pub fn grown(self, diagonal: f64) -> f64 {
        diagonal * (1.0 + self.part)
    }

    /// The last step lowered the cost.
    pub fn ease(&mut self) {
        self.part = (self.part * EASE).max(self.least_eased);
    }

    /// The last step did not.
    pub fn stiffen(&mut self) {
        self.part = (self.part * STIFFEN).max(self.least_stiffened);
    }
}
