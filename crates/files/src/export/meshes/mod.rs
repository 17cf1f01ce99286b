//! Targets as meshes and solid bodies.
//!
//! `meshing` has the settings and errors of meshes, `texture` the sizes of textures; `mesh` makes a mesh, and `gltf`, `obj` and
//! `scene` write it. `inlay` makes two bodies of a target, which `threemf` writes; [`stl`] writes solids without a print.
//! `solid_mesh` reads meshes of other programs to put boards on.

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
