//! Prior knowledge of the intrinsics of a camera.

use crate::model::Model;
use deltille_core::camera::Camera;

/// Prior knowledge of the intrinsics of a camera.
#[derive(Clone, Debug, PartialEq)]
pub enum Intrinsics {
    /// Only the model is known; its parameters are estimated.
    Unknown(Model),
    /// All parameters are known and stay fixed.
    Known(Camera),
    /// All parameters are known approximately; some are estimated from these initial values.
    Near {
        /// The camera.
        camera: Camera,
        /// Which parameters are estimated, in the order of [`Camera::parameter_names`].
        free: Vec<bool>,
    },
}

impl From<Model> for Intrinsics {
    fn from(model: Model) -> Self {
        Self::Unknown(model)
    }
}

impl From<Camera> for Intrinsics {
    fn from(camera: Camera) -> Self {
        Self::Known(camera)
    }
}

impl Intrinsics {
    /// The model to estimate; `None` if a camera was given.
    pub fn model(&self) -> Option<Model> {
        match self {
            Self::Unknown(model) => Some(*model),
            Self::Known(_) | Self::Near { .. } => None,
        }
    }

    /// Which parameters are estimated.
    pub(crate) fn free(&self) -> Vec<bool> {
        match self {
            Self::Unknown(model) => model.free(),
            Self::Known(camera) => vec![false; camera.parameters().len()],
            Self::Near { free, .. } => free.clone(),
        }
    }
}
