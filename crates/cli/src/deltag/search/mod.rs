//! New families: from bits and a distance to a family file.
//!
//! Input: requirements and rules. Output: a family file whose claims have been verified. The modules, in the order in
//! which a user meets them:
//!
//! 1. `plan` finds the smallest shipped family that suffices, which avoids a search.
//! 2. `parameters` parses bits and distance, as in d25h7. `bounds` computes how large a family can be.
//! 3. `rules` reads the rules of a search from options or a file. `frontier` evaluates rules on a construction.
//! 4. `gen_family` runs the search and writes the result.
//! 5. `checkpoint` stores the file from which an interrupted search resumes.

pub mod bounds;
mod checkpoint;
pub mod frontier;
pub mod gen_family;
mod parameters;
pub mod plan;
mod rules;
