//! Parameters that all corners of an image share: tone curve, halo and astigmatism of the point spread function, and
//! the ink spread of the print.

use super::blurred_corner::PLACES_OF_FOUR;
use deltille_core::detection::InkEstimate;
use deltille_core::detection::{Curve, Piece, TONE_PARAMS, Tone, ToneEstimate};

/// Number of parameters: three of the tone curve, two of the astigmatism, the cross, two of the skewness, the halo, and
/// the ink.
pub(super) const PARAMS: usize = TONE_PARAMS + 7;
/// Index of the cross.
pub(super) const CROSS: usize = TONE_PARAMS + 2;
/// Index of the first skewness.
pub(super) const SKEWNESS: usize = CROSS + 1;
/// Index of the halo.
pub(super) const HALO: usize = PARAMS - 2;
/// Index of the ink.
pub(super) const INK: usize = PARAMS - 1;

/// Step of the difference quotients with respect to a parameter of the tone curve. The terms have
/// seven digits. About four of these remain in the difference.
pub(super) const STEP: f64 = 0.01;

/// Width of a halo relative to the blur: sharpening masks of 1 to 2 px on images with 0.7 to 1 px
/// of blur.
const HALO_WIDTH: f64 = 2.5;

/// Minimum blur of the pattern without its halo, relative to a blur whose edges have the same slope.
const MIN_CORE: f64 = 0.3;

/// Unit of the ink, in edges.
pub(crate) const INK_UNIT: f64 = 0.01;

/// Maximum skewness. Beyond it, the expansion of an edge by its skewness is not monotonic within its blur.
const MAX_SKEWNESS: f64 = 1.0;

/// Maximum astigmatism with the cross: the difference of the squared blur in one direction from the mean of all,
/// relative to that mean.
const MAX_ASTIGMATISM: f64 = 0.98;

/// The parameters that the corners of an image share.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Optics {
    /// Whether the tone curve is unknown.
    pub(super) is_open: bool,
    /// Whether the ink spread is unknown.
    pub(super) is_ink_open: bool,
    pub(super) curve: Option<Curve>,
    pub(super) params: [f64; TONE_PARAMS],
    /// Range of grey values, from the blackest to the whitest corner, for which a tone curve is estimated.
    pub(super) range: [f64; 2],
    /// Astigmatism: e₁, e₂ of the shape M = (1 + e₁, e₂; e₂, 1 − e₁) of the squared blur.
    pub astigmatism: [f64; 2],
    /// Cross: the squared blur across an edge at the angle θ is larger by c cos 4θ. Interpolation between the pixels of
    /// a colour filter, sharpening and JPEG treat rows and columns alike, but not diagonals.
    pub cross: f64,
    /// Skewness of the blur along rows and columns: third cumulants relative to the cube of the blur. An image
    /// reduced after demosaicing has them, because the filters have fixed positions in each of its pixels.
    pub skewness: [f64; 2],
    /// Whether the astigmatism is motion blur along a line instead of a Gaussian.
    pub is_motion: bool,
    /// Strength of the halo, and its width relative to the blur.
    pub halo: [f64; 2],
    /// Ink spread: growth of dark areas on the print, in units of [`INK_UNIT`].
    pub ink: f64,
    /// Factor of the covariances of corners, for noise that is not white.
    pub inflation: f64,
    /// Upper limits of the variances of x and y from displaced columns and rows of pixels, px².
    pub displaced: [f64; 2],
    /// Covariance xx, xy, yy of the displacement of corners due to the uncertainty of the optics,
    /// px².
    pub shift: [f64; 3],
    /// Median residual of single corners without these parameters, in units of half the contrast.
    pub plain_residual: f64,
    /// The estimated tone curve, for the report.
    pub tone: Option<ToneEstimate>,
    /// The estimated ink spread, for the report.
    pub ink_found: Option<InkEstimate>,
}

impl Default for Optics {
    fn default() -> Self {
        Self {
            is_open: false,
            is_ink_open: false,
            curve: None,
            params: [0.0; TONE_PARAMS],
            range: [0.0, 1.0],
            astigmatism: [0.0; 2],
            cross: 0.0,
            skewness: [0.0; 2],
            is_motion: false,
            halo: [0.0, HALO_WIDTH],
            ink: 0.0,
            inflation: 1.0,
            displaced: [0.0; 2],
            shift: [0.0; 3],
            plain_residual: 0.0,
            tone: None,
            ink_found: None,
        }
    }
}

/// Minimum stretch of the blur that can be motion. Below it, motion changes the kurtosis by less than a fifth.
pub(crate) const MIN_MOTION: f64 = 0.25;

/// Distribution of the blur over directions: M, of trace 2, or its remainder without motion along a line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spread {
    astigmatism: [f64; 2],
    /// Fraction of the astigmatism that the motion explains, and magnitude of the astigmatism.
    part: f64,
    length: f64,
    /// Whether there is motion blur.
    pub is_swept: bool,
    /// Half of the motion vector, in units of the blur, and its derivatives with respect to both
    /// parameters of astigmatism.
    pub way: [f64; 2],
    pub way_by_astigmatism: [[f64; 2]; 2],
}

impl Spread {
    /// Returns the bilinear form aᵀ M b.
    pub(crate) fn product(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        let [along, across] = parts(a, b);
        let [e1, e2] = self.astigmatism;
        (1.0 - self.part * self.length) * (a[0] * b[0] + a[1] * b[1])
            + (1.0 - self.part) * (e1 * along + e2 * across)
    }

    /// Returns the derivatives of [`Self::product`] with respect to both parameters of astigmatism.
    pub(crate) fn by_astigmatism(&self, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        let parts = parts(a, b);
        let round = self.part * (a[0] * b[0] + a[1] * b[1]);
        [0, 1].map(|e| match self.is_swept {
            true => (1.0 - self.part) * parts[e] - round * self.astigmatism[e] / self.length,
            false => parts[e],
        })
    }
}

/// Returns the coefficients of both parameters of astigmatism in aᵀ M b.
fn parts(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

impl Optics {
    /// Returns optics with a given tone curve, and nothing else known.
    pub(crate) fn of(tone: Tone) -> Self {
        Self { is_open: tone == Tone::Auto, curve: Curve::of(tone), ..Self::default() }
    }

    /// Returns these optics for a print with this ink spread, in edges; `None` if it is unknown.
    pub(crate) fn with_ink(self, ink: Option<f64>) -> Self {
        Self { is_ink_open: ink.is_none(), ink: ink.unwrap_or(0.0) / INK_UNIT, ..self }
    }

    /// Returns these optics with a first estimate of an unknown ink spread, in edges.
    pub(crate) fn with_ink_near(self, ink: f64) -> Self {
        Self { ink: ink / INK_UNIT, ..self }
    }

    /// Returns these optics with a first estimate of the astigmatism of an image with motion.
    pub(crate) fn with_motion_near(&self, astigmatism: [f64; 2]) -> Self {
        let mut params = self.vector();
        params[TONE_PARAMS..CROSS].copy_from_slice(&astigmatism);
        Self { is_motion: true, ..self.with(&params) }
    }

    /// Returns the ink spread, in edges.
    pub(crate) fn ink(&self) -> f64 {
        INK_UNIT * self.ink
    }

    /// Returns whether the ink spread is unknown.
    pub(crate) fn is_ink_open(&self) -> bool {
        self.is_ink_open
    }

    /// Returns these optics with the ink spread treated as known; an unknown ink spread counts as
    /// zero.
    pub(crate) fn with_ink_as_known(self) -> Self {
        Self { is_ink_open: false, ..self }
    }

    /// Returns the distribution of the blur over directions, for corners with this number of edges.
    pub(crate) fn spread(&self, edges: usize) -> Spread {
        let ([e1, e2], length) = (self.astigmatism, self.stretch());
        let is_swept = self.is_motion && length > 0.0;
        let still = Spread {
            astigmatism: [e1, e2],
            part: 0.0,
            length,
            is_swept,
            way: [0.0; 2],
            way_by_astigmatism: [[0.0; 2]; 2],
        };
        if !is_swept {
            return still;
        }
        // The variance of a box is a third of the square of half its length. It is the excess of the blur along the
        // motion over that across it: 2 · length, because M has the trace 2.
        let (far, turn) = ((6.0 * length).sqrt(), e2.atan2(e1) / 2.0);
        let way = [far * turn.cos(), far * turn.sin()];
        let square = 2.0 * length * length;
        let by = |longer: f64, turned: f64| {
            [way[0] * longer - way[1] * turned, way[1] * longer + way[0] * turned]
        };
        let way_by_astigmatism = [by(e1 / square, -e2 / square), by(e2 / square, e1 / square)];
        let part = if edges == 2 { PLACES_OF_FOUR } else { 1.0 };
        Spread { part, way, way_by_astigmatism, ..still }
    }

    /// Returns the difference of the squared blur along both principal axes, relative to their sum.
    pub(super) fn stretch(&self) -> f64 {
        let [e1, e2] = self.astigmatism;
        e1.hypot(e2)
    }

    /// Returns the smallest blur over all directions, relative to the mean blur.
    pub(crate) fn narrowest(&self) -> f64 {
        (1.0 - self.stretch() - self.cross.abs()).sqrt()
    }

    /// Returns the blur of the pattern without halo, relative to the blur of a pattern without halo whose edges have
    /// the same slope: (1 + α)/s − α/(w·s) is the same for all α. So the blur of a corner is nearly the same with and
    /// without a halo.
    pub(crate) fn core(&self) -> f64 {
        let [strength, width] = self.halo;
        (1.0 + strength * (1.0 - 1.0 / width)).max(MIN_CORE)
    }

    /// Returns the derivative of the logarithm of [`Self::core`] with respect to the strength of
    /// the halo.
    pub(crate) fn ln_core_by_halo(&self) -> f64 {
        (1.0 - 1.0 / self.halo[1]) / self.core()
    }

    /// Returns whether there is a tone curve.
    pub(crate) fn is_toned(&self) -> bool {
        self.curve.is_some()
    }

    /// Returns the tone curve between the black and white of a corner.
    pub(crate) fn piece(&self, level: f64, amplitude: f64) -> Piece {
        match &self.curve {
            Some(curve) => curve.piece(level, amplitude),
            None => Piece::line(level, amplitude),
        }
    }

    /// Returns the optics with one parameter increased by a [`STEP`].
    pub(super) fn moved(&self, parameter: usize) -> Self {
        let mut params = self.vector();
        params[parameter] += STEP;
        self.with(&params)
    }

    pub(super) fn vector(&self) -> [f64; PARAMS] {
        let ([p1, p2, p3], [e1, e2], [g1, g2]) = (self.params, self.astigmatism, self.skewness);
        [p1, p2, p3, e1, e2, self.cross, g1, g2, self.halo[0], self.ink]
    }

    pub(super) fn with(
        &self,
        &[p1, p2, p3, e1, e2, cross, g1, g2, halo, ink]: &[f64; PARAMS],
    ) -> Self {
        let params = [p1, p2, p3];
        let curve = match params {
            same if same == self.params => self.curve.clone(),
            // The camera is linear again, and corners need no pieces of a curve.
            [0.0, 0.0, 0.0] => None,
            _ => Some(Curve::estimated(params, self.range)),
        };
        let long = ((e1.hypot(e2) + cross.abs()) / MAX_ASTIGMATISM).max(1.0);
        Self {
            curve,
            params,
            astigmatism: [e1 / long, e2 / long],
            cross: cross / long,
            skewness: [g1, g2].map(|g| g.clamp(-MAX_SKEWNESS, MAX_SKEWNESS)),
            halo: [halo, self.halo[1]],
            ink,
            ..self.clone()
        }
    }

    /// Returns κ₀ and κ₁ between black and white.
    pub(super) fn kappas(&self, [black, white]: [f64; 2]) -> [f64; 2] {
        let piece = self.piece((white + black) / 2.0, (white - black) / 2.0);
        [0, 1].map(|i| f64::from(piece.terms[i]))
    }

    /// Returns the derivative of κ₀ with respect to a parameter.
    pub(super) fn kappa_slope(&self, greys: [f64; 2], parameter: usize) -> f64 {
        match parameter {
            0..TONE_PARAMS => {
                (self.moved(parameter).kappas(greys)[0] - self.kappas(greys)[0]) / STEP
            }
            _ => 0.0,
        }
    }
}
