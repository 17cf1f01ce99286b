use super::Decoded;
use crate::family::algebra::LinearMap;
use crate::family::{Construction, Family, TagWords, ball};

/// Decoding by the structure of a family that is part of a union of cosets of a linear code.
///
/// The syndrome of a word is that of its errors plus that of its coset. So one lookup per coset, in a table of all
/// error patterns, gives the intended word of the union. A second lookup, by its smallest rotation, shows whether the
/// family contains it. The time does not depend on the number of codes.
///
/// The code is invariant under a rotation of the tag, so rotating errors is a linear map of their syndrome.
/// Of three rotated patterns, the table contains only the one with the smallest syndrome. This
/// makes the table a third as large.
#[derive(Clone, Debug)]
pub(super) struct Syndromes {
    words: TagWords,
    /// The central cell, if no word of the union uses it; else zero.
    ignored: u64,
    syndromes: LinearMap,
    /// Maps the syndrome of a word to that of the rotated word.
    turned: LinearMap,
    /// Syndromes of the cosets.
    cosets: Vec<u32>,
    patterns: PatternTable,
    /// The smallest rotation of each code, without the ignored cell, and its id; in increasing order.
    ids: Vec<(u64, u32)>,
}

/// Largest number of error patterns: larger tables would not be worth their memory of at least 18 bytes per pattern.
/// Three patterns that are rotations of each other count as one.
const MAX_PATTERNS: f64 = 4e6;

impl Syndromes {
    /// Returns the approximate time for a word, in the unit of [`super::Blocks::cost`]; infinite if this method does
    /// not apply.
    pub(super) fn cost(family: &Family) -> f64 {
        /// Cost of a table lookup, in comparisons of adjacent words (measured).
        const LOOK_COST: f64 = 30.0;
        /// Number of words that share the cost of making the table, about one comparison for each
        /// pattern: the words of about a hundred images.
        const WORDS: f64 = 10_000.0;
        match family.construction() {
            Construction::Algebraic(c) if c.exchanged.is_empty() => {
                let patterns = ball(family.dimension().bits(), family.correctable());
                LOOK_COST * (1.0 + c.cosets.len() as f64) + patterns / WORDS
            }
            _ => f64::INFINITY,
        }
    }

    /// Returns `None` if the family records no such structure, or its codes do not belong to it.
    pub(super) fn new(family: &Family) -> Option<Self> {
        let Construction::Algebraic(construction) = family.construction() else { return None };
        let (code, cosets, ignored) = construction.on_the_tag(family.dimension())?;
        let bits = family.dimension().bits();
        let correctable = family.correctable();
        let words = TagWords::new(family.dimension());
        let is_invariant = code.rows().iter().all(|&row| code.contains(words.rotate(row)));
        if ball(bits, correctable) > 3.0 * MAX_PATTERNS || !is_invariant {
            return None;
        }
        let syndromes = code.syndromes(bits)?;
        // Free bits are words with the syndromes 1, 2, 4, …
        let turn_of = |&bit: &u32| syndromes.apply(words.rotate(1 << bit));
        let turned: Vec<u32> = code.free_bits(bits).iter().map(turn_of).collect();
        let turned = LinearMap::of_columns(&turned);
        let cells = (0..bits).map(|bit| 1 << bit).filter(|bit| ignored & bit == 0);
        let cells: Vec<(u64, [u32; 3])> =
            cells.map(|bit| (bit, turns_of(&turned, syndromes.apply(bit)))).collect();
        let patterns = PatternTable::new(&cells, correctable)?;
        let mut ids: Vec<(u64, u32)> =
            family.codes().iter().map(|&code| words.canonical(code & !ignored)).zip(0..).collect();
        ids.sort_unstable();
        let cosets: Vec<u32> = cosets.iter().map(|&word| syndromes.apply(word)).collect();
        let belongs = |&code: &u64| cosets.contains(&syndromes.apply(code & !ignored));
        let all_belong = family.codes().iter().all(belongs);
        all_belong.then_some(Self { words, ignored, syndromes, turned, cosets, patterns, ids })
    }

    /// Returns the code within `max_errors`, at most ⌊(h−1)/2⌋.
    pub(super) fn decode(&self, codes: &[u64], word: u64, max_errors: u32) -> Option<Decoded> {
        let read = word & !self.ignored;
        let syndrome = self.syndromes.apply(read);
        self.cosets.iter().find_map(|coset| {
            let meant = read ^ self.errors(syndrome ^ coset)?;
            let canonical = self.words.canonical(meant);
            let at = self.ids.binary_search_by_key(&canonical, |&(word, _)| word).ok()?;
            let id = self.ids[at].1;
            let turned = self.words.rotations(codes[id as usize]);
            let rotations = turned.iter().position(|turned| turned & !self.ignored == meant)?;
            let errors = (word ^ turned[rotations]).count_ones();
            let rotations = rotations as u8;
            (errors <= max_errors).then_some(Decoded { id, rotations, errors, runner_up: None })
        })
    }
}

impl Syndromes {
    /// Returns the error pattern with a syndrome.
    #[inline]
    fn errors(&self, syndrome: u32) -> Option<u64> {
        let rotations = turns_of(&self.turned, syndrome);
        let least = rotations[0].min(rotations[1]).min(rotations[2]);
        let pattern = self.patterns.get(least)?;
        // Two more rotations undo one, and vice versa.
        Some(match rotations.iter().position(|&syndrome| syndrome == least) {
            Some(1) => self.words.rotate(self.words.rotate(pattern)),
            Some(2) => self.words.rotate(pattern),
            _ => pattern,
        })
    }
}

/// Returns the syndromes of a word after zero, one and two rotations.
#[inline]
fn turns_of(turned: &LinearMap, syndrome: u32) -> [u32; 3] {
    let once = turned.apply(syndrome.into());
    [syndrome, once, turned.apply(once.into())]
}

/// Error patterns by their syndromes, one for every three rotations of each other: a hash table with open addressing.
#[derive(Clone, Debug)]
struct PatternTable {
    slots: Vec<Slot>,
    shift: u32,
}

/// Twelve bytes, so that most lookups touch one cache line.
#[derive(Clone, Copy, Debug)]
struct Slot {
    syndrome: u32,
    pattern: [u32; 2],
}

const EMPTY: Slot = Slot { syndrome: 0, pattern: [u32::MAX; 2] };

impl PatternTable {
    /// Creates a table of all patterns of up to `weight` errors in some cells. `cells` contains the bit of each with
    /// its syndromes in all rotations. Returns `None` if two patterns have the same syndrome.
    fn new(cells: &[(u64, [u32; 3])], weight: u32) -> Option<Self> {
        let count = cells.len() as u32;
        // Only few patterns are invariant under a rotation.
        let count = ball(count, weight) / 3.0 + ball(count / 3, weight / 3);
        let slots = ((1.5 * count) as usize + 2).next_power_of_two();
        let mut table = Self { slots: vec![EMPTY; slots], shift: 32 - slots.ilog2() };
        table.insert_all(cells, weight, 0, [0; 3]).then_some(table)
    }

    fn insert_all(
        &mut self,
        cells: &[(u64, [u32; 3])],
        weight: u32,
        pattern: u64,
        syndromes: [u32; 3],
    ) -> bool {
        self.insert(pattern, syndromes)
            && (weight == 0
                || cells.iter().enumerate().all(|(i, (bit, columns))| {
                    let sums = std::array::from_fn(|turn| syndromes[turn] ^ columns[turn]);
                    self.insert_all(&cells[i + 1..], weight - 1, pattern | bit, sums)
                }))
    }

    /// Inserts a pattern whose syndrome is the smallest of its rotations; returns false if another
    /// pattern has this syndrome.
    fn insert(&mut self, pattern: u64, [syndrome, once, twice]: [u32; 3]) -> bool {
        if once < syndrome || twice < syndrome {
            return true;
        }
        let (at, found) = self.find(syndrome);
        self.slots[at] = Slot { syndrome, pattern: [pattern as u32, (pattern >> 32) as u32] };
        found.is_none()
    }

    fn get(&self, syndrome: u32) -> Option<u64> {
        self.find(syndrome).1
    }

    /// Returns the slot of a syndrome, occupied or free, and its pattern.
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
