//! The request of a search, the shipped family that it starts from, and the upper bound on the
//! number of codes.

use std::time::Duration;

use super::budget::Budget;
use deltille_core::family::algebra::{AlgebraicConstruction, CycleSpace};
use deltille_core::family::{
    Construction, Family, FamilyError, Rules, Screen, TagWords, bounds_of_cells, parse_word,
    shipped_names,
};
use deltille_core::lattice::{Dimension, GridKind};

/// Request of a search: its target and duration.
///
/// ```
/// use deltille_search::best::{Best, Budget};
/// use deltille_core::family::Control;
/// use deltille_core::lattice::Dimension;
///
/// let search = Best::new(Dimension::from_bits(9)?, 5, Budget::Work(1)).seed(7);
/// let family = search.family("own9h5", None, Control::default())?;
/// assert!(!family.is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Best {
    /// Dimension of the tags.
    pub dimension: Dimension,
    /// Minimum distance h between any two codes in any rotation.
    pub distance: u32,
    /// Rules for single codes.
    pub rules: Rules,
    /// Budget of the search.
    pub budget: Budget,
    /// Seed of all random choices.
    pub seed: u64,
    /// Maximum number of codes.
    pub limit: Option<u64>,
    /// Whether local search may exchange codes at the end; otherwise the family is algebraic.
    pub exchange: bool,
}

impl Best {
    /// Creates a search for all codes that satisfy the published rules of their distance, including local search.
    pub fn new(dimension: Dimension, distance: u32, budget: Budget) -> Self {
        let rules = Rules::published(distance);
        Self { dimension, distance, rules, budget, seed: 0, limit: None, exchange: true }
    }

    /// Sets the rules for single codes.
    #[must_use]
    pub fn rules(self, rules: Rules) -> Self {
        Self { rules, ..self }
    }

    /// Sets the seed.
    #[must_use]
    pub fn seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// Sets the maximum number of codes.
    #[must_use]
    pub fn limit(self, limit: Option<u64>) -> Self {
        Self { limit, ..self }
    }

    /// Switches local search at the end on or off; see [`Self::exchange`].
    #[must_use]
    pub fn exchange(self, exchange: bool) -> Self {
        Self { exchange, ..self }
    }
}

/// Largest number of dimensions whose words are all listed and sorted. For larger codes, only the words selected by a
/// stride are listed.
pub(super) const LISTED_DIMENSIONS: u32 = 24;

/// Start of a search.
#[derive(Clone, Debug)]
pub struct Start {
    /// Name of the family on record.
    pub family: String,
    /// Codes of the family that satisfy the rules.
    pub codes: Vec<u64>,
    pub(super) construction: AlgebraicConstruction,
}

impl Best {
    /// Returns the best construction on record for these tags. It belongs to a shipped family with these bits and at
    /// least this distance; its codes are limited to those that satisfy the rules.
    pub fn start(&self) -> Option<Start> {
        let screen = self.screen();
        let on_record = |name: &str| {
            let family = Family::shipped(name).ok()?;
            let Construction::Algebraic(construction) = family.construction() else { return None };
            let fits = family.dimension() == self.dimension && family.distance() >= self.distance;
            let limit = self.limit.or(construction.stride.and(construction.limit));
            let construction = AlgebraicConstruction { limit, ..construction.clone() };
            // Exchanged words are listed regardless of the rules.
            let admitted = |word: &String| parse_word(word).is_some_and(|w| screen.admits(w));
            let all_admitted = construction.exchanged.iter().all(admitted);
            let construction = match all_admitted && self.exchange {
                true => construction,
                false => AlgebraicConstruction { exchanged: Vec::new(), ..construction },
            };
            let codes = fits.then(|| construction.codes(&screen).ok()).flatten()?;
            Some(Start { family: name.to_owned(), codes, construction })
        };
        let all = shipped_names().into_iter().filter_map(on_record);
        all.filter(|start| !start.codes.is_empty()).max_by_key(|start| start.codes.len())
    }

    /// Returns the family that a search starts from.
    ///
    /// # Errors
    /// Returns an error if the name states other bits or another distance.
    pub fn family_of(&self, name: &str, start: &Start) -> Result<Family, FamilyError> {
        let construction = Construction::Algebraic(start.construction.clone());
        let (codes, rules) = (start.codes.clone(), self.rules.clone());
        Family::new(name, self.dimension, self.distance, codes, rules, construction)
    }

    /// Returns the space in which codes are drawn. It excludes the free cells, which are the last
    /// cycles.
    pub(super) fn space(&self) -> CycleSpace {
        let whole = CycleSpace::of(self.dimension);
        let free = self.rules.free.map_or(0, |free| free.mask(self.dimension).count_ones());
        let centre = whole.centre && free % 3 != 1;
        CycleSpace { cycles: whole.cycles - free / 3, centre }
    }

    pub(super) fn screen(&self) -> Screen {
        Screen::new(TagWords::new(self.dimension), self.distance, &self.rules)
    }

    /// Returns whether exchanging codes is likely to gain more than better sources in the available time. A few
    /// seconds are not even enough to count the conflicts.
    pub(super) fn exchange_pays(&self) -> bool {
        const LEAST: Duration = Duration::from_secs(20);
        let is_long = match self.budget {
            Budget::Time(time, _) => time >= LEAST,
            Budget::Work(_) => true,
        };
        self.exchange && is_long
    }

    /// Returns an upper bound for the number of codes; the search ends when it is reached.
    pub(super) fn most(&self) -> usize {
        let cells = self.space().bits();
        let bounds = bounds_of_cells(GridKind::Deltille, cells, self.distance);
        let least = bounds.linear_programming.min(bounds.sphere_packing);
        usize::try_from(least).unwrap_or(usize::MAX)
    }
}
