//! Files of the library as JavaScript values.

use deltille_files::export::artifacts::Files;
use js_sys::{Array, Uint8Array};
use wasm_bindgen::JsValue;

/// Returns alternating names and bytes.
pub fn in_array(files: &Files) -> Array {
    let array = Array::new();
    for (name, bytes) in files {
        array.push(&JsValue::from_str(name));
        array.push(&Uint8Array::from(bytes.as_slice()).into());
    }
    array
}
