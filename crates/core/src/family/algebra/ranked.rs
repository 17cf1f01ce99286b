//! The tags of an invariant linear code by number, without listing the code.
//!
//! The rotation σ splits such a code into the words F that it fixes and the words E with w + σw + σ²w = 0. On E, the
//! rotation is multiplication by a primitive third root of unity, so E is a vector space over GF(4). Words w + f and
//! w′ + f′ (w, w′ in E; f, f′ in F) are rotations of each other if and only if f = f′ and w, w′ are
//! rotations of each other. The latter holds if w and w′ span the same line over GF(4). So the
//! orbits of three words are the pairs of a word of F and a
//! point of the projective space of E: |F| · (|E|−1)/3 of them.

use super::{CycleSpace, Span};

/// The orbits of three words of an invariant linear code, numbered from 0.
#[derive(Clone, Debug)]
pub struct Ranked {
    space: CycleSpace,
    fixed: Vec<u64>,
    /// A basis of E over GF(4).
    lines: Vec<u64>,
}

impl Ranked {
    /// Numbers the orbits of `code`; `None` if the code is not invariant under the rotation.
    pub fn new(space: CycleSpace, code: &Span) -> Option<Self> {
        if !code.rows().iter().all(|&row| code.contains(space.rotate(row))) {
            return None;
        }
        let trace = |w: u64| w ^ space.rotate(w) ^ space.rotate(space.rotate(w));
        let fixed = Span::of(code.rows().iter().map(|&row| trace(row))).rows().to_vec();
        let mut span = Span::default();
        let mut lines = Vec::new();
        for &row in code.rows() {
            let word = row ^ trace(row);
            if span.insert(word) {
                span.insert(space.rotate(word));
                lines.push(word);
            }
        }
        Some(Self { space, fixed, lines })
    }

    /// Returns the number of orbits of three words.
    pub fn len(&self) -> u64 {
        self.points() << self.fixed.len()
    }

    /// Returns whether there are no orbits of three words: the rotation fixes every word.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Returns the number of points of the projective space, (4^n − 1)/3 for n dimensions over GF(4).
    fn points(&self) -> u64 {
        ((1u64 << (2 * self.lines.len())) - 1) / 3
    }

    /// Returns a word of orbit number `rank`, in cycle coordinates; `None` if there are at most `rank` orbits.
    pub fn word(&self, rank: u64) -> Option<u64> {
        if rank >= self.len() {
            return None;
        }
        let (which, mut point) = (rank / self.points(), rank % self.points());
        let chosen = (0..).zip(&self.fixed).filter(|&(i, _)| which >> i & 1 == 1);
        let mut word = chosen.fold(0, |sum, (_, w)| sum ^ w);
        // There are 4^lead points whose last nonzero coordinate, scaled to one, is number `lead`.
        let mut lead = 0;
        while point >> (2 * lead) != 0 {
            point -= 1 << (2 * lead);
            lead += 1;
        }
        word ^= self.lines[lead];
        for (i, &line) in self.lines[..lead].iter().enumerate() {
            let once = self.space.rotate(line);
            word ^= [0, line, once, line ^ once][(point >> (2 * i) & 0b11) as usize];
        }
        Some(word)
    }
}
