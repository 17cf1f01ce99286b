//! Meshes read back by code independent of their writer.
//!
//! Input: an inspected file. Output: its triangles, and the view of a camera on them.
//!
//! 1. `load` reads a textured mesh through the gltf and tobj crates, as other programs do; `stl` reads an untextured
//!    one.
//! 2. `mesh` is the mesh as values.
//! 3. `view` is a virtual camera in front of it; `samples` are those of its image that a triangle covers.

pub(super) mod load;
pub(super) mod mesh;
pub(super) mod samples;
pub(super) mod stl;
pub(super) mod view;
