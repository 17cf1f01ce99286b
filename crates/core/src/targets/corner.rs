//! A corner of a panel and its measured position.

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
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub panel_mm: DVec2,
    /// Position in the target frame, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub target_mm: DVec3,
    /// Measured position on the physical target, if available. The positions above are the planned ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<MeasuredPosition>,
}

impl Corner {
    /// Returns the measured offset from the planned position in the panel frame, mm; zero if not measured.
    pub fn offset_mm(&self) -> DVec3 {
        self.measured.map_or(DVec3::ZERO, |place| place.offset_mm)
    }
}

/// Measured position of a corner of a physical target, estimated from the views of a calibration.
///
/// Offsets are relative to the plan after it was fitted to the corners by position, rotation and scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredPosition {
    /// Offset from the plan, along the axes of the panel frame, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub offset_mm: DVec3,
    /// Covariance of the offset, mm²: xx, xy, xz, yy, yz, zz.
    #[serde(deserialize_with = "quantity::figure::de")]
    pub covariance_mm2: [f64; 6],
}
