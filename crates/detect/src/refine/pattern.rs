//! Patterns of brightness around a corner, and their evaluation.
//!
//! A pattern is composed of simpler ones: a halo of edges in motion, motion of displaced edges, displacement of edges.
//! Blocks of pixels are evaluated together, so that each part has one loop, compiled once for each kind of processor,
//! whatever it is composed of.

use multiversion::multiversion;

/// Pairs of edges.
pub(crate) const PAIRS: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// Number of pixels that are evaluated together: their values stay in the fastest cache.
pub(crate) const BLOCK: usize = 64;

/// A value with its derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade<const K: usize> {
    /// f, −1 to 1.
    pub f: f32,
    /// ∂f/∂h_k.
    pub slopes: [f32; K],
    /// ∂f/∂ρ for each of [`PAIRS`]; 0 if f does not depend on it.
    pub correlations: [f32; PAIRS.len()],
    /// ∂f/∂α, with the strength α of a halo; 0 without one.
    pub halo: f32,
    /// ∂f/∂d_k, if the halves of the edges are displaced.
    pub shifts: [f32; K],
    /// Derivatives with respect to half of the motion across each edge; 0 without motion.
    pub way: [f32; K],
    /// Derivatives with respect to the strengths of the box of a pixel; 0 without it.
    pub boxed: [f32; K],
}

impl<const K: usize> Shade<K> {
    /// Creates a value that depends only on the distances from the edges.
    #[inline(always)]
    pub(crate) fn new(f: f32, slopes: [f32; K]) -> Self {
        let none = [0.0; K];
        Self {
            f,
            slopes,
            correlations: [0.0; PAIRS.len()],
            halo: 0.0,
            shifts: none,
            way: none,
            boxed: none,
        }
    }
}

/// The values of a block, by field of [`Shade`].
#[derive(Clone, Debug)]
pub(crate) struct Shades<const K: usize> {
    f: [f32; BLOCK],
    slopes: [[f32; BLOCK]; K],
    correlations: [[f32; BLOCK]; PAIRS.len()],
    halo: [f32; BLOCK],
    shifts: [[f32; BLOCK]; K],
    way: [[f32; BLOCK]; K],
    boxed: [[f32; BLOCK]; K],
}

impl<const K: usize> Shades<K> {
    /// Zeros.
    pub(crate) const NONE: Self = Self {
        f: [0.0; BLOCK],
        slopes: [[0.0; BLOCK]; K],
        correlations: [[0.0; BLOCK]; PAIRS.len()],
        halo: [0.0; BLOCK],
        shifts: [[0.0; BLOCK]; K],
        way: [[0.0; BLOCK]; K],
        boxed: [[0.0; BLOCK]; K],
    };

    /// Returns the value at a pixel of the block.
    #[inline(always)]
    pub(crate) fn at(&self, i: usize) -> Shade<K> {
        Shade {
            f: self.f[i],
            slopes: column(&self.slopes, i),
            correlations: column(&self.correlations, i),
            halo: self.halo[i],
            shifts: column(&self.shifts, i),
            way: column(&self.way, i),
            boxed: column(&self.boxed, i),
        }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, shade: Shade<K>) {
        self.f[i] = shade.f;
        self.halo[i] = shade.halo;
        for p in 0..PAIRS.len() {
            self.correlations[p][i] = shade.correlations[p];
        }
        for k in 0..K {
            self.slopes[k][i] = shade.slopes[k];
            self.shifts[k][i] = shade.shifts[k];
            self.way[k][i] = shade.way[k];
            self.boxed[k][i] = shade.boxed[k];
        }
    }
}

/// Signed distances of the pixels of a block from each edge, in units of the blur.
#[derive(Clone, Debug)]
pub(crate) struct Distances<const K: usize> {
    /// Number of pixels, up to [`BLOCK`].
    pub count: usize,
    /// The distances.
    pub h: [[f32; BLOCK]; K],
}

impl<const K: usize> Distances<K> {
    /// Returns other distances of the same pixels.
    pub(crate) fn map(&self, mut other: impl FnMut([f32; K]) -> [f32; K]) -> Self {
        let mut moved = Self { count: self.count, h: [[0.0; BLOCK]; K] };
        for i in 0..self.count.min(BLOCK) {
            for (row, h) in moved.h.iter_mut().zip(other(column(&self.h, i))) {
                row[i] = h;
            }
        }
        moved
    }
}

#[inline(always)]
fn column<const N: usize>(rows: &[[f32; BLOCK]; N], i: usize) -> [f32; N] {
    std::array::from_fn(|n| rows[n][i])
}

/// The brightness around a corner of K edges.
pub(crate) trait Pattern<const K: usize> {
    /// Computes the brightness at these distances from the edges.
    fn shade(&self, distances: &Distances<K>, shades: &mut Shades<K>);
}

/// The brightness at a pixel, given a simpler pattern there and N others.
///
/// A trait, because its method is compiled for the processor of the loop into which it is inlined. Closures that are
/// called twice are not.
pub(crate) trait Combination<const K: usize, const N: usize> {
    /// Returns the brightness at distances h from the edges.
    fn at(&self, h: [f32; K], simpler: Shade<K>, others: [Shade<K>; N]) -> Shade<K>;
}

/// Combines a pattern with N others at the pixels of a block. `shades` has its values before, which patterns of edges alone
/// ignore, and those of the combination afterwards.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub(crate) fn combine<const K: usize, const N: usize, C: Combination<K, N>>(
    combination: &C,
    distances: &Distances<K>,
    others: [&Shades<K>; N],
    shades: &mut Shades<K>,
) {
    for i in 0..distances.count.min(BLOCK) {
        let mut there = [Shade::new(0.0, [0.0; K]); N];
        for (there, other) in there.iter_mut().zip(others) {
            *there = other.at(i);
        }
        shades.set(i, combination.at(column(&distances.h, i), shades.at(i), there));
    }
}

/// Returns the brightness at one place.
#[cfg(test)]
pub(crate) fn at<const K: usize>(pattern: &impl Pattern<K>, h: [f32; K]) -> Shade<K> {
    let mut shades = Shades::NONE;
    pattern.shade(&Distances { count: 1, h: h.map(|h| [h; BLOCK]) }, &mut shades);
    shades.at(0)
}
