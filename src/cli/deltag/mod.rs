//! `deltag`: search, check and list DelTag code families.

mod gen_family;
mod list;
mod verify_family;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Search, check and list DelTag code families.
#[derive(Parser)]
#[command(name = "deltag", version, arg_required_else_help = false)]
pub struct Deltag {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Search a family such as d25h7 and write its file
    GenFamily(gen_family::Args),
    /// Check every claim of a family file from nothing but its codes
    VerifyFamily(verify_family::Args),
    /// List the families that come with the program
    List(list::Args),
}

/// Runs the program.
pub fn run(deltag: Deltag) -> anyhow::Result<ExitCode> {
    match deltag.command {
        Command::GenFamily(args) => gen_family::run(args),
        Command::VerifyFamily(args) => verify_family::run(args),
        Command::List(args) => list::run(args),
    }
}
