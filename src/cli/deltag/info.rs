use std::process::ExitCode;

use crate::family::{Family, bounds::bounds};

#[derive(clap::Args)]
pub(super) struct Args {
    /// A shipped family, or a family file
    family: String,
}

/// Tags on one face of the common targets: a 10 × 11 board, or a face of an icosahedron with 66
/// corners, when every third tile of every third row carries one.
const TAGS_PER_FACE: usize = 10;

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let family = Family::resolve(&args.family)?;
    let (bits, rules) = (family.dimension().bits(), family.rules());
    println!("{}, fingerprint {}", family.name(), family.fingerprint());
    println!("  codes           {}", family.len());
    println!("  bits            {bits} in {} rows", family.dimension().rows());
    println!("  distance        {}, corrects {} cells", family.distance(), family.correctable());
    println!(
        "  rules           {} % of neighbours differ, {} white and {} black cells at least",
        100.0 * rules.min_complexity,
        rules.black_distance,
        rules.white_distance
    );
    let construction = match serde_json::to_value(family.construction())? {
        serde_json::Value::Object(mut fields) => {
            let method = fields.remove("method").unwrap_or_default();
            let source = fields.remove("source").unwrap_or_default();
            [method, source].iter().filter_map(|v| v.as_str()).collect::<Vec<_>>().join(", ")
        }
        _ => String::new(),
    };
    println!("  construction    {construction}");
    println!(
        "  upper bound     {} codes (linear programming)",
        bounds(family.dimension(), family.distance()).linear_programming
    );
    println!(
        "  enough for      {} boards or {} icosahedra with {TAGS_PER_FACE} tags a face",
        family.len() / TAGS_PER_FACE,
        family.len() / (20 * TAGS_PER_FACE)
    );
    println!("  a random pattern is taken for a tag with probability");
    for (corrected, rate) in family.false_positive_rates().iter().enumerate() {
        println!("    {rate:>9.2e}  when {corrected} cells are corrected");
    }
    println!("  pairs of words, turns included, at each distance");
    let most = family.histogram().values().copied().max().unwrap_or(1) as f64;
    for (distance, pairs) in family.histogram() {
        let bar = "█".repeat((40.0 * *pairs as f64 / most).ceil() as usize);
        println!("    {distance:>3} {pairs:>12} {bar}");
    }
    Ok(ExitCode::SUCCESS)
}
