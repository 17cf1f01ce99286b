//! `deltille icosahedron` and its sisters: what they write, what proves it, and what they refuse.

mod made;
mod outlines;
mod wrong;
