//! The covariance of all unknowns of a calibration as JSON (schema `deltille/covariance/1`), CSV, or arrays of NumPy.

use std::fmt::Write as _;

use serde::Serialize;

use crate::export::detections::npy::{float64, texts};
use crate::export::writing::cell::quoted;
use crate::export::writing::zip::zip;
use deltille_calibrate::{JointCovariance, JointUnknown, Matrix};
use deltille_core::json;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/covariance/1";

/// The formats, by the end of the file name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CovarianceFormat {
    /// A line for each pair of unknowns.
    Csv,
    /// Arrays of NumPy: `names` and `units` (n), `noise` and `observed` (n × n, NaN where it is not known).
    Npz,
    /// The names, the units, and the rows of the matrices.
    Json,
}

#[derive(Serialize)]
struct CovarianceFile<'a> {
    schema: &'static str,
    names: Vec<&'a str>,
    units: Vec<&'a str>,
    noise: Vec<Vec<Option<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    observed: Option<Vec<Vec<Option<f64>>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    observed_freedom: Option<f64>,
}

impl CovarianceFormat {
    /// The format of a file with this extension.
    pub fn of_extension(extension: &str) -> Option<Self> {
        match extension.to_ascii_lowercase().as_str() {
            "csv" => Some(Self::Csv),
            "npz" => Some(Self::Npz),
            "json" => Some(Self::Json),
            _ => None,
        }
    }

    /// Returns the content of a file.
    pub fn write(self, of: &JointCovariance) -> Vec<u8> {
        match self {
            Self::Csv => csv(of).into_bytes(),
            Self::Npz => npz(of),
            Self::Json => json::to_text(&file(of), 4).into_bytes(),
        }
    }

    /// Returns a file without unknowns, to find out what it may replace.
    pub fn sample(self) -> Vec<u8> {
        match self {
            Self::Csv => HEAD.as_bytes().to_vec(),
            Self::Npz => arrays(&[], &[], &[]),
            Self::Json => format!("{{\"schema\": \"{SCHEMA}\"}}").into_bytes(),
        }
    }
}

const HEAD: &str = "row,column,unit,noise,observed\n";

fn csv(of: &JointCovariance) -> String {
    let mut text = HEAD.to_owned();
    for (i, row) in of.unknowns.iter().enumerate() {
        for (j, column) in of.unknowns.iter().enumerate() {
            let observed = of.observed.as_ref().and_then(|matrix| entry(matrix, i, j));
            let observed = observed.map_or(String::new(), |value| value.to_string());
            let (noise, unit) = (of.noise[(i, j)], product(row.unit, column.unit));
            let [row, column] = [row, column].map(|of| quoted(&of.name));
            // Writing to a string does not fail.
            let _ = writeln!(text, "{row},{column},{unit},{noise},{observed}");
        }
    }
    text
}

/// An entry of a matrix; `None` beyond its end, where the observed covariance is not known.
fn entry(matrix: &Matrix, i: usize, j: usize) -> Option<f64> {
    (i.max(j) < matrix.rows()).then(|| matrix[(i, j)])
}

/// The product of two units.
fn product(row: &str, column: &str) -> String {
    match (row, column) {
        ("1", unit) | (unit, "1") => unit.to_owned(),
        (row, column) if row == column => format!("{row}^2"),
        (row, column) => format!("{row}*{column}"),
    }
}

fn npz(of: &JointCovariance) -> Vec<u8> {
    let (names, units) = labels(of);
    let noise = Some(("noise.npy", &of.noise));
    let observed = of.observed.as_ref().map(|matrix| ("observed.npy", matrix));
    arrays(&names, &units, &noise.into_iter().chain(observed).collect::<Vec<_>>())
}

fn arrays(names: &[&str], units: &[&str], matrices: &[(&str, &Matrix)]) -> Vec<u8> {
    let labels = [("names.npy", texts(names)), ("units.npy", texts(units))];
    let matrices = matrices.iter().map(|&(name, matrix)| {
        let n = names.len();
        let value = move |i, j| entry(matrix, i, j).unwrap_or(f64::NAN);
        let values = (0..n).flat_map(|i| (0..n).map(move |j| value(i, j)));
        (name, float64(n, n, values))
    });
    let parts: Vec<(&str, Vec<u8>)> = labels.into_iter().chain(matrices).collect();
    zip(&parts.iter().map(|(name, bytes)| (*name, bytes.as_slice(), false)).collect::<Vec<_>>())
}

fn file(of: &JointCovariance) -> CovarianceFile<'_> {
    let (names, units) = labels(of);
    let n = of.unknowns.len();
    let rows = |matrix: &Matrix| -> Vec<Vec<Option<f64>>> {
        (0..n).map(|i| (0..n).map(|j| entry(matrix, i, j)).collect()).collect()
    };
    CovarianceFile {
        schema: SCHEMA,
        names,
        units,
        noise: rows(&of.noise),
        observed: of.observed.as_ref().map(rows),
        observed_freedom: of.observed_freedom,
    }
}

fn labels(of: &JointCovariance) -> (Vec<&str>, Vec<&str>) {
    of.unknowns.iter().map(|JointUnknown { name, unit, .. }| (name.as_str(), *unit)).unzip()
}
