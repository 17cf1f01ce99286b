//! The formats of detections: each is a line of a table, and a writer beside it.

use super::{csv, detection, orpc};
use crate::export::named::Format;
use crate::export::writing::kind::Kind;
use deltille_core::detection::Detection;
use deltille_core::targets::Target;

/// A format of detections.
#[derive(Clone, Copy)]
pub struct DetectionFormat {
    /// What it is asked for by, and the extension of its files.
    name: &'static str,
    help: &'static str,
    kind: fn() -> Kind,
    text: Option<Text>,
    /// Whether corners of one target only have a place in it.
    pub is_of_one_target: bool,
}

/// What writes a detection; the target is the one that was looked for.
type Text = fn(&Detection, Option<&Target>) -> String;

/// The formats.
pub const DETECTION_FORMATS: &[DetectionFormat] = &[
    DetectionFormat {
        name: "json",
        help: "Everything, one file per image",
        kind: || Kind::of_schema(detection::SCHEMA),
        text: Some(|found, _| detection::write(found)),
        is_of_one_target: false,
    },
    DetectionFormat {
        name: "orpc",
        help: "The corner list of the reference detector",
        kind: || Kind::of(orpc::HEAD.as_bytes()),
        text: Some(orpc::write),
        is_of_one_target: true,
    },
    DetectionFormat {
        name: "csv",
        help: "One corner a line, with a header",
        kind: || Kind::of(csv::HEADER.as_bytes()),
        text: Some(|found, _| csv::write(found)),
        is_of_one_target: false,
    },
    DetectionFormat {
        name: "parquet",
        help: "corners.parquet and pictures.parquet, a row for each corner and for each image of the run; `calibrate` \
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

    /// Whether each image has a file of its own; a table has rows for all.
    pub fn is_of_one_image(&self) -> bool {
        self.text.is_some()
    }

    /// The text of an image's file; a table has none.
    pub fn text(&self, found: &Detection, target: Option<&Target>) -> Option<String> {
        self.text.map(|text| text(found, target))
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
