//! Tables of poses: CSV with named columns, and TUM.

use deltille_calibrate::{RobotPose, RobotPoses, RobotRotation};
use glam::DVec3;

use super::Problem;
use super::fields::{Angles, angles, matrix, nanoseconds, number, quaternion};

/// Whether a line is a pose in TUM format.
pub(super) fn is_tum(line: &str) -> bool {
    let mut count = 0;
    line.split_whitespace().all(|value| {
        count += 1;
        value.parse::<f64>().is_ok()
    }) && count > 1
}

/// The separator of the columns of a header.
pub(super) fn separator(line: &str) -> Option<char> {
    [',', ';', '\t'].into_iter().find(|&separator| line.contains(separator))
}

/// Reads lines `t x y z qx qy qz qw` (s, m).
pub(super) fn read_tum(text: &str) -> Result<RobotPoses, Problem> {
    const FIELDS: [&str; 8] = ["t", "x", "y", "z", "qx", "qy", "qz", "qw"];
    let mut poses = Vec::new();
    for (line, text) in lines(text) {
        let values: Vec<&str> = text.split_whitespace().collect();
        if values.len() != FIELDS.len() {
            let problem = format!("{} numbers, but TUM has 8: t x y z qx qy qz qw", values.len());
            return Err(Problem::at(line, problem));
        }
        let values = FIELDS.iter().zip(values).map(|(field, text)| number(field, text));
        let values = values.collect::<Result<Vec<f64>, _>>();
        let values = values.map_err(|problem| Problem::at(line, problem))?;
        poses.push(RobotPose {
            image: None,
            time_ns: Some(nanoseconds(values[0])),
            translation_mm: DVec3::from_slice(&values[1..]) * 1000.0,
            rotation: quaternion([values[4], values[5], values[6], values[7]])
                .map_err(|problem| Problem::at(line, format!("qx qy qz qw: {problem}")))?,
        });
    }
    Ok(RobotPoses { poses, are_inverse: false })
}

/// Lines with their numbers, without comments and empty ones.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = (1..).zip(text.lines());
    lines.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'))
}

/// The rotation columns of a table.
enum Rotation {
    Quaternion([usize; 4]),
    Angles([usize; 3], Angles, bool),
    Matrix([usize; 9]),
}

/// The columns of a table.
struct Columns<'a> {
    names: Vec<&'a str>,
    image: Option<usize>,
    /// The column, and whether its unit is a second.
    time: Option<(usize, bool)>,
    translation: [usize; 3],
    /// Millimetres in the unit of translations.
    unit_mm: f64,
    rotation: Rotation,
}

const MATRIX: [&str; 9] = ["r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33"];

/// The notations of rotations by angles: their columns, the kind, and whether they are in degrees.
const ANGLES: [([&str; 3], Angles, bool); 4] = [
    (["rx_rad", "ry_rad", "rz_rad"], Angles::Vector, false),
    (["rx_deg", "ry_deg", "rz_deg"], Angles::Vector, true),
    (["roll_rad", "pitch_rad", "yaw_rad"], Angles::RollPitchYaw, false),
    (["roll_deg", "pitch_deg", "yaw_deg"], Angles::RollPitchYaw, true),
];

impl<'a> Columns<'a> {
    fn of(header: &'a str, separator: char) -> Result<Self, String> {
        let names: Vec<&str> =
            header.split(separator).map(|name| name.trim().trim_matches('"')).collect();
        let at = |name: &str| names.iter().position(|of| *of == name);
        fn all<const N: usize>(
            at: impl Fn(&str) -> Option<usize>,
            columns: [&str; N],
        ) -> Option<[usize; N]> {
            let found: Vec<usize> = columns.iter().filter_map(|name| at(name)).collect();
            found.try_into().ok()
        }
        if let Some(twice) = (1..names.len()).find(|&i| names[..i].contains(&names[i])) {
            return Err(format!("column {} appears twice", names[twice]));
        }
        for (bare, units) in [
            (&["x", "y", "z"][..], ["mm", "m"]),
            (&["rx", "ry", "rz", "roll", "pitch", "yaw"][..], ["rad", "deg"]),
            (&["time", "t", "timestamp", "stamp"][..], ["s", "ns"]),
        ] {
            if let Some(name) = bare.iter().find(|name| at(name).is_some()) {
                let stem = if units[0] == "s" { "time" } else { name };
                let [one, other] = units;
                return Err(format!(
                    "column {name} has no unit; name it {stem}_{one} or {stem}_{other}"
                ));
            }
        }
        let metres = [("mm", 1.0), ("m", 1000.0)].map(|(unit, unit_mm)| {
            let columns = ["x", "y", "z"].map(|axis| at(&format!("{axis}_{unit}")));
            let [x, y, z] = columns;
            Some(([x?, y?, z?], unit_mm))
        });
        let (translation, unit_mm) = match metres {
            [Some(found), None] | [None, Some(found)] => found,
            [Some(_), Some(_)] => {
                return Err("translations are in both x_mm and x_m; keep one".to_owned());
            }
            [None, None] => {
                return Err("columns x_mm, y_mm, z_mm (or x_m, y_m, z_m) are missing".to_owned());
            }
        };
        let quaternion = all(at, ["qx", "qy", "qz", "qw"]).map(Rotation::Quaternion);
        let by_angles = ANGLES.into_iter().filter_map(|(columns, kind, in_degrees)| {
            Some(Rotation::Angles(all(at, columns)?, kind, in_degrees))
        });
        let matrix = all(at, MATRIX).map(Rotation::Matrix);
        let mut rotations: Vec<Rotation> =
            quaternion.into_iter().chain(by_angles).chain(matrix).collect();
        let rotation = match (rotations.pop(), rotations.is_empty()) {
            (Some(rotation), true) => rotation,
            (Some(_), false) => {
                return Err("rotations are given in several notations; keep one".to_owned());
            }
            (None, _) => {
                return Err("no complete rotation: give qx, qy, qz, qw; or rx_rad, ry_rad, rz_rad (a rotation vector, \
                            or _deg); or roll_deg, pitch_deg, yaw_deg (or _rad); or r11 to r33"
                    .to_owned());
            }
        };
        let seconds = at("time_s").map(|column| (column, true));
        let time = seconds.or(at("time_ns").map(|column| (column, false)));
        Ok(Self { image: at("image"), time, translation, unit_mm, rotation, names })
    }

    fn pose(&self, values: &[&str]) -> Result<RobotPose, String> {
        let value = |column: usize| number(self.names[column], values[column]);
        let three = |[a, b, c]: [usize; 3]| Ok::<_, String>([value(a)?, value(b)?, value(c)?]);
        let image = self.image.map(|column| values[column].trim().trim_matches('"').to_owned());
        if image.as_ref().is_some_and(String::is_empty) {
            return Err("image is empty".to_owned());
        }
        let time_ns = match self.time {
            None => None,
            Some((column, true)) => Some(nanoseconds(value(column)?)),
            Some((column, false)) => Some(
                values[column]
                    .trim()
                    .parse::<i64>()
                    .map_err(|_| format!("time_ns: {:?} is not a whole number", values[column]))?,
            ),
        };
        let rotation: RobotRotation = match self.rotation {
            Rotation::Quaternion([x, y, z, w]) => {
                quaternion([value(x)?, value(y)?, value(z)?, value(w)?])
                    .map_err(|problem| format!("qx, qy, qz, qw: {problem}"))?
            }
            Rotation::Angles(columns, kind, in_degrees) => {
                angles(columns.map(|column| self.names[column]), three(columns)?, kind, in_degrees)?
            }
            Rotation::Matrix([a, b, c, d, e, f, g, h, i]) => {
                matrix([three([a, b, c])?, three([d, e, f])?, three([g, h, i])?])
                    .map_err(|problem| format!("r11 to r33: {problem}"))?
            }
        };
        let translation_mm = DVec3::from(three(self.translation)?) * self.unit_mm;
        Ok(RobotPose { image, time_ns, translation_mm, rotation })
    }
}

/// Reads a table with a header.
pub(super) fn read_csv(text: &str) -> Result<RobotPoses, Problem> {
    let mut lines = lines(text);
    let Some((line, header)) = lines.next() else { return Ok(RobotPoses::default()) };
    let separator = separator(header).unwrap_or(',');
    let columns = Columns::of(header, separator).map_err(|problem| Problem::at(line, problem))?;
    let pose = |(line, text): (usize, &str)| {
        let values: Vec<&str> = text.split(separator).collect();
        if values.len() != columns.names.len() {
            let (found, needed) = (values.len(), columns.names.len());
            return Err(Problem::at(
                line,
                format!("{found} values, but the header has {needed} columns"),
            ));
        }
        columns.pose(&values).map_err(|problem| Problem::at(line, problem))
    };
    Ok(RobotPoses { poses: lines.map(pose).collect::<Result<_, _>>()?, are_inverse: false })
}
