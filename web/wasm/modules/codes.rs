//! Tag codes: figures of families, decoding and error rates.

use deltille_core::family::{
    ACCEPTED_FALSE_POSITIVES, Decoder, Family, corrected_within, dictionary_family,
    dictionary_names, shipped_families,
};
use wasm_bindgen::prelude::*;

use deltille_web::errors::Raise;

/// Returns the bundled families as JSON: names, tilings, bits, distances, numbers of codes.
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

/// Returns the names of OpenCV's dictionaries.
#[wasm_bindgen]
pub fn dictionaries() -> Vec<String> {
    dictionary_names().map(str::to_owned).collect()
}

/// Returns the family file of a dictionary from its table, or from the family file of its AprilTags.
///
/// # Errors
/// Throws if there is no dictionary of that name, or if the table is not valid.
#[wasm_bindgen]
pub fn dictionary_file(name: &str, table: &str) -> Result<String, JsError> {
    let family = dictionary_family(name, table)
        .ok_or_else(|| JsError::new(&format!("unknown dictionary {name}")))?;
    Ok(family.raise()?.to_json())
}

/// A family with its decoder.
#[wasm_bindgen]
pub struct Codes {
    family: Family,
    decoder: Decoder,
}

#[wasm_bindgen]
impl Codes {
    /// Reads a family file.
    ///
    /// # Errors
    /// Throws if `file` is not a valid family file.
    #[wasm_bindgen(constructor)]
    pub fn new(file: &str) -> Result<Self, JsError> {
        let family = Family::from_json(file).raise()?;
        let decoder = Decoder::new(&family);
        Ok(Self { family, decoder })
    }

    /// Returns figures of the family as JSON: bits, codes, minimum distance, histogram of distances between codes, upper bounds
    /// on the number of codes, rotation steps per full turn, and for each cell the cell whose content it receives in one step.
    pub fn figures(&self) -> String {
        let family = &self.family;
        let bounds = family.bounds();
        serde_json::json!({
            "name": family.name(), "bits": family.dimension().bits(), "codes": family.len(),
            "distance": family.distance(), "correctable": family.correctable(),
            "kind": family.kind(), "histogram": family.histogram(),
            "linear_programming": bounds.linear_programming, "sphere_packing": bounds.sphere_packing,
            "turns": family.kind().rotations(), "rotation": family.cells().rotation(),
        })
        .to_string()
    }

    /// Returns the cells of a tag as JSON: the corners of each on a tile of edge 1, with a border of `border` cell widths.
    pub fn cells(&self, border: f64) -> String {
        let cells = self.family.cells();
        let bits = self.family.dimension().bits();
        let all: Vec<Vec<[f64; 2]>> = (0..bits)
            .map(|bit| cells.corners(bit, border).iter().map(|corner| corner.to_array()).collect())
            .collect();
        serde_json::to_string(&all).unwrap_or_default()
    }

    /// Returns the codes of all tags.
    pub fn codes(&self) -> Vec<u64> {
        self.family.codes().to_vec()
    }

    /// Returns a word after a counter-clockwise rotation of its tag by 120° or 90°.
    pub fn turned(&self, word: u64) -> u64 {
        self.family.cells().rotate(word)
    }

    /// Returns the fractions of tags read and misread, alternating, for each probability of a wrong cell in `rates`.
    pub fn reading(&self, rates: &[f64]) -> Vec<f64> {
        let shares = rates.iter().filter_map(|&rate| self.family.reading(rate));
        shares.flat_map(|shares| [shares.read, shares.misread]).collect()
    }

    /// Returns false-positive rates as JSON: the probability that a bordered triangle or square without a tag is decoded, for
    /// each number of corrected cells. `coins` assumes random cells, `natural` cells of natural images if their rate is known.
    /// `accepted` is the rate accepted for single tags, `recommended` the number of cells to correct under it. Takes a second
    /// or two for large families.
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

    /// Returns the id of the nearest tag, its rotation steps and the number of wrong cells; nothing if no code is within
    /// `max_errors`.
    pub fn decode(&self, word: u64, max_errors: u32) -> Option<Vec<u32>> {
        let found = self.decoder.decode(word, max_errors)?;
        Some(vec![found.id, found.rotations.into(), found.errors])
    }
}
