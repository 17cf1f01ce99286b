//! The sentence that describes a proposed view.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use std::fmt;

use super::guide::NextView;

/// Names of the parts of an image and of the sides of a board, in eight directions from right clockwise.
const PARTS: [&str; 8] = [
    "at the right edge",
    "in the lower right corner",
    "at the lower edge",
    "in the lower left corner",
    "at the left edge",
    "in the upper left corner",
    "at the upper edge",
    "in the upper right corner",
];
const SIDES: [&str; 8] = [
    "right side",
    "lower right corner",
    "lower side",
    "lower left corner",
    "left side",
    "upper left corner",
    "upper side",
    "upper right corner",
];

/// Largest offset from the image centre that counts as the middle, as a fraction of the image sides.
const MIDDLE: f64 = 0.09;

/// Smallest tilt or roll that is mentioned, rad (8°): people do not hold a board more accurately.
const MENTIONED: f64 = 0.14;

/// Index of the nearest of the eight directions.
fn direction(angle: f64) -> usize {
    ((angle / FRAC_PI_4).round() as i64).rem_euclid(8) as usize
}

impl fmt::Display for NextView {
    /// Writes the instruction for a person. Left and right are those of the image, which is not mirrored.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let off = self.at - 0.5;
        let [aside, up] = [off.x.abs() > MIDDLE, off.y.abs() > MIDDLE];
        let place = match (aside, up) {
            (false, false) => "in the middle",
            (true, false) => PARTS[if off.x > 0.0 { 0 } else { 4 }],
            (false, true) => PARTS[if off.y > 0.0 { 2 } else { 6 }],
            (true, true) => {
                let right = if off.x > 0.0 { 1 } else { 3 };
                PARTS[if off.y > 0.0 { right } else { 8 - right }]
            }
        };
        write!(f, "hold the board {place} of the image, about {} away, ", far(self.distance_mm))?;
        match self.tilt_rad < MENTIONED {
            true => write!(f, "facing the camera")?,
            false => write!(
                f,
                "with its {} tilted away by {:.0}°",
                SIDES[direction(self.tilt_direction_rad)],
                round_to_5(self.tilt_rad.to_degrees())
            )?,
        }
        // An upside-down sheet also has level rows, but shows other corners at these positions.
        let roll = self.roll_rad.rem_euclid(TAU);
        let roll = if roll > 2.0 * FRAC_PI_2 { roll - TAU } else { roll };
        match roll {
            _ if roll.abs() < MENTIONED => Ok(()),
            _ if roll.abs() > 2.0 * FRAC_PI_2 - MENTIONED => write!(f, ", upside down"),
            _ => write!(
                f,
                ", rotated {} by {:.0}°",
                if roll > 0.0 { "counterclockwise" } else { "clockwise" },
                round_to_5(roll.abs().to_degrees())
            ),
        }
    }
}

fn round_to_5(degrees: f64) -> f64 {
    5.0 * (degrees / 5.0).round()
}

/// Formats a distance, rounded to the accuracy with which a person can estimate it.
fn far(mm: f64) -> String {
    match mm {
        ..950.0 => format!("{:.0} cm", (mm / 50.0).round().max(1.0) * 5.0),
        950.0..10_000.0 => format!("{:.1} m", mm / 1000.0),
        _ => format!("{:.0} m", mm / 1000.0),
    }
}
