//! The model at every pixel of a window, its derivatives, and its residuals.

use multiversion::multiversion;

use super::beside::Beside;
use super::corner::{AMPLITUDE, ANGLE, Corner, LEVEL, LN_BLUR, PARAMS, SLOPE, X, Y};
use super::look::Look;
use super::window::{MAX_PIXELS, Window};
use crate::refine::blurred_corner::{
    Deltille, FEW_NODES_RHO, Orthant, PAIRS, Pattern, Shade, SweptChecker, SweptDeltille,
    WithPixel, edge_slope,
};
use crate::refine::displaced_edges::WithSpot;
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
    // Dispatches on constants first: branches that they exclude are not compiled.
    if K == 2 {
        let is_square = look.correlations[0].rho.abs() <= FEW_NODES_RHO;
        match (look.way.is_some() || look.is_inked() || JOINT, is_square) {
            (true, true) => fill_any_square::<K, JOINT>(columns, shown, window, corner, look),
            (true, false) => fill_any_checker::<K, JOINT>(columns, shown, window, corner, look),
            (false, true) => fill_square::<K, JOINT>(columns, shown, window, corner, look),
            (false, false) => fill_checker::<K, JOINT>(columns, shown, window, corner, look),
        }
    } else {
        match (look.way, look.is_inked()) {
            (Some(way), _) => {
                let way = std::array::from_fn(|k| way.get(k).copied().unwrap_or(0.0));
                fill_swept_deltille::<K, JOINT>(columns, shown, window, corner, look, way);
            }
            (None, true) => match look.with_spot(look.with_pixel(Deltille), 1.0) {
                Some(near) => {
                    fill_spot_deltille::<K, JOINT>(columns, shown, window, corner, look, near);
                }
                None => fill_inked_deltille::<K, JOINT>(columns, shown, window, corner, look),
            },
            (None, false) => fill_deltille::<K, JOINT>(columns, shown, window, corner, look),
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill_checker<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    let still = look.with_pixel(Orthant::new(look.correlations[0].rho));
    if look.has_halo() {
        let pattern = look.haloed_of(|by| still.scaled(by));
        fill::<2, C, JOINT, _>(columns, shown, window, corner, look, pattern);
    } else {
        fill::<2, C, JOINT, _>(columns, shown, window, corner, look, still);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill_square<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    let still = look.with_pixel(Orthant::of_few_nodes(look.correlations[0].rho));
    if look.has_halo() {
        let pattern = look.haloed_of(|by| still.scaled(by));
        fill::<2, C, JOINT, _>(columns, shown, window, corner, look, pattern);
    } else {
        fill::<2, C, JOINT, _>(columns, shown, window, corner, look, still);
    }
}

/// Two edges with motion, ink and a halo, each of which may be zero.
#[multiversion(targets("x86_64+avx2"))]
fn fill_any_checker<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    let still = look.with_pixel(Orthant::new(look.correlations[0].rho));
    fill_any::<C, JOINT, 6>(columns, shown, window, corner, look, still);
}

/// The same for edges that are nearly square.
#[multiversion(targets("x86_64+avx2"))]
fn fill_any_square<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    let still = look.with_pixel(Orthant::of_few_nodes(look.correlations[0].rho));
    fill_any::<C, JOINT, 3>(columns, shown, window, corner, look, still);
}

#[inline(always)]
fn fill_any<const C: usize, const JOINT: bool, const NODES: usize>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
    still: WithPixel<Orthant<NODES>, 2>,
) {
    let has_halo = JOINT || look.has_halo();
    let Some(way) = look.way.map(|way| [way[0], way[1]]) else {
        if has_halo {
            let pattern = look.haloed_of(|by| look.parted(still.scaled(by), by));
            fill::<2, C, JOINT, _>(columns, shown, window, corner, look, pattern);
        } else {
            let pattern = look.parted(still, 1.0);
            fill::<2, C, JOINT, _>(columns, shown, window, corner, look, pattern);
        }
        return;
    };
    let swept = |by: f32| SweptChecker {
        pattern: look.parted(still.scaled(by), by),
        way: [way[0] * by, way[1] * by],
    };
    if has_halo {
        fill::<2, C, JOINT, _>(columns, shown, window, corner, look, look.haloed_of(swept));
    } else {
        fill::<2, C, JOINT, _>(columns, shown, window, corner, look, swept(1.0));
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill_deltille<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    let still = look.with_pixel(Deltille);
    if JOINT || look.has_halo() {
        let pattern = look.haloed_of(|by| still.scaled(by));
        fill::<3, C, JOINT, _>(columns, shown, window, corner, look, pattern);
    } else {
        fill::<3, C, JOINT, _>(columns, shown, window, corner, look, still);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill_inked_deltille<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    let still = look.with_pixel(Deltille);
    let inked = look.with_triangle(still);
    if JOINT || look.has_halo() {
        let inked = |by: f32| look.with_triangle(still.scaled(by));
        fill::<3, C, JOINT, _>(columns, shown, window, corner, look, look.haloed_of(inked));
    } else {
        fill::<3, C, JOINT, _>(columns, shown, window, corner, look, inked);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill_spot_deltille<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
    near: WithSpot<WithPixel<Deltille, 3>>,
) {
    if JOINT || look.has_halo() {
        // The halo is wider than the blur, so its spot is relatively smaller.
        let still = look.with_pixel(Deltille);
        let spot = |by: f32| look.with_spot(still.scaled(by), by).unwrap_or(near);
        fill::<3, C, JOINT, _>(columns, shown, window, corner, look, look.haloed_of(spot));
    } else {
        fill::<3, C, JOINT, _>(columns, shown, window, corner, look, near);
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn fill_swept_deltille<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
    way: [f32; 3],
) {
    let swept = |by: f32| SweptDeltille::new(way.map(|way| way * by));
    if look.is_inked() {
        let pattern = look.with_triangle(look.haloed_of(swept));
        fill::<3, C, JOINT, _>(columns, shown, window, corner, look, pattern);
    } else if JOINT || look.has_halo() {
        fill::<3, C, JOINT, _>(columns, shown, window, corner, look, look.haloed_of(swept));
    } else {
        fill::<3, C, JOINT, _>(columns, shown, window, corner, look, swept(1.0));
    }
}

/// Fills the columns of derivatives and residuals.
#[inline(always)]
fn fill<const K: usize, const C: usize, const JOINT: bool, P: Pattern<K>>(
    columns: &mut Columns,
    shown: Shown,
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
    pattern: P,
) {
    let Shown { pixels, beside } = shown;
    let [x, y] = corner.position.as_vec2().to_array();
    // Directions of the edges, in units of the blur across them.
    let sines: [f32; K] = std::array::from_fn(|k| (look.rotations[k].0 * look.sharpness[k]) as f32);
    let cosines: [f32; K] =
        std::array::from_fn(|k| (look.rotations[k].1 * look.sharpness[k]) as f32);
    let bends: [f32; K] = std::array::from_fn(|k| (corner.bends[k] / look.sharpness[k]) as f32);
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
    let displaced: [f32; K] = std::array::from_fn(|k| look.displaced[k] as f32);
    // Lines of three edges move, and halves of two edges part.
    let moved: [f32; K] = if K == 3 { displaced } else { [0.0; K] };
    let parted: [f32; K] = if K == 3 { [0.0; K] } else { displaced };
    let by_ink: [f32; K] = std::array::from_fn(|k| look.by_ink[k] as f32);
    let (amplitude, level) = (corner.amplitude as f32, corner.level as f32);
    let [gu, gv] = corner.slope.as_vec2().to_array();
    let (piece, [low, high]) = (look.piece, look.limits);
    let n = window.u.len().min(MAX_PIXELS);
    let (us, vs) = (&window.u[..n], &window.v[..n]);
    for i in 0..n {
        let (u, v) = (us[i], vs[i]);
        let (du, dv) = (u - x, v - y);
        let along: [f32; K] = std::array::from_fn(|k| cosines[k] * du + sines[k] * dv);
        let h: [f32; K] = std::array::from_fn(|k| {
            cosines[k] * dv - sines[k] * du - 0.5 * bends[k] * along[k] * along[k] - moved[k]
        });
        let Shade { mut f, mut slopes, correlations, halo, shifts, way, boxed } = pattern.at(h);
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
            for p in 0..P::CORRELATED {
                by += correlations[p] * rho_by_angle[p][k];
            }
            by += way[k] * way_by_turn[k] + skewed[k] * skewness_by_turn[k];
            by += boxed[k] * pixel_by_turn[k];
            columns[ANGLE + k][i] = light * by;
        }
        let by_light = by_shade * (f + piece.ratio);
        columns[X][i] = light * by_x;
        columns[Y][i] = light * by_y;
        columns[LN_BLUR][i] = light * by_scale;
        columns[AMPLITUDE][i] = seen * (tone - steepness * change * piece.ratio);
        columns[LEVEL][i] = seen * (1.0 + steepness * change);
        columns[SLOPE][i] = u * by_light;
        columns[SLOPE + 1][i] = v * by_light;
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
                for p in 0..P::CORRELATED {
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
