use serde::Serialize;

/// Something seen that took no part, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Excluded {
    /// Name of the camera, in a rig; `None` where all its cameras are meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Name of the view, or of the frame of a rig.
    pub view: String,
    /// File name of the picture; empty where pictures of several cameras are meant.
    pub image: String,
    /// Id of the panel that is wrong in itself; `None` where the view does not fit as a whole.
    pub panel: Option<u32>,
    /// How many corners went.
    pub corners: usize,
    /// Why.
    pub reason: String,
}

impl Excluded {
    /// The view's name, in a rig with its camera's.
    pub fn shown(&self) -> String {
        match &self.camera {
            Some(camera) => format!("{} of camera {camera}", self.view),
            None => self.view.clone(),
        }
    }
}
