//! Print finish: mirror images for the back of glass, and the spot colours that tell a print shop which shapes are
//! special inks or cutting lines.

use serde::{Deserialize, Serialize};

use deltille_core::setting::Setting::{self, FinishContour, FinishWhite};

/// Maximum number of characters in the name of a spot colour.
const LONGEST_NAME: usize = 60;

/// Names that do not denote a separate ink in a PDF (ISO 32000-1, 8.6.6.4): "all", "none" and the process colours.
const RESERVED: [&str; 6] = ["All", "None", "Cyan", "Magenta", "Yellow", "Black"];

/// How a target is printed. All positions in a target's description are those the viewer sees: on a mirrored target,
/// through the glass.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finish {
    /// Whether pages and laser drawings are mirrored, to be viewed through the material they are printed on.
    #[serde(default, skip_serializing_if = "is_false")]
    pub mirrored: bool,
    /// Name of the spot colour printed beneath the whole page, for example `White`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub white: Option<String>,
    /// Name of the spot colour of cutting lines, for example `CutContour`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contour: Option<String>,
}

fn is_false(value: &bool) -> bool {
    !value
}

impl Finish {
    /// Returns whether the finish is plain black on paper, the default.
    pub fn is_plain(&self) -> bool {
        *self == Self::default()
    }

    /// Iterates over the spot colours, each with the setting that names it.
    pub fn spots(&self) -> impl Iterator<Item = (Setting, &str)> {
        let white = self.white.as_deref().map(|name| (FinishWhite, name));
        let contour = self.contour.as_deref().map(|name| (FinishContour, name));
        white.into_iter().chain(contour)
    }

    /// Checks the names. Returns the invalid setting and the reason.
    pub(super) fn check(&self) -> Result<(), (Setting, String)> {
        for (setting, name) in self.spots() {
            let is_plain = |c: char| c.is_ascii_alphanumeric() || " _-.".contains(c);
            let is_name =
                !name.is_empty() && name.len() <= LONGEST_NAME && name.chars().all(is_plain);
            if !is_name || name.trim() != name {
                let what = "is not a valid spot colour name: use letters, digits, spaces, `_`, `-` and `.`, as in";
                return Err((setting, format!("`{name}` {what} RDG_WHITE or CutContour")));
            }
            if RESERVED.iter().any(|reserved| reserved.eq_ignore_ascii_case(name)) {
                let what = "is reserved for process colours: give the name of a separate ink";
                return Err((setting, format!("`{name}` {what}")));
            }
        }
        if self.white.is_some() && self.white == self.contour {
            let problem = "this name is already used for the white ink: choose another".to_owned();
            return Err((FinishContour, problem));
        }
        Ok(())
    }
}
