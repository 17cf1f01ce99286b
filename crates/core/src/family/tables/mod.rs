//! Families as tables: files, shipped families, and those of other programs.
//!
//! `file` is the family file, `fingerprint` identifies its codes, `shipped` lists the families in the library, and
//! `growth` records earlier states of a family. `aruco` and `import` read tables of other programs, `export` writes
//! source text for them. `published_bounds` contains known bounds on the sizes of codes.

pub(in crate::family) mod aruco;
pub(in crate::family) mod export;
pub(in crate::family) mod file;
pub(in crate::family) mod fingerprint;
pub(in crate::family) mod growth;
pub(in crate::family) mod import;
pub(in crate::family) mod published_bounds;
pub(super) mod shipped;

pub use aruco::{dictionary, dictionary_family, dictionary_names};
pub use export::{ExportFormat, export};
pub use file::{Construction, check_name};
pub use growth::Beginning;
pub use import::{ImportError, ImportSpec, import};
pub use published_bounds::{PublishedBounds, published_bounds};
pub(crate) use shipped::shipped_name;
pub use shipped::{ShippedFamily, shipped_families, shipped_names, smallest_shipped, square_names};
