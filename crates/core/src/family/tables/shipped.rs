use std::borrow::Cow;

use super::aruco::dictionary;
use crate::family::positions;
use crate::lattice::GridKind;

/// Properties of a family without its codes. A program in a browser fetches codes only when it needs them, so names
/// and proposals must not include them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ShippedFamily {
    /// Its name.
    pub name: &'static str,
    /// The tiling whose tiles its tags fill.
    pub kind: GridKind,
    /// Number of cells of a tag.
    pub bits: u32,
    /// Minimum number of cells in which two tags differ, in any rotation.
    pub distance: u32,
    /// Number of codes.
    pub codes: usize,
}

impl ShippedFamily {
    const fn of(
        kind: GridKind,
        name: &'static str,
        bits: u32,
        distance: u32,
        codes: usize,
    ) -> Self {
        Self { name, kind, bits, distance, codes }
    }

    /// Returns the number of correctable cells.
    pub fn correctable(&self) -> u32 {
        (self.distance - 1) / 2
    }
}

/// Families of triangular tags.
const TRIANGULAR: [ShippedFamily; 12] = {
    use GridKind::Deltille as D;
    [
        ShippedFamily::of(D, "d16h5", 16, 5, 78),
        ShippedFamily::of(D, "d25h7", 25, 7, 1208),
        ShippedFamily::of(D, "d25h9", 25, 9, 83),
        ShippedFamily::of(D, "d36h9", 36, 9, 20_140),
        ShippedFamily::of(D, "d36h11", 36, 11, 1902),
        ShippedFamily::of(D, "d49h12", 49, 12, 20_000),
        ShippedFamily::of(D, "d64h12", 64, 12, 10_000),
        ShippedFamily::of(D, "delTag16h5", 16, 5, 34),
        ShippedFamily::of(D, "delTag25h7", 25, 7, 343),
        ShippedFamily::of(D, "delTag25h9", 25, 9, 47),
        ShippedFamily::of(D, "delTag36h9", 36, 9, 6659),
        ShippedFamily::of(D, "delTag36h11", 36, 11, 753),
    ]
};

/// Families of square tags, the tables of AprilTag: see `families/LICENSE-AprilTag.md`.
const SQUARE: [ShippedFamily; 3] = [
    ShippedFamily::of(GridKind::Checker, "aprilTag16h5", 16, 5, 30),
    ShippedFamily::of(GridKind::Checker, "aprilTag25h9", 25, 9, 35),
    ShippedFamily::of(GridKind::Checker, "aprilTag36h11", 36, 11, 587),
];

/// Returns the shipped families: of triangular tags, then of square ones.
pub fn shipped_families() -> impl Iterator<Item = &'static ShippedFamily> {
    TRIANGULAR.iter().chain(&SQUARE)
}

/// Returns the names of the shipped DelTag families.
pub fn shipped_names() -> Vec<&'static str> {
    TRIANGULAR.iter().map(|family| family.name).collect()
}

/// Returns the names of the shipped families of square tags. AprilTag's own short names, for example `t36h11` for
/// `aprilTag36h11`, are accepted too.
pub fn square_names() -> Vec<&'static str> {
    SQUARE.iter().map(|family| family.name).collect()
}

/// Returns the best shipped family for tiles of `kind` that has at least `needed` codes and corrects at least
/// `corrects` cells. The best family for printing has the fewest bits, so that its cells are
/// largest. Among equals, it has the greatest distance.
pub fn smallest_shipped(
    kind: GridKind,
    needed: u64,
    corrects: u32,
) -> Option<&'static ShippedFamily> {
    shipped_families()
        .filter(|family| family.kind == kind)
        .filter(|family| family.codes as u64 >= needed && family.correctable() >= corrects)
        .min_by_key(|family| (family.bits, std::cmp::Reverse(family.distance), family.codes))
}

/// Returns the text of a shipped family.
pub(in crate::family) fn json(name: &str) -> Option<&'static str> {
    Some(match whole(name).as_ref() {
        "d16h5" => include_str!("../../../families/d16h5.json"),
        "d25h7" => include_str!("../../../families/d25h7.json"),
        "d25h9" => include_str!("../../../families/d25h9.json"),
        "d36h9" => include_str!("../../../families/d36h9.json"),
        "d36h11" => include_str!("../../../families/d36h11.json"),
        "d49h12" => include_str!("../../../families/d49h12.json"),
        "d64h12" => include_str!("../../../families/d64h12.json"),
        "delTag16h5" => include_str!("../../../families/delTag16h5.json"),
        "delTag25h7" => include_str!("../../../families/delTag25h7.json"),
        "delTag25h9" => include_str!("../../../families/delTag25h9.json"),
        "delTag36h9" => include_str!("../../../families/delTag36h9.json"),
        "delTag36h11" => include_str!("../../../families/delTag36h11.json"),
        positions::NAME => include_str!("../../../families/dense9.json"),
        "aprilTag16h5" => include_str!("../../../families/aprilTag16h5.json"),
        "aprilTag25h9" => include_str!("../../../families/aprilTag25h9.json"),
        "aprilTag36h11" => include_str!("../../../families/aprilTag36h11.json"),
        _ => return None,
    })
}

/// Expands AprilTag's abbreviation of a name.
fn whole(name: &str) -> Cow<'_, str> {
    let square =
        name.strip_prefix('t').filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
    square.map_or(name.into(), |rest| format!("aprilTag{rest}").into())
}

/// Returns the full name of a shipped family or OpenCV dictionary; does not load any codes.
pub(crate) fn shipped_name(called: &str) -> Option<Cow<'_, str>> {
    let name = whole(called);
    if name == positions::NAME || shipped_families().any(|family| family.name == name) {
        return Some(name);
    }
    dictionary(called).map(|(name, _)| name.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::Family;

    #[test]
    fn listed_properties_match_the_family_files() {
        for &known in shipped_families() {
            let family = Family::shipped(known.name).unwrap();
            let (bits, distance) = (family.dimension().bits(), family.distance());
            let read = ShippedFamily::of(family.kind(), known.name, bits, distance, family.len());
            assert_eq!(read, known);
            assert_eq!(family.correctable(), known.correctable());
            assert_eq!(family.name(), known.name);
            assert_eq!(shipped_name(known.name).as_deref(), Some(known.name));
        }
    }
}
