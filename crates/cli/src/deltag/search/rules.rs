//! The rules of a search: those of the published families, changed by a file, then by options.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::parameters::Parameters;
use deltille::family::{FamilyError, FreeCells, Robust, Rules};
use deltille::limits;

#[derive(clap::Args)]
pub struct RuleArgs {
    /// Fraction of edge-adjacent cell pairs that must differ in every code, 0 to 1 [default: 0.5]
    #[arg(long, value_name = "SHARE",
          value_parser = crate::values::number(0.0..=1.0))]
    min_complexity: Option<f64>,
    /// Minimum distance of every code from the all-black word (its minimum number of white cells)
    /// [default: the distance]
    #[arg(long, value_name = "CELLS",
          value_parser = crate::values::whole(0..=64u32))]
    black_distance: Option<u32>,
    /// Require the distance of every code from the all-white word to be at least that of the family
    #[arg(long)]
    reject_white: bool,
    /// Require a minimum distance even if some cells are hidden: apex (the 4 cells at any one
    /// corner), edge (the cells along any one edge) or tile (any triangle of 4 cells). Give the
    /// distance after an equals sign, such as edge=5 [default: 3]. Repeatable
    #[arg(long, value_name = "CELLS[=DISTANCE]")]
    robust_to: Vec<Robust>,
    /// Leave the centre cells unused, for a hole: one cell, or six with 9 and 36 bits
    #[arg(long, value_name = "centre")]
    free: Option<FreeCells>,
    /// TOML file with min_complexity, black_distance, white_distance, robust and free; options take precedence
    #[arg(long, value_name = "FILE")]
    rules: Option<PathBuf>,
}

impl RuleArgs {
    /// Whether the complexity is given.
    pub fn has_complexity(&self) -> bool {
        self.min_complexity.is_some()
    }

    /// Whether codes must be distinct with cells hidden.
    pub fn is_robust(&self) -> bool {
        !self.robust_to.is_empty()
    }

    /// Whether cells are left unused.
    pub fn has_free_cells(&self) -> bool {
        self.free.is_some()
    }

    /// Returns the rules, checked against the number of bits.
    pub fn rules(&self, parameters: Parameters) -> anyhow::Result<Rules> {
        let Parameters { dimension, distance } = parameters;
        let bits = dimension.bits();
        let mut rules = Rules::published(distance);
        if let Some(path) = &self.rules {
            read(path, &mut rules)?;
            check(&rules, bits, |field| format!("{}: field `{field}`", path.display()))?;
        }
        rules.min_complexity = self.min_complexity.unwrap_or(rules.min_complexity);
        rules.black_distance = self.black_distance.unwrap_or(rules.black_distance);
        if self.reject_white {
            rules.white_distance = distance;
        }
        rules.free = self.free.or(rules.free);
        if !self.robust_to.is_empty() {
            rules.robust.clone_from(&self.robust_to);
        }
        check(&rules, bits, |field| match field {
            "robust" => "--robust-to".to_owned(),
            field => format!("--{}", field.replace('_', "-")),
        })?;
        Ok(rules)
    }
}

fn check(rules: &Rules, bits: u32, place: impl Fn(&str) -> String) -> anyhow::Result<()> {
    match rules.check(bits) {
        Err(FamilyError::Field { field, problem }) => bail!("{}: {problem}", place(&field)),
        other => Ok(other?),
    }
}

/// Reads the fields of a rules file.
fn read(path: &Path, rules: &mut Rules) -> anyhow::Result<()> {
    let file = path.display();
    let text = limits::read_short_text(path, limits::MAX_SETTINGS_BYTES).context("--rules")?;
    let table: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
        let line = 1 + before.matches('\n').count();
        anyhow::anyhow!(
            "{file}: line {line} is not valid TOML ({}); expected lines such as min_complexity = 0.5",
            error.message()
        )
    })?;
    for (field, value) in &table {
        let cells = || {
            value.as_integer().and_then(|v| u32::try_from(v).ok()).with_context(|| {
                format!("{file}: field `{field}`: {value} is not a number of cells, such as 7")
            })
        };
        match field.as_str() {
            "min_complexity" => {
                let share = value.as_float().or(value.as_integer().map(|v| v as f64));
                rules.min_complexity = share.with_context(|| {
                    format!("{file}: field `{field}`: {value} is not a number between 0 and 1")
                })?;
            }
            "black_distance" => rules.black_distance = cells()?,
            "white_distance" => rules.white_distance = cells()?,
            "free" => {
                let free = value.as_str().and_then(|text| text.parse().ok());
                rules.free = Some(free.with_context(|| {
                    format!("{file}: field `{field}`: {value} is not \"centre\"")
                })?);
            }
            "robust" => {
                let texts = value.as_array().map(Vec::as_slice).unwrap_or_default();
                let parsed = texts.iter().map(|text| text.as_str()?.parse().ok());
                let robust = parsed.collect::<Option<Vec<Robust>>>().filter(|r| !r.is_empty());
                rules.robust = robust.with_context(|| {
                    format!(
                        "{file}: field `{field}`: {value} is not a list such as [\"edge\", \"apex=5\"]"
                    )
                })?;
            }
            _ => bail!(
                "{file}: unknown field `{field}` (known: min_complexity, black_distance, white_distance, robust, \
                 free)"
            ),
        }
    }
    Ok(())
}
