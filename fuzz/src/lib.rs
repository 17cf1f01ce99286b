//! Fuzz targets for every file reader; `fuzz/run` runs them all.

pub mod files;

use files::{Dice, READERS, Reader};

/// Defines the fuzz target with the given name.
#[macro_export]
macro_rules! target {
    ($name:literal) => {
        libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
            let _ = $crate::reader($name).read(bytes);
        });

        libfuzzer_sys::fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
            $crate::changed_or($name, data, size, max_size, seed, libfuzzer_sys::fuzzer_mutate)
        });
    };
}

/// Returns the reader with the given name.
pub fn reader(name: &str) -> &'static Reader {
    READERS.iter().find(|reader| reader.name == name).expect("a reader of this name")
}

/// Replaces a file by a mutated one, and returns its size. Occasionally, and if the result would be too large, it uses
/// libFuzzer's own mutator instead.
pub fn changed_or(
    name: &str,
    data: &mut [u8],
    size: usize,
    max_size: usize,
    seed: u32,
    otherwise: fn(&mut [u8], usize, usize) -> usize,
) -> usize {
    let mut dice = Dice::new(u64::from(seed));
    if dice.below(10) > 0 {
        let changed = reader(name).changed(&data[..size], &mut dice);
        if changed.len() <= max_size {
            data[..changed.len()].copy_from_slice(&changed);
            return changed.len();
        }
    }
    otherwise(data, size, max_size)
}
