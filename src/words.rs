//! Numbers in sentences.

/// A number of things, in the right number: `1 view`, `2 views`.
pub(crate) fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}
