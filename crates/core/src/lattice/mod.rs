//! The lattices: positions of their vertices (`vertex`) and tiles (`tile`), their maps onto themselves (`map`), and
//! the arrangement of a tag's cells (`cells`) inside a tile. All other code takes bit layout and rotation from here.
//!
//! ```text
//!        row 2      ·───────·───────·
//!                  ╱█╲     ╱█╲     ╱
//!                 ╱███╲   ╱███╲   ╱          a tile is *upright* (black, █) or *inverted* (white);
//!        row 1   ·───────·───────·           the upright tile (r,c) has its lower-left vertex
//!               ╱█╲     ╱█╲     ╱            at (r,c)
//!              ╱███╲   ╱███╲   ╱
//!        row 0 ·───────·───────·
//!            col 0   col 1   col 2
//! ```
//!
//! With edge length `s` the vertex (row `r`, column `c`) lies at `x = (c + r/2)·s`,
//! `y = r·s·√3/2`: columns run along the lower edge, rows lean to the right by 60°.
//!
//! The square lattice of checkerboards has the same vertices at `x = c·s`, `y = r·s`. Its tiles are squares; those
//! with even r + c are black. [`GridKind`] defines the differences.

mod cells;
mod map;
mod tile;
mod vertex;

pub use cells::{Cell, Dimension, DimensionError, TagCells};
pub use map::LatticeMap;
pub use tile::{GridKind, Orientation, Tile};
pub use vertex::Vertex;

/// Ratio of the height of an equilateral triangle to its edge, √3/2.
pub const ROW_HEIGHT: f64 = 0.866_025_403_784_438_6;
