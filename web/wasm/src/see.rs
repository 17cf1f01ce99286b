//! Grey values, and frames of a webcam, to corners.

use deltille_core::detection::{Detection, InkEstimate, Watch};
use deltille_core::family::Family;
use deltille_core::lattice::GridKind;
use deltille_core::raster::{AnyGray, FileNotes, Gray, grey_of_colours};
use deltille_core::targets::Target;
use deltille_detect::{Detector, DetectorConfig};
use deltille_files::export::{csv, detection, orpc};
use wasm_bindgen::prelude::*;

use crate::errors::Raise;
use crate::family::set_family;

/// A picture that is looked at.
#[wasm_bindgen]
pub struct Picture {
    image: AnyGray,
    notes: FileNotes,
}

#[wasm_bindgen]
impl Picture {
    /// Grey values, row by row, of 8 bits, or of 16 with the lower byte first; `orientation` is how the file says that they
    /// are to be turned for a viewer, 1 if not at all.
    ///
    /// # Errors
    /// In words, where these are not as many bytes as width and height say.
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
        let notes = FileNotes { exif_orientation, damage: None };
        Ok(Self { image: image.ok_or_else(wrong_size)?, notes })
    }

    /// Pixels of red, green, blue and alpha, as of a frame of a video.
    ///
    /// # Errors
    /// In words, where these are not as many as width and height say.
    pub fn of_colours(width: u32, height: u32, rgba: &[u8]) -> Result<Self, JsError> {
        let grey = grey_of_colours::<4>(width, height, rgba).ok_or_else(wrong_size)?;
        Ok(Self { image: AnyGray::U8(grey), notes: FileNotes::default() })
    }
}

fn wrong_size() -> JsError {
    JsError::new("there are not as many pixels as width and height say")
}

/// Looks for a target, or for untagged boards.
#[wasm_bindgen]
pub struct Finder {
    detector: Detector,
    target: Option<Target>,
}

/// What was found in a picture.
#[wasm_bindgen]
pub struct Found {
    detection: Detection,
    target: Option<Target>,
}

/// The name of the family of a target's tags, where it has tags.
///
/// # Errors
/// In words, where it is no description of a target.
#[wasm_bindgen]
pub fn family_of(target: &str) -> Result<Option<String>, JsError> {
    Ok(Target::from_json(target).raise()?.family.map(|family| family.name))
}

#[wasm_bindgen]
impl Finder {
    /// Looks for the target of a description, with the file of the family that it names.
    ///
    /// # Errors
    /// In words, where it is no description, or the family is another one.
    pub fn of_target(target: &str, family: Option<String>) -> Result<Self, JsError> {
        let mut target = Target::from_json(target).raise()?;
        set_family(&mut target, family)?;
        let detector = Detector::new(&target).raise()?;
        Ok(Self { detector, target: Some(target) })
    }

    /// Looks for untagged boards of a tiling, `deltille` or `checker`. With rows and columns they are labelled where
    /// they are seen whole; 0 where these are not known.
    ///
    /// # Errors
    /// In words, where there is no such tiling.
    pub fn of_grid(kind: &str, rows: u32, cols: u32) -> Result<Self, JsError> {
        let kind = match kind {
            "deltille" => GridKind::Deltille,
            "checker" => GridKind::Checker,
            _ => return Err(JsError::new("the tiling is deltille or checker")),
        };
        let size = (rows > 0 && cols > 0).then_some((rows, cols));
        let detector = Detector::for_grid(kind, size, DetectorConfig::default());
        Ok(Self { detector, target: None })
    }

    /// What pictures of one print say together of its ink: of the list of what was found in each, as JSON, one estimate, and
    /// that in words. Nothing where a second look with it would find nothing else.
    ///
    /// # Errors
    /// In words, where it is no such list.
    pub fn ink_of_all(&self, found: &str) -> Result<Option<Vec<String>>, JsError> {
        let found: Vec<Option<InkEstimate>> = serde_json::from_str(found).raise()?;
        let ink = self.detector.ink_of_all(&found);
        ink.map(|ink| Ok(vec![serde_json::to_string(&ink).raise()?, ink.to_string()])).transpose()
    }

    /// One that looks again, with the ink that all pictures show.
    ///
    /// # Errors
    /// In words, where it is no estimate of ink.
    pub fn with_ink(self, ink: &str) -> Result<Self, JsError> {
        let ink: InkEstimate = serde_json::from_str(ink).raise()?;
        Ok(Self { detector: self.detector.with_ink(ink), ..self })
    }

    /// Looks at a picture.
    pub fn find(&self, picture: &Picture, name: &str) -> Found {
        let mut detection = self.detector.detect(&picture.image, name);
        detection.file = picture.notes.clone();
        Found { detection, target: self.target.clone() }
    }
}

#[wasm_bindgen]
impl Found {
    /// The detection as `deltille detect` writes it.
    pub fn json(&self) -> String {
        detection::write(&self.detection)
    }

    /// The same as a table.
    pub fn csv(&self) -> String {
        csv::write(&self.detection)
    }

    /// The same as the list that the reference detector writes.
    pub fn orpc(&self) -> String {
        orpc::write(&self.detection, self.target.as_ref())
    }

    /// Why nothing was found or labelled, in sentences.
    pub fn reasons(&self) -> Vec<String> {
        self.detection.reasons.iter().map(crate::errors::told).collect()
    }
}

/// Recognises targets by their tags.
#[wasm_bindgen]
pub struct Recogniser(deltille_detect::Recogniser);

#[wasm_bindgen]
impl Recogniser {
    /// One that knows the families of these files.
    ///
    /// # Errors
    /// In words, where one of them is no family file.
    #[wasm_bindgen(constructor)]
    pub fn new(families: Vec<String>) -> Result<Self, JsError> {
        let read = families.iter().map(|file| Family::from_json(file));
        let families = read.collect::<Result<Vec<_>, _>>().raise()?;
        Ok(Self(deltille_detect::Recogniser::new(families)))
    }

    /// The target that a picture shows, as JSON: its description, the tags that were read, how many corners it has and how
    /// many the picture shows. Nothing where none is known.
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

/// Says which frames of a webcam are worth keeping.
#[wasm_bindgen]
#[derive(Default)]
pub struct Watcher(Watch);

#[wasm_bindgen]
impl Watcher {
    /// One that has seen nothing.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Whether the next frame is worth keeping: the target is held still in it, somewhere new.
    pub fn look(&mut self, found: &Found) -> bool {
        self.0.look(&found.detection).is_worth_keeping()
    }
}
