//! The library in a browser: turns settings and dropped files into targets and results.
//!
//! | file in `modules` | purpose |
//! |---|---|
//! | `make` | makes targets and their files from settings, except for PNG pages and meshes |
//! | `prove` | makes PNG pages and meshes, reads files back and compares them with their target, reads logos |
//! | `photo` | decodes photographs and draws detections over them |
//! | `see` | detects corners in grey values and webcam frames |
//! | `solve` | calibrates a camera from corners and writes its report |
//! | `codes` | figures of tag families, decoding and error rates: part of `make` |
//!
//! A page loads the modules on demand. This crate is what they share: [`errors`] converts errors of the library to JavaScript
//! exceptions, [`family`] sets the family of a target from its file, and [`files`] converts files to JavaScript values.
//!
//! Values are passed as JSON in the library's own formats, files as bytes. No module contains the families: the page fetches
//! the family file that it needs.

pub mod errors;
pub mod family;
pub mod files;

use wasm_bindgen::prelude::*;

/// Returns the version of the library.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console)]
    fn error(text: &str);
}

/// Logs panics, with their location, to the browser's console; the page restarts the module. Messages use the page's names of
/// settings.
#[wasm_bindgen(start)]
pub fn start() {
    deltille_core::setting::speak(errors::name);
    std::panic::set_hook(Box::new(|panic| error(&format!("the library crashed: {panic}"))));
}
