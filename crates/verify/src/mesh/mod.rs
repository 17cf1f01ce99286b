//! Meshes with textures: boards and solids as other programs show them.
//!
//! Comes in: a loaded mesh. Goes out: a verdict on each face, and on the surface.
//!
//! 1. `simulator` finds the mesh that a model for a simulator puts in its place.
//! 2. `textured` runs the following on it; `measures` says how exact a mesh must be.
//! 3. `face_view` puts a camera before a face; `face` projects every corner that it sees back onto the mesh.
//! 4. `flat_face` draws the texture flat; `print` compares that like a page, and with `texels` texel by texel.
//! 5. `surface` looks at what is no print.

mod face;
mod face_view;
mod flat_face;
pub(super) mod measures;
mod print;
pub(super) mod simulator;
mod surface;
mod texels;
pub(super) mod textured;
