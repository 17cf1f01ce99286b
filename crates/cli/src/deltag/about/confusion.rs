//! `deltag info A B`.

use anyhow::bail;
use serde_json::json;

use crate::output::{self, Telling, say};
use deltille::family::{Confusion, Family, PAIRS_COUNTED};

/// Tells how far the tags of two families are from each other.
pub fn about(of: &Family, other: &Family, telling: Telling) -> anyhow::Result<()> {
    let Some(confusion) = Confusion::between(of, other) else {
        let bits = [of, other].map(|family| family.dimension().bits());
        if bits[0] != bits[1] {
            bail!(
                "{} and {}: their tags have {} and {} cells, so that none is read as one of the other",
                of.name(),
                other.name(),
                bits[0],
                bits[1]
            );
        }
        bail!("more than {PAIRS_COUNTED} codes are not compared one by one");
    };
    let Confusion { direct, mirrored, .. } = &confusion;
    let within = |most: u32| [direct, mirrored].map(|all| all.range(..=most).map(|(_, n)| n).sum());
    let [t, u] = [of, other].map(Family::correctable);
    if telling.is_json() {
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
        "{} of {} codes, {} of {}, turned in all ways",
        of.name(),
        of.len(),
        other.name(),
        other.len()
    );
    say!("  pairs of a tag of each            as printed   in a mirror");
    let least =
        |all: &std::collections::BTreeMap<u32, u64>| all.keys().next().copied().unwrap_or(0);
    say!("  differ in so many cells at least  {:>10}  {:>12}", least(direct), least(mirrored));
    for most in 0..=t.max(u) {
        let [direct, mirrored]: [u64; 2] = within(most);
        let corrected = match most {
            0 => "are the same".to_owned(),
            n => format!("differ in {n} at most"),
        };
        say!("  {corrected:<32}  {direct:>10}  {mirrored:>12}");
    }
    say!(
        "  {} corrects {t}, {} {u}: pairs that differ in no more cells are taken for each other",
        of.name(),
        other.name()
    );
    Ok(())
}
