//! Code families: definition, rules, checks, storage and decoding.
//!
//! A *family* of bits b and distance h is a list of b-bit codes. Any two words that a camera may read from the tags
//! differ in at least h cells; the words are the codes and their rotations by 120° and 240°. So up to ⌊(h−1)/2⌋
//! misread cells still leave the tag and its rotation unambiguous.
//!
//! ```
//! use deltille_core::family::{Decoder, Family};
//!
//! let family = Family::shipped("delTag25h7")?;
//! let decoder = Decoder::new(&family);
//! let read = family.code(12).unwrap() ^ 0b1000_0010_0000_0001; // three cells misread
//! let decoded = decoder.decode(read, 3).unwrap();
//! assert_eq!((decoded.id, decoded.rotations, decoded.errors), (12, 0, 3));
//! # Ok::<(), deltille_core::family::FamilyError>(())
//! ```
//!
//! The family [`positions`] is of a different kind: on its boards every tile has a tag of nine cells, which identify a
//! position only together with the neighbouring tags.
//!
//! Families of square tags, the AprilTags of checkerboards, are read, decoded, drawn and certified like the others,
//! with their four rotations by 90°. This project does not search for new ones.
//!
//! The modules, in the order in which a family is made and used:
//!
//! 1. `rules`, `free`: the words that may be codes;
//! 2. [`lexicode`], [`algebra`]: codes by trial and by construction, as a family file records them; `control`:
//!    callbacks to watch and stop a search. The crate `deltille-search` contains the searches;
//! 3. `check`: proofs about a family, and its comparison with bounds and with natural images;
//! 4. `tables`: families as files, shipped families, families of other programs;
//! 5. `decode`: from the cells of a photograph to a tag; [`positions`]: codes that identify a position.
//!
//! `kernels` contains the loops that dominate searches and proofs.
//!
//! Limits: codes have 9, 16, 25, 36, 49 or 64 bits ([`crate::lattice::Dimension`]). Loading a family checks its form
//! and fingerprint. [`certify`] proves the distance between its codes, which takes time quadratic in their number.

pub mod algebra;
mod check;
mod control;
mod decode;
mod error;
mod free;
mod hex;
mod kernels;
mod krawtchouk;
pub mod lexicode;
pub mod positions;
mod rules;
mod tables;

use std::collections::BTreeMap;

#[doc(hidden)]
pub use check::bounds::bounds_of_cells;
pub use check::{
    ACCEPTED_FALSE_POSITIVES, Certificate, Confusion, HiddenCells, NATURAL_FACTOR, NaturalWords,
    Reading, Robust, RuleChoice, TRIANGLES_PER_MEGAPIXEL, ball, best_rule, bounds, certify,
    certify_codes, corrected_within, distance_histogram, false_positive_rates, invariant_bound,
    rule_choices,
};
pub use control::{Control, Progress};
pub use decode::{Decoded, Decoder, TagWords};
pub use error::FamilyError;
pub use free::FreeCells;
pub use rules::{Rules, Screen};
use tables::fingerprint::fingerprint;
pub(crate) use tables::shipped_name;
pub use tables::{
    Beginning, Construction, ExportFormat, ImportError, ImportSpec, PublishedBounds, ShippedFamily,
    check_name, dictionary, dictionary_names, export, import, published_bounds, shipped_families,
    shipped_names, smallest_shipped, square_names,
};
use tables::{aruco, file, shipped};
#[doc(hidden)]
pub use {hex::parse_word, kernels::nearer, tables::dictionary_family};

use crate::lattice::{Dimension, GridKind, TagCells};

/// Schema and version that this crate reads and writes.
pub const SCHEMA: &str = "deltille/family/1";

/// Largest number of codes whose pairs are counted one by one.
pub const PAIRS_COUNTED: usize = 100_000;

/// A family: its codes and their construction.
#[derive(Clone, Debug, PartialEq)]
pub struct Family {
    name: String,
    kind: GridKind,
    dimension: Dimension,
    distance: u32,
    codes: Vec<u64>,
    rules: Rules,
    construction: Construction,
    histogram: BTreeMap<u32, u64>,
    fingerprint: String,
    /// See [`Family::beginnings`].
    beginnings: Vec<Beginning>,
    /// See [`Family::with_squares`].
    squares: Option<Box<Family>>,
}

impl Family {
    /// Creates a family of triangular tags with these `codes`, in the order of their ids.
    ///
    /// Checks the form (name, code width, no code twice in any rotation) but not the distance, which [`certify`]
    /// proves. Counts the distance histogram. A name with bits and distance, for example d25h7 or delTag25h7, must
    /// match the family.
    ///
    /// # Errors
    /// Returns an error if the name is not a valid file name or states other bits or another
    /// distance, or if a code is too
    /// wide or occurs twice.
    pub fn new(
        name: &str,
        dimension: Dimension,
        distance: u32,
        codes: Vec<u64>,
        rules: Rules,
        construction: Construction,
    ) -> Result<Self, FamilyError> {
        Self::of(name, GridKind::Deltille, dimension, distance, codes, rules, construction)
    }

    /// Creates a family of tags that fill a tile of `kind`.
    fn of(
        name: &str,
        kind: GridKind,
        dimension: Dimension,
        distance: u32,
        codes: Vec<u64>,
        rules: Rules,
        construction: Construction,
    ) -> Result<Self, FamilyError> {
        file::check_form(name, kind, dimension, distance, &codes, &rules)?;
        let histogram = if codes.len() <= PAIRS_COUNTED {
            distance_histogram(kind, dimension, &codes)
        } else {
            BTreeMap::new()
        };
        let fingerprint = fingerprint(kind, dimension, distance, rules.free, &codes);
        let name = name.to_owned();
        Ok(Self {
            name,
            kind,
            dimension,
            distance,
            codes,
            rules,
            construction,
            histogram,
            fingerprint,
            beginnings: Vec::new(),
            squares: None,
        })
    }

    /// Returns the family with the family of the square tags added, for a target with faces of both
    /// tilings. A family file contains only one of them.
    pub fn with_squares(self, squares: Family) -> Self {
        Self { squares: Some(Box::new(squares)), ..self }
    }

    /// Combines a family with that of the squares, if both exist.
    pub fn paired(family: Option<Self>, squares: Option<Self>) -> Option<Self> {
        match (family, squares) {
            (Some(family), Some(squares)) => Some(family.with_squares(squares)),
            (family, _) => family,
        }
    }

    /// Returns the family of tags in tiles of a kind: this one, or that of its squares.
    pub fn of_tiling(&self, kind: GridKind) -> Option<&Self> {
        if self.kind == kind { Some(self) } else { self.squares.as_deref() }
    }

    /// Returns a shipped family by name: one of [`shipped_families`], or a dictionary of [`dictionary_names`]. In a browser,
    /// only the position codes are shipped: a page fetches the files of the families that it needs.
    ///
    /// # Errors
    /// Returns an error if no family of that name is shipped; the message lists those that are.
    pub fn shipped(name: &str) -> Result<Self, FamilyError> {
        let found = if name == positions::NAME {
            Some(Ok(Self::places()))
        } else if cfg!(target_family = "wasm") {
            None
        } else {
            let file = shipped::json(name).map(Self::from_json);
            file.or_else(|| aruco::family(name, shipped::json))
        };
        found.unwrap_or_else(|| {
            let shipped = [shipped_names(), square_names(), vec![positions::NAME]].concat();
            Err(FamilyError::Unknown { name: name.to_owned(), shipped })
        })
    }

    /// Creates the family of position codes, see [`positions`].
    fn places() -> Self {
        let cells = positions::cells();
        let dimension = cells.dimension();
        let codes = positions::first_board();
        let fingerprint = fingerprint(cells.kind(), dimension, 1, None, &codes);
        Self {
            name: positions::NAME.to_owned(),
            kind: cells.kind(),
            dimension,
            distance: 1,
            codes,
            rules: Rules::NONE,
            construction: Construction::Positions,
            histogram: BTreeMap::new(),
            fingerprint,
            beginnings: Vec::new(),
            squares: None,
        }
    }

    /// Returns whether the tags identify a position only together with neighbouring ones, so that every tile has a
    /// tag.
    pub fn is_position_family(&self) -> bool {
        self.construction == Construction::Positions
    }

    /// Parses the text of a family file (`docs/formats.md`, “Family”, schema [`SCHEMA`]).
    ///
    /// # Errors
    /// Returns an error if the text is not a family file, a field is invalid, or the codes do not match the stated
    /// fingerprint.
    pub fn from_json(json: &str) -> Result<Self, FamilyError> {
        file::from_json(json)
    }

    /// Writes the text of the family file.
    pub fn to_json(&self) -> String {
        file::to_json(self)
    }

    /// Returns the name, which is a valid file stem.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the tiling whose tiles the tags fill: triangular or square tags.
    pub fn kind(&self) -> GridKind {
        self.kind
    }

    /// Returns the cells of the tags.
    pub fn cells(&self) -> TagCells {
        TagCells::of(self.kind, self.dimension)
    }

    /// Returns the dimension of the tags.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// Returns the bits of the cells that no code uses and that are not read: see [`FreeCells`].
    pub fn free_cells(&self) -> u64 {
        self.rules.free.map_or(0, |free| free.mask(self.dimension))
    }

    /// Returns the number of cells that carry codes: all except the free ones.
    pub fn used_cells(&self) -> u32 {
        self.dimension.bits() - self.free_cells().count_ones()
    }

    /// Returns the claimed minimum distance h between any two words of different tags or rotations.
    pub fn distance(&self) -> u32 {
        self.distance
    }

    /// Returns the number of misread cells that can always be corrected, ⌊(h−1)/2⌋.
    pub fn correctable(&self) -> u32 {
        (self.distance - 1) / 2
    }

    /// Returns the codes; an id is a position in this list. For position codes these are the codes of the first board.
    pub fn codes(&self) -> &[u64] {
        &self.codes
    }

    /// Returns the code of a tag.
    pub fn code(&self, id: u32) -> Option<u64> {
        if self.is_position_family() && (id as usize) < self.len() {
            return Some(positions::word(id));
        }
        self.codes.get(id as usize).copied()
    }

    /// Returns the number of codes.
    pub fn len(&self) -> usize {
        let boards = if self.is_position_family() { positions::BOARDS as usize } else { 1 };
        boards * self.codes.len()
    }

    /// Returns whether there are no codes, which is never true for a checked family.
    pub fn is_empty(&self) -> bool {
        self.codes.is_empty()
    }

    /// Returns the rules that every single code satisfies.
    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// Returns the construction of the codes, in enough detail to repeat it.
    pub fn construction(&self) -> &Construction {
        &self.construction
    }

    /// Returns the number of unordered pairs, among the codes and their rotations, at each distance. It is empty for
    /// families of more than 100,000 codes, and for position codes.
    pub fn histogram(&self) -> &BTreeMap<u32, u64> {
        &self.histogram
    }

    /// Returns the probability that a word of fair coin tosses is mistaken for a tag, for 0, 1, …,
    /// [`Self::correctable`] corrected bits. For position codes, every word is the word of a
    /// position. Image content is
    /// rarely that complex: see [`Self::natural_false_positive_rates`].
    pub fn false_positive_rates(&self) -> Vec<f64> {
        if self.is_position_family() {
            return vec![1.0];
        }
        false_positive_rates(self.kind, self.used_cells(), self.distance, self.codes.len())
    }

    /// Returns 16 hexadecimal digits that identify bits, distance and codes: the first 64 bits of the SHA-256 of the
    /// text
    ///
    /// ```text
    /// deltille/family
    /// bits 25
    /// distance 7
    /// 0x08f50a7
    /// …
    /// ```
    ///
    /// with one code per line in id order, in lower case with ⌈b/4⌉ digits, and a line feed after every line. For
    /// square tags the second line is `kind checker`. For tags with free cells a line `free centre` follows the
    /// distance.
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }
}
