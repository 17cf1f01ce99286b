//! False-positive rates that `deltag` reports: on random bits, and in natural images.

use serde_json::{Value, json};

use crate::output::say;
use deltille::family::{
    ACCEPTED_FALSE_POSITIVES, Family, NATURAL_FACTOR, TRIANGLES_PER_MEGAPIXEL, corrected_within,
};
use deltille_core::words::counted;

/// Adds the rates to the JSON description of a family.
pub fn add_to(described: &mut Value, family: &Family) {
    let natural = family.natural_false_positive_rates();
    let per_megapixel = natural
        .as_ref()
        .map(|rates| rates.iter().map(|rate| rate * TRIANGLES_PER_MEGAPIXEL).collect::<Vec<_>>());
    described["false_positive_rate"] = json!(family.false_positive_rates());
    described["natural_false_positive_rate"] = json!(&natural);
    described["natural_false_positive_factor"] = json!(natural.as_ref().map(|_| NATURAL_FACTOR));
    described["natural_false_positives_per_megapixel_at_most"] = json!(per_megapixel);
    described["accepted_false_positive_rate"] = json!(ACCEPTED_FALSE_POSITIVES);
    described["recommended_correction"] = json!(recommended_correction(natural.as_deref()));
}

/// Prints both rates for each number of corrected cells.
pub fn print(family: &Family) -> anyhow::Result<()> {
    let natural = family.natural_false_positive_rates();
    say!("  probability that a triangle with a border, but without a tag, is accepted as a tag");
    say!("    random bits   natural images  when correcting");
    for (corrected, rate) in family.false_positive_rates().iter().enumerate() {
        let natural =
            natural.as_ref().map_or("-".to_owned(), |all| format!("{:.1e}", all[corrected]));
        let corrected = match corrected {
            0 => "no cells".to_owned(),
            1 => "1 cell".to_owned(),
            n => format!("up to {n} cells"),
        };
        say!("    {rate:>11.1e}  {natural:>15}  {corrected}");
    }
    if natural.is_some() {
        say!("  rates in natural images are accurate to within a factor of {NATURAL_FACTOR}");
    }
    say!(
        "  in natural images, `detect` reads at most {TRIANGLES_PER_MEGAPIXEL} triangles per megapixel"
    );
    say!("  recommended     {}", recommended(natural.as_deref()));
    Ok(())
}

fn recommended_correction(natural: Option<&[f64]>) -> Option<u32> {
    corrected_within(natural?, ACCEPTED_FALSE_POSITIVES)
}

/// Returns the recommended number of corrected cells for single tags, from the natural rates of a family.
pub fn recommended(natural: Option<&[f64]>) -> String {
    let rate = format!("{ACCEPTED_FALSE_POSITIVES:.0e}");
    match recommended_correction(natural) {
        Some(0) => {
            format!("correct no cells in single tags: natural false-positive rate below {rate}")
        }
        Some(most) => format!(
            "correct at most {} in single tags: natural false-positive rate below {rate}",
            counted(most as usize, "cell")
        ),
        None => format!("do not accept single tags: natural false-positive rate above {rate}"),
    }
}
