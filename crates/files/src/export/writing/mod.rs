//! Files on disk: [`atomic`] writes one file, [`staging`] writes a set completely or not at all;
//! [`kind`] recognises files before they are replaced; `zip` makes archives, `cell` the cells of a CSV.

pub mod atomic;
pub(in crate::export) mod cell;
pub mod kind;
pub mod staging;
pub(in crate::export) mod zip;
