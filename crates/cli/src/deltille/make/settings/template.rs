//! Templates: the settings of a command as a TOML file, for reuse.

use std::path::Path;

use anyhow::{Context, anyhow, bail};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::output::{self, Overwrite};
use deltille::export::GENERATOR;
use deltille::export::kind::Kind;
use deltille::limits;
use deltille_core::reading::in_words;
use deltille_core::words::quoted;

/// Reads the settings in a file that was made for a command.
pub fn read<T: DeserializeOwned>(
    path: &Path,
    command: &str,
    made_for: impl Fn(&T) -> Option<&str>,
) -> anyhow::Result<T> {
    let text = limits::read_short_text(path, limits::MAX_SETTINGS_BYTES).context("--template")?;
    let settings: T = toml::from_str(&text).map_err(|error| {
        let before = error.span().map_or("", |span| &text[..span.start]);
        let line = before.matches('\n').count();
        let field = text.lines().nth(line).and_then(|line| line.split('=').next());
        // The line may be a table name, or blank.
        let field =
            field.unwrap_or_default().trim_matches(|c: char| c.is_whitespace() || "[]".contains(c));
        let field = if field.is_empty() { String::new() } else { format!(", {}", quoted(field)) };
        let message = in_words(error.message().replace('\n', " "));
        anyhow!("--template: {} line {}{field}: {message}", path.display(), line + 1)
    })?;
    match made_for(&settings).filter(|made_for| *made_for != command) {
        Some(made_for) => {
            let made_for = quoted(made_for);
            bail!("--template: {} was made for {made_for}, not `{command}`", path.display())
        }
        None => Ok(settings),
    }
}

/// Returns the text of a template.
pub fn text(settings: &impl Serialize) -> String {
    let toml = toml::to_string(settings).expect("plain settings have a TOML form");
    format!("# {GENERATOR}, template\n{toml}")
}

/// A template to be written after everything else.
pub struct Template<'a> {
    path: &'a Path,
    text: String,
    overwrite: Overwrite,
}

impl<'a> Template<'a> {
    /// Fails if the path is a folder, or a file of another kind and `--force` is not given.
    pub fn new(path: &'a Path, text: String, overwrite: Overwrite) -> anyhow::Result<Self> {
        if path.is_dir() {
            bail!("--save-template: {} is a folder; expected a file", path.display());
        }
        overwrite.check(path, &Kind::of(text.as_bytes())).context("--save-template")?;
        Ok(Self { path, text, overwrite })
    }

    pub fn write(&self) -> anyhow::Result<()> {
        output::write(self.path, self.text.as_bytes(), self.overwrite).context("--save-template")
    }
}
