//! Large independent sets in graphs: compatible codes among many candidates.
//!
//! The search is a local search with plateau moves (after Andrade, Resende, Werneck, "Fast local search for the
//! maximum independent set problem", J. Heuristics 2012). A vertex without conflict is added at once.
//! Otherwise, a vertex with a single conflict replaces the conflicting one. If there are several,
//! the one that has been outside the longest is used. If there is no gain for a while, one to four
//! vertices with few conflicts are forced in, or the search returns to the best set. The result
//! depends only on the seed and the number of steps.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use deltille_core::family::Screen;
use deltille_core::family::nearer;

/// Pairs of vertices that exclude each other; all lists are in one array.
#[derive(Clone, Debug)]
pub(crate) struct ConflictGraph {
    starts: Vec<usize>,
    lists: Vec<u32>,
}

impl ConflictGraph {
    /// Creates the graph of `n` vertices with the given neighbours of each, a symmetric relation.
    pub(crate) fn new(n: usize, neighbours: impl Fn(usize) -> Vec<u32> + Sync + Send) -> Self {
        let rows: Vec<Vec<u32>> = (0..n).into_par_iter().map(neighbours).collect();
        let mut starts = vec![0];
        starts.extend(rows.iter().scan(0, |sum, row| {
            *sum += row.len();
            Some(*sum)
        }));
        Self { starts, lists: rows.concat() }
    }

    /// Creates the graph of words that are too close to each other, in any rotation. Some conflicts are missing if
    /// `halt` returned true first.
    pub(crate) fn of_words(
        screen: &Screen,
        pool: &[u64],
        halt: impl Fn() -> bool + Sync + Send,
    ) -> Self {
        let turned: Vec<u64> = pool.iter().flat_map(|&w| screen.words().rotations(w)).collect();
        Self::new(pool.len(), |i| {
            if halt() {
                return Vec::new();
            }
            let mut near = nearer(pool[i], &turned, screen.reach());
            if screen.is_robust() {
                near.retain(|&at| !screen.is_apart(pool[i] ^ turned[at as usize]));
            }
            near.iter_mut().for_each(|j| *j /= 3);
            near.dedup();
            near.retain(|&j| j != i as u32);
            near
        })
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn neighbours(&self, v: u32) -> &[u32] {
        &self.lists[self.starts[v as usize]..self.starts[v as usize + 1]]
    }

    /// Grows a large independent set from `initial` (itself independent). Stops after `steps` moves or when `stop`
    /// returns true, which is checked from time to time.
    pub(crate) fn search(
        &self,
        initial: &[u32],
        seed: u64,
        steps: u64,
        stop: impl Fn() -> bool,
    ) -> Vec<u32> {
        /// Steps between two checks of the clock.
        const STOP_CHECK: u64 = 1 << 10;
        /// Minimum number of steps that a removed vertex stays outside; up to four more are added.
        const TABU: u64 = 7;
        /// Number of vertices with one conflict that are compared before each exchange.
        const LOOK_AT: usize = 50;
        /// Steps without gain after which vertices are forced in: fraction of all steps, and
        /// maximum.
        const PATIENCE: (u64, u64) = (8, 3_000);
        /// Loss of vertices, relative to the best set, at which the search returns to that set.
        const TOO_FAR: usize = 3;
        let patience = (steps / PATIENCE.0).clamp(1, PATIENCE.1);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut state = State::new(self, initial);
        let mut best = state.chosen.items.clone();
        let mut left_at = vec![0u64; self.len()];
        let mut last_gain = 0;
        for step in 1..=steps {
            if self.len() == 0 || (step % STOP_CHECK == 0 && stop()) {
                break;
            }
            let rested = |v: &u32| left_at[*v as usize] <= step;
            if let Some(v) = state.free.pick(&mut random) {
                state.add(v);
            } else if step - last_gain > patience {
                last_gain = step;
                if state.chosen.items.len() + TOO_FAR < best.len() || random.random_ratio(1, 20) {
                    state = State::new(self, &best);
                }
                for _ in 0..4 {
                    if let Some(v) = state.loosest(&mut random) {
                        state.force(v, |u| left_at[u as usize] = step + TABU + step % 5);
                    }
                    if random.random_bool(0.5) {
                        break;
                    }
                }
            } else if let Some(v) = (0..LOOK_AT.min(state.single.items.len()))
                .filter_map(|_| state.single.pick(&mut random))
                .filter(rested)
                .min_by_key(|&v| left_at[v as usize])
            {
                state.force(v, |u| left_at[u as usize] = step + TABU + step % 5);
            }
            if state.chosen.items.len() > best.len() {
                best.clone_from(&state.chosen.items);
                last_gain = step;
            }
        }
        best
    }
}

/// A set of vertices with constant-time insertion, removal and random choice.
struct Set {
    items: Vec<u32>,
    place: Vec<u32>,
}

const ABSENT: u32 = u32::MAX;

impl Set {
    fn new(n: usize) -> Self {
        Self { items: Vec::new(), place: vec![ABSENT; n] }
    }

    fn contains(&self, v: u32) -> bool {
        self.place[v as usize] != ABSENT
    }

    fn insert(&mut self, v: u32) {
        if !self.contains(v) {
            self.place[v as usize] = self.items.len() as u32;
            self.items.push(v);
        }
    }

    fn remove(&mut self, v: u32) {
        let at = std::mem::replace(&mut self.place[v as usize], ABSENT);
        if at != ABSENT {
            self.items.swap_remove(at as usize);
            if let Some(&moved) = self.items.get(at as usize) {
                self.place[moved as usize] = at;
            }
        }
    }

    fn pick(&self, random: &mut ChaCha8Rng) -> Option<u32> {
        (!self.items.is_empty()).then(|| self.items[random.random_range(0..self.items.len())])
    }
}

/// An independent set, and the number of its vertices that exclude each vertex.
struct State<'a> {
    graph: &'a ConflictGraph,
    chosen: Set,
    conflicts: Vec<u32>,
    /// Vertices outside with no conflict, and with one.
    free: Set,
    single: Set,
}

impl<'a> State<'a> {
    fn new(graph: &'a ConflictGraph, initial: &[u32]) -> Self {
        let n = graph.len();
        let mut free = Set::new(n);
        (0..n as u32).for_each(|v| free.insert(v));
        let chosen = Set::new(n);
        let mut state = Self { graph, chosen, conflicts: vec![0; n], free, single: Set::new(n) };
        for &v in initial {
            state.add(v);
        }
        state
    }

    fn add(&mut self, v: u32) {
        self.free.remove(v);
        self.single.remove(v);
        self.chosen.insert(v);
        for &u in self.graph.neighbours(v) {
            self.conflicts[u as usize] += 1;
            match self.conflicts[u as usize] {
                1 => {
                    self.free.remove(u);
                    self.single.insert(u);
                }
                2 => self.single.remove(u),
                _ => {}
            }
        }
    }

    fn remove(&mut self, v: u32) {
        self.chosen.remove(v);
        match self.conflicts[v as usize] {
            0 => self.free.insert(v),
            1 => self.single.insert(v),
            _ => {}
        }
        for &u in self.graph.neighbours(v) {
            self.conflicts[u as usize] -= 1;
            match self.conflicts[u as usize] {
                0 => {
                    self.single.remove(u);
                    self.free.insert(u);
                }
                1 => self.single.insert(u),
                _ => {}
            }
        }
    }

    /// Returns the vertex with the fewest conflicts among some random ones outside.
    fn loosest(&self, random: &mut ChaCha8Rng) -> Option<u32> {
        (0..20)
            .map(|_| random.random_range(0..self.graph.len() as u32))
            .filter(|&v| !self.chosen.contains(v))
            .min_by_key(|&v| self.conflicts[v as usize])
    }

    /// Adds a vertex after removing the vertices it excludes.
    fn force(&mut self, v: u32, mut left: impl FnMut(u32)) {
        let out: Vec<u32> =
            self.graph.neighbours(v).iter().copied().filter(|&u| self.chosen.contains(u)).collect();
        for u in out {
            self.remove(u);
            left(u);
        }
        self.add(v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_largest_set_of_a_cycle_and_keeps_it_independent() {
        let n = 41;
        let graph =
            ConflictGraph::new(n, |i| [(i + 1) % n, (i + n - 1) % n].map(|j| j as u32).to_vec());
        assert!(ConflictGraph::new(0, |_| Vec::new()).search(&[], 1, 10, || false).is_empty());
        let set = graph.search(&[3], 1, 20_000, || false);
        assert_eq!(set.len(), 20);
        assert!(set.iter().all(|&v| !graph.neighbours(v).iter().any(|u| set.contains(u))));
    }
}
