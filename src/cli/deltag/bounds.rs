use std::process::ExitCode;

use super::parameters::Parameters;
use crate::cli::output::say;
use crate::family::{self, Construction, bounds::bounds, shipped_names};
use crate::lattice::GridKind;

#[derive(clap::Args)]
pub(super) struct Args {
    /// Bits and distance, such as d25h7
    family: Parameters,
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let Parameters { dimension, distance } = args.family;
    let bounds = bounds(GridKind::Deltille, dimension, distance);
    // Better bounds may be known.
    say!("no family of {} bits and distance {distance} has more tags than", dimension.bits());
    say!("{:>12}  by linear programming (Delsarte)", bounds.linear_programming);
    say!("{:>12}  by sphere packing", bounds.sphere_packing);
    let least = bounds.linear_programming.min(bounds.sphere_packing);
    for name in shipped_names() {
        let family = family::resolve(name)?;
        if family.dimension() == dimension && family.distance() == distance {
            let share = 100.0 * family.len() as f64 / least as f64;
            say!("{:>12}  has {name}, {share:.1} % of the tighter bound", family.len());
            // What its file does not list.
            if let Construction::Algebraic(construction) = family.construction()
                && let Some((_, count)) = construction.by_rank(dimension, 0)
            {
                let share = 100.0 * count as f64 / least as f64;
                say!("{count:>12}  has {name} by rank, before the rules, {share:.1} %");
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}
