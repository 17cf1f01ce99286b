//! What is asked for, what is on record for it, and what bounds it.

use std::time::Duration;

use super::budget::Budget;
use deltille_core::family::algebra::{AlgebraicConstruction, CycleSpace};
use deltille_core::family::{
    Construction, Family, FamilyError, Rules, Screen, TagWords, bounds_of_cells, parse_word,
    shipped_names,
};
use deltille_core::lattice::{Dimension, GridKind};

/// What to search and for how long.
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
    /// Least distance h between any two codes in any turn.
    pub distance: u32,
    /// Rules for single codes.
    pub rules: Rules,
    /// How long to search.
    pub budget: Budget,
    /// Seed of all random choices.
    pub seed: u64,
    /// Number of codes at most.
    pub limit: Option<u64>,
    /// Whether local search may exchange codes at the end; without it the family is algebraic.
    pub exchange: bool,
}

impl Best {
    /// A search for all codes that satisfy the published rules of their distance, local search included.
    pub fn new(dimension: Dimension, distance: u32, budget: Budget) -> Self {
        let rules = Rules::published(distance);
        Self { dimension, distance, rules, budget, seed: 0, limit: None, exchange: true }
    }

    /// With other rules for single codes.
    #[must_use]
    pub fn rules(self, rules: Rules) -> Self {
        Self { rules, ..self }
    }

    /// With other random choices.
    #[must_use]
    pub fn seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// With so many codes at most.
    #[must_use]
    pub fn limit(self, limit: Option<u64>) -> Self {
        Self { limit, ..self }
    }

    /// With local search at the end, or without; see [`Self::exchange`].
    #[must_use]
    pub fn exchange(self, exchange: bool) -> Self {
        Self { exchange, ..self }
    }
}

/// Codes of which no more words than of so many dimensions are listed and put in order; of larger ones those are listed
/// that a stride meets.
pub(super) const LISTED_DIMENSIONS: u32 = 24;

/// What a search starts from.
#[derive(Clone, Debug)]
pub struct Start {
    /// Name of the family on record.
    pub family: String,
    /// Its codes, as far as they satisfy the rules.
    pub codes: Vec<u64>,
    pub(super) construction: AlgebraicConstruction,
}

impl Best {
    /// The best construction on record for such tags: of a shipped family with these bits and this distance or a
    /// greater one, as far as its codes satisfy the rules.
    pub fn start(&self) -> Option<Start> {
        let screen = self.screen();
        let on_record = |name: &str| {
            let family = Family::shipped(name).ok()?;
            let Construction::Algebraic(construction) = family.construction() else { return None };
            let fits = family.dimension() == self.dimension && family.distance() >= self.distance;
            let limit = self.limit.or(construction.stride.and(construction.limit));
            let construction = AlgebraicConstruction { limit, ..construction.clone() };
            // Exchanged words are listed whatever the rules.
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

    /// The family that a search starts from.
    ///
    /// # Errors
    /// Where the name speaks of other bits or another distance.
    pub fn family_of(&self, name: &str, start: &Start) -> Result<Family, FamilyError> {
        let construction = Construction::Algebraic(start.construction.clone());
        let (codes, rules) = (start.codes.clone(), self.rules.clone());
        Family::new(name, self.dimension, self.distance, codes, rules, construction)
    }

    /// The space that codes are drawn in: without the cells that none may use, which are its last cycles.
    pub(super) fn space(&self) -> CycleSpace {
        let whole = CycleSpace::of(self.dimension);
        let free = self.rules.free.map_or(0, |free| free.mask(self.dimension).count_ones());
        let centre = whole.centre && free % 3 != 1;
        CycleSpace { cycles: whole.cycles - free / 3, centre }
    }

    pub(super) fn screen(&self) -> Screen {
        Screen::new(TagWords::new(self.dimension), self.distance, &self.rules)
    }

    /// Whether there is time to gain more by exchanging codes than better sources gain: in a few
    /// seconds not even the conflicts are counted.
    pub(super) fn exchange_pays(&self) -> bool {
        const LEAST: Duration = Duration::from_secs(20);
        let is_long = match self.budget {
            Budget::Time(time, _) => time >= LEAST,
            Budget::Work(_) => true,
        };
        self.exchange && is_long
    }

    /// No family is larger; once there are so many codes, the search is over.
    pub(super) fn most(&self) -> usize {
        let cells = self.space().bits();
        let bounds = bounds_of_cells(GridKind::Deltille, cells, self.distance);
        let least = bounds.linear_programming.min(bounds.sphere_packing);
        usize::try_from(least).unwrap_or(usize::MAX)
    }
}
