//! Textured meshes: boards and solids as other programs show them.
//!
//! Input: a loaded mesh. Output: a verdict on each face and on the surface.
//!
//! 1. `simulator` finds the mesh that a simulator model loads.
//! 2. `textured` runs the following steps on it; `measures` contains their tolerances.
//! 3. `face_view` places a camera in front of a face; `face` projects every detected corner back onto the mesh.
//! 4. `flat_face` draws the texture flat; `print` compares the result like a page, and with `texels` texel by texel.
//! 5. `surface` checks the properties that are independent of the print.

mod face;
mod face_view;
mod flat_face;
pub(super) mod measures;
mod print;
pub(super) mod simulator;
mod surface;
mod texels;
pub(super) mod textured;
