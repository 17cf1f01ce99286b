use super::Family;
use crate::lattice::GridKind;

/// Families that come with the crate: file stem and text.
const SHIPPED: &[(&str, &str)] = &[
    ("d16h5", include_str!("../../families/d16h5.json")),
    ("d25h7", include_str!("../../families/d25h7.json")),
    ("d25h9", include_str!("../../families/d25h9.json")),
    ("d36h9", include_str!("../../families/d36h9.json")),
    ("d36h11", include_str!("../../families/d36h11.json")),
    ("d49h12", include_str!("../../families/d49h12.json")),
    ("delTag16h5", include_str!("../../families/delTag16h5.json")),
    ("delTag25h7", include_str!("../../families/delTag25h7.json")),
    ("delTag25h9", include_str!("../../families/delTag25h9.json")),
    ("delTag36h9", include_str!("../../families/delTag36h9.json")),
    ("delTag36h11", include_str!("../../families/delTag36h11.json")),
];

/// Square families, the tables of AprilTag: see `families/LICENSE-AprilTag.md`.
const SQUARE: &[(&str, &str)] = &[
    ("aprilTag16h5", include_str!("../../families/aprilTag16h5.json")),
    ("aprilTag25h9", include_str!("../../families/aprilTag25h9.json")),
    ("aprilTag36h11", include_str!("../../families/aprilTag36h11.json")),
];

/// Names of the DelTag families that come with the crate.
pub fn shipped_names() -> Vec<&'static str> {
    SHIPPED.iter().map(|&(name, _)| name).collect()
}

/// Names of the families of square tags that come with the crate. AprilTag's own short names,
/// `t36h11` for `aprilTag36h11`, are understood too.
pub fn square_names() -> Vec<&'static str> {
    SQUARE.iter().map(|&(name, _)| name).collect()
}

/// The family that comes with the crate, is for tiles of `kind`, has at least `needed` codes, corrects at least `corrects`
/// cells, and is the best of these to print: fewest bits, which makes the largest cells, then the
/// greatest distance.
pub fn smallest_shipped(kind: GridKind, needed: u64, corrects: u32) -> Option<Family> {
    let shipped = match kind {
        GridKind::Deltille => SHIPPED,
        GridKind::Checker => SQUARE,
    };
    let families = shipped.iter().filter_map(|&(name, _)| Family::shipped(name).ok());
    families
        .filter(|family| family.len() as u64 >= needed && family.correctable() >= corrects)
        .min_by_key(|f| (f.dimension().bits(), std::cmp::Reverse(f.distance()), f.len()))
}

pub(super) fn json(name: &str) -> Option<&'static str> {
    let short = |n: &str| {
        let (rest, own) = (name.strip_prefix('t'), n.strip_prefix("aprilTag"));
        own.is_some() && own == rest
    };
    let mut all = SHIPPED.iter().chain(SQUARE);
    all.find(|&&(n, _)| n == name || short(n)).map(|&(_, json)| json)
}
