//! The last word on a corner's position, from the raw pixels.
//!
//! The paper's polynomial walks to the corner; the model ([`super::corner_model`]) starts there
//! and adds a covariance. Where the model does not hold, the polynomial's result stays.
//!
//! ```
//! use deltille::detect::{Refinement, Refiner};
//! use deltille::synth::SimulatedCorner;
//! use deltille::target::GridKind;
//!
//! let image = SimulatedCorner::seen_from(2, 0.3, 0.5, [20.2, 19.9], 1.0).render(41, 41);
//! let refined = Refiner::new(GridKind::Checker, Refinement::Model, 21).refine(&image, [21.0, 20.0]);
//! assert!((refined.position[0] - 20.2).abs() < 1e-3 && refined.cov.is_some());
//! ```

use super::clearance::{Edge, Surroundings};
use super::corner_model::{Corner, CornerFitter, Fitted, MAX_RADIUS, Window};
use super::corner_start::{start, start_along};
use super::polynomial::Polynomial;
use crate::raster::{Gray, Intensity};
use crate::target::GridKind;

/// Smallest radius in which the model is fitted: 49 pixels for ten unknowns.
pub const MIN_MODEL_RADIUS: usize = 3;

/// Fewest pixels to which the model is fitted: three for each unknown, so that the noise shows.
const MIN_PIXELS: usize = 30;

/// Half the side of the square around a corner that must be clear for the polynomial, px: a third of
/// what its usual window reads, where nearly all of its weight lies.
const MIN_POLYNOMIAL_CLEAR_PX: f64 = 2.0;

/// Largest side of a window, px.
pub const MAX_WINDOW_PX: usize = 2 * MAX_RADIUS + 1;

/// How positions are refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Refinement {
    /// The paper's: the umbilic point of a cubic, or the saddle of a quadric.
    Polynomial,
    /// A blurred corner fitted to the pixels, from the polynomial's result.
    #[default]
    Model,
}

/// What came of a refinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefineStatus {
    /// The method asked for has found the corner.
    Ok,
    /// The model does not hold here; the position is the polynomial's.
    Polynomial,
    /// No corner; the position is the start.
    Failed,
}

/// A refined position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// Position, px.
    pub position: [f64; 2],
    /// Covariance xx, xy, yy, px², where the method gives one.
    pub cov: Option<[f64; 3]>,
    /// Which method found it.
    pub status: RefineStatus,
}

/// What the model found, of either kind of corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ModelFit {
    /// The corner; of two edges the last angle means nothing.
    corner: Corner<3>,
    /// Covariance xx, xy, yy of its position, px².
    pub cov: [f64; 3],
    /// Standard deviation of what is left, over half the contrast.
    pub residual: f64,
}

impl ModelFit {
    /// Position, px.
    pub fn position(&self) -> [f64; 2] {
        self.corner.position
    }

    /// Standard deviation of the blur with the pixel's box in it, px.
    pub fn blur_px(&self) -> f64 {
        self.corner.blur_px
    }
}

impl<const K: usize> From<Fitted<K>> for ModelFit {
    fn from(Fitted { corner, cov, noise }: Fitted<K>) -> Self {
        Self { corner: corner.with_edges(), cov, residual: noise / corner.amplitude.abs() }
    }
}

impl From<ModelFit> for Refined {
    fn from(fit: ModelFit) -> Self {
        Self { position: fit.position(), cov: Some(fit.cov), status: RefineStatus::Ok }
    }
}

/// What is known of the surroundings of a corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room<'a> {
    /// What lies there.
    pub around: &'a Surroundings,
    /// Deviation of the blur, px.
    pub blur_px: f64,
    /// Nothing beyond this in either coordinate is looked at, px.
    pub reach_px: f64,
}

impl Room<'_> {
    /// The pixels of the image that show nothing but the corner at `position`, within a radius.
    fn window<T: Intensity>(&self, image: &Gray<T>, position: [f64; 2], radius: usize) -> Window {
        let [x, y] = position;
        let [right, bottom] = [image.width(), image.height()].map(|side| side as f64 - 1.0);
        let is_clear = self.around.clear(self.blur_px);
        Window::of(radius, |[u, v]| {
            let [px, py] = [x.round() + u, y.round() + v];
            let inside = px >= 0.0 && py >= 0.0 && px <= right && py <= bottom;
            inside && is_clear([px - x, py - y])
        })
    }

    /// Half the side of the largest square that shows nothing else, px.
    pub fn clear_square_px(&self) -> f64 {
        self.around.clear_square_px(self.blur_px).min(self.reach_px)
    }
}

/// Refines corners of one kind.
#[derive(Clone, Debug)]
pub struct Refiner {
    polynomial: Polynomial,
    iterations: usize,
    method: Refinement,
    /// Windows of the model by radius, from [`MIN_MODEL_RADIUS`].
    windows: Vec<Window>,
}

impl Refiner {
    /// A refiner that reads at most `window_px` × `window_px` pixels, an odd number from 9 to
    /// [`MAX_WINDOW_PX`]; the polynomial reads 4r + 1 pixels for a whole r, the largest that fits.
    pub fn new(kind: GridKind, method: Refinement, window_px: usize) -> Self {
        let window_px = window_px.clamp(9, MAX_WINDOW_PX);
        Self::with_radii(kind, method, (window_px - 1) / 4, (window_px - 1) / 2)
    }

    /// A refiner with a polynomial of radius r and a model of at most `model_radius`.
    pub(super) fn with_radii(
        kind: GridKind,
        method: Refinement,
        polynomial_radius: usize,
        model_radius: usize,
    ) -> Self {
        let polynomial = Polynomial::new(kind, polynomial_radius);
        let iterations = polynomial.usual_iterations();
        let windows = (MIN_MODEL_RADIUS..=model_radius.min(MAX_RADIUS)).map(Window::new).collect();
        Self { polynomial, iterations, method, windows }
    }

    /// The same refiner with another number of iterations of the polynomial.
    pub fn with_iterations(self, iterations: usize) -> Self {
        Self { iterations, ..self }
    }

    /// The corner near `start`, in the whole window.
    pub fn refine<T: Intensity>(&self, image: &Gray<T>, start: [f64; 2]) -> Refined {
        let found = self.polynomial.refine(image, start, self.iterations).map(|c| c.position);
        let model = || {
            let mut fitter = CornerFitter::default();
            let position = found.unwrap_or(start);
            match self.polynomial {
                Polynomial::Cubic(_) => self.alone::<3, T>(&mut fitter, image, position),
                Polynomial::Quadric(_) => self.alone::<2, T>(&mut fitter, image, position),
            }
        };
        let fit = (self.method == Refinement::Model).then(model).flatten();
        fit.map_or_else(|| self.without_model(start, found), Refined::from)
    }

    /// A corner of a grid near `start`, from pixels that show nothing else. Beside it what the model
    /// found.
    pub(super) fn refine_within<T: Intensity>(
        &self,
        fitter: &mut CornerFitter,
        image: &Gray<T>,
        start: [f64; 2],
        room: Room,
    ) -> (Refined, Option<ModelFit>) {
        let mut model = |position| {
            let modelled = self.method == Refinement::Model;
            modelled.then(|| self.model(fitter, image, position, room, None)).flatten()
        };
        if let Some(fit) = model(start) {
            return (fit.into(), Some(fit));
        }
        // Where other edges are this near, they would draw the polynomial away from a start that the
        // finder has taken care of.
        let found = (room.clear_square_px() >= MIN_POLYNOMIAL_CLEAR_PX)
            .then(|| self.polynomial.refine(image, start, self.iterations))
            .flatten()
            .map(|corner| corner.position);
        match found.and_then(model) {
            Some(fit) => (fit.into(), Some(fit)),
            None => (self.without_model(start, found), None),
        }
    }

    fn without_model(&self, start: [f64; 2], polynomial: Option<[f64; 2]>) -> Refined {
        let status = match (polynomial, self.method) {
            (None, _) => RefineStatus::Failed,
            (Some(_), Refinement::Polynomial) => RefineStatus::Ok,
            (Some(_), Refinement::Model) => RefineStatus::Polynomial,
        };
        Refined { position: polynomial.unwrap_or(start), cov: None, status }
    }

    /// The model of a single corner, in the largest window that lies in the image.
    fn alone<const K: usize, T: Intensity>(
        &self,
        fitter: &mut CornerFitter,
        image: &Gray<T>,
        position: [f64; 2],
    ) -> Option<ModelFit> {
        let reach = distance_to_rim(image, position);
        let window = self.windows.iter().rev().find(|w| w.radius() as f64 <= reach)?;
        let first = start::<K, T>(image, position, window.radius())?;
        Some(fitter.fit(image, window, &first)?.into())
    }

    /// The model of a corner of a grid, in all of its room that is clear and lies in the image, with
    /// the bends that the grid shows; from a fit `before`, where there is one.
    pub(super) fn model<T: Intensity>(
        &self,
        fitter: &mut CornerFitter,
        image: &Gray<T>,
        position: [f64; 2],
        room: Room,
        before: Option<&ModelFit>,
    ) -> Option<ModelFit> {
        match self.polynomial {
            Polynomial::Cubic(_) => self.model_of::<3, T>(fitter, image, position, room, before),
            Polynomial::Quadric(_) => self.model_of::<2, T>(fitter, image, position, room, before),
        }
    }

    fn model_of<const K: usize, T: Intensity>(
        &self,
        fitter: &mut CornerFitter,
        image: &Gray<T>,
        position: [f64; 2],
        room: Room,
        before: Option<&ModelFit>,
    ) -> Option<ModelFit> {
        let radius = room.reach_px.min(self.largest_radius());
        let is_whole = radius <= room.clear_square_px().min(distance_to_rim(image, position));
        let whole = self.windows.iter().find(|w| w.radius() as f64 == radius && is_whole);
        let cut;
        let window = match whole {
            Some(window) => window,
            None => {
                cut = room.window(image, position, radius as usize);
                &cut
            }
        };
        let edges: &[Edge; K] = room.around.edges.as_slice().try_into().ok()?;
        let bends = edges.map(|edge| edge.bend);
        let angles = edges.map(|edge| edge.angle_rad);
        let first = match before {
            _ if window.count() < MIN_PIXELS => return None,
            Some(fit) => fit.corner.with_edges(),
            None => start_along(image, position, window, angles, room.blur_px)?,
        };
        Some(fitter.fit(image, window, &Corner { bends, ..first })?.into())
    }

    pub(super) fn method(&self) -> Refinement {
        self.method
    }

    /// Radius of the largest window of the model, px.
    pub(super) fn largest_radius(&self) -> f64 {
        self.windows.last().map_or(0.0, |window| window.radius() as f64)
    }
}

/// Pixels between a position and the nearest side of the image, where bilinear samples end.
fn distance_to_rim<T: Intensity>(image: &Gray<T>, [x, y]: [f64; 2]) -> f64 {
    let [right, bottom] = [image.width(), image.height()].map(|side| side as f64 - 2.0);
    [x - 1.0, y - 1.0, right - x, bottom - y].into_iter().fold(f64::INFINITY, f64::min)
}
