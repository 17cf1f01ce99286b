//! How a target is printed where plain black on paper is not all: as its mirror image for the back of glass, and with
//! the spot colours that print shops tell special inks and cutters by.

use serde::{Deserialize, Serialize};

use deltille_core::setting::Setting::{self, FinishContour, FinishWhite};

/// Most characters of the name of a spot colour.
const LONGEST_NAME: usize = 60;

/// Names that stand for something else than an ink of their own in a PDF (ISO 32000-1, 8.6.6.4), or for inks that are there
/// anyway.
const RESERVED: [&str; 6] = ["All", "None", "Cyan", "Magenta", "Yellow", "Black"];

/// How a target is printed. All positions in its description are those that are seen: on a mirrored one, through the
/// glass.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finish {
    /// Whether pages, and drawings for a laser, are mirror images, to be looked at through what they are printed on.
    #[serde(default, skip_serializing_if = "is_false")]
    pub mirrored: bool,
    /// Name of the spot colour that lies beneath all of a page, such as `White`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub white: Option<String>,
    /// Name of the spot colour of lines to cut along, such as `CutContour`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contour: Option<String>,
}

fn is_false(value: &bool) -> bool {
    !value
}

impl Finish {
    /// Whether it is black on paper, as everything is unless it is asked for otherwise.
    pub fn is_plain(&self) -> bool {
        *self == Self::default()
    }

    /// The spot colours, each with the setting that names it.
    pub fn spots(&self) -> impl Iterator<Item = (Setting, &str)> {
        let white = self.white.as_deref().map(|name| (FinishWhite, name));
        let contour = self.contour.as_deref().map(|name| (FinishContour, name));
        white.into_iter().chain(contour)
    }

    /// Checks the names; returns the setting at fault and what is wrong with it.
    pub(super) fn check(&self) -> Result<(), (Setting, String)> {
        for (setting, name) in self.spots() {
            let is_plain = |c: char| c.is_ascii_alphanumeric() || " _-.".contains(c);
            let is_name =
                !name.is_empty() && name.len() <= LONGEST_NAME && name.chars().all(is_plain);
            if !is_name || name.trim() != name {
                let what = "is no name of a spot colour: give letters, digits, blanks, `_`, `-` and `.`, such as";
                return Err((setting, format!("`{name}` {what} RDG_WHITE or CutContour")));
            }
            if RESERVED.iter().any(|reserved| reserved.eq_ignore_ascii_case(name)) {
                let what = "stands for a process colour, or for all or none of them: give the name of an ink of its own";
                return Err((setting, format!("`{name}` {what}")));
            }
        }
        if self.white.is_some() && self.white == self.contour {
            let problem = "it is the name of the white, too: give another".to_owned();
            return Err((FinishContour, problem));
        }
        Ok(())
    }
}
