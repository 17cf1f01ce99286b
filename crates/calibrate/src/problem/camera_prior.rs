//! The prior of the parameters of a camera: their values and covariance in an earlier calibration, or independent
//! measurements.

use nalgebra::{DMatrix, DVector};

use deltille_core::camera::Camera;

/// A ridge on correlations, because files round them.
const RIDGE: f64 = 1e-9;

/// Known values of the parameters of a camera.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CameraPrior {
    /// All parameters.
    values: Vec<f64>,
    /// Inverse covariance of the estimated ones, in their order.
    information: DMatrix<f64>,
}

impl CameraPrior {
    /// Creates the prior; `None` if the covariance has no inverse.
    pub(crate) fn new(camera: &Camera, covariance: &DMatrix<f64>) -> Option<Self> {
        Some(Self { values: camera.parameters(), information: inverted(covariance)? })
    }

    /// Creates the prior from the index, value and standard deviation of some parameters; `None` if none of them is
    /// estimated (`free`).
    pub(crate) fn measured(
        priors: &[(usize, f64, f64)],
        camera: &Camera,
        free: &[bool],
    ) -> Option<Self> {
        let mut values = camera.parameters();
        let mut weights = vec![0.0; values.len()];
        for &(i, value, sd) in priors.iter().filter(|(i, ..)| free[*i]) {
            (values[i], weights[i]) = (value, sd.powi(-2));
        }
        let is_some = weights.iter().any(|weight| *weight > 0.0);
        let of_free: Vec<f64> = (0..free.len()).filter(|&i| free[i]).map(|i| weights[i]).collect();
        let information = DMatrix::from_diagonal(&DVector::from_vec(of_free));
        is_some.then_some(Self { values, information })
    }

    /// Multiplies the inverse covariance by a factor.
    pub(crate) fn scale(&mut self, factor: f64) {
        self.information *= factor;
    }

    /// Number of parameters with a known value. Each counts as an observation.
    pub(crate) fn count(&self) -> usize {
        self.information.diagonal().iter().filter(|weight| **weight > 0.0).count()
    }

    /// The inverse covariance.
    pub(crate) fn information(&self) -> &DMatrix<f64> {
        &self.information
    }

    /// The deviation of a camera from the earlier values; `free` are the indices of the estimated parameters.
    pub(crate) fn off(&self, camera: &Camera, free: &[usize]) -> DVector<f64> {
        let now = camera.parameters();
        DVector::from_iterator(free.len(), free.iter().map(|&i| now[i] - self.values[i]))
    }

    /// Adds the prior to normal equations whose unit of cost is a residual of `sigma`; returns its cost. `parameters`
    /// lists the index of each unknown parameter of the camera and its column.
    pub(crate) fn add(
        &self,
        camera: &Camera,
        parameters: &[(usize, usize)],
        sigma: f64,
        matrix: &mut DMatrix<f64>,
        right: &mut DVector<f64>,
    ) -> f64 {
        let free: Vec<usize> = parameters.iter().map(|(index, _)| *index).collect();
        let off = self.off(camera, &free);
        let pull = &self.information * &off * (sigma * sigma);
        for (i, &(_, row)) in parameters.iter().enumerate() {
            right[row] -= pull[i];
            for (j, &(_, column)) in parameters.iter().enumerate() {
                matrix[(row, column)] += self.information[(i, j)] * (sigma * sigma);
            }
        }
        off.dot(&pull)
    }
}

/// The inverse of a covariance of parameters with different units.
pub(crate) fn inverted(covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = covariance.nrows();
    let scale = DVector::from_fn(n, |i, _| covariance[(i, i)].sqrt().recip());
    let mut scaled = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] * scale[i] * scale[j]);
    (0..n).for_each(|i| scaled[(i, i)] += RIDGE);
    let inverse = scaled.cholesky()?.inverse();
    let inverse = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
    inverse.iter().all(|v| v.is_finite()).then_some(inverse)
}
