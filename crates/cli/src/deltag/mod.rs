//! `deltag`: search, check, list and draw DelTag code families.
//!
//! Input: arguments. Output: family files, drawings, messages and an exit code. The modules, in the order in which a
//! user meets their commands:
//!
//! 1. `about` lists and describes families, and verifies their files.
//! 2. `search` finds new ones.
//! 3. `draw` draws and prints their tags.
//! 4. `exchange` exports and imports them for other programs.
//!
//! `named` resolves the family that a command is given.

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
use crate::terminal::Verbosity;

/// Search, check, list and draw DelTag code families.
#[derive(Parser)]
#[command(name = "deltag", version, arg_required_else_help = false)]
pub struct Deltag {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    verbosity: Verbosity,
}

#[derive(Subcommand)]
enum Command {
    /// Search for a family such as d25h7 and write its file
    #[command(after_help = gen_family::HELP, mut_arg("force", |arg| arg.help(gen_family::FORCE)))]
    GenFamily(gen_family::Args),
    /// Recompute the stated properties of family files from their codes
    #[command(after_help = verify_family::HELP)]
    VerifyFamily(verify_family::Args),
    /// Describe a family, or compute the distance between two
    Info(info::Args),
    /// List complexity rules: the number of codes that satisfy each rule, and its false-positive rate in natural images
    #[command(after_help = frontier::HELP)]
    Frontier(frontier::Args),
    /// Print upper bounds on the size of a family, and compare the shipped families with them
    Bounds(bounds::Args),
    /// Find the smallest shipped family for a target
    Plan(plan::Args),
    /// Print tags of a linear code by index in its enumeration, including those not listed in its file
    ByRank(by_rank::Args),
    /// Export a family for another program
    Export(export::Args),
    /// Create a family file from a table of another program
    #[command(after_help = import::HELP)]
    Import(import::Args),
    /// Draw tags of a family in one image
    Show(show::Args),
    /// Print tags of a family to scale, on as many pages as needed
    Sheet(sheet::Args),
    /// List the families that ship with the program
    List(list::Args),
    /// Generate shell completions
    Completions(shell::Completions),
    /// Write manual pages
    Man(shell::Man),
}

/// Runs the program.
pub fn run(deltag: Deltag) -> anyhow::Result<ExitCode> {
    deltag.verbosity.set();
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
