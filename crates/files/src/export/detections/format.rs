//! The formats of detections: each has a row in a table and a writer in this folder.

use super::{csv, detection, orpc};
use crate::export::named::Format;
use crate::export::writing::kind::Kind;
use deltille_core::detection::Detection;
use deltille_core::targets::Target;

/// A format of detections.
#[derive(Clone, Copy)]
pub struct DetectionFormat {
    /// The name that selects the format, and the extension of its files.
    name: &'static str,
    help: &'static str,
    kind: fn() -> Kind,
    text: Option<Text>,
    /// Whether it can contain corners of one target only.
    pub is_of_one_target: bool,
}

/// Writer of a detection; the targets are those that were searched for.
type Text = fn(&Detection, &[&Target]) -> String;

/// The formats.
pub const DETECTION_FORMATS: &[DetectionFormat] = &[
    DetectionFormat {
        name: "json",
        help: "All results, one file per image",
        kind: || Kind::of_schema(detection::SCHEMA),
        text: Some(|found, _| detection::write(found)),
        is_of_one_target: false,
    },
    DetectionFormat {
        name: "orpc",
        help: "The corner list of the reference detector of Ha et al. (ICCV 2017)",
        kind: || Kind::of(orpc::HEAD.as_bytes()),
        text: Some(|found, targets| orpc::write(found, targets.first().copied())),
        is_of_one_target: true,
    },
    DetectionFormat {
        name: "csv",
        help: "One corner per line, with a header, its image and its position on the target",
        kind: || Kind::of(csv::HEADER.as_bytes()),
        text: Some(csv::write),
        is_of_one_target: false,
    },
    DetectionFormat {
        name: "parquet",
        help: "corners.parquet and images.parquet, with a row for each corner and for each image of the run; `calibrate` \
               and `rig` read them",
        kind: Kind::own_parquet,
        text: None,
        is_of_one_target: false,
    },
];

impl DetectionFormat {
    /// The kind of its files.
    pub fn kind(&self) -> Kind {
        (self.kind)()
    }

    /// Whether each image has its own file; a table has rows for all images.
    pub fn is_of_one_image(&self) -> bool {
        self.text.is_some()
    }

    /// Returns the text of an image's file; `None` for tables.
    pub fn text(&self, found: &Detection, targets: &[&Target]) -> Option<String> {
        self.text.map(|text| text(found, targets))
    }
}

impl Format for DetectionFormat {
    fn name(&self) -> &'static str {
        self.name
    }

    fn help(&self) -> String {
        self.help.to_owned()
    }
}
