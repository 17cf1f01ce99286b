//! Camera pose, lens distortion and shape of the sheet: maps pixels to the page and back.
//!
//! Written independently for this experiment, so that it shares no errors with [`deltille::camera`]. The page frame has
//! its origin in the middle of the board, x right, y up, z towards the viewer:
//!
//! ```text
//! sheet    X(u, v) = b · ρ sin(u/ρ) + b⊥ · v + z · ρ (1 − cos(u/ρ))      bent along b, flat for ρ = ∞
//! camera   P = R X + t,  n = (P_x, P_y) / P_z
//! lens     n = m (1 + k |m|²),  pixel = centre + f m
//! ```
//!
//! Rendering goes from pixels to the page, for which this model has a closed form.

use glam::{DMat3, DVec2, DVec3};

/// Number of Newton iterations for the lens; convergence is quadratic.
const LENS_ITERATIONS: u32 = 20;

/// Round-trip error up to which a projected point counts as visible, px; if it is larger, the sheet hides the point.
const SAME_PX: f64 = 1e-3;

/// A view of a sheet.
#[derive(Clone, Debug)]
pub struct View {
    /// Width and height of the image, px.
    pub size_px: [usize; 2],
    /// Focal length, px.
    pub focal_px: f64,
    /// Distortion coefficient k of the lens.
    pub lens: f64,
    /// Middle of the board on the page, mm.
    pub middle_mm: DVec2,
    /// Curvature of the sheet; `None` if flat.
    pub curl: Option<Curl>,
    /// Pose of the camera relative to the sheet.
    pub place: Place,
}

/// Pose of the camera relative to the sheet.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// R.
    rotation: DMat3,
    /// t, mm.
    translation_mm: DVec3,
    /// Rᵀ, and the camera position in the frame of the sheet, −Rᵀ t.
    turn_back: DMat3,
    eye_mm: DVec3,
}

impl Place {
    /// Creates the pose from R and t.
    pub fn new(rotation: DMat3, translation_mm: DVec3) -> Self {
        let turn_back = rotation.transpose();
        Self { rotation, translation_mm, turn_back, eye_mm: -(turn_back * translation_mm) }
    }
}

/// A sheet bent to a cylinder.
#[derive(Clone, Copy, Debug)]
pub struct Curl {
    /// Radius ρ, mm; its sign gives the side to which the sheet bends.
    pub radius_mm: f64,
    /// Direction b on the page.
    pub along: DVec2,
}

impl View {
    /// Returns the position on the page that a pixel sees, mm; `None` if its ray misses the bent
    /// sheet.
    pub fn page_from_px(&self, px: DVec2) -> Option<DVec2> {
        let Some(curl) = self.curl else { return self.table_from_px(px) };
        let place = curl.hit(self.place.eye_mm, self.ray(px))?;
        Some(place + self.middle_mm)
    }

    /// Returns the position that a pixel sees on the plane of the flat page, mm; `None` at and above its horizon.
    pub fn table_from_px(&self, px: DVec2) -> Option<DVec2> {
        let (eye, ray) = (self.place.eye_mm, self.ray(px));
        let s = -eye.z / ray.z;
        (s > 0.0).then(|| (eye + s * ray).truncate() + self.middle_mm)
    }

    /// Returns the viewing direction of a pixel, in the frame of the sheet.
    fn ray(&self, px: DVec2) -> DVec3 {
        let m = (px - self.centre_px()) / self.focal_px;
        let n = m * (1.0 + self.lens * m.length_squared());
        self.place.turn_back * n.extend(1.0)
    }

    /// Returns the pixel at which a position of the page is seen; `None` behind the camera and where the sheet hides
    /// it.
    pub fn px_from_page(&self, page_mm: DVec2) -> Option<DVec2> {
        let place = page_mm - self.middle_mm;
        let on_sheet = self.curl.map_or(place.extend(0.0), |curl| curl.bent(place));
        let p = self.place.rotation * on_sheet + self.place.translation_mm;
        if p.z <= 0.0 {
            return None;
        }
        let n = p.truncate() / p.z;
        // |n| = r (1 + k r²), solved for r.
        let length = n.length();
        let mut r = length;
        for _ in 0..LENS_ITERATIONS {
            r -= (r * (1.0 + self.lens * r * r) - length) / (1.0 + 3.0 * self.lens * r * r);
        }
        let m = if length > 0.0 { n * (r / length) } else { n };
        let px = self.centre_px() + self.focal_px * m;
        let off_mm = self.page_from_px(px)?.distance(page_mm);
        (off_mm * self.focal_px / p.z < SAME_PX).then_some(px)
    }

    fn centre_px(&self) -> DVec2 {
        0.5 * (DVec2::from(self.size_px.map(|size| size as f64)) - 1.0)
    }
}

impl Curl {
    /// Maps a position on the flat sheet to its position in space.
    fn bent(&self, place: DVec2) -> DVec3 {
        let (rho, across) = (self.radius_mm, self.along.perp());
        let (u, v) = (place.dot(self.along), place.dot(across));
        let (sin, cos) = (u / rho).sin_cos();
        (self.along * (rho * sin) + across * v).extend(rho * (1.0 - cos))
    }

    /// Returns the position on the flat sheet that a ray meets first.
    fn hit(&self, eye: DVec3, ray: DVec3) -> Option<DVec2> {
        let (rho, across) = (self.radius_mm, self.along.perp());
        let flat = |p: DVec3| [p.truncate().dot(self.along), p.truncate().dot(across)];
        let ([ou, ov], [du, dv]) = (flat(eye), flat(ray));
        let oz = eye.z - rho;
        // The circle u² + (z − ρ)² = ρ².
        let a = du * du + ray.z * ray.z;
        let b = ou * du + oz * ray.z;
        let c = ou * ou + oz * oz - rho * rho;
        let root = b * b - a * c;
        if root < 0.0 {
            return None;
        }
        let root = root.sqrt();
        [(-b - root) / a, (-b + root) / a].into_iter().filter(|&s| s > 0.0).find_map(|s| {
            let (u, w) = (ou + s * du, oz + s * ray.z);
            // The half of the cylinder on which the sheet lies.
            (w * rho < 0.0).then(|| {
                let u = rho * (u / rho).asin();
                self.along * u + across * (ov + s * dv)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A view of a sheet of 200 × 150 mm.
    fn view(curl: Option<Curl>) -> View {
        View {
            size_px: [640, 480],
            focal_px: 700.0,
            lens: -0.12,
            middle_mm: DVec2::new(100.0, 75.0),
            curl,
            place: Place::new(
                DMat3::from_rotation_x(0.6) * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)),
                DVec3::new(5.0, -3.0, 400.0),
            ),
        }
    }

    #[test]
    fn projecting_and_unprojecting_are_inverse() {
        let along = DVec2::new(0.8, 0.6);
        for curl in
            [None, Some(Curl { radius_mm: 300.0, along }), Some(Curl { radius_mm: -300.0, along })]
        {
            let view = view(curl);
            for place in [(100.0, 75.0), (3.0, 140.0), (190.0, 20.0)].map(DVec2::from) {
                let px = view.px_from_page(place).unwrap();
                let back = view.page_from_px(px).unwrap();
                assert!(back.distance(place) < 1e-9, "{curl:?} {place:?}");
            }
        }
    }

    #[test]
    fn a_slight_bend_is_nearly_flat() {
        let curl = Curl { radius_mm: 1e7, along: DVec2::X };
        let (flat, bent) = (view(None), view(Some(curl)));
        let place = DVec2::new(20.0, 130.0);
        let [flat, bent] = [flat, bent].map(|view| view.px_from_page(place).unwrap());
        assert!(flat.distance(bent) < 0.01);
    }
}
