//! The model at every pixel of a window, its derivatives, and its residuals.

use multiversion::multiversion;

use super::beside::Beside;
use super::corner::{AMPLITUDE, ANGLE, Corner, LEVEL, LN_BLUR, PARAMS, SLOPE, X, Y};
use super::look::Look;
use super::window::{MAX_PIXELS, Window};
use crate::refine::blurred_corner::{
    Deltille, FEW_NODES_RHO, Orthant, SweptChecker, SweptDeltille, WithPixel, edge_slope,
};
use crate::refine::pattern::{BLOCK, Combination, Distances, PAIRS, Pattern, Shade, Shades};
use deltille_core::detection::TONE_PARAMS;

/// First of the rows after the residual, for the parameters that all corners share: amplitude · (1
/// − S²).
pub(super) const RISE: usize = PARAMS + 1;
/// S.
pub(super) const SHADE: usize = PARAMS + 2;
/// Derivatives with respect to the two parameters of astigmatism, and to the cross.
pub(super) const SHAPE: usize = PARAMS + 3;
/// Derivatives with respect to the skewness along rows and columns.
pub(super) const SKEWNESS: usize = PARAMS + 6;
/// Derivatives with respect to the strength of the halo.
pub(super) const HALO: usize = PARAMS + 8;
/// Derivatives with respect to the ink.
pub(super) const INK: usize = PARAMS + 9;
/// Derivatives with respect to the parameters of the tone curve.
pub(super) const TONE: usize = PARAMS + 10;

/// Number of rows, in blocks of four.
pub(super) const ALL: usize = (TONE + TONE_PARAMS).next_multiple_of(4);

/// One row for each parameter, then the residual; one column for each pixel.
pub(super) type Columns = [[f32; MAX_PIXELS]; ALL];

/// The pixels of a window, and the effect of borders of tags on them.
#[derive(Clone, Copy)]
pub(super) struct Shown<'a> {
    pub(super) pixels: &'a [f32; MAX_PIXELS],
    pub(super) beside: &'a Beside,
}

/// Fills the columns of a corner in window coordinates. Includes those of the shared parameters if it is fitted
/// `JOINT`ly.
pub(super) fn fill_columns<const K: usize, const JOINT: bool>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<K>,
    look: &Look<K>,
) {
    let scene = Scene { shown, window, corner, look };
    if K == 2 {
        let rho = look.correlations[0].rho;
        match rho.abs() <= FEW_NODES_RHO {
            true => scene.fill_checker::<JOINT, _>(columns, Orthant::of_few_nodes(rho)),
            false => scene.fill_checker::<JOINT, _>(columns, Orthant::new(rho)),
        }
    } else {
        scene.fill_deltille::<JOINT>(columns);
    }
}

/// A corner in a window.
struct Scene<'a, const C: usize> {
    shown: Shown<'a>,
    window: &'a Window,
    corner: &'a Corner<C>,
    look: &'a Look<C>,
}

impl<const C: usize> Scene<'_, C> {
    /// Fills the columns of a corner of two edges.
    fn fill_checker<const JOINT: bool, O: Copy>(&self, columns: &mut Columns, edges: O)
    where
        WithPixel<O, 2>: Combination<2, 0>,
    {
        let look = self.look;
        let still = look.with_pixel(edges);
        // Derivatives with respect to the ink also need displaced edges where it is 0.
        let parted = |by: f32| look.parted(still.scaled(by), by);
        match look.way {
            Some(way) => self.fill_haloed::<2, JOINT, 1, _>(columns, |by| SweptChecker {
                pattern: parted(by),
                way: [way[0] * by, way[1] * by],
            }),
            None if JOINT || look.is_inked() => {
                self.fill_haloed::<2, JOINT, 1, _>(columns, parted);
            }
            None => self.fill_haloed::<2, JOINT, 1, _>(columns, |by| still.scaled(by)),
        }
    }

    /// Fills the columns of a corner of three edges.
    fn fill_deltille<const JOINT: bool>(&self, columns: &mut Columns) {
        let look = self.look;
        let still = |by: f32| look.with_pixel(Deltille).scaled(by);
        match (look.way, look.is_inked()) {
            (Some(way), is_inked) => {
                let way: [f32; 3] = std::array::from_fn(|k| way.get(k).copied().unwrap_or(0.0));
                let swept = |by: f32| SweptDeltille::new(way.map(|way| way * by));
                if is_inked {
                    let pattern = look.with_triangle(look.haloed_of(swept));
                    fill::<3, C, JOINT, 3>(columns, self, &pattern);
                } else {
                    self.fill_haloed::<3, JOINT, 0, _>(columns, swept);
                }
            }
            (None, true) => match look.with_spot(still(1.0), 1.0) {
                // The halo is wider than the blur, so its spot is relatively smaller.
                Some(near) => self.fill_haloed::<3, JOINT, 0, _>(columns, |by| {
                    look.with_spot(still(by), by).unwrap_or(near)
                }),
                None => {
                    self.fill_haloed::<3, JOINT, 3, _>(columns, |by| look.with_triangle(still(by)))
                }
            },
            (None, false) => self.fill_haloed::<3, JOINT, 0, _>(columns, still),
        }
    }

    /// Fills the columns of a pattern with the halo of the image. `pattern` creates it with its lengths multiplied by a
    /// factor. Derivatives with respect to the halo also need both widths where it is 0.
    fn fill_haloed<const K: usize, const JOINT: bool, const CORRELATED: usize, P: Pattern<K>>(
        &self,
        columns: &mut Columns,
        pattern: impl Fn(f32) -> P,
    ) {
        if JOINT || self.look.has_halo() {
            fill::<K, C, JOINT, CORRELATED>(columns, self, &self.look.haloed_of(pattern));
        } else {
            fill::<K, C, JOINT, CORRELATED>(columns, self, &pattern(1.0));
        }
    }
}

/// The edges of a corner in a window, in units of the blur across them.
struct Lines<const K: usize> {
    /// The corner, px.
    place: [f32; 2],
    sines: [f32; K],
    cosines: [f32; K],
    /// Curvatures.
    bends: [f32; K],
    /// Displacements of three edges by ink.
    moved: [f32; K],
}

impl<const K: usize> Lines<K> {
    fn of<const C: usize>(corner: &Corner<C>, look: &Look<C>) -> Self {
        let (rotations, sharpness) = (look.rotations, look.sharpness);
        Self {
            place: corner.position.as_vec2().to_array(),
            sines: std::array::from_fn(|k| (rotations[k].0 * sharpness[k]) as f32),
            cosines: std::array::from_fn(|k| (rotations[k].1 * sharpness[k]) as f32),
            bends: std::array::from_fn(|k| (corner.bends[k] / sharpness[k]) as f32),
            moved: std::array::from_fn(|k| if K == 3 { look.displaced[k] as f32 } else { 0.0 }),
        }
    }

    /// Returns the position of a pixel relative to the corner.
    #[inline(always)]
    fn offset(&self, u: f32, v: f32) -> [f32; 2] {
        [u - self.place[0], v - self.place[1]]
    }

    /// Returns the position along an edge.
    #[inline(always)]
    fn along(&self, k: usize, du: f32, dv: f32) -> f32 {
        self.cosines[k] * du + self.sines[k] * dv
    }

    /// Computes the distances of pixels from the edges.
    #[inline(always)]
    fn distances(&self, us: &[f32], vs: &[f32], distances: &mut Distances<K>) {
        distances.count = us.len().min(BLOCK);
        for (i, (u, v)) in us.iter().zip(vs).enumerate().take(BLOCK) {
            let [du, dv] = self.offset(*u, *v);
            for k in 0..K {
                let along = self.along(k, du, dv);
                let across = self.cosines[k] * dv - self.sines[k] * du;
                distances.h[k][i] = across - 0.5 * self.bends[k] * along * along - self.moved[k];
            }
        }
    }
}

/// Fills the columns of derivatives and residuals of a pattern that depends on the first `CORRELATED` of [`PAIRS`].
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill<const K: usize, const C: usize, const JOINT: bool, const CORRELATED: usize>(
    columns: &mut Columns,
    scene: &Scene<C>,
    pattern: &dyn Pattern<K>,
) {
    let Scene { shown: Shown { pixels, beside }, window, corner, look } = *scene;
    let lines = Lines::<K>::of(corner, look);
    let Lines { sines, cosines, bends, .. } = lines;
    let by_turn: [f32; K] = std::array::from_fn(|k| look.by_turn[k] as f32);
    // Derivatives of the correlations that the pattern depends on, with respect to each angle.
    let mut rho_by_angle = [[0.0f32; K]; PAIRS.len()];
    for (by_angle, (pair, of)) in rho_by_angle.iter_mut().zip(PAIRS.iter().zip(&look.correlations))
    {
        for (edge, by) in pair.iter().zip(of.by_angle) {
            if let Some(here) = by_angle.get_mut(*edge) {
                *here = by as f32;
            }
        }
    }
    let by_shape: [[f32; K]; 3] =
        [0, 1, 2].map(|e| std::array::from_fn(|k| look.by_shape[e][k] as f32));
    let rho_by_shape = look.correlations.map(|of| of.by_shape.map(|by| by as f32));
    let skewness: [f32; K] = std::array::from_fn(|k| look.skewness[k] as f32);
    let skewness_by_turn: [f32; K] = std::array::from_fn(|k| look.skewness_by_turn[k] as f32);
    let by_skewness: [[f32; K]; 2] =
        [0, 1].map(|e| std::array::from_fn(|k| look.by_skewness[e][k] as f32));
    let pixel_by_sharpness: [f32; K] = std::array::from_fn(|k| look.pixel[k].by_sharpness as f32);
    let pixel_by_turn: [f32; K] = std::array::from_fn(|k| look.pixel[k].by_turn as f32);
    let way_by_turn: [f32; K] = std::array::from_fn(|k| look.way_by_turn[k] as f32);
    let way_by_shape: [[f32; K]; 3] =
        [0, 1, 2].map(|e| std::array::from_fn(|k| look.way_by_shape[e][k] as f32));
    // Halves of two edges part, and lines of three edges move.
    let parted: [f32; K] =
        std::array::from_fn(|k| if K == 3 { 0.0 } else { look.displaced[k] as f32 });
    let by_ink: [f32; K] = std::array::from_fn(|k| look.by_ink[k] as f32);
    let (amplitude, level) = (corner.amplitude as f32, corner.level as f32);
    let [gu, gv] = corner.slope.as_vec2().to_array();
    // The variance of the blur, by which a slope of the light displaces the pattern.
    let blur = corner.blur_px.powi(2) as f32;
    let (piece, [low, high]) = (look.piece, look.limits);
    let n = window.u.len().min(MAX_PIXELS);
    let mut distances = Distances { count: 0, h: [[0.0; BLOCK]; K] };
    let mut shades = Shades::NONE;
    for start in (0..n).step_by(BLOCK) {
        // Indices are then known to be valid.
        let start = start.min(MAX_PIXELS - BLOCK);
        let count = (n - start).min(BLOCK);
        let (us, vs) = (&window.u[start..start + count], &window.v[start..start + count]);
        lines.distances(us, vs, &mut distances);
        pattern.shade(&distances, &mut shades);
        for j in 0..count {
            let i = start + j;
            let (u, v) = (us[j], vs[j]);
            let [du, dv] = lines.offset(u, v);
            let along: [f32; K] = std::array::from_fn(|k| lines.along(k, du, dv));
            let h: [f32; K] = std::array::from_fn(|k| distances.h[k][j]);
            let Shade { mut f, mut slopes, correlations, halo, shifts, way, boxed } = shades.at(j);
            // The term of Edgeworth's series for the skewness of each of three edges.
            let mut skewed = [0.0; K];
            if K == 3 {
                for k in 0..K {
                    let (square, steep) =
                        (h[k] * h[k], if k == 1 { -1.0 } else { 1.0 } * edge_slope(h[k]));
                    skewed[k] = steep * (1.0 - square);
                    f += skewness[k] * skewed[k];
                    slopes[k] += skewness[k] * steep * h[k] * (square - 3.0);
                }
            }
            let (mut by_x, mut by_y, mut by_scale) = (0.0, 0.0, 0.0);
            // Only squares have tags with a border of the opposite colour.
            if K == 2 {
                f += beside.f[i];
                (by_x, by_y) = (beside.by_position[0][i], beside.by_position[1][i]);
                by_scale = beside.by_scale[i];
            }
            let change = gu * u + gv * v;
            let gain = 1.0 + change;
            let shade = f * gain + change * piece.ratio;
            let (tone, steepness) = piece.at(shade);
            let model = level + amplitude * tone;
            let seen = if model > low && model < high { 1.0 } else { 0.0 };
            let by_shade = amplitude * steepness * seen;
            let light = by_shade * gain;
            // The derivatives with respect to the logarithm of the blur across each edge, with opposite sign.
            let mut narrowed = [0.0; K];
            for k in 0..K {
                let bent = bends[k] * along[k];
                by_x += slopes[k] * (sines[k] + bent * cosines[k]);
                by_y -= slopes[k] * (cosines[k] - bent * sines[k]);
                narrowed[k] =
                    slopes[k] * h[k] + shifts[k] * parted[k] + pixel_by_sharpness[k] * boxed[k];
                by_scale -= narrowed[k];
                let across = cosines[k] * dv - sines[k] * du;
                let mut by = -slopes[k] * (along[k] + bent * across) - narrowed[k] * by_turn[k];
                for p in 0..CORRELATED {
                    by += correlations[p] * rho_by_angle[p][k];
                }
                by += way[k] * way_by_turn[k] + skewed[k] * skewness_by_turn[k];
                by += boxed[k] * pixel_by_turn[k];
                columns[ANGLE + k][i] = light * by;
            }
            let by_light = by_shade * (f + piece.ratio);
            let [by_x, by_y] = [light * by_x, light * by_y];
            columns[X][i] = by_x;
            columns[Y][i] = by_y;
            columns[LN_BLUR][i] = light * by_scale - 2.0 * blur * (gu * by_x + gv * by_y);
            columns[AMPLITUDE][i] = seen * (tone - steepness * change * piece.ratio);
            columns[LEVEL][i] = seen * (1.0 + steepness * change);
            columns[SLOPE][i] = u * by_light - blur * by_x;
            columns[SLOPE + 1][i] = v * by_light - blur * by_y;
            columns[PARAMS][i] = pixels[i] - model.max(low).min(high);
            if JOINT {
                columns[RISE][i] = amplitude * seen * (1.0 - shade * shade);
                columns[SHADE][i] = shade;
                columns[HALO][i] = light * (halo + by_scale * look.core_by_halo);
                let mut by = 0.0;
                for k in 0..K {
                    by += if K == 3 { -slopes[k] } else { shifts[k] } * by_ink[k];
                }
                columns[INK][i] = light * by;
                for e in 0..2 {
                    let by = (0..K).map(|k| skewed[k] * by_skewness[e][k]).sum::<f32>();
                    columns[SKEWNESS + e][i] = light * by;
                }
                for e in 0..3 {
                    let mut by = 0.0;
                    for p in 0..CORRELATED {
                        by += correlations[p] * rho_by_shape[p][e];
                    }
                    for k in 0..K {
                        by -= narrowed[k] * by_shape[e][k];
                        by += way[k] * way_by_shape[e][k];
                        by -= 3.0 * skewness[k] * skewed[k] * by_shape[e][k];
                    }
                    columns[SHAPE + e][i] = light * by;
                }
            }
        }
    }
}
