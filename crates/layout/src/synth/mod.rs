//! Synthetic images of a target, with exact ground truth.
//!
//! 1. `surface`: paper with black areas; `sheet` and `solid` build surfaces from a printed sheet and a target;
//! 2. `scene`: surfaces in front of a camera, rendered with illumination, blur and noise;
//!    `occlusion`: the parts that they hide from view;
//! 3. `corner`: one ideal corner on its own.
//!
//! Outlines are projected edge by edge, and their area in every pixel is computed, not sampled
//! ([`deltille_core::raster::Coverage`]). So the image before blur and noise is exact, and so are the positions of the
//! corners.

mod corner;
mod occlusion;
mod scene;
mod sheet;
mod solid;
mod surface;

pub use corner::SimulatedCorner;
pub use scene::{Light, Scene, Truth, TruthCorner};
pub use sheet::scene_of_sheet;
pub use solid::scene_of_target;
pub use surface::Surface;
