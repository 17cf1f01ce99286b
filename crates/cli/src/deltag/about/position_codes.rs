//! Output of `deltag` for position codes, which are not a family of individual tags.

use serde_json::json;

use crate::output::{self, ResultFormat, say};
use deltille::family::Family;
use deltille::family::positions::{BITS, BOARDS, POSITIONS, PatchCertificate, certify_positions};
use deltille_core::words::counted;

/// Prints a description of the position codes.
pub fn about(family: &Family, result_format: ResultFormat) -> anyhow::Result<()> {
    if result_format.is_json() {
        let patches = certify_positions().into_iter().map(|certificate| {
            let PatchCertificate { tiles, forms, least, .. } = certificate;
            json!({
                "tiles": tiles, "forms": forms, "from_places": least.places,
                "from_turned": least.turned, "from_mirrored": least.mirrored,
            })
        });
        return output::print_json(&json!({
            "name": family.name(), "fingerprint": family.fingerprint(), "bits": BITS,
            "boards": BOARDS, "positions": POSITIONS, "patches": patches.collect::<Vec<_>>(),
        }));
    }
    say!("{}, fingerprint {}", family.name(), family.fingerprint());
    say!("  position codes: any 3 × 4 adjacent upright tiles identify their position on the board");
    say!("  cells           {BITS} in a tile");
    say!("  boards          {BOARDS}, with ids from 0");
    say!("  positions       {POSITIONS} on each board, repeating after 256 edges");
    say!("  minimum distance between any two patches, in any position and rotation");
    say!("    tiles  forms  cells  corrected errors, and distance to mirrored patches");
    for certificate in certify_positions() {
        say!("{}", line(&certificate));
    }
    say!("  to print        deltille board --dense");
    Ok(())
}

fn line(certificate: &PatchCertificate) -> String {
    let least = certificate.least.places.min(certificate.least.turned);
    let mirrored = match certificate.least.mirrored {
        0 => "mirrored ones need more tiles".to_owned(),
        cells => format!("mirrored ones differ in {cells}"),
    };
    let PatchCertificate { tiles, forms, .. } = certificate;
    let corrected = least.saturating_sub(1) / 2;
    format!("    {tiles:>5}  {forms:>5}  {least:>5}  {corrected} corrected, {mirrored}")
}

/// Checks the claimed distances; returns whether they are met, and a description.
pub fn verify(family: &Family) -> (bool, String) {
    let certificates = certify_positions();
    let cells = |c: &PatchCertificate| c.least.places.min(c.least.turned);
    if let Some(broken) = certificates.iter().find(|certificate| !certificate.is_valid()) {
        let PatchCertificate { tiles, claimed, .. } = broken;
        let found = cells(broken);
        return (
            false,
            format!(
                "two patches of {tiles} tiles differ in {found} cells, but {claimed} are claimed"
            ),
        );
    }
    let distances = certificates
        .iter()
        .map(|c| format!("{} tiles: {}", c.tiles, counted(cells(c) as usize, "cell")));
    let distances = distances.collect::<Vec<_>>().join(", ");
    let mirrored = certificates.last().map_or(0, |certificate| certificate.least.mirrored);
    let what = format!(
        "{POSITIONS} positions on each of {BOARDS} boards; minimum distance between patches in any rotation: {distances}, \
         the last {mirrored} from mirrored ones; fingerprint {}",
        family.fingerprint()
    );
    (true, what)
}
