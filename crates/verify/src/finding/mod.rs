//! Deviations of an artifact as values, each with its location and numbers.
//!
//! Input: the result of a comparison. Output: a [`Finding`], as a sentence and as JSON.
//!
//! 1. `construct` is about a file; `board`, `tile` and `mark` are about a page; `fold` is about a net.
//! 2. `mesh` is about meshes and bodies; `list` and `cut` are about files for other detectors and cutters.
//! 3. `any` is one of these, or a finding about the pages of a file.
//! 4. `shown` rounds numbers for all sentences.
//!
//! [`Finding`]: any::Finding

pub(super) mod any;
pub(super) mod board;
pub(super) mod construct;
pub(super) mod cut;
pub(super) mod fold;
pub(super) mod list;
pub(super) mod mark;
pub(super) mod mesh;
pub(super) mod shown;
pub(super) mod tile;
