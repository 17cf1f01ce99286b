//! Compatible codes with hidden cells, selected from those of a construction.
//!
//! Words of a code that are far enough apart may be too close with hidden cells. Selecting compatible ones is an
//! independent-set problem, solved by local search ([`super::independent`]).

use super::independent::ConflictGraph;
use deltille_core::family::algebra::AlgebraicConstruction;
use deltille_core::family::{FamilyError, Screen};

/// Maximum number of words considered: their conflicts must fit in memory.
const MAX_WORDS: usize = 30_000;

/// Number of moves of the local search.
const STEPS: u64 = 4_000_000;

/// Adds a list of selected words to a construction if that gives more codes; returns the codes and
/// the construction. Without such a list, a construction takes words in order, which is rarely the
/// best selection.
pub(crate) fn with_the_most_codes(
    screen: &Screen,
    construction: AlgebraicConstruction,
    codes: Vec<u64>,
    halt: impl Fn() -> bool + Sync,
) -> Result<(Vec<u64>, AlgebraicConstruction), FamilyError> {
    if !screen.is_robust() || construction.stride.is_some() {
        return Ok((codes, construction));
    }
    let words = construction.words_of_the_union(screen)?;
    if words.len() == codes.len() || words.len() > MAX_WORDS {
        return Ok((codes, construction));
    }
    let mut pool = codes.clone();
    pool.extend(words.into_iter().filter(|word| !codes.contains(word)));
    let graph = ConflictGraph::of_words(screen, &pool, || false);
    let first: Vec<u32> = (0..codes.len() as u32).collect();
    let found = graph.search(&first, construction.seed, STEPS, halt);
    if found.len() <= codes.len() {
        return Ok((codes, construction));
    }
    // Words listed one by one come first and leave the remaining room to others.
    let listed = found.iter().map(|&i| screen.words().hex(pool[i as usize])).collect();
    let construction = AlgebraicConstruction { exchanged: listed, ..construction };
    Ok((construction.codes(screen)?, construction))
}

#[cfg(test)]
mod tests {
    use crate::best::{Best, Budget};
    use crate::local::Search;
    use deltille_core::family::lexicode::Lexicode;
    use deltille_core::family::{
        Construction, Control, Family, Robust, Rules, Screen, TagWords, certify,
    };
    use deltille_core::lattice::Dimension;

    fn rules(distance: u32, robust: &str) -> Rules {
        let robust: Vec<Robust> = vec![robust.parse().unwrap()];
        Rules { robust, ..Rules::published(distance) }
    }

    /// For every method, the result is proven and contains a fraction of the codes without the rule.
    #[test]
    fn all_methods_find_codes_robust_to_hidden_cells() {
        let dimension = Dimension::from_bits(16).unwrap();
        for (robust, least) in [("apex", 20), ("edge", 5), ("tile=2", 20)] {
            let rules = rules(5, robust);
            let lexicode = Lexicode::published(dimension, 5).rules(rules.clone());
            let lexicode = lexicode.family("own", Control::default()).unwrap();
            let search = Search { seed: 1, rounds: 1, steps: 20_000 };
            let screen = Screen::new(TagWords::new(dimension), 5, &rules);
            let codes = search.codes(&screen, Control::default()).unwrap();
            let construction = search.construction(1);
            let searched =
                Family::new("own", dimension, 5, codes, rules.clone(), construction).unwrap();
            let mut families = vec![lexicode, searched];
            // This takes seconds.
            if robust == "edge" {
                let best = Best::new(dimension, 5, Budget::Work(1)).rules(rules);
                families.push(best.family("own", best.start(), Control::default()).unwrap());
            }
            for family in families {
                let certificate = certify(&family);
                assert!(certificate.is_valid(), "{robust}: {:?}", certificate.failures);
                assert!(certificate.robust[0].distance >= family.rules().robust[0].distance);
                assert!(family.len() >= least, "{robust}: {}", family.len());
                assert_eq!(Family::from_json(&family.to_json()).unwrap(), family);
            }
        }
    }

    #[test]
    fn wrong_claims_are_found() {
        let family = Family::shipped("d16h5").unwrap();
        let construction = Construction::Imported { source: "a test".to_owned() };
        let (dimension, codes) = (family.dimension(), family.codes().to_vec());
        let claims = Family::new("own", dimension, 5, codes, rules(5, "edge"), construction);
        let failures = certify(&claims.unwrap()).failures;
        assert!(failures.iter().any(|failure| failure.starts_with("robust: ")), "{failures:?}");
    }
}
