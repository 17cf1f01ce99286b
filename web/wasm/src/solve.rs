//! Corners to a camera and its page.

use deltille_core::calibrate::{Calibration, Intrinsics, Model, Reference, Words, views};
use deltille_core::targets::Target;
use deltille_files::export::calibration::{Print, Residuals};
use deltille_files::export::{calibration, camera, detection};
use deltille_files::report::Report;
use wasm_bindgen::prelude::*;

use crate::errors::{Raise, told};

/// A calibrated camera: its files and its page.
#[wasm_bindgen]
pub struct Solved {
    json: String,
    yaml: String,
    opencv: Option<String>,
    ros: Option<String>,
    page: String,
    said: Vec<String>,
    figures: String,
}

#[wasm_bindgen]
impl Solved {
    /// Calibrates a camera from detections (the JSON that was found in each picture) of a target.
    ///
    /// # Errors
    /// In words, where views are too few, too much alike, or do not belong together.
    #[wasm_bindgen(constructor)]
    pub fn new(
        target: &str,
        detections: Vec<String>,
        names: Vec<String>,
        model: &str,
    ) -> Result<Self, JsError> {
        let target = Target::from_json(target).raise()?;
        let reference = Reference::Target(&target);
        let model: Model = model.parse().raise()?;
        let read = detections
            .iter()
            .map(|text| detection::read(text))
            .collect::<Result<Vec<_>, _>>()
            .raise()?;
        let named: Vec<_> = names.into_iter().zip(read).collect();
        let shown = views(&named, &reference).raise()?;
        let calibration = Calibration::of(&reference, reference.panels()).camera(
            "camera",
            shown.views,
            Intrinsics::Unknown(model),
        );
        let mut estimate = calibration.solve().raise()?;
        let diagnoses = calibration.diagnose(&estimate);
        estimate.excluded.splice(0..0, shown.left_out.into_iter().map(|(_, out)| out));
        let found = estimate.cameras.first().ok_or_else(|| JsError::new("there is no camera"))?;
        let words = Words::new(&estimate, None);
        let said = diagnoses.iter().map(|diagnosis| told(&words.sentence(diagnosis))).collect();
        let mut page = Report::new("camera", &estimate);
        page.diagnoses = &diagnoses;
        let figures = serde_json::json!({
            "rms_px": found.rms_px, "views": found.views.len(), "corners": found.corner_count(),
            "names": found.camera.parameter_names(), "values": found.camera.parameters(),
            "sd": found.parameters.iter().map(|parameter| parameter.sd).collect::<Vec<_>>(),
            "projection_sd_px": found.projection_sd_px(None, deltille_core::calibrate::Source::Noise),
        });
        Ok(Self {
            json: calibration::write(&estimate, &diagnoses, Print::default(), Residuals::LeftOut)
                .unwrap_or_default(),
            yaml: found.camera.to_yaml(),
            opencv: camera::opencv(&found.camera).ok(),
            ros: camera::ros(&found.camera, "camera").ok(),
            page: page.html(),
            said,
            figures: figures.to_string(),
        })
    }

    /// The calibration as `deltille calibrate` writes it.
    pub fn json(&self) -> String {
        self.json.clone()
    }

    /// The camera file of the programs.
    pub fn yaml(&self) -> String {
        self.yaml.clone()
    }

    /// That of OpenCV, where it has such a lens.
    pub fn opencv(&self) -> Option<String> {
        self.opencv.clone()
    }

    /// That of ROS, where it has such a lens.
    pub fn ros(&self) -> Option<String> {
        self.ros.clone()
    }

    /// The page of the calibration.
    pub fn page(&self) -> String {
        self.page.clone()
    }

    /// What is to be said of it, in sentences.
    pub fn said(&self) -> Vec<String> {
        self.said.clone()
    }

    /// Its figures, as JSON.
    pub fn figures(&self) -> String {
        self.figures.clone()
    }
}
