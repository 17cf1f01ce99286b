use std::process::ExitCode;

use serde_json::Value;

use super::{confusion, false_positives, place_codes};
use crate::cli::output::{self, Telling, say};
use crate::family::{self, Family, TagWords, bounds::bounds};
use crate::lattice::GridKind;
use crate::targets::{BoardSpec, SolidShape, SolidSpec, TagSpec, Target, TargetSpec};
use crate::words::counted;

#[derive(clap::Args)]
pub(super) struct Args {
    /// A shipped family, or a family file; of two it is told how far they are from each other
    #[arg(required = true, num_args = 1..=2, value_names = ["FAMILY", "OTHER"])]
    families: Vec<String>,
    #[command(flatten)]
    telling: Telling,
}

/// Rows and columns of the board that coverage is told in, that of the paper.
const BOARD: [u32; 2] = [10, 11];

/// How many tags a target takes with the settings that `deltille` has by default.
fn tags_of(spec: &TargetSpec) -> anyhow::Result<usize> {
    let family = Family::shipped(&TagSpec::default().family)?;
    let target = Target::build("probe", spec, Some(&family), None)?;
    Ok(target.panels.iter().map(|panel| panel.tags.len()).sum())
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    if let [of, other] = &args.families[..] {
        let [of, other] = [super::resolve(of)?, super::resolve(other)?];
        confusion::about(&of, &other, args.telling)?;
        return Ok(ExitCode::SUCCESS);
    }
    let name = &args.families[0];
    let known = family::resolve(name)?;
    if known.is_of_places() {
        place_codes::about(&known, args.telling)?;
        return Ok(ExitCode::SUCCESS);
    }
    let family = super::resolve(name)?;
    if args.telling.is_json() {
        let bounds = bounds(family.kind(), family.dimension(), family.distance());
        let mut told = serde_json::json!({
            "name": family.name(), "fingerprint": family.fingerprint(), "codes": family.len(),
            "bits": family.dimension().bits(), "distance": family.distance(),
            "corrects": family.correctable(), "rules": family.rules(),
            "construction": family.construction(), "upper_bound": bounds.linear_programming,
            "distance_histogram": family.histogram(),
        });
        false_positives::add_to(&mut told, &family);
        output::print_json(&told)?;
        return Ok(ExitCode::SUCCESS);
    }
    let (bits, rules) = (family.dimension().bits(), family.rules());
    let pairs = TagWords::new(family.dimension()).pairs();
    say!("{}, fingerprint {}", family.name(), family.fingerprint());
    say!("  codes           {}", family.len());
    say!("  bits            {bits} in {} rows", family.dimension().rows());
    say!("  distance        {}, corrects {} cells", family.distance(), family.correctable());
    say!(
        "  rules           every code: {} of {} neighbouring pairs of cells differ, {} cells are white, \
         {} black, at least",
        (rules.min_complexity * f64::from(pairs) - 1e-9).ceil(),
        pairs,
        rules.black_distance,
        rules.white_distance
    );
    let construction = match serde_json::to_value(family.construction())? {
        Value::Object(mut fields) => {
            let method = fields.remove("method").unwrap_or_default();
            let source = fields.remove("source").unwrap_or_default();
            [method, source].iter().filter_map(|v| v.as_str()).collect::<Vec<_>>().join(", ")
        }
        _ => String::new(),
    };
    say!("  construction    {construction}");
    say!(
        "  upper bound     {} codes (linear programming)",
        bounds(family.kind(), family.dimension(), family.distance()).linear_programming
    );
    let [rows, cols] = BOARD;
    let board = tags_of(&TargetSpec::Board(BoardSpec::new(GridKind::Deltille, rows, cols, 20.0)))?;
    let solid = tags_of(&TargetSpec::Solid(SolidSpec::new(SolidShape::Icosahedron)))?;
    let solids = match family.len() / solid {
        1 => "1 icosahedron".to_owned(),
        n => format!("{n} icosahedra"),
    };
    say!(
        "  enough for      {} of {rows} x {cols} corners ({board} tags each) or {solids} ({solid} tags each)",
        counted(family.len() / board, "board")
    );
    false_positives::tell(&family)?;
    if family.histogram().is_empty() {
        say!("  distances       of so many codes are not counted");
        return Ok(ExitCode::SUCCESS);
    }
    say!("  pairs of words, turns included, at each distance");
    let most = family.histogram().values().copied().max().unwrap_or(1) as f64;
    for (distance, pairs) in family.histogram() {
        let bar = "█".repeat((40.0 * *pairs as f64 / most).ceil() as usize);
        say!("    {distance:>3} {pairs:>12} {bar}");
    }
    Ok(ExitCode::SUCCESS)
}
