//! Numbers and rotations of poses, checked.

use std::f64::consts::TAU;

use deltille_calibrate::RobotRotation;
use glam::{DMat3, DQuat, DVec3};

/// Largest deviation of a quaternion from length 1, and of a matrix from a rotation: numbers with two or three decimals are
/// accepted, and normalised.
const ROUNDING: f64 = 0.01;

/// Nanoseconds of seconds.
pub(super) fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// A number of a field.
pub(super) fn number(field: &str, text: &str) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    value.ok_or_else(|| format!("{field}: {:?} is not a number", text.trim()))
}

/// A quaternion.
pub(super) fn quaternion(xyzw: [f64; 4]) -> Result<RobotRotation, String> {
    let rotation = DQuat::from_array(xyzw);
    let length = rotation.length();
    match (length - 1.0).abs() <= ROUNDING {
        true => Ok(RobotRotation::Quaternion(rotation)),
        false => Err(format!("the quaternion has length {length:.3}, not 1")),
    }
}

/// A rotation matrix by rows.
pub(super) fn matrix(rows: [[f64; 3]; 3]) -> Result<RobotRotation, String> {
    let matrix = DMat3::from_cols_array_2d(&rows).transpose();
    let off = matrix * matrix.transpose() - DMat3::IDENTITY;
    let off = off.to_cols_array().into_iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    match off <= ROUNDING && matrix.determinant() > 0.0 {
        true => Ok(RobotRotation::Matrix(matrix)),
        false => Err("the matrix is not a rotation".to_owned()),
    }
}

/// How angles are given.
#[derive(Clone, Copy)]
pub(super) enum Angles {
    Vector,
    RollPitchYaw,
}

/// Angles of these fields.
pub(super) fn angles(
    fields: [&str; 3],
    values: [f64; 3],
    kind: Angles,
    in_degrees: bool,
) -> Result<RobotRotation, String> {
    if !in_degrees && let Some(i) = (0..3).find(|&i| values[i].abs() > TAU) {
        let (field, value) = (fields[i], values[i]);
        return Err(format!(
            "{field} is {value}, more than a full turn in radians; name it _deg if it is in degrees"
        ));
    }
    let values = DVec3::from(values);
    let values = if in_degrees { values.map(f64::to_radians) } else { values };
    Ok(match kind {
        Angles::Vector => RobotRotation::Vector(values),
        Angles::RollPitchYaw => RobotRotation::RollPitchYaw(values),
    })
}
