//! Converts between Rust values and numpy arrays, checks numeric arguments, and turns plain data into dictionaries.

use deltille::calibrate::Matrix;
use deltille::glam::DMat3;
use deltille_core::quantity::{OutOfRange, Range, distance_mm};
use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayLikeDyn};
use pyo3::prelude::*;

use super::errors;

/// Converts rows of `N` numbers to an array with `N` columns.
pub fn rows<'py, T: Element + Copy, const N: usize>(
    py: Python<'py>,
    rows: impl IntoIterator<Item = [T; N]>,
) -> Bound<'py, PyArray2<T>> {
    let flat: Vec<T> = rows.into_iter().flatten().collect();
    let count = flat.len() / N;
    let array = Array2::from_shape_vec((count, N), flat).expect("every row has N numbers");
    array.into_pyarray(py)
}

/// Converts symmetric matrices (xx, xy, yy) to an array of N × 2 × 2; unknown ones are NaN.
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

/// Converts numbers to a one-dimensional array.
pub fn column<T: Element>(
    py: Python<'_>,
    all: impl IntoIterator<Item = T>,
) -> Bound<'_, PyArray1<T>> {
    all.into_iter().collect::<Array1<T>>().into_pyarray(py)
}

/// Converts a matrix to an array.
pub fn matrix<'py>(py: Python<'py>, matrix: &Matrix) -> Bound<'py, PyArray2<f64>> {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    Array2::from_shape_fn((rows, columns), |(i, j)| matrix[(i, j)]).into_pyarray(py)
}

/// Converts a 3 × 3 matrix to an array.
pub fn matrix3<'py>(py: Python<'py>, matrix: &DMat3) -> Bound<'py, PyArray2<f64>> {
    rows(py, [0, 1, 2].map(|row| matrix.row(row).to_array()))
}

/// Reads rows of `N` numbers from an array with `N` columns, or from anything numpy converts to one.
///
/// # Errors
/// Returns an error with the argument's name if `given` has another shape or type.
pub fn rows_of<const N: usize>(
    argument: &str,
    given: &Bound<'_, PyAny>,
) -> PyResult<Vec<[f64; N]>> {
    let wrong = |what: String| {
        errors::argument(format!("{argument}: expected an array of N × {N}, got {what}"))
    };
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

/// Reads `N` numbers in a range. The array may have several dimensions, like OpenCV's vectors.
///
/// # Errors
/// Returns an error of class `class` with the argument's name if the count, the type or a number is wrong.
pub fn vector<const N: usize>(
    argument: &str,
    given: &Bound<'_, PyAny>,
    range: Range,
    class: fn(String) -> PyErr,
) -> PyResult<[f64; N]> {
    let all = numbers(argument, given, range, class)?;
    let count = all.len();
    let wrong = |_| class(format!("{argument}: expected {N} numbers, got {count}"));
    all.try_into().map_err(wrong)
}

/// Reads any number of numbers in a range.
///
/// # Errors
/// Returns an error of class `class` with the argument's name if the type or a number is wrong.
pub fn numbers(
    argument: &str,
    given: &Bound<'_, PyAny>,
    range: Range,
    class: fn(String) -> PyErr,
) -> PyResult<Vec<f64>> {
    let Ok(array) = given.extract::<PyArrayLikeDyn<'_, f64, numpy::AllowTypeChange>>() else {
        let kind = given.get_type().qualname()?;
        return Err(class(format!("{argument}: expected numbers, got {kind}")));
    };
    let array = array.as_array();
    let checked = array.iter().map(|&number| range.check(number));
    let checked: Result<Vec<f64>, OutOfRange> = checked.collect();
    checked.map_err(|error| class(format!("{argument}: {error}")))
}

/// Checks that a number is in a range.
///
/// # Errors
/// Returns an error of class `class` with the argument's name if it is not.
pub fn number(
    argument: &str,
    given: f64,
    range: Range,
    class: fn(String) -> PyErr,
) -> PyResult<f64> {
    range.check(given).map_err(|error| class(format!("{argument}: {error}")))
}

/// Formats an array shape.
pub fn shape_in_words(shape: &[usize]) -> String {
    match shape {
        [] => "a single number".to_owned(),
        [count] => format!("a vector of {count}"),
        _ => shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" × "),
    }
}

/// Converts a Python integer to the library's type.
///
/// # Errors
/// Returns an error of class `class` with the argument's name if it is negative or too large.
pub fn whole<T: TryFrom<i64>>(
    argument: &str,
    given: i64,
    class: fn(String) -> PyErr,
) -> PyResult<T> {
    let wrong = |_| match given {
        ..0 => class(format!("{argument}: expected a whole number of at least 0, got {given}")),
        _ => class(format!("{argument}: {given} is too large")),
    };
    given.try_into().map_err(wrong)
}

/// Checks the distance at which projections are evaluated, mm; `None` stands for infinity.
pub fn distance(distance_mm: Option<f64>) -> PyResult<Option<f64>> {
    let given = distance_mm.filter(|mm| *mm != f64::INFINITY);
    let checked =
        given.map(|mm| number("distance_mm", mm, distance_mm::RANGE, errors::calibration));
    checked.transpose()
}

/// Converts plain data to a dictionary.
pub fn record<'py>(py: Python<'py>, data: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(data).unwrap_or_default();
    py.import("json")?.call_method1("loads", (text,))
}
