//! `deltille`: make, detect and verify deltille targets.

fn main() {}
