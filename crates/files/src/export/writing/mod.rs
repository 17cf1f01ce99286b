//! Files on disk: [`atomic`] writes one file, [`staging`] a set, all or none; [`kind`] recognises files before they are replaced.

pub mod atomic;
pub mod kind;
pub mod staging;
