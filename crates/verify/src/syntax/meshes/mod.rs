//! Constructs of meshes and bodies.
//!
//! Input: a file, and the files that it names. Output: their constructs that are not on the list of the format.
//!
//! 1. `glb` lists the chunks of a binary glTF, `glb_json` its JSON.
//! 2. `obj` lists the statements of an OBJ, `mtl` those of its materials.
//! 3. `usda` lists the lines of a USD as text, `threemf` the parts of a 3MF, and `stl` the header of an STL.

pub(super) mod glb;
mod glb_json;
mod mtl;
pub(super) mod obj;
pub(super) mod stl;
pub(super) mod threemf;
pub(crate) mod usda;
