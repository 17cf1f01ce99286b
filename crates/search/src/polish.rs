//! Local search among all words: codes are exchanged for others until more fit.
//!
//! Most words conflict with many codes of a good family and never help. So each round counts, for every word, how
//! many codes it conflicts with. It takes the words with the fewest conflicts as candidates, and searches for a
//! larger set of compatible ones among them and the present codes.

use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::independent::ConflictGraph;
use deltille_core::family::{Control, Screen};

/// Largest number of bits at which words are counted in a table of all of them.
pub(crate) const MAX_BITS: u32 = 25;

/// Number of candidates in one round: their conflicts must fit in memory.
const POOL: usize = 24_000;

/// Duration and start of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Effort {
    pub seed: u64,
    pub rounds: u32,
    /// Number of moves of the local search in a round.
    pub steps: u64,
    /// Sufficient number of codes.
    pub most: usize,
}

/// Returns a family at least as large as `codes`, which must be valid. The screen admits every code of the result,
/// and all distances are kept.
pub(crate) fn polish(
    screen: &Screen,
    codes: Vec<u64>,
    effort: Effort,
    control: Control,
    stop: impl Fn() -> bool + Sync,
) -> Vec<u64> {
    if screen.words().dimension().bits() > MAX_BITS {
        return codes;
    }
    let mut best = codes;
    let halt = || control.is_cancelled() || stop();
    for number in 0..effort.rounds {
        if halt() || best.len() >= effort.most {
            break;
        }
        best = round(screen, &best, effort, number, halt);
        control.tell(u64::from(number) + 1, u64::from(effort.rounds), best.len());
    }
    best
}

/// Performs one round. It has its own random numbers, so that later rounds do not depend on whether the search was
/// interrupted in between.
pub(crate) fn round(
    screen: &Screen,
    codes: &[u64],
    effort: Effort,
    number: u32,
    halt: impl Fn() -> bool + Sync,
) -> Vec<u64> {
    let mut random = ChaCha8Rng::seed_from_u64(effort.seed);
    random.set_stream(number.into());
    let Some(pool) = candidates(screen, codes, &mut random, &halt) else { return codes.to_vec() };
    let graph = ConflictGraph::of_words(screen, &pool, &halt);
    // Without all conflicts, nothing can be exchanged.
    if halt() {
        return codes.to_vec();
    }
    let initial: Vec<u32> = (0..codes.len() as u32).collect();
    let found = graph.search(&initial, random.random(), effort.steps, halt);
    found.into_iter().map(|i| pool[i as usize]).collect()
}

/// Returns the codes, then the words with the fewest conflicts, up to [`POOL`] in all; `None` if `halt` returned true
/// first.
fn candidates(
    screen: &Screen,
    codes: &[u64],
    random: &mut ChaCha8Rng,
    halt: impl Fn() -> bool,
) -> Option<Vec<u64>> {
    let words = screen.words();
    let bits = words.dimension().bits();
    let mut conflicts = vec![0u8; 1 << bits];
    let hidden = screen.hidden_differences();
    for &code in codes {
        if halt() {
            return None;
        }
        for word in words.rotations(code) {
            count_ball(&mut conflicts, word as usize, bits, screen.distance() - 1);
            for difference in &hidden {
                let count = &mut conflicts[(word ^ difference) as usize];
                *count = count.saturating_add(1);
            }
        }
    }
    let mut own: Vec<u64> = codes.iter().map(|&code| words.canonical(code)).collect();
    own.sort_unstable();
    let mut by_conflicts: Vec<Vec<u64>> = vec![Vec::new(); 256];
    for word in 0..1u64 << bits {
        let count = conflicts[word as usize];
        let level = &mut by_conflicts[usize::from(count)];
        if level.len() < 50 * POOL
            && screen.admits(word)
            && words.canonical(word) == word
            && own.binary_search(&word).is_err()
        {
            level.push(word);
        }
    }
    let mut pool = codes.to_vec();
    for level in by_conflicts {
        let room = POOL.saturating_sub(pool.len());
        if level.len() <= room {
            pool.extend(level);
        } else {
            pool.extend(level.choose_multiple(random, room));
            break;
        }
    }
    Some(pool)
}

/// Adds one to the count of every word within `radius` of `word`.
fn count_ball(counts: &mut [u8], word: usize, bits: u32, radius: u32) {
    counts[word] = counts[word].saturating_add(1);
    if radius > 0 {
        for bit in 0..bits {
            count_ball(counts, word ^ 1 << bit, bit, radius - 1);
        }
    }
}
