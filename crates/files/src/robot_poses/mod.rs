//! Poses of a robot from their files.
//!
//! Input: the text of a file. Output: [`RobotPoses`], or an error that names file, line and field. The format follows from the
//! content:
//!
//! 1. `table` reads CSV, whose columns name their units, and TUM (`t x y z qx qy qz qw`).
//! 2. `list` reads JSON.
//! 3. `ros` reads messages as `ros2 topic echo` prints them.
//!
//! `fields` checks numbers and rotations for all of them.
//!
//! ```
//! use deltille_files::robot_poses;
//!
//! let text = "image,x_mm,y_mm,z_mm,qx,qy,qz,qw\n1.png,400,0,300,0,1,0,0\n";
//! let robot = robot_poses::parse(text)?;
//! assert_eq!(robot.poses[0].translation_mm.x, 400.0);
//! let error = robot_poses::parse("image,x,y,z,qx,qy,qz,qw\n").unwrap_err();
//! assert_eq!(error.to_string(), "line 1: column x has no unit; name it x_mm or x_m");
//! # Ok::<(), robot_poses::Problem>(())
//! ```

mod fields;
mod list;
mod ros;
mod table;

use std::path::{Path, PathBuf};

use deltille_calibrate::RobotPoses;

use crate::limits::{Limits, ReadError};
use deltille_core::quantity::position_mm;

/// Error of reading poses.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RobotPosesError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file has no valid poses.
    #[error("{}: {problem}", path.display())]
    Poses {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: Problem,
    },
}

/// What is wrong with poses.
#[derive(Debug, PartialEq, thiserror::Error)]
#[error("{}{text}", line.map_or(String::new(), |line| format!("line {line}: ")))]
pub struct Problem {
    /// Number of the line, from 1, if the problem has one.
    pub line: Option<usize>,
    /// The problem, with the name of the field.
    pub text: String,
}

impl Problem {
    fn at(line: usize, text: impl Into<String>) -> Self {
        Self { line: Some(line), text: text.into() }
    }

    fn of_file(text: impl Into<String>) -> Self {
        Self { line: None, text: text.into() }
    }
}

/// Reads the poses in a file.
///
/// # Errors
/// Returns an error if the file cannot be read, or contains no valid poses.
pub fn read(path: &Path, limits: &Limits) -> Result<RobotPoses, RobotPosesError> {
    let text = limits.read_text(path)?;
    parse(&text).map_err(|problem| RobotPosesError::Poses { path: path.to_owned(), problem })
}

/// Reads poses from text.
///
/// # Errors
/// Returns an error if the text contains no valid poses.
pub fn parse(text: &str) -> Result<RobotPoses, Problem> {
    let text = text.trim_start_matches('\u{feff}');
    let is_content = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
    let first = text.lines().find(is_content).unwrap_or_default();
    let found = if first.starts_with(['{', '[']) {
        list::read(text)?
    } else if table::is_tum(first) {
        table::read_tum(text)?
    } else if table::separator(first).is_some() {
        table::read_csv(text)?
    } else if first.contains(':') || first == "---" {
        ros::read(text)?
    } else {
        return Err(Problem::of_file(UNKNOWN));
    };
    if found.poses.is_empty() {
        return Err(Problem::of_file("the file contains no poses"));
    }
    for (index, pose) in found.poses.iter().enumerate() {
        for coordinate in pose.translation_mm.to_array() {
            let wrong = |why| Problem::of_file(format!("translation of pose {}: {why}", index + 1));
            position_mm::RANGE.check(coordinate).map_err(wrong)?;
        }
    }
    Ok(found)
}

const UNKNOWN: &str = "these are not poses of a robot: use CSV with named columns, JSON, TUM (t x y z qx qy qz qw), or messages \
                       of ROS (PoseStamped or TransformStamped)";

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    /// The same pose in every format and notation.
    #[test]
    fn formats_and_notations_agree() {
        let rotation = DQuat::from_rotation_z(0.5)
            * DQuat::from_rotation_y(-0.3)
            * DQuat::from_rotation_x(2.0);
        let [x, y, z, w] = rotation.to_array();
        let vector = rotation.to_scaled_axis();
        let degrees = vector.map(f64::to_degrees);
        let rows = glam::DMat3::from_quat(rotation).transpose().to_cols_array_2d();
        let row = |i: usize| rows[i].map(|v| v.to_string()).join(",");
        let [a, b, c] = [row(0), row(1), row(2)];
        let texts = [
            format!(
                "time_s,x_mm,y_mm,z_mm,qx,qy,qz,qw,joint_1\n1.5,100,-200,300,{x},{y},{z},{w},7\n"
            ),
            format!("# robot\n1.5 0.1 -0.2 0.3 {x} {y} {z} {w}\n"),
            format!(
                "time_ns;x_m;y_m;z_m;rx_rad;ry_rad;rz_rad\n1500000000;0.1;-0.2;0.3;{};{};{}\n",
                vector.x, vector.y, vector.z
            ),
            format!(
                "x_m,y_m,z_m,rx_deg,ry_deg,rz_deg\n0.1,-0.2,0.3,{},{},{}\n",
                degrees.x, degrees.y, degrees.z
            ),
            "x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad\n0.1,-0.2,0.3,2.0,-0.3,0.5\n".to_owned(),
            format!(
                "x_mm,y_mm,z_mm,r11,r12,r13,r21,r22,r23,r31,r32,r33\n100,-200,300,{a},{b},{c}\n"
            ),
            format!(
                "{{\"transform\": \"base_from_flange\", \"poses\": [{{\"time_s\": 1.5, \"matrix_m\": \
                 [[{a},0.1],[{b},-0.2],[{c},0.3],[0,0,0,1]]}}]}}"
            ),
            format!(
                "header:\n  stamp:\n    sec: 1\n    nanosec: 500000000\n  frame_id: base\npose:\n  position:\n    \
                 x: 0.1\n    y: -0.2\n    z: 0.3\n  orientation:\n    x: {x}\n    y: {y}\n    z: {z}\n    w: {w}\n---\n"
            ),
            format!(
                "transforms:\n- header:\n    stamp:\n      sec: 1\n      nanosec: 500000000\n  child_frame_id: tool0\n  \
                 transform:\n    translation:\n      x: 0.1\n      y: -0.2\n      z: 0.3\n    rotation:\n      x: {x}\n      \
                 y: {y}\n      z: {z}\n      w: {w}\n"
            ),
        ];
        for text in texts {
            let found = parse(&text).unwrap_or_else(|problem| panic!("{problem}: {text}"));
            let [pose] = found.poses.as_slice() else { panic!("{text}") };
            assert!(
                pose.translation_mm.distance(DVec3::new(100.0, -200.0, 300.0)) < 1e-9,
                "{text}"
            );
            assert!(pose.rotation.rotation().angle_between(rotation) < 1e-7, "{text}");
            assert!(pose.time_ns.is_none_or(|time| time == 1_500_000_000), "{text}");
        }
    }

    #[test]
    fn ambiguous_and_wrong_files_are_refused() {
        for (text, problem) in [
            (
                "x_mm,y_mm,z_mm,rx,ry,rz\n",
                "line 1: column rx has no unit; name it rx_rad or rx_deg",
            ),
            ("timestamp,x_mm\n", "line 1: column timestamp has no unit; name it time_s or time_ns"),
            (
                "qx,qy,qz,qw,x_mm,y_mm\n",
                "line 1: columns x_mm, y_mm, z_mm (or x_m, y_m, z_m) are missing",
            ),
            (
                "x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0,0,0,0,2\n",
                "line 2: qx, qy, qz, qw: the quaternion has length 2.000, not 1",
            ),
            (
                "x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0,0,0,0\n",
                "line 2: 6 values, but the header has 7 columns",
            ),
            (
                "x_m,y_m,z_m,qx,qy,qz,qw\n\n0,nan,0,0,0,0,1\n",
                "line 3: y_m: \"nan\" is not a number",
            ),
            ("1 2 3 4 0 0 0\n", "line 1: 7 numbers, but TUM has 8: t x y z qx qy qz qw"),
            (
                "header:\n  stamp: 0\npose:\n  position:\n    x: 1\n",
                "line 1: the message has no position.y",
            ),
            (
                "{\"transform\": \"base_from_flange\", \"poses\": [{\"translation_m\": [0, 0, 0]}]}",
                "poses[0]: give one rotation: rotation_xyzw, rotation_vector_rad, roll_pitch_yaw_deg, matrix_mm or matrix_m",
            ),
            ("x_m,y_m,z_m,qx,qy,qz,qw\n", "the file contains no poses"),
        ] {
            assert_eq!(parse(text).unwrap_err().to_string(), problem);
        }
        let angle =
            parse("x_m,y_m,z_m,rx_rad,ry_rad,rz_rad\n0,0,0,90,0,0\n").unwrap_err().to_string();
        assert!(
            angle.starts_with("line 2: rx_rad is 90, more than a full turn in radians"),
            "{angle}"
        );
    }
}
