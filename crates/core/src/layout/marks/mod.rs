//! What is printed beside a target, and how.
//!
//! In come sheets with their panels, out go the same with more on them: `label` (what the texts say), `logo` (an outline in the
//! margin), `tag_ids` (the id of each tag in small type), `guide` (a page of its own that says what to do with the others);
//! at the end `finish` (mirrored, in spot colours, with lines to cut along).

pub(in crate::layout) mod finish;
pub(in crate::layout) mod guide;
pub(in crate::layout) mod label;
pub(in crate::layout) mod logo;
pub(in crate::layout) mod tag_ids;

pub use finish::Finish;
pub use label::Label;
pub use logo::{Logo, LogoPlacement, MOST_LOGO_BYTES};
