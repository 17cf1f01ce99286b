//! The camera: from a page in view to the grey values of a file.
//!
//! The input is the scene and the pose of the camera. The output is an 8-bit image.
//!
//! 1. `view` maps pixels to positions on the page and back.
//! 2. `optics` gathers the light of each pixel, with blur and covers.
//! 3. `sensor` converts it to grey values, with noise and in-camera processing.
//! 4. `mosaic` contains the colour filters of a sensor.

mod mosaic;
pub mod optics;
pub(crate) mod sensor;
pub mod view;
