//! The result of detection, as values: grids with their corners and tags (`values`), why labels are missing (`reason`), and what
//! was estimated of the camera's tone curve (`tone`) and of the ink on the print (`ink`).

pub(in crate::detect) mod ink;
pub(in crate::detect) mod reason;
pub(in crate::detect) mod tone;
pub(in crate::detect) mod values;
