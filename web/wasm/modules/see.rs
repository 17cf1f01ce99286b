//! Detects corners in grey values and webcam frames.

#![allow(unreachable_pub, reason = "the page is the only user of this interface")]

use deltille_core::detection::{Detection, InkEstimate, Watch};
use deltille_core::family::Family;
use deltille_core::lattice::GridKind;
use deltille_core::raster::{AnyGray, Colours, FileNotes, Gray};
use deltille_core::targets::Target;
use deltille_detect::{Detector, DetectorConfig, Tracker};
use deltille_files::export::{csv, detection, orpc};
use wasm_bindgen::prelude::*;

use deltille_web::errors::Raise;
use deltille_web::family::set_family;

/// An image for detection.
#[wasm_bindgen]
pub struct Picture {
    image: AnyGray,
    notes: FileNotes,
}

#[wasm_bindgen]
impl Picture {
    /// Makes an image of 8-bit or little-endian 16-bit grey values, row by row. `orientation` is the EXIF orientation, 1 if the
    /// image is upright.
    ///
    /// # Errors
    /// Throws if the number of bytes does not match width and height.
    pub fn of_grey(
        width: u32,
        height: u32,
        is_deep: bool,
        grey: Vec<u8>,
        orientation: u8,
    ) -> Result<Self, JsError> {
        let (width, height) = (width as usize, height as usize);
        let image = if is_deep {
            let (pairs, _) = grey.as_chunks();
            let values = pairs.iter().map(|&pair| u16::from_le_bytes(pair)).collect();
            Gray::from_vec(width, height, values).map(AnyGray::U16)
        } else {
            Gray::from_vec(width, height, grey).map(AnyGray::U8)
        };
        let exif_orientation = (orientation != 1).then_some(orientation);
        let notes = FileNotes { exif_orientation, ..FileNotes::default() };
        Ok(Self { image: image.ok_or_else(wrong_size)?, notes })
    }

    /// Makes an image of RGBA pixels, such as those of a video frame.
    ///
    /// # Errors
    /// Throws if the number of bytes does not match width and height.
    pub fn of_colours(width: u32, height: u32, rgba: &[u8]) -> Result<Self, JsError> {
        let colours = Colours::new(width as usize, height as usize, 4, rgba);
        let grey = colours.ok_or_else(wrong_size)?.grey();
        Ok(Self { image: AnyGray::U8(grey), notes: FileNotes::default() })
    }
}

fn wrong_size() -> JsError {
    JsError::new("the number of pixels does not match width and height")
}

/// Detects a target, or untagged boards.
#[wasm_bindgen]
pub struct Finder {
    detector: Detector,
    /// Follows targets in a video, once one is shown.
    tracker: Option<Tracker>,
    target: Option<Target>,
}

/// The detections in an image.
#[wasm_bindgen]
pub struct Found {
    detection: Detection,
    target: Option<Target>,
}

/// Returns the name of a target's tag family; nothing for a target without tags.
///
/// # Errors
/// Throws if `target` is not a valid description.
#[wasm_bindgen]
pub fn family_of(target: &str) -> Result<Option<String>, JsError> {
    Ok(Target::from_json(target).raise()?.family.map(|family| family.name))
}

#[wasm_bindgen]
impl Finder {
    /// Makes a finder for the target of a description. `family` is the content of the family file that [`family_of`] names.
    ///
    /// # Errors
    /// Throws if the description is invalid, or if the family does not match it.
    pub fn of_target(target: &str, family: Option<String>) -> Result<Self, JsError> {
        let mut target = Target::from_json(target).raise()?;
        set_family(&mut target, family)?;
        let detector = Detector::new(&target).raise()?;
        Ok(Self { detector, tracker: None, target: Some(target) })
    }

    /// Makes a finder for untagged boards of a tiling, `deltille` or `checker`. If rows and columns are given (not 0), boards
    /// that are completely visible are labelled.
    ///
    /// # Errors
    /// Throws if the tiling is unknown.
    pub fn of_grid(kind: &str, rows: u32, cols: u32) -> Result<Self, JsError> {
        let kind = match kind {
            "deltille" => GridKind::Deltille,
            "checker" => GridKind::Checker,
            _ => return Err(JsError::new("unknown tiling (known: deltille, checker)")),
        };
        let size = (rows > 0 && cols > 0).then_some((rows, cols));
        let detector = Detector::for_grid(kind, size, DetectorConfig::default());
        Ok(Self { detector, tracker: None, target: None })
    }

    /// Combines the ink estimates of several images of one print (JSON list) into one. Returns it as JSON and in words, or
    /// nothing if detecting again with it would change nothing.
    ///
    /// # Errors
    /// Throws if `found` is not a valid list of ink estimates.
    pub fn ink_of_all(&self, found: &str) -> Result<Option<Vec<String>>, JsError> {
        let found: Vec<Option<InkEstimate>> = serde_json::from_str(found).raise()?;
        let ink = self.detector.ink_of_all(&found);
        ink.map(|ink| Ok(vec![serde_json::to_string(&ink).raise()?, ink.to_string()])).transpose()
    }

    /// Returns a finder that uses this ink estimate.
    ///
    /// # Errors
    /// Throws if `ink` is not a valid ink estimate.
    pub fn with_ink(self, ink: &str) -> Result<Self, JsError> {
        let ink: InkEstimate = serde_json::from_str(ink).raise()?;
        Ok(Self { detector: self.detector.with_ink(ink), tracker: None, ..self })
    }

    /// Detects targets in an image.
    pub fn find(&self, picture: &Picture, name: &str) -> Found {
        let mut detection = self.detector.detect(&picture.image, name);
        detection.file = picture.notes.clone();
        Found { detection, target: self.target.clone() }
    }

    /// Detects targets in the next image of a video.
    pub fn follow(&mut self, picture: &Picture, name: &str) -> Found {
        let tracker = self.tracker.get_or_insert_with(|| Tracker::new(self.detector.clone()));
        let mut detection = tracker.detect(&picture.image, name);
        detection.file = picture.notes.clone();
        Found { detection, target: self.target.clone() }
    }
}

#[wasm_bindgen]
impl Found {
    /// Returns the detection as JSON, as `deltille detect` writes it.
    pub fn json(&self) -> String {
        detection::write(&self.detection)
    }

    /// Returns the detection as a CSV table.
    pub fn csv(&self) -> String {
        csv::write(&self.detection, &self.target.iter().collect::<Vec<_>>())
    }

    /// Returns the detection in the ORPC format of the reference detector.
    pub fn orpc(&self) -> String {
        orpc::write(&self.detection, self.target.as_ref())
    }

    /// Returns sentences that explain why nothing was found or labelled.
    pub fn reasons(&self) -> Vec<String> {
        self.detection.reasons.iter().map(deltille_web::errors::one_line).collect()
    }
}

/// Identifies targets by their tags.
#[wasm_bindgen]
pub struct Recogniser(deltille_detect::Recogniser);

#[wasm_bindgen]
impl Recogniser {
    /// Makes a recogniser for these family files.
    ///
    /// # Errors
    /// Throws if one of them is not a valid family file.
    #[wasm_bindgen(constructor)]
    pub fn new(families: Vec<String>) -> Result<Self, JsError> {
        let read = families.iter().map(|file| Family::from_json(file));
        let families = read.collect::<Result<Vec<_>, _>>().raise()?;
        Ok(Self(deltille_detect::Recogniser::new(families)))
    }

    /// Identifies the target in an image and returns JSON: its description, the number of decoded tags, and the numbers of
    /// corners of the target and in the image. Nothing if no target is identified.
    pub fn recognise(&self, picture: &Picture) -> Option<String> {
        let found = self.0.recognise(&picture.image)?;
        let [corners, shown] = found.corners;
        let said = serde_json::json!({
            "target": found.target.to_json(), "spec": found.target.spec, "tags": found.tags,
            "corners": corners, "shown": shown,
        });
        Some(said.to_string())
    }
}

/// Selects webcam frames that are worth keeping.
#[wasm_bindgen]
#[derive(Default)]
pub struct Watcher(Watch);

#[wasm_bindgen]
impl Watcher {
    /// Makes a watcher without history.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns whether the next frame is worth keeping: the target is still, and in a new position.
    pub fn observe(&mut self, found: &Found) -> bool {
        self.0.observe(&found.detection).is_worth_keeping()
    }
}
