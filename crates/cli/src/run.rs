//! From the result of a command to an exit code and one line on standard error.

use std::ffi::OsString;
use std::io;
use std::process::ExitCode;

use anyhow::Context;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Parser};

use crate::deltille::with_short_help;
use crate::output::{detail, log};
use crate::{interrupt, terminal, wording};
use deltille_core::words::{cut, shown, with_short_quotes};

/// Exit code for invalid input of any kind.
pub const BAD_INPUT: u8 = 2;
/// Exit code if a check failed, or some of many inputs failed.
pub const FAILED: u8 = 1;
/// Exit code if a question could not be answered because necessary information is unknown.
pub const UNDECIDED: u8 = 3;

/// Number of characters kept at either end of a long message.
const MAX_CHARACTERS: usize = 1000;

/// Interruption by Ctrl-C or another signal, with the status of the work; see [`interrupt::leave`].
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Interrupted(pub String);

/// Parses the arguments and runs a program; errors become one line on standard error.
pub fn run<A: Parser>(program: impl FnOnce(A) -> anyhow::Result<ExitCode>) -> ExitCode {
    run_with(std::env::args_os().collect(), program)
}

/// Returns the number of an exit code, for callers that end the process without returning from `main`.
pub fn number(code: ExitCode) -> u8 {
    (0..=u8::MAX).find(|&number| ExitCode::from(number) == code).unwrap_or(BAD_INPUT)
}

/// Like [`run`], with given arguments; the first is the name of the program.
pub fn run_with<A: Parser>(
    arguments: Vec<OsString>,
    program: impl FnOnce(A) -> anyhow::Result<ExitCode>,
) -> ExitCode {
    interrupt::listen();
    wording::install();
    let arguments = with_help_option(arguments);
    let mut command = with_short_help(with_negative_numbers(A::command()));
    let parsed = command.try_get_matches_from_mut(&arguments).and_then(|matches| {
        wording::set_command(&command, &matches);
        A::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
    });
    let result = match parsed {
        Ok(parsed) => {
            let result = program(parsed);
            detail!("finished in {:.2} s", terminal::run_time().as_secs_f64());
            result
        }
        Err(error) if error.use_stderr() => {
            Err(anyhow::anyhow!(one_line(&error, &arguments, &command)))
        }
        Err(help_or_version) => {
            // If the reader of the help text is gone, there is nothing to report.
            match help_or_version.print() {
                Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                    Err(error).context("cannot write to standard output")
                }
                _ => return ExitCode::SUCCESS,
            }
        }
    };
    result.unwrap_or_else(|error| {
        if interrupt::is_raised() {
            // Any other error is a consequence of the interruption.
            interrupt::leave(error.downcast_ref().map(|Interrupted(how)| how.as_str()));
        }
        report(&error);
        ExitCode::from(BAD_INPUT)
    })
}

/// Prints an error and its causes on one line.
pub fn report(error: &anyhow::Error) {
    log!("error: {}", message(error));
}

/// Returns an error and its causes on one line. Omits causes that are already part of the message.
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

/// Cuts the middle out of a line that is too long to read, because messages may quote arbitrary file content.
fn shortened(line: &str) -> String {
    let count = line.chars().count();
    if count <= 2 * MAX_CHARACTERS {
        return line.to_owned();
    }
    let start: String = line.chars().take(MAX_CHARACTERS).collect();
    let end: String = line.chars().skip(count - MAX_CHARACTERS).collect();
    format!("{start} … {end}")
}

/// Returns a command whose options take negative numbers as values, so that their parsers can name the valid ones.
fn with_negative_numbers(command: Command) -> Command {
    command
        .mut_args(|argument| {
            let is_number = !argument.is_positional() && argument.get_action().takes_values();
            if is_number { argument.allow_negative_numbers(true) } else { argument }
        })
        .mut_subcommands(with_negative_numbers)
}

/// Returns the arguments with `help COMMAND` replaced by `COMMAND --help`, which also suggests a similar command.
fn with_help_option(mut arguments: Vec<OsString>) -> Vec<OsString> {
    if arguments.get(1).is_some_and(|command| command == "help") {
        arguments.remove(1);
        arguments.retain(|argument| argument != "--help" && argument != "-h");
        arguments.push("--help".into());
    }
    arguments
}

/// Options of other programs and of other commands of this one, and the option that does the same.
const INSTEAD: [(&str, &[&str]); 6] = [
    ("--cols", &["--squares", "--tags", "--circles", "--tiles"]),
    ("--dxf", &["--laser dxf"]),
    ("--glb", &["--gltf"]),
    ("--rows", &["--squares", "--tags", "--circles", "--tiles"]),
    ("--squares", &["--rows", "--cols", "--tiles"]),
    ("--stl", &["--3mf", "--gltf"]),
];

/// Returns those of the options in [`INSTEAD`] that the command has.
fn instead(unknown: &str, command: &Command) -> Option<String> {
    let (_, options) = INSTEAD.iter().find(|(given, _)| *given == unknown)?;
    let is_known = |option: &str| {
        let name = option.trim_start_matches("--").split(' ').next();
        command.get_arguments().any(|own| own.get_long() == name)
    };
    let known: Vec<&str> = options.iter().copied().filter(|option| is_known(option)).collect();
    (!known.is_empty()).then(|| known.join(" or "))
}

/// Returns the first paragraph of a clap message and its tip on one line.
fn one_line(error: &clap::Error, arguments: &[OsString], program: &Command) -> String {
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
        return format!("a command is missing: one of {commands} (see --help)");
    }
    let text_of = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        // The best suggestion is the last one.
        Some(ContextValue::Strings(texts)) => texts.last().map(String::as_str),
        _ => None,
    };
    if let (Some(unknown), Some(known)) =
        (text_of(ContextKind::InvalidSubcommand), text_of(ContextKind::SuggestedSubcommand))
    {
        return format!("unknown command {}; did you mean {known}?", cut(unknown));
    }
    if let (ErrorKind::UnknownArgument, Some(unknown)) =
        (error.kind(), text_of(ContextKind::InvalidArg))
        && let Some(command) = arguments.get(1).and_then(|name| program.find_subcommand(name))
        && let Some(instead) = instead(unknown, command)
    {
        return format!("unknown option {unknown}; did you mean {instead}?");
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
        None => format!("{first} (see --help)"),
    }
}
