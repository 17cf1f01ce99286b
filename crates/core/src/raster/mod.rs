//! Grey images: pixel types, views, pyramids, blur and exact area coverage.
//!
//! 1. `intensity`: pixel types; `gray`: an image of one type, `any_gray`: of 8 or 16 bits, as in files;
//!    `camera_notes`: the camera of a photograph;
//! 2. `view`: borrowed pixels, `image_view`: of any type; `colours`: their grey values; `mosaic`: those that a colour
//!    sensor measured;
//! 3. `pyramid`: smaller copies; `blur`; `bands`: parallel processing of rows;
//! 4. `coverage`: the exact area of outlines in every pixel.
//!
//! Row-major, y down, pixel centres at integer coordinates.

mod any_gray;
mod bands;
mod blur;
mod camera_notes;
mod colours;
mod coverage;
mod gray;
mod image_view;
mod intensity;
mod mosaic;
mod pyramid;
mod view;

pub use any_gray::{AnyGray, FileNotes};
pub use bands::{bands, fill_bands};
pub use blur::gaussian;
pub use camera_notes::CameraNotes;
pub use colours::Colours;
pub use coverage::Coverage;
pub use gray::Gray;
pub use image_view::ImageView;
#[doc(hidden)]
pub use image_view::of_any;
pub use intensity::{Intensity, PYRAMID_FULL_SCALE};
pub use pyramid::Pyramid;
pub use view::View;
