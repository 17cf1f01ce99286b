//! A view that is proposed, in a sentence.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use std::fmt;

use super::guide::NextView;

/// Names of the eight directions of an image, from right towards below: what is there, and a side of the board.
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

/// Within so much of the middle, in parts of the image's sides, a board is in the middle.
const MIDDLE: f64 = 0.09;

/// Tilts and turns below this are not told, rad (8°): nobody holds a board better.
const TOLD: f64 = 0.14;

/// Which of eight directions an angle is.
fn direction(angle: f64) -> usize {
    ((angle / FRAC_PI_4).round() as i64).rem_euclid(8) as usize
}

impl fmt::Display for NextView {
    /// What a person is to do. Left and right are those of the picture, which is not mirrored.
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
        write!(f, "hold the board {place} of the picture, about {} away, ", far(self.distance_mm))?;
        match self.tilt_rad < TOLD {
            true => write!(f, "facing the camera")?,
            false => write!(
                f,
                "its {} tilted away by {:.0}°",
                SIDES[direction(self.away_rad)],
                round_to_5(self.tilt_rad.to_degrees())
            )?,
        }
        // A sheet that is upside down has its rows level, but other corners where others were.
        let roll = self.roll_rad.rem_euclid(TAU);
        let roll = if roll > 2.0 * FRAC_PI_2 { roll - TAU } else { roll };
        match roll {
            _ if roll.abs() < TOLD => Ok(()),
            _ if roll.abs() > 2.0 * FRAC_PI_2 - TOLD => write!(f, ", upside down"),
            _ => write!(
                f,
                ", turned {} by {:.0}°",
                if roll > 0.0 { "counterclockwise" } else { "clockwise" },
                round_to_5(roll.abs().to_degrees())
            ),
        }
    }
}

fn round_to_5(degrees: f64) -> f64 {
    5.0 * (degrees / 5.0).round()
}

/// A distance as a person judges it.
fn far(mm: f64) -> String {
    match mm {
        ..950.0 => format!("{:.0} cm", (mm / 50.0).round().max(1.0) * 5.0),
        950.0..10_000.0 => format!("{:.1} m", mm / 1000.0),
        _ => format!("{:.0} m", mm / 1000.0),
    }
}
