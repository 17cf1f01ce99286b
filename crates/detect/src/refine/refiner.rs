//! Final refinement of a corner's position, from the raw pixels.
//!
//! The polynomial of the paper converges to the corner. The model ([`super::model`]) starts there and adds a
//! covariance. If the model does not fit, the result of the polynomial is kept.
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

use super::clearance::{Edge, Margin, NOTHING, Surroundings};
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

/// Minimum radius of the window of the model, px: 49 pixels for ten unknowns.
pub(crate) const MIN_MODEL_RADIUS: usize = 3;

/// Number of pixels of that window.
pub(crate) const USUAL_MIN_PIXELS: usize = (2 * MIN_MODEL_RADIUS + 1).pow(2);

/// Minimum number of pixels for the model: three for each unknown, so that the noise is measurable.
pub(crate) const MIN_PIXELS: usize = 30;

/// Minimum half side of the clear square around a corner for the polynomial, px. It is a third of its usual window,
/// where nearly all of its weight lies.
const MIN_POLYNOMIAL_CLEAR_PX: f64 = 2.0;

/// Smallest side of a window, px: 4r + 1 pixels of the smallest polynomial, with r = 2.
const MIN_WINDOW_PX: usize = 9;

/// Largest side of a window, px.
pub const MAX_WINDOW_PX: usize = 2 * MAX_RADIUS + 1;

/// Method that refines positions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Refinement {
    /// The umbilic point of a fitted cubic surface, as in the paper, or the saddle point of a quadric.
    Polynomial,
    /// A blurred corner model fitted to the pixels, starting from the polynomial's result.
    #[default]
    Model,
}

/// Method that gave a refined position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefineStatus {
    /// The requested method.
    Ok,
    /// The polynomial, because the model does not fit here.
    Polynomial,
    /// None, because there is no corner: the position is the start position.
    Failed,
}

/// A refined position.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Refined {
    /// Position, px; pixel centres at integers.
    pub position: DVec2,
    /// Covariance xx, xy, yy of the position, px²; `None` if the method gives none.
    pub cov: Option<[f64; 3]>,
    /// Method that gave the position.
    pub status: RefineStatus,
}

/// Result of the model, for either kind of corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ModelFit {
    /// The corner; with two edges, the last angle has no meaning.
    pub corner: Corner<3>,
    /// Covariance xx, xy, yy of its position, px².
    pub cov: [f64; 3],
    /// Standard deviation of the residuals, relative to half the contrast.
    pub residual: f64,
    /// Mean squared difference of neighbouring residuals, relative to white noise.
    pub whiteness: f64,
}

impl ModelFit {
    /// Returns the position, px.
    pub(crate) fn position(&self) -> DVec2 {
        self.corner.position
    }

    /// Returns the standard deviation of the residuals, as a fraction of full scale.
    pub(crate) fn noise(&self) -> f64 {
        self.residual * self.corner.amplitude.abs()
    }

    /// Returns the standard deviation of the blur including the pixel's box, px.
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

/// Sharpness of the corners of a grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sharpness<'a> {
    /// Standard deviation of the blur, px.
    pub blur_px: f64,
    /// Parameters that all corners of the image share.
    pub optics: &'a Optics,
}

impl Sharpness<'_> {
    /// Returns the margin of a corner from other edges. Without motion, the blur is nearly the same in all directions.
    pub(crate) fn margin(&self) -> Margin {
        let margin = Margin::of(self.blur_px);
        match self.optics.is_motion {
            true => margin.with_astigmatism(self.optics.astigmatism),
            false => margin,
        }
    }
}

/// Clear area around a corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room<'a> {
    /// Surroundings of the corner.
    pub around: &'a Surroundings,
    /// Standard deviation of the blur, px.
    pub blur_px: f64,
    /// Maximum distance of the pixels used, in either coordinate, px.
    pub reach_px: f64,
    /// Parameters that all corners of the image share.
    pub optics: &'a Optics,
}

impl Room<'_> {
    /// Returns the pixels of the image that show only the corner at `position`, within a radius.
    fn window(&self, image: ImageView, position: DVec2, radius: usize) -> Window {
        let [right, bottom] = [image.width(), image.height()].map(|side| side as f64 - 1.0);
        let pixel = position.round();
        let off = pixel - position;
        let margin = self.margin();
        let span = |v: f64| {
            if !(0.0..=bottom).contains(&(pixel.y + v)) {
                return NOTHING;
            }
            let [first, last] = self.around.span(v + off.y, margin);
            [(first - off.x).max(-pixel.x), (last - off.x).min(right - pixel.x)]
        };
        let within = |with_borders: bool| {
            let is_off_tags = self.around.off_tags(margin, with_borders);
            Window::within(radius, span, |place| is_off_tags(place + off))
        };
        let (window, borders) = (within(false), &self.around.borders);
        let least_beside = USUAL_MIN_PIXELS / 4;
        let is_beside_enough =
            |border| window.count_beside(border, position - pixel) >= least_beside;
        if borders.is_empty()
            || window.count() >= USUAL_MIN_PIXELS && borders.iter().all(is_beside_enough)
        {
            return window;
        }
        // The print may differ from the target, so borders of tags are only read if too little is visible without them.
        within(true).with_borders(borders)
    }

    /// Returns half the side of the largest clear square, px.
    pub(crate) fn clear_square_px(&self) -> f64 {
        self.around.clear_square_px(self.margin()).min(self.reach_px)
    }

    fn margin(&self) -> Margin {
        Sharpness { blur_px: self.blur_px, optics: self.optics }.margin()
    }
}

/// The result of the model, and the fitted pixels.
type Fit = (Patch, ModelFit);

/// Refines corners of one tiling.
#[derive(Clone, Debug)]
pub struct Refiner {
    polynomial: Polynomial,
    iterations: usize,
    method: Refinement,
    /// Windows of the model by radius, from [`MIN_MODEL_RADIUS`].
    windows: Vec<Window>,
    tone: Tone,
    /// Optics known before any image.
    pub(crate) known: Optics,
    /// Optics with a usual tone curve, for first fits under an unknown one.
    toned: Option<Optics>,
}

impl Refiner {
    /// Creates a refiner that reads at most `window_px` × `window_px` pixels, an odd number from 9 to
    /// [`MAX_WINDOW_PX`]. The polynomial reads 4r + 1 pixels, with the largest integer r that fits.
    pub fn new(kind: GridKind, method: Refinement, window_px: usize) -> Self {
        let window_px = window_px.clamp(MIN_WINDOW_PX, MAX_WINDOW_PX);
        Self::with_radii(kind, method, (window_px - 1) / 4, (window_px - 1) / 2)
    }

    /// Creates a refiner with a polynomial of radius r and a model of at most `model_radius`.
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
            toned: None,
        }
    }

    /// Sets the number of iterations of the polynomial.
    pub fn with_iterations(self, iterations: usize) -> Self {
        Self { iterations, ..self }
    }

    /// Sets the tone curve of the camera; by default, grey values are linear in light.
    pub fn with_tone(self, tone: Tone) -> Self {
        let toned = (tone == Tone::Auto).then(|| Optics::of(Tone::Srgb));
        Self { tone, known: Optics::of(tone), toned, ..self }
    }

    /// Sets the ink spread of the print, in edges of a tile; `None` if it is unknown.
    pub fn with_ink(self, ink: Option<f64>) -> Self {
        Self { known: self.known.with_ink(ink), ..self }
    }

    /// Returns this refiner for an image in which an unknown ink spread is near this value, in edges of a tile.
    pub(crate) fn with_ink_near(&self, ink: f64) -> Self {
        let near = |optics: &Optics| optics.clone().with_ink_near(ink);
        Self { known: near(&self.known), toned: self.toned.as_ref().map(near), ..self.clone() }
    }

    /// Returns this refiner for an image with motion whose astigmatism is near this value.
    pub(crate) fn with_motion_near(&self, astigmatism: [f64; 2]) -> Self {
        let known = self.known.with_motion_near(astigmatism);
        Self { known, ..self.clone() }
    }

    /// Returns whether the ink spread is unknown.
    pub(crate) fn is_ink_open(&self) -> bool {
        self.known.is_ink_open()
    }

    /// Returns the position of a corner near `start` to within a tenth of a pixel, by the polynomial.
    pub(crate) fn found(&self, image: ImageView, start: DVec2) -> Option<DVec2> {
        self.polynomial.find(image, start).map(|found| found.position)
    }

    /// Refines the corner near `start`, in the whole window.
    ///
    /// An unknown tone curve is estimated from this corner; [`Self::refine_all`] uses all corners of an image.
    pub fn refine<'a>(&self, image: impl Into<ImageView<'a>>, start: DVec2) -> Refined {
        self.refine_all(image, &[start])[0]
    }

    /// Refines the corners of an image near `starts`, each in the whole window.
    pub fn refine_all<'a>(
        &self,
        image: impl Into<ImageView<'a>>,
        starts: &[DVec2],
    ) -> Vec<Refined> {
        self.refine_view(image.into(), starts)
    }

    /// Implements [`Self::refine_all`] without generics, so that it is compiled only in this crate.
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

    /// Returns the optics of an image from these corners, given the known ones.
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

    /// Refines a corner of a grid near `start`, from pixels that show only this corner. Also returns the result of the
    /// model.
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
        // Other edges this near would pull the polynomial away from a start that the finder has
        // already checked.
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

    /// Fits the model to a single corner, in the largest window that lies in the image.
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

    /// Fits the model to a corner of a grid, in all of its clear area in the image, with the edge
    /// curvatures of the grid. The accuracy of the fit is limited by the noise if it starts from a
    /// fit `before`; otherwise it is a rough fit.
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
        let mut is_clipped = false;
        let (first, accuracy) = match before {
            _ if window.count() < MIN_PIXELS => return None,
            Some(fit) => (fit.corner.with_edges(), Accuracy::Full),
            None => {
                let pixels = fitter.pixels(image, window, position)?;
                let off = window.off_borders(pixels, position - position.round());
                let (places, pixels) = match &off {
                    Some([us, vs, pixels]) => ([&us[..], &vs[..]], &pixels[..]),
                    None => (window.places(), pixels),
                };
                let first = start_along(places, pixels, position, angles, room.blur_px)?;
                is_clipped = fitter.is_white_clipped();
                (first, Accuracy::Rough)
            }
        };
        let edges = first.angles.map(|angle_rad| edge_along(edges, angle_rad));
        let bends = edges.map(|edge| edge.bend);
        let across_px = edges.map(|edge| edge.across_px);
        let first = Corner { bends, across_px, ..first };
        // The shared optics may not apply near the border of an image. If no tone curve is known, a strong one may move
        // edges that are almost parallel far from their positions.
        let are_shared = *room.optics != self.known;
        let known = are_shared.then_some(&self.known);
        let is_first = before.is_none() && !are_shared && !is_clipped;
        let toned = self.toned.as_ref().filter(|_| is_first);
        let mut tried = [Some(room.optics), known, toned].into_iter().flatten();
        let fit = tried.find_map(|optics| fitter.fit(image, window, &first, optics, accuracy))?;
        Some(fit.into())
    }

    /// Returns the pixels of a corner's clear area.
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

    /// Returns the radius of the largest window of the model, px.
    pub(crate) fn largest_radius(&self) -> f64 {
        self.windows.last().map_or(0.0, |window| window.radius() as f64)
    }
}

/// Returns the edge nearest to a direction, rotated by 180° if it points the other way. Since the
/// fit, edges near 180° may have become the first ones.
fn edge_along(edges: &[Edge], angle_rad: f64) -> Edge {
    let off = |edge: &Edge| (edge.angle_rad - angle_rad).sin().abs();
    let nearest = edges.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b)));
    let edge = nearest.unwrap_or(Edge { angle_rad, bend: 0.0, across_px: 0.0 });
    let is_opposite = (edge.angle_rad - angle_rad).cos() < 0.0;
    Edge { bend: if is_opposite { -edge.bend } else { edge.bend }, ..edge }
}

/// Returns the number of pixels between a position and the nearest side of the image, where bilinear samples end.
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

    /// Side of the square of each corner in an image, px.
    const SIDE: usize = 41;

    /// Renders an image of 5 × 5 corners seen from 45°, with illumination that falls to a third.
    /// Also returns their positions.
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

    /// Returns the RMS of the errors per coordinate, px, and normalised by the covariances.
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
    fn corners_of_an_image_determine_its_tone_curve() {
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
                // 50 degrees of freedom: a standard deviation of 0.2.
                assert!((0.4..1.8).contains(&normalised), "{lines} edges, {name}: {normalised}");
            }
        }
    }

    /// Pixels brighter than white are clipped to white, which seems to move an edge that is fitted to them.
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
