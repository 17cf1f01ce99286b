//! The library in a browser: what forms and dropped files become, and what becomes of results.
//!
//! | module | its one job |
//! |---|---|
//! | `make` | settings to targets, their files, and the files read back |
//! | `see` | photographs and frames of a webcam to corners |
//! | `solve` | corners to a camera and its page |
//! | `family` | codes of tags, looked at and damaged |
//! | `errors` | the library's words as exceptions |
//!
//! It is built thrice, as modules that a page loads when it needs them: with the feature `see`, `solve` or `make`.
//! Values travel as JSON of the library's own formats, files as bytes.

mod errors;
#[cfg(feature = "see")]
pub mod family;
#[cfg(feature = "make")]
pub mod make;
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

/// Where the library fails within, the browser's console says where; the page starts the module anew.
#[wasm_bindgen(start)]
pub fn start() {
    std::panic::set_hook(Box::new(|what| error(&format!("the library failed within: {what}"))));
}
