//! Reader of `.tp` board poses, for a `.dsc` that gives each board in its own plane.
//!
//! ```text
//! # a comment line
//! 0                     board id
//! 1 0 0 0               target_from_board: R and t, three lines of a row of R and an entry of t, mm
//! 0 1 0 0
//! 0 0 1 0
//! 1
//! …
//! ```

use deltille_core::quantity::position_mm;
use deltille_core::targets::{PanelPose, Target};
use deltille_core::words::quoted;
use glam::{DMat3, DVec3};

/// Tolerance of the orthonormality of a rotation; files have at least six digits.
const ORTHONORMAL: f64 = 1e-3;

/// Error of using a `.tp`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TpError {
    /// A line is not valid.
    #[error("line {line}: {problem}")]
    Line {
        /// Counted from 1.
        line: usize,
        /// The problem.
        problem: String,
    },
    /// A board without a pose.
    #[error("board {0} of the .dsc has no pose in this file")]
    NoPose(u32),
    /// Two boards in the same position.
    #[error("boards {} and {} have the same position", .0[0], .0[1])]
    Overlap([u32; 2]),
}

/// Reads the poses target_from_board with the ids of their boards.
///
/// # Errors
/// Returns an error if a line is not valid.
pub fn read(text: &str) -> Result<Vec<(u32, PanelPose)>, TpError> {
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let mut found: Vec<(u32, PanelPose)> = Vec::new();
    while let Some((line, id)) = lines.next() {
        let fault = |line: usize, problem: String| TpError::Line { line, problem };
        let id = id.parse::<u32>();
        let id = id.map_err(|_| fault(line, "expected the id of a board".to_owned()))?;
        if found.iter().any(|(other, _)| *other == id) {
            return Err(fault(line, format!("board {id} has two poses")));
        }
        let (mut rows, mut translation_mm) = ([DVec3::ZERO; 3], DVec3::ZERO);
        for row in 0..3 {
            let (at, text) = lines.next().ok_or_else(|| {
                fault(line, format!("expected three lines of board {id} after its id"))
            })?;
            let numbers: Option<Vec<f64>> =
                text.split_whitespace().map(|number| number.parse().ok()).collect();
            let Some(&[a, b, c, t]) = numbers.as_deref() else {
                let problem = format!(
                    "expected four numbers (a row of R and an entry of t), not {}",
                    quoted(text)
                );
                return Err(fault(at, problem));
            };
            rows[row] = DVec3::new(a, b, c);
            translation_mm[row] =
                position_mm::RANGE.check(t).map_err(|what| fault(at, what.to_string()))?;
        }
        let rotation = DMat3::from_cols_array_2d(&rows.map(|row| row.to_array())).transpose();
        let off = rotation * rotation.transpose() - DMat3::IDENTITY;
        let off = off.to_cols_array().into_iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        // Both comparisons are false for NaN.
        if !(off < ORTHONORMAL && rotation.determinant() > 0.0) {
            return Err(fault(line, format!("R of board {id} is not a rotation")));
        }
        let rotation = DMat3::from_quat(glam::DQuat::from_mat3(&rotation).normalize());
        found.push((id, PanelPose::new(rotation, translation_mm)));
    }
    Ok(found)
}

/// Returns a target, read from a `.dsc` that gives each board in its own plane, with its boards at
/// the poses of a text. Poses of other boards are ignored.
///
/// # Errors
/// Returns an error if the text is not valid, lacks a board, or gives two boards the same position.
pub fn placed(target: &Target, text: &str) -> Result<Target, TpError> {
    let poses = read(text)?;
    let of_panel = |panel: &deltille_core::targets::Panel| {
        let pose = poses.iter().find(|(id, _)| *id == panel.id);
        let (_, pose) = pose.ok_or(TpError::NoPose(panel.id))?;
        Ok(PanelPose::from_pose(&pose.to_pose().after(&panel.pose.to_pose()), None))
    };
    let poses = target.panels.iter().map(of_panel).collect::<Result<Vec<_>, _>>()?;
    let target = target.with_poses(&poses);
    match target.overlapping_boards() {
        Some(pair) => Err(TpError::Overlap(pair)),
        None => Ok(target),
    }
}
