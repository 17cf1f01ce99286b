//! From a command's result to an exit code and one line on standard error.

use std::ffi::OsString;
use std::io;
use std::process::ExitCode;

use anyhow::Context;
use clap::Parser;
use clap::error::{ContextKind, ContextValue, ErrorKind};

use crate::output::tell;
use crate::{interrupt, wording};
use deltille_core::words::{cut, shown, with_short_quotes};

/// Exit code for bad input of every kind.
pub const BAD_INPUT: u8 = 2;
/// Exit code when what was checked does not hold, or some of many inputs failed.
pub const FAILED: u8 = 1;
/// Exit code when a verdict was asked for, and what it needs is not known.
pub const UNDECIDED: u8 = 3;

/// Characters kept of either end of a long message.
const MOST_CHARACTERS: usize = 1000;

/// Ctrl-C or another signal came, and this is how things stand; see [`interrupt::leave`].
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Interrupted(pub String);

/// Parses the arguments and runs a program; errors become one line on standard error.
pub fn run<A: Parser>(program: impl FnOnce(A) -> anyhow::Result<ExitCode>) -> ExitCode {
    run_with(std::env::args_os().collect(), program)
}

/// The number of an exit code, for whoever ends the process in another way than by returning from `main`.
pub fn number(code: ExitCode) -> u8 {
    (0..=u8::MAX).find(|&number| ExitCode::from(number) == code).unwrap_or(BAD_INPUT)
}

/// The same with given arguments, of which the first is the name of the program.
pub fn run_with<A: Parser>(
    arguments: Vec<OsString>,
    program: impl FnOnce(A) -> anyhow::Result<ExitCode>,
) -> ExitCode {
    interrupt::listen();
    wording::speak();
    let mut command = A::command();
    let parsed = command.try_get_matches_from_mut(&arguments).and_then(|matches| {
        wording::runs(&command, &matches);
        A::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
    });
    let result = match parsed {
        Ok(parsed) => program(parsed),
        Err(error) if error.use_stderr() => Err(anyhow::anyhow!(one_line(&error, &arguments))),
        Err(help_or_version) => {
            // Nothing is left to say when the reader of the help text has gone away.
            match help_or_version.print() {
                Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                    Err(error).context("cannot write to the standard output")
                }
                _ => return ExitCode::SUCCESS,
            }
        }
    };
    result.unwrap_or_else(|error| {
        if interrupt::is_raised() {
            // Any other error has come of what is being torn down.
            interrupt::leave(error.downcast_ref().map(|Interrupted(how)| how.as_str()));
        }
        report(&error);
        ExitCode::from(BAD_INPUT)
    })
}

/// Prints an error and its causes on one line.
pub fn report(error: &anyhow::Error) {
    tell!("error: {}", message(error));
}

/// An error and its causes on one line; a cause that the message above it tells already is left
/// out.
pub fn message(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    shortened(&with_short_quotes(&shown(&text.replace('\n', " "))))
}

/// A line without its middle where that is longer than anybody reads: messages name what they found
/// in a file, whatever it is.
fn shortened(line: &str) -> String {
    let count = line.chars().count();
    if count <= 2 * MOST_CHARACTERS {
        return line.to_owned();
    }
    let start: String = line.chars().take(MOST_CHARACTERS).collect();
    let end: String = line.chars().skip(count - MOST_CHARACTERS).collect();
    format!("{start} … {end}")
}

/// The first paragraph of a message of clap, and its tip, on one line.
fn one_line(error: &clap::Error, arguments: &[OsString]) -> String {
    if error.kind() == ErrorKind::InvalidUtf8 {
        let arguments = (1..).zip(arguments.iter().skip(1));
        let wrong: Vec<String> = arguments
            .filter(|(_, argument)| argument.to_str().is_none())
            .map(|(i, argument)| format!("{i} (`{}`)", argument.to_string_lossy()))
            .collect();
        return format!("argument {} is not UTF-8 text", wrong.join(" or "));
    }
    if let (ErrorKind::MissingSubcommand, Some(ContextValue::Strings(commands))) =
        (error.kind(), error.get(ContextKind::ValidSubcommand))
    {
        let commands = commands.join(", ");
        return format!("a command is missing, one of {commands} (--help tells what they do)");
    }
    let mut text = error.to_string();
    for (_, value) in error.context() {
        if let ContextValue::String(value) = value {
            text = text.replace(value, &cut(value));
        }
    }
    let mut paragraphs = text
        .split("\n\n")
        .map(|paragraph| paragraph.split_whitespace().collect::<Vec<_>>().join(" "));
    let first = paragraphs.next().unwrap_or_default();
    let first = first.trim_start_matches("error: ").to_owned();
    match paragraphs.find(|paragraph| paragraph.starts_with("tip: ")) {
        Some(tip) => format!("{first} ({})", tip.trim_start_matches("tip: ")),
        None => format!("{first} (--help tells more)"),
    }
}
