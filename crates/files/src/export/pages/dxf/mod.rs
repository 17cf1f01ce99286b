//! DXF of AutoCAD release 12, as text, in millimetres: the dialect that every cutter reads.
//!
//! Closed paths are closed `POLYLINE`s, others are `LINE`s. The layers `CUT`, `FOLD`, `VALLEY` and
//! `ENGRAVE` have a colour each, by which cutters choose the operation.
//!
//! The reader accepts only what the writer writes, and names anything else: unknown elements could
//! move, hide or scale what is cut.

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
