//! A corner of a panel, and where it was measured.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::quantity;

/// A vertex of a panel where all tiles meet (six of a deltille, four of a checkerboard).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Corner {
    /// Id of the corner, unique within the target.
    pub id: u32,
    /// Lattice row.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub row: i32,
    /// Lattice column.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub col: i32,
    /// Position in the panel frame, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub panel_mm: DVec2,
    /// Position in the target frame, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub target_mm: DVec3,
    /// Where it is on the target that was made, where that was measured. The positions above are those of
    /// the plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<MeasuredPlace>,
}

impl Corner {
    /// How far from its place in the plan it is, in the panel frame, mm; zero where that was not measured.
    pub fn offset_mm(&self) -> DVec3 {
        self.measured.map_or(DVec3::ZERO, |place| place.offset_mm)
    }
}

/// Where a corner of a target that was made is, as the views of a calibration have it.
///
/// Offsets are relative to the plan where it fits the corners best, in any place and turn and at any scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredPlace {
    /// Offset from the plan, along the axes of the panel frame, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub offset_mm: DVec3,
    /// Covariance of that, mm²: xx, xy, xz, yy, yz, zz.
    #[serde(deserialize_with = "quantity::figure::de")]
    pub covariance_mm2: [f64; 6],
}
