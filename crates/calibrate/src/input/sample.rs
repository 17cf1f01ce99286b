//! Some of many items, evenly spread.

/// At most so many of the items, evenly over their sequence.
pub(crate) fn evenly<T>(items: &[T], most: usize) -> impl Iterator<Item = &T> {
    let count = items.len().min(most);
    (0..count).map(move |i| &items[i * items.len() / count])
}
