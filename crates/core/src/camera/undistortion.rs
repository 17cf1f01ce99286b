//! A pinhole view of what a camera sees, and where its pixels lie in the camera's picture.

use glam::{DQuat, DVec2, DVec3};
use rayon::prelude::*;

use super::Camera;

/// The widest pinhole view that is chosen without being asked for: half of it is 75°, where a pixel
/// covers a fifteenth of the angle that one in the middle does.
const WIDEST_RAD: f64 = 150.0 / 180.0 * std::f64::consts::PI;

/// No pinhole sees more than half the world, and hardly anything at its border.
const MOST_RAD: f64 = 179.0 / 180.0 * std::f64::consts::PI;

/// Halvings of the ratio of two focal lengths.
const HALVINGS: usize = 60;

/// Pixels along each side of a picture that are looked at.
const ALONG: usize = 128;

/// The view of the camera that is narrower by this factor than its widest is hardly more than a pixel.
const NARROWEST: f64 = 1e3;

/// Part of the radius at which a lens turns back up to which it is taken: the angle grows with the root of what is left.
const STEADY_PART: f64 = 1.0 - 1e-6;

/// How much a pinhole view shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Field {
    /// As much as leaves no pixel without a place in the camera's picture.
    Inside,
    /// All that the camera's picture shows.
    Whole,
    /// What a focal length makes of it, px.
    Focal(f64),
    /// A horizontal field of view, rad.
    Horizontal(f64),
}

/// Why there is no such view. Messages say what to do about it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UndistortionError {
    /// A field of view that no pinhole has.
    #[error("a pinhole sees less than 180°, and {degrees:.1}° are asked for: ask for less")]
    TooWide {
        /// What was asked for.
        degrees: f64,
    },
    /// The camera sees nothing where the view looks.
    #[error("the camera sees nothing along the axis of the view")]
    Nothing,
}

/// A pinhole view of what a camera sees, of square pixels, with the principal point in the middle.
///
/// ```
/// use deltille_core::camera::{BrownConrady, Camera, Field, Lens, Undistortion};
/// use glam::DVec2;
///
/// let lens = BrownConrady { radial: [-0.2, 0.05, 0.0], ..BrownConrady::default() };
/// let camera = Camera::centred(1280, 960, 900.0, Lens::BrownConrady(lens));
/// let view = Undistortion::new(&camera, [1280, 960], Field::Inside)?;
/// let corner = view.place(DVec2::ZERO).unwrap();
/// assert!(camera.sees(corner, 0.0));
/// # Ok::<(), deltille_core::camera::UndistortionError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Undistortion {
    /// The camera.
    camera: Camera,
    /// The pinhole.
    view: Camera,
    /// From the frame of the camera to that of the view.
    view_from_camera: DQuat,
    /// How far points are, mm; matters for lenses that are not central.
    distance_mm: f64,
    /// Rays farther from the axis, rad, are beyond where the lens turns back.
    steady_rad: f64,
}

impl Undistortion {
    /// A view of a width and height, px, that looks where the camera does.
    ///
    /// # Errors
    /// Where no pinhole shows that.
    pub fn new(
        camera: &Camera,
        size_px: [u32; 2],
        field: Field,
    ) -> Result<Self, UndistortionError> {
        Self::turned(camera, DQuat::IDENTITY, size_px, field)
    }

    /// A view that looks elsewhere: `view_from_camera` takes directions of the camera frame to its own.
    ///
    /// # Errors
    /// Where no pinhole shows that.
    pub fn turned(
        camera: &Camera,
        view_from_camera: DQuat,
        [width, height]: [u32; 2],
        field: Field,
    ) -> Result<Self, UndistortionError> {
        let view = Camera::pinhole(width, height, WIDEST_RAD);
        let steady_rad = steady_rad(camera);
        let camera = camera.clone();
        // Far beyond any pupil.
        let distance_mm = 1e9;
        let widest = Self { camera, view, view_from_camera, distance_mm, steady_rad };
        let half = f64::from(width) / 2.0;
        let focal = match field {
            Field::Focal(focal) => focal,
            Field::Horizontal(rad) if rad < MOST_RAD => half / (rad / 2.0).tan(),
            Field::Horizontal(rad) => {
                return Err(UndistortionError::TooWide { degrees: rad.to_degrees() });
            }
            Field::Inside => widest.focal_inside()?,
            Field::Whole => widest.focal_whole()?,
        };
        Ok(widest.with_focal(focal))
    }

    /// The same of points at a distance, mm, from the camera, of which only lenses that are not central see another
    /// picture than of points far away.
    #[must_use]
    pub fn at_distance(self, distance_mm: f64) -> Self {
        Self { distance_mm, ..self }
    }

    /// The same with another focal length, px.
    #[must_use]
    pub fn with_focal(self, focal_px: f64) -> Self {
        let view = Camera { focal_px: DVec2::splat(focal_px), ..self.view };
        Self { view, ..self }
    }

    /// The pinhole camera of the view.
    pub fn view(&self) -> &Camera {
        &self.view
    }

    /// From the frame of the camera to that of the view.
    pub fn view_from_camera(&self) -> DQuat {
        self.view_from_camera
    }

    /// Where a pixel of the view lies in the camera's picture, px; `None` where it does not.
    pub fn place(&self, pixel: DVec2) -> Option<DVec2> {
        let flat = (pixel - self.view.centre_px) / self.view.focal_px;
        let direction = self.view_from_camera.conjugate() * flat.extend(1.0).normalize();
        if direction.angle_between(DVec3::Z) >= self.steady_rad {
            return None;
        }
        let place = self.camera.project(self.distance_mm * direction)?;
        // Between the centres of pixels all is known, beyond the last nothing.
        self.camera.sees(place, 0.5 - 1e-9).then_some(place)
    }

    /// The places of all pixels.
    pub fn map(&self) -> PixelMap {
        let [width, height] = [self.view.width, self.view.height].map(|side| side as usize);
        let place = |at: usize| {
            let pixel = DVec2::new((at % width) as f64, (at / width) as f64);
            self.place(pixel).map_or([f32::NAN; 2], |place| place.as_vec2().to_array())
        };
        PixelMap { width, height, places: (0..width * height).into_par_iter().map(place).collect() }
    }

    /// The shortest focal length with which all pixels have a place, no shorter than that of the widest view.
    fn focal_inside(&self) -> Result<f64, UndistortionError> {
        let is_inside = |focal: f64| {
            let view = self.clone().with_focal(focal);
            view.view.border(ALONG).all(|pixel| view.place(pixel).is_some())
        };
        let mut low = self.view.focal_px.x;
        if is_inside(low) {
            return Ok(low);
        }
        let mut high = NARROWEST * low;
        if !is_inside(high) {
            return Err(UndistortionError::Nothing);
        }
        for _ in 0..HALVINGS {
            let middle = (low * high).sqrt();
            *(if is_inside(middle) { &mut high } else { &mut low }) = middle;
        }
        Ok(high)
    }

    /// The longest focal length with which all that the camera sees is shown, no shorter than that of the widest view.
    fn focal_whole(&self) -> Result<f64, UndistortionError> {
        let half = [self.view.width, self.view.height].map(|side| (f64::from(side) - 1.0) / 2.0);
        let seen = self.camera.border(ALONG).filter_map(|pixel| {
            let ray = self.camera.unproject(pixel)?;
            (ray.direction.angle_between(DVec3::Z) < self.steady_rad).then_some(ray.direction)
        });
        let widest = self.view.focal_px.x;
        let needed = seen.map(|direction| {
            let at = self.view_from_camera * direction;
            match at.z > 0.0 {
                true => (half[0] * at.z / at.x.abs()).min(half[1] * at.z / at.y.abs()),
                false => 0.0,
            }
        });
        let needed = needed.fold(f64::INFINITY, f64::min);
        match needed.is_finite() {
            true => Ok(needed.max(widest)),
            // The lens ends within the picture: as wide as it is good.
            false => {
                let half_rad = self.steady_rad.min(WIDEST_RAD / 2.0);
                Ok((half[0].min(half[1]) / half_rad.tan()).max(widest))
            }
        }
    }
}

/// The angle from the axis at which a lens turns back, rad; π where it does not.
fn steady_rad(camera: &Camera) -> f64 {
    let Some(radius) = camera.lens.steady_radius() else { return std::f64::consts::PI };
    let around = (0..32).map(|i| DVec2::from_angle(f64::from(i) / 32.0 * std::f64::consts::TAU));
    let rays = around.filter_map(|at| camera.lens.ray(STEADY_PART * radius * at));
    let angles = rays.map(|ray| ray.direction.angle_between(DVec3::Z));
    angles.fold(f64::INFINITY, f64::min).min(std::f64::consts::PI)
}

impl Camera {
    /// So many steps of pixels along each border of the image.
    #[doc(hidden)]
    pub fn border(&self, along: usize) -> impl Iterator<Item = DVec2> {
        let last = DVec2::new(f64::from(self.width) - 1.0, f64::from(self.height) - 1.0);
        (0..=along).flat_map(move |i| {
            let part = i as f64 / along as f64;
            let (x, y) = (part * last.x, part * last.y);
            [[x, 0.0], [x, last.y], [0.0, y], [last.x, y]].map(DVec2::from)
        })
    }
}

/// Where the pixels of a picture lie in another one.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelMap {
    width: usize,
    height: usize,
    places: Vec<[f32; 2]>,
}

impl PixelMap {
    /// Width of the new picture, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height of the new picture, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The place x, y, px, of each pixel, row by row; NaN where it has none.
    pub fn places(&self) -> &[[f32; 2]] {
        &self.places
    }

    /// The part of the pixels that have a place.
    pub fn covered(&self) -> f64 {
        let count = self.places.iter().filter(|place| !place[0].is_nan()).count();
        count as f64 / self.places.len().max(1) as f64
    }

    /// The largest rectangle, x, y, width, height in px, in which all pixels have a place; empty where none has.
    pub fn whole_rectangle(&self) -> [usize; 4] {
        let mut best = [0; 4];
        let mut heights = vec![0; self.width + 1];
        for (row, places) in self.places.chunks(self.width.max(1)).enumerate() {
            for (height, place) in heights.iter_mut().zip(places) {
                *height = if place[0].is_nan() { 0 } else { *height + 1 };
            }
            // The largest rectangle below a skyline, by the columns that still may grow.
            let mut open: Vec<(usize, usize)> = Vec::new();
            for (column, &height) in heights.iter().enumerate() {
                let mut first = column;
                while let Some(&(from, tall)) = open.last().filter(|(_, tall)| *tall > height) {
                    if tall * (column - from) > best[2] * best[3] {
                        best = [from, row + 1 - tall, column - from, tall];
                    }
                    first = from;
                    open.pop();
                }
                if height > 0 && open.last().is_none_or(|(_, tall)| *tall < height) {
                    open.push((first, height));
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{BrownConrady, DoubleSphere, KannalaBrandt, Lens};

    fn lenses() -> Vec<Lens> {
        let radial = [-0.25, 0.08, -0.01];
        vec![
            Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() }),
            Lens::KannalaBrandt(KannalaBrandt { k: vec![0.02, -0.003, 0.0, 0.0] }),
            Lens::DoubleSphere(DoubleSphere { xi: -0.2, alpha: 0.6 }),
        ]
    }

    #[test]
    fn pixels_look_along_the_rays_of_their_places() {
        for lens in lenses() {
            let camera = Camera::centred(800, 600, 420.0, lens);
            let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.1, -0.2, 0.05);
            for (turn, field) in [
                (DQuat::IDENTITY, Field::Inside),
                (DQuat::IDENTITY, Field::Whole),
                (turn, Field::Horizontal(1.0)),
            ] {
                let made = Undistortion::turned(&camera, turn, [640, 480], field).unwrap();
                let (mut seen, mut worst): (_, f64) = (0, 0.0);
                for pixel in made.view.border(ALONG).chain([DVec2::new(300.0, 200.0)]) {
                    let Some(place) = made.place(pixel) else { continue };
                    let ray = camera.unproject(place).unwrap().direction;
                    let back = made.view.project(1e3 * (turn * ray)).unwrap();
                    worst = worst.max(back.distance(pixel));
                    seen += 1;
                }
                assert!(seen > 0 && worst < 1e-5, "{field:?}: {seen}, {worst}");
            }
        }
    }

    #[test]
    fn inside_has_every_pixel_and_whole_the_border_of_the_picture() {
        for lens in lenses() {
            let camera = Camera::centred(800, 600, 420.0, lens);
            let inside = Undistortion::new(&camera, [800, 600], Field::Inside).unwrap();
            let map = inside.map();
            assert_eq!(map.whole_rectangle(), [0, 0, 800, 600]);
            // A little wider is too wide.
            let wider = inside.clone().with_focal(0.995 * inside.view.focal_px.x).map();
            assert!(wider.covered() < 1.0);
            let whole = Undistortion::new(&camera, [800, 600], Field::Whole).unwrap();
            assert!(whole.view.focal_px.x < inside.view.focal_px.x);
            for pixel in camera.border(ALONG) {
                let ray = camera.unproject(pixel).unwrap().direction;
                let at = whole.view.project(ray).unwrap();
                assert!(whole.view.sees(at, 0.499), "{at}");
            }
        }
    }

    #[test]
    fn what_a_lens_shows_twice_is_shown_once() {
        // r (1 − 0.5 r²) turns back at r = 0.816, 39°.
        let lens = BrownConrady { radial: [-0.5, 0.0, 0.0], ..BrownConrady::default() };
        let camera = Camera::centred(1200, 900, 600.0, Lens::BrownConrady(lens));
        let wide = Undistortion::new(&camera, [1200, 900], Field::Horizontal(2.0)).unwrap();
        assert!(wide.place(DVec2::new(599.5 + 0.8 * wide.view.focal_px.x, 449.5)).is_some());
        assert!(wide.place(DVec2::new(599.5 + 0.85 * wide.view.focal_px.x, 449.5)).is_none());
    }

    #[test]
    fn the_largest_rectangle_is_found() {
        let picture = ["..####", ".#####", "######", "..###."];
        let place = |c| if c == '#' { [0.0; 2] } else { [f32::NAN; 2] };
        let places = picture.iter().flat_map(|row| row.chars().map(place)).collect();
        let map = PixelMap { width: 6, height: 4, places };
        assert_eq!(map.whole_rectangle(), [2, 0, 4, 3]);
        assert!((map.covered() - 18.0 / 24.0).abs() < 1e-12);
    }
}
