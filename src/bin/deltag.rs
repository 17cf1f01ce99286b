//! `deltag`: search, check and draw DelTag code families.

fn main() {}
