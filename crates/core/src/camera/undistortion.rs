//! A pinhole view of a camera's image, and the positions of its pixels in that image.

use glam::{DQuat, DVec2, DVec3};
use rayon::prelude::*;

use super::Camera;

/// Widest pinhole view that is chosen by default. At its border, 75° from the axis, a pixel covers a fifteenth of the
/// angle of a central one.
const WIDEST_RAD: f64 = 150.0 / 180.0 * std::f64::consts::PI;

/// Widest possible pinhole view: a pinhole sees less than 180°, and resolves almost nothing at its border.
const MAX_RAD: f64 = 179.0 / 180.0 * std::f64::consts::PI;

/// Number of bisections of the ratio of two focal lengths.
const HALVINGS: usize = 60;

/// Number of pixels sampled along each side of an image.
const ALONG: usize = 128;

/// Ratio of the widest view to the narrowest, which shows little more than a pixel.
const NARROWEST: f64 = 1e3;

/// Used fraction of the fold radius of a lens. The unused range of angles grows with the square
/// root of the unused fraction.
const STEADY_PART: f64 = 1.0 - 1e-6;

/// Field of view of a pinhole view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Field {
    /// The largest view in which every pixel has a position in the camera's image.
    Inside,
    /// The whole image of the camera.
    Whole,
    /// The view with this focal length, px.
    Focal(f64),
    /// The view with this horizontal field of view, rad.
    Horizontal(f64),
}

/// Why a view does not exist. Messages contain the remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UndistortionError {
    /// A pinhole cannot have this field of view.
    #[error(
        "a field of view of {degrees:.1}° is too wide: a pinhole view must be narrower than 180°"
    )]
    TooWide {
        /// Requested field of view, degrees.
        degrees: f64,
    },
    /// The camera does not see the direction of the view.
    #[error("the optical axis of the view is outside the camera's field of view")]
    Nothing,
}

/// A pinhole view of a camera's image, with square pixels and the principal point in the centre.
///
/// ```
/// use deltille_core::camera::{BrownConrady, Camera, Field, Lens, Undistortion};
/// use glam::DVec2;
///
/// let lens = BrownConrady { radial: [-0.2, 0.05, 0.0], ..BrownConrady::default() };
/// let camera = Camera::centred(1280, 960, 900.0, Lens::BrownConrady(lens));
/// let view = Undistortion::new(&camera, [1280, 960], Field::Inside)?;
/// let corner = view.source(DVec2::ZERO).unwrap();
/// assert!(camera.sees(corner, 0.0));
/// # Ok::<(), deltille_core::camera::UndistortionError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Undistortion {
    /// Camera of the image.
    camera: Camera,
    /// Pinhole camera of the view.
    view: Camera,
    /// Rotation from the frame of the camera to that of the view.
    view_from_camera: DQuat,
    /// Distance of points, mm; it matters for lenses that are not central.
    distance_mm: f64,
    /// Largest valid angle of rays from the axis, rad; the lens folds beyond it.
    steady_rad: f64,
}

impl Undistortion {
    /// Creates a view along the camera's axis, with the given width and height, px.
    ///
    /// # Errors
    /// Returns an error if no pinhole view covers the field of view.
    pub fn new(
        camera: &Camera,
        size_px: [u32; 2],
        field: Field,
    ) -> Result<Self, UndistortionError> {
        Self::rotated(camera, DQuat::IDENTITY, size_px, field)
    }

    /// Creates a view in another direction: `view_from_camera` rotates directions from the camera
    /// frame to the view frame.
    ///
    /// # Errors
    /// Returns an error if no pinhole shows the field.
    pub fn rotated(
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
            Field::Horizontal(rad) if rad < MAX_RAD => half / (rad / 2.0).tan(),
            Field::Horizontal(rad) => {
                return Err(UndistortionError::TooWide { degrees: rad.to_degrees() });
            }
            Field::Inside => widest.focal_inside()?,
            Field::Whole => widest.focal_whole()?,
        };
        Ok(widest.with_focal(focal))
    }

    /// Returns the view for points at a distance from the camera, mm. It differs from the view of
    /// distant points only if the lens is not central.
    #[must_use]
    pub fn at_distance(self, distance_mm: f64) -> Self {
        Self { distance_mm, ..self }
    }

    /// Returns the view with another focal length, px.
    #[must_use]
    pub fn with_focal(self, focal_px: f64) -> Self {
        let view = Camera { focal_px: DVec2::splat(focal_px), ..self.view };
        Self { view, ..self }
    }

    /// Returns the pinhole camera of the view.
    pub fn view(&self) -> &Camera {
        &self.view
    }

    /// Returns the rotation from the frame of the camera to that of the view.
    pub fn view_from_camera(&self) -> DQuat {
        self.view_from_camera
    }

    /// Returns the position of a view pixel in the camera's image, px; `None` if it has none.
    pub fn source(&self, pixel: DVec2) -> Option<DVec2> {
        let flat = (pixel - self.view.centre_px) / self.view.focal_px;
        let direction = self.view_from_camera.conjugate() * flat.extend(1.0).normalize();
        if direction.angle_between(DVec3::Z) >= self.steady_rad {
            return None;
        }
        let place = self.camera.project(self.distance_mm * direction)?;
        // Values are known between pixel centres, but not beyond the outermost ones.
        self.camera.sees(place, 0.5 - 1e-9).then_some(place)
    }

    /// Returns the positions of all pixels.
    pub fn map(&self) -> PixelMap {
        let [width, height] = [self.view.width, self.view.height].map(|side| side as usize);
        let place = |at: usize| {
            let pixel = DVec2::new((at % width) as f64, (at / width) as f64);
            self.source(pixel).map_or([f32::NAN; 2], |place| place.as_vec2().to_array())
        };
        PixelMap {
            width,
            height,
            positions: (0..width * height).into_par_iter().map(place).collect(),
        }
    }

    /// Returns the shortest focal length at which all pixels have a position, but not shorter than that of the widest
    /// view.
    fn focal_inside(&self) -> Result<f64, UndistortionError> {
        let is_inside = |focal: f64| {
            let view = self.clone().with_focal(focal);
            view.view.border(ALONG).all(|pixel| view.source(pixel).is_some())
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

    /// Returns the longest focal length that shows everything the camera sees, but not shorter than that of the
    /// widest view.
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
            // The valid range of the lens ends within the image; the view extends to its limit.
            false => {
                let half_rad = self.steady_rad.min(WIDEST_RAD / 2.0);
                Ok((half[0].min(half[1]) / half_rad.tan()).max(widest))
            }
        }
    }
}

/// Returns the angle from the axis at which a lens folds back, rad; π if it does not.
fn steady_rad(camera: &Camera) -> f64 {
    let Some(radius) = camera.lens.monotonic_radius() else { return std::f64::consts::PI };
    let around = (0..32).map(|i| DVec2::from_angle(f64::from(i) / 32.0 * std::f64::consts::TAU));
    let rays = around.filter_map(|at| camera.lens.ray(STEADY_PART * radius * at));
    let angles = rays.map(|ray| ray.direction.angle_between(DVec3::Z));
    angles.fold(f64::INFINITY, f64::min).min(std::f64::consts::PI)
}

impl Camera {
    /// Returns pixel positions along the image border, `along` steps per side.
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

/// Positions of the pixels of an image in another image.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelMap {
    width: usize,
    height: usize,
    positions: Vec<[f32; 2]>,
}

impl PixelMap {
    /// Returns the width of the new image, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the height of the new image, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns the position x, y, px, of each pixel, row by row; NaN if it has none.
    pub fn positions(&self) -> &[[f32; 2]] {
        &self.positions
    }

    /// Returns the fraction of pixels that have a position.
    pub fn valid_fraction(&self) -> f64 {
        let count = self.positions.iter().filter(|place| !place[0].is_nan()).count();
        count as f64 / self.positions.len().max(1) as f64
    }

    /// Returns the largest rectangle, x, y, width, height in px, in which all pixels have a position; empty if there
    /// is none.
    pub fn valid_rectangle(&self) -> [usize; 4] {
        let mut best = [0; 4];
        let mut heights = vec![0; self.width + 1];
        for (row, places) in self.positions.chunks(self.width.max(1)).enumerate() {
            for (height, place) in heights.iter_mut().zip(places) {
                *height = if place[0].is_nan() { 0 } else { *height + 1 };
            }
            // Finds the largest rectangle below a skyline from the columns that can still grow.
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
    fn pixels_match_the_rays_of_their_positions() {
        for lens in lenses() {
            let camera = Camera::centred(800, 600, 420.0, lens);
            let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.1, -0.2, 0.05);
            for (turn, field) in [
                (DQuat::IDENTITY, Field::Inside),
                (DQuat::IDENTITY, Field::Whole),
                (turn, Field::Horizontal(1.0)),
            ] {
                let made = Undistortion::rotated(&camera, turn, [640, 480], field).unwrap();
                let (mut seen, mut worst): (_, f64) = (0, 0.0);
                for pixel in made.view.border(ALONG).chain([DVec2::new(300.0, 200.0)]) {
                    let Some(place) = made.source(pixel) else { continue };
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
    fn inside_is_complete_and_whole_shows_the_border() {
        for lens in lenses() {
            let camera = Camera::centred(800, 600, 420.0, lens);
            let inside = Undistortion::new(&camera, [800, 600], Field::Inside).unwrap();
            let map = inside.map();
            assert_eq!(map.valid_rectangle(), [0, 0, 800, 600]);
            // A slightly wider view is too wide.
            let wider = inside.clone().with_focal(0.995 * inside.view.focal_px.x).map();
            assert!(wider.valid_fraction() < 1.0);
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
    fn folded_image_parts_are_shown_once() {
        // r (1 − 0.5 r²) folds back at r = 0.816, 39°.
        let lens = BrownConrady { radial: [-0.5, 0.0, 0.0], ..BrownConrady::default() };
        let camera = Camera::centred(1200, 900, 600.0, Lens::BrownConrady(lens));
        let wide = Undistortion::new(&camera, [1200, 900], Field::Horizontal(2.0)).unwrap();
        assert!(wide.source(DVec2::new(599.5 + 0.8 * wide.view.focal_px.x, 449.5)).is_some());
        assert!(wide.source(DVec2::new(599.5 + 0.85 * wide.view.focal_px.x, 449.5)).is_none());
    }

    #[test]
    fn the_largest_rectangle_is_found() {
        let picture = ["..####", ".#####", "######", "..###."];
        let place = |c| if c == '#' { [0.0; 2] } else { [f32::NAN; 2] };
        let places = picture.iter().flat_map(|row| row.chars().map(place)).collect();
        let map = PixelMap { width: 6, height: 4, positions: places };
        assert_eq!(map.valid_rectangle(), [2, 0, 4, 3]);
        assert!((map.valid_fraction() - 18.0 / 24.0).abs() < 1e-12);
    }
}
