//! Checks of options: lengths, and options without effect.

use anyhow::{Context, bail};

use deltille::targets::parse_length_mm;

/// Rejects the first option that is given but unused; the last element of each entry names the
/// option that it requires.
pub fn refuse_idle(options: &[(&str, bool, bool, &str)]) -> anyhow::Result<()> {
    match options.iter().find(|(_, is_given, is_used, _)| *is_given && !is_used) {
        Some((option, .., needed)) => {
            bail!("{option} needs {needed}")
        }
        None => Ok(()),
    }
}

/// Whether a flag is omitted from a template.
pub fn is_false(value: &bool) -> bool {
    !value
}

/// Whether settings are omitted from a template, because all are defaults.
pub fn is_usual<T: Default + PartialEq>(settings: &T) -> bool {
    *settings == T::default()
}

/// Returns the length of an option in millimetres, if given.
pub fn length(option: &str, text: &Option<String>) -> anyhow::Result<Option<f64>> {
    let parsed = text.as_deref().map(parse_length_mm).transpose();
    parsed.with_context(|| format!("--{option}"))
}
