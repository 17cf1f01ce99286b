//! Linear maps over GF(2) from words of up to 64 bits to words of up to 32 bits, such as syndromes.

/// A linear map over GF(2) from words of up to 64 bits to words of up to 32 bits, evaluated byte by byte with tables.
#[derive(Clone, Debug)]
pub struct LinearMap {
    /// tables[i][x]: image of the word with byte i = x and all else 0.
    tables: Vec<[u32; 256]>,
}

impl LinearMap {
    /// Creates the map from bit i to `columns[i]`, for at most 64 columns; other bits map to zero.
    pub fn of_columns(columns: &[u32]) -> Self {
        let table = |columns: &[u32]| {
            std::array::from_fn(|x| {
                (0..).zip(columns).filter(|&(i, _)| x >> i & 1 == 1).fold(0, |sum, (_, c)| sum ^ c)
            })
        };
        Self { tables: columns.chunks(8).map(table).collect() }
    }

    /// Returns the image of a word: the sum (exclusive or) of the columns of its set bits.
    #[inline]
    pub fn apply(&self, word: u64) -> u32 {
        let bytes = word.to_le_bytes();
        self.tables.iter().zip(bytes).fold(0, |sum, (table, byte)| sum ^ table[usize::from(byte)])
    }
}
