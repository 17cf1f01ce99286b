use std::process::ExitCode;

use serde_json::{Value, json};

use super::{confusion, false_positives, position_codes};
use crate::deltag::named::resolve;
use crate::output::{self, ResultFormat, say};
use deltille::family::{self, Family, HiddenCells, PAIRS_COUNTED, TagWords};
use deltille::lattice::GridKind;
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TagSpec, Target, TargetSpec};
use deltille_core::words::counted;

#[derive(clap::Args)]
pub struct Args {
    /// A shipped family or a family file; given two, prints the distance between them
    #[arg(required = true, num_args = 1..=2, value_names = ["FAMILY", "OTHER"])]
    families: Vec<String>,
    #[command(flatten)]
    result_format: ResultFormat,
}

/// Rows and columns of the board used to express the size of a family; it is the board in the
/// Deltille publication.
const BOARD: [u32; 2] = [10, 11];

/// Counts the tags of a target with the default settings of `deltille`.
fn tags_of(spec: &TargetSpec) -> anyhow::Result<usize> {
    let family = Family::shipped(&TagSpec::default().family)?;
    let target = Target::build("probe", spec, Some(&family))?;
    Ok(target.panels.iter().map(|panel| panel.tags.len()).sum())
}

/// Returns the minimum distances with cells hidden, for families small enough to count all pairs.
fn without_hidden(family: &Family) -> Vec<(HiddenCells, u32)> {
    let known = family.len() <= PAIRS_COUNTED;
    let all = HiddenCells::ALL.into_iter().filter(|_| known);
    all.filter_map(|hidden| Some((hidden, family.distance_without(hidden)?))).collect()
}

/// Returns an upper bound on the number of codes, and how it was obtained.
fn upper_bound(family: &Family) -> (u64, &'static str) {
    let bounds = family.bounds();
    match bounds.found_none() {
        true => (bounds.sphere_packing, "sphere packing"),
        false => (bounds.linear_programming, "linear programming"),
    }
}

/// Returns the properties of a family as JSON.
fn described(family: &Family) -> Value {
    let (bound, _) = upper_bound(family);
    let mut described = json!({
        "name": family.name(), "fingerprint": family.fingerprint(), "codes": family.len(),
        "bits": family.dimension().bits(), "distance": family.distance(),
        "corrects": family.correctable(), "rules": family.rules(),
        "construction": family.construction(), "upper_bound": bound,
        "distance_histogram": family.histogram(),
    });
    let left = without_hidden(family);
    let left = left.iter().map(|(cells, left)| (cells.name().to_owned(), json!(left)));
    described["distance_without"] = left.collect::<serde_json::Map<_, _>>().into();
    described["beginnings"] = json!(family.beginnings());
    false_positives::add_to(&mut described, family);
    described
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    if let [of, other] = &args.families[..] {
        let [of, other] = [resolve(of)?, resolve(other)?];
        confusion::about(&of, &other, args.result_format)?;
        return Ok(ExitCode::SUCCESS);
    }
    let name = &args.families[0];
    let known = family::resolve(name)?;
    if known.is_position_family() {
        position_codes::about(&known, args.result_format)?;
        return Ok(ExitCode::SUCCESS);
    }
    let family = resolve(name)?;
    if args.result_format.is_json() {
        output::print_json(&described(&family))?;
        return Ok(ExitCode::SUCCESS);
    }
    print(&family)?;
    false_positives::print(&family)?;
    print_distances(&family)?;
    Ok(ExitCode::SUCCESS)
}

/// Prints the properties of a family.
fn print(family: &Family) -> anyhow::Result<()> {
    let (bits, rules) = (family.dimension().bits(), family.rules());
    let pairs = TagWords::new(family.dimension()).without(family.free_cells()).pairs();
    say!("{}, fingerprint {}", family.name(), family.fingerprint());
    say!("  codes           {}", family.len());
    say!("  bits            {bits} in {} rows", family.dimension().rows());
    say!("  distance        {}, corrects {} cells", family.distance(), family.correctable());
    if let Some(free) = rules.free {
        let cells = counted(family.free_cells().count_ones() as usize, "cell");
        say!("  free            {cells}, the {}: not used by any code", free.name());
    }
    for (hidden, left) in without_hidden(family) {
        let cells = hidden.count(family.dimension());
        let what = match hidden {
            HiddenCells::Apex => format!("the {cells} cells of a corner"),
            HiddenCells::Edge => format!("the {cells} cells along an edge"),
            _ => format!("any triangle of {cells} cells"),
        };
        let kept = rules.robust.iter().find(|rule| rule.to == hidden);
        let kept = kept.map_or(String::new(), |rule| format!(", required {}", rule.distance));
        say!("                  {left} with {what} hidden ({}{kept})", hidden.name());
    }
    for before in family.beginnings() {
        let (codes, fingerprint) = (before.codes, &before.fingerprint);
        say!("  extends         {codes} codes, fingerprint {fingerprint}");
    }
    say!(
        "  rules           every code: at least {} of {} adjacent cell pairs differ, {} cells white, \
         {} black",
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
    let of_cells = match family.free_cells().count_ones() {
        0 => String::new(),
        free => format!(", of the {} cells in use", bits - free),
    };
    let (bound, by) = upper_bound(family);
    say!("  upper bound     {bound} codes ({by}{of_cells})");
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
    Ok(())
}

/// Prints the histogram of distances between codes.
fn print_distances(family: &Family) -> anyhow::Result<()> {
    if family.histogram().is_empty() {
        say!("  distances       not counted for this many codes");
        return Ok(());
    }
    say!("  number of word pairs, all rotations included, by distance");
    let most = family.histogram().values().copied().max().unwrap_or(1) as f64;
    for (distance, pairs) in family.histogram() {
        let bar = "█".repeat((40.0 * *pairs as f64 / most).ceil() as usize);
        say!("    {distance:>3} {pairs:>12} {bar}");
    }
    Ok(())
}
