//! Texts on a sheet.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Text on a sheet: a string in files, structured data in programs. Faces and edges are numbered as in the solid, from
/// 0.
///
/// ```
/// use deltille_layout::Label;
///
/// let label = Label::Tab { edge: 7, under: 3 };
/// assert_eq!(label.to_string(), "edge 7 · under face 3");
/// assert_eq!(Label::from("edge 7 · under face 3".to_owned()), label);
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum Label {
    /// The number of a face.
    Face(usize),
    /// Number of an edge. Sides with the same number meet.
    Edge(usize),
    /// Number of an edge, and the face under which its tab is glued.
    Tab {
        /// The edge.
        edge: usize,
        /// The face.
        under: usize,
    },
    /// Number of an edge, and the face beyond it.
    Beyond {
        /// The edge.
        edge: usize,
        /// The face.
        face: usize,
    },
    /// Any other text: ASCII and `° ± · × – −`.
    Words(String),
}

impl Label {
    /// Returns the number of characters.
    pub fn characters(&self) -> usize {
        self.to_string().chars().count()
    }

    /// Returns whether the label identifies a face or an edge of a solid.
    pub fn is_number(&self) -> bool {
        !matches!(self, Self::Words(_))
    }

    /// Parses the number of a face or an edge.
    fn read_number(text: &str) -> Option<Self> {
        if let Some(face) = text.strip_prefix("face ") {
            return Some(Self::Face(face.parse().ok()?));
        }
        let rest = text.strip_prefix("edge ")?;
        if let Some((edge, under)) = rest.split_once(" · under face ") {
            return Some(Self::Tab { edge: edge.parse().ok()?, under: under.parse().ok()? });
        }
        if let Some((edge, face)) = rest.split_once(" · face ") {
            return Some(Self::Beyond { edge: edge.parse().ok()?, face: face.parse().ok()? });
        }
        Some(Self::Edge(rest.parse().ok()?))
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Face(face) => write!(f, "face {face}"),
            Self::Edge(edge) => write!(f, "edge {edge}"),
            Self::Tab { edge, under } => write!(f, "edge {edge} · under face {under}"),
            Self::Beyond { edge, face } => write!(f, "edge {edge} · face {face}"),
            Self::Words(words) => f.write_str(words),
        }
    }
}

/// Parses the text that [`Display`](fmt::Display) writes for a label.
impl From<String> for Label {
    fn from(text: String) -> Self {
        // A text such as "edge 07" does not match the written form, so it remains ordinary text.
        let number = Self::read_number(&text).filter(|label| label.to_string() == text);
        number.unwrap_or(Self::Words(text))
    }
}

impl From<Label> for String {
    fn from(label: Label) -> Self {
        match label {
            Label::Words(words) => words,
            number => number.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_labels_are_read_back_and_other_words_are_kept() {
        let tab = Label::Tab { edge: 7, under: 3 };
        for label in [Label::Face(0), Label::Edge(29), tab, Label::Beyond { edge: 0, face: 12 }] {
            assert_eq!(Label::from(label.to_string()), label);
        }
        for words in ["", "face", "face 03", "edge +7", "edge 20 mm", "edge 1 · under face x", "7"]
        {
            assert_eq!(Label::from(words.to_owned()), Label::Words(words.to_owned()));
        }
    }
}
