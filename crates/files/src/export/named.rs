//! Formats by name. Options, help texts and errors are made from one table for each kind of format.

/// A format, as a line of a table.
pub trait Format: Sync + 'static {
    /// Its name in options and keywords.
    fn name(&self) -> &'static str;

    /// A phrase for help texts that says what is written.
    fn help(&self) -> String;
}

/// Returns the format of that name.
///
/// # Errors
/// Returns an error that lists the known names if no format has this name.
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
