//! Poses in JSON, schema `deltille/robot-poses/1`.

use deltille_calibrate::{RobotPose, RobotPoses, RobotRotation};
use deltille_core::reading::in_words;
use glam::DVec3;
use serde::Deserialize;

use super::Problem;
use super::fields::{Angles, angles, matrix, nanoseconds, quaternion};

/// Schema and version.
const SCHEMA: &str = "deltille/robot-poses/1";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    schema: Option<String>,
    transform: Transform,
    poses: Vec<Record>,
}

#[derive(Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum Transform {
    BaseFromFlange,
    FlangeFromBase,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    #[serde(default)]
    image: Option<String>,
    #[serde(default)]
    time_s: Option<f64>,
    #[serde(default)]
    time_ns: Option<i64>,
    #[serde(default)]
    translation_mm: Option<DVec3>,
    #[serde(default)]
    translation_m: Option<DVec3>,
    #[serde(default)]
    rotation_xyzw: Option<[f64; 4]>,
    #[serde(default)]
    rotation_vector_rad: Option<[f64; 3]>,
    #[serde(default)]
    rotation_vector_deg: Option<[f64; 3]>,
    #[serde(default)]
    roll_pitch_yaw_rad: Option<[f64; 3]>,
    #[serde(default)]
    roll_pitch_yaw_deg: Option<[f64; 3]>,
    #[serde(default)]
    matrix_mm: Option<[[f64; 4]; 4]>,
    #[serde(default)]
    matrix_m: Option<[[f64; 4]; 4]>,
}

/// Reads a list of poses.
pub(super) fn read(text: &str) -> Result<RobotPoses, Problem> {
    let file: File =
        serde_json::from_str(text).map_err(|error| Problem::of_file(in_words(error)))?;
    if let Some(schema) = file.schema.filter(|schema| schema != SCHEMA) {
        return Err(Problem::of_file(format!("this is a {schema} file, not {SCHEMA}")));
    }
    let pose = |(index, record): (usize, Record)| {
        record.pose().map_err(|problem| Problem::of_file(format!("poses[{index}]: {problem}")))
    };
    let poses = file.poses.into_iter().enumerate().map(pose).collect::<Result<_, _>>()?;
    Ok(RobotPoses { poses, are_inverse: file.transform == Transform::FlangeFromBase })
}

impl Record {
    fn pose(self) -> Result<RobotPose, String> {
        let in_matrix = |matrix: Option<[[f64; 4]; 4]>, field: &str, unit_mm: f64| {
            matrix.map(|rows| of_matrix(field, rows, unit_mm)).transpose()
        };
        let whole = [
            in_matrix(self.matrix_mm, "matrix_mm", 1.0)?,
            in_matrix(self.matrix_m, "matrix_m", 1000.0)?,
        ];
        let translations = [
            self.translation_mm,
            self.translation_m.map(|translation| translation * 1000.0),
            whole[0].map(|(translation, _)| translation),
            whole[1].map(|(translation, _)| translation),
        ];
        let by_angles = |values: Option<[f64; 3]>, field: &str, kind: Angles, in_degrees: bool| {
            values.map(|values| angles([field; 3], values, kind, in_degrees)).transpose()
        };
        let by_quaternion = self.rotation_xyzw.map(quaternion).transpose();
        let rotations = [
            by_quaternion.map_err(|problem| format!("rotation_xyzw: {problem}"))?,
            by_angles(self.rotation_vector_rad, "rotation_vector_rad", Angles::Vector, false)?,
            by_angles(self.rotation_vector_deg, "rotation_vector_deg", Angles::Vector, true)?,
            by_angles(self.roll_pitch_yaw_rad, "roll_pitch_yaw_rad", Angles::RollPitchYaw, false)?,
            by_angles(self.roll_pitch_yaw_deg, "roll_pitch_yaw_deg", Angles::RollPitchYaw, true)?,
            whole[0].map(|(_, rotation)| rotation),
            whole[1].map(|(_, rotation)| rotation),
        ];
        let translation_mm = only(translations)
            .ok_or("give one translation: translation_mm, translation_m, matrix_mm or matrix_m")?;
        let rotation = only(rotations).ok_or(
            "give one rotation: rotation_xyzw, rotation_vector_rad, roll_pitch_yaw_deg, matrix_mm or matrix_m",
        )?;
        let time_ns = self.time_ns.or(self.time_s.map(nanoseconds));
        Ok(RobotPose { image: self.image, time_ns, translation_mm, rotation })
    }
}

/// The only value that is given.
fn only<T, const N: usize>(values: [Option<T>; N]) -> Option<T> {
    let mut given = values.into_iter().flatten();
    given.next().filter(|_| given.next().is_none())
}

fn of_matrix(
    field: &str,
    rows: [[f64; 4]; 4],
    unit_mm: f64,
) -> Result<(DVec3, RobotRotation), String> {
    if rows[3] != [0.0, 0.0, 0.0, 1.0] {
        return Err(format!("{field}: the last row is not 0 0 0 1; write the matrix by rows"));
    }
    let rotation = [0, 1, 2].map(|i| [rows[i][0], rows[i][1], rows[i][2]]);
    let rotation = matrix(rotation).map_err(|problem| format!("{field}: {problem}"))?;
    Ok((DVec3::new(rows[0][3], rows[1][3], rows[2][3]) * unit_mm, rotation))
}
