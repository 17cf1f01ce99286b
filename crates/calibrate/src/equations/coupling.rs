//! The coupling B between the kept unknowns and the eliminated parts.
//!
//! If corners are eliminated, B has a block for each frame and corner, and for large targets takes most of the memory.
//! A corner at x in the scene moves with the pose of a frame as y = exp(ω) R x + t + τ. With the derivatives j of
//! residuals with respect to y, and k with respect to the offset of the corner, the block is
//!
//! ```text
//!     ⎡ R (x × T) ⎤                         rows of ω
//!     ⎣ R    T    ⎦ ,   T = Rᵀ Σ j kᵀ       rows of τ
//! ```
//!
//! Only T is stored. Products with a vector use it directly; for products with matrices, some columns of B at a time are
//! formed.

use std::ops::Range;

use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector};

use super::layout::Layout;
use crate::problem::bundle::Problem;
use deltille_core::camera::Pose;

/// The coupling between kept unknowns (rows) and parts, one after the other (columns).
#[derive(Clone, Debug, Default)]
pub(super) struct Coupling {
    /// The rows of all kept unknowns except those in `moved`.
    pub rows: DMatrix<f64>,
    /// Number of columns of a part.
    size: usize,
    /// The last rows, if they are those of frames.
    pub moved: Option<Moved>,
}

/// The coupling of frames with corners.
#[derive(Clone, Debug)]
pub(super) struct Moved {
    /// T, for each corner one for each frame. A column belongs to a coordinate of the corner.
    products: Vec<DMat3>,
    /// R of each frame.
    frames: Vec<DMat3>,
    /// x of each corner, mm.
    corners: Vec<DVec3>,
}

impl Coupling {
    /// The coupling with a number of parts that have `size` unknowns each; zero so far.
    pub(super) fn of(problem: &Problem, layout: &Layout, size: usize, count: usize) -> Self {
        let moved = layout.frames.map(|_| Moved::of(problem, count));
        let rows = if moved.is_some() { layout.shared } else { layout.count };
        Self { rows: DMatrix::zeros(rows, size * count), size, moved }
    }

    /// The columns of some parts.
    pub(super) fn between(&self, parts: Range<usize>) -> DMatrix<f64> {
        let rows = self.rows.columns(self.size * parts.start, self.size * parts.len());
        let Some(moved) = &self.moved else { return rows.into_owned() };
        let (shared, frames) = (rows.nrows(), moved.frames.len());
        let mut between = DMatrix::zeros(shared + 6 * frames, rows.ncols());
        between.rows_mut(0, shared).copy_from(&rows);
        for (index, corner) in parts.enumerate() {
            for k in 0..3 {
                let mut column = between.column_mut(3 * index + k);
                let of_frames = column.as_mut_slice()[shared..].chunks_exact_mut(6);
                let products = moved.frames.iter().zip(moved.products_of(corner));
                for (own, (frame, product)) in of_frames.zip(products) {
                    let by_turn = moved.corners[corner].cross(product.col(k));
                    own[..3].copy_from_slice(&(*frame * by_turn).to_array());
                    own[3..].copy_from_slice(&(*frame * product.col(k)).to_array());
                }
            }
        }
        between
    }

    /// B v of some parts.
    pub(super) fn times(&self, parts: Range<usize>, vector: &DVector<f64>) -> DVector<f64> {
        let rows = self.rows.columns(self.size * parts.start, self.size * parts.len());
        let product = rows * vector;
        let Some(moved) = &self.moved else { return product };
        let mut of_frames = vec![[DVec3::ZERO; 2]; moved.frames.len()];
        for (corner, offset) in parts.zip(vector.as_slice().chunks_exact(3)) {
            let (at, offset) = (moved.corners[corner], DVec3::from_slice(offset));
            for ([turn, shift], product) in of_frames.iter_mut().zip(moved.products_of(corner)) {
                let product = *product * offset;
                *turn += at.cross(product);
                *shift += product;
            }
        }
        let of_frames = of_frames
            .iter()
            .zip(&moved.frames)
            .flat_map(|(of, frame)| of.iter().flat_map(|&part| (*frame * part).to_array()));
        let all = product.iter().copied().chain(of_frames).collect();
        DVector::from_vec(all)
    }

    /// Bᵀ v of some parts.
    pub(super) fn tr_times(&self, parts: Range<usize>, vector: &DVector<f64>) -> DVector<f64> {
        let rows = self.rows.columns(self.size * parts.start, self.size * parts.len());
        let mut product = rows.tr_mul(&vector.rows(0, rows.nrows()));
        let Some(moved) = &self.moved else { return product };
        let of_frames = vector.as_slice()[rows.nrows()..].chunks_exact(6).zip(&moved.frames);
        let of_frames: Vec<[DVec3; 2]> = of_frames
            .map(|(of, frame)| {
                [&of[..3], &of[3..]].map(|part| frame.transpose() * DVec3::from_slice(part))
            })
            .collect();
        for (corner, own) in parts.zip(product.as_mut_slice().chunks_exact_mut(3)) {
            let at = moved.corners[corner];
            let of_frames = of_frames.iter().zip(moved.products_of(corner));
            let sum: DVec3 = of_frames
                .map(|(&[turn, shift], product)| product.transpose() * (shift + turn.cross(at)))
                .sum();
            own.iter_mut().zip(sum.to_array()).for_each(|(own, sum)| *own += sum);
        }
        product
    }
}

impl Moved {
    /// T of a corner for each frame.
    fn products_of(&self, corner: usize) -> &[DMat3] {
        &self.products[self.frames.len() * corner..][..self.frames.len()]
    }

    fn of(problem: &Problem, count: usize) -> Self {
        let rotation = |frame: &Pose| DMat3::from_quat(frame.rotation);
        let frames: Vec<DMat3> = problem.frames.iter().map(rotation).collect();
        let corners = problem.scene_points();
        Self { products: vec![DMat3::ZERO; count * frames.len()], frames, corners }
    }

    /// Adds to T of a frame and a corner.
    pub(super) fn add(&mut self, frame: usize, corner: usize, [x, y, z]: [[f64; 3]; 3]) {
        let product = DMat3::from_cols(x.into(), y.into(), z.into()).transpose();
        let scene_from_frame = self.frames[frame].transpose();
        self.products[self.frames.len() * corner + frame] += scene_from_frame * product;
    }
}
