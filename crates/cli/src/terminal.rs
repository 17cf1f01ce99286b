//! How much the programs print, and in which colours.

use std::borrow::Cow;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use anstream::{AutoStream, ColorChoice, stream::RawStream};
use clap::builder::styling::{AnsiColor, Style};

/// Options of every command.
#[derive(clap::Args, Clone, Copy, Default)]
#[command(next_help_heading = "Messages")]
pub struct Verbosity {
    /// Print only results, warnings and errors: no progress, no notes, no list of files
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Also print which files are read, and how long the work takes
    #[arg(short, long, global = true)]
    verbose: bool,
}

/// The options of this process, and its start.
static CHOSEN: OnceLock<(Verbosity, Instant)> = OnceLock::new();

impl Verbosity {
    /// Applies the options to everything that this process prints from now on.
    pub fn set(self) {
        // Only one command runs per process.
        let _ = CHOSEN.set((self, Instant::now()));
    }
}

/// Whether only results, warnings and errors are printed.
pub fn is_quiet() -> bool {
    CHOSEN.get().is_some_and(|(chosen, _)| chosen.quiet)
}

/// Whether details of the work are printed.
pub fn is_verbose() -> bool {
    CHOSEN.get().is_some_and(|(chosen, _)| chosen.verbose)
}

/// Returns the run time of the command so far.
pub fn run_time() -> Duration {
    CHOSEN.get().map_or(Duration::ZERO, |(_, start)| start.elapsed())
}

/// Words that are coloured where they occur first in a line, with their style.
const WORDS: [(&str, AnsiColor); 7] = [
    ("error:", AnsiColor::Red),
    ("warning:", AnsiColor::Yellow),
    ("note:", AnsiColor::Cyan),
    ("interrupted:", AnsiColor::Yellow),
    ("FAILED", AnsiColor::Red),
    ("verified: ", AnsiColor::Green),
    (" verified,", AnsiColor::Green),
];

/// Returns a line with the colours in which this stream shows it: none if it is not a terminal, or if the environment variable
/// NO_COLOR is set.
pub fn coloured<'a>(line: &'a str, stream: &impl RawStream) -> Cow<'a, str> {
    let found = WORDS.iter().find(|(word, _)| line.contains(word));
    match found {
        Some((word, colour)) if AutoStream::choice(stream) != ColorChoice::Never => {
            let style = Style::new().bold().fg_color(Some((*colour).into()));
            Cow::Owned(line.replacen(word, &format!("{style}{word}{style:#}"), 1))
        }
        _ => Cow::Borrowed(line),
    }
}
