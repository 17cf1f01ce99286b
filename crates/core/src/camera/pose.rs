use glam::{DMat3, DQuat, DVec3};

/// A rigid motion `y = R·x + t` between two frames, named after both, for example `camera_from_target`. Translations
/// are in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The rotation R, a unit quaternion.
    pub rotation: DQuat,
    /// The translation t, mm.
    pub translation: DVec3,
}

impl Pose {
    /// The identity motion.
    pub const IDENTITY: Pose = Pose { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };

    /// Maps a point x of the first frame to R·x + t in the second frame, mm.
    #[inline]
    pub fn apply(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation
    }

    /// Returns the inverse motion, for example `target_from_camera` for `camera_from_target`.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// Returns the composition of this motion after `first`, for example `a_from_c` for `a_from_b` and `b_from_c`.
    ///
    /// ```
    /// use deltille_core::camera::Pose;
    /// use glam::DVec3;
    ///
    /// let camera_from_target = Pose::looking_at(DVec3::new(0.0, 0.0, 500.0), DVec3::ZERO, DVec3::Y);
    /// let target_from_camera = camera_from_target.inverse();
    /// let [rotation, shift] = target_from_camera.after(&camera_from_target).off(&Pose::IDENTITY);
    /// assert!(rotation.length() < 1e-12 && shift.length() < 1e-9);
    /// assert_eq!(camera_from_target.apply(DVec3::ZERO).z, 500.0);
    /// ```
    pub fn after(&self, first: &Pose) -> Self {
        Self {
            rotation: self.rotation * first.rotation,
            translation: self.rotation * first.translation + self.translation,
        }
    }

    /// Returns the difference ω, τ from another pose between the same frames. Rotating by exp(ω)
    /// after the other's rotation gives this rotation; ω is in rad and at most 180° long. τ is the
    /// difference of the translations, mm.
    pub fn off(&self, other: &Pose) -> [DVec3; 2] {
        let turn = self.rotation * other.rotation.conjugate();
        // A quaternion and its negative are the same rotation; one of them represents an angle above 180°.
        let turn = if turn.w < 0.0 { -turn } else { turn };
        [turn.to_scaled_axis(), self.translation - other.translation]
    }

    /// Like [`Self::looking_at`], with a default for up: z, or y if the camera looks along z. Returns `None` if `up`
    /// is parallel to the line of sight, or `eye` and `centre` coincide.
    pub fn viewing(eye: DVec3, centre: DVec3, up: Option<DVec3>) -> Option<Self> {
        let sight = (centre - eye).normalize_or_zero();
        let upright = if sight.cross(DVec3::Z).length() < 1e-6 { DVec3::Y } else { DVec3::Z };
        let up = up.unwrap_or(upright);
        let is_clear = sight.cross(up).length() >= 1e-9;
        is_clear.then(|| Self::looking_at(eye, centre, up))
    }

    /// Returns the pose camera_from_target of a camera at `eye` that looks at `centre`, with `up` upwards in its
    /// image. `up` must not be parallel to the line of sight.
    pub fn looking_at(eye: DVec3, centre: DVec3, up: DVec3) -> Self {
        let forward = (centre - eye).normalize();
        let right = forward.cross(up).normalize();
        let down = forward.cross(right);
        let rotation = DQuat::from_mat3(&DMat3::from_cols(right, down, forward).transpose());
        Self { rotation, translation: -(rotation * eye) }
    }
}

/// Tolerance for the orthonormality of a rotation: the rounding error of numbers with six digits.
const ROTATION_SLACK: f64 = 1e-5;

/// Returns whether a row-major matrix is a rotation: orthonormal and not a reflection, up to the
/// rounding of numbers in files.
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
    fn looking_at_centres_the_point_and_keeps_up() {
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
        assert!(twice.off(&pose)[0].length() < 1e-9, "one rotation in two forms");
        assert!((pose.inverse().apply(DVec3::ZERO) - eye).length() < 1e-9);
    }
}
