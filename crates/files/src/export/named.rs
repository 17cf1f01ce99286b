//! Formats that are asked for by name. Each kind of them is a table, of which options, help texts and errors are made.

/// A format, as a line of a table.
pub trait Format: Sync + 'static {
    /// What it is asked for by.
    fn name(&self) -> &'static str;

    /// What is written, for a help text.
    fn help(&self) -> String;
}

/// The format of that name.
///
/// # Errors
/// Where there is none, with the names that there are.
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
    let last = names.pop().unwrap_or_default();
    Err(format!("{name} is not {} or {last}", names.join(", ")))
}
