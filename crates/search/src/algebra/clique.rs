//! The heaviest clique of a small graph, by branch and bound.
//!
//! Vertices are coloured greedily, so that no two of a colour are adjacent. A clique has at most one vertex of each
//! colour, so the heaviest vertices of the colours bound its weight (Carraghan and Pardalos 1990, Tomita and Seki
//! 2003, here with weights). Vertex sets are bit sets.

/// A graph of weighted vertices; edges join compatible vertices.
pub(super) struct Cliques {
    words: usize,
    rows: Vec<u64>,
    weights: Vec<u32>,
}

/// Progress of a search.
struct Search {
    best: u64,
    found: Vec<usize>,
    chosen: Vec<usize>,
    nodes: u32,
}

impl Cliques {
    /// Creates the graph of vertices with these weights and a symmetric relation.
    pub(super) fn new(weights: Vec<u32>, adjacent: impl Fn(usize, usize) -> bool) -> Self {
        let n = weights.len();
        let words = n.div_ceil(64);
        let mut rows = vec![0; n * words];
        for i in 0..n {
            for j in 0..i {
                if adjacent(i, j) {
                    rows[i * words + j / 64] |= 1 << (j % 64);
                    rows[j * words + i / 64] |= 1 << (i % 64);
                }
            }
        }
        Self { words, rows, weights }
    }

    /// Returns the heaviest clique, or the heaviest found in `nodes` branches.
    pub(super) fn heaviest(&self, nodes: u32) -> Vec<usize> {
        let mut all = vec![0; self.words];
        (0..self.weights.len()).for_each(|v| all[v / 64] |= 1 << (v % 64));
        let mut search = Search { best: 0, found: Vec::new(), chosen: Vec::new(), nodes };
        self.branch(all, 0, &mut search);
        search.found
    }

    fn branch(&self, mut open: Vec<u64>, weight: u64, search: &mut Search) {
        let Some(left) = search.nodes.checked_sub(1) else { return };
        search.nodes = left;
        for (v, bound) in self.coloured(&open).into_iter().rev() {
            if weight + bound <= search.best || search.nodes == 0 {
                return;
            }
            search.chosen.push(v);
            let heavier = weight + u64::from(self.weights[v]);
            if heavier > search.best {
                search.best = heavier;
                search.found.clone_from(&search.chosen);
            }
            let inner: Vec<u64> = open.iter().zip(self.row(v)).map(|(a, b)| a & b).collect();
            if inner.iter().any(|&word| word != 0) {
                self.branch(inner, heavier, search);
            }
            search.chosen.pop();
            open[v / 64] &= !(1 << (v % 64));
        }
    }

    /// Returns the vertices colour by colour, each with a bound for cliques among it and those before it.
    fn coloured(&self, open: &[u64]) -> Vec<(usize, u64)> {
        let mut uncoloured = open.to_vec();
        let mut order = Vec::new();
        let mut total = 0;
        while uncoloured.iter().any(|&word| word != 0) {
            let first = order.len();
            let mut fitting = uncoloured.clone();
            let mut heaviest = 0;
            for i in 0..self.words {
                while fitting[i] != 0 {
                    let v = 64 * i + fitting[i].trailing_zeros() as usize;
                    let bit = 1 << (v % 64);
                    uncoloured[i] &= !bit;
                    fitting[i] &= !bit;
                    fitting[i..].iter_mut().zip(&self.row(v)[i..]).for_each(|(a, b)| *a &= !b);
                    heaviest = heaviest.max(u64::from(self.weights[v]));
                    order.push((v, 0));
                }
            }
            total += heaviest;
            order[first..].iter_mut().for_each(|(_, bound)| *bound = total);
        }
        order
    }

    fn row(&self, v: usize) -> &[u64] {
        &self.rows[v * self.words..(v + 1) * self.words]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn finds_the_heaviest_clique(edges: [u16; 12], weights in prop::array::uniform12(1u32..9)) {
            let adjacent = |i: usize, j: usize| edges[i.max(j)] >> i.min(j) & 1 == 1;
            let is_clique = |set: u32| {
                let inside = |v: usize| set >> v & 1 == 1;
                (0..12).all(|i| (0..i).all(|j| !inside(i) || !inside(j) || adjacent(i, j)))
            };
            let weight = |set: u32| (0..12).filter(|v| set >> v & 1 == 1).map(|v| weights[v]).sum();
            let heaviest: u32 = (0..1u32 << 12).filter(|&s| is_clique(s)).map(weight).max().unwrap();
            let found = Cliques::new(weights.to_vec(), adjacent).heaviest(u32::MAX);
            let found = found.into_iter().fold(0, |set, v| set | 1 << v);
            prop_assert!(is_clique(found));
            prop_assert_eq!(weight(found), heaviest);
        }
    }
}
