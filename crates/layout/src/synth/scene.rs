use glam::{DVec2, DVec3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use serde::{Deserialize, Serialize};

use super::Surface;
use super::occlusion::Shadow;
use deltille_core::camera::{Camera, Pose};
use deltille_core::polygon::{bounds, clip};
use deltille_core::raster::{Coverage, Gray, gaussian};

/// Maximum distance between the image of an edge and its chords, px.
const MAX_CHORD_ERROR_PX: f64 = 1e-4;

/// Maximum depth of the subdivision of an edge: 2¹⁰ chords follow the image of an
/// edge through any lens.
const MAX_DIVISIONS: u32 = 10;

/// Outlines that the camera does not see completely are cut into parts down to this fraction of the paper. At the
/// fold of a distortion, the image does not move to first order, so their steps are far below a pixel.
const SMALLEST_PART: f64 = 1.0 / 256.0;

/// Illumination and imperfections of an image.
///
/// ```
/// use deltille_layout::synth::Light;
///
/// let dim = Light::default().white(0.3).noise(0.02).seed(7);
/// assert_eq!([dim.white, dim.blur_px], [0.3, 0.8]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Light {
    /// Grey value of white paper; full scale is 1.
    pub white: f64,
    /// Grey value of black print; full scale is 1.
    pub black: f64,
    /// Grey value outside the target; full scale is 1.
    pub background: f64,
    /// Relative change of illumination across the width and down the height of the image.
    pub gradient: DVec2,
    /// Standard deviation of the Gaussian blur, px.
    pub blur_px: f64,
    /// Standard deviation of the Gaussian noise; full scale is 1.
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for Light {
    /// Typical values of a good photograph: levels 0.1 and 0.9, 0.8 px of blur, 1 % of noise.
    fn default() -> Self {
        Self {
            white: 0.9,
            black: 0.1,
            background: 0.5,
            gradient: DVec2::ZERO,
            blur_px: 0.8,
            noise: 0.01,
            seed: 0,
        }
    }
}

impl Light {
    /// Sets the level of white paper; full scale is 1.
    #[must_use]
    pub fn white(self, white: f64) -> Self {
        Self { white, ..self }
    }

    /// Sets the level of black print; full scale is 1.
    #[must_use]
    pub fn black(self, black: f64) -> Self {
        Self { black, ..self }
    }

    /// Sets the level around the target; full scale is 1.
    #[must_use]
    pub fn background(self, background: f64) -> Self {
        Self { background, ..self }
    }

    /// Sets the relative change of illumination across the width and down the height of the image.
    #[must_use]
    pub fn gradient(self, gradient: DVec2) -> Self {
        Self { gradient, ..self }
    }

    /// Sets the standard deviation of the Gaussian blur, px.
    #[must_use]
    pub fn blur_px(self, blur_px: f64) -> Self {
        Self { blur_px, ..self }
    }

    /// Sets the standard deviation of the Gaussian noise; full scale is 1.
    #[must_use]
    pub fn noise(self, noise: f64) -> Self {
        Self { noise, ..self }
    }

    /// Sets the seed of the noise.
    #[must_use]
    pub fn seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }
}

/// Surfaces of solids, visible from the front only. They may hide each other, but must not intersect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The surfaces; their paper outlines are convex.
    pub surfaces: Vec<Surface>,
}

/// True positions of the corners in a synthetic image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Truth {
    /// All corners in the image.
    pub corners: Vec<TruthCorner>,
}

/// A visible corner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TruthCorner {
    /// Panel id.
    pub panel: u32,
    /// Corner id in the target.
    pub id: u32,
    /// Lattice row.
    pub row: i32,
    /// Lattice column.
    pub col: i32,
    /// True horizontal position, px, to the right; pixel centres at integers.
    pub x: f64,
    /// True vertical position, px, downwards.
    pub y: f64,
    /// Position in the target frame, mm.
    pub target_mm: DVec3,
}

impl Scene {
    /// Renders the image that `camera` takes, on a scale of 0 to 1, before rounding to a pixel depth.
    pub fn render(&self, camera: &Camera, camera_from_target: &Pose, light: &Light) -> Gray<f32> {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let mut coverage = Coverage::new(width, height);
        for (surface, shadows) in self.seen_from(camera_from_target) {
            let [left, lower, right, upper] = bounds(&surface.paper_mm);
            let view = View {
                camera,
                camera_from_surface: surface.camera_from(camera_from_target),
                smallest_part_mm: SMALLEST_PART * (right - left).max(upper - lower),
            };
            let mut add = |outline: &[DVec2], solid: bool, value: f64| {
                for part in lit(outline, &shadows) {
                    view.draw(part, &mut |image| coverage.add(&clockwise(image, solid), value));
                }
            };
            add(&surface.paper_mm, true, light.white - light.background);
            for area in &surface.black_mm {
                for (i, outline) in area.iter().enumerate() {
                    let solid = depth(area, i).is_multiple_of(2);
                    add(outline, solid, light.black - light.white);
                }
            }
        }
        let sharp = coverage.finish();
        let background = light.background as f32;
        let mut image = gaussian(&sharp.map(|v| v + background), light.blur_px);
        let mut rng = ChaCha8Rng::seed_from_u64(light.seed);
        let noise = Normal::new(0.0, light.noise.max(0.0)).ok();
        for y in 0..height {
            let row_gain = 1.0 + light.gradient.y * (y as f64 / height as f64 - 0.5);
            for (x, pixel) in image.row_mut(y).iter_mut().enumerate() {
                let gain = row_gain + light.gradient.x * (x as f64 / width as f64 - 0.5);
                let shot = noise.map_or(0.0, |n| n.sample(&mut rng));
                *pixel = (f64::from(*pixel) * gain + shot).clamp(0.0, 1.0) as f32;
            }
        }
        image
    }

    /// Returns the corners that are visible in the image, at least `margin_px` from its border.
    pub fn truth(&self, camera: &Camera, camera_from_target: &Pose, margin_px: f64) -> Truth {
        let mut truth = Truth::default();
        for (surface, shadows) in self.seen_from(camera_from_target) {
            let camera_from_surface = surface.camera_from(camera_from_target);
            for &(id, row, col, place) in &surface.corners {
                if shadows.iter().any(|shadow| shadow.hides(place)) {
                    continue;
                }
                let point = place.extend(0.0);
                let pixel = camera.project(camera_from_surface.apply(point));
                let Some(DVec2 { x, y }) = pixel.filter(|&p| camera.sees(p, margin_px)) else {
                    continue;
                };
                let target_mm = surface.target_from_surface.apply(point);
                let panel = surface.panel;
                truth.corners.push(TruthCorner { panel, id, row, col, x, y, target_mm });
            }
        }
        truth
    }

    /// Returns the surfaces that face the camera, with the shadows of the others on them.
    fn seen_from(&self, camera_from_target: &Pose) -> Vec<(&Surface, Vec<Shadow>)> {
        let eye = camera_from_target.inverse().translation;
        let facing = self.surfaces.iter().filter(|surface| {
            let corner = surface.paper_mm.first().copied().unwrap_or_default();
            let on_surface = surface.target_from_surface.apply(corner.extend(0.0));
            (surface.target_from_surface.rotation * DVec3::Z).dot(eye - on_surface) > 0.0
        });
        let facing: Vec<&Surface> = facing.collect();
        let shadows = |behind: &Surface| {
            let others = facing.iter().filter(|before| !std::ptr::eq(**before, behind));
            others.filter_map(|before| Shadow::of(before, behind, eye)).collect()
        };
        facing.iter().map(|&surface| (surface, shadows(surface))).collect()
    }
}

/// The plane of a surface, seen by a camera.
struct View<'a> {
    camera: &'a Camera,
    camera_from_surface: Pose,
    smallest_part_mm: f64,
}

impl View<'_> {
    /// Passes the image of an outline to `add`. If the camera does not see all of the outline, it is halved until the
    /// parts are visible or small.
    fn draw(&self, outline: Vec<DVec2>, add: &mut impl FnMut(Vec<DVec2>)) {
        if let Some(image) = self.outline(&outline) {
            return add(image);
        }
        let [left, lower, right, upper] = bounds(&outline);
        let extent = DVec2::new(right - left, upper - lower);
        if outline.len() < 3 || extent.max_element() < self.smallest_part_mm {
            return;
        }
        let middle = DVec2::new(left.midpoint(right), lower.midpoint(upper));
        let across = if extent.x > extent.y { DVec2::X } else { DVec2::Y };
        for side in [across, -across] {
            self.draw(clip(&outline, |p| side.dot(p - middle)), add);
        }
    }

    fn project(&self, point: DVec2) -> Option<DVec2> {
        self.camera.project(self.camera_from_surface.apply(point.extend(0.0)))
    }

    /// Returns the image of an outline as a fine polygon; `None` if a part of it cannot be projected.
    fn outline(&self, outline: &[DVec2]) -> Option<Vec<DVec2>> {
        let mut image = Vec::with_capacity(4 * outline.len());
        for (i, &from) in outline.iter().enumerate() {
            let to = outline[(i + 1) % outline.len()];
            let (start, end) = (self.project(from)?, self.project(to)?);
            image.push(start);
            self.divide([from, to], [start, end], MAX_DIVISIONS, &mut image)?;
        }
        Some(image)
    }

    /// Adds points between the ends of an edge until the polygon follows its curvature.
    fn divide(
        &self,
        [from, to]: [DVec2; 2],
        [start, end]: [DVec2; 2],
        divisions: u32,
        image: &mut Vec<DVec2>,
    ) -> Option<()> {
        let middle = from.midpoint(to);
        let seen = self.project(middle)?;
        let chord = end - start;
        let cross = (seen - start).perp_dot(chord);
        if cross.abs() <= MAX_CHORD_ERROR_PX * chord.length() || divisions == 0 {
            return Some(());
        }
        self.divide([from, middle], [start, seen], divisions - 1, image)?;
        image.push(seen);
        self.divide([middle, to], [seen, end], divisions - 1, image)
    }
}

/// Returns the parts of an outline outside all shadows.
fn lit(outline: &[DVec2], shadows: &[Shadow]) -> Vec<Vec<DVec2>> {
    shadows.iter().fold(vec![outline.to_vec()], |parts, shadow| {
        parts.into_iter().flat_map(|part| shadow.cut(part)).collect()
    })
}

/// Returns the number of other outlines of an area that enclose outline `i`.
fn depth(area: &[Vec<DVec2>], i: usize) -> usize {
    let Some(&point) = area[i].first() else {
        return 0;
    };
    // Outlines may touch in vertices, so the test uses a point just inside the outline.
    let inner = just_inside(&area[i]).unwrap_or(point);
    (0..area.len()).filter(|&j| j != i && encloses(&area[j], inner)).count()
}

/// Returns a point inside a polygon, close to the middle of its first edge.
fn just_inside(polygon: &[DVec2]) -> Option<DVec2> {
    let (a, b) = (*polygon.first()?, *polygon.get(1)?);
    let (middle, normal) = (a.midpoint(b), (b - a).perp() * 1e-3);
    [middle + normal, middle - normal].into_iter().find(|&p| encloses(polygon, p))
}

/// Returns whether a polygon encloses a point, by the even-odd rule.
fn encloses(polygon: &[DVec2], p: DVec2) -> bool {
    let n = polygon.len();
    (0..n).fold(false, |inside, i| {
        let (a, b) = (polygon[i], polygon[(i + 1) % n]);
        let crosses =
            (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x;
        inside != crosses
    })
}

/// Orients a polygon clockwise on the screen if `solid`, else counter-clockwise.
fn clockwise(mut polygon: Vec<DVec2>, solid: bool) -> Vec<DVec2> {
    let n = polygon.len();
    let doubled: f64 = (0..n).map(|i| polygon[i].perp_dot(polygon[(i + 1) % n])).sum();
    if (doubled > 0.0) != solid {
        polygon.reverse();
    }
    polygon
}

#[cfg(test)]
mod tests {
    use deltille_core::camera::{Lens, LensKind};
    use deltille_core::polygon::rectangle;
    use glam::DQuat;

    use super::*;

    /// White paper that extends beyond what a lens sees: beyond the fold of a distortion, and behind the camera. Every
    /// pixel is white if its line of sight meets the paper.
    #[test]
    fn paper_is_drawn_wherever_a_pixel_sees_it() {
        let barrel = |camera: Camera| {
            let mut values = camera.parameters();
            (values[4], values[5]) = (-0.35, 0.02);
            camera.with_parameters(&values)
        };
        let centred = |focal_px, kind: LensKind| {
            let lens: Lens = kind.lens(2, None).unwrap();
            Camera::centred(320, 240, focal_px, lens)
        };
        let folded = barrel(centred(150.0, LensKind::BrownConrady));
        let pinhole = Camera::pinhole(320, 240, 1.5);
        let fisheye = centred(90.0, LensKind::KannalaBrandt);
        for (camera, tilt) in [(folded, 0.2), (pinhole, 1.3), (fisheye, 1.2)] {
            let pose = Pose {
                rotation: DQuat::from_rotation_x(std::f64::consts::PI - tilt),
                translation: DVec3::new(20.0, 30.0, 100.0),
            };
            let paper_mm = rectangle([-300.0, -250.0, 280.0, 260.0]).to_vec();
            let surface = Surface {
                panel: 0,
                target_from_surface: Pose::IDENTITY,
                paper_mm: paper_mm.clone(),
                black_mm: Vec::new(),
                corners: Vec::new(),
            };
            let light = Light::default().white(1.0).background(0.0).noise(0.0).blur_px(0.0);
            let image = Scene { surfaces: vec![surface] }.render(&camera, &pose, &light);
            let seen = |x: usize, y: usize| {
                let ray = camera.unproject(DVec2::new(x as f64, y as f64))?;
                let back = pose.inverse();
                let (eye, along) = (back.translation, back.rotation * ray.direction);
                let distance = -eye.z / along.z;
                (distance > 0.0 && encloses(&paper_mm, (eye + distance * along).truncate()))
                    .then_some(())
            };
            let mut white = 0;
            let mut wrong = Vec::new();
            for (y, x) in (0..240).flat_map(|y| (0..320).map(move |x| (y, x))) {
                let expected = seen(x, y).is_some();
                white += usize::from(expected);
                // On the edge of the paper, a pixel is partly white.
                let value = image.row(y)[x];
                if (value > 0.999 && !expected) || (value < 0.001 && expected) {
                    wrong.push((x, y));
                }
            }
            assert!((10_000..70_000).contains(&white), "{white} white pixels");
            assert!(wrong.len() < 3, "{} pixels: {:?}", wrong.len(), camera.lens);
        }
    }
}
