//! All words that are far enough from every code of a list, without trying each one.
//!
//! In cycle coordinates a word is a string of three-bit symbols. A tree over the first symbols carries the list of
//! codes that are still close enough to exclude words, with their distance so far; it shrinks from level to level.
//! Under each leaf remain 9 bits, 512 words, as a bitmap; each remaining code clears a precomputed ball of it. That
//! costs a few machine operations per *code*, shared by 512 words, where a scan would pay for every pair.
//!
//! Only one of the three rotations of a word is visited: until a symbol differs from its own rotations, only one of
//! each three rotated symbols is tried.

use rayon::prelude::*;

use crate::family::algebra::{Arrangement, CycleSpace};
use crate::family::kernels::{LEAF_BITS, Leaf, cover, thin_out};
use crate::family::{Control, FamilyError, Screen};

/// A prepared sweep: the tree is divided into parts that can be processed in any order.
pub(super) struct Sweep<'a> {
    screen: &'a Screen,
    /// Codes and their rotations, in cycle coordinates.
    list: Vec<u64>,
    balls: Vec<Leaf>,
    parts: Vec<(u64, bool)>,
    space: CycleSpace,
    bit_map: Vec<u8>,
}

/// Number of symbols that the parts of the tree fix.
const PART_SYMBOLS: u32 = 3;

impl<'a> Sweep<'a> {
    /// Returns whether words with this number of bits can be swept: they must consist of whole
    /// symbols, and of enough of them.
    pub(super) fn suits(bits: u32) -> bool {
        bits.is_multiple_of(3) && bits / 3 > PART_SYMBOLS + LEAF_BITS / 3
    }

    /// Creates a sweep for the words that `screen` admits and that are far enough from all of `turned`.
    pub(super) fn new(screen: &'a Screen, turned: &[u64]) -> Self {
        let dimension = screen.words().dimension();
        let space = CycleSpace::of(dimension);
        let bit_map = Arrangement::plain(space).bit_map(dimension);
        let list = turned
            .iter()
            .map(|word| (0..).zip(&bit_map).fold(0, |w, (i, &tag)| w | (word >> tag & 1) << i))
            .collect();
        let balls = (0..=LEAF_BITS)
            .flat_map(|radius| (0..1u32 << LEAF_BITS).map(move |centre| ball(centre, radius)))
            .collect();
        let mut parts = vec![(0, false)];
        for _ in 0..PART_SYMBOLS {
            parts = parts
                .into_iter()
                .flat_map(|(prefix, decided)| {
                    symbols(decided)
                        .iter()
                        .map(move |&s| (prefix << 3 | s, decided || !is_constant(s)))
                })
                .collect();
        }
        Self { screen, list, balls, parts, space, bit_map }
    }

    /// Returns the number of parts.
    pub(super) fn parts(&self) -> usize {
        self.parts.len()
    }

    /// Returns the words found in some parts, in the order of the parts: the smallest of each three rotations.
    pub(super) fn run(
        &self,
        parts: std::ops::Range<usize>,
        control: Control,
    ) -> Result<Vec<u64>, FamilyError> {
        let found: Vec<Vec<u64>> = parts
            .into_par_iter()
            .map(|part| {
                let (prefix, decided) = self.parts[part];
                let mut traversal = Traversal::new(self);
                let mut shift = self.space.bits();
                for i in (0..PART_SYMBOLS).rev() {
                    shift -= 3;
                    let (from, to) = traversal.lists.split_at_mut(1);
                    thin_out(&from[0], &mut to[0], shift, prefix >> (3 * i) & 0b111, self.slack());
                    traversal.lists.swap(0, 1);
                }
                if !control.is_cancelled() {
                    traversal.descend(0, prefix, shift, decided, control);
                }
                traversal.found
            })
            .collect();
        control.check()?;
        Ok(found.concat())
    }

    fn slack(&self) -> u32 {
        self.screen.distance() - 1
    }
}

/// One traversal of the tree.
struct Traversal<'a> {
    sweep: &'a Sweep<'a>,
    /// One list of codes for each level.
    lists: Vec<Vec<u64>>,
    found: Vec<u64>,
}

impl<'a> Traversal<'a> {
    fn new(sweep: &'a Sweep<'a>) -> Self {
        let mut lists = vec![Vec::new(); sweep.space.cycles as usize];
        lists[0] = sweep.list.clone();
        Self { sweep, lists, found: Vec::new() }
    }

    /// Descends below the node that fixes all bits from `shift` up to `prefix`; its list has index `level`.
    fn descend(&mut self, level: usize, prefix: u64, shift: u32, decided: bool, control: Control) {
        if shift == LEAF_BITS {
            return self.leaf(level, prefix);
        }
        if control.is_cancelled() {
            return;
        }
        let shift = shift - 3;
        for &symbol in symbols(decided) {
            let (from, to) = self.lists.split_at_mut(level + 1);
            thin_out(&from[level], &mut to[0], shift, symbol, self.sweep.slack());
            let decided = decided || !is_constant(symbol);
            self.descend(level + 1, prefix << 3 | symbol, shift, decided, control);
        }
    }

    fn leaf(&mut self, level: usize, prefix: u64) {
        let sweep = self.sweep;
        let covered = cover(&self.lists[level], &sweep.balls, sweep.slack());
        for (i, bits) in covered.iter().enumerate() {
            let mut open = !bits;
            while open != 0 {
                let suffix = 64 * i as u64 + u64::from(open.trailing_zeros());
                open &= open - 1;
                let word = prefix << LEAF_BITS | suffix;
                let tag =
                    (0..).zip(&sweep.bit_map).fold(0, |tag, (i, &to)| tag | (word >> i & 1) << to);
                if sweep.screen.admits(tag) {
                    self.found.push(sweep.screen.words().canonical(tag));
                }
            }
        }
    }
}

/// Returns the symbols to try: all, or one of each three rotated ones until a symbol distinguishes rotations.
fn symbols(decided: bool) -> &'static [u64] {
    if decided { &[0, 1, 2, 3, 4, 5, 6, 7] } else { &[0b000, 0b111, 0b001, 0b011] }
}

fn is_constant(symbol: u64) -> bool {
    symbol == 0b000 || symbol == 0b111
}

/// Returns the suffixes within `radius` of `centre`.
fn ball(centre: u32, radius: u32) -> Leaf {
    let mut leaf = [0; 8];
    for x in 0..1u32 << LEAF_BITS {
        if (x ^ centre).count_ones() <= radius {
            leaf[x as usize / 64] |= 1 << (x % 64);
        }
    }
    leaf
}
