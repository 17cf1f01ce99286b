//! Arrays of many small things, and back.

use deltille::glam::{DMat3, DVec2, DVec3};
use deltille::nalgebra::DMatrix;
use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{Element, PyArray1, PyArray2, PyArray3, PyReadonlyArray2, PyUntypedArrayMethods};
use numpy::{IntoPyArray, PyArrayLike2};
use pyo3::prelude::*;

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
pub fn matrix<'py>(py: Python<'py>, matrix: &DMatrix<f64>) -> Bound<'py, PyArray2<f64>> {
    let (rows, columns) = matrix.shape();
    Array2::from_shape_fn((rows, columns), |(i, j)| matrix[(i, j)]).into_pyarray(py)
}

/// A 3 × 3 matrix.
pub fn matrix3<'py>(py: Python<'py>, matrix: &DMat3) -> Bound<'py, PyArray2<f64>> {
    rows(py, [0, 1, 2].map(|row| matrix.row(row).to_array()))
}

/// An array of N × 3, or anything that makes one.
pub type Points<'py> = PyArrayLike2<'py, f64, numpy::AllowTypeChange>;

/// Rows of an array, which are to have three numbers.
pub fn points3(points: &Points) -> Option<Vec<DVec3>> {
    let points = points.as_array();
    let is_it = points.ncols() == 3;
    is_it.then(|| points.rows().into_iter().map(|p| DVec3::new(p[0], p[1], p[2])).collect())
}

/// Rows of an array, which are to have two numbers.
pub fn points2(points: &Points) -> Option<Vec<DVec2>> {
    let points = points.as_array();
    let is_it = points.ncols() == 2;
    is_it.then(|| points.rows().into_iter().map(|p| DVec2::new(p[0], p[1])).collect())
}

/// The shape of an array, as it is read.
pub fn shape(points: &Points) -> String {
    let points: &PyReadonlyArray2<f64> = points;
    format!("{} × {}", points.shape()[0], points.shape()[1])
}
