//! Inspection of binary STL. Every reader must interpret the file the same way, so it may contain
//! only the header that the program writes, and triangles without attributes, which some readers
//! interpret as colours.

use crate::syntax::findings::Findings;
use deltille_files::export::stl::header;
use deltille_files::limits::Limits;

/// Number of bytes before the triangles, of a triangle, and of a triangle without its attributes.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;
const GEOMETRY: usize = 48;

/// Inspects a binary STL of the target with this name. Its reader reports a truncated file.
///
/// # Errors
///
/// Returns an error if there are more triangles than the limits allow.
pub(in crate::syntax) fn check(
    bytes: &[u8],
    name: &str,
    limits: &Limits,
) -> Result<Findings, String> {
    let count = bytes.len().saturating_sub(HEAD) / TRIANGLE;
    limits.check_nodes(count).map_err(|exceeded| exceeded.to_string())?;
    let mut found = Findings::default();
    let head = bytes.get(..80).is_none_or(|head| head == header(name));
    found.unless(head, "the header", "text other than the target's name");
    let triangles = bytes.get(HEAD..).unwrap_or_default().chunks_exact(TRIANGLE);
    let coloured = triangles.enumerate().find(|(_, triangle)| triangle[GEOMETRY..] != [0, 0]);
    if let Some((index, _)) = coloured {
        found.add(format!("triangle {index}"), "attribute bytes");
    }
    Ok(found)
}
