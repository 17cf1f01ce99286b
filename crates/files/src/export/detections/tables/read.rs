//! Reads tables written by this program or by others, one batch of rows at a time.

use std::collections::{BTreeMap, HashMap};
use std::str;

use bytes::Bytes;
use parquet::basic::{Compression, ConvertedType, LogicalType};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData};
use parquet::file::reader::FileReader;
use parquet::file::serialized_reader::SerializedFileReader;

use super::column::{self, Cell, Column};
use super::row::Row;
use super::write::kind_name;
use super::{
    CORNERS_SCHEMA, EARLIER_IMAGES_SCHEMA, IMAGES_SCHEMA, ImageRecord, SCHEMA, TableError,
};
use crate::export::detections::detection;
use crate::limits::{self, Broken, Kind as Limit, Limits};
use deltille_core::detection::{Detection, Grid, GridCorner, Reason};
use deltille_core::lattice::GridKind;
use deltille_core::quantity;
use deltille_core::raster::FileNotes;
use deltille_core::targets::TargetIdentity;

/// Number of rows decoded at a time.
const BATCH: usize = 4096;

/// Approximate memory of a row, bytes. Repeated values take less in a file.
const BYTES_PER_CORNER: u64 = 32;
const BYTES_PER_IMAGE: u64 = 200;

/// The table that a file contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contents {
    /// A row for each corner.
    Corners,
    /// A row for each image.
    Images,
}

/// Reads tables. Each may consist of several files, in any order.
pub struct Reader {
    limits: Limits,
    index: HashMap<String, usize>,
    seen: Vec<Seen>,
}

/// The content of tables.
#[derive(Clone, Debug, PartialEq)]
pub struct Read {
    /// The images, in the order of their first occurrence.
    pub images: Vec<ImageRecord>,
    /// Number of images with fewer corners than their table states.
    pub short: usize,
}

/// The data read so far for an image.
struct Seen {
    image: String,
    picture: Option<ImageRecord>,
    /// Its number of corners in the `images` table.
    corners: Option<u32>,
    grids: BTreeMap<u32, Grid>,
}

impl Reader {
    /// Creates a reader without tables. No file may exceed [`Limits::max_bytes`], packed or unpacked.
    pub fn new(limits: Limits) -> Self {
        Self { limits, index: HashMap::new(), seen: Vec::new() }
    }

    /// Reads a file of a table and returns which table it is.
    ///
    /// # Errors
    /// Returns an error if the file is not a valid table, is damaged, or needs more memory than the limits allow.
    pub fn add(&mut self, content: Vec<u8>) -> Result<Contents, TableError> {
        // The Parquet reader does not check everything, so it may panic.
        limits::caught(|| self.add_file(Bytes::from(content)))
            .unwrap_or_else(|broken: Broken| Err(TableError::File(broken.to_string())))
    }

    fn add_file(&mut self, content: Bytes) -> Result<Contents, TableError> {
        let file = SerializedFileReader::new(content.clone()).map_err(damaged)?;
        let metadata = file.metadata();
        let contents = contents(metadata)?;
        let (columns, per_row) = match contents {
            Contents::Corners => (&column::CORNERS[..], BYTES_PER_CORNER),
            Contents::Images => (&column::IMAGES[..], BYTES_PER_IMAGE),
        };
        let places = places(metadata, columns)?;
        let mut budget = Budget { left: self.limits.max_bytes, limits: self.limits };
        check_groups(metadata, &content, &places, per_row, &mut budget)?;
        let mut first_row = 1;
        for group in 0..metadata.num_row_groups() {
            let reader = file.get_row_group(group).map_err(damaged)?;
            let rows = reader.metadata().num_rows() as usize;
            let open = |(column, place): (&Column, &Option<usize>)| {
                let Some(place) = *place else { return Ok(None) };
                let description = reader.metadata().column(place).column_descr_ptr();
                let stream = Stream {
                    column: *column,
                    reader: reader.get_column_reader(place).map_err(damaged)?,
                    unsigned: is_unsigned(
                        description.logical_type_ref(),
                        description.converted_type(),
                    ),
                    has_gaps: description.max_def_level() > 0,
                };
                Ok(Some(stream))
            };
            let streams: Result<Vec<Option<Stream>>, TableError> =
                columns.iter().zip(&places).map(open).collect();
            let mut streams = streams?;
            for begin in (0..rows).step_by(BATCH) {
                let count = BATCH.min(rows - begin);
                let batch = streams.iter_mut().map(|stream| match stream {
                    Some(stream) => stream.next(count),
                    None => Ok(Vec::new()),
                });
                let batch = batch.collect::<Result<Vec<_>, TableError>>()?;
                for row in 0..count {
                    let number = first_row + (begin + row) as u64;
                    let row = Row { number, columns, cells: &batch, row };
                    match contents {
                        Contents::Corners => self.add_corner(&row, &mut budget)?,
                        Contents::Images => self.add_picture(&row, &mut budget)?,
                    }
                }
            }
            first_row += rows as u64;
        }
        Ok(contents)
    }

    /// The image with the given name.
    fn seen(&mut self, image: &str, budget: &mut Budget) -> Result<&mut Seen, TableError> {
        // Rows of an image are usually consecutive.
        let last = self.seen.len().checked_sub(1).filter(|&last| self.seen[last].image == image);
        let place = match last.or_else(|| self.index.get(image).copied()) {
            Some(place) => place,
            None => {
                budget.spend(BYTES_PER_IMAGE + 2 * image.len() as u64)?;
                self.index.insert(image.to_owned(), self.seen.len());
                let image = image.to_owned();
                self.seen.push(Seen {
                    image,
                    picture: None,
                    corners: None,
                    grids: BTreeMap::new(),
                });
                self.seen.len() - 1
            }
        };
        Ok(&mut self.seen[place])
    }

    fn add_corner(&mut self, row: &Row, budget: &mut Budget) -> Result<(), TableError> {
        let kind = match row.text(2)? {
            Some(name) if name == kind_name(GridKind::Deltille) => GridKind::Deltille,
            Some(name) if name == kind_name(GridKind::Checker) => GridKind::Checker,
            Some(_) => return Err(row.wrong(2, "neither `deltille` nor `checker`")),
            None => return Err(row.missing(2)),
        };
        let target = row.text(3)?;
        let panel = row.unsigned(4)?;
        let mirrored = row.flag(5)?.unwrap_or(false);
        let place = |at| {
            let value = row.whole(at)?.ok_or_else(|| row.missing(at))?;
            let in_range = quantity::place_in_lattice::RANGE.check(value as f64);
            in_range.map_err(|what| row.wrong(at, what))?;
            Ok::<i32, TableError>(value as i32)
        };
        let needed = |at, range| row.real(at, range)?.ok_or_else(|| row.missing(at));
        let covariance = |at| row.real(at, quantity::figure::RANGE);
        let cov = match [covariance(11)?, covariance(12)?, covariance(13)?] {
            [Some(xx), Some(xy), Some(yy)] => Some([xx, xy, yy]),
            [None, None, None] => None,
            _ => return Err(row.wrong(11, "a covariance needs xx, xy and yy")),
        };
        let corner = GridCorner {
            row: place(6)?,
            col: place(7)?,
            id: row.unsigned(8)?,
            x: needed(9, quantity::place_px::RANGE)?,
            y: needed(10, quantity::place_px::RANGE)?,
            cov,
        };
        let index = row.unsigned(1)?.ok_or_else(|| row.missing(1))?;
        let image = row.text(0)?.ok_or_else(|| row.missing(0))?;
        let seen = self.seen(image, budget)?;
        if !seen.grids.contains_key(&index) {
            budget.spend(BYTES_PER_IMAGE + target.map_or(0, |target| target.len() as u64))?;
        }
        let grid = seen.grids.entry(index).or_insert_with(|| Grid {
            kind,
            target: target.map(str::to_owned),
            panel,
            mirrored,
            corners: Vec::new(),
            tags: Vec::new(),
        });
        if (grid.kind, grid.target.as_deref(), grid.panel, grid.mirrored)
            != (kind, target, panel, mirrored)
        {
            let problem = "kind, target, panel or side differs from other corners of this grid";
            return Err(row.wrong(1, problem));
        }
        grid.corners.push(corner);
        Ok(())
    }

    fn add_picture(&mut self, row: &Row, budget: &mut Budget) -> Result<(), TableError> {
        let image = row.text(0)?.ok_or_else(|| row.missing(0))?;
        let mut spent = 0;
        let mut owned = |text: Option<&str>| {
            spent += text.map_or(0, |text| text.len() as u64);
            text.map(str::to_owned)
        };
        let found = match owned(row.text(23)?) {
            Some(why) => Err(why),
            None => {
                let side = |at| {
                    let value = row.whole(at)?.ok_or_else(|| row.missing(at))?;
                    let in_range = quantity::side_px::RANGE.check(value as f64);
                    in_range.map_err(|what| row.wrong(at, what))?;
                    Ok::<u32, TableError>(value as u32)
                };
                let mut found = Detection::new(image, [side(1)?, side(2)?], Vec::new());
                found.time_ns = row.whole(25)?;
                found.tone = row.tone()?;
                found.ink = row.ink()?;
                let exif_orientation = row.unsigned(21)?.map(u8::try_from).transpose();
                let exif_orientation =
                    exif_orientation.map_err(|_| row.wrong(21, "not from 2 to 8"))?;
                let camera = owned(row.text(26)?).map(|json| serde_json::from_str(&json));
                let camera = camera.transpose().map_err(|error| row.wrong(26, error))?;
                let damage = owned(row.text(22)?);
                found.file = FileNotes { exif_orientation, camera, damage };
                if let Some(json) = owned(row.text(24)?) {
                    let targets: Result<Vec<TargetIdentity>, _> = serde_json::from_str(&json);
                    found.targets = targets.map_err(|error| row.wrong(24, error))?;
                }
                if let Some(json) = owned(row.text(8)?) {
                    let reasons: Result<Vec<Reason>, _> = serde_json::from_str(&json);
                    found.reasons = reasons.map_err(|error| row.wrong(8, error))?;
                }
                Ok(found)
            }
        };
        let (tags, corners) = (row.unsigned(5)?.unwrap_or(0), row.unsigned(4)?);
        // Reasons take more memory than their text.
        budget.spend(image.len() as u64 + 8 * spent)?;
        let seen = self.seen(image, budget)?;
        let picture = ImageRecord { image: image.to_owned(), tags, found };
        if seen.picture.replace(picture).is_some() {
            let problem = "it is listed twice in the `images` table".to_owned();
            return Err(TableError::ImageRecord { image: image.to_owned(), problem });
        }
        seen.corners = corners;
        Ok(())
    }

    /// Returns the images with their corners, sorted by row and column within each grid.
    ///
    /// # Errors
    /// Returns an error if corners belong to an image that is not in the `images` table or could not be read, or if the corners of
    /// an image contradict each other.
    pub fn finish(self) -> Result<Read, TableError> {
        let (mut images, mut short) = (Vec::with_capacity(self.seen.len()), 0);
        for Seen { image, picture, corners, grids } in self.seen {
            let wrong = |problem: String| TableError::ImageRecord { image: image.clone(), problem };
            let Some(mut picture) = picture else {
                return Err(wrong(
                    "it has corners, but it is not in the `images` table".to_owned(),
                ));
            };
            let count: usize = grids.values().map(|grid| grid.corners.len()).sum();
            short +=
                usize::from(corners.is_some_and(|corners| (count as u64) < u64::from(corners)));
            match &mut picture.found {
                Ok(found) => {
                    found.grids = grids.into_values().collect();
                    // Restores the order of detection, even if other programs moved the rows.
                    let order = |grid: &mut Grid| {
                        grid.corners.sort_by_key(|corner| (corner.row, corner.col))
                    };
                    found.grids.iter_mut().for_each(order);
                    let checked = detection::check_corners(&found.grids);
                    checked.map_err(|error| wrong(error.to_string()))?;
                }
                Err(_) if count > 0 => {
                    return Err(wrong("it has corners, but it could not be read".to_owned()));
                }
                Err(_) => {}
            }
            images.push(picture);
        }
        Ok(Read { images, short })
    }
}

fn damaged(error: ParquetError) -> TableError {
    // Messages have the uninformative prefix "Parquet error: ".
    let words = error.to_string();
    TableError::File(words.trim_start_matches("Parquet error: ").to_owned())
}

/// Identifies the table by its columns.
fn contents(metadata: &ParquetMetaData) -> Result<Contents, TableError> {
    let schema = metadata.file_metadata().schema_descr();
    let has = |name: &str| schema.columns().iter().any(|column| column.path().string() == name);
    let (contents, reads) = match (has("width"), has("x")) {
        (true, _) => (Contents::Images, IMAGES_SCHEMA),
        (_, true) => (Contents::Corners, CORNERS_SCHEMA),
        _ => return Err(TableError::Other("x` or `width")),
    };
    let stated = metadata.file_metadata().key_value_metadata().into_iter().flatten();
    let stated = stated.filter(|pair| pair.key == SCHEMA).find_map(|pair| pair.value.as_deref());
    match stated {
        Some(EARLIER_IMAGES_SCHEMA) if reads == IMAGES_SCHEMA => Ok(contents),
        Some(found) if found != reads => {
            let found: String = found.chars().take(100).collect();
            Err(TableError::Schema { found, reads })
        }
        _ => Ok(contents),
    }
}

/// Positions of the columns in a file.
fn places(
    metadata: &ParquetMetaData,
    columns: &'static [Column],
) -> Result<Vec<Option<usize>>, TableError> {
    let schema = metadata.file_metadata().schema_descr();
    let place = |column: &'static Column| {
        let wrong =
            |problem: &str| TableError::Column { column: column.name, problem: problem.to_owned() };
        let all = schema.columns().iter();
        let is_named = |name: &str| all.clone().position(|found| found.path().string() == name);
        match is_named(column.name).or_else(|| is_named(&column.earlier_name())) {
            Some(place) => {
                let found = schema.column(place);
                let is_flat = found.max_rep_level() == 0 && found.max_def_level() <= 1;
                is_flat.then_some(Some(place)).ok_or_else(|| wrong("every row needs a value"))
            }
            None if column.needed => Err(wrong("the column is missing")),
            None => Ok(None),
        }
    };
    columns.iter().map(place).collect()
}

/// Memory that may still be allocated, bytes.
struct Budget {
    left: u64,
    limits: Limits,
}

impl Budget {
    fn spend(&mut self, bytes: u64) -> Result<(), TableError> {
        let left = self.left.checked_sub(bytes);
        self.left = left.ok_or_else(|| self.limits.exceeded(Limit::Bytes))?;
        Ok(())
    }
}

/// Checks the sizes of all pages before any is unpacked.
fn check_groups(
    metadata: &ParquetMetaData,
    content: &Bytes,
    places: &[Option<usize>],
    per_row: u64,
    budget: &mut Budget,
) -> Result<(), TableError> {
    let file = |problem: &str| TableError::File(problem.to_owned());
    for group in metadata.row_groups() {
        let rows =
            u64::try_from(group.num_rows()).map_err(|_| file("a negative number of rows"))?;
        budget.spend(rows.saturating_mul(per_row))?;
        for &place in places.iter().flatten() {
            let part = group.columns().get(place).ok_or_else(|| file("a column is missing"))?;
            let problem = |problem: String| {
                TableError::File(format!("column {}: {problem}", part.column_path().string()))
            };
            if !matches!(part.compression(), Compression::UNCOMPRESSED | Compression::SNAPPY) {
                let words = part.compression().to_string();
                let name = words.split('(').next().unwrap_or_default().to_owned();
                return Err(problem(format!(
                    "compressed with {name}; write it with SNAPPY or uncompressed"
                )));
            }
            let pages = pages_of(part, content)
                .ok_or_else(|| problem("it is outside the file".to_owned()))?;
            let entries = budget.limits.max_nodes;
            budget.spend(super::pages::unpacked_bytes(pages, entries).map_err(problem)?)?;
        }
    }
    Ok(())
}

/// The bytes of a column's part.
fn pages_of<'a>(part: &ColumnChunkMetaData, content: &'a Bytes) -> Option<&'a [u8]> {
    let begin = part.dictionary_page_offset().unwrap_or(part.data_page_offset());
    let begin = usize::try_from(begin).ok()?;
    let length = usize::try_from(part.compressed_size()).ok()?;
    content.get(begin..begin.checked_add(length)?)
}

fn is_unsigned(logical: Option<&LogicalType>, converted: ConvertedType) -> bool {
    let by_logical = matches!(logical, Some(LogicalType::Integer(whole)) if !whole.is_signed);
    by_logical
        || matches!(
            converted,
            ConvertedType::UINT_8 | ConvertedType::UINT_16 | ConvertedType::UINT_32
        )
}

/// A column that is being read.
struct Stream {
    column: Column,
    reader: ColumnReader,
    unsigned: bool,
    has_gaps: bool,
}

impl Stream {
    /// The next rows.
    fn next(&mut self, count: usize) -> Result<Vec<Cell>, TableError> {
        let (unsigned, has_gaps) = (self.unsigned, self.has_gaps);
        let whole = |value: i32| {
            Cell::Whole(if unsigned { i64::from(value as u32) } else { i64::from(value) })
        };
        // NumPy uses NaN for missing values.
        let real = |value: f64| if value.is_nan() { Cell::None } else { Cell::Real(value) };
        let cells = match &mut self.reader {
            ColumnReader::BoolColumnReader(from) => cells(from, count, has_gaps, Cell::Flag),
            ColumnReader::Int32ColumnReader(from) => cells(from, count, has_gaps, whole),
            ColumnReader::Int64ColumnReader(from) => cells(from, count, has_gaps, Cell::Whole),
            ColumnReader::FloatColumnReader(from) => {
                cells(from, count, has_gaps, |value| real(value.into()))
            }
            ColumnReader::DoubleColumnReader(from) => cells(from, count, has_gaps, real),
            ColumnReader::ByteArrayColumnReader(from) => cells(from, count, has_gaps, Cell::Text),
            _ => {
                let problem = format!("expected {}", self.column.kind.expected());
                return Err(TableError::Column { column: self.column.name, problem });
            }
        };
        cells.map_err(|error| match error {
            Some(error) => damaged(error),
            None => TableError::File(format!("column {} is truncated", self.column.name)),
        })
    }
}

/// The next rows of a column; an error of `None` if the column ends too soon.
fn cells<T: DataType>(
    from: &mut ColumnReaderImpl<T>,
    count: usize,
    has_gaps: bool,
    cell: impl Fn(T::T) -> Cell,
) -> Result<Vec<Cell>, Option<ParquetError>> {
    let mut cells = Vec::with_capacity(count);
    while cells.len() < count {
        let (mut levels, mut values) = (Vec::new(), Vec::new());
        let gaps = has_gaps.then_some(&mut levels);
        let (rows, ..) = from.read_records(count - cells.len(), gaps, None, &mut values)?;
        if rows == 0 {
            return Err(None);
        }
        let mut values = values.into_iter();
        if has_gaps {
            for level in levels {
                let value = if level > 0 { Some(values.next().ok_or(None)?) } else { None };
                cells.push(value.map_or(Cell::None, &cell));
            }
        } else {
            cells.extend(values.map(&cell));
        }
    }
    Ok(cells)
}
