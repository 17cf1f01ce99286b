//! `deltag info A B`.

use anyhow::bail;
use serde_json::json;

use crate::output::{self, ResultFormat, say};
use deltille::family::{Confusion, Family, PAIRS_COUNTED};

/// Reports the minimum distance between the tags of two families.
pub fn about(of: &Family, other: &Family, result_format: ResultFormat) -> anyhow::Result<()> {
    let Some(confusion) = Confusion::between(of, other) else {
        let bits = [of, other].map(|family| family.dimension().bits());
        if bits[0] != bits[1] {
            bail!(
                "{} and {}: their tags have {} and {} cells, so they cannot be confused",
                of.name(),
                other.name(),
                bits[0],
                bits[1]
            );
        }
        bail!("cannot compare families of more than {PAIRS_COUNTED} codes");
    };
    let Confusion { direct, mirrored, .. } = &confusion;
    let within = |most: u32| [direct, mirrored].map(|all| all.range(..=most).map(|(_, n)| n).sum());
    let [t, u] = [of, other].map(Family::correctable);
    if result_format.is_json() {
        return output::print_json(&json!({
            "families": [of.name(), other.name()],
            "corrects": [t, u],
            "least_distance": direct.keys().next(),
            "least_mirrored_distance": mirrored.keys().next(),
            "distance_histogram": direct,
            "mirrored_distance_histogram": mirrored,
        }));
    }
    say!(
        "{} of {} codes, {} of {}, in all rotations",
        of.name(),
        of.len(),
        other.name(),
        other.len()
    );
    say!("  pairs of one tag of each          as printed      mirrored");
    let least =
        |all: &std::collections::BTreeMap<u32, u64>| all.keys().next().copied().unwrap_or(0);
    say!("  minimum distance in cells         {:>10}  {:>12}", least(direct), least(mirrored));
    for most in 0..=t.max(u) {
        let [direct, mirrored]: [u64; 2] = within(most);
        let corrected = match most {
            0 => "are identical".to_owned(),
            n => format!("differ in at most {n} cells"),
        };
        say!("  {corrected:<32}  {direct:>10}  {mirrored:>12}");
    }
    say!(
        "  {} corrects {t} cells and {} corrects {u}: tags that differ in no more can be confused",
        of.name(),
        other.name()
    );
    Ok(())
}
