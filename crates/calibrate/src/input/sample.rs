//! Selection of some of many items, evenly spread.

/// Selects at most `most` items, evenly over their sequence.
pub(crate) fn evenly<T>(items: &[T], most: usize) -> impl Iterator<Item = &T> {
    let count = items.len().min(most);
    (0..count).map(move |i| &items[i * items.len() / count])
}
