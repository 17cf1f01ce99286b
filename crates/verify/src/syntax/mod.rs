//! Inspection of a file against a list of constructs that every viewer renders the same way.
//!
//! Input: the bytes of a file. Output: the constructs that are not on the list; a file with such constructs is not
//! rendered.
//!
//! 1. `inspect` selects the list by the format.
//! 2. `words` contains the texts that a file must carry.
//! 3. `pages` contains the lists for PDF and SVG, `meshes` those for meshes and bodies, `png` that for pages and
//!    textures.
//! 4. `findings` collects the constructs that are not on the lists. `text` and `zlib` read the
//!    elements that several formats share.
//!
//! A rendering shows only how one program interprets a file. Scripts, animations, print rules,
//! layers, blend modes, vertex colours or a second scene make other programs show something else.
//! Each format therefore has a list of the constructs that its writer here uses and the reader
//! interprets exactly; any other construct is reported and rejected, even if it is not known to be
//! harmful.

pub(super) mod findings;
pub(super) mod inspect;
pub(super) mod meshes;
mod pages;
mod png;
mod text;
mod words;
mod zlib;
