//! Messages of ROS as text: PoseStamped, PoseWithCovarianceStamped or TransformStamped, separated by `---`.

use std::collections::BTreeMap;

use deltille_calibrate::{RobotPose, RobotPoses};
use glam::DVec3;

use super::Problem;
use super::fields::{number, quaternion};

/// Reads messages in metres.
pub(super) fn read(text: &str) -> Result<RobotPoses, Problem> {
    let mut poses = Vec::new();
    let mut message = Message::default();
    let lines = (1..).zip(text.lines());
    for (line, text) in lines.chain([(0, "---")]) {
        if text.trim_end() == "---" {
            let whole = std::mem::take(&mut message);
            if !whole.values.is_empty() {
                poses.push(whole.pose()?);
            }
        } else {
            message.add(line, text)?;
        }
    }
    Ok(RobotPoses { poses, are_inverse: false })
}

/// A message.
#[derive(Default)]
struct Message<'a> {
    first_line: usize,
    /// The keys of the current line and their indentation.
    keys: Vec<(usize, &'a str)>,
    /// Values and their lines by their last two keys, such as `position.x`.
    values: BTreeMap<String, (usize, &'a str)>,
}

impl<'a> Message<'a> {
    fn add(&mut self, line: usize, text: &'a str) -> Result<(), Problem> {
        let content = text.trim_start_matches([' ', '-']);
        let Some((key, value)) = content.split_once(':') else { return Ok(()) };
        if content.starts_with('#') {
            return Ok(());
        }
        if self.values.is_empty() && self.keys.is_empty() {
            self.first_line = line;
        }
        let indentation = text.len() - content.len();
        self.keys.retain(|(of, _)| *of < indentation);
        let (key, value) = (key.trim(), value.trim());
        if !value.is_empty() {
            let parent = self.keys.last().map_or("", |(_, key)| key);
            let name = format!("{parent}.{key}");
            let is_part = ["position", "translation"].contains(&parent);
            if self.values.insert(name, (line, value)).is_some() && is_part {
                return Err(Problem::at(
                    line,
                    "a message with several transforms; give only that between base and flange",
                ));
            }
        }
        self.keys.push((indentation, key));
        Ok(())
    }

    fn number(&self, parent: &str, key: &str) -> Result<f64, Problem> {
        let field = format!("{parent}.{key}");
        let missing = || Problem::at(self.first_line, format!("the message has no {field}"));
        let (line, text) = self.values.get(&field).ok_or_else(missing)?;
        number(&field, text).map_err(|problem| Problem::at(*line, problem))
    }

    fn pose(&self) -> Result<RobotPose, Problem> {
        let is_transform = self.values.contains_key("translation.x");
        let [translation, rotation] = match is_transform {
            true => ["translation", "rotation"],
            false => ["position", "orientation"],
        };
        let [x, y, z] = ["x", "y", "z"].map(|key| self.number(translation, key));
        let [qx, qy, qz, qw] = ["x", "y", "z", "w"].map(|key| self.number(rotation, key));
        let stamp = |seconds: &str, parts: &str| -> Option<i64> {
            let value = |key: &str| self.values.get(&format!("stamp.{key}"))?.1.parse::<i64>().ok();
            value(seconds)?.checked_mul(1_000_000_000)?.checked_add(value(parts)?)
        };
        Ok(RobotPose {
            image: None,
            time_ns: stamp("sec", "nanosec").or_else(|| stamp("secs", "nsecs")),
            translation_mm: DVec3::new(x?, y?, z?) * 1000.0,
            rotation: quaternion([qx?, qy?, qz?, qw?]).map_err(|problem| {
                Problem::at(self.first_line, format!("{rotation}: {problem}"))
            })?,
        })
    }
}
