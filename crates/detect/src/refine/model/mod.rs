//! A corner fitted to raw pixels by Levenberg–Marquardt, see `docs/formulation.md`, “Measured corners”.
//!
//! ```text
//!     I(u,v) = level + amplitude · T(f(h₁ … h_K)·g + (g − 1)·r),      g = 1 + g_u u + g_v v
//!     h_k    = (cos θ_k · (v − y) − sin θ_k · (u − x) − ½ κ_k t²) / s_k
//!     t      =  cos θ_k · (u − x) + sin θ_k · (v − y)
//!     s_k²   = s² · nᵀ M n,      n = (−sin θ_k, cos θ_k)
//! ```
//!
//! Where ink has spread on the print, what is dark has grown: every line of a corner of three edges lies aside,
//! both halves the same way, by ink times the image of an edge across it, and the three miss each other. The
//! position is where they would meet on a print without. Of two edges the halves move against each other, and the corner stays.
//!
//! T is the camera's tone curve between the corner's black and white, r the sum of their light over
//! its difference ([`deltille_core::detection::tone`]); of a linear camera T(S) = S and I = (level + amplitude·f)·g.
//! M, of trace 2, tells in which direction the picture is blurred more; where it moved, by a box. Both, and
//! halos in f, are the same all over a picture and given: [`crate::refine::optics`]. What is brighter than white or
//! darker than black is seen as these; where pixels are, the model ends there too, so that they only count
//! where it does not.
//!
//! Edges have curvatures κ where a lens bends them, which are given: a window is too small to tell
//! them from the position. (u, v) are pixels from the window's centre, f is the blurred corner of
//! [`crate::refine::blurred_corner`]. The blur s includes the pixel's own box as a variance of 1/12. From
//! 0.5 px of blur on, the model reaches the bound of exact integration (docs/benchmarks.md, Corner accuracy).
//! The slopes g are drawn to 0 by a weak prior, all else is free.
//!
//! The covariance is σ² (JᵀJ + prior)⁻¹ with the noise σ estimated from the residuals. It is honest
//! where the noise is white and the window shows nothing but the corner; JPEG's noise is not white.
//!
//! Comes in: the pixels around a corner, and where it is about. Goes out: the corner with its covariance, or the equations
//! of a corner with what it shares with others.
//!
//! 1. `window` is which pixels are read.
//! 2. `corner` has the parameters; `look` is what the optics make of them.
//! 3. `columns` has the model and its derivatives pixel by pixel, `sums` the normal equations.
//! 4. `fitter` descends to the minimum; `joint` gives the equations for all corners of a picture together.

pub(crate) mod columns;
pub(crate) mod corner;
pub(crate) mod fitter;
pub(crate) mod joint;
pub(crate) mod look;
pub(crate) mod sums;
pub(crate) mod window;
