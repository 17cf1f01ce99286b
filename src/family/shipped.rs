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

/// Names of the families that come with the crate.
pub fn shipped_names() -> Vec<&'static str> {
    SHIPPED.iter().map(|&(name, _)| name).collect()
}

pub(super) fn json(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|&&(n, _)| n == name).map(|&(_, json)| json)
}
