//! `deltag plan`.

use std::process::ExitCode;

use serde_json::Value;

use super::gen_family::{FILE_LIMIT, bytes_per_code};
use crate::deltag::about::false_positives;
use crate::output::{self, ResultFormat, say};
use crate::values::whole;
use deltille::family::{Family, NATURAL_FACTOR, ShippedFamily, shipped_names, smallest_shipped};
use deltille::lattice::GridKind;
use deltille_core::words::counted;

#[derive(clap::Args)]
pub struct Args {
    /// Number of faces, or of flat boards
    #[arg(long, default_value_t = 1,
          value_parser = whole(1..=u32::MAX))]
    faces: u32,
    /// Number of tags on each face
    #[arg(long, default_value_t = 10,
          value_parser = whole(1..=u32::MAX))]
    tags_per_face: u32,
    /// Number of misread cells per tag that the family must be able to correct
    #[arg(long, value_name = "CELLS", default_value_t = 0,
          value_parser = whole(0..=31u32))]
    corrects: u32,
    #[command(flatten)]
    result_format: ResultFormat,
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let needed = u64::from(args.faces) * u64::from(args.tags_per_face);
    let families = shipped_names().into_iter().map(Family::shipped);
    let mut families: Vec<Family> = families.collect::<Result<_, _>>()?;
    families.retain(|family| family.correctable() >= args.corrects);
    let largest = families.iter().max_by_key(|f| f.len());
    let Some(largest) = largest else {
        anyhow::bail!("--corrects {}: no shipped family corrects this many cells", args.corrects);
    };
    let Some(best) = smallest_shipped(GridKind::Deltille, needed, args.corrects) else {
        let (name, len) = (largest.name(), largest.len());
        let listed = FILE_LIMIT / bytes_per_code(largest.dimension());
        let instead = if largest.dimension().bits() >= 49 && needed <= listed / 2 {
            format!("create a larger file with `deltag gen-family {name}`, or lower")
        } else {
            "lower".to_owned()
        };
        let (kind, corrects) = match args.corrects {
            0 => (String::new(), ""),
            n => (format!(" that correct {}", counted(n as usize, "cell")), " or --corrects"),
        };
        anyhow::bail!(
            "{needed} tags{kind}: the largest shipped family, {name}, has {len}; {instead} \
             --faces or --tags-per-face{corrects}"
        );
    };
    let more = smallest_shipped(GridKind::Deltille, needed, best.correctable() + 1);
    if args.result_format.is_json() {
        output::print_json(&serde_json::json!({
            "tags": needed, "best": of(best)?, "corrects_more": more.map(of).transpose()?,
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let tags = counted(needed as usize, "tag");
    say!(
        "{} x {} = {tags}: {}",
        args.faces,
        args.tags_per_face,
        about(&Family::shipped(best.name)?)
    );
    // The next family, which corrects more with more bits.
    if let Some(more) = more {
        say!("to correct more errors, with smaller cells: {}", about(&Family::shipped(more.name)?));
    }
    Ok(ExitCode::SUCCESS)
}

/// Describes a family for `--json`.
fn of(family: &ShippedFamily) -> anyhow::Result<Value> {
    let mut described = serde_json::json!({
        "name": family.name, "bits": family.bits, "distance": family.distance,
        "codes": family.codes, "corrects": family.correctable(),
    });
    false_positives::add_to(&mut described, &Family::shipped(family.name)?);
    Ok(described)
}

fn about(family: &Family) -> String {
    let coins = family.false_positive_rates();
    let rates = family.natural_false_positive_rates();
    let last = |rates: &[f64]| rates.last().copied().unwrap_or_default();
    let [coins, natural] = [last(&coins), last(rates.as_deref().unwrap_or_default())];
    format!(
        "{}, {} codes of {} bits, distance {}; corrects {} cells, with false-positive rate {coins:.1e} for random bits and \
         {natural:.1e} for a bordered triangle in natural images (within a factor of {NATURAL_FACTOR}); {}",
        family.name(),
        family.len(),
        family.dimension().bits(),
        family.distance(),
        family.correctable(),
        false_positives::recommended(rates.as_deref())
    )
}
