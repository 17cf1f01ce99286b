//! A row of a table: its cells with their types and ranges.

use std::str;

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::TableError;
use super::column::{Cell, Column, Kind};
use deltille_core::detection::{InkEstimate, ToneEstimate};
use deltille_core::quantity;
use deltille_core::quantity::Range;

/// Maximum size of a text, for example the path of an image, bytes.
const MAX_TEXT: usize = 10_000;

/// A row of a table.
pub(super) struct Row<'a> {
    pub number: u64,
    pub columns: &'static [Column],
    pub cells: &'a [Vec<Cell>],
    pub row: usize,
}

impl<'a> Row<'a> {
    pub(super) fn cell(&self, at: usize) -> &'a Cell {
        self.cells[at].get(self.row).unwrap_or(&Cell::None)
    }

    pub(super) fn wrong(&self, at: usize, problem: impl ToString) -> TableError {
        let (row, column) = (self.number, self.columns[at].name);
        TableError::Cell { row, column, problem: problem.to_string() }
    }

    pub(super) fn missing(&self, at: usize) -> TableError {
        self.wrong(at, format!("expected {}", self.columns[at].kind.expected()))
    }

    pub(super) fn text(&self, at: usize) -> Result<Option<&'a str>, TableError> {
        match self.cell(at) {
            Cell::None => Ok(None),
            Cell::Text(bytes) if bytes.len() > MAX_TEXT => {
                Err(self.wrong(at, format!("text with more than {MAX_TEXT} bytes")))
            }
            Cell::Text(bytes) => {
                let text = str::from_utf8(bytes.data());
                text.map(Some).map_err(|_| self.wrong(at, "not UTF-8 text"))
            }
            _ => Err(self.missing(at)),
        }
    }

    /// Returns an integer. It may be stored as floating-point, because some programs have no integers with missing values.
    pub(super) fn whole(&self, at: usize) -> Result<Option<i64>, TableError> {
        match *self.cell(at) {
            Cell::None => Ok(None),
            Cell::Whole(value) => Ok(Some(value)),
            Cell::Real(value) if value.fract() == 0.0 && value.abs() < 1e15 => {
                Ok(Some(value as i64))
            }
            _ => Err(self.missing(at)),
        }
    }

    pub(super) fn unsigned(&self, at: usize) -> Result<Option<u32>, TableError> {
        let value = self.whole(at)?.map(u32::try_from).transpose();
        value.map_err(|_| self.wrong(at, "not an integer from 0 to 4294967295"))
    }

    pub(super) fn real(&self, at: usize, range: Range) -> Result<Option<f64>, TableError> {
        let value = match *self.cell(at) {
            Cell::None => return Ok(None),
            Cell::Real(value) => value,
            Cell::Whole(value) => value as f64,
            _ => return Err(self.missing(at)),
        };
        range.check(value).map(Some).map_err(|what| self.wrong(at, what))
    }

    pub(super) fn flag(&self, at: usize) -> Result<Option<bool>, TableError> {
        match *self.cell(at) {
            Cell::None => Ok(None),
            Cell::Flag(value) => Ok(Some(value)),
            _ => Err(self.missing(at)),
        }
    }

    pub(super) fn tone(&self) -> Result<Option<ToneEstimate>, TableError> {
        self.estimate(9, &["black", "white", "kappa", "kappa_sd", "kappa_odd", "used"])
    }

    pub(super) fn ink(&self) -> Result<Option<InkEstimate>, TableError> {
        let fields = ["edges", "edges_sd", "um", "um_sd", "used", "images"];
        self.estimate(15, &fields)
    }

    /// Returns an estimate from consecutive columns starting at `at`, if the first has a value. It is read like JSON, which checks
    /// the ranges.
    fn estimate<T: DeserializeOwned>(
        &self,
        at: usize,
        fields: &[&str],
    ) -> Result<Option<T>, TableError> {
        if *self.cell(at) == Cell::None {
            return Ok(None);
        }
        let mut object = Map::new();
        for (column, field) in (at..).zip(fields) {
            let value = match self.columns[column].kind {
                Kind::Flag => self.flag(column)?.map(Value::from),
                Kind::Real => self.real(column, quantity::figure::RANGE)?.map(Value::from),
                _ => self.unsigned(column)?.map(Value::from),
            };
            object.extend(value.map(|value| ((*field).to_owned(), value)));
        }
        let read = serde_json::from_value(Value::Object(object));
        read.map(Some).map_err(|error| self.wrong(at, error))
    }
}
