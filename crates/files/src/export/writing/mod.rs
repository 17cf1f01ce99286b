//! Files on disk: [`atomic`] writes one file, [`staging`] writes a set completely or not at all;
//! [`kind`] recognises files before they are replaced; `zip` makes archives.

pub mod atomic;
pub mod kind;
pub mod staging;
pub(in crate::export) mod zip;
