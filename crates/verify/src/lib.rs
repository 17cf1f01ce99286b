//! Verification of artifacts: a file is read back, rendered, detected and compared with its target.
//!
//! Comes in: a [target](deltille_layout::Printing), and an artifact of it as bytes. Goes out: a [`Verdict`] with each
//! [`Finding`]. Data meets the folders in this order:
//!
//! 1. `reading` takes bytes from memory or from disk, within limits; `by_format` chooses what they go through.
//! 2. `construct` refuses what not every viewer shows alike.
//! 3. `document` makes pictures of pages, `model` loads meshes, with code that others wrote.
//! 4. `panel` compares one board in a picture, `sheet` all that is on a sheet of paper, `net` what is folded of it.
//! 5. `mesh` compares solids with textures, `body` what is printed in three dimensions, `cut` drawings for cutters.
//! 6. `finding` and `verdict` are the result as values.
//!
//! `printed` runs 3 and 4 on the pages that `printed_files` names; `listing` reads lists for other detectors. `verifier` has
//! the settings, `error` why nothing can be compared. A module imports from those above it in this list, or from these
//! and the result, never in a circle.
//!
//! # What is compared
//!
//! [`verify`] takes files as bytes: it opens none, starts no program and needs no clock (threads
//! are those of the current pool, if there is one), so that it works without a file system.
//! [`Verifier::verify_path`] does the same for files on disk, which are read within
//! [`Limits`](deltille_files::limits::Limits); third-party code then runs on a thread with a time limit.
//!
//! The verification is independent of how a file was drawn: a PDF is rasterised by hayro, an SVG by
//! resvg, and the picture goes through the detector like a photograph. Then it is checked for each
//! page that
//!
//! - the page size that the file states is that of the target;
//! - each check bar, measured in the picture, has its stated length;
//! - every corner is found, once, with its label, within [`TOLERANCE_MM`] of its stated position,
//!   and there is no other corner;
//! - every tile, and every cell of every tag, has its colour over its whole area, also where
//!   decoding would correct a wrong cell, and its edges lie within a quarter of a pixel of their
//!   places: 0.02 mm at 300 dpi;
//! - the sheet has the texts of the description, and no ink beside the tiles, texts and bars.
//!
//! A deviation is named by its cause where one cause explains it: a scale, a mirror image, a
//! rotation or a shift of the whole board instead of a list of all corners.
//!
//! The pages of a sheet that is larger than the paper are assembled by their stated places; where
//! they overlap they must agree. The net of a solid is folded: the faces, each with the pose that
//! its detected corners have on the paper, are rotated about the fold lines, and must come to lie
//! within [`FOLD_TOLERANCE_MM`] of their stated positions in space; the two sides of each edge must
//! meet, and carry the same number where they are cut.
//!
//! A mesh (`.glb`, `.obj`, `.usda`) is loaded with its textures, and rendered by a virtual camera before each
//! face; every detected corner is projected along its ray onto the loaded triangles and must lie
//! within [`MESH_TOLERANCE_MM`] of its stated position in space. The texture on each face is then
//! laid out flat and compared like a sheet: every tile, every cell of every tag, and no other mark.
//! Models for simulators (`.sdf`, `.urdf`, `.xml` of MuJoCo) must put that mesh in its place; a `.usda` holds it.
//! Of two bodies to print in two colours (`.3mf`), each must be closed, the black one fill what the white one leaves of the
//! plate, and the surface of both is compared like a printed page.
//! A body to print (`.stl`) must be a closed surface with its normals outwards and of the stated
//! shape.
//!
//! What is rendered here must be what other programs show. So a file is inspected before it is
//! rendered, and anything in it that not every viewer shows alike is a finding: files are accepted
//! by a list of permitted constructs, not refused by a list of forbidden ones. Titles and
//! descriptions must be those of the target, and unused content is refused.
//!
//! Pages that are printed as mirror images are turned over first. Drawings of boards for a laser are put back to what is
//! left when the beam has taken its part, and that is compared like a printed page.
//!
//! Lists for other detectors (`.dsc`) and drawings for a cutter (`.dxf`) are read and compared with
//! the target number by number.
//!
//! Limits: texts and stray ink are compared only where the boards lie as stated and are recognised;
//! dirt within a few pixels of a text or a bar is attributed to it.

mod body;
mod by_format;
mod construct;
mod cut;
mod document;
mod error;
mod finding;
mod listing;
mod mesh;
mod model;
mod net;
mod panel;
mod printed;
mod printed_files;
mod reading;
mod sheet;
mod verdict;
mod verifier;

pub use by_format::verify;
pub use document::opened::Document;
pub use document::page::Page;
pub use error::VerifyError;
pub use finding::any::{Finding, PageFinding};
pub use finding::board::BoardFinding;
pub use finding::construct::ConstructFinding;
pub use finding::cut::CutFinding;
pub use finding::fold::FoldFinding;
pub use finding::list::ListFinding;
pub use finding::mark::MarkFinding;
pub use finding::mesh::MeshFinding;
pub use finding::tile::TileFinding;
pub use mesh::measures::MESH_TOLERANCE_MM;
pub use net::motion::FOLD_TOLERANCE_MM;
pub use reading::error::DocumentError;
pub use reading::format::Format;
pub use reading::names::whole_of;
pub use reading::reader::Artifact;
pub use verdict::{
    BodyVerdict, CutVerdict, FaceVerdict, FoldVerdict, InlayVerdict, ListVerdict, SheetVerdict,
    Verdict,
};
pub use verifier::{Progress, TOLERANCE_MM, Verifier};
