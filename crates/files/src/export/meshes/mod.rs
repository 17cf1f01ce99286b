//! Targets in space.
//!
//! `meshing` says how a mesh is made, `texture` how large its pictures are, `mesh` makes it; `gltf`, `obj` and `scene` write it.
//! `inlay` makes two bodies of a target, which `threemf` writes; [`stl`] has solids without a print. `solid_mesh` reads the meshes of
//! others to put boards on.

#[cfg(feature = "meshes")]
pub mod gltf;
#[cfg(feature = "meshes")]
pub mod inlay;
#[cfg(feature = "meshes")]
pub mod mesh;
#[cfg(feature = "meshes")]
pub(super) mod meshing;
#[cfg(feature = "meshes")]
pub mod obj;
#[cfg(feature = "meshes")]
pub mod scene;
#[cfg(feature = "meshes")]
pub mod solid_mesh;
pub mod stl;
#[cfg(feature = "meshes")]
pub mod texture;
#[cfg(feature = "meshes")]
pub mod threemf;
