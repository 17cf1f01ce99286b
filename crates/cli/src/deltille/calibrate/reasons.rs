//! Why no image shows the target.

use std::collections::BTreeMap;

use deltille::detect::{Detection, Reason, ReasonKind};

/// Reports that an image shows no board, with the reason if it is known.
pub fn no_board(why: Option<&Reason>) -> String {
    why.map_or_else(|| "no board found".to_owned(), |why| format!("no board found: {why}"))
}

/// Why images show no labels: the number of images, and the first reason, of each kind.
#[derive(Default)]
pub struct Reasons(BTreeMap<ReasonKind, (usize, Reason)>);

impl Reasons {
    /// Adds the reasons of an image.
    pub fn add(&mut self, found: &Detection) {
        let reasons: BTreeMap<_, _> = found.reasons.iter().map(|why| (why.kind, why)).collect();
        for (kind, why) in reasons {
            self.0.entry(kind).or_insert_with(|| (0, why.clone())).0 += 1;
        }
    }

    /// Reports that none of these images shows the target, with all reasons, the most frequent one first.
    pub fn nothing_shown(&self, images: &str) -> String {
        let mut reasons: Vec<_> = self.0.values().collect();
        reasons.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
        let reasons = reasons.iter().map(|(count, why)| format!("; {count} of them: {why}"));
        format!("no board of this kind found in {images}{}", reasons.collect::<String>())
    }
}
