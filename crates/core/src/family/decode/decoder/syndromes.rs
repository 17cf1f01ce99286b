use super::Decoded;
use crate::family::algebra::LinearMap;
use crate::family::{Construction, Family, TagWords, ball};

/// Decoding by the structure of a family that is part of a union of cosets of a linear code.
///
/// The syndrome of a word is that of its errors plus that of its coset, so one look into a table
/// of all error patterns per coset gives the word of the union that was meant; whether the family
/// lists it is looked up by its smallest turn. Time does not depend on the number of codes.
///
/// The code is the same when a tag turns, so a turn of errors is a linear map of their syndrome. The table holds one
/// of three turned patterns, that with the smallest syndrome, and is a third as large.
#[derive(Clone, Debug)]
pub(super) struct Syndromes {
    words: TagWords,
    /// The central cell, where no word of the union uses it; else none.
    ignored: u64,
    syndromes: LinearMap,
    /// The syndrome of a turned word, from that of the word.
    turned: LinearMap,
    /// Syndromes of the cosets.
    cosets: Vec<u32>,
    patterns: PatternTable,
    /// The smallest turn of each code, without the ignored cell, and its id; ascending.
    ids: Vec<(u64, u32)>,
}

/// Tables of more error patterns than this would not be worth their memory, 18 bytes each or more; three patterns that turn
/// into each other count as one.
const MAX_PATTERNS: f64 = 4e6;

impl Syndromes {
    /// Time for a word, roughly, in the unit of [`super::Blocks::cost`]; infinite where this way
    /// of decoding is none.
    pub(super) fn cost(family: &Family) -> f64 {
        /// A look into the table costs as much as comparing so many words side by side (measured).
        const LOOK_COST: f64 = 30.0;
        /// Words over which the work is shared that making the table is, about a comparison for each pattern: those of some
        /// hundred pictures.
        const WORDS: f64 = 10_000.0;
        match family.construction() {
            Construction::Algebraic(c) if c.exchanged.is_empty() => {
                let patterns = ball(family.dimension().bits(), family.correctable());
                LOOK_COST * (1.0 + c.cosets.len() as f64) + patterns / WORDS
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
        let words = TagWords::new(family.dimension());
        let is_invariant = code.rows().iter().all(|&row| code.contains(words.turn(row)));
        if ball(bits, correctable) > 3.0 * MAX_PATTERNS || !is_invariant {
            return None;
        }
        let syndromes = code.syndromes(bits)?;
        // Free bits are words with the syndromes 1, 2, 4, …
        let turn_of = |&bit: &u32| syndromes.apply(words.turn(1 << bit));
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

    /// The code within `max_errors`, at most ⌊(h−1)/2⌋.
    pub(super) fn decode(&self, codes: &[u64], word: u64, max_errors: u32) -> Option<Decoded> {
        let read = word & !self.ignored;
        let syndrome = self.syndromes.apply(read);
        self.cosets.iter().find_map(|coset| {
            let meant = read ^ self.errors(syndrome ^ coset)?;
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

impl Syndromes {
    /// The pattern of errors that has a syndrome.
    #[inline]
    fn errors(&self, syndrome: u32) -> Option<u64> {
        let turns = turns_of(&self.turned, syndrome);
        let least = turns[0].min(turns[1]).min(turns[2]);
        let pattern = self.patterns.get(least)?;
        // Turned twice more it is turned back once, and the other way round.
        Some(match turns.iter().position(|&syndrome| syndrome == least) {
            Some(1) => self.words.turn(self.words.turn(pattern)),
            Some(2) => self.words.turn(pattern),
            _ => pattern,
        })
    }
}

/// The syndromes of a word after no turn, one and two.
#[inline]
fn turns_of(turned: &LinearMap, syndrome: u32) -> [u32; 3] {
    let once = turned.apply(syndrome.into());
    [syndrome, once, turned.apply(once.into())]
}

/// Error patterns by their syndromes, one of each three that turn into each other: a hash table with open addressing.
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
    /// All patterns of up to `weight` errors in some cells, of each of which the bit is given with its syndromes in all turns;
    /// `None` when two have the same syndrome.
    fn new(cells: &[(u64, [u32; 3])], weight: u32) -> Option<Self> {
        let count = cells.len() as u32;
        // A turn leaves but a few patterns as they are.
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

    /// Takes a pattern whose syndrome is the smallest of its turns; false where another has it.
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
