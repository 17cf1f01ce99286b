//! The camera: from a page that is seen to the grey values of a file.
//!
//! Comes in: what there is to see, and where the camera stands. Goes out: a picture of eight bits.
//!
//! 1. `view` says which place of the page a pixel sees, and where a place of the page is seen.
//! 2. `optics` gathers the light of each pixel, blurred and partly covered.
//! 3. `sensor` makes grey values of it, with noise, and what programs in cameras do to them.
//! 4. `mosaic` has the colour filters of a sensor.

mod mosaic;
pub mod optics;
pub(crate) mod sensor;
pub mod view;
