//! A picture as a file holds it: either depth, and what the file says beside its pixels.

use serde::{Deserialize, Serialize};

use super::Gray;

/// What the file of a photograph says beside its pixels.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileNotes {
    /// How EXIF says that the pixels are to be turned for a viewer, from 2 to 8; `None` if not at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exif_orientation: Option<u8>,
    /// Why some pixels do not come from the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damage: Option<String>,
}

impl FileNotes {
    /// Whether there is nothing to say.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// A grey image in the depth of its file.
#[derive(Clone, Debug, PartialEq)]
pub enum AnyGray {
    /// 8 bits.
    U8(Gray<u8>),
    /// 16 bits.
    U16(Gray<u16>),
}

impl AnyGray {
    /// Width in pixels.
    pub fn width(&self) -> usize {
        match self {
            Self::U8(image) => image.width(),
            Self::U16(image) => image.width(),
        }
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        match self {
            Self::U8(image) => image.height(),
            Self::U16(image) => image.height(),
        }
    }
}
