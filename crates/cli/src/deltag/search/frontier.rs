//! `deltag frontier`.

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, bail};

use super::parameters::Parameters;
use crate::output::{self, Telling, say};
use deltille::clock;
use deltille::family::search::best::{Best, Budget};
use deltille::family::{RuleChoice, Rules, best_rule, rule_choices};

/// Told at the end of `--help`.
pub const HELP: &str = "The construction is the best on record, that gen-family starts from. \
    `gen-family --false-positives` takes the rule that is marked.";

#[derive(clap::Args)]
pub struct Args {
    /// Bits and distance, such as d36h9
    family: Parameters,
    #[command(flatten)]
    choice: ChoiceArgs,
    #[command(flatten)]
    telling: Telling,
}

/// Which of the rules is the best.
#[derive(clap::Args)]
pub struct ChoiceArgs {
    /// Choose the rule for complexity that leaves the most codes with so many natural false positives
    /// for each triangle with a border, such as 1e-4, where --corrects cells are corrected
    #[arg(long, value_name = "RATE", allow_negative_numbers = true,
          value_parser = crate::values::number(1e-15..=1.0))]
    pub false_positives: Option<f64>,
    /// Cells that are corrected in a single tag [default: half of what the distance allows]
    #[arg(long, value_name = "CELLS", requires = "false_positives", allow_negative_numbers = true,
          value_parser = crate::values::whole(0..=31u32))]
    pub corrects: Option<u32>,
}

impl ChoiceArgs {
    /// Cells that are corrected in a single tag.
    pub fn corrected(&self, distance: u32) -> anyhow::Result<u32> {
        let most = (distance - 1) / 2;
        let corrected = self.corrects.unwrap_or(most / 2);
        if corrected > most {
            bail!(
                "--corrects: {corrected} is more than the {most} cells that distance {distance} corrects"
            );
        }
        Ok(corrected)
    }

    /// The best of the rules; `None` where none is asked for.
    pub fn best<'a>(
        &self,
        choices: &'a [RuleChoice],
        distance: u32,
    ) -> anyhow::Result<Option<&'a RuleChoice>> {
        let Some(accepted) = self.false_positives else { return Ok(None) };
        let corrected = self.corrected(distance)?;
        let found = best_rule(choices, corrected, accepted).with_context(|| {
            format!(
                "--false-positives: with {corrected} corrected no code is so rare in natural pictures; lower --corrects \
                 or accept more"
            )
        });
        found.map(Some)
    }
}

/// What rules for complexity leave of the best construction on record, whose other rules are these.
pub fn choices(parameters: Parameters, rules: &Rules) -> anyhow::Result<Vec<RuleChoice>> {
    let Parameters { dimension, distance } = parameters;
    // No time is spent: what is on record is not searched for.
    let budget = Budget::Time(Duration::ZERO, clock::now);
    let any = Rules { min_complexity: 0.0, ..rules.clone() };
    let Some(start) = Best::new(dimension, distance, budget).rules(any).start() else {
        bail!(
            "no construction of {} bits and distance {distance} is on record: rules are chosen for one that is",
            dimension.bits()
        );
    };
    Ok(rule_choices(dimension, distance, &start.codes))
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let distance = args.family.distance;
    let choices = choices(args.family, &Rules::published(distance))?;
    let best = args.choice.best(&choices, distance)?;
    if args.telling.is_json() {
        let of = |choice: &RuleChoice| {
            serde_json::json!({
                "min_pairs": choice.min_pairs, "min_complexity": choice.min_complexity,
                "codes": choice.codes, "natural_false_positive_rate": choice.natural,
            })
        };
        output::print_json(&serde_json::json!({
            "bits": args.family.dimension.bits(), "distance": distance,
            "choices": choices.iter().map(of).collect::<Vec<_>>(),
            "best": best.map(of),
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let corrected: String =
        (0..=(distance - 1) / 2).map(|cells| format!("{:>9}", format!("{cells} corr."))).collect();
    say!("pairs    codes {corrected}   natural false positives");
    for choice in &choices {
        let rates: String = choice.natural.iter().map(|rate| format!("{rate:>9.1e}")).collect();
        let mark = if best == Some(choice) { "   chosen" } else { "" };
        say!("{:>5} {:>8} {rates}{mark}", choice.min_pairs, choice.codes);
    }
    Ok(ExitCode::SUCCESS)
}
