//! Help texts and the guide: the programs accept the command lines that are shown there, and both describe every option.

use std::fs;
use std::path::Path;

use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use clap::{Arg, Command, CommandFactory};
use deltille_cli::{deltag::Deltag, deltille::Deltille};

use crate::common::page::Page;

/// A program with all its commands, or a command with its subcommands, each with its full name.
fn commands(name: &str, command: Command) -> Vec<(String, Command)> {
    let own = command.get_subcommands().cloned().collect::<Vec<_>>();
    let own = own.into_iter().flat_map(|own| commands(&format!("{name} {}", own.get_name()), own));
    let own: Vec<_> = own.collect();
    [vec![(name.to_owned(), command)], own].concat()
}

fn all_commands() -> Vec<(String, Command)> {
    [commands("deltille", Deltille::command()), commands("deltag", Deltag::command())].concat()
}

fn shown(command: &Command) -> impl Iterator<Item = &Arg> {
    command.get_arguments().filter(|argument| !argument.is_hide_set())
}

/// Pages of the guide with their names.
fn guide() -> Vec<(String, String)> {
    let root = Path::new(crate::common::REPOSITORY);
    let pages = fs::read_dir(root.join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let pages = pages.filter(|path| path.extension().is_some_and(|end| end == "md"));
    let pages = pages.chain([root.join("README.md")]);
    pages.map(|path| (path.display().to_string(), fs::read_to_string(path).unwrap())).collect()
}

/// The command lines of our programs in a shell line.
fn command_lines(line: &str) -> Vec<Vec<String>> {
    let line = line.split(" #").next().unwrap();
    // The value that the loop of a guide inserts.
    let line = line.replace("$eye", "0,0,400").replace("$i", "1");
    let words: Vec<&str> = line.split_whitespace().collect();
    let ends_command = |word: &&str| ["|", "&&", ";", "do", ">", "2>"].contains(word);
    let parts =
        words.split(ends_command).filter(|part| matches!(part, ["deltille" | "deltag", ..]));
    let word = |word: &&str| word.trim_matches(['\'', ';']).to_owned();
    parts.map(|part| part.iter().map(word).collect()).collect()
}

/// Command lines of a page: those in its code, and those in its text, which may be abridged.
fn command_lines_of_page(page: &str) -> (Vec<Vec<String>>, Vec<Vec<String>>) {
    let (mut of_code, mut of_text) = (Vec::new(), Vec::new());
    let page = page.replace("\\\n", " ");
    for (i, part) in page.split("\n```").enumerate() {
        if i % 2 == 1 {
            let lines = part.strip_prefix("sh\n").unwrap_or_default().lines();
            of_code.extend(lines.flat_map(command_lines));
            continue;
        }
        let is_code = |line: &&str| line.starts_with("    ");
        of_code.extend(part.lines().filter(is_code).flat_map(command_lines));
        for paragraph in part.split("\n\n") {
            let spans = paragraph.split('`').skip(1).step_by(2);
            let lines =
                spans.flat_map(|span| command_lines(&span.replace("=…", "=any").replace('…', " ")));
            // A program without arguments is only a name, and `<command>` is a placeholder.
            of_text.extend(lines.filter(|words| words.len() > 1 && !words[1].starts_with('<')));
        }
    }
    (of_code, of_text)
}

fn parsed(words: &[String]) -> Result<(), Error> {
    let program = if words[0] == "deltag" { Deltag::command() } else { Deltille::command() };
    program.try_get_matches_from(words).map(drop)
}

/// Whether a line is refused only because it is abridged, or asks for a help text.
fn is_abridged(error: &Error) -> bool {
    let has_no_value = matches!(
        error.get(ContextKind::InvalidValue),
        Some(ContextValue::String(value)) if value.is_empty()
    );
    has_no_value
        || matches!(
            error.kind(),
            ErrorKind::MissingRequiredArgument
                | ErrorKind::MissingSubcommand
                | ErrorKind::DisplayHelp
                | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
                | ErrorKind::DisplayVersion
        )
}

#[test]
fn command_lines_in_help_texts_and_the_guide_are_valid() {
    let mut wrong = Vec::new();
    let mut count = [0; 3];
    for (name, command) in all_commands() {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let (_, examples) = help.split_once("Examples:\n").unwrap_or_default();
        for words in examples.lines().flat_map(command_lines) {
            count[0] += 1;
            wrong.extend(parsed(&words).err().map(|error| format!("--help of {name}: {error}")));
        }
        let is_first_of_deltille = name.starts_with("deltille ") && name.split(' ').count() == 2;
        if is_first_of_deltille && !command.has_subcommands() && examples.is_empty() {
            wrong.push(format!("{name} has no examples"));
        }
    }
    for (name, page) in guide() {
        let (of_code, of_text) = command_lines_of_page(&page);
        count[1] += of_code.len();
        count[2] += of_text.len();
        for words in of_code {
            let error = parsed(&words).err();
            wrong.extend(error.map(|error| format!("{name}: {}: {error}", words.join(" "))));
        }
        for words in of_text {
            // The first of c|rust|python.
            let words: Vec<String> =
                words.iter().map(|word| word.split('|').next().unwrap().to_owned()).collect();
            let error = parsed(&words).err().filter(|error| !is_abridged(error));
            wrong.extend(error.map(|error| format!("{name}: {}: {error}", words.join(" "))));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // Slightly below the existing numbers, so that skipped lines are noticed.
    assert!(count[0] > 50 && count[1] > 80 && count[2] > 100, "{count:?}");
}

#[test]
fn help_texts_and_the_guide_describe_every_option() {
    let guide = guide().into_iter().map(|(_, page)| page).collect::<String>();
    let words: Vec<&str> = guide
        .split(|c: char| !(c.is_ascii_alphanumeric() || c == '-'))
        .filter(|word| word.starts_with('-'))
        .collect();
    let mut missing = Vec::new();
    for (name, command) in all_commands() {
        for argument in shown(&command) {
            if argument.get_help().is_none() {
                missing.push(format!("{name} --help: {}", argument.get_id()));
            }
            let long = argument.get_long().map(|long| format!("--{long}"));
            let short = argument.get_short().map(|short| format!("-{short}"));
            let mut forms = [long, short].into_iter().flatten().peekable();
            if forms.peek().is_some() && !forms.any(|form| words.contains(&&*form)) {
                missing.push(format!("{name} {}: not in docs/", argument.get_id()));
            }
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// The layout of a help text, in an example with all elements.
#[test]
fn a_help_text() {
    let mut page = Page::default();
    page.run(&std::env::temp_dir(), "deltille refine --help");
    page.is("help");
}
