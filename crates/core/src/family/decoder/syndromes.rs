use super::Decoded;
use crate::family::algebra::LinearMap;
use crate::family::{Construction, Family, TagWords, ball};

/// Decoding by the structure of a family that is part of a union of cosets of a linear code.
///
/// The syndrome of a word is that of its errors plus that of its coset, so one look into a table
/// of all error patterns per coset gives the word of the union that was meant; whether the family
/// lists it is looked up by its smallest turn. Time does not depend on the number of codes.
#[derive(Clone, Debug)]
pub(super) struct Syndromes {
    words: TagWords,
    /// The central cell, where no word of the union uses it; else none.
    ignored: u64,
    syndromes: LinearMap,
    /// Syndromes of the cosets.
    cosets: Vec<u32>,
    patterns: PatternTable,
    /// The smallest turn of each code, without the ignored cell, and its id; ascending.
    ids: Vec<(u64, u32)>,
}

/// Tables of more error patterns than this would not be worth their memory, 24 bytes each.
const MAX_PATTERNS: f64 = 4e6;

impl Syndromes {
    /// Time for a word, roughly, in the unit of [`super::Blocks::cost`]; infinite where this way
    /// of decoding is none.
    pub(super) fn cost(family: &Family) -> f64 {
        /// A look into the table costs as much as comparing so many words side by side (measured).
        const LOOK_COST: f64 = 30.0;
        match family.construction() {
            Construction::Algebraic(c) if c.exchanged.is_empty() => {
                LOOK_COST * (1.0 + c.cosets.len() as f64)
            }
            _ => f64::INFINITY,
        }
    }

    /// `None` where the family records no such structure, or its codes are not of it.
    pub(super) fn new(family: &Family) -> Option<Self> {
        let Construction::Algebraic(construction) = family.construction() else { return None };
        let (code, cosets, ignored) = construction.on_the_tag(family.dimension())?;
        let bits = family.dimension().bits();
        let correctable = family.correctable();
        if ball(bits, correctable) > MAX_PATTERNS {
            return None;
        }
        let syndromes = code.syndromes(bits)?;
        let cells: Vec<u32> = (0..bits).filter(|&bit| ignored >> bit & 1 == 0).collect();
        let patterns = PatternTable::new(&cells, &syndromes, correctable)?;
        let words = TagWords::new(family.dimension());
        let mut ids: Vec<(u64, u32)> =
            family.codes().iter().map(|&code| words.canonical(code & !ignored)).zip(0..).collect();
        ids.sort_unstable();
        let cosets: Vec<u32> = cosets.iter().map(|&word| syndromes.apply(word)).collect();
        let belongs = |&code: &u64| cosets.contains(&syndromes.apply(code & !ignored));
        let all_belong = family.codes().iter().all(belongs);
        all_belong.then_some(Self { words, ignored, syndromes, cosets, patterns, ids })
    }

    /// The code within `max_errors`, at most ⌊(h−1)/2⌋.
    pub(super) fn decode(&self, codes: &[u64], word: u64, max_errors: u32) -> Option<Decoded> {
        let read = word & !self.ignored;
        let syndrome = self.syndromes.apply(read);
        self.cosets.iter().find_map(|coset| {
            let meant = read ^ self.patterns.get(syndrome ^ coset)?;
            let canonical = self.words.canonical(meant);
            let at = self.ids.binary_search_by_key(&canonical, |&(word, _)| word).ok()?;
            let id = self.ids[at].1;
            let turned = self.words.turns(codes[id as usize]);
            let turns = turned.iter().position(|turned| turned & !self.ignored == meant)?;
            let errors = (word ^ turned[turns]).count_ones();
            let turns = turns as u8;
            (errors <= max_errors).then_some(Decoded { id, turns, errors, runner_up: None })
        })
    }
}

/// Error patterns by their syndromes: a hash table with open addressing.
#[derive(Clone, Debug)]
struct PatternTable {
    slots: Vec<Slot>,
    shift: u32,
}

/// Twelve bytes, so that most looks touch one line of the cache.
#[derive(Clone, Copy, Debug)]
struct Slot {
    syndrome: u32,
    pattern: [u32; 2],
}

const EMPTY: Slot = Slot { syndrome: 0, pattern: [u32::MAX; 2] };

impl PatternTable {
    /// All patterns of up to `weight` errors in some cells; `None` when two have the same syndrome.
    fn new(cells: &[u32], syndromes: &LinearMap, weight: u32) -> Option<Self> {
        let count = ball(cells.len() as u32, weight) as usize;
        let slots = (2 * count).next_power_of_two().max(2);
        let mut table = Self { slots: vec![EMPTY; slots], shift: 32 - slots.ilog2() };
        table.insert_all(cells, syndromes, weight, 0).then_some(table)
    }

    fn insert_all(
        &mut self,
        cells: &[u32],
        syndromes: &LinearMap,
        weight: u32,
        pattern: u64,
    ) -> bool {
        self.insert(pattern, syndromes.apply(pattern))
            && (weight == 0
                || cells.iter().enumerate().all(|(i, cell)| {
                    self.insert_all(&cells[i + 1..], syndromes, weight - 1, pattern | 1 << cell)
                }))
    }

    fn insert(&mut self, pattern: u64, syndrome: u32) -> bool {
        let (at, found) = self.find(syndrome);
        self.slots[at] = Slot { syndrome, pattern: [pattern as u32, (pattern >> 32) as u32] };
        found.is_none()
    }

    fn get(&self, syndrome: u32) -> Option<u64> {
        self.find(syndrome).1
    }

    /// Where a syndrome is, or would be, and its pattern.
    #[inline]
    fn find(&self, syndrome: u32) -> (usize, Option<u64>) {
        // Fibonacci hashing: the upper bits of the product depend on all bits of the syndrome.
        let mut at = (syndrome.wrapping_mul(0x9E37_79B9) >> self.shift) as usize;
        loop {
            let slot = self.slots[at];
            if slot.pattern == EMPTY.pattern {
                return (at, None);
            }
            if slot.syndrome == syndrome {
                let [low, high] = slot.pattern.map(u64::from);
                return (at, Some(high << 32 | low));
            }
            at = (at + 1) & (self.slots.len() - 1);
        }
    }
}
