//! The effect of errors of the board on the shared unknowns.
//!
//! A corner that is off its planned position is off in every frame. It biases the estimate, and the scatter between
//! frames does not show that. With R the normal equations between the shared unknowns and the corner offsets b, after
//! elimination of the poses of the frames,
//!
//! ```text
//!     δs = S⁻¹ R b,    covariance S⁻¹ R Σ_b Rᵀ S⁻¹
//! ```
//!
//! Σ_b has two parts of equal size: offsets of single corners, and a stretch, shear, scale and bend of the sheet of
//! each panel as a whole.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::equations::block::Local;
use crate::equations::covariances::Covariances;
use crate::equations::frame::OfFrame;
use crate::equations::minimise::Minimum;
use crate::input::loss::Loss;
use crate::problem::corner_map::CornerMap;
use crate::problem::whitening::Whitening;

/// Standard deviation of a corner of a printed board, mm. Office printers stretch a sheet by 0.05 to 0.2 %, by
/// different amounts across and along the feed: 0.05 to 0.2 mm at 100 mm from the centre. The
/// corners of the sheet in the robot-hand data set (20 mm edges, 200 mm across) are off by 0.07 mm
/// per axis.
const PRINTED_MM: f64 = 0.1;

/// Upper limit of the same standard deviation in edges, for small boards, which are not made on
/// office printers.
const PRINTED_EDGES: f64 = 0.005;

/// Number of frames whose equations are in memory at the same time.
const FRAMES_AT_A_TIME: usize = 64;

/// The covariance of the shared unknowns from errors of the board; `accuracy_mm` is the standard deviation of a corner
/// per axis, or `None` for a printed board. Returns `None` if the corners are unknowns themselves,
/// or exact.
pub(crate) fn board_errors(
    minimum: &Minimum,
    whitening: &Whitening,
    loss: Loss,
    found: &Covariances,
    accuracy_mm: Option<f64>,
) -> Option<DMatrix<f64>> {
    let Minimum { problem, layout, .. } = minimum;
    if problem.map.is_some() || layout.shared == 0 {
        return None;
    }
    let map = CornerMap::flat(&problem.blocks);
    let accuracy_mm = accuracy(&map, accuracy_mm)?;
    let mut problem = problem.clone();
    let sheets = sheets(&map, &SHEET);
    let mut across = DMatrix::zeros(layout.shared, 3 * map.len());
    problem.map = Some(map);
    let of_frame = |frame: usize| {
        let blocks = problem.blocks.iter().zip(&whitening.blocks);
        let blocks = blocks.filter(|(block, _)| block.frame == frame);
        let locals = blocks.map(|(block, weights)| {
            Local::of(&problem, layout, block, weights, loss, whitening.sigma)
        });
        OfFrame::of(locals.collect::<Option<Vec<Local>>>()?, layout.shared)
    };
    let frames: Vec<usize> = (0..problem.frames.len()).collect();
    for some in frames.chunks(FRAMES_AT_A_TIME) {
        let some: Vec<_> = some.par_iter().map(|&frame| of_frame(frame)).collect();
        for frame in some {
            frame?.add_across(&mut across);
        }
    }
    let change = &found.shared * across;
    let by_sheets = &change * sheets;
    let covariance = &change * change.transpose() + &by_sheets * by_sheets.transpose();
    Some(covariance * accuracy_mm.powi(2))
}

/// Standard deviation of a corner per axis, mm; `None` for an exact board.
pub(crate) fn accuracy(map: &CornerMap, given_mm: Option<f64>) -> Option<f64> {
    let printed = || PRINTED_MM.min(PRINTED_EDGES * map.edge_mm());
    Some(given_mm.unwrap_or_else(printed)).filter(|mm| *mm > 0.0)
}

/// Errors of the shared unknowns and the offsets of corners, in this order, if the corners are estimated too: columns
/// whose outer products sum to the covariance.
///
/// The prior of the offsets is white. If the views do not determine a sheet that is distorted as a
/// whole, the prior pulls it towards its plan by X a = H⁻¹ P M a. P is the part of the prior in the
/// normal equations H. The columns of M are modes in which a sheet differs from its plan, each with
/// the size of one standard deviation of a printed sheet. The vector a contains the amount of each
/// mode. With many views this bias is negligible; with four views it is most of the error. From the
/// estimated offsets b, the views determine a as
///
/// ```text
///     C = (1 + Mᵀ P M − Mᵀ P X)⁻¹,    mean C Mᵀ P b
/// ```
///
/// so a board that is found to be exact is not treated as a printed sheet.
pub(crate) fn drawn_to_plan(
    minimum: &Minimum,
    whitening: &Whitening,
    found: &Covariances,
    accuracy_mm: Option<f64>,
) -> Option<DMatrix<f64>> {
    let Minimum { problem, normal, layout, .. } = minimum;
    let map = problem.map.as_ref()?;
    let accuracy_mm = accuracy(map, accuracy_mm)?;
    // Scale is not measured, because distances absorb it.
    let sheets = sheets(map, &SHEET[1..]);
    // P M; the normal equations contain it times the square of sigma.
    let pulls = DMatrix::from_fn(sheets.nrows(), sheets.ncols(), |i, mode| {
        accuracy_mm * map.prior_mm[i % 3].powi(-2) * sheets[(i, mode)]
    });
    if pulls.ncols() == 0 {
        return None;
    }
    let mut right = DMatrix::zeros(layout.shared + pulls.nrows(), pulls.ncols());
    right.rows_mut(layout.shared, pulls.nrows()).copy_from(&(&pulls * whitening.sigma.powi(2)));
    let off = normal.solve_without_frames(layout, found, &right)?;
    let of_corners = off.rows(layout.shared, sheets.nrows());
    let said = pulls.tr_mul(&(&sheets * accuracy_mm - of_corners));
    let precision = DMatrix::identity(off.ncols(), off.ncols()) + (&said + said.transpose()) * 0.5;
    let covariance = precision.cholesky()?.inverse();
    let offsets = map.offsets_mm.iter().flat_map(|offset| offset.to_array());
    let found = DVector::from_iterator(sheets.nrows(), offsets);
    let mean = &covariance * pulls.tr_mul(&found);
    let root = (covariance + &mean * mean.transpose()).cholesky()?.l();
    Some(off * root)
}

/// Displacements of a sheet as a function of the position relative to its centre: scaled,
/// stretched, sheared, and bent.
pub(crate) const SHEET: [fn(DVec3) -> DVec3; 6] = [
    |at| DVec3::new(at.x, at.y, 0.0),
    |at| DVec3::new(at.x, -at.y, 0.0),
    |at| DVec3::new(at.y, at.x, 0.0),
    |at| DVec3::new(0.0, 0.0, at.x * at.x),
    |at| DVec3::new(0.0, 0.0, at.x * at.y),
    |at| DVec3::new(0.0, 0.0, at.y * at.y),
];

/// Offsets of all corners, one column for each mode in which the sheet of a panel differs from its
/// plan. The modes in the plane together have a mean square of 1 per axis; so do those out of the
/// plane.
pub(crate) fn sheets(map: &CornerMap, fields: &[fn(DVec3) -> DVec3]) -> DMatrix<f64> {
    let mut columns = Vec::new();
    let mut first = 0;
    // Corners are ordered by panel.
    for of_panel in map.corners.chunk_by(|a, b| a.panel == b.panel) {
        let count = of_panel.len() as f64;
        let middle = of_panel.iter().map(|corner| corner.panel_mm).sum::<DVec3>() / count;
        for field in fields {
            let moved = of_panel.iter().map(|corner| field(corner.panel_mm - middle));
            let mut moved: Vec<DVec3> = moved.collect();
            // A translation of the whole sheet is not an error.
            let mean = moved.iter().sum::<DVec3>() / count;
            moved.iter_mut().for_each(|offset| *offset -= mean);
            let squares: DVec3 = moved.iter().map(|offset| *offset * *offset).sum();
            let coordinates = if squares.z > 0.0 { count } else { 2.0 * count };
            let size = (3.0 * squares.element_sum() / coordinates).sqrt();
            if size > 0.0 {
                let mut column = DVector::zeros(3 * map.len());
                let values = moved.iter().flat_map(|offset| (*offset / size).to_array());
                values.enumerate().for_each(|(i, value)| column[3 * first + i] = value);
                columns.push(column);
            }
        }
        first += of_panel.len();
    }
    match columns.is_empty() {
        true => DMatrix::zeros(3 * map.len(), 0),
        false => DMatrix::from_columns(&columns),
    }
}
