//! DXF of AutoCAD release 12, as text, in millimetres: the dialect that all cutters read.
//!
//! Closed paths are closed `POLYLINE`s, others are `LINE`s. Each of the layers `CUT`, `FOLD`, `VALLEY` and `ENGRAVE` has a colour,
//! by which cutters choose the operation.
//!
//! The reader accepts only files in the form of the writer. It reports any other element, because
//! that element could move, hide or scale the cut lines.

mod read;
mod write;

pub use read::{DxfError, read};
pub use write::text;

use deltille_layout::artwork::CutLayer;

/// Layers with their colours: red, green, magenta, blue.
const LAYERS: [(CutLayer, &str, u8); 4] = [
    (CutLayer::Cut, "CUT", 1),
    (CutLayer::Fold, "FOLD", 3),
    (CutLayer::Valley, "VALLEY", 6),
    (CutLayer::Engrave, "ENGRAVE", 5),
];

/// The name of a layer in a file.
pub fn layer_name(layer: CutLayer) -> &'static str {
    LAYERS.iter().find(|(l, ..)| *l == layer).map_or("0", |(_, name, _)| name)
}
