//! Whether options say something, as lengths or at all.

use anyhow::{Context, bail};

use deltille::targets::parse_length_mm;

/// Refuses the first option of these that is given and not used; the last of each says what it needs, and how to have it.
pub fn refuse_idle(options: &[(&str, bool, bool, &str)]) -> anyhow::Result<()> {
    match options.iter().find(|(_, is_given, is_used, _)| *is_given && !is_used) {
        Some((option, .., needed)) => {
            bail!("{option}: it says nothing without {needed}, or leave it out")
        }
        None => Ok(()),
    }
}

/// Whether a setting is left out of a template.
pub fn is_false(value: &bool) -> bool {
    !value
}

/// Whether settings say nothing.
pub fn is_usual<T: Default + PartialEq>(settings: &T) -> bool {
    *settings == T::default()
}

/// A length in millimetres that an option gives, if it is given.
pub fn length(option: &str, text: &Option<String>) -> anyhow::Result<Option<f64>> {
    let parsed = text.as_deref().map(parse_length_mm).transpose();
    parsed.with_context(|| format!("--{option}"))
}
