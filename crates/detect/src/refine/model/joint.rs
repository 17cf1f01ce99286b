//! The equations of a corner together with the parameters that all corners of an image share.

use nalgebra::{SMatrix, SVector};

use super::columns::{ALL, HALO, INK, RISE, SHADE, SHAPE, SKEWNESS, TONE};
use super::corner::{ANGLE, Corner, OWN, PARAMS, SLOPE, X, Y};
use super::fitter::CornerFitter;
use super::sums::products;
use super::window::Patch;
use crate::refine::correlation::Influence;
use crate::refine::optics::{Optics, PARAMS as COMMON_PARAMS, STEP};
use deltille_core::detection::Piece;
use deltille_core::raster::ImageView;

/// A parameter that all corners of an image share.
#[derive(Clone, Debug)]
pub(crate) enum Common {
    /// A parameter of the tone curve, and the optics with it increased by a [`STEP`].
    Tone { parameter: usize, moved: Box<Optics> },
    /// The first or second parameter of astigmatism, or the cross.
    Shape(usize),
    /// The skewness along rows or columns.
    Skewness(usize),
    /// The strength of the halo.
    Halo,
    /// The growth of dark areas on the print.
    Ink,
}

/// Number of parameters of the optics, which follow the corner's own.
pub(crate) const COMMON: usize = COMMON_PARAMS;

/// Number of all parameters.
const UNKNOWNS: usize = OWN + COMMON;

/// The normal equations of a corner and the optics.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    /// JᵀJ with the prior on the slopes, and ones for missing parameters of the corner.
    pub matrix: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    /// Jᵀr, likewise.
    pub gradient: SVector<f64, UNKNOWNS>,
    /// rᵀr.
    pub cost: f64,
    /// Standard deviation of the residuals.
    pub noise: f64,
}

impl CornerFitter {
    /// Returns the normal equations at a corner in image coordinates, from the pixels of a patch. The parameters of the
    /// optics follow the corner's own. Returns `None` outside the image.
    pub(crate) fn joint<const K: usize>(
        &mut self,
        image: ImageView,
        patch: &Patch,
        corner: &Corner<K>,
        optics: &Optics,
        common: &[Common],
    ) -> Option<Joint> {
        let Patch { window, centre } = patch;
        self.load(image, window, *centre)?;
        let corner = Corner { position: corner.position - centre, ..*corner };
        let params = ANGLE + K;
        let toned = |optics: &Optics| optics.piece(corner.level, corner.amplitude);
        let piece = toned(optics);
        self.fill::<K, true>(window, &corner, optics, piece);
        let columns = &mut *self.columns;
        let mut rows = [None; UNKNOWNS];
        (0..params).for_each(|i| rows[i] = Some(i));
        for (row, common) in rows[OWN..].iter_mut().zip(common) {
            *row = Some(match common {
                Common::Tone { parameter, moved } => {
                    let there = toned(moved).terms;
                    let slopes = std::array::from_fn(|j| (there[j] - piece.terms[j]) / STEP as f32);
                    let slopes = Piece { terms: slopes, ratio: 0.0 };
                    let (filled, tones) = columns.split_at_mut(TONE);
                    let shown = filled[RISE].iter().zip(&filled[SHADE]).take(window.count);
                    for (by, (rise, &shade)) in tones[*parameter].iter_mut().zip(shown) {
                        *by = rise * slopes.bulge(shade);
                    }
                    TONE + parameter
                }
                Common::Shape(i) => SHAPE + i,
                Common::Skewness(i) => SKEWNESS + i,
                Common::Halo => HALO,
                Common::Ink => INK,
            });
        }
        let products = products::<ALL>(columns, window.count);
        let product = |i: usize, j: usize| products[i.min(j)][i.max(j)];
        let (mut matrix, mut gradient) = (SMatrix::zeros(), SVector::zeros());
        for (i, row) in rows.into_iter().enumerate() {
            let Some(row) = row else {
                matrix[(i, i)] = 1.0;
                continue;
            };
            gradient[i] = product(row, PARAMS);
            for (j, column) in rows.into_iter().enumerate().take(i + 1) {
                let value = column.map_or(0.0, |column| product(row, column));
                (matrix[(i, j)], matrix[(j, i)]) = (value, value);
            }
        }
        let cost = product(PARAMS, PARAMS);
        let noise = self.noise(cost / (window.count - params) as f64, &corner);
        let weight = self.slope_weight(corner.slope, noise);
        for (i, slope) in corner.slope.to_array().iter().enumerate() {
            matrix[(SLOPE + i, SLOPE + i)] += weight;
            gradient[SLOPE + i] -= weight * slope;
        }
        Some(Joint { matrix, gradient, cost, noise })
    }

    /// Returns the influence of the pixels of a fitted corner on its position, and their residuals. The corner is as
    /// for [`Self::joint`].
    pub(crate) fn influence<const K: usize>(
        &mut self,
        image: ImageView,
        patch: &Patch,
        corner: &Corner<K>,
        optics: &Optics,
    ) -> Option<Influence> {
        let Patch { window, centre } = patch;
        self.load(image, window, *centre)?;
        let corner = Corner { position: corner.position - centre, ..*corner };
        let piece = optics.piece(corner.level, corner.amplitude);
        let normal = self.normal(window, &corner, optics, piece);
        let freedom = (window.count - (ANGLE + K)) as f64;
        let noise = self.noise(normal.cost / freedom, &corner);
        let factor = self.with_prior(&normal, &corner, noise).0.cholesky()?;
        let inverse = factor.inverse();
        let root = factor.l().try_inverse()?;
        let column = |weights: [f32; PARAMS]| -> Vec<f32> {
            let mut sums = vec![0.0; window.count];
            let columns = weights.iter().zip(&self.columns[..ANGLE + K]);
            // Half of the entries of a triangular matrix are zero.
            for (weight, column) in columns.filter(|(weight, _)| **weight != 0.0) {
                sums.iter_mut().zip(column).for_each(|(sum, value)| *sum += weight * value);
            }
            sums
        };
        let row = |matrix: &SMatrix<f64, PARAMS, PARAMS>, i: usize| {
            std::array::from_fn(|p| matrix[(i, p)] as f32)
        };
        let places = window.u.iter().zip(&window.v).take(window.count);
        Some(Influence {
            places: places.map(|(&u, &v)| [u as i32, v as i32]).collect(),
            twice_middle: (2.0 * corner.position).round().as_ivec2().to_array(),
            residuals: self.columns[PARAMS][..window.count].to_vec(),
            on_position: [X, Y].map(|i| column(row(&inverse, i))),
            slopes: [X, Y].map(|i| self.columns[i][..window.count].to_vec()),
            hat: (0..ANGLE + K).map(|i| column(row(&root, i))).collect(),
            noise,
        })
    }
}
