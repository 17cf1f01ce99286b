use std::process::ExitCode;

use crate::family::{Family, shipped_names};

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
    let families: Vec<Family> =
        shipped_names().into_iter().map(Family::resolve).collect::<Result<_, _>>()?;
    // Fewest bits give the largest cells; among these the greatest distance is the safest.
    let best = families
        .iter()
        .filter(|f| f.len() as u64 >= needed && f.correctable() >= args.corrects)
        .min_by_key(|f| (f.dimension().bits(), std::cmp::Reverse(f.distance()), f.len()));
    let Some(family) = best else {
        let largest = families
            .iter()
            .filter(|f| f.correctable() >= args.corrects)
            .map(Family::len)
            .max()
            .unwrap_or(0);
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
