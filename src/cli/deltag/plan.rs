use std::process::ExitCode;

use crate::family::{Family, shipped_names, smallest_shipped};

#[derive(clap::Args)]
pub(super) struct Args {
    /// Faces of the target, or boards
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    faces: u32,
    /// Tags on each
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    tags_per_face: u32,
    /// Cells that may be misread in a tag, at least
    #[arg(long, default_value_t = 0)]
    corrects: u32,
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let needed = u64::from(args.faces) * u64::from(args.tags_per_face);
    let Some(family) = smallest_shipped(needed, args.corrects) else {
        let families = shipped_names().into_iter().map(Family::resolve);
        let families: Vec<Family> = families.collect::<Result<_, _>>()?;
        let correcting = families.iter().filter(|f| f.correctable() >= args.corrects);
        let largest = correcting.map(Family::len).max().unwrap_or(0);
        anyhow::bail!(
            "{needed} tags that correct {} cells: the largest shipped family has {largest}; lower \
             --faces, --tags-per-face or --corrects",
            args.corrects
        );
    };
    println!(
        "{}: {} codes for {needed} tags, {} bits, distance {}, corrects {} cells",
        family.name(),
        family.len(),
        family.dimension().bits(),
        family.distance(),
        family.correctable()
    );
    Ok(ExitCode::SUCCESS)
}
