//! The constraints on the parameters of a camera, in files of calibrations.

use serde::{Deserialize, Serialize};

use deltille_calibrate::{CameraEstimate, Constraint};

/// A constraint on the parameters of a camera.
#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(in crate::export) enum ConstraintRecord {
    Fixed { parameter: String, value: Option<f64> },
    Equal { parameters: Vec<String> },
    Prior { parameter: String, value: f64, sd: f64 },
}

impl ConstraintRecord {
    pub(in crate::export) fn read(self) -> Constraint {
        match self {
            Self::Fixed { parameter, value } => Constraint::Fixed { parameter, value },
            Self::Equal { parameters } => Constraint::Equal { parameters },
            Self::Prior { parameter, value, sd } => Constraint::Prior { parameter, value, sd },
        }
    }
}

/// The constraints of a camera, with the values of fixed parameters.
pub(in crate::export) fn constraints(camera: &CameraEstimate) -> Vec<ConstraintRecord> {
    let record = |of: &Constraint| match of.clone() {
        Constraint::Fixed { parameter, .. } => {
            let found = camera.parameters.iter().find(|p| p.name == parameter);
            ConstraintRecord::Fixed { parameter, value: found.map(|found| found.value) }
        }
        Constraint::Equal { parameters } => ConstraintRecord::Equal { parameters },
        Constraint::Prior { parameter, value, sd } => {
            ConstraintRecord::Prior { parameter, value, sd }
        }
    };
    camera.constraints.iter().map(record).collect()
}
