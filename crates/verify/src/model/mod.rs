//! Meshes read back, by other code than wrote them.
//!
//! Comes in: a file that was inspected. Goes out: its triangles, and what a camera sees of them.
//!
//! 1. `load` reads a mesh with textures through the gltf and tobj crates, as other programs do; `stl` one without.
//! 2. `mesh` is that as values.
//! 3. `view` is a virtual camera before it.

pub(super) mod load;
pub(super) mod mesh;
pub(super) mod stl;
pub(super) mod view;
