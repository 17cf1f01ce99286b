//! Significance of groups of parameters.

use nalgebra::{DMatrix, DVector};

use super::optics::{CROSS, HALO, INK, PARAMS, SKEWNESS};
use deltille_core::detection::TONE_PARAMS;

/// Groups of parameters that are used together.
const GROUPS: [&[usize]; 6] =
    [&[0, 1, 2], &[3, 4], &[CROSS], &[SKEWNESS, SKEWNESS + 1], &[HALO], &[INK]];

/// χ² thresholds of three, two and one degrees of freedom: a group is used if noise exceeds its threshold with a
/// probability below 1 : 1000. Astigmatism is used from 1 : 10, because every image is blurred
/// slightly more in one direction. At a grazing angle, this resembles a tone curve.
const CHI2: [f64; 6] = [16.3, 4.6, 10.8, 13.8, 10.8, 10.8];

/// Threshold of one degree of freedom, 1 : 1000.
const CHI2_OF_ONE: f64 = 10.8;

/// Effect, as a fraction of the noise, above which a curve that displaces no corner is used.
const NOTICED: f64 = 0.05;

/// Blur below which the profile of an edge is mostly the box of a pixel, which the model approximates. The error of the
/// approximation resembles the part of a curve that is not κ₀, and would move edges along rows and columns by up to 0.07 px.
const SHARPEST_PX: f64 = 0.35;

/// Values of all parameters, with the information about the active ones.
pub(super) struct Estimate {
    pub(super) vector: [f64; PARAMS],
    pub(super) active: Vec<usize>,
    /// The inverse of their covariance.
    pub(super) information: DMatrix<f64>,
    /// Derivatives of κ₀ with respect to the parameters of the curve.
    pub(super) kappa_slopes: [f64; TONE_PARAMS],
    /// Number of pixels in the windows of the corners, and their median blur, px.
    pub(super) pixels: usize,
    pub(super) blur_px: f64,
}

impl Estimate {
    pub(super) fn values(&self) -> DVector<f64> {
        DVector::from_iterator(self.active.len(), self.active.iter().map(|&p| self.vector[p]))
    }

    /// Returns the estimate without the groups whose evidence is below this fraction of the
    /// threshold. They are removed one by one, the weakest first, because one group may explain
    /// another.
    pub(super) fn supported(mut self, part: f64) -> Self {
        loop {
            let present =
                GROUPS.iter().zip(CHI2).filter(|(group, _)| self.active.contains(&group[0]));
            let present = present.map(|(group, limit)| (self.evidence(group) / limit, group));
            match present.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((ratio, group)) if ratio <= part => self = self.without(group),
                _ => return self,
            }
        }
    }

    /// Returns the evidence against a group being zero, in squared standard deviations.
    ///
    /// The part of a curve other than κ₀ displaces no corner. It occurs in every image whose blur
    /// differs a little from the model. It counts if it is more than a twentieth of the noise, and the image is not as sharp
    /// as its pixels.
    fn evidence(&self, group: &[usize]) -> f64 {
        let places = |inside: bool| -> Vec<usize> {
            let all = 0..self.active.len();
            all.filter(|&i| group.contains(&self.active[i]) == inside).collect()
        };
        let (own, others) = (places(true), places(false));
        let between = |a: &[usize], b: &[usize]| self.information.select_rows(a).select_columns(b);
        let value = self.values().select_rows(&own);
        let shared = match between(&others, &others).cholesky() {
            _ if others.is_empty() => DMatrix::zeros(own.len(), own.len()),
            Some(factor) => between(&own, &others) * factor.solve(&between(&others, &own)),
            None => return 0.0,
        };
        let information = between(&own, &own) - shared;
        let chi2 = value.dot(&(&information * &value));
        if group[0] != 0 {
            return chi2;
        }
        let slopes = DVector::from_column_slice(&self.kappa_slopes);
        let Some(factor) = information.cholesky() else { return 0.0 };
        let of_kappa = slopes.dot(&value).powi(2) / slopes.dot(&factor.solve(&slopes));
        let of_noise = chi2 / (NOTICED * self.pixels as f64);
        let of_noise = if self.blur_px < SHARPEST_PX { 0.0 } else { of_noise };
        CHI2[0] * (of_kappa / CHI2_OF_ONE).max(of_noise)
    }

    /// Returns the most likely values of these parameters if those of all other groups are zero.
    pub(super) fn only(self, active: &[usize]) -> Self {
        let others = GROUPS.iter().filter(|group| !active.contains(&group[0]));
        let present = |all: &Self, group: &[usize]| all.active.contains(&group[0]);
        others.fold(
            self,
            |rest, group| if present(&rest, group) { rest.without(group) } else { rest },
        )
    }

    /// Returns the most likely values of the other parameters if a group is zero.
    fn without(&self, group: &[usize]) -> Self {
        let kept: Vec<usize> =
            (0..self.active.len()).filter(|&i| !group.contains(&self.active[i])).collect();
        let right = (&self.information * self.values()).select_rows(&kept);
        let information = self.information.select_rows(&kept).select_columns(&kept);
        let values = match information.clone().cholesky() {
            Some(factor) => factor.solve(&right),
            None => DVector::zeros(kept.len()),
        };
        let active: Vec<usize> = kept.iter().map(|&i| self.active[i]).collect();
        let mut vector = self.vector;
        group.iter().for_each(|&p| vector[p] = 0.0);
        active.iter().zip(&values).for_each(|(&p, value)| vector[p] = *value);
        Self { vector, active, information, ..*self }
    }
}
