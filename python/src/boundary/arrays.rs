//! Arrays of many small things, and back; numbers that arguments give; plain data as dictionaries.

use deltille::calibrate::Matrix;
use deltille::glam::DMat3;
use deltille_core::quantity::{OutOfRange, Range, distance_mm};
use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayLikeDyn};
use pyo3::prelude::*;

use super::errors;

/// Rows of so many numbers as an array of N × so many.
pub fn rows<'py, T: Element + Copy, const N: usize>(
    py: Python<'py>,
    rows: impl IntoIterator<Item = [T; N]>,
) -> Bound<'py, PyArray2<T>> {
    let flat: Vec<T> = rows.into_iter().flatten().collect();
    let count = flat.len() / N;
    let array = Array2::from_shape_vec((count, N), flat).expect("every row has so many");
    array.into_pyarray(py)
}

/// Symmetric matrices xx, xy, yy as an array of N × 2 × 2; what is not known is NaN.
pub fn covariances<'py>(
    py: Python<'py>,
    all: impl IntoIterator<Item = Option<[f64; 3]>>,
) -> Bound<'py, PyArray3<f64>> {
    let full = |cov: Option<[f64; 3]>| {
        let [xx, xy, yy] = cov.unwrap_or([f64::NAN; 3]);
        [xx, xy, xy, yy]
    };
    let flat: Vec<f64> = all.into_iter().flat_map(full).collect();
    let array = Array3::from_shape_vec((flat.len() / 4, 2, 2), flat);
    array.expect("four numbers each").into_pyarray(py)
}

/// One number each.
pub fn column<T: Element>(
    py: Python<'_>,
    all: impl IntoIterator<Item = T>,
) -> Bound<'_, PyArray1<T>> {
    all.into_iter().collect::<Array1<T>>().into_pyarray(py)
}

/// A matrix.
pub fn matrix<'py>(py: Python<'py>, matrix: &Matrix) -> Bound<'py, PyArray2<f64>> {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    Array2::from_shape_fn((rows, columns), |(i, j)| matrix[(i, j)]).into_pyarray(py)
}

/// A 3 × 3 matrix.
pub fn matrix3<'py>(py: Python<'py>, matrix: &DMat3) -> Bound<'py, PyArray2<f64>> {
    rows(py, [0, 1, 2].map(|row| matrix.row(row).to_array()))
}

/// Rows of so many numbers each, of an array of N × so many or anything that makes one.
///
/// # Errors
/// Where it is something else, with the argument's name.
pub fn rows_of<const N: usize>(
    argument: &str,
    given: &Bound<'_, PyAny>,
) -> PyResult<Vec<[f64; N]>> {
    let wrong =
        |what: String| errors::argument(format!("{argument}: N × {N} are wanted, not {what}"));
    let Ok(array) = given.extract::<PyArrayLikeDyn<'_, f64, numpy::AllowTypeChange>>() else {
        return Err(wrong(given.get_type().qualname()?.to_string()));
    };
    let array = array.as_array();
    match array.shape() {
        [_, across] if *across == N => {
            Ok(array.outer_iter().map(|row| std::array::from_fn(|i| row[[i]])).collect())
        }
        shape => Err(wrong(shape_in_words(shape))),
    }
}

/// So many numbers of a range, also where an array has them in several dimensions, as OpenCV's vectors.
///
/// # Errors
/// Where it is something else, with the argument's name, of a class.
pub fn vector<const N: usize>(
    argument: &str,
    given: &Bound<'_, PyAny>,
    range: Range,
    class: fn(String) -> PyErr,
) -> PyResult<[f64; N]> {
    let all = numbers(argument, given, range, class)?;
    let count = all.len();
    let wrong = |_| class(format!("{argument}: {N} numbers are wanted, not {count}"));
    all.try_into().map_err(wrong)
}

/// Numbers of a range in a row, alike.
///
/// # Errors
/// Where it is something else, with the argument's name.
pub fn numbers(
    argument: &str,
    given: &Bound<'_, PyAny>,
    range: Range,
    class: fn(String) -> PyErr,
) -> PyResult<Vec<f64>> {
    let Ok(array) = given.extract::<PyArrayLikeDyn<'_, f64, numpy::AllowTypeChange>>() else {
        let kind = given.get_type().qualname()?;
        return Err(class(format!("{argument}: numbers are wanted, not {kind}")));
    };
    let array = array.as_array();
    let checked = array.iter().map(|&number| range.check(number));
    let checked: Result<Vec<f64>, OutOfRange> = checked.collect();
    checked.map_err(|error| class(format!("{argument}: {error}")))
}

/// A number of a range.
///
/// # Errors
/// Where it is another one, with the argument's name, of a class.
pub fn number(
    argument: &str,
    given: f64,
    range: Range,
    class: fn(String) -> PyErr,
) -> PyResult<f64> {
    range.check(given).map_err(|error| class(format!("{argument}: {error}")))
}

/// A shape as it is read.
pub fn shape_in_words(shape: &[usize]) -> String {
    match shape {
        [] => "a single number".to_owned(),
        [count] => format!("{count} in a row"),
        _ => shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" × "),
    }
}

/// A whole number that the library's own type holds.
///
/// # Errors
/// Where it is negative or too large, with the argument's name, of a class.
pub fn whole<T: TryFrom<i64>>(
    argument: &str,
    given: i64,
    class: fn(String) -> PyErr,
) -> PyResult<T> {
    let wrong = |_| match given {
        ..0 => class(format!("{argument}: give a whole number from 0, not {given}")),
        _ => class(format!("{argument}: {given} is too large")),
    };
    given.try_into().map_err(wrong)
}

/// A distance at which projections are looked at, mm; infinity where none is given.
pub fn distance(distance_mm: Option<f64>) -> PyResult<Option<f64>> {
    let given = distance_mm.filter(|mm| *mm != f64::INFINITY);
    let checked =
        given.map(|mm| number("distance_mm", mm, distance_mm::RANGE, errors::calibration));
    checked.transpose()
}

/// Plain data as a dictionary.
pub fn record<'py>(py: Python<'py>, data: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(data).unwrap_or_default();
    py.import("json")?.call_method1("loads", (text,))
}
