//! Numbers in files: each belongs to a quantity and lies within its range.
//!
//! Being finite is not enough: 1e308 mm overflows when squared, and a variance of 1e-308 px² when inverted. The
//! ranges here cover everything that is made or measured, with room to spare. Arithmetic on values within them stays
//! finite.
//!
//! Fields of files name their quantity, so that a value outside the range is rejected with the name of the field:
//!
//! ```text
//! #[serde(deserialize_with = "quantity::position_mm::de")]
//! pub target_mm: DVec3,
//! ```

use std::collections::BTreeMap;
use std::fmt;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Deserializer, de::Error};

/// The range of a quantity, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest allowed value.
    pub least: f64,
    /// Largest allowed value.
    pub most: f64,
    /// Unit; empty for dimensionless quantities.
    pub unit: &'static str,
}

/// A value outside its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutOfRange {
    value: f64,
    range: Range,
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { value, range } = self;
        write!(f, "{} is not {range}", Short(*value))
    }
}

impl std::error::Error for OutOfRange {}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { least, most, unit } = *self;
        let blank = if unit.is_empty() { "" } else { " " };
        write!(f, "between {} and {}{blank}{unit}", Short(least), Short(most))
    }
}

/// A number formatted in few characters.
struct Short(f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.abs() {
            size if size != 0.0 && !(1e-4..1e7).contains(&size) => write!(f, "{:e}", self.0),
            _ => write!(f, "{}", self.0),
        }
    }
}

impl Range {
    /// Returns the value if it is in the range; NaN is not.
    ///
    /// # Errors
    /// Returns an error with the value and the range.
    pub fn check(self, value: f64) -> Result<f64, OutOfRange> {
        let inside = (self.least..=self.most).contains(&value);
        inside.then_some(value).ok_or(OutOfRange { value, range: self })
    }

    /// Parses a number of this range.
    ///
    /// # Errors
    /// Returns an error that states the range.
    pub fn parse(self, text: &str) -> Result<f64, String> {
        let value: Option<f64> = text.trim().parse().ok();
        value.and_then(|value| self.check(value).ok()).ok_or_else(|| format!("must be {self}"))
    }

    fn deserialize<'de, D, T>(self, deserializer: D) -> Result<T, D::Error>
    where
        D: Deserializer<'de>,
        T: Deserialize<'de> + Numbers,
    {
        let value = T::deserialize(deserializer)?;
        value.all(&mut |number| self.check(number).map(|_| ())).map_err(D::Error::custom)?;
        Ok(value)
    }
}

/// A value made of numbers, for example a list or a vector.
pub trait Numbers {
    /// Applies `pass` to each number until one fails.
    ///
    /// # Errors
    /// Returns the first error of `pass`.
    fn all(&self, pass: &mut dyn FnMut(f64) -> Result<(), OutOfRange>) -> Result<(), OutOfRange>;
}

impl Numbers for f64 {
    fn all(&self, pass: &mut dyn FnMut(f64) -> Result<(), OutOfRange>) -> Result<(), OutOfRange> {
        pass(*self)
    }
}

impl Numbers for i32 {
    fn all(&self, pass: &mut dyn FnMut(f64) -> Result<(), OutOfRange>) -> Result<(), OutOfRange> {
        pass(f64::from(*self))
    }
}

impl Numbers for u32 {
    fn all(&self, pass: &mut dyn FnMut(f64) -> Result<(), OutOfRange>) -> Result<(), OutOfRange> {
        pass(f64::from(*self))
    }
}

impl<T: Numbers, const N: usize> Numbers for [T; N] {
    fn all(&self, pass: &mut dyn FnMut(f64) -> Result<(), OutOfRange>) -> Result<(), OutOfRange> {
        self.iter().try_for_each(|number| number.all(pass))
    }
}

impl Numbers for DVec2 {
    fn all(&self, pass: &mut dyn FnMut(f64) -> Result<(), OutOfRange>) -> Result<(), OutOfRange> {
        self.to_array().all(pass)
    }
}

impl Numbers for DVec3 {
    fn all(&self, pass: &mut dyn FnMut(f64) -> Result<(), OutOfRange>) -> Result<(), OutOfRange> {
        self.to_array().all(pass)
    }
}

impl<T: Numbers> Numbers for Vec<T> {
    fn all(&self, pass: &mut dyn FnMut(f64) -> Result<(), OutOfRange>) -> Result<(), OutOfRange> {
        self.iter().try_for_each(|number| number.all(pass))
    }
}

impl<T: Numbers> Numbers for Option<T> {
    fn all(&self, pass: &mut dyn FnMut(f64) -> Result<(), OutOfRange>) -> Result<(), OutOfRange> {
        self.iter().try_for_each(|number| number.all(pass))
    }
}

impl<K, T: Numbers> Numbers for BTreeMap<K, T> {
    fn all(&self, pass: &mut dyn FnMut(f64) -> Result<(), OutOfRange>) -> Result<(), OutOfRange> {
        self.values().try_for_each(|number| number.all(pass))
    }
}

macro_rules! quantities {
    ($($(#[$doc:meta])* $name:ident: $least:literal to $most:literal $unit:literal;)*) => {$(
        $(#[$doc])*
        pub mod $name {
            use super::{Deserialize, Deserializer, Numbers};

            #[allow(dead_code, reason = "some quantities need only `RANGE` or only `de`")]
            /// Range of the quantity.
            pub const RANGE: super::Range =
                super::Range { least: $least, most: $most, unit: $unit };

            #[allow(dead_code, reason = "some quantities need only `RANGE` or only `de`")]
            /// Deserialises a number, or lists of numbers, within the range.
            ///
            /// # Errors
            /// Returns an error if a value is not a number or not in the range.
            pub fn de<'de, D, T>(deserializer: D) -> Result<T, D::Error>
            where
                D: Deserializer<'de>,
                T: Deserialize<'de> + Numbers,
            {
                RANGE.deserialize(deserializer)
            }
        }
    )*};
}

quantities! {
    /// A coordinate in space or on paper.
    position_mm: -1e6 to 1e6 "mm";
    /// A length that may be zero.
    length_mm: 0.0 to 1e6 "mm";
    /// An edge of a tile.
    edge_mm: 1e-3 to 1e5 "mm";
    /// An angle of a few full rotations at most.
    angle_rad: -100.0 to 100.0 "rad";
    /// An entry of a rotation matrix.
    cosine: -1.001 to 1.001 "";
    /// An entry of the covariance of a pose, rad² to mm².
    pose_covariance: -1e12 to 1e12 "";
    /// A variance of a pose, at least (1e-9 rad)² or (1e-9 mm)².
    pose_variance: 1e-18 to 1e12 "";
    /// A coordinate in an image. Corners may lie outside the image.
    place_px: -1e6 to 1e6 "px";
    /// A side of an image.
    side_px: 1.0 to 50_000.0 "";
    /// A variance of a position in an image; it is close to zero for images without noise.
    variance_px2: 1e-20 to 1e8 "px²";
    /// A focal length.
    focal_px: 0.1 to 1e8 "px";
    /// A focal length in the metadata of a photograph.
    nominal_focal_mm: 0.1 to 1e5 "mm";
    /// A coefficient of a lens.
    coefficient: -1e9 to 1e9 "";
    /// α of the models eucm and double-sphere.
    alpha: 0.0 to 1.0 "";
    /// β of eucm.
    beta: 1e-6 to 1e6 "";
    /// ξ of double-sphere, with |ξ| < 1.
    xi: -0.999999 to 0.999999 "";
    /// A row or column of a lattice; negative where the origin is arbitrary.
    place_in_lattice: -100_000.0 to 100_000.0 "";
    /// Number of columns or rows of a matrix of corners.
    side_of_matrix: 0.0 to 10_000.0 "";
    /// A border of a tag.
    border_bits: 0.0 to 100.0 "bit-widths";
    /// The width of the black around the tiles of a face.
    rim_mm: 1e-3 to 1e5 "mm";
    /// The width of a gap between tags, in tags.
    gap_edges: 0.01 to 1.0 "edges";
    /// Standard deviation of the board's corners from its description. Boards with a larger one are useless.
    board_accuracy_mm: 0.0 to 10.0 "mm";
    /// A measured length divided by the nominal one.
    print_scale: 0.5 to 2.0 "";
    /// A resolution.
    dots_per_inch: 1.0 to 1e6 "dpi";
    /// Millimetres in the unit of a mesh.
    unit_mm: 1e-6 to 1e6 "mm";
    /// Distance of a point at which the projection uncertainty is evaluated.
    distance_mm: 1.0 to 1e6 "mm";
    /// Blur of a synthetic image.
    blur_px: 0.0 to 100.0 "px";
    /// A grey value or noise level, relative to full scale.
    of_full_scale: 0.0 to 1.0 "of full scale";
    /// Relative change of the light across a synthetic image.
    light_gradient: -2.0 to 2.0 "";
    /// Any other measured quantity.
    figure: -1e15 to 1e15 "";
    /// Standard deviation of any other measured quantity.
    deviation: 0.0 to 1e15 "";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize)]
    struct File {
        #[serde(default, deserialize_with = "variance_px2::de")]
        cov: Option<[f64; 2]>,
    }

    #[test]
    fn errors_name_the_value_and_its_range() {
        let read = |text: &str| serde_json::from_str::<File>(text);
        assert_eq!(read(r#"{"cov": [1, 2e-20]}"#).unwrap().cov, Some([1.0, 2e-20]));
        assert!(read("{}").unwrap().cov.is_none());
        let message = read(r#"{"cov": [1, 1e308]}"#).unwrap_err().to_string();
        assert!(message.starts_with("1e308 is not between 1e-20 and 1e8 px²"), "{message}");
        for bad in ["nan", "inf", "-1e308", "x", ""] {
            assert_eq!(
                position_mm::RANGE.parse(bad).unwrap_err(),
                "must be between -1000000 and 1000000 mm"
            );
        }
    }
}
