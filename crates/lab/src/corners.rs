//! The experiment of the paper's Fig. 6: precision of corner refinement against blur, noise and tilt.
//!
//! Each image shows one corner ([`SimulatedCorner`]). Its position is uniform in the central pixel, its illumination
//! changes by up to 10 % across 200 px, and its noise is white. Every method starts from the four pixel centres around
//! the true position. The errors are compared with the Cramér–Rao bound for the same images and the same 21×21 pixels.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;

use super::bound;
use deltille::detect::{RefineStatus, Refinement, Refiner, Tone};
use deltille::lattice::GridKind;
use deltille::raster::Gray;
use deltille::synth::SimulatedCorner;
use deltille_core::statistics::quantile;

/// Side of the window that all methods use, px: an 11×11 fit on smoothed pixels, as in the reference implementation.
pub const WINDOW_PX: usize = 21;

/// Side of an image, px: large enough for windows around starts that lie a pixel off the centre.
const SIDE: usize = 41;

/// Maximum illumination gradient, relative change per pixel: 10 % across 200 px.
const MAX_SLOPE: f64 = 0.1 / 200.0;

/// Error above which a fit is counted as having converged to something other than the corner, px.
pub const FAR_PX: f64 = 0.5;

/// Blur, noise and maximum tilt in sweeps that do not vary them.
const BLUR_PX: f64 = 1.0;
const NOISE: f64 = 0.01;
const MAX_TILT_DEG: f64 = 60.0;

/// The varied quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sweep {
    /// Gaussian blur, px.
    Blur,
    /// Noise, % of full scale.
    Noise,
    /// Tilt, degrees; uniform up to 60° in the other sweeps.
    Tilt,
    /// Gamma of the camera: grey = light^(1/γ), applied before the noise.
    Tone,
}

impl Sweep {
    /// All sweeps; those of the paper come first, in its order.
    pub const ALL: [Self; 4] = [Self::Blur, Self::Noise, Self::Tilt, Self::Tone];

    /// Returns the values of the sweep.
    pub fn values(self) -> &'static [f64] {
        match self {
            Self::Blur => &[0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0],
            Self::Noise => &[0.5, 1.0, 2.0, 3.0, 4.0, 5.0],
            Self::Tilt => &[0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0],
            Self::Tone => &[1.0, 1.2, 1.4, 1.8, 2.2, 2.6],
        }
    }

    /// Returns the name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Blur => "blur_px",
            Self::Noise => "noise_percent",
            Self::Tilt => "tilt_deg",
            Self::Tone => "gamma",
        }
    }
}

/// The methods compared.
pub const METHODS: [Method; 5] = [
    Method::Polynomial(1),
    Method::Polynomial(2),
    Method::Polynomial(5),
    Method::Model,
    Method::ModelWithTone,
];

/// A refinement method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The paper's polynomial fit, with this number of iterations.
    Polynomial(usize),
    /// The model fit for a linear camera, starting from the result of the polynomial.
    Model,
    /// The model fit, with the tone curve estimated from this one corner.
    ModelWithTone,
}

impl Method {
    /// Returns the name in tables.
    pub fn name(self) -> String {
        match self {
            Self::Polynomial(t) => format!("polynomial t = {t}"),
            Self::Model => "model".to_owned(),
            Self::ModelWithTone => "model with tone curve".to_owned(),
        }
    }

    fn refiner(self, kind: GridKind) -> Refiner {
        match self {
            Self::Polynomial(t) => {
                Refiner::new(kind, Refinement::Polynomial, WINDOW_PX).with_iterations(t)
            }
            Self::Model => Refiner::new(kind, Refinement::Model, WINDOW_PX),
            Self::ModelWithTone => {
                Refiner::new(kind, Refinement::Model, WINDOW_PX).with_tone(Tone::Auto)
            }
        }
    }
}

/// One row of the result: one method at one point of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Deltille or checker.
    pub kind: GridKind,
    /// The varied quantity.
    pub sweep: Sweep,
    /// Its value.
    pub value: f64,
    /// Refinement method.
    pub method: Method,
    /// Number of fits: four per image.
    pub fits: usize,
    /// Mean, median and 95th percentile of the error of all fits that found a corner, px.
    pub error_px: [f64; 3],
    /// Smallest mean error of an unbiased method, px.
    pub bound_px: f64,
    /// Number of fits that found no corner.
    pub failed: usize,
    /// Number of fits with an error above [`FAR_PX`].
    pub far: usize,
    /// Mean of eᵀC⁻¹e with the reported covariances: 2 if they are correct.
    pub nees: Option<f64>,
}

/// Returns the number of rows, which is also the number of progress reports.
pub fn rows_count() -> usize {
    2 * METHODS.len() * Sweep::ALL.iter().map(|sweep| sweep.values().len()).sum::<usize>()
}

/// Runs the experiment with `images` images per point. `tone` is the tone curve of the camera in sweeps that do not
/// vary it. Returns `None` if cancelled.
///
/// The result depends only on `images` and `seed`. `progress` is called once per row.
pub fn run(
    images: usize,
    seed: u64,
    tone: Tone,
    cancel: &AtomicBool,
    progress: &(dyn Fn() + Sync),
) -> Option<Vec<Row>> {
    let mut rows = Vec::with_capacity(rows_count());
    let mut stream = 0;
    for kind in [GridKind::Deltille, GridKind::Checker] {
        for sweep in Sweep::ALL {
            for &value in sweep.values() {
                rows.extend(point(kind, sweep, value, tone, [seed, stream], images, cancel)?);
                METHODS.iter().for_each(|_| progress());
                stream += 1;
            }
        }
    }
    Some(rows)
}

/// Runs all methods at one point of a sweep.
pub fn point(
    kind: GridKind,
    sweep: Sweep,
    value: f64,
    tone: Tone,
    [seed, stream]: [u64; 2],
    images: usize,
    cancel: &AtomicBool,
) -> Option<Vec<Row>> {
    let refiners = METHODS.map(|method| method.refiner(kind));
    let samples: Option<Vec<Sample>> = (0..images)
        .into_par_iter()
        .map(|image| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(stream << 32 | image as u64);
            (!cancel.load(Ordering::Relaxed))
                .then(|| sample(kind, sweep, value, tone, &mut rng, &refiners))
        })
        .collect();
    let samples = samples?;
    let bounds: Vec<f64> = samples.iter().filter_map(|sample| sample.bound_px).collect();
    let bound_px = mean(&bounds);
    let rows = METHODS.iter().enumerate().map(|(m, &method)| {
        let outcomes = || samples.iter().flat_map(|sample| sample.outcomes[m]);
        let mut errors: Vec<f64> = outcomes().filter_map(|o| Some(o?.error_px)).collect();
        let middle = mean(&errors);
        let mut quantile = |part: f64| quantile(&mut errors, part).unwrap_or(f64::NAN);
        let nees: Vec<f64> = outcomes().filter_map(|o| o?.nees).collect();
        Row {
            kind,
            sweep,
            value,
            method,
            fits: 4 * images,
            error_px: [middle, quantile(0.5), quantile(0.95)],
            bound_px,
            failed: 4 * images - errors.len(),
            far: errors.iter().filter(|&&error| error > FAR_PX).count(),
            nees: (!nees.is_empty()).then(|| mean(&nees)),
        }
    });
    Some(rows.collect())
}

/// Result of a fit that found a corner.
#[derive(Clone, Copy)]
struct Outcome {
    error_px: f64,
    nees: Option<f64>,
}

/// Result of one image: its bound, and the outcome of each method from each start.
struct Sample {
    bound_px: Option<f64>,
    outcomes: [[Option<Outcome>; 4]; METHODS.len()],
}

fn sample(
    kind: GridKind,
    sweep: Sweep,
    value: f64,
    tone: Tone,
    rng: &mut ChaCha8Rng,
    refiners: &[Refiner; METHODS.len()],
) -> Sample {
    let tilt_deg = rng.random_range(0.0..MAX_TILT_DEG);
    let (blur_px, noise, tilt_deg) = match sweep {
        Sweep::Blur => (value, NOISE, tilt_deg),
        Sweep::Noise => (BLUR_PX, value / 100.0, tilt_deg),
        Sweep::Tilt => (BLUR_PX, NOISE, value),
        Sweep::Tone => (BLUR_PX, NOISE, tilt_deg),
    };
    let tone = if sweep == Sweep::Tone { Tone::Gamma(value) } else { tone };
    let centre = (SIDE / 2) as f64;
    let offset = DVec2::new(rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5));
    let truth = centre + offset;
    let lines = match kind {
        GridKind::Deltille => 3,
        GridKind::Checker => 2,
    };
    let axis = rng.random_range(0.0..TAU);
    let (slope, towards) = (rng.random_range(-MAX_SLOPE..MAX_SLOPE), rng.random_range(0.0..TAU));
    let corner = SimulatedCorner {
        slope: slope * DVec2::from_angle(towards),
        ..SimulatedCorner::seen_from(lines, axis, tilt_deg.to_radians(), truth, blur_px)
    };
    let mut image = corner.render(SIDE, SIDE);
    for pixel in image.pixels_mut() {
        *pixel = tone.grey(f64::from(*pixel)) as f32;
    }
    add_noise(&mut image, noise, rng);
    let starts = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|corner| truth.floor() + corner);
    let outcome = |refiner: &Refiner, start| {
        let refined = refiner.refine(&image, start);
        let DVec2 { x: dx, y: dy } = refined.position - truth;
        let nees = refined.cov.map(|[xx, xy, yy]| {
            (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
        });
        let found = refined.status != RefineStatus::Failed;
        found.then_some(Outcome { error_px: dx.hypot(dy), nees })
    };
    Sample {
        bound_px: bound::covariance(&corner, WINDOW_PX / 2, noise, tone)
            .and_then(|covariance| bound::mean_length(&covariance)),
        outcomes: std::array::from_fn(|m| starts.map(|start| outcome(&refiners[m], start))),
    }
}

fn add_noise(image: &mut Gray<f32>, noise: f64, rng: &mut ChaCha8Rng) {
    let Ok(normal) = Normal::new(0.0, noise) else { return };
    for pixel in image.pixels_mut() {
        *pixel += normal.sample(rng) as f32;
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Formats the result as CSV.
pub fn csv(rows: &[Row]) -> String {
    let mut text =
        "kind,sweep,value,method,fits,mean_px,median_px,p95_px,bound_px,failed,far,nees\n"
            .to_owned();
    for row in rows {
        let kind = name(row.kind);
        let (sweep, value, method) = (row.sweep.name(), row.value, row.method.name());
        let ([mean, median, p95], bound) = (row.error_px, row.bound_px);
        let nees = row.nees.map_or_else(String::new, |nees| format!("{nees:.3}"));
        let (fits, failed, far) = (row.fits, row.failed, row.far);
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{kind},{sweep},{value},{method},{fits},{mean:.5},{median:.5},{p95:.5},{bound:.5},\
             {failed},{far},{nees}"
        );
    }
    text
}

/// Returns the name of a kind of corner.
pub fn name(kind: GridKind) -> &'static str {
    match kind {
        GridKind::Deltille => "deltille",
        GridKind::Checker => "checker",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small version of the experiment at its default point, with the error limits of the full one.
    #[test]
    fn the_model_is_near_the_bound_and_its_covariances_are_correct() {
        let never = AtomicBool::new(false);
        for (kind, model_px, polynomial_px) in
            [(GridKind::Deltille, 0.0070_f64, 0.0117), (GridKind::Checker, 0.0085, 0.0171)]
        {
            let rows = point(kind, Sweep::Blur, 1.0, Tone::Linear, [1, 0], 200, &never).unwrap();
            let (polynomial, model, toned) = (&rows[2], &rows[3], &rows[4]);
            assert!(toned.error_px[0] < 1.03 * model.error_px[0], "{toned:?}");
            assert!(polynomial.error_px[0] < polynomial_px, "{polynomial:?}");
            assert!(model.error_px[0] < model_px.min(1.25 * model.bound_px), "{model:?}");
            assert!(model.error_px[0] > 0.85 * model.bound_px, "better than possible: {model:?}");
            assert!(model.failed + model.far == 0, "{model:?}");
            // The mean of 200 images with two degrees of freedom each has a standard deviation of 0.14.
            assert!((model.nees.unwrap() - 2.0).abs() < 0.45, "{model:?}");
        }
    }

    /// A gamma of 2.2 shifts the corner of a linear model by more than the noise does; estimating the curve corrects
    /// this.
    #[test]
    fn tone_curves_are_estimated_from_the_corner() {
        let never = AtomicBool::new(false);
        for (kind, model_px) in [(GridKind::Deltille, 0.0095), (GridKind::Checker, 0.0115)] {
            let gamma = Sweep::Tone;
            let rows = point(kind, gamma, 2.2, Tone::Linear, [1, 0], 200, &never).unwrap();
            let toned = &rows[4];
            assert!(toned.error_px[0] < model_px, "{toned:?}");
            assert!(toned.error_px[0] < 1.25 * toned.bound_px, "{toned:?}");
            assert!((toned.nees.unwrap() - 2.0).abs() < 0.6, "{toned:?}");
        }
    }

    #[test]
    fn results_depend_only_on_the_seed_and_runs_can_be_cancelled() {
        let run = |seed| {
            let never = AtomicBool::new(false);
            csv(&point(GridKind::Checker, Sweep::Tilt, 45.0, Tone::Linear, [seed, 0], 8, &never)
                .unwrap())
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
        assert!(super::run(1, 1, Tone::Linear, &AtomicBool::new(true), &|| ()).is_none());
    }
}
