//! Writer of both tables, a group of rows at a time.

use std::io::Write;
use std::mem;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{ColumnPath, Type};

use super::column::{self, Cell, Column, Kind};
use super::{CORNERS_SCHEMA, IMAGES_SCHEMA, ImageRecord, SCHEMA, TableError};
use crate::export::GENERATOR;
use crate::export::detections::positions::Positions;
use deltille_core::detection::Detection;
use deltille_core::lattice::GridKind;
use deltille_core::targets::Target;

/// Number of rows written together: a few megabytes in memory.
const GROUP: usize = 1 << 16;

impl From<ParquetError> for TableError {
    fn from(error: ParquetError) -> Self {
        Self::Write(error.to_string())
    }
}

/// Writes both tables, image by image.
pub struct Writer<W: Write + Send> {
    corners: Table<W>,
    images: Table<W>,
    positions: Positions,
}

impl<W: Write + Send> Writer<W> {
    /// Begins both tables, of corners and of images. Corners on `targets` are written with their positions on the target.
    ///
    /// # Errors
    /// Returns an error if the tables cannot be written.
    pub fn new(corners: W, images: W, targets: &[Target]) -> Result<Self, TableError> {
        let targets: Vec<&Target> = targets.iter().collect();
        Ok(Self {
            positions: Positions::of(&targets),
            corners: Table::new(corners, CORNERS_SCHEMA, &column::CORNERS)?,
            images: Table::new(images, IMAGES_SCHEMA, &column::IMAGES)?,
        })
    }

    /// Adds an image and its corners.
    ///
    /// # Errors
    /// Returns an error if the tables cannot be written.
    pub fn push(&mut self, picture: &ImageRecord) -> Result<(), TableError> {
        if let Ok(found) = &picture.found {
            self.push_corners(&picture.image, found)?;
        }
        self.images.push(picture_row(picture))
    }

    fn push_corners(&mut self, image: &str, found: &Detection) -> Result<(), TableError> {
        let image = text(image);
        for (index, grid) in found.grids.iter().enumerate() {
            let kind = text(kind_name(grid.kind));
            let target = grid.target.as_deref().map_or(Cell::None, text);
            let positions = self.positions.of_grid(grid);
            for corner in &grid.corners {
                let position = positions.and_then(|all| all.get(&(corner.row, corner.col)));
                let [xx, xy, yy] = three(corner.cov);
                let [x, y, z] = three(position.map(|position| position.to_array()));
                self.corners.push([
                    image.clone(),
                    Cell::Whole(index as i64),
                    kind.clone(),
                    target.clone(),
                    whole(grid.panel),
                    Cell::Flag(grid.mirrored),
                    whole(Some(corner.row)),
                    whole(Some(corner.col)),
                    whole(corner.id),
                    Cell::Real(corner.x),
                    Cell::Real(corner.y),
                    xx,
                    xy,
                    yy,
                    x,
                    y,
                    z,
                ])?;
            }
        }
        Ok(())
    }

    /// Ends both tables and returns their outputs.
    ///
    /// # Errors
    /// Returns an error if the tables cannot be written.
    pub fn finish(self) -> Result<[W; 2], TableError> {
        Ok([self.corners.finish()?, self.images.finish()?])
    }
}

/// The name of a tiling.
pub(super) fn kind_name(kind: GridKind) -> &'static str {
    match kind {
        GridKind::Deltille => "deltille",
        GridKind::Checker => "checker",
    }
}

fn text(text: &str) -> Cell {
    Cell::Text(ByteArray::from(text))
}

fn whole(value: Option<impl Into<i64>>) -> Cell {
    value.map_or(Cell::None, |value| Cell::Whole(value.into()))
}

fn real(value: Option<f64>) -> Cell {
    value.map_or(Cell::None, Cell::Real)
}

fn three(values: Option<[f64; 3]>) -> [Cell; 3] {
    values.map_or([const { Cell::None }; 3], |values| values.map(Cell::Real))
}

fn flag(value: Option<bool>) -> Cell {
    value.map_or(Cell::None, Cell::Flag)
}

fn picture_row(picture: &ImageRecord) -> [Cell; column::IMAGES.len()] {
    let found = picture.found.as_ref().ok();
    let count = |of: fn(&Detection) -> usize| whole(found.map(|found| of(found) as u32));
    let reasons = found.map(|found| &found.reasons).filter(|reasons| !reasons.is_empty());
    let targets = found.map(|found| &found.targets).filter(|targets| !targets.is_empty());
    let sentences = |reasons: &Vec<deltille_core::detection::Reason>| {
        text(&reasons.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
    };
    // Reasons consist of names and numbers.
    let json =
        |value: serde_json::Value| text(value.as_str().map_or(&value.to_string(), |name| name));
    let to_json = |value: Result<_, _>| value.map_or(Cell::None, json);
    let tone = found.and_then(|found| found.tone);
    let ink = found.and_then(|found| found.ink);
    let file = found.map(|found| &found.file);
    let camera = file.and_then(|file| file.camera.as_ref());
    [
        text(&picture.image),
        whole(found.map(|found| found.width)),
        whole(found.map(|found| found.height)),
        count(|found| found.grids.len()),
        count(|found| found.grids.iter().map(|grid| grid.corners.len()).sum()),
        whole(found.map(|_| picture.tags)),
        reasons.map_or(Cell::None, |all| to_json(serde_json::to_value(all[0].kind))),
        reasons.map_or(Cell::None, sentences),
        reasons.map_or(Cell::None, |all| to_json(serde_json::to_value(all))),
        real(tone.map(|tone| tone.black)),
        real(tone.map(|tone| tone.white)),
        real(tone.map(|tone| tone.kappa)),
        real(tone.map(|tone| tone.kappa_sd)),
        real(tone.map(|tone| tone.kappa_odd)),
        flag(tone.map(|tone| tone.used)),
        real(ink.map(|ink| ink.edges)),
        real(ink.map(|ink| ink.edges_sd)),
        real(ink.and_then(|ink| ink.um)),
        real(ink.and_then(|ink| ink.um_sd)),
        flag(ink.map(|ink| ink.used)),
        whole(ink.map(|ink| ink.images)),
        whole(file.and_then(|file| file.exif_orientation)),
        file.and_then(|file| file.damage.as_deref()).map_or(Cell::None, text),
        picture.found.as_ref().err().map_or(Cell::None, |why| text(why)),
        targets.map_or(Cell::None, |all| to_json(serde_json::to_value(all))),
        whole(found.and_then(|found| found.time_ns)),
        camera.map_or(Cell::None, |camera| to_json(serde_json::to_value(camera))),
    ]
}

/// A table that is being written.
struct Table<W: Write + Send> {
    columns: Vec<Values>,
    rows: usize,
    out: SerializedFileWriter<W>,
}

/// Values of a column that are not written yet.
struct Values {
    column: Column,
    /// Whether each row has a value: 1 or 0.
    levels: Vec<i16>,
    typed: Typed,
}

enum Typed {
    Text(Vec<ByteArray>),
    Whole(Vec<i32>),
    Long(Vec<i64>),
    Real(Vec<f64>),
    Flag(Vec<bool>),
}

impl<W: Write + Send> Table<W> {
    fn new(out: W, schema: &'static str, columns: &[Column]) -> Result<Self, TableError> {
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_created_by(GENERATOR.to_owned())
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_offset_index_disabled(true)
            .set_key_value_metadata(Some(vec![KeyValue::new(
                SCHEMA.to_owned(),
                schema.to_owned(),
            )]));
        for column in columns.iter().filter(|column| !column.repeats) {
            let path = ColumnPath::new(vec![column.name.to_owned()]);
            properties = properties.set_column_dictionary_enabled(path, false);
        }
        let fields = columns.iter().map(|column| Ok(Arc::new(field(column)?)));
        let fields = fields.collect::<Result<Vec<_>, ParquetError>>()?;
        let root = Type::group_type_builder("table").with_fields(fields).build()?;
        let out = SerializedFileWriter::new(out, Arc::new(root), Arc::new(properties.build()))?;
        let empty =
            |&column: &Column| Values { column, levels: Vec::new(), typed: Typed::of(column.kind) };
        Ok(Self { columns: columns.iter().map(empty).collect(), rows: 0, out })
    }

    fn push<const N: usize>(&mut self, row: [Cell; N]) -> Result<(), TableError> {
        for (column, cell) in self.columns.iter_mut().zip(row) {
            column.push(cell);
        }
        self.rows += 1;
        if self.rows == GROUP { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<(), TableError> {
        if mem::take(&mut self.rows) == 0 {
            return Ok(());
        }
        let mut group = self.out.next_row_group()?;
        let mut columns = self.columns.iter_mut();
        while let Some((mut out, values)) = group.next_column()?.zip(columns.next()) {
            values.write(&mut out)?;
            out.close()?;
        }
        group.close()?;
        Ok(())
    }

    fn finish(mut self) -> Result<W, TableError> {
        self.flush()?;
        Ok(self.out.into_inner()?)
    }
}

fn field(column: &Column) -> Result<Type, ParquetError> {
    let (physical, logical) = match column.kind {
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Kind::Signed => (Physical::INT32, None),
        Kind::Unsigned => (Physical::INT32, Some(LogicalType::integer(32, false))),
        Kind::Long => (Physical::INT64, None),
        Kind::Real => (Physical::DOUBLE, None),
        Kind::Flag => (Physical::BOOLEAN, None),
    };
    let repetition = if column.full { Repetition::REQUIRED } else { Repetition::OPTIONAL };
    let builder = Type::primitive_type_builder(column.name, physical);
    builder.with_repetition(repetition).with_logical_type(logical).build()
}

impl Typed {
    fn of(kind: Kind) -> Self {
        match kind {
            Kind::Text => Self::Text(Vec::new()),
            Kind::Signed | Kind::Unsigned => Self::Whole(Vec::new()),
            Kind::Long => Self::Long(Vec::new()),
            Kind::Real => Self::Real(Vec::new()),
            Kind::Flag => Self::Flag(Vec::new()),
        }
    }
}

impl Values {
    fn push(&mut self, cell: Cell) {
        self.levels.push(i16::from(cell != Cell::None));
        match (&mut self.typed, cell) {
            (_, Cell::None) => {}
            (Typed::Text(values), Cell::Text(value)) => values.push(value),
            // Unsigned values are stored in the same bits.
            (Typed::Whole(values), Cell::Whole(value)) => values.push(value as i32),
            (Typed::Long(values), Cell::Whole(value)) => values.push(value),
            (Typed::Real(values), Cell::Real(value)) => values.push(value),
            (Typed::Flag(values), Cell::Flag(value)) => values.push(value),
            (_, cell) => unreachable!("column {}: {cell:?}", self.column.name),
        }
    }

    fn write(&mut self, out: &mut SerializedColumnWriter) -> Result<(), ParquetError> {
        let levels = mem::take(&mut self.levels);
        let levels = (!self.column.full).then_some(&levels[..]);
        match &mut self.typed {
            Typed::Text(values) => {
                out.typed::<ByteArrayType>().write_batch(&mem::take(values), levels, None)?
            }
            Typed::Whole(values) => {
                out.typed::<Int32Type>().write_batch(&mem::take(values), levels, None)?
            }
            Typed::Long(values) => {
                out.typed::<Int64Type>().write_batch(&mem::take(values), levels, None)?
            }
            Typed::Real(values) => {
                out.typed::<DoubleType>().write_batch(&mem::take(values), levels, None)?
            }
            Typed::Flag(values) => {
                out.typed::<BoolType>().write_batch(&mem::take(values), levels, None)?
            }
        };
        Ok(())
    }
}
