//! What the texts on a sheet say.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What a text on a sheet says: a text in files, data for programs. Numbers of faces and edges are
/// those of the solid, from 0.
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
    /// The number of an edge: sides of the same number meet.
    Edge(usize),
    /// The number of an edge, and the face that its tab goes under.
    Tab {
        /// The edge.
        edge: usize,
        /// The face.
        under: usize,
    },
    /// The number of an edge, and the face beyond it.
    Beyond {
        /// The edge.
        edge: usize,
        /// The face.
        face: usize,
    },
    /// Anything else, for people: ASCII and `° ± · × – −`.
    Words(String),
}

impl Label {
    /// How many characters it has.
    pub fn characters(&self) -> usize {
        self.to_string().chars().count()
    }

    /// Whether it says which face or edge of a solid something is.
    pub fn is_number(&self) -> bool {
        !matches!(self, Self::Words(_))
    }

    /// A number of a face or an edge.
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

/// The label that is written so.
impl From<String> for Label {
    fn from(text: String) -> Self {
        // Such as "edge 07" is no number that is written here.
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
    fn what_is_written_is_read_and_other_words_stay_as_they_are() {
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
