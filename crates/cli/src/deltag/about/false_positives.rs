//! What `deltag` says of false positives: by fair coins, and in natural pictures.

use serde_json::{Value, json};

use crate::output::say;
use deltille::family::{
    ACCEPTED_FALSE_POSITIVES, Family, NATURAL_FACTOR, TRIANGLES_PER_MEGAPIXEL, corrected_within,
};
use deltille_core::words::counted;

/// Adds the fields of `--json` to what is told of a family.
pub fn add_to(told: &mut Value, family: &Family) {
    let natural = family.natural_false_positive_rates();
    let per_megapixel = natural
        .as_ref()
        .map(|rates| rates.iter().map(|rate| rate * TRIANGLES_PER_MEGAPIXEL).collect::<Vec<_>>());
    told["false_positive_rate"] = json!(family.false_positive_rates());
    told["natural_false_positive_rate"] = json!(&natural);
    told["natural_false_positive_factor"] = json!(natural.as_ref().map(|_| NATURAL_FACTOR));
    told["natural_false_positives_per_megapixel_at_most"] = json!(per_megapixel);
    told["accepted_false_positive_rate"] = json!(ACCEPTED_FALSE_POSITIVES);
    told["recommended_correction"] = json!(recommended_correction(natural.as_deref()));
}

/// Says both rates for each number of corrected cells.
pub fn tell(family: &Family) -> anyhow::Result<()> {
    let natural = family.natural_false_positive_rates();
    say!("  a triangle with a border that is no tag is taken for one with probability");
    say!("    fair coins  natural pictures  when");
    for (corrected, rate) in family.false_positive_rates().iter().enumerate() {
        let natural =
            natural.as_ref().map_or("-".to_owned(), |all| format!("{:.1e}", all[corrected]));
        let corrected = match corrected {
            0 => "nothing is".to_owned(),
            1 => "1 cell is".to_owned(),
            n => format!("up to {n} cells are"),
        };
        say!("    {rate:>10.1e}  {natural:>16}  {corrected} corrected");
    }
    if natural.is_some() {
        say!("  rates in natural pictures are known within a factor of {NATURAL_FACTOR}");
    }
    say!(
        "  of a natural picture `detect` reads {TRIANGLES_PER_MEGAPIXEL} triangles in a megapixel, or fewer"
    );
    say!("  recommended     {}", recommended(natural.as_deref()));
    Ok(())
}

fn recommended_correction(natural: Option<&[f64]>) -> Option<u32> {
    corrected_within(natural?, ACCEPTED_FALSE_POSITIVES)
}

/// How many cells of a single tag may be corrected, by a family's natural rates.
pub fn recommended(natural: Option<&[f64]>) -> String {
    let rate = format!("{ACCEPTED_FALSE_POSITIVES:.0e}");
    match recommended_correction(natural) {
        Some(0) => format!(
            "whoever believes single tags corrects nothing: natural false positives below {rate}"
        ),
        Some(most) => format!(
            "whoever believes single tags corrects {} at most: natural false positives below {rate}",
            counted(most as usize, "cell")
        ),
        None => format!("believe no single tag: natural false positives are above {rate}"),
    }
}
