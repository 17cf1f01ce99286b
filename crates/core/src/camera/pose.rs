use glam::{DMat3, DQuat, DVec3};

/// A rigid motion `y = R·x + t` between two frames, named after both, as in
/// `camera_from_target`. Translations in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The rotation R, a unit quaternion.
    pub rotation: DQuat,
    /// The translation t, mm.
    pub translation: DVec3,
}

impl Pose {
    /// The motion that leaves every point where it is.
    pub const IDENTITY: Pose = Pose { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };

    /// The point R·x + t of the second frame, mm, for a point x of the first.
    pub fn apply(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation
    }

    /// The inverse motion: `target_from_camera` of `camera_from_target`.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// The composition of this motion after `first`: `a_from_c` of `a_from_b` and `b_from_c`.
    ///
    /// ```
    /// use deltille_core::camera::Pose;
    /// use glam::DVec3;
    ///
    /// let camera_from_target = Pose::looking_at(DVec3::new(0.0, 0.0, 500.0), DVec3::ZERO, DVec3::Y);
    /// let target_from_camera = camera_from_target.inverse();
    /// let [turn, step] = target_from_camera.after(&camera_from_target).off(&Pose::IDENTITY);
    /// assert!(turn.length() < 1e-12 && step.length() < 1e-9);
    /// assert_eq!(camera_from_target.apply(DVec3::ZERO).z, 500.0);
    /// ```
    pub fn after(&self, first: &Pose) -> Self {
        Self {
            rotation: self.rotation * first.rotation,
            translation: self.rotation * first.translation + self.translation,
        }
    }

    /// How far this pose is from another between the same frames: the turn exp(ω) after the other's
    /// rotation, rad, at most half a turn, and the move τ, mm.
    pub fn off(&self, other: &Pose) -> [DVec3; 2] {
        let turn = self.rotation * other.rotation.conjugate();
        // A quaternion and its negative are the same turn; one of them goes the long way round.
        let turn = if turn.w < 0.0 { -turn } else { turn };
        [turn.to_scaled_axis(), self.translation - other.translation]
    }

    /// [`Self::looking_at`] with what is usually up: z, or y where the camera looks along z. `None` where `up` is
    /// parallel to the line of sight, or there is none.
    pub fn viewing(eye: DVec3, centre: DVec3, up: Option<DVec3>) -> Option<Self> {
        let sight = (centre - eye).normalize_or_zero();
        let upright = if sight.cross(DVec3::Z).length() < 1e-6 { DVec3::Y } else { DVec3::Z };
        let up = up.unwrap_or(upright);
        let is_clear = sight.cross(up).length() >= 1e-9;
        is_clear.then(|| Self::looking_at(eye, centre, up))
    }

    /// The camera_from_target pose of a camera that stands at `eye`, looks at `centre`, and has
    /// `up` upwards in its image; `up` must not be parallel to the line of sight.
    pub fn looking_at(eye: DVec3, centre: DVec3, up: DVec3) -> Self {
        let forward = (centre - eye).normalize();
        let right = forward.cross(up).normalize();
        let down = forward.cross(right);
        let rotation = DQuat::from_mat3(&DMat3::from_cols(right, down, forward).transpose());
        Self { rotation, translation: -(rotation * eye) }
    }
}

/// How far the rotation of a pose may be from orthonormal: what six written digits leave.
const ROTATION_SLACK: f64 = 1e-5;

/// Whether a matrix, row by row, is a rotation: orthonormal and not a mirror image, up to what written digits leave.
pub fn is_rotation(rows: &[f64; 9]) -> bool {
    let matrix = DMat3::from_cols_array(rows);
    let off = matrix * matrix.transpose() - DMat3::IDENTITY;
    let most = off.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
    most <= ROTATION_SLACK && matrix.determinant() >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_sees_what_it_looks_at_in_the_middle_and_up_is_up() {
        let eye = DVec3::new(100.0, -50.0, 400.0);
        let centre = DVec3::new(30.0, 20.0, 0.0);
        let pose = Pose::looking_at(eye, centre, DVec3::Y);
        let seen = pose.apply(centre);
        assert!(seen.x.abs() < 1e-9 && seen.y.abs() < 1e-9 && seen.z > 0.0);
        assert!(pose.apply(centre + DVec3::Y).y < 0.0, "y is down in the camera");
        assert!(pose.apply(centre + DVec3::X).x > 0.0);
        let back = pose.inverse().after(&pose);
        assert!((back.apply(centre) - centre).length() < 1e-9);
        let twice = Pose { rotation: -pose.rotation, ..pose };
        assert!(twice.off(&pose)[0].length() < 1e-9, "one turn in two ways");
        assert!((pose.inverse().apply(DVec3::ZERO) - eye).length() < 1e-9);
    }
}
