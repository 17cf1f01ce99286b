//! Budget for searches in an image. The time for candidates and links grows with the number of pixels. Searches around
//! every grid and between grids would take minutes in an image made only of patterns.

/// Maximum number of searches per image, a few microseconds each. They take about a second, and are
/// about a hundred times as many as photographs of boards need.
const MAX_PASSES: usize = 200_000;

/// Remaining searches for an image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort(usize);

impl Default for Effort {
    fn default() -> Self {
        Self(MAX_PASSES)
    }
}

impl Effort {
    /// Spends `looks` searches. Returns whether there were enough.
    pub(crate) fn spend(&mut self, looks: usize) -> bool {
        let is_worth = self.0 >= looks;
        self.0 = self.0.saturating_sub(looks);
        is_worth
    }
}
