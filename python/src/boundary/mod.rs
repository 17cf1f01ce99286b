//! Between Python and the library: values, files of text, exceptions, Ctrl-C.
//!
//! Comes in: arrays, numbers and the library's errors. Goes out: pictures and points, arrays, exceptions.
//!
//! 1. `image` takes a picture from an array, `arrays` points and numbers; `arrays` gives results back.
//! 2. `interrupt` does long work, which Ctrl-C ends.
//! 3. `text_file` writes text whole or not at all.
//! 4. `errors` makes exceptions of errors, in the words of Python: a setting is called by its keyword.

pub mod arrays;
pub mod errors;
pub mod image;
pub mod interrupt;
pub mod text_file;
