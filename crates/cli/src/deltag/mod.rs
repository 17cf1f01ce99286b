//! `deltag`: search, check, list and draw DelTag code families.
//!
//! Comes in: arguments. Goes out: files of families, pictures, messages and an exit code. A user meets the commands in
//! this order:
//!
//! 1. `about` lists the families there are, tells of them, and checks what their files claim.
//! 2. `search` makes others.
//! 3. `draw` shows and prints their tags.
//! 4. `exchange` writes them for other programs, and reads theirs.
//!
//! `named` is the family that a command is given.

mod about;
mod draw;
mod exchange;
mod named;
mod search;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use self::about::{by_rank, info, list, verify_family};
use self::draw::{sheet, show};
use self::exchange::{export, import};
use self::search::{bounds, frontier, gen_family, plan};
use crate::shell;

/// Search, check, list and draw DelTag code families.
#[derive(Parser)]
#[command(name = "deltag", version, arg_required_else_help = false)]
pub struct Deltag {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Search a family such as d25h7 and write its file
    #[command(after_help = gen_family::HELP, mut_arg("force", |arg| arg.help(gen_family::FORCE)))]
    GenFamily(gen_family::Args),
    /// Check what a family file claims from nothing but its codes
    #[command(after_help = verify_family::HELP)]
    VerifyFamily(verify_family::Args),
    /// Tell all about a family, or how far two are from each other
    Info(info::Args),
    /// Print what rules for complexity leave of a construction: codes, and natural false positives
    #[command(after_help = frontier::HELP)]
    Frontier(frontier::Args),
    /// Print upper bounds for the size of a family, and how close the shipped ones come
    Bounds(bounds::Args),
    /// Name the smallest shipped family that suffices for a target
    Plan(plan::Args),
    /// Print tags of a linear family by number, also those that its file does not list
    ByRank(by_rank::Args),
    /// Write a family for another program
    Export(export::Args),
    /// Make a family file of a table of another program
    #[command(after_help = import::HELP)]
    Import(import::Args),
    /// Draw tags of a family on one picture, to look at
    Show(show::Args),
    /// Print tags of a family to true scale, on as many pages as they take
    Sheet(sheet::Args),
    /// List the families that come with the program
    List(list::Args),
    /// Print what a shell reads to complete commands and options
    Completions(shell::Completions),
    /// Write pages of the manual
    Man(shell::Man),
}

/// Runs the program.
pub fn run(deltag: Deltag) -> anyhow::Result<ExitCode> {
    match deltag.command {
        Command::GenFamily(args) => gen_family::run(args),
        Command::VerifyFamily(args) => verify_family::run(args),
        Command::Info(args) => info::run(args),
        Command::Frontier(args) => frontier::run(args),
        Command::Bounds(args) => bounds::run(args),
        Command::Plan(args) => plan::run(args),
        Command::ByRank(args) => by_rank::run(args),
        Command::Export(args) => export::run(args),
        Command::Import(args) => import::run(args),
        Command::Show(args) => show::run(args),
        Command::Sheet(args) => sheet::run(args),
        Command::List(args) => list::run(args),
        Command::Completions(args) => shell::completions::<Deltag>(args),
        Command::Man(args) => shell::man::<Deltag>(args),
    }
}
