//! Constructs of meshes and bodies.
//!
//! Comes in: a file, and those that it names. Goes out: what in them is not on the list of the format.
//!
//! 1. `glb` has the chunks of a binary glTF, `glb_json` its JSON.
//! 2. `obj` has the statements of an OBJ, `mtl` those of its materials.
//! 3. `usda` has the lines of a USD as text; `threemf` the parts of a 3MF, and `stl` the head of an STL.

pub(super) mod glb;
mod glb_json;
mod mtl;
pub(super) mod obj;
pub(super) mod stl;
pub(super) mod threemf;
pub(crate) mod usda;
