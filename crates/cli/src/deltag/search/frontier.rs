//! `deltag frontier`.

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, bail};

use super::parameters::Parameters;
use crate::output::{self, ResultFormat, say};
use deltille::clock;
use deltille::family::search::best::{Best, Budget};
use deltille::family::{RuleChoice, Rules, best_rule, rule_choices};

/// Text at the end of `--help`.
pub const HELP: &str = "Evaluates the best known construction, from which gen-family starts. The rule marked \
    \"chosen\" is the one that `gen-family --false-positives` uses.";

#[derive(clap::Args)]
pub struct Args {
    /// Bits and distance, such as d36h9
    family: Parameters,
    #[command(flatten)]
    choice: ChoiceArgs,
    #[command(flatten)]
    result_format: ResultFormat,
}

/// Selection of the best rule.
#[derive(clap::Args)]
pub struct ChoiceArgs {
    /// Select the complexity rule that keeps the most codes with at most this false-positive rate,
    /// such as 1e-4. The rate is per black-bordered triangle in natural images, with the error
    /// correction of --corrects
    #[arg(long, value_name = "RATE",
          value_parser = crate::values::number(1e-15..=1.0))]
    pub false_positives: Option<f64>,
    /// Number of cells corrected in a single tag [default: half of the maximum for this distance]
    #[arg(long, value_name = "CELLS", requires = "false_positives",
          value_parser = crate::values::whole(0..=31u32))]
    pub corrects: Option<u32>,
}

impl ChoiceArgs {
    /// Returns the number of cells corrected in a single tag.
    pub fn corrected(&self, distance: u32) -> anyhow::Result<u32> {
        let most = (distance - 1) / 2;
        let corrected = self.corrects.unwrap_or(most / 2);
        if corrected > most {
            bail!(
                "--corrects: {corrected} exceeds the {most} cells that distance {distance} can correct"
            );
        }
        Ok(corrected)
    }

    /// Returns the best rule, or `None` if no selection was requested.
    pub fn best<'a>(
        &self,
        choices: &'a [RuleChoice],
        distance: u32,
    ) -> anyhow::Result<Option<&'a RuleChoice>> {
        let Some(accepted) = self.false_positives else { return Ok(None) };
        let corrected = self.corrected(distance)?;
        let found = best_rule(choices, corrected, accepted).with_context(|| {
            format!(
                "--false-positives: no rule reaches this rate in natural images with {corrected} cells corrected; lower \
                 --corrects or allow a higher rate"
            )
        });
        found.map(Some)
    }
}

/// Evaluates the complexity rules on the best known construction that satisfies the other `rules`.
pub fn choices(parameters: Parameters, rules: &Rules) -> anyhow::Result<Vec<RuleChoice>> {
    let Parameters { dimension, distance } = parameters;
    // With no time budget, only known constructions are used.
    let budget = Budget::Time(Duration::ZERO, clock::now);
    let any = Rules { min_complexity: 0.0, ..rules.clone() };
    let Some(start) = Best::new(dimension, distance, budget).rules(any).start() else {
        bail!(
            "no construction of {} bits and distance {distance} is known, so no rule can be selected",
            dimension.bits()
        );
    };
    Ok(rule_choices(dimension, distance, &start.codes))
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let distance = args.family.distance;
    let choices = choices(args.family, &Rules::published(distance))?;
    let best = args.choice.best(&choices, distance)?;
    if args.result_format.is_json() {
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
    say!("pairs    codes {corrected}   natural false-positive rate");
    for choice in &choices {
        let rates: String = choice.natural.iter().map(|rate| format!("{rate:>9.1e}")).collect();
        let mark = if best == Some(choice) { "   chosen" } else { "" };
        say!("{:>5} {:>8} {rates}{mark}", choice.min_pairs, choice.codes);
    }
    Ok(ExitCode::SUCCESS)
}
