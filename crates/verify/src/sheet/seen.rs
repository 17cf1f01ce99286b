//! Where the corners of panels were detected on a sheet.

use std::collections::BTreeMap;

use glam::DVec2;

/// Positions of the corners detected on a sheet, mm in the frame of the sheet: by panel id, then by
/// corner id.
pub(crate) type Seen = BTreeMap<u32, BTreeMap<u32, DVec2>>;
