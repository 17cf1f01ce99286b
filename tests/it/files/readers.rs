//! Every reader gets valid files, files that once caused a fault, and mutated files that keep their
//! format. No reader may panic, end without a result, or accept an invalid file. The fuzz targets
//! in `fuzz/` do the same for hours.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use crate::changed::{Dice, READERS, Reader};

/// Number of mutated files for each reader.
const CHANGED: u64 = 150;

/// Reads a file and returns the name of the reader if it panicked.
fn harm(reader: &Reader, what: &str, bytes: &[u8]) -> Option<String> {
    let read = catch_unwind(AssertUnwindSafe(|| reader.read(bytes)));
    read.is_err().then(|| format!("{}: {what}", reader.name))
}

#[test]
fn valid_files_are_read() {
    let refused = READERS.iter().filter(|reader| !reader.read(&reader.good()));
    let refused: Vec<&str> = refused.map(|reader| reader.name).collect();
    assert!(refused.is_empty(), "{refused:?}");
}

#[test]
fn corpus_files_violate_no_guarantee_of_a_reader() {
    let corpus = Path::new(crate::common::REPOSITORY).join("fuzz/corpus");
    let mut harms = Vec::new();
    for folder in fs::read_dir(corpus).unwrap().map(|entry| entry.unwrap().path()) {
        let reader = READERS.iter().find(|reader| folder.ends_with(reader.name)).unwrap();
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            harms.extend(harm(reader, &path.display().to_string(), &fs::read(&path).unwrap()));
        }
    }
    assert!(harms.is_empty(), "{harms:?}");
}

#[test]
fn mutated_files_violate_no_guarantee_of_a_reader() {
    let mut harms = Vec::new();
    for reader in READERS {
        let mut bytes = reader.good();
        for seed in 0..CHANGED {
            bytes = reader.changed(&bytes, &mut Dice::new(seed));
            harms.extend(harm(reader, &format!("seed {seed}"), &bytes));
        }
    }
    assert!(harms.is_empty(), "{harms:?}");
}
