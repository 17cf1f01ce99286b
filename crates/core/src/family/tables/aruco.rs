//! The predefined dictionaries of OpenCV's ArUco module, as families of square tags.
//!
//! The tables are in `families/aruco`, extracted from OpenCV by a script in the same folder. The smaller dictionaries
//! of a size are the first codes of the largest. OpenCV's AprilTags are AprilTag's codes rotated by 180°.
//!
//! Limits: DICT_ARUCO_ORIGINAL is omitted, because some of its markers are rotations of others. Untested dictionaries
//! are omitted too.

use crate::family::{Construction, Family, FamilyError, Rules, TagWords};
use crate::lattice::{Dimension, GridKind};

/// A predefined dictionary.
struct Dictionary {
    /// Name in OpenCV.
    name: &'static str,
    /// Number of cells along a side of a marker.
    side: u32,
    /// Number of markers.
    len: usize,
    /// Minimum number of cells in which two markers differ, in any rotation.
    distance: u32,
}

const fn of(name: &'static str, side: u32, len: usize, distance: u32) -> Dictionary {
    Dictionary { name, side, len, distance }
}

const DICTIONARIES: [Dictionary; 19] = [
    of("DICT_4X4_50", 4, 50, 4),
    of("DICT_4X4_100", 4, 100, 3),
    of("DICT_4X4_250", 4, 250, 3),
    of("DICT_4X4_1000", 4, 1000, 2),
    of("DICT_5X5_50", 5, 50, 8),
    of("DICT_5X5_100", 5, 100, 7),
    of("DICT_5X5_250", 5, 250, 6),
    of("DICT_5X5_1000", 5, 1000, 5),
    of("DICT_6X6_50", 6, 50, 13),
    of("DICT_6X6_100", 6, 100, 12),
    of("DICT_6X6_250", 6, 250, 11),
    of("DICT_6X6_1000", 6, 1000, 9),
    of("DICT_7X7_50", 7, 50, 19),
    of("DICT_7X7_100", 7, 100, 18),
    of("DICT_7X7_250", 7, 250, 17),
    of("DICT_7X7_1000", 7, 1000, 14),
    of("DICT_APRILTAG_16h5", 4, 30, 5),
    of("DICT_APRILTAG_25h9", 5, 35, 9),
    of("DICT_APRILTAG_36h11", 6, 587, 11),
];

/// Returns the OpenCV names of the dictionaries.
pub fn dictionary_names() -> impl Iterator<Item = &'static str> {
    DICTIONARIES.iter().map(|dictionary| dictionary.name)
}

/// Finds a dictionary by name, ignoring case, with or without `DICT_`. Returns its name in OpenCV
/// and the dimension of
/// its markers.
pub fn dictionary(name: &str) -> Option<(&'static str, Dimension)> {
    let found = find(name)?;
    Some((found.name, Dimension::from_bits(found.side * found.side).ok()?))
}

fn find(name: &str) -> Option<&'static Dictionary> {
    let short = |name: &str| {
        let upper = name.to_ascii_uppercase();
        upper.strip_prefix("DICT_").map(str::to_owned).unwrap_or(upper)
    };
    DICTIONARIES.iter().find(|dictionary| short(dictionary.name) == short(name))
}

/// Returns the family of a dictionary by name; `None` if there is none of that name. `shipped` returns the file of a
/// shipped family.
pub(in crate::family) fn family(
    name: &str,
    shipped: impl FnOnce(&str) -> Option<&'static str>,
) -> Option<Result<Family, FamilyError>> {
    let dictionary = find(name)?;
    let table = match (dictionary.april_tag(), dictionary.side) {
        (Some(family), _) => shipped(&family)?,
        (None, 4) => include_str!("../../../families/aruco/4x4.txt"),
        (None, 5) => include_str!("../../../families/aruco/5x5.txt"),
        (None, 6) => include_str!("../../../families/aruco/6x6.txt"),
        (None, _) => include_str!("../../../families/aruco/7x7.txt"),
    };
    Some(dictionary.family(table))
}

/// Returns the family of a dictionary from a table in `families/aruco` or, for AprilTags, from the file of their family. A
/// program in a browser fetches these only when it needs them. `None` if there is no dictionary of that name.
#[doc(hidden)]
pub fn dictionary_family(name: &str, table: &str) -> Option<Result<Family, FamilyError>> {
    Some(find(name)?.family(table))
}

impl Dictionary {
    /// Returns the name of the family of AprilTag with these codes, if there is one.
    fn april_tag(&self) -> Option<String> {
        self.name.strip_prefix("DICT_APRILTAG_").map(|bits| format!("aprilTag{bits}"))
    }

    /// Returns the family of the first codes of a table.
    fn family(&self, table: &str) -> Result<Family, FamilyError> {
        let Self { name, side, len, distance } = self;
        let dimension = Dimension::from_bits(side * side)
            .map_err(|error| FamilyError::field("bits", error.to_string()))?;
        let codes = match self.april_tag() {
            Some(_) => {
                let family = Family::from_json(table)?;
                let words = TagWords::of(family.kind(), family.dimension());
                family.codes().iter().map(|&code| words.rotate(words.rotate(code))).collect()
            }
            None => {
                let codes = table.lines().take(*len).map(|code| u64::from_str_radix(code, 16));
                codes
                    .collect::<Result<_, _>>()
                    .map_err(|error| FamilyError::field("codes", error.to_string()))?
            }
        };
        let source = format!("OpenCV, {name}, bits in rows; families/LICENSE-OpenCV.md");
        let construction = Construction::Imported { source };
        Family::of(name, GridKind::Checker, dimension, *distance, codes, Rules::NONE, construction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes the smallest distance between any two words of different markers or rotations, by comparing all.
    fn least_distance(family: &Family) -> u32 {
        let words = TagWords::of(family.kind(), family.dimension());
        let rotations =
            |code: u64| std::iter::successors(Some(code), |&word| Some(words.rotate(word))).take(4);
        let between = |(i, &code): (usize, &u64)| {
            let others = family.codes()[..i].iter().flat_map(|&other| rotations(other));
            let least =
                others.chain(rotations(code).skip(1)).map(|word| (code ^ word).count_ones());
            least.min().unwrap()
        };
        family.codes().iter().enumerate().map(between).min().unwrap()
    }

    #[test]
    fn dictionaries_have_their_stated_distances() {
        for Dictionary { name, len, distance, .. } in &DICTIONARIES {
            let family = Family::shipped(name).unwrap();
            assert_eq!(family.len(), *len, "{name}");
            assert_eq!(family.name(), *name);
            assert_eq!(least_distance(&family), *distance, "{name}");
            assert_eq!(Family::from_json(&family.to_json()).unwrap(), family, "{name}");
        }
    }

    #[test]
    fn names_match_opencv_in_any_case() {
        for name in ["5x5_100", "DICT_5X5_100", "dict_5x5_100"] {
            assert_eq!(dictionary(name).unwrap().0, "DICT_5X5_100");
        }
        for name in ["5x5", "DICT_ARUCO_ORIGINAL", "8x8_50", ""] {
            assert!(dictionary(name).is_none(), "{name}");
        }
    }
}
