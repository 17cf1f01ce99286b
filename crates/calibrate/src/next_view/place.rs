//! The placement of a board: position in the image, distance, tilt and rotation, and the resulting pose.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec2};

use super::body::{Body, COARSE};
use deltille_core::camera::{Camera, Pose};

/// Limits within which placements are similar: fraction of the image, rad (20°), and fraction of
/// the distance. They are twice the error of a person.
const LIKE_AT: f64 = 0.12;
const LIKE_RAD: f64 = 0.35;
const LIKE_DEEP: f64 = 0.2;

/// The placement of a board in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placing {
    /// Position of its centre, in fractions of the image's width and height.
    pub at: DVec2,
    /// Distance of its centre, mm.
    pub distance_mm: f64,
    /// The angle between its normal and the line of sight, rad.
    pub tilt: f64,
    /// Direction in the image in which it recedes, rad, clockwise from right.
    pub away: f64,
    /// Rotation in its plane, rad, counter-clockwise in the image.
    pub roll: f64,
}

impl Placing {
    /// Returns the pose `camera_from_target`; `None` if the lens does not image the position.
    pub(super) fn pose(&self, camera: &Camera, body: &Body) -> Option<Pose> {
        let size = DVec2::new(camera.width.into(), camera.height.into());
        let pixel = self.at * size - 0.5;
        let sight = camera.unproject(pixel)?.direction.normalize();
        let along = |step: DVec2| {
            // Use the side of the position on which the lens has a ray.
            let ends = [camera.unproject(pixel + step), camera.unproject(pixel - step)];
            let across = match ends {
                [Some(after), Some(before)] => after.direction - before.direction,
                [Some(after), None] => after.direction - sight,
                [None, Some(before)] => sight - before.direction,
                [None, None] => return None,
            };
            Some(across - sight * across.dot(sight))
        };
        let right = along(DVec2::X)?.normalize_or_zero();
        // Out of the board, towards the camera.
        let out = -sight;
        let up = out.cross(right);
        let up = if up.dot(along(DVec2::Y)?) > 0.0 { -up } else { up };
        let facing = DMat3::from_cols(right, up, out);
        if facing.determinant() < 0.5 {
            return None;
        }
        let (sin, cos) = self.away.sin_cos();
        let farther = cos * right - sin * up;
        let tilted = DQuat::from_axis_angle(farther.cross(sight), self.tilt);
        let rolled = DQuat::from_rotation_z(self.roll);
        let rotation = tilted * DQuat::from_mat3(&facing) * rolled;
        let camera_from_front = Pose { rotation, translation: self.distance_mm * sight };
        Some(camera_from_front.after(&body.front.inverse()))
    }

    /// The placement at the distance where the outline fills this fraction of the image, along the side that it fills
    /// more.
    pub(super) fn filling(self, part: f64, camera: &Camera, body: &Body) -> Option<Self> {
        let size = DVec2::new(camera.width.into(), camera.height.into());
        let reach = body.reach_mm();
        // Starts from the size at the centre of a typical field of view, then scales the distance
        // by the error.
        let mut placing = Self { distance_mm: 2.0 * reach / part, ..self };
        for _ in 0..ROUNDS {
            let outlines = body.outlines(camera, &placing.pose(camera, body)?, COARSE);
            let points = || outlines.iter().flatten();
            let least = points().copied().reduce(DVec2::min)?;
            let most = points().copied().reduce(DVec2::max)?;
            let filled = ((most - least) / size).max_element();
            placing.distance_mm *= (filled / part).clamp(0.5, 2.0);
        }
        (placing.distance_mm.is_finite() && placing.distance_mm > 0.1 * reach).then_some(placing)
    }
}

/// Number of iterations of the distance: each at least halves the error, because size is nearly
/// inversely proportional to distance.
const ROUNDS: usize = 5;

impl Body {
    /// Reach of its outline from the centre of its front, mm.
    pub(super) fn reach_mm(&self) -> f64 {
        let corners = self.panels.iter().flat_map(|panel| &panel.corners);
        let far = corners.map(|corner| corner.target_mm.distance(self.front.translation));
        far.fold(1e-3, f64::max)
    }
}

impl Placing {
    /// Whether a person would consider the two placements the same.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let lean = |placing: &Self| placing.tilt * DVec2::from_angle(placing.away);
        let turn = (self.roll - other.roll + PI).rem_euclid(TAU) - PI;
        self.at.distance(other.at) < LIKE_AT
            && lean(self).distance(lean(other)) < LIKE_RAD
            && turn.abs() < LIKE_RAD
            && (self.distance_mm / other.distance_mm).ln().abs() < LIKE_DEEP
    }

    /// Changes one of its coordinates: x, y, the logarithm of the distance, tilt, away, roll.
    pub(super) fn moved(self, coordinate: usize, by: f64) -> Self {
        let mut moved = self;
        match coordinate {
            0 => moved.at.x += by,
            1 => moved.at.y += by,
            2 => moved.distance_mm *= by.exp(),
            3 => moved.tilt += by,
            4 => moved.away += by,
            _ => moved.roll += by,
        }
        moved
    }
}
