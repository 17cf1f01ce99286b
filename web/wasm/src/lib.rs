//! The library in a browser: what forms and dropped files become, and what becomes of results.
//!
//! | module | its one job |
//! |---|---|
//! | `make` | settings to targets and their files |
//! | `prove` | files read back and compared with their target |
//! | `photo` | photographs decoded, and detections drawn over them |
//! | `see` | grey values, and frames of a webcam, to corners |
//! | `solve` | corners to a camera and its page |
//! | `codes` | codes of tags, looked at and damaged |
//! | `family` | the family of a target, from its file |
//! | `errors` | the library's words as exceptions |
//!
//! It is built once for each of the first five, as modules that a page loads when it needs them; `codes` comes with `make`.
//! Values travel as JSON of the library's own formats, files as bytes. No module carries the families: a page fetches the
//! file of the one that is asked for.

#![allow(unreachable_pub, reason = "the interface is that of the page")]

#[cfg(feature = "make")]
pub mod codes;
mod errors;
#[cfg(any(feature = "prove", feature = "see"))]
mod family;
#[cfg(feature = "make")]
pub mod make;
#[cfg(feature = "photo")]
pub mod photo;
#[cfg(feature = "prove")]
pub mod prove;
#[cfg(feature = "see")]
pub mod see;
#[cfg(feature = "solve")]
pub mod solve;

use wasm_bindgen::prelude::*;

/// The version of the library.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console)]
    fn error(text: &str);
}

/// Where the library fails within, the browser's console says where; the page starts the module anew. Messages name settings
/// as the page does.
#[wasm_bindgen(start)]
pub fn start() {
    deltille_core::setting::speak(errors::name);
    std::panic::set_hook(Box::new(|what| error(&format!("the library failed within: {what}"))));
}
