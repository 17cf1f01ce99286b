use std::fmt::Write;
use std::process::ExitCode;

use anyhow::Context;

use crate::deltag::named::deltags;
use crate::output;
use crate::values::whole;
use deltille::family::{self, Construction, Screen, TagWords};

#[derive(clap::Args)]
pub struct Args {
    /// A shipped family such as d49h12, or a family file
    family: String,
    /// Index of the first tag in the enumeration, counted from 0
    #[arg(long, value_parser = whole(0..=u64::MAX))]
    rank: u64,
    /// Number of tags to print
    #[arg(long, default_value_t = 1,
          value_parser = whole(1..=u64::MAX))]
    count: u64,
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let family = deltags(family::resolve(&args.family)?)?;
    let Construction::Algebraic(construction) = family.construction() else {
        anyhow::bail!("{}: only codes of a linear family can be enumerated by index", args.family);
    };
    let words = TagWords::new(family.dimension());
    let screen = Screen::new(words.clone(), family.distance(), family.rules());
    for rank in args.rank..=args.rank.saturating_add(args.count - 1) {
        let (word, count) = construction.by_rank(family.dimension(), rank).with_context(|| {
            format!(
                "{}: the family is not a plain linear code, so its codes cannot be enumerated by index",
                args.family
            )
        })?;
        let word = word.with_context(|| {
            format!(
                "--rank {rank}: the family has {count} codes, with ranks from 0 to {}",
                count - 1
            )
        })?;
        // Checked before the first line is printed.
        let left = count - args.rank;
        anyhow::ensure!(
            args.count <= left,
            "--count {}: only {left} codes remain from --rank {}",
            args.count,
            args.rank
        );
        let mut line = format!("{rank} {}", words.hex(word));
        if !screen.admits(word) {
            line.push_str(" violates a rule of the family");
        }
        // Writing to a String cannot fail.
        let _ = writeln!(line);
        output::print(&line)?;
    }
    Ok(ExitCode::SUCCESS)
}
