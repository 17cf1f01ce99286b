use sha2::{Digest, Sha256};

use crate::family::{FreeCells, TagWords};
use crate::lattice::{Dimension, GridKind};

/// See [`Family::fingerprint`].
pub(in crate::family) fn fingerprint(
    kind: GridKind,
    dimension: Dimension,
    distance: u32,
    free: Option<FreeCells>,
    codes: &[u64],
) -> String {
    let words = TagWords::of(kind, dimension);
    let mut hash = Sha256::new();
    let kind = if kind == GridKind::Checker { "kind checker\n" } else { "" };
    hash.update(format!("deltille/family\n{kind}bits {}\ndistance {distance}\n", dimension.bits()));
    if let Some(free) = free {
        hash.update(format!("free {}\n", free.name()));
    }
    for &code in codes {
        hash.update(words.hex(code));
        hash.update("\n");
    }
    hash.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect()
}
