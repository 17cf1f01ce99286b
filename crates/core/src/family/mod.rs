//! Code families: what a family is, which words its rules admit, how it is checked, stored and decoded.
//!
//! A *family* of bits b and distance h is a list of b-bit codes such that any two of the words a
//! camera may read off the tags, the codes and their turns by 120° and 240°, differ in at least h
//! cells. So up to ⌊(h−1)/2⌋ cells may be misread and the tag, and how it is turned, is still known.
//!
//! ```
//! use deltille_core::family::{Decoder, Family};
//!
//! let family = Family::shipped("delTag25h7")?;
//! let decoder = Decoder::new(&family);
//! let read = family.code(12).unwrap() ^ 0b1000_0010_0000_0001; // three cells misread
//! let decoded = decoder.decode(read, 3).unwrap();
//! assert_eq!((decoded.id, decoded.turns, decoded.errors), (12, 0, 3));
//! # Ok::<(), deltille_core::family::FamilyError>(())
//! ```
//!
//! One family is of another kind, [`places`]: on its boards every tile has a tag of nine cells, which tell a place only
//! together with those beside them.
//!
//! Families of square tags, the AprilTags of checkerboards, are read, decoded, drawn and certified like the
//! others, with their four turns by 90°; they are not searched here.
//!
//! The chapters, in the order in which a family comes to be and is used:
//!
//! 1. `rules`, `free`: which words may be codes;
//! 2. [`lexicode`], [`algebra`]: codes by trial and by construction, as a family file records them; `control`: how a search
//!    is watched and stopped. The searches are the crate `deltille-search`;
//! 3. `check`: what is proved of a family, and how it compares with bounds and with pictures of the world;
//! 4. `tables`: families as files, those that ship, those of other programs;
//! 5. `decode`: from the cells of a photograph to a tag; [`places`]: the codes that tell a place.
//!
//! `kernels` has the loops in which searches and proofs spend their time.
//!
//! Limits: codes have 9, 16, 25, 36, 49 or 64 bits ([`crate::lattice::Dimension`]). Loading a family
//! checks its form and fingerprint; the distance between its codes is proved by [`certify`], which
//! costs the square of their number.

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
pub mod places;
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
pub use {hex::parse_word, kernels::nearer};

use crate::lattice::{Dimension, GridKind, TagCells};

/// Schema and version that this crate writes and reads.
pub const SCHEMA: &str = "deltille/family/1";

/// The pairs of larger families are too many to count one by one.
pub const PAIRS_COUNTED: usize = 100_000;

/// A family: its codes, and how they came about.
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
    /// A family of triangular tags with these `codes`, in the order of their ids.
    ///
    /// Checks the form (name, code width, no code twice in any turn) but not the distance, which
    /// [`certify`] proves. The distance histogram is counted here. A name that speaks of bits and a
    /// distance, such as d25h7 or delTag25h7, must speak of these.
    ///
    /// # Errors
    /// Where the name is no file name or speaks of other bits or another distance, a code is too wide, or stands there
    /// twice.
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

    /// The same of tags that fill a tile of `kind`.
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

    /// The same family with that of the squares of a target whose faces are of both tilings. Files of families have one
    /// of them.
    pub fn with_squares(self, squares: Family) -> Self {
        Self { squares: Some(Box::new(squares)), ..self }
    }

    /// A family with that of the squares, where there are both.
    pub fn paired(family: Option<Self>, squares: Option<Self>) -> Option<Self> {
        match (family, squares) {
            (Some(family), Some(squares)) => Some(family.with_squares(squares)),
            (family, _) => family,
        }
    }

    /// The family of tags in tiles of a kind: this one, or that of its squares.
    pub fn of_tiling(&self, kind: GridKind) -> Option<&Self> {
        if self.kind == kind { Some(self) } else { self.squares.as_deref() }
    }

    /// A family that comes with the crate, by its name: those of [`shipped_families`], and the dictionaries of
    /// [`dictionary_names`].
    ///
    /// # Errors
    /// Where no family of that name is shipped; the message names those that are.
    pub fn shipped(name: &str) -> Result<Self, FamilyError> {
        match shipped::json(name) {
            Some(json) => Self::from_json(json),
            None => aruco::family(name).unwrap_or_else(|| {
                let shipped = [shipped_names(), square_names(), vec![places::NAME]].concat();
                Err(FamilyError::Unknown { name: name.to_owned(), shipped })
            }),
        }
    }

    /// The family of place codes, see [`places`].
    fn places() -> Self {
        let cells = places::cells();
        let dimension = cells.dimension();
        let codes = places::first_board();
        let fingerprint = fingerprint(cells.kind(), dimension, 1, None, &codes);
        Self {
            name: places::NAME.to_owned(),
            kind: cells.kind(),
            dimension,
            distance: 1,
            codes,
            rules: Rules::NONE,
            construction: Construction::Places,
            histogram: BTreeMap::new(),
            fingerprint,
            beginnings: Vec::new(),
            squares: None,
        }
    }

    /// Whether its tags tell a place only together with those beside them, and every tile has one.
    pub fn is_of_places(&self) -> bool {
        self.construction == Construction::Places
    }

    /// Reads the text of a family file (`docs/formats.md`, “Family”, schema [`SCHEMA`]).
    ///
    /// # Errors
    /// Where it is no family file, a field is wrong, or the codes do not have the stated fingerprint.
    pub fn from_json(json: &str) -> Result<Self, FamilyError> {
        file::from_json(json)
    }

    /// The text of the family file.
    pub fn to_json(&self) -> String {
        file::to_json(self)
    }

    /// The name, usable as the stem of a file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The tiling whose tiles its tags fill: triangular or square tags.
    pub fn kind(&self) -> GridKind {
        self.kind
    }

    /// The cells of its tags.
    pub fn cells(&self) -> TagCells {
        TagCells::of(self.kind, self.dimension)
    }

    /// The dimension of its tags.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// The bits of cells that no code uses, and that are not read: see [`FreeCells`].
    pub fn free_cells(&self) -> u64 {
        self.rules.free.map_or(0, |free| free.mask(self.dimension))
    }

    /// Number of the cells that carry its codes: all but the free ones.
    pub fn used_cells(&self) -> u32 {
        self.dimension.bits() - self.free_cells().count_ones()
    }

    /// The claimed minimum distance h between any two words read off different tags or turns.
    pub fn distance(&self) -> u32 {
        self.distance
    }

    /// The number of misread cells that never hide which tag was read, ⌊(h−1)/2⌋.
    pub fn correctable(&self) -> u32 {
        (self.distance - 1) / 2
    }

    /// The codes; an id is a position in this list. Of place codes these are those of the first board.
    pub fn codes(&self) -> &[u64] {
        &self.codes
    }

    /// The code of a tag.
    pub fn code(&self, id: u32) -> Option<u64> {
        if self.is_of_places() && (id as usize) < self.len() {
            return Some(places::word(id));
        }
        self.codes.get(id as usize).copied()
    }

    /// Number of codes.
    pub fn len(&self) -> usize {
        let boards = if self.is_of_places() { places::BOARDS as usize } else { 1 };
        boards * self.codes.len()
    }

    /// Whether there is no code; never so for a family that was checked.
    pub fn is_empty(&self) -> bool {
        self.codes.is_empty()
    }

    /// What every single code satisfies.
    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// How the codes were found, in enough detail to find them again.
    pub fn construction(&self) -> &Construction {
        &self.construction
    }

    /// Number of unordered pairs, among the codes and their turns, at each distance; empty for
    /// families of more than 100,000 codes, and for place codes.
    pub fn histogram(&self) -> &BTreeMap<u32, u64> {
        &self.histogram
    }

    /// Probability that a word of fair coin tosses is taken for a tag, for 0, 1, …,
    /// [`Self::correctable`] corrected bits; of place codes every word is one of a place. What pictures show is seldom so
    /// complex: [`Self::natural_false_positive_rates`].
    pub fn false_positive_rates(&self) -> Vec<f64> {
        if self.is_of_places() {
            return vec![1.0];
        }
        false_positive_rates(self.kind, self.used_cells(), self.distance, self.codes.len())
    }

    /// 16 hexadecimal digits that stand for bits, distance and codes: the first half of the first
    /// half of the SHA-256 of the text
    ///
    /// ```text
    /// deltille/family
    /// bits 25
    /// distance 7
    /// 0x08f50a7
    /// …
    /// ```
    ///
    /// one code a line in id order, lower case, ⌈b/4⌉ digits, every line ended by a line feed. That
    /// of square tags has a second line `kind checker`, that of tags with free cells a line `free centre`
    /// after the distance.
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }
}
