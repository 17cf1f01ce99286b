//! A virtual camera in front of a loaded mesh: renders it with its texture, and finds the point of the mesh behind a
//! pixel.

use glam::{DVec2, DVec3};

use crate::model::mesh::Model;
use crate::model::samples::{SAMPLES, for_each_sample, pixels};
use deltille_core::camera::{Camera, Pose};
use deltille_core::raster::Gray;

/// Grey value around the mesh, between the black and white of the print.
const BACKGROUND: u8 = 128;

/// A pinhole camera in front of a loaded mesh.
pub(crate) struct View {
    /// The camera; it has no distortion.
    pub camera: Camera,
    /// Its pose.
    pub camera_from_target: Pose,
}

impl View {
    /// Renders the mesh: each sample shows the texture of the nearest triangle whose front, by the order of its
    /// vertices, faces the camera. Skips a triangle with a vertex that cannot be projected.
    pub(crate) fn render(&self, model: &Model) -> Gray<u8> {
        let [width, height] = [self.camera.width, self.camera.height].map(|n| n as usize * SAMPLES);
        let mut nearest = vec![0.0f32; width * height];
        let mut shades = vec![BACKGROUND; width * height];
        let scale = SAMPLES as f64;
        let sample = |pixel: DVec2| (pixel + 0.5) * scale - 0.5;
        for triangle in &model.triangles {
            let (texture, size) = model.texture(triangle);
            let seen = triangle.vertices_mm.map(|v| self.camera_from_target.apply(v));
            let normal = (seen[1] - seen[0]).cross(seen[2] - seen[0]);
            if normal.dot(seen[0]) >= 0.0 {
                continue;
            }
            let Some(corners) = all(seen.map(|v| self.camera.project(v).map(sample))) else {
                continue;
            };
            // 1/z and texture coordinates over z are affine on the screen; 1/z also determines which triangle is nearest.
            let values = [0, 1, 2].map(|i| {
                let texel = triangle.uv[i] * size / seen[i].z;
                [1.0 / seen[i].z, texel.x, texel.y]
            });
            for_each_sample(corners, values, [width, height], |at, [inverse_z, u, v]| {
                if inverse_z as f32 > nearest[at] {
                    nearest[at] = inverse_z as f32;
                    let light = texture.bilinear(u / inverse_z - 0.5, v / inverse_z - 0.5);
                    shades[at] = (light + 0.5) as u8;
                }
            });
        }
        pixels(&shades, width)
    }

    /// Returns the first intersection of a pixel's ray with a front-facing triangle of the mesh, in
    /// the target frame, mm; `None` if the ray hits nothing.
    pub(crate) fn meet(&self, model: &Model, pixel: DVec2) -> Option<DVec3> {
        let target_from_camera = self.camera_from_target.inverse();
        let eye = target_from_camera.translation;
        let ahead = (pixel - self.camera.centre_px) / self.camera.focal_px;
        let ray = target_from_camera.rotation * ahead.extend(1.0);
        let meets = model.triangles.iter().filter_map(|triangle| {
            let normal = triangle.winding();
            let towards = normal.dot(ray);
            if towards >= 0.0 {
                return None;
            }
            let [a, b, c] = triangle.vertices_mm;
            let t = normal.dot(a - eye) / towards;
            let p = eye + ray * t;
            let inside = [(a, b), (b, c), (c, a)]
                .iter()
                .all(|(p0, p1)| (*p1 - *p0).cross(p - *p0).dot(normal) >= 0.0);
            (t > 0.0 && inside).then_some((t, p))
        });
        meets.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, point)| point)
    }
}

/// Returns the three values if all are present.
fn all<T: Copy>(values: [Option<T>; 3]) -> Option<[T; 3]> {
    let [a, b, c] = values;
    Some([a?, b?, c?])
}
