//! What is printed beside a target.
//!
//! In come sheets with their panels, out go the same with more on them: `label` (what the texts say), `logo` (an outline) and
//! `logo_room` (how large it becomes in the margin), `tag_ids` (the id of each tag in small type).

pub(crate) mod label;
pub(crate) mod logo;
pub(crate) mod logo_room;
pub(crate) mod tag_ids;

pub use label::Label;
pub use logo::{Logo, LogoPlacement, MOST_LOGO_BYTES};
