//! How long a picture is looked at. Candidates and links take a time that grows with its pixels; what is sought
//! around every grid, and between the grids, would take minutes in a picture made of nothing else.

/// Looks that a picture is worth, at some microseconds each: some hundred times what photographs of boards take, and
/// about a second.
const MOST_LOOKS: usize = 200_000;

/// What is left of the looks that a picture is worth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort(usize);

impl Default for Effort {
    fn default() -> Self {
        Self(MOST_LOOKS)
    }
}

impl Effort {
    /// Spends so many looks; whether there were as many.
    pub(crate) fn spend(&mut self, looks: usize) -> bool {
        let is_worth = self.0 >= looks;
        self.0 = self.0.saturating_sub(looks);
        is_worth
    }
}
