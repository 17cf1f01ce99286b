//! What `deltag` tells of place codes, which are no family like others.

use serde_json::json;

use crate::output::{self, Telling, say};
use deltille::family::Family;
use deltille::family::places::{BITS, BOARDS, PLACES, PatchCertificate, certify_places};
use deltille_core::words::counted;

/// Tells all about them.
pub fn about(family: &Family, telling: Telling) -> anyhow::Result<()> {
    if telling.is_json() {
        let patches = certify_places().into_iter().map(|certificate| {
            let PatchCertificate { tiles, forms, least, .. } = certificate;
            json!({
                "tiles": tiles, "forms": forms, "from_places": least.places,
                "from_turned": least.turned, "from_mirrored": least.mirrored,
            })
        });
        return output::print_json(&json!({
            "name": family.name(), "fingerprint": family.fingerprint(), "bits": BITS,
            "boards": BOARDS, "places": PLACES, "patches": patches.collect::<Vec<_>>(),
        }));
    }
    say!("{}, fingerprint {}", family.name(), family.fingerprint());
    say!(
        "  of a kind of its own: every upright tile of a board tells, with some beside it, where it is"
    );
    say!("  cells           {BITS} in a tile");
    say!("  boards          {BOARDS}, by their ids from 0");
    say!("  places          {PLACES} on each, which come again after 256 edges");
    say!("  patches differ, wherever two of them are and however they are turned, at least in");
    say!("    tiles  forms  cells  told apart by counting, with errors corrected");
    for certificate in certify_places() {
        say!("{}", line(&certificate));
    }
    say!("  to print        deltille board --dense");
    Ok(())
}

fn line(certificate: &PatchCertificate) -> String {
    let least = certificate.least.places.min(certificate.least.turned);
    let mirrored = match certificate.least.mirrored {
        0 => "from mirrored ones by more tiles only".to_owned(),
        cells => format!("from mirrored ones in {cells}"),
    };
    let PatchCertificate { tiles, forms, .. } = certificate;
    let corrected = least.saturating_sub(1) / 2;
    format!("    {tiles:>5}  {forms:>5}  {least:>5}  {corrected} corrected, {mirrored}")
}

/// Whether what is claimed of them holds, and what was found.
pub fn verify(family: &Family) -> (bool, String) {
    let certificates = certify_places();
    let cells = |c: &PatchCertificate| c.least.places.min(c.least.turned);
    if let Some(broken) = certificates.iter().find(|certificate| !certificate.holds()) {
        let PatchCertificate { tiles, claimed, .. } = broken;
        let found = cells(broken);
        return (
            false,
            format!("two patches of {tiles} tiles differ in {found} cells, not {claimed}"),
        );
    }
    let distances = certificates
        .iter()
        .map(|c| format!("{} tiles in {}", c.tiles, counted(cells(c) as usize, "cell")));
    let distances = distances.collect::<Vec<_>>().join(", ");
    let mirrored = certificates.last().map_or(0, |certificate| certificate.least.mirrored);
    let what = format!(
        "{PLACES} places on each of {BOARDS} boards; any two patches, turned or not, differ: {distances} at least, \
         the last from mirrored ones in {mirrored}; fingerprint {}",
        family.fingerprint()
    );
    (true, what)
}
