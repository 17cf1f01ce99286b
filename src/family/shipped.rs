/// Families that come with the crate: file stem and text.
const SHIPPED: &[(&str, &str)] = &[
    ("delTag16h5", include_str!("../../families/delTag16h5.json")),
    ("delTag25h7", include_str!("../../families/delTag25h7.json")),
    ("delTag25h9", include_str!("../../families/delTag25h9.json")),
    ("delTag36h9", include_str!("../../families/delTag36h9.json")),
    ("delTag36h11", include_str!("../../families/delTag36h11.json")),
];

/// Names of the families that come with the crate.
pub fn shipped_names() -> Vec<&'static str> {
    SHIPPED.iter().map(|&(name, _)| name).collect()
}

pub(super) fn json(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|&&(n, _)| n == name).map(|&(_, json)| json)
}
