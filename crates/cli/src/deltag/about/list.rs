use std::process::ExitCode;

use serde_json::json;

use crate::output::{self, ResultFormat, say};
use deltille::family::{self, positions, shipped_names};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    result_format: ResultFormat,
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let families = shipped_names().into_iter().map(family::resolve);
    let families = families.collect::<Result<Vec<_>, _>>()?;
    if args.result_format.is_json() {
        let listed = families.iter().map(|family| {
            json!({
                "name": family.name(), "bits": family.dimension().bits(), "distance": family.distance(),
                "codes": family.len(), "fingerprint": family.fingerprint(),
            })
        });
        let position_codes = json!({ "name": positions::NAME, "bits": positions::BITS, "boards": positions::BOARDS, "positions": positions::POSITIONS });
        output::print_json(&listed.chain([position_codes]).collect::<Vec<_>>())?;
        return Ok(ExitCode::SUCCESS);
    }
    say!("{:<12} {:>4} {:>8} {:>8}  fingerprint", "family", "bits", "distance", "codes");
    for family in families {
        say!(
            "{:<12} {:>4} {:>8} {:>8}  {}",
            family.name(),
            family.dimension().bits(),
            family.distance(),
            family.len(),
            family.fingerprint()
        );
    }
    say!(
        "{:<12} {:>4}   position codes of {} boards: `deltag info {0}`",
        positions::NAME,
        positions::BITS,
        positions::BOARDS
    );
    Ok(ExitCode::SUCCESS)
}
