//! Detections of many pictures as two tables in Parquet, and back: `corners`, a row for each corner, and
//! `pictures`, a row for each picture (`docs/formats.md`, “Tables”).
//!
//! Everything that a calibration needs of detections is in them. What they leave out is in the JSON of a
//! [detection](super::detection): the tags one by one, and how long each stage took.
//!
//! `column` is their schema, `write` and `read` are its two directions; `pages` checks what a file promises before it is unpacked, and
//! `folder` finds the tables of a folder.
//!
//! ```
//! use deltille_core::detection::Detection;
//! use deltille_files::export::tables::{Picture, Reader, Writer};
//! use deltille_files::limits::Limits;
//!
//! let picture = Picture::of(&Detection::new("desk.png", [640, 480], Vec::new()));
//! let mut writer = Writer::new(Vec::new(), Vec::new(), &[])?;
//! writer.push(&picture)?;
//! let [corners, pictures] = writer.finish()?;
//!
//! let mut reader = Reader::new(Limits::default());
//! reader.add(corners)?;
//! reader.add(pictures)?;
//! assert_eq!(reader.finish()?.pictures, [picture]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod column;
pub mod folder;
mod pages;
mod read;
mod write;

use deltille_core::detection::Detection;

use crate::limits::Exceeded;

pub use read::{Contents, Read, Reader};
pub use write::Writer;

/// File names of the two tables in a folder, without their ending.
pub const CORNERS: &str = "corners";
/// See [`CORNERS`].
pub const PICTURES: &str = "pictures";
/// The ending of both.
pub const EXTENSION: &str = "parquet";

/// The key under which a table's file names its schema, and the schemas with their versions. Tables that other
/// programs wrote have none and are known by their columns.
const SCHEMA: &str = "deltille.schema";
const CORNERS_SCHEMA: &str = "deltille/corners/1";
const PICTURES_SCHEMA: &str = "deltille/pictures/1";

/// What came of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Its name, by which corners and pictures are joined; no two of a table have the same.
    pub image: String,
    /// How many tags were read in it.
    pub tags: u32,
    /// What was found, without tags; or in words why the picture could not be read.
    pub found: Result<Detection, String>,
}

impl Picture {
    /// The picture of a detection.
    pub fn of(found: &Detection) -> Self {
        let mut found = found.clone();
        let tags = found.grids.iter().map(|grid| grid.tags.len()).sum::<usize>();
        found.grids.iter_mut().for_each(|grid| grid.tags.clear());
        found.timing_ms.clear();
        Self { image: found.image.clone(), tags: tags as u32, found: Ok(found) }
    }

    /// A picture that could not be read, and why.
    pub fn unread(image: impl Into<String>, why: impl Into<String>) -> Self {
        Self { image: image.into(), tags: 0, found: Err(why.into()) }
    }
}

/// Why a table cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The file could not be written.
    #[error("{0}")]
    Write(String),
    /// The file is no Parquet, or damaged.
    #[error("not a Parquet file that can be read: {0}")]
    File(String),
    /// The file holds another table.
    #[error(
        "neither a table of corners nor one of pictures: it has no column `{0}`; give what \
         `deltille detect --format parquet` wrote"
    )]
    Other(&'static str),
    /// The table has another version.
    #[error("its schema is `{found}`, this version reads `{reads}`: make the file anew")]
    Schema {
        /// The schema that the file names.
        found: String,
        /// The one that is read.
        reads: &'static str,
    },
    /// The table needs more memory than the limits allow.
    #[error(transparent)]
    Exceeded(#[from] Exceeded),
    /// A column is missing, or holds something else.
    #[error("column `{column}`: {problem}")]
    Column {
        /// The column.
        column: &'static str,
        /// What is wrong with it.
        problem: String,
    },
    /// A value is missing or not in its range.
    #[error("row {row}, column `{column}`: {problem}")]
    Cell {
        /// The row, from 1 on.
        row: u64,
        /// The column.
        column: &'static str,
        /// What is wrong.
        problem: String,
    },
    /// The rows of a picture contradict each other.
    #[error("picture {image}: {problem}")]
    Picture {
        /// The picture.
        image: String,
        /// What is wrong.
        problem: String,
    },
}
