//! The texts that a file must contain.

use serde_json::Value;

use deltille_files::export::mesh::extras;
use deltille_layout::artwork::{drawn_lines, subject};
use deltille_layout::{Finish, LineKind, Printing, SheetLayout};

/// The texts that a file must contain about the target. People and programs read them without seeing the page.
pub(super) struct Words {
    /// Name of the target.
    pub title: String,
    /// One line that describes the target.
    pub subject: String,
    /// The same facts as JSON, for programs.
    extras: Value,
    /// Print finish of its pages.
    pub finish: Finish,
    /// Number of cut lines on each sheet.
    pub cut_lines: Vec<usize>,
}

impl Words {
    /// Creates the texts for a target.
    pub(super) fn of(printing: &Printing) -> Self {
        let target = &printing.target;
        let (title, finish) = (target.name.to_string(), printing.finish.clone());
        let cut = |layout: &SheetLayout| {
            drawn_lines(layout).filter(|(_, line)| line.kind == LineKind::Cut).count()
        };
        let cut_lines = printing.sheets.iter().map(cut).collect();
        Self { title, subject: subject(target), extras: extras(target), finish, cut_lines }
    }

    /// Whether data in a mesh describes the target; any version of the program may have written it.
    pub(super) fn are_extras(&self, found: &Value) -> bool {
        let creator = found["generator"].as_str().is_some_and(is_creator);
        let mut stated = self.extras.clone();
        stated["generator"] = found["generator"].clone();
        creator && stated == *found
    }
}

/// Whether a text names this program, in any version.
pub(super) fn is_creator(words: &str) -> bool {
    let version = words.strip_prefix("deltille ").unwrap_or_default();
    !version.is_empty() && version.chars().all(|c| c.is_ascii_digit() || c == '.')
}
