//! Shell completions and manual pages of both programs.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::{Command, CommandFactory};

use crate::output::{self, Overwrite, print, report};
use deltille_core::words::counted;

/// Examples at the end of the help of `deltille completions`.
pub const COMPLETIONS: &str = "Examples:
  deltille completions bash
  deltille completions zsh";
/// Examples at the end of the help of `deltille man`.
pub const MAN: &str = "Examples:
  deltille man -o man1";

/// Arguments of `completions`.
#[derive(clap::Args)]
pub struct Completions {
    /// Shell to generate completions for
    shell: clap_complete::Shell,
}

/// Arguments of `man`.
#[derive(clap::Args)]
pub struct Man {
    /// Output folder
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Prints the completion script of a program for a shell.
pub fn completions<P: CommandFactory>(args: Completions) -> anyhow::Result<ExitCode> {
    let mut command = P::command();
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, name, &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes a manual page for a program and for each of its commands.
pub fn man<P: CommandFactory>(args: Man) -> anyhow::Result<ExitCode> {
    output::check_folder(&args.output).context("-o")?;
    let mut program = P::command();
    program.build();
    let count = pages(&program, program.get_name(), &args.output, args.overwrite)?;
    report!("wrote {} to {}", counted(count, "page"), args.output.display());
    Ok(ExitCode::SUCCESS)
}

/// Writes the page of a command and those of its subcommands. Returns the number of pages.
fn pages(
    command: &Command,
    name: &str,
    folder: &Path,
    overwrite: Overwrite,
) -> anyhow::Result<usize> {
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut page)?;
    output::write(&folder.join(format!("{name}.1")), &page, overwrite).context("-o")?;
    let own = command.get_subcommands().filter(|own| own.get_name() != "help");
    let mut count = 1;
    for own in own {
        count += pages(own, &format!("{name}-{}", own.get_name()), folder, overwrite)?;
    }
    Ok(count)
}
