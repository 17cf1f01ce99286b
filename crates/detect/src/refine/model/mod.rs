//! A corner fitted to raw pixels by Levenberg–Marquardt, see `docs/formulation.md`, “Measured corners”.
//!
//! ```text
//!     I(u,v) = level + amplitude · T(f(h₁ … h_K)·g + (g − 1)·r),      g = 1 + g_u u + g_v v
//!     h_k    = (cos θ_k · (v − y) − sin θ_k · (u − x) − ½ κ_k t²) / s_k
//!     t      =  cos θ_k · (u − x) + sin θ_k · (v − y)
//!     s_k²   = s² · nᵀ M n,      n = (−sin θ_k, cos θ_k)
//! ```
//!
//! Ink spread on the print makes dark areas grow. It displaces every line of a corner of three edges, both halves to
//! the same side, by the ink spread times the image length of a tile edge across it. The three
//! lines then do not meet. The position is where they would meet on a print without ink spread.
//! With two edges, the halves move in opposite directions, and the corner does not move.
//!
//! T is the tone curve of the camera between the corner's black and white. r is the sum of their
//! light divided by the difference ([`deltille_core::detection::tone`]). For a linear camera T(S) =
//! S and I = (level + amplitude·f)·g. M, of trace 2, gives the direction of stronger blur; for
//! motion the blur is a box. These, and halos in f, are the same over the whole image and are
//! given: [`crate::refine::optics`]. Values brighter than white or darker than black are clipped.
//! Where pixels are clipped, the model is clipped too, so that they count only where the model is
//! within the limits.
//!
//! The curvatures κ of the edges by lens distortion are given, because a window is too small to distinguish them from
//! the position. (u, v) are pixels from the window's centre. f is the blurred corner of
//! [`crate::refine::blurred_corner`]. The blur s contains the pixel's own box: as a variance of 1/12, and with its next
//! cumulant (`look`). A weak prior pulls the slopes g to 0; all other parameters are free.
//!
//! The covariance is σ² (JᵀJ + prior)⁻¹ with the noise σ estimated from the residuals, but at least that of rounding. It is
//! accurate if the noise is white and the window shows only the corner; JPEG noise is not white.
//!
//! Input: the pixels around a corner, and its approximate position. Output: the corner with its covariance, or the
//! equations of a corner and the parameters that it shares with others.
//!
//! 1. `window` contains the pixels that are read.
//! 2. `corner` contains the parameters; `look` the effect of the optics on them, `beside` the borders of tags nearby.
//! 3. `columns` contains the model and its derivatives for each pixel, `sums` the normal equations.
//! 4. `fitter` descends to the minimum; `joint` gives the equations for all corners of an image together.

pub(crate) mod beside;
pub(crate) mod columns;
pub(crate) mod corner;
pub(crate) mod fitter;
pub(crate) mod joint;
pub(crate) mod look;
pub(crate) mod sums;
pub(crate) mod window;
