use std::process::ExitCode;

use super::parameters::Parameters;
use crate::output::{self, ResultFormat, say};
use deltille::family::{
    self, Construction, bounds::bounds, invariant_bound, published_bounds, shipped_names,
};
use deltille::lattice::{GridKind, TagCells};

#[derive(clap::Args)]
pub struct Args {
    /// Bits and distance, such as d25h7
    family: Parameters,
    #[command(flatten)]
    result_format: ResultFormat,
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let Parameters { dimension, distance } = args.family;
    let bounds = bounds(GridKind::Deltille, dimension, distance);
    let found_none = bounds.found_none();
    let linear = (!found_none).then_some(bounds.linear_programming);
    let published = published_bounds(&TagCells::new(dimension), distance);
    let least = bounds.linear_programming.min(bounds.sphere_packing);
    let least = published.map_or(least, |published| least.min(published.most_tags));
    let invariant = invariant_bound(dimension, distance);
    let least = invariant.map_or(least, |invariant| least.min(invariant));
    let mut shipped = Vec::new();
    for name in shipped_names() {
        let family = family::resolve(name)?;
        if family.dimension() == dimension && family.distance() == distance {
            // Number of codes by rank, which the file does not list.
            let by_rank = match family.construction() {
                Construction::Algebraic(construction) => construction.by_rank(dimension, 0),
                _ => None,
            };
            shipped.push((name, family.len(), by_rank.map(|(_, count)| count)));
        }
    }
    if args.result_format.is_json() {
        let shipped = shipped.iter().map(|(name, codes, by_rank)| {
            serde_json::json!({ "name": name, "codes": codes, "by_rank_before_rules": by_rank })
        });
        output::print_json(&serde_json::json!({
            "bits": dimension.bits(), "distance": distance,
            "linear_programming": linear, "sphere_packing": bounds.sphere_packing,
            "invariant_codes": invariant,
            "published": published.map(|known| serde_json::json!({
                "most_tags": known.most_tags, "most_words": known.most_words,
                "known_words": known.known_words,
            })),
            "shipped": shipped.collect::<Vec<_>>(),
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    say!(
        "upper bounds on the number of tags with {} bits and distance {distance}",
        dimension.bits()
    );
    match linear {
        Some(linear) => say!("{linear:>12}  by linear programming (Delsarte)"),
        None => {
            say!("{:>12}  by linear programming (Delsarte): no verifiable bound", "none")
        }
    }
    say!("{:>12}  by sphere packing", bounds.sphere_packing);
    if let Some(known) = published {
        say!(
            "{:>12}  by Brouwer's tables: a third of {} words; the largest known code, whether closed under rotation \
             or not, has {}",
            known.most_tags,
            known.most_words,
            known.known_words
        );
    }
    if let Some(invariant) = invariant {
        say!(
            "{invariant:>12}  by semidefinite programming, for codes that are closed under rotation"
        );
    }
    for (name, codes, by_rank) in shipped {
        let share = |codes: f64| 100.0 * codes / least as f64;
        say!("{codes:>12}  in {name}, {:.1} % of the tightest bound", share(codes as f64));
        if let Some(count) = by_rank {
            let share = share(count as f64);
            say!("{count:>12}  in {name} by rank, before applying the rules, {share:.1} %");
        }
    }
    Ok(ExitCode::SUCCESS)
}
