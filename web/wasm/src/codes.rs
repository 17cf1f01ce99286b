//! Codes of tags, looked at and damaged.

use deltille_core::family::{
    ACCEPTED_FALSE_POSITIVES, Decoder, Family, corrected_within, shipped_families,
};
use wasm_bindgen::prelude::*;

use crate::errors::Raise;

/// What is known of the families that are shipped, as JSON: names, tilings, bits, distances, codes.
#[wasm_bindgen]
pub fn families() -> String {
    let known = shipped_families().map(|family| {
        serde_json::json!({
            "name": family.name, "kind": family.kind, "bits": family.bits,
            "distance": family.distance, "codes": family.codes,
        })
    });
    serde_json::Value::from_iter(known).to_string()
}

/// A family, with what decodes words that were read.
#[wasm_bindgen]
pub struct Codes {
    family: Family,
    decoder: Decoder,
}

#[wasm_bindgen]
impl Codes {
    /// The family of a file.
    ///
    /// # Errors
    /// In words, where it is no family file.
    #[wasm_bindgen(constructor)]
    pub fn new(file: &str) -> Result<Self, JsError> {
        let family = Family::from_json(file).raise()?;
        let decoder = Decoder::new(&family);
        Ok(Self { family, decoder })
    }

    /// What is known of it, as JSON: bits, codes, distance, how many pairs of codes have each distance, how many codes no family
    /// exceeds, how often a tag turns into itself, and the cell whose content each cell then receives.
    pub fn figures(&self) -> String {
        let family = &self.family;
        let bounds = family.bounds();
        serde_json::json!({
            "name": family.name(), "bits": family.dimension().bits(), "codes": family.len(),
            "distance": family.distance(), "correctable": family.correctable(),
            "kind": family.kind(), "histogram": family.histogram(),
            "linear_programming": bounds.linear_programming, "sphere_packing": bounds.sphere_packing,
            "turns": family.kind().turns(), "rotation": family.cells().rotation(),
        })
        .to_string()
    }

    /// The cells of a tag as JSON: of each its corners on a tile of edge 1 with a border of so many widths of a cell.
    pub fn cells(&self, border: f64) -> String {
        let cells = self.family.cells();
        let bits = self.family.dimension().bits();
        let all: Vec<Vec<[f64; 2]>> = (0..bits)
            .map(|bit| cells.corners(bit, border).iter().map(|corner| corner.to_array()).collect())
            .collect();
        serde_json::to_string(&all).unwrap_or_default()
    }

    /// The codes of all tags.
    pub fn codes(&self) -> Vec<u64> {
        self.family.codes().to_vec()
    }

    /// A word after the tag was turned counter-clockwise, by 120° or 90°.
    pub fn turned(&self, word: u64) -> u64 {
        self.family.cells().rotate(word)
    }

    /// The shares of tags that are read, and misread, where cells are wrong with each of these probabilities: one after the
    /// other.
    pub fn reading(&self, rates: &[f64]) -> Vec<f64> {
        let shares = rates.iter().filter_map(|&rate| self.family.reading(rate));
        shares.flat_map(|shares| [shares.read, shares.misread]).collect()
    }

    /// How often a triangle or square with a border that is no tag is taken for one, as JSON, for each number of corrected
    /// cells: where its cells are fair coins, and in natural pictures where that is known; the rate that is accepted of single
    /// tags, and how many cells may be corrected by it. Takes a second or two for large families.
    pub fn false_positives(&self) -> String {
        let natural = self.family.natural_false_positive_rates();
        let recommended =
            natural.as_deref().map(|all| corrected_within(all, ACCEPTED_FALSE_POSITIVES));
        serde_json::json!({
            "coins": self.family.false_positive_rates(), "natural": natural,
            "accepted": ACCEPTED_FALSE_POSITIVES, "recommended": recommended.flatten(),
        })
        .to_string()
    }

    /// The tag that a word is nearest to, with its turns and the number of cells that were wrong; nothing where none is
    /// near enough.
    pub fn decode(&self, word: u64, max_errors: u32) -> Option<Vec<u32>> {
        let found = self.decoder.decode(word, max_errors)?;
        Some(vec![found.id, found.turns.into(), found.errors])
    }
}
