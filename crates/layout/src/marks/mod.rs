//! Marks that are printed beside a target.
//!
//! The functions take sheets with panels and add marks to them: `label` (the texts), `logo` (an outline), `logo_room`
//! (its size in the margin), `tag_ids` (the id of each tag in small type).

pub(crate) mod label;
pub(crate) mod logo;
pub(crate) mod logo_room;
pub(crate) mod tag_ids;

pub use label::Label;
pub use logo::{Logo, LogoPlacement, MAX_LOGO_BYTES};
