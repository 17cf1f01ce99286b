//! Detections of many images as two Parquet tables, and back: `corners`, with a row for each corner, and
//! `images`, with a row for each image (`docs/formats.md`, “Tables”).
//!
//! They contain all that a calibration needs. Individual tags and the duration of each stage are only in the JSON of a
//! [detection](super::detection).
//!
//! `column` is the schema, and `write` and `read` use it; `row` is a row that is read. `pages` checks the stated sizes of a file before it is unpacked, and
//! `folder` finds the tables of a folder.
//!
//! ```
//! use deltille_core::detection::Detection;
//! use deltille_files::export::tables::{ImageRecord, Reader, Writer};
//! use deltille_files::limits::Limits;
//!
//! let picture = ImageRecord::of(&Detection::new("desk.png", [640, 480], Vec::new()));
//! let mut writer = Writer::new(Vec::new(), Vec::new(), &[])?;
//! writer.push(&picture)?;
//! let [corners, pictures] = writer.finish()?;
//!
//! let mut reader = Reader::new(Limits::default());
//! reader.add(corners)?;
//! reader.add(pictures)?;
//! assert_eq!(reader.finish()?.images, [picture]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod column;
pub mod folder;
mod pages;
mod read;
mod row;
mod write;

use deltille_core::detection::Detection;

use crate::limits::Exceeded;

pub use read::{Contents, Read, Reader};
pub use write::Writer;

/// File names of the two tables in a folder, without extension.
pub const CORNERS: &str = "corners";
/// See [`CORNERS`].
pub const IMAGES: &str = "images";
/// The extension of both.
pub const EXTENSION: &str = "parquet";

/// The key under which the file of a table names its schema, and the schemas with their versions. Tables of other
/// programs have no schema and are recognised by their columns.
const SCHEMA: &str = "deltille.schema";
const CORNERS_SCHEMA: &str = "deltille/corners/1";
const IMAGES_SCHEMA: &str = "deltille/images/1";

/// Names of the table of images and of its schema before version 0.1; readers accept them.
const EARLIER_IMAGES: &str = "pictures";
const EARLIER_IMAGES_SCHEMA: &str = "deltille/pictures/1";

/// The result for an image.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageRecord {
    /// Its name, unique in a table, by which corners and images are joined.
    pub image: String,
    /// Number of tags that were read in it.
    pub tags: u32,
    /// The detection without tags, or the reason why the image could not be read.
    pub found: Result<Detection, String>,
}

impl ImageRecord {
    /// The result for an image with a detection.
    pub fn of(found: &Detection) -> Self {
        let mut found = found.clone();
        let tags = found.grids.iter().map(|grid| grid.tags.len()).sum::<usize>();
        found.grids.iter_mut().for_each(|grid| grid.tags.clear());
        found.timing_ms.clear();
        Self { image: found.image.clone(), tags: tags as u32, found: Ok(found) }
    }

    /// The result for an image that could not be read, with the reason.
    pub fn unread(image: impl Into<String>, why: impl Into<String>) -> Self {
        Self { image: image.into(), tags: 0, found: Err(why.into()) }
    }
}

/// Error of reading or writing a table.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The file could not be written.
    #[error("{0}")]
    Write(String),
    /// The file is not Parquet, or is damaged.
    #[error("not a readable Parquet file: {0}")]
    File(String),
    /// The file contains another table.
    #[error(
        "neither a `corners` nor an `images` table: it has no column `{0}`; use the files that \
         `deltille detect --format parquet` wrote"
    )]
    Other(&'static str),
    /// The table has another version.
    #[error("its schema is `{found}`, but this version reads `{reads}`: create the file again")]
    Schema {
        /// The schema that the file names.
        found: String,
        /// The schema that this version reads.
        reads: &'static str,
    },
    /// The table needs more memory than the limits allow.
    #[error(transparent)]
    Exceeded(#[from] Exceeded),
    /// A column is missing or has another type.
    #[error("column `{column}`: {problem}")]
    Column {
        /// The column.
        column: &'static str,
        /// The problem.
        problem: String,
    },
    /// A value is missing or out of range.
    #[error("row {row}, column `{column}`: {problem}")]
    Cell {
        /// The row, counted from 1.
        row: u64,
        /// The column.
        column: &'static str,
        /// The problem.
        problem: String,
    },
    /// The rows of an image contradict each other.
    #[error("image {image}: {problem}")]
    ImageRecord {
        /// The image.
        image: String,
        /// The problem.
        problem: String,
    },
}
