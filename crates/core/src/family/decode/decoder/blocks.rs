use super::Decoded;
use crate::family::kernels::first_nearer;
use crate::family::{Family, TagWords, ball};

/// Tables of a family's words in all rotations, by blocks of their bits.
///
/// If a word is within e errors of a code, at least one block contains at most ⌊e / blocks⌋ errors.
/// So for each block, only
/// codes whose block is that close to the word's are compared; they are adjacent in memory. For these, 32 bits
/// outside the block are compared first, many at a time.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    bits: u32,
    blocks: Vec<Block>,
    /// For each number of errors in a block, its patterns: all words of that weight.
    patterns: Vec<Vec<u32>>,
    /// The words, three rotations of each code, in the order of the ids.
    words: Vec<u64>,
}

#[derive(Clone, Debug)]
struct Block {
    shift: u32,
    width: u32,
    /// Bucket of block value x: entries[starts[x]..starts[x + 1]].
    starts: Vec<u32>,
    /// Bits of each word outside the block, up to 32.
    tails: Vec<u32>,
    /// Value 3·id + turns for each word.
    readings: Vec<u32>,
}

/// Largest block width: tables of wider blocks exceed the processor's caches.
const MAX_BLOCK_BITS: u32 = 18;

impl Blocks {
    pub(super) fn new(family: &Family) -> Self {
        let bits = family.dimension().bits();
        let correctable = family.correctable();
        let (count, _) = block_count(family);
        let rotations = TagWords::new(family.dimension());
        let words: Vec<u64> =
            family.codes().iter().flat_map(|&code| rotations.rotations(code)).collect();
        let blocks = (0..count)
            .map(|i| (i * bits / count, (i + 1) * bits / count))
            .map(|(shift, end)| Block::new(bits, shift, (end - shift).min(MAX_BLOCK_BITS), &words))
            .collect::<Vec<_>>();
        let width = blocks.iter().map(|b| b.width).max().unwrap_or(0);
        let patterns = (0..=correctable / count).map(|weight| patterns(width, weight)).collect();
        Self { bits, blocks, patterns, words }
    }

    /// Returns the approximate time for a word that is not a code, in comparisons.
    pub(super) fn cost(family: &Family) -> f64 {
        block_count(family).1
    }

    /// Returns the code within `max_errors`, at most ⌊(h−1)/2⌋; the first one found is the only one.
    pub(super) fn decode(&self, word: u64, max_errors: u32) -> Option<Decoded> {
        let radius = max_errors / self.blocks.len() as u32;
        for weight in 0..=radius {
            for block in &self.blocks {
                let key = block.key(word);
                let tail = block.tail(self.bits, word);
                for pattern in &self.patterns[weight as usize] {
                    if pattern >> block.width != 0 {
                        break;
                    }
                    let found =
                        block.find((key as u32 ^ pattern) as usize, tail, max_errors, |reading| {
                            let errors = (word ^ self.words[reading as usize]).count_ones();
                            (errors <= max_errors).then_some(Decoded {
                                id: reading / 3,
                                rotations: (reading % 3) as u8,
                                errors,
                                runner_up: None,
                            })
                        });
                    if found.is_some() {
                        return found;
                    }
                }
            }
        }
        None
    }
}

impl Block {
    fn new(bits: u32, shift: u32, width: u32, all: &[u64]) -> Self {
        let mut block = Self {
            shift,
            width,
            starts: vec![0; (1 << width) + 1],
            tails: vec![0; all.len()],
            readings: vec![0; all.len()],
        };
        for &word in all {
            let key = block.key(word);
            block.starts[key + 1] += 1;
        }
        for i in 0..1 << width {
            block.starts[i + 1] += block.starts[i];
        }
        let mut next = block.starts.clone();
        for (reading, &word) in (0..).zip(all) {
            let slot = &mut next[block.key(word)];
            block.tails[*slot as usize] = block.tail(bits, word);
            block.readings[*slot as usize] = reading;
            *slot += 1;
        }
        block
    }

    #[inline]
    fn key(&self, word: u64) -> usize {
        (word >> self.shift) as usize & ((1 << self.width) - 1)
    }

    /// Returns the bits above the block, then those below it, starting with the lowest; drops the
    /// highest if there are more than 32.
    #[inline]
    fn tail(&self, bits: u32, word: u64) -> u32 {
        let end = self.shift + self.width;
        // The last block of 64 bits has no bits above it, and shifting by 64 would overflow.
        let above = word >> (end - 1) >> 1;
        let below = word & ((1 << self.shift) - 1);
        (above | below << (bits - end)) as u32
    }

    /// Returns the first result of `confirm` for the words of a bucket whose tails are close enough.
    #[inline]
    fn find<T>(
        &self,
        key: usize,
        tail: u32,
        max_errors: u32,
        confirm: impl Fn(u32) -> Option<T>,
    ) -> Option<T> {
        let (mut from, to) = (self.starts[key] as usize, self.starts[key + 1] as usize);
        while let Some(at) = first_nearer(tail, &self.tails[from..to], max_errors + 1) {
            let found = confirm(self.readings[from + at]);
            if found.is_some() {
                return found;
            }
            from += at + 1;
        }
        None
    }
}

/// Returns the number of blocks with the least work for a word that is not a code, and that work.
fn block_count(family: &Family) -> (u32, f64) {
    /// Cost of accessing a bucket, in comparisons of adjacent words.
    const BUCKET_COST: f64 = 100.0;
    let (bits, correctable) = (family.dimension().bits(), family.correctable());
    let words = 3.0 * family.len() as f64;
    let cost = |count: u32| {
        let width = (bits / count).min(MAX_BLOCK_BITS);
        let in_bucket = words / f64::from(1u32 << width);
        let probes = f64::from(count) * ball(width, correctable / count);
        (count, probes * (BUCKET_COST + in_bucket))
    };
    (1..=bits / 3).map(cost).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((1, f64::MAX))
}

/// Returns all words of `width` bits with `weight` ones, in increasing order.
fn patterns(width: u32, weight: u32) -> Vec<u32> {
    (0..1u32 << width).filter(|x| x.count_ones() == weight).collect()
}
