//! What the texts in a file must say.

use serde_json::Value;

use deltille_files::export::mesh::extras;
use deltille_layout::artwork::{drawn_lines, subject};
use deltille_layout::{Finish, LineKind, Printing, SheetLayout};

/// What the texts in a file must say about the target: they are read by people and programs that do
/// not look at the picture.
pub(super) struct Words {
    /// Its name.
    pub title: String,
    /// One line on what it is.
    pub subject: String,
    /// The same facts as JSON, for programs.
    extras: Value,
    /// How its pages are printed.
    pub finish: Finish,
    /// Number of lines to cut along on each sheet.
    pub cut_lines: Vec<usize>,
}

impl Words {
    /// The texts that belong to a target.
    pub(super) fn of(printing: &Printing) -> Self {
        let target = &printing.target;
        let (title, finish) = (target.name.to_string(), printing.finish.clone());
        let cut = |layout: &SheetLayout| {
            drawn_lines(layout).filter(|(_, line)| line.kind == LineKind::Cut).count()
        };
        let cut_lines = printing.sheets.iter().map(cut).collect();
        Self { title, subject: subject(target), extras: extras(target), finish, cut_lines }
    }

    /// Whether data in a mesh is that of the target; any version of the program may have written it.
    pub(super) fn are_extras(&self, found: &Value) -> bool {
        let creator = found["generator"].as_str().is_some_and(is_creator);
        let mut stated = self.extras.clone();
        stated["generator"] = found["generator"].clone();
        creator && stated == *found
    }
}

/// Whether words name this program in any of its versions.
pub(super) fn is_creator(words: &str) -> bool {
    let version = words.strip_prefix("deltille ").unwrap_or_default();
    !version.is_empty() && version.chars().all(|c| c.is_ascii_digit() || c == '.')
}
