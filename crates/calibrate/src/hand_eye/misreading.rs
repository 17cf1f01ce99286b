//! What poses may mean instead of what was stated, in words.

use std::fmt;

use crate::input::robot::Mounting;

/// What poses may mean instead of what was stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Misreading {
    /// They are the inverse; equally, camera and board may be mounted the other way round.
    Inverted,
    /// The scalar part of quaternions is at the other end.
    QuaternionOrder,
    /// Angles are in degrees, not radians.
    Degrees,
    /// Angles are in radians, not degrees.
    Radians,
    /// Angles are rotations about moving axes x, y and z, not fixed ones.
    AngleOrder,
    /// Matrices are transposed.
    Transposed,
    /// Translations are in metres, not millimetres.
    Metres,
    /// Translations are in millimetres, not metres.
    Millimetres,
    /// Translations are in centimetres.
    Centimetres,
    /// Translations are in inches.
    Inches,
    /// This axis of the translations has the opposite sign.
    Mirrored(char),
}

impl fmt::Display for Misreading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.look())
    }
}

impl Misreading {
    /// How the poses look.
    pub(super) fn look(self) -> String {
        let look = match self {
            Self::Inverted => "inverted",
            Self::QuaternionOrder => "as if w was at the wrong end of the quaternions",
            Self::Degrees => "as if the angles were in degrees",
            Self::Radians => "as if the angles were in radians",
            Self::AngleOrder => "as if the angles were rotations about moving axes x, y, z",
            Self::Transposed => "as if the rotation matrices were transposed",
            Self::Metres => "as if the translations were in metres",
            Self::Millimetres => "as if the translations were in millimetres",
            Self::Centimetres => "as if the translations were in centimetres",
            Self::Inches => "as if the translations were in inches",
            Self::Mirrored(axis) => {
                return format!("as if {axis} of the translations had the opposite sign");
            }
        };
        look.to_owned()
    }

    /// What to change.
    pub(super) fn remedy(self, mounting: Mounting, are_inverse: bool) -> String {
        match self {
            Self::Inverted => {
                let other = match mounting {
                    Mounting::EyeInHand => "the board is on the flange (eye-to-hand)",
                    Mounting::EyeToHand => "the camera is on the flange (eye-in-hand)",
                };
                let own = if are_inverse { "base_from_flange" } else { "flange_from_base" };
                format!("change --inverse-poses if they are {own}, or --eye-to-hand if {other}")
            }
            Self::QuaternionOrder => {
                "write quaternions in the order of their names, x y z w".to_owned()
            }
            Self::Degrees => "name the columns _deg".to_owned(),
            Self::Radians => "name the columns _rad".to_owned(),
            Self::AngleOrder => "convert them to quaternions or rotation vectors".to_owned(),
            Self::Transposed => "write matrices by rows".to_owned(),
            Self::Metres => "name the columns _m, or multiply them by 1000".to_owned(),
            Self::Millimetres => "name the columns _mm, or divide them by 1000".to_owned(),
            Self::Centimetres | Self::Inches => "convert them to millimetres".to_owned(),
            Self::Mirrored(_) => "use right-handed axes for translations and rotations".to_owned(),
        }
    }
}
