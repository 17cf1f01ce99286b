//! The camera of a photograph, as its metadata name it.

use serde::{Deserialize, Serialize};

use crate::quantity;

/// Camera, lens and focal length of a photograph, from its EXIF metadata.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraNotes {
    /// Maker of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub make: Option<String>,
    /// Model of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Serial number of the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial: Option<String>,
    /// Model of the lens.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<String>,
    /// Focal length, mm; nominal, and rounded by most cameras.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::nominal_focal_mm::de"
    )]
    pub focal_mm: Option<f64>,
    /// Focal length with the same angle of view on 35 mm film, mm. It changes with a digital zoom, too.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::nominal_focal_mm::de"
    )]
    pub focal_35mm_mm: Option<f64>,
}

impl CameraNotes {
    /// Returns whether there are no notes.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
