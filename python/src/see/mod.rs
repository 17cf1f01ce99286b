//! Images of targets: projection, rendering and detection.
//!
//! Input: targets, cameras and images. Output: a `Detection` for each image.
//!
//! 1. `camera` projects points, and reads and writes camera files; `pose` is a rigid motion.
//! 2. `rendering` renders synthetic images with the true positions of the corners.
//! 3. `detector` finds targets in images.
//! 4. `frames` reads the images of videos and recordings; `tracker` follows targets through them.
//! 5. `detection` is the result: corners, tags, or the reason why there are none. `arguments` reads targets and detections from
//!    arguments.
//! 6. `undistortion` undistorts and rectifies images.

pub mod arguments;
pub mod camera;
pub mod detection;
pub mod detector;
pub mod frames;
pub mod pose;
pub mod rendering;
pub mod tracker;
pub mod undistortion;
