//! Files on disk: [`atomic`] writes one, [`staging`] a set, all or none; [`kind`] recognises what is replaced.

pub mod atomic;
pub mod kind;
pub mod staging;
