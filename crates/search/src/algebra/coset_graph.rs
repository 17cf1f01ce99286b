//! Unions of cosets of an invariant linear code K, by clique search.
//!
//! Two cosets of K are at distance h or more if and only if the sum of their syndromes is not the
//! syndrome of a word
//! lighter than h. All syndromes of such words are marked once. A code K ∪ (K+a) ∪ … with distance h is then a set of
//! syndromes that contains 0 and whose pairwise sums are all unmarked: a clique in a Cayley graph (an independent set
//! in its complement). Its vertices here are whole orbits of syndromes under the rotation, so that the union is
//! invariant.
//!
//! The search draws the first vertices at random and finds the best completion, so the union need not be the largest.
//! The table of marks has one bit for each syndrome, which limits codes to [`MAX_SYNDROME_BITS`].

use deltille_core::family::algebra::{CosetUnion, CycleSpace, LinearMap, Span};
use rand::SeedableRng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

use super::clique::Cliques;

/// Largest number of syndrome bits; the table of marked syndromes then takes 16 MiB.
pub const MAX_SYNDROME_BITS: u32 = 27;

/// The compatibility graph of the cosets of one code. Vertices are orbits of cosets that keep the distance;
/// edges join those that keep the distance between each other.
#[derive(Clone, Debug)]
pub struct CosetGraph {
    space: CycleSpace,
    code: Span,
    free_bits: Vec<u32>,
    /// Bit s: some word lighter than h has syndrome s.
    marked: Vec<u64>,
    turned: LinearMap,
    vertices: Vec<Vertex>,
}

/// An orbit of syndromes under the rotation: one syndrome that the rotation fixes, or three.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    syndrome: u32,
    /// Number of orbits of three words in its cosets.
    weight: u32,
}

impl CosetGraph {
    /// Creates the graph of an invariant `code` for minimum distance `distance` (1 or more). Returns `None` if the
    /// code itself has a smaller distance, its syndromes have more than [`MAX_SYNDROME_BITS`] bits, or `halt`
    /// returned true before the table was complete.
    pub fn new(
        space: CycleSpace,
        code: Span,
        distance: u32,
        halt: &dyn Fn() -> bool,
    ) -> Option<Self> {
        let free_bits = code.free_bits(space.bits());
        let syndrome_bits = free_bits.len() as u32;
        if syndrome_bits > MAX_SYNDROME_BITS {
            return None;
        }
        let syndromes = code.syndromes(space.bits())?;
        let columns: Vec<u32> = (0..space.bits()).map(|i| syndromes.apply(1 << i)).collect();
        let mut marked = vec![0u64; (1usize << syndrome_bits).div_ceil(64)];
        if !mark(&columns, 0, distance - 1, &mut marked, halt) {
            return None;
        }
        let turned: Vec<u32> =
            free_bits.iter().map(|&i| syndromes.apply(space.rotate(1 << i))).collect();
        let turned = LinearMap::of_columns(&turned);
        let mut graph = Self { space, code, free_bits, marked, turned, vertices: Vec::new() };
        graph.vertices = graph.find_vertices();
        Some(graph)
    }

    /// Returns the number of orbits of cosets that can be united with the code itself.
    pub fn vertices(&self) -> usize {
        self.vertices.len()
    }

    fn find_vertices(&self) -> Vec<Vertex> {
        let words = 1u32 << self.code.dimension();
        let fixed_words = self.code.words().filter(|&w| self.space.rotate(w) == w).count() as u32;
        let fixed_weight = (words - fixed_words) / 3;
        (1..1u32 << self.free_bits.len())
            .filter(|&s| !self.is_marked(s))
            .filter_map(|syndrome| {
                let once = self.rotate(syndrome);
                if once == syndrome {
                    return Some(Vertex { syndrome, weight: fixed_weight });
                }
                let twice = self.rotate(once);
                let first = syndrome < once && syndrome < twice;
                (first && !self.is_marked(syndrome ^ once))
                    .then_some(Vertex { syndrome, weight: words })
            })
            .collect()
    }

    fn is_marked(&self, syndrome: u32) -> bool {
        self.marked[syndrome as usize / 64] >> (syndrome % 64) & 1 == 1
    }

    fn rotate(&self, syndrome: u32) -> u32 {
        self.turned.apply(syndrome.into())
    }

    fn adjacent(&self, a: u32, b: u32) -> bool {
        let once = self.rotate(b);
        !self.is_marked(a ^ b)
            && !self.is_marked(a ^ once)
            && !self.is_marked(a ^ self.rotate(once))
    }

    /// Returns a large union, grown from one random start. Vertices are added one by one. Each step
    /// compares a few random candidates and adds the one that leaves the most possible words. When
    /// few are left, branch and bound finds the heaviest
    /// clique of these, unless `halt` returns true. The result depends only on `seed`, unless `halt` ended the
    /// search.
    pub fn grow(&self, seed: u64, halt: impl Fn() -> bool) -> CosetUnion {
        /// Number of candidates that are compared before each choice.
        const LOOK_AT: usize = 12;
        /// Number of vertices below which branch and bound is used, and number of branches
        /// searched.
        const FEW: usize = 800;
        const NODES: u32 = 4_000;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut chosen: Vec<Vertex> = Vec::new();
        let mut open = self.vertices.clone();
        while !open.is_empty() && !halt() {
            if open.len() <= FEW {
                let weights = open.iter().map(|v| v.weight).collect();
                let adjacent =
                    |i: usize, j: usize| self.adjacent(open[i].syndrome, open[j].syndrome);
                let heaviest = Cliques::new(weights, adjacent).heaviest(NODES);
                chosen.extend(heaviest.into_iter().map(|v| open[v]));
                break;
            }
            let tries = if open.len() > 50_000 { 1 } else { LOOK_AT.min(open.len()) };
            let best = (0..tries)
                .map(|_| {
                    let pick = *open.choose(&mut random).expect("not empty");
                    let left: Vec<Vertex> = open
                        .iter()
                        .copied()
                        .filter(|v| {
                            v.syndrome != pick.syndrome && self.adjacent(v.syndrome, pick.syndrome)
                        })
                        .collect();
                    (pick, left)
                })
                .max_by_key(|(pick, left)| {
                    let weight: u64 = left.iter().map(|v| u64::from(v.weight)).sum();
                    u64::from(pick.weight) * 3 + weight
                });
            let Some((pick, left)) = best else { break };
            chosen.push(pick);
            open = left;
        }
        self.union(&chosen)
    }

    fn union(&self, chosen: &[Vertex]) -> CosetUnion {
        let mut syndromes = vec![0];
        for vertex in chosen {
            let once = self.rotate(vertex.syndrome);
            syndromes.push(vertex.syndrome);
            if once != vertex.syndrome {
                syndromes.extend([once, self.rotate(once)]);
            }
        }
        let cosets = syndromes.iter().map(|&s| self.word(s)).collect();
        CosetUnion { space: self.space, code: self.code.clone(), cosets }
    }

    /// Returns the word of this syndrome that has only free bits set.
    fn word(&self, syndrome: u32) -> u64 {
        (0..)
            .zip(&self.free_bits)
            .filter(|&(i, _)| syndrome >> i & 1 == 1)
            .fold(0, |word, (_, bit)| word | 1 << bit)
    }
}

/// Marks the syndromes of all words of up to `weight` set bits, as sums of columns added to `sum`. Returns false if
/// one or more columns sum to zero, so that the code has such a light word, or if `halt` returned true first.
fn mark(
    columns: &[u32],
    sum: u32,
    weight: u32,
    marked: &mut [u64],
    halt: &dyn Fn() -> bool,
) -> bool {
    /// Remaining weight at which `halt` is called: about ten thousand sums lie between two calls.
    const LOOK_AT: u32 = 4;
    marked[sum as usize / 64] |= 1 << (sum % 64);
    if weight == 0 {
        return true;
    }
    if weight == LOOK_AT && halt() {
        return false;
    }
    columns.iter().enumerate().all(|(i, column)| {
        sum != *column && mark(&columns[i + 1..], sum ^ column, weight - 1, marked, halt)
    })
}
