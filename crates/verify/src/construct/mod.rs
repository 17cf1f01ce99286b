//! Inspection of the constructs of a file against a list of those that every viewer shows alike.
//!
//! Comes in: the bytes of a file. Goes out: what in it is not on the list; then it is not rendered.
//!
//! 1. `inspect` chooses the list by the format.
//! 2. `words` has the texts that a file must carry.
//! 3. `pages` has the lists of PDF and SVG, `meshes` those of meshes and bodies, `png` that of pages and textures.
//! 4. `findings` collects what is not on them. `text` and `zlib` read what all formats have in common.
//!
//! Rendering a file proves what one program shows. Scripts, animations, rules for print, layers,
//! blend modes, vertex colours or a second scene make other programs show something else. So each
//! format has a list of the constructs that its writer here uses and the reader interprets exactly;
//! anything else is named and refused, known as harmful or not.

pub(super) mod findings;
pub(super) mod inspect;
pub(super) mod meshes;
mod pages;
mod png;
mod text;
mod words;
mod zlib;
