//! DXF of AutoCAD release 12, as text, in millimetres: the dialect that every cutter reads.
//!
//! Closed paths are closed `POLYLINE`s, others are `LINE`s; layers `CUT`, `FOLD`, `VALLEY`
//! and `ENGRAVE` have colours of their own, by which cutters tell what to do.
//!
//! The reader takes what the writer writes, and names anything else: what it does not know could
//! move, hide or scale what is cut.

mod read;
mod write;

pub use read::{DxfError, read};
pub use write::text;

use deltille_core::artwork::CutLayer;

/// Layers with their colours: red, green, magenta, blue.
const LAYERS: [(CutLayer, &str, u8); 4] = [
    (CutLayer::Cut, "CUT", 1),
    (CutLayer::Fold, "FOLD", 3),
    (CutLayer::Valley, "VALLEY", 6),
    (CutLayer::Engrave, "ENGRAVE", 5),
];

/// The name of a layer in the file.
pub fn layer_name(layer: CutLayer) -> &'static str {
    LAYERS.iter().find(|(l, ..)| *l == layer).map_or("0", |(_, name, _)| name)
}
