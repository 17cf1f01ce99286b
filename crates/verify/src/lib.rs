//! Verification of artifacts: reads a file back, renders it, runs the detector on it and compares the result with its
//! target.
//!
//! Input: a [target](deltille_layout::Printing), and an artifact of it as bytes. Output: a [`Verdict`] with each
//! [`Finding`]. Data passes through the folders in this order:
//!
//! 1. `reading` reads bytes from memory or disk, within limits; `by_format` selects the comparison for the format.
//! 2. `syntax` rejects constructs that viewers may render differently.
//! 3. `document` renders pages and `model` loads meshes, both with third-party code.
//! 4. `panel` compares one board on a page, `sheet` a whole sheet of paper, `net` the solid folded from it.
//! 5. `mesh` compares textured meshes, `body` bodies for 3D printing, `cut` drawings for cutters.
//! 6. `finding` and `verdict` hold the result as values.
//!
//! `printed` runs steps 3 and 4 on the pages that `printed_files` names; `listing` reads lists for other detectors.
//! `verifier` contains the settings, `error` the reasons why nothing can be compared. A module imports only from
//! modules above it in this list, from those in this paragraph, and from the result; there are no import cycles.
//!
//! # What is compared
//!
//! [`verify`] takes files as bytes. It opens no file, starts no program and needs no clock, so it works without a
//! file system; its threads are those of the current pool, if there is one. [`Verifier::verify_path`] does the same
//! for files on disk, which it reads within [`Limits`](deltille_files::limits::Limits); third-party code then runs on
//! a thread with a time limit.
//!
//! The verification is independent of how a file was drawn: hayro rasterises a PDF, resvg an SVG, and the detector
//! processes the result like a photograph. For each page it then checks that
//!
//! - the page size stated in the file is that of the target;
//! - each check bar, measured on the rendered page, has its stated length;
//! - every corner is found exactly once, with its label, within [`TOLERANCE_MM`] of its stated position, and there
//!   are no other corners;
//! - every tile, and every cell of every tag, has the right colour over its whole area, even where decoding would
//!   correct a wrong cell, and its edges lie within a quarter of a pixel of their stated positions (0.02 mm at 300
//!   dpi);
//! - the sheet has the texts of the description, and no ink outside the tiles, texts and bars.
//!
//! A finding names the cause where one cause explains all deviations: a scale, mirroring, rotation or shift of the
//! whole board instead of a list of all its corners.
//!
//! The pages of a sheet that is larger than the paper are assembled at their stated positions; where they overlap,
//! they must agree. The net of a solid is folded: each face starts at the pose of its detected corners on the paper,
//! is rotated about the fold lines, and must end within [`FOLD_TOLERANCE_MM`] of its stated position in space. The
//! two sides of each edge must meet, and cut sides must carry the same number.
//!
//! A mesh (`.glb`, `.obj`, `.usda`) is loaded with its textures, and a virtual camera renders each face. Every
//! detected corner is projected along its ray onto the loaded triangles and must lie within [`MESH_TOLERANCE_MM`] of
//! its stated position in space. The texture of each face is then laid out flat and compared like a sheet: every
//! tile, every cell of every tag, and no other marks. Models for simulators (`.sdf`, `.urdf`, `.xml` of MuJoCo) must
//! place that mesh at the target frame; a `.usda` contains it. Two bodies for two-colour printing (`.3mf`) must both
//! be closed, the black one must fill the part of the plate that the white one leaves empty, and
//! their common surface is compared like a printed page. A body for printing (`.stl`) must be a
//! closed surface of the stated shape, with its normals outwards.
//!
//! Other programs must show the same as the rendering here. The file is therefore inspected before it is rendered,
//! and every construct that viewers may render differently is a finding: files are checked against a list of
//! permitted constructs, not against a list of forbidden ones. Titles and descriptions must be those of the target,
//! and unused content is rejected.
//!
//! Pages printed as mirror images are mirrored back first. From drawings of boards for a laser, the surface left by
//! the beam is reconstructed and compared like a printed page.
//!
//! Lists for other detectors (`.dsc`) and drawings for a cutter (`.dxf`) are parsed and compared with the target
//! number by number.
//!
//! Limits: texts and stray ink are compared only where the boards are detected at their stated positions; dirt within
//! a few pixels of a text or bar is attributed to that text or bar.

mod body;
mod by_format;
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
mod syntax;
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
