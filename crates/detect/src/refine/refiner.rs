//! The last word on a corner's position, from the raw pixels.
//!
//! The paper's polynomial walks to the corner; the model ([`super::model`]) starts there
//! and adds a covariance. Where the model does not hold, the polynomial's result stays.
//!
//! ```
//! use deltille_detect::{Refinement, Refiner};
//! use deltille_layout::synth::SimulatedCorner;
//! use deltille_core::lattice::GridKind;
//! use glam::DVec2;
//!
//! let place = DVec2::new(20.2, 19.9);
//! let image = SimulatedCorner::seen_from(2, 0.3, 0.5, place, 1.0).render(41, 41);
//! let refiner = Refiner::new(GridKind::Checker, Refinement::Model, 21);
//! let refined = refiner.refine(&image, DVec2::new(21.0, 20.0));
//! assert!(refined.position.abs_diff_eq(place, 1e-3) && refined.cov.is_some());
//! ```

use std::borrow::Cow;

use glam::DVec2;

use super::clearance::{Edge, NOTHING, Surroundings};
use super::corner_start::{start, start_along};
use super::joint_fit::Sample;
use super::model::corner::Corner;
use super::model::fitter::{Accuracy, CornerFitter, Fitted};
use super::model::window::{MAX_RADIUS, Patch, Window};
use super::optics::Optics;
use super::shared_optics::SAMPLES;
use crate::corners::polynomial::Polynomial;
use deltille_core::detection::Tone;
use deltille_core::lattice::GridKind;
use deltille_core::raster::ImageView;

/// Smallest radius in which the model is fitted: 49 pixels for ten unknowns.
pub(crate) const MIN_MODEL_RADIUS: usize = 3;

/// Fewest pixels to which the model is fitted: three for each unknown, so that the noise shows.
pub(crate) const MIN_PIXELS: usize = 30;

/// Half the side of the square around a corner that must be clear for the polynomial, px: a third of
/// what its usual window reads, where nearly all of its weight lies.
const MIN_POLYNOMIAL_CLEAR_PX: f64 = 2.0;

/// Smallest side of a window, px: what the smallest polynomial reads, 4r + 1 with r = 2.
const MIN_WINDOW_PX: usize = 9;

/// Largest side of a window, px.
pub const MAX_WINDOW_PX: usize = 2 * MAX_RADIUS + 1;

/// How positions are refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Refinement {
    /// The umbilic point of a fitted cubic surface, as in the paper, or the saddle of a quadric.
    Polynomial,
    /// A blurred corner fitted to the pixels, from the polynomial's result.
    #[default]
    Model,
}

/// Which method gave a refined position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefineStatus {
    /// The method that was asked for.
    Ok,
    /// The model does not hold here; the position is the polynomial's.
    Polynomial,
    /// None, as there is no corner: the position is the start.
    Failed,
}

/// A refined position.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Refined {
    /// Position, px; pixel centres at integers.
    pub position: DVec2,
    /// Covariance xx, xy, yy of the position, px²; `None` where the method gives none.
    pub cov: Option<[f64; 3]>,
    /// Which method found it.
    pub status: RefineStatus,
}

/// What the model found, of either kind of corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ModelFit {
    /// The corner; of two edges the last angle means nothing.
    pub corner: Corner<3>,
    /// Covariance xx, xy, yy of its position, px².
    pub cov: [f64; 3],
    /// Standard deviation of what is left, over half the contrast.
    pub residual: f64,
    /// Mean squared difference of neighbouring residuals over that of white noise.
    pub whiteness: f64,
}

impl ModelFit {
    /// Position, px.
    pub(crate) fn position(&self) -> DVec2 {
        self.corner.position
    }

    /// Standard deviation of what is left, of full scale.
    pub(crate) fn noise(&self) -> f64 {
        self.residual * self.corner.amplitude.abs()
    }

    /// Standard deviation of the blur with the pixel's box in it, px.
    pub(crate) fn blur_px(&self) -> f64 {
        self.corner.blur_px
    }
}

impl<const K: usize> From<Fitted<K>> for ModelFit {
    fn from(Fitted { corner, cov, noise, whiteness }: Fitted<K>) -> Self {
        let residual = noise / corner.amplitude.abs();
        Self { corner: corner.with_edges(), cov, residual, whiteness }
    }
}

impl From<ModelFit> for Refined {
    fn from(fit: ModelFit) -> Self {
        Self { position: fit.position(), cov: Some(fit.cov), status: RefineStatus::Ok }
    }
}

/// How a picture shows the corners of a grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sharpness<'a> {
    /// Standard deviation of the blur, px.
    pub blur_px: f64,
    /// What all corners of the picture share.
    pub optics: &'a Optics,
}

/// What is known of the surroundings of a corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room<'a> {
    /// What lies there.
    pub around: &'a Surroundings,
    /// Deviation of the blur, px.
    pub blur_px: f64,
    /// Nothing beyond this in either coordinate is looked at, px.
    pub reach_px: f64,
    /// What is common to all corners of the picture.
    pub optics: &'a Optics,
}

impl Room<'_> {
    /// The pixels of the image that show nothing but the corner at `position`, within a radius.
    fn window(&self, image: ImageView, position: DVec2, radius: usize) -> Window {
        let [right, bottom] = [image.width(), image.height()].map(|side| side as f64 - 1.0);
        let pixel = position.round();
        let off = pixel - position;
        let span = |v: f64| {
            if !(0.0..=bottom).contains(&(pixel.y + v)) {
                return NOTHING;
            }
            let [first, last] = self.around.span(v + off.y, self.blur_px);
            [(first - off.x).max(-pixel.x), (last - off.x).min(right - pixel.x)]
        };
        let is_off_tags = self.around.off_tags(self.blur_px);
        Window::within(radius, span, |place| is_off_tags(place + off))
    }

    /// Half the side of the largest square that shows nothing else, px.
    pub(crate) fn clear_square_px(&self) -> f64 {
        self.around.clear_square_px(self.blur_px).min(self.reach_px)
    }
}

/// What the model found, and the pixels that it was fitted to.
type Fit = (Patch, ModelFit);

/// Refines corners of one kind.
#[derive(Clone, Debug)]
pub struct Refiner {
    polynomial: Polynomial,
    iterations: usize,
    method: Refinement,
    /// Windows of the model by radius, from [`MIN_MODEL_RADIUS`].
    windows: Vec<Window>,
    tone: Tone,
    /// What is known before any picture is seen.
    pub(crate) known: Optics,
}

impl Refiner {
    /// A refiner that reads at most `window_px` × `window_px` pixels, an odd number from 9 to
    /// [`MAX_WINDOW_PX`]; the polynomial reads 4r + 1 pixels for a whole r, the largest that fits.
    pub fn new(kind: GridKind, method: Refinement, window_px: usize) -> Self {
        let window_px = window_px.clamp(MIN_WINDOW_PX, MAX_WINDOW_PX);
        Self::with_radii(kind, method, (window_px - 1) / 4, (window_px - 1) / 2)
    }

    /// A refiner with a polynomial of radius r and a model of at most `model_radius`.
    pub(crate) fn with_radii(
        kind: GridKind,
        method: Refinement,
        polynomial_radius: usize,
        model_radius: usize,
    ) -> Self {
        let polynomial = Polynomial::new(kind, polynomial_radius);
        let iterations = polynomial.usual_iterations();
        let windows = (MIN_MODEL_RADIUS..=model_radius.min(MAX_RADIUS)).map(Window::new).collect();
        Self {
            polynomial,
            iterations,
            method,
            windows,
            tone: Tone::Linear,
            known: Optics::default(),
        }
    }

    /// The same refiner with another number of iterations of the polynomial.
    pub fn with_iterations(self, iterations: usize) -> Self {
        Self { iterations, ..self }
    }

    /// The same refiner for a camera with this tone curve; without it grey values are linear in light.
    pub fn with_tone(self, tone: Tone) -> Self {
        Self { tone, known: Optics::of(tone), ..self }
    }

    /// The same refiner for a print whose ink has spread so far, in edges of a tile; `None` where it is not known.
    pub fn with_ink(self, ink: Option<f64>) -> Self {
        Self { known: self.known.with_ink(ink), ..self }
    }

    /// The corner near `start`, in the whole window.
    ///
    /// An unknown tone curve is estimated from this corner; [`Self::refine_all`] asks all of a picture.
    pub fn refine<'a>(&self, image: impl Into<ImageView<'a>>, start: DVec2) -> Refined {
        self.refine_all(image, &[start])[0]
    }

    /// The corners of a picture near `starts`, each in the whole window.
    pub fn refine_all<'a>(
        &self,
        image: impl Into<ImageView<'a>>,
        starts: &[DVec2],
    ) -> Vec<Refined> {
        self.refine_view(image.into(), starts)
    }

    /// [`Self::refine_all`], compiled here and not in every crate that uses it.
    fn refine_view(&self, image: ImageView, starts: &[DVec2]) -> Vec<Refined> {
        let mut fitter = CornerFitter::default();
        let mut fit = |start: &DVec2| self.refine_with(&mut fitter, image, *start, &self.known);
        let first: Vec<(Refined, Option<Fit>)> = starts.iter().map(&mut fit).collect();
        if self.method == Refinement::Polynomial || self.tone == Tone::Linear {
            return first.into_iter().map(|(refined, _)| refined).collect();
        }
        let samples = first.iter().filter_map(|(_, fit)| fit.clone());
        let every = first.len().div_ceil(SAMPLES).max(1);
        let samples: Vec<Sample> = samples
            .step_by(every)
            .map(|(patch, fit)| Sample { patch, corner: fit.corner, residual: fit.residual })
            .collect();
        let optics = self.joint_optics(&mut fitter, image, samples, &self.known);
        let again = |(i, (refined, fit)): (usize, (Refined, Option<_>))| match fit {
            Some(_) => self.refine_with(&mut fitter, image, starts[i], &optics).0,
            None => refined,
        };
        first.into_iter().enumerate().map(again).collect()
    }

    /// The optics of a picture that these corners show, of which so much is known.
    pub(crate) fn joint_optics(
        &self,
        fitter: &mut CornerFitter,
        image: ImageView,
        samples: Vec<Sample>,
        known: &Optics,
    ) -> Optics {
        match self.polynomial {
            Polynomial::Cubic(_) => Optics::estimate::<3>(fitter, image, samples, known),
            Polynomial::Quadric(_) => Optics::estimate::<2>(fitter, image, samples, known),
        }
    }

    fn refine_with(
        &self,
        fitter: &mut CornerFitter,
        image: ImageView,
        start: DVec2,
        optics: &Optics,
    ) -> (Refined, Option<Fit>) {
        let found = self.polynomial.refine(image, start, self.iterations).map(|c| c.position);
        let position = found.unwrap_or(start);
        let model = || match self.polynomial {
            Polynomial::Cubic(_) => self.alone::<3>(fitter, image, position, optics),
            Polynomial::Quadric(_) => self.alone::<2>(fitter, image, position, optics),
        };
        match (self.method == Refinement::Model).then(model).flatten() {
            Some((window, fit)) => {
                let patch = Patch { window: window.clone(), centre: position.round() };
                (fit.into(), Some((patch, fit)))
            }
            None => (self.without_model(start, found), None),
        }
    }

    /// A corner of a grid near `start`, from pixels that show nothing else. Beside it what the model
    /// found.
    pub(crate) fn refine_within(
        &self,
        fitter: &mut CornerFitter,
        image: ImageView,
        start: DVec2,
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

    fn without_model(&self, start: DVec2, polynomial: Option<DVec2>) -> Refined {
        let status = match (polynomial, self.method) {
            (None, _) => RefineStatus::Failed,
            (Some(_), Refinement::Polynomial) => RefineStatus::Ok,
            (Some(_), Refinement::Model) => RefineStatus::Polynomial,
        };
        Refined { position: polynomial.unwrap_or(start), cov: None, status }
    }

    /// The model of a single corner, in the largest window that lies in the image.
    fn alone<const K: usize>(
        &self,
        fitter: &mut CornerFitter,
        image: ImageView,
        position: DVec2,
        optics: &Optics,
    ) -> Option<(&Window, ModelFit)> {
        let reach = distance_to_rim(image, position);
        let window = self.windows.iter().rev().find(|w| w.radius() as f64 <= reach)?;
        let first = start::<K>(image, position, window.radius())?;
        Some((window, fitter.fit(image, window, &first, optics, Accuracy::Full)?.into()))
    }

    /// The model of a corner of a grid, in all of its room that is clear and lies in the image, with
    /// the bends that the grid shows: as good as the noise allows from a fit `before`, and such a fit without.
    pub(crate) fn model(
        &self,
        fitter: &mut CornerFitter,
        image: ImageView,
        position: DVec2,
        room: Room,
        before: Option<&ModelFit>,
    ) -> Option<ModelFit> {
        match self.polynomial {
            Polynomial::Cubic(_) => self.model_of::<3>(fitter, image, position, room, before),
            Polynomial::Quadric(_) => self.model_of::<2>(fitter, image, position, room, before),
        }
    }

    fn model_of<const K: usize>(
        &self,
        fitter: &mut CornerFitter,
        image: ImageView,
        position: DVec2,
        room: Room,
        before: Option<&ModelFit>,
    ) -> Option<ModelFit> {
        let window = self.window(image, position, room);
        let window = &*window;
        let edges: &[Edge; K] = room.around.edges.as_slice().try_into().ok()?;
        let angles = edges.map(|edge| edge.angle_rad);
        let (first, accuracy) = match before {
            _ if window.count() < MIN_PIXELS => return None,
            Some(fit) => (fit.corner.with_edges(), Accuracy::Full),
            None => {
                let pixels = fitter.pixels(image, window, position)?;
                (start_along(window, pixels, position, angles, room.blur_px)?, Accuracy::Rough)
            }
        };
        let edges = first.angles.map(|angle_rad| edge_along(edges, angle_rad));
        let bends = edges.map(|edge| edge.bend);
        let across_px = edges.map(|edge| edge.across_px);
        let first = Corner { bends, across_px, ..first };
        // What a picture has in common may not be common to its rim.
        let fit = fitter
            .fit(image, window, &first, room.optics, accuracy)
            .or_else(|| fitter.fit(image, window, &first, &self.known, accuracy))?;
        Some(fit.into())
    }

    /// The pixels of a corner's room.
    pub(crate) fn window(&self, image: ImageView, position: DVec2, room: Room) -> Cow<'_, Window> {
        let radius = room.reach_px.min(self.largest_radius());
        let is_whole = radius <= room.clear_square_px().min(distance_to_rim(image, position));
        let whole = self.windows.iter().find(|w| w.radius() as f64 == radius && is_whole);
        match whole {
            Some(window) => Cow::Borrowed(window),
            None => Cow::Owned(room.window(image, position, radius as usize)),
        }
    }

    pub(crate) fn method(&self) -> Refinement {
        self.method
    }

    /// Radius of the largest window of the model, px.
    pub(crate) fn largest_radius(&self) -> f64 {
        self.windows.last().map_or(0.0, |window| window.radius() as f64)
    }
}

/// The edge nearest to a direction, turned by half where it points the other way: edges near a half-turn may have
/// become the first since the fit.
fn edge_along(edges: &[Edge], angle_rad: f64) -> Edge {
    let off = |edge: &Edge| (edge.angle_rad - angle_rad).sin().abs();
    let nearest = edges.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b)));
    let edge = nearest.unwrap_or(Edge { angle_rad, bend: 0.0, across_px: 0.0 });
    let is_opposite = (edge.angle_rad - angle_rad).cos() < 0.0;
    Edge { bend: if is_opposite { -edge.bend } else { edge.bend }, ..edge }
}

/// Pixels between a position and the nearest side of the image, where bilinear samples end.
fn distance_to_rim(image: ImageView, DVec2 { x, y }: DVec2) -> f64 {
    let [right, bottom] = [image.width(), image.height()].map(|side| side as f64 - 2.0);
    [x - 1.0, y - 1.0, right - x, bottom - y].into_iter().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;
    use deltille_core::raster::Gray;
    use deltille_layout::synth::SimulatedCorner;

    /// Side of the square in which each corner of a picture lies, px.
    const SIDE: usize = 41;

    /// A picture of 5 × 5 corners seen from 45°, their light falling to a third, and their places.
    fn picture(lines: usize, grey: impl Fn(f64) -> f64, noise: f64) -> (Gray<f32>, Vec<DVec2>) {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let normal = Normal::new(0.0, noise).unwrap();
        let mut image = Gray::<f32>::new(5 * SIDE, 5 * SIDE);
        let mut places = Vec::new();
        for tile in 0..25 {
            let (left, top) = (tile % 5 * SIDE, tile / 5 * SIDE);
            let mut at = || (SIDE / 2) as f64 + rng.random_range(-0.5..0.5);
            let position = DVec2::new(at(), at());
            let axis = rng.random_range(0.0..std::f64::consts::TAU);
            let light = 1.0 - (tile % 5) as f64 / 6.0;
            let corner = SimulatedCorner {
                amplitude: 0.35 * light,
                level: 0.42 * light,
                ..SimulatedCorner::seen_from(lines, axis, 0.8, position, 1.0)
            };
            let shown = corner.render(SIDE, SIDE);
            for (y, x) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (y, x))) {
                let value = grey(f64::from(shown.at(x, y))) + normal.sample(&mut rng);
                image.pixels_mut()[(top + y) * 5 * SIDE + left + x] = value as f32;
            }
            places.push(DVec2::new(left as f64, top as f64) + position);
        }
        (image, places)
    }

    /// Rms of the errors per coordinate, px, and of what the covariances make of them.
    fn errors(refined: &[Refined], places: &[DVec2]) -> (f64, f64) {
        let (mut square, mut normalised) = (0.0, 0.0);
        for (refined, place) in refined.iter().zip(places) {
            let DVec2 { x: dx, y: dy } = refined.position - place;
            let [xx, xy, yy] = refined.cov.unwrap();
            square += dx * dx + dy * dy;
            normalised += (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
        }
        let count = 2.0 * places.len() as f64;
        ((square / count).sqrt(), normalised / count)
    }

    #[test]
    fn corners_of_a_picture_tell_its_tone_curve() {
        let smooth = |y: f64| y * y * (3.0 - 2.0 * y);
        let srgb = |y: f64| Tone::Srgb.grey(y);
        let curves: [(&str, &dyn Fn(f64) -> f64); 3] =
            [("line", &|y| y), ("sRGB", &srgb), ("smooth step", &smooth)];
        for (kind, lines) in [(GridKind::Deltille, 3), (GridKind::Checker, 2)] {
            for (name, curve) in curves {
                let (image, places) = picture(lines, curve, 0.005);
                let starts: Vec<DVec2> = places.iter().map(|place| place.round()).collect();
                let refiner = Refiner::new(kind, Refinement::Model, 21).with_tone(Tone::Auto);
                let (rms, normalised) = errors(&refiner.refine_all(&image, &starts), &places);
                assert!(rms < 0.015, "{lines} edges, {name}: {rms}");
                // 50 degrees of freedom: 0.2 standard deviation.
                assert!((0.4..1.8).contains(&normalised), "{lines} edges, {name}: {normalised}");
            }
        }
    }

    /// What is brighter than white is white: an edge that is fitted to it seems to move.
    #[test]
    fn clipped_pixels_do_not_move_corners() {
        let (image, places) = picture(3, |y| (2.0 * y).min(1.0), 0.0);
        let refiner = Refiner::new(GridKind::Deltille, Refinement::Model, 21);
        let refined: Vec<Refined> =
            places.iter().map(|p| refiner.refine(&image, p.map(f64::round))).collect();
        let (rms, _) = errors(&refined, &places);
        assert!(rms < 0.01, "{rms}");
    }
}
