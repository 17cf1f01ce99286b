use super::kernels::first_nearer;
use super::{Family, TagWords};

/// A word recognised as a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decoded {
    /// Id of the tag.
    pub id: u32,
    /// Number of counter-clockwise turns by 120° of the tag that give the word read, 0 to 2.
    pub turns: u8,
    /// Cells that differ.
    pub errors: u32,
    /// Errors of the next best reading (another tag, or another turn), if that lies within the
    /// errors allowed too. Never so while these are at most ⌊(h−1)/2⌋; then any other reading has
    /// at least h − `errors`.
    pub runner_up: Option<u32>,
}

/// Finds the nearest code, in any turn, to a word that was read.
///
/// The bits are cut into blocks. A word within e errors of a code agrees with it in some block up
/// to ⌊e / blocks⌋ errors, so for each block only the codes are compared whose block is that close
/// to the word's; they lie side by side in a table sorted by block.
#[derive(Clone, Debug)]
pub struct Decoder {
    /// Largest number of errors at which every word has one nearest code at most.
    correctable: u32,
    blocks: Vec<Block>,
    /// For each number of errors in a block, its patterns: all words of that weight.
    patterns: Vec<Vec<u32>>,
}

#[derive(Clone, Debug)]
struct Block {
    shift: u32,
    width: u32,
    /// Bucket of block value x: entries[starts[x]..starts[x + 1]].
    starts: Vec<u32>,
    words: Vec<u64>,
    /// 3·id + turns of each word.
    readings: Vec<u32>,
}

/// Blocks wider than this make tables that fall out of the processor's caches.
const MAX_BLOCK_BITS: u32 = 18;

impl Decoder {
    /// A decoder for `family`. Takes memory in proportion to blocks × codes.
    pub fn new(family: &Family) -> Self {
        let bits = family.dimension().bits();
        let correctable = family.correctable();
        let count = block_count(bits, correctable, 3 * family.len());
        let words = TagWords::new(family.dimension());
        let readings: Vec<u64> =
            family.codes().iter().flat_map(|&code| words.turns(code)).collect();
        let blocks = (0..count)
            .map(|i| (i * bits / count, (i + 1) * bits / count))
            .map(|(shift, end)| Block::new(shift, (end - shift).min(MAX_BLOCK_BITS), &readings))
            .collect::<Vec<_>>();
        let width = blocks.iter().map(|b| b.width).max().unwrap_or(0);
        let patterns = (0..=correctable / count).map(|weight| patterns(width, weight)).collect();
        Self { correctable, blocks, patterns }
    }

    /// The nearest code within `max_errors` cells of `word`, or none.
    ///
    /// Up to ⌊(h−1)/2⌋ errors the answer is unique. Beyond, every code is compared, ties go to the
    /// lower id, then the fewer turns, and show in `runner_up`.
    pub fn decode(&self, word: u64, max_errors: u32) -> Option<Decoded> {
        if max_errors > self.correctable {
            return self.decode_beyond(word, max_errors);
        }
        let radius = max_errors / self.blocks.len() as u32;
        for weight in 0..=radius {
            for block in &self.blocks {
                let key = (word >> block.shift) as u32 & ((1 << block.width) - 1);
                let patterns = &self.patterns[weight as usize];
                for pattern in patterns {
                    if *pattern >> block.width != 0 {
                        break;
                    }
                    if let Some(decoded) = block.find(key ^ pattern, word, max_errors) {
                        return Some(decoded);
                    }
                }
            }
        }
        None
    }

    fn decode_beyond(&self, word: u64, max_errors: u32) -> Option<Decoded> {
        let block = &self.blocks[0];
        let (mut best, mut second) = ((u32::MAX, u32::MAX), u32::MAX);
        for (&other, &reading) in block.words.iter().zip(&block.readings) {
            let errors = (word ^ other).count_ones();
            if (errors, reading) < best {
                second = best.0;
                best = (errors, reading);
            } else {
                second = second.min(errors);
            }
        }
        let (errors, reading) = best;
        (errors <= max_errors).then(|| Decoded {
            id: reading / 3,
            turns: (reading % 3) as u8,
            errors,
            runner_up: (second <= max_errors).then_some(second),
        })
    }
}

impl Block {
    fn new(shift: u32, width: u32, all: &[u64]) -> Self {
        let key = |word: u64| (word >> shift) as usize & ((1 << width) - 1);
        let mut starts = vec![0u32; (1 << width) + 1];
        for &word in all {
            starts[key(word) + 1] += 1;
        }
        for i in 0..1 << width {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let (mut words, mut readings) = (vec![0; all.len()], vec![0; all.len()]);
        for (reading, &word) in (0..).zip(all) {
            let slot = &mut next[key(word)];
            words[*slot as usize] = word;
            readings[*slot as usize] = reading;
            *slot += 1;
        }
        Self { shift, width, starts, words, readings }
    }

    #[inline]
    fn find(&self, key: u32, word: u64, max_errors: u32) -> Option<Decoded> {
        let (from, to) = (self.starts[key as usize], self.starts[key as usize + 1]);
        let bucket = from as usize..to as usize;
        let found = first_nearer(word, &self.words[bucket.clone()], max_errors + 1)?;
        let reading = self.readings[bucket.start + found];
        let errors = (word ^ self.words[bucket.start + found]).count_ones();
        Some(Decoded { id: reading / 3, turns: (reading % 3) as u8, errors, runner_up: None })
    }
}

/// Number of blocks with the least work for a word that is no code.
fn block_count(bits: u32, correctable: u32, words: usize) -> u32 {
    /// A bucket costs about as much to reach as this many words to compare, side by side.
    const BUCKET_COST: f64 = 50.0;
    let cost = |count: &u32| {
        let width = (bits / count).min(MAX_BLOCK_BITS);
        let in_bucket = words as f64 / f64::from(1u32 << width);
        let probes = f64::from(*count) * super::statistics::ball(width, correctable / count);
        probes * (BUCKET_COST + in_bucket)
    };
    (1..=bits / 3).min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(1)
}

/// All words of `width` bits with `weight` ones, ascending.
fn patterns(width: u32, weight: u32) -> Vec<u32> {
    (0..1u32 << width).filter(|x| x.count_ones() == weight).collect()
}
