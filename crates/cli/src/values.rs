//! Parsers of option values, whose errors say what is expected.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use deltille::Name;
use deltille::export::named::{Format, named};
use deltille::targets::parse_length_mm;
use deltille_core::quantity::distance_mm;

/// Parses an integer within a range. Errors do not mention bounds that are the limits of the type.
pub fn whole<T>(range: RangeInclusive<T>) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Display + Copy + Bounded + Send + Sync + 'static,
{
    let (least, most) = (*range.start(), *range.end());
    let wanted = if most == T::MOST {
        format!("expected a whole number, {least} or more")
    } else {
        format!("expected a whole number from {least} to {most}")
    };
    move |text| {
        let digits = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        match text.parse() {
            Ok(value) if digits && (least..=most).contains(&value) => Ok(value),
            Err(_) if digits && most == T::MOST => Err(format!("expected at most {most}")),
            _ => Err(wanted.clone()),
        }
    }
}

/// An integer type with its largest value.
pub trait Bounded {
    const MOST: Self;
}

impl Bounded for u16 {
    const MOST: Self = Self::MAX;
}

impl Bounded for u32 {
    const MOST: Self = Self::MAX;
}

impl Bounded for u64 {
    const MOST: Self = Self::MAX;
}

/// Parses a decimal number within a range.
pub fn number(
    range: RangeInclusive<f64>,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    let wanted = format!("expected a number from {} to {}", range.start(), range.end());
    move |text| text.parse().ok().filter(|v| range.contains(v)).ok_or_else(|| wanted.clone())
}

/// Parses the name of a format in a table.
pub fn format<F: Format>(all: &'static [F]) -> impl TypedValueParser<Value = &'static F> {
    let value = |format: &F| PossibleValue::new(format.name()).help(format.help());
    PossibleValuesParser::new(all.iter().map(value)).try_map(move |name| named(all, &name))
}

/// Parses a name that can be both a file stem and a family name.
pub fn name(text: &str) -> Result<String, String> {
    Name::without_dots(text).map(Into::into)
}

/// Two integers, such as 8x6.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid(pub [u32; 2]);

impl FromStr for Grid {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides = text.split_once(['x', 'X', '×']);
        let number = |side: &str| whole(0..=u32::MAX)(side.trim()).ok();
        let sides = sides.and_then(|(a, b)| Some([number(a)?, number(b)?]));
        sides.map(Self).ok_or_else(|| "expected two whole numbers, such as 8x6".to_owned())
    }
}

/// Tag ids, in the order given.
#[derive(Clone, Debug, PartialEq)]
pub struct Ids(pub Vec<u32>);

impl Ids {
    /// Upper limit: all tags of the largest family that fits in a file.
    const MOST: usize = 10_000_000;

    /// Rejects ids that a family does not have.
    pub fn check(&self, family: &deltille::family::Family) -> anyhow::Result<()> {
        match self.0.iter().find(|&&id| family.code(id).is_none()) {
            None => Ok(()),
            Some(id) => anyhow::bail!(
                "--ids: {} has no tag {id} (its ids are 0 to {})",
                family.name(),
                family.len() - 1
            ),
        }
    }
}

impl FromStr for Ids {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut ids = Vec::new();
        for part in text.split(',') {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let number = |s: &str| s.trim().parse::<u32>().ok();
            let (Some(first), Some(last)) = (number(first), number(last)) else {
                return Err("expected ids and ranges, such as 0-9 or 3,7,20-25".to_owned());
            };
            if first > last {
                return Err(format!("the range {first}-{last} is reversed"));
            }
            if ids.len() + (last - first) as usize >= Self::MOST {
                return Err(format!("at most {} ids are allowed", Self::MOST));
            }
            ids.extend(first..=last);
        }
        let mut sorted = ids.clone();
        sorted.sort_unstable();
        match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(format!("{} is given twice", pair[0])),
            None => Ok(Self(ids)),
        }
    }
}

/// Parses a distance, mm.
pub fn distance(text: &str) -> Result<f64, String> {
    let mm = parse_length_mm(text).map_err(|error| error.to_string())?;
    distance_mm::RANGE.check(mm).map_err(|_| format!("{text}: not between 1 mm and 1000 m"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_single_or_in_ranges_and_unique() {
        assert_eq!("3,7,20-22".parse::<Ids>().unwrap().0, [3, 7, 20, 21, 22]);
        for bad in ["", "-", "5-3", "a", "1-99999999", "0-9,,1", "0,0", "1-5,3"] {
            assert!(bad.parse::<Ids>().is_err(), "{bad}");
        }
    }

    #[test]
    fn grids_are_two_numbers() {
        assert_eq!("8x6".parse(), Ok(Grid([8, 6])));
        assert_eq!("11 × 8".parse(), Ok(Grid([11, 8])));
        for bad in ["", "8", "x", "8x", "8x6x5", "-8x6", "8.5x6", "99999999999x2"] {
            assert!(bad.parse::<Grid>().is_err(), "{bad}");
        }
    }

    #[test]
    fn errors_of_numbers_state_the_expected_range() {
        let count = whole(1..=9u32);
        assert_eq!(count("9"), Ok(9));
        for bad in ["", "0", "10", "-1", "+3", "1.5", "x", "99999999999999999999"] {
            assert_eq!(count(bad).unwrap_err(), "expected a whole number from 1 to 9", "{bad}");
        }
        let seed = whole(0..=u64::MAX);
        assert_eq!(seed("-1").unwrap_err(), "expected a whole number, 0 or more");
        assert_eq!(
            seed("18446744073709551616").unwrap_err(),
            "expected at most 18446744073709551615"
        );
        assert!(number(0.0..=1.0)("nan").is_err());
    }
}
