//! An image as stored in a file: its pixels in either depth, and its metadata.

use serde::{Deserialize, Serialize};

use super::{CameraNotes, Gray};

/// Metadata of a photograph's file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileNotes {
    /// EXIF orientation, from 2 to 8: how a viewer rotates or flips the pixels; `None` if they are shown unchanged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exif_orientation: Option<u8>,
    /// The camera that the EXIF metadata name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraNotes>,
    /// Why some pixels do not come from the file, if it is damaged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damage: Option<String>,
}

impl FileNotes {
    /// Returns whether there are no notes.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// A grey image in the bit depth of its file.
#[derive(Clone, Debug, PartialEq)]
pub enum AnyGray {
    /// 8 bits.
    U8(Gray<u8>),
    /// 16 bits.
    U16(Gray<u16>),
}

impl AnyGray {
    /// Returns the width in pixels.
    pub fn width(&self) -> usize {
        match self {
            Self::U8(image) => image.width(),
            Self::U16(image) => image.width(),
        }
    }

    /// Returns the height in pixels.
    pub fn height(&self) -> usize {
        match self {
            Self::U8(image) => image.height(),
            Self::U16(image) => image.height(),
        }
    }
}
