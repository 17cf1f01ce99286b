//! Selection of evenly spaced items from a list.

/// Selects at most `most` items, evenly spaced over the list.
pub(crate) fn evenly<T>(items: &[T], most: usize) -> impl Iterator<Item = &T> {
    let count = items.len().min(most);
    (0..count).map(move |i| &items[i * items.len() / count])
}
