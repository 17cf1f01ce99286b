//! `deltille icosahedron` and similar commands: their output, its verification, and their errors.

mod made;
mod outlines;
mod wrong;
