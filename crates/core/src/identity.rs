//! The identity of a target, which results use to name it.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::words::counted;
use crate::{Name, quantity};

/// The fingerprint of a target: 64 bits of a SHA-256 hash, written as 16 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Fingerprint(u64);

impl Fingerprint {
    /// Returns the first eight digits, as printed on sheets.
    pub fn short(self) -> String {
        format!("{:08x}", self.0 >> 32)
    }

    /// Creates a fingerprint from its bits.
    pub fn from_bits(bits: u64) -> Self {
        Self(bits)
    }
}

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl FromStr for Fingerprint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_hex = text.len() == 16
            && text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
        match u64::from_str_radix(text, 16) {
            Ok(bits) if is_hex => Ok(Self(bits)),
            _ => Err("a fingerprint has 16 hexadecimal digits".to_owned()),
        }
    }
}

impl TryFrom<String> for Fingerprint {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Fingerprint> for String {
    fn from(fingerprint: Fingerprint) -> Self {
        fingerprint.to_string()
    }
}

/// Identifies a target in results, so that results of different targets cannot be mixed up unnoticed.
///
/// Two targets with the same tags in the same tiles have the same [`labels`](Self::labels). The
/// [`fingerprint`](Self::fingerprint) is the same only if the corners also have the same positions. The name and the
/// sizes are for messages, which show the first half of the fingerprint, as sheets do.
///
/// ```
/// use deltille_core::targets::{BoardSpec, Target};
///
/// let [small, large] = [20.0, 25.0].map(|edge_mm| BoardSpec::deltille(10, 11, edge_mm));
/// let [small, large] = [Target::new("desk", small)?, Target::new("desk", large)?];
/// let [small, large] = [small.identity(), large.identity()];
/// assert_eq!(small.labels, large.labels);
/// assert_ne!(small.fingerprint, large.fingerprint);
/// assert_eq!(small.to_string(), format!("desk ({}, 110 corners, edges of 20 mm)", small.fingerprint.short()));
/// # Ok::<(), deltille_core::targets::TargetError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetIdentity {
    /// Name of the target.
    pub name: Name,
    /// Hash of panel ids, tilings, corners (mm, in the target frame) and tags.
    pub fingerprint: Fingerprint,
    /// Fingerprint of the target as printed, if this one has measured corners or refined panels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<Fingerprint>,
    /// Hash of panel ids, tilings, rows and columns of corners, and tags: everything that detection can distinguish.
    pub labels: Fingerprint,
    /// Number of panels.
    pub panels: u32,
    /// Number of corners.
    pub corners: u32,
    /// Shortest and longest edge of a tile, mm.
    #[serde(deserialize_with = "quantity::edge_mm::de")]
    pub edge_mm: [f64; 2],
}

impl TargetIdentity {
    /// Returns the fingerprint of the target as printed.
    pub fn of_print(&self) -> Fingerprint {
        self.plan.unwrap_or(self.fingerprint)
    }

    /// Returns whether both are the same print, regardless of later measurements of it.
    pub fn is_same_print(&self, other: &Self) -> bool {
        self.of_print() == other.of_print()
    }

    /// Returns whether both targets have the same labels although their corners were printed at different positions.
    pub fn is_confusable(&self, other: &Self) -> bool {
        self.labels == other.labels && !self.is_same_print(other)
    }
}

/// Checks that results of two targets can be used together. They cannot if the tags are the same and the corner
/// positions differ: then one of the descriptions is wrong for the board.
///
/// # Errors
/// Returns an error that names both results and their targets. `first` and `second` name the results, for example
/// `the camera`. The caller adds the advice.
pub fn check_same_board(
    [first, second]: [&str; 2],
    [of_first, of_second]: [&[TargetIdentity]; 2],
) -> Result<(), String> {
    let mut pairs = of_first.iter().flat_map(|one| of_second.iter().map(move |other| (one, other)));
    match pairs.find(|(one, other)| one.is_confusable(other)) {
        Some((one, other)) => Err(format!(
            "{first} was made with {one}, {second} with {other}: rows, columns and tags match, but the corner positions differ, so at least one description does not match the photographed board"
        )),
        None => Ok(()),
    }
}

/// Checks that a result was made with one of the given targets. A result that names no target passes.
///
/// # Errors
/// Returns an error that names the target of the result and the given one.
pub fn check_result_of(
    of_result: &[TargetIdentity],
    given: &[TargetIdentity],
) -> Result<(), String> {
    let is_given = |one: &TargetIdentity| given.iter().any(|other| one.is_same_print(other));
    match (of_result.first(), given.first()) {
        (Some(one), Some(other)) if !of_result.iter().any(is_given) => Err(format!(
            "it was calibrated with {one}, but the given target is {other}: pass the target it was calibrated with"
        )),
        _ => Ok(()),
    }
}

/// Writes the name, the first half of the fingerprint and the size, for example `desk (84457e08, 110 corners, edges
/// of 20 mm)`.
impl fmt::Display for TargetIdentity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let corners = counted(self.corners as usize, "corner");
        write!(f, "{} ({}, {corners}", self.name, self.fingerprint.short())?;
        if self.panels > 1 {
            write!(f, " on {}", counted(self.panels as usize, "panel"))?;
        }
        let [least, most] = self.edge_mm.map(short);
        match least == most {
            true => write!(f, ", edges of {least} mm)"),
            false => write!(f, ", edges of {least} to {most} mm)"),
        }
    }
}

/// Formats a length to 0.0001 mm, the precision of a fingerprint, without trailing zeros.
fn short(mm: f64) -> String {
    let text = format!("{mm:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fingerprints_are_sixteen_lowercase_digits() {
        let fingerprint = Fingerprint::from_bits(0x0123_4567_89ab_cdef);
        assert_eq!(fingerprint.to_string().parse(), Ok(fingerprint));
        assert_eq!(fingerprint.short(), "01234567");
        for wrong in
            ["", "0123456789abcde", "0123456789ABCDEF", "+123456789abcdef", "0123456789abcdeg"]
        {
            assert!(wrong.parse::<Fingerprint>().is_err(), "{wrong}");
        }
    }
}
