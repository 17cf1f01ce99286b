//! The boundary between Python and the library: values, text files, exceptions, Ctrl-C.
//!
//! Input: arrays, numbers and the library's errors. Output: images and points, arrays, exceptions.
//!
//! 1. `image` reads an image from an array, `arrays` reads points and numbers and returns results.
//! 2. `interrupt` runs long work that Ctrl-C can interrupt.
//! 3. `text_file` writes text files atomically.
//! 4. `errors` converts errors to exceptions, with settings named by their keywords.

pub mod arrays;
pub mod errors;
pub mod image;
pub mod interrupt;
pub mod text_file;
