//! Formats selected by name. Each kind of format is a table from which options, help texts and errors are generated.

/// A format, as a row of a table.
pub trait Format: Sync + 'static {
    /// The name that selects the format.
    fn name(&self) -> &'static str;

    /// Description of the output for a help text.
    fn help(&self) -> String;
}

/// Returns the format with the given name.
///
/// # Errors
/// Returns a message with the known names if there is no such format.
pub fn named<'a, F: Format>(
    all: impl IntoIterator<Item = &'a F>,
    name: &str,
) -> Result<&'a F, String> {
    let mut names = Vec::new();
    for format in all {
        if format.name() == name {
            return Ok(format);
        }
        names.push(format.name());
    }
    Err(format!("unknown format {name} (known: {})", names.join(", ")))
}
