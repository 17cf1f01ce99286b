//! What `deltag` tells of place codes, which are no family like others.

use crate::cli::output::say;
use crate::family::Family;
use crate::family::places::{BOARDS, PLACES, PatchCertificate, certify_places};

/// Tells all about them.
pub(super) fn about(family: &Family) -> anyhow::Result<()> {
    say!("{}, fingerprint {}", family.name(), family.fingerprint());
    say!(
        "  of a kind of its own: every upright tile of a board tells, with some beside it, where it is"
    );
    say!("  cells           9 in a tile");
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

/// Proves what is claimed of them, and tells it in a line; whether it holds.
pub(super) fn verify(family: &Family) -> anyhow::Result<bool> {
    let name = family.name();
    let certificates = certify_places();
    match certificates.iter().find(|certificate| !certificate.holds()) {
        Some(PatchCertificate { tiles, least, claimed, .. }) => {
            let found = least.places.min(least.turned);
            say!(
                "{name}: DOES NOT HOLD. Two patches of {tiles} tiles differ in {found} cells, not {claimed}"
            );
            Ok(false)
        }
        None => {
            let distances = certificates.iter().map(|c| {
                format!("{} tiles in {} cells", c.tiles, c.least.places.min(c.least.turned))
            });
            let distances = distances.collect::<Vec<_>>().join(", ");
            let mirrored = certificates.last().map_or(0, |certificate| certificate.least.mirrored);
            say!(
                "{name}: holds. {PLACES} places on each of {BOARDS} boards; any two patches, turned or not, differ: \
                 {distances} at least, the last from mirrored ones in {mirrored}; fingerprint {}",
                family.fingerprint()
            );
            Ok(true)
        }
    }
}
