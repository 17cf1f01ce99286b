//! A logo: a black outline in the margin of each sheet that identifies a target and its owner.
//!
//! ```text
//!   ├──────────── 230 mm ───────────┤   ▲▲    The logo lies at the end of the strip in which the label begins. It shortens
//!   name · 10 × 11 corners · …         ▲▲▲▲   the check bar of that strip; the board does not move.
//! ```

use std::fmt;

use glam::DVec2;
use kurbo::{BezPath, PathEl, Point};
use serde::{Deserialize, Serialize};

use deltille_core::setting::Setting::PaperLogo;
use deltille_core::targets::TargetError;
use deltille_core::{polygon, quantity};

/// Height of a logo in outline units: for a logo 12 mm high, one unit is 1.2 µm.
const UNITS: i32 = 10_000;

/// Maximum length of the outline data, bytes: some 6,000 corners, more than a printer resolves on a few square
/// centimetres. Every target file contains the outline.
pub const MAX_LOGO_BYTES: usize = 65_536;

/// Maximum ratio of width to height, and of height to width.
const MAX_RATIO: f64 = 30.0;

/// Minimum width of an outline, mm; narrower ones are omitted. Some viewers draw a mark this thin one pixel wide,
/// others not at all.
pub(super) const SLIVER_MM: f64 = 0.02;

/// Black outline of a logo, in whole units of a ten-thousandth of its height.
///
/// In files, it is SVG path data of straight lines, x right, y down, whose ink begins at 0 0. Fill it by the even-odd
/// rule.
///
/// ```
/// use deltille_layout::Logo;
/// use glam::DVec2;
///
/// let triangle = [(0.0, 7.0), (4.0, 0.0), (8.0, 7.0)].map(DVec2::from).to_vec();
/// let logo = Logo::from_outlines(&[triangle])?;
/// assert_eq!(logo.to_string(), "M0 10000L5714 0L11429 10000Z");
/// # Ok::<(), deltille_core::targets::TargetError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Logo {
    rings: Vec<Vec<[i32; 2]>>,
    width: i32,
}

impl Logo {
    /// Builds a logo from closed outlines in any unit, x right, y down. Outlines must not cross. Holes run in the
    /// opposite direction to outer outlines.
    ///
    /// # Errors
    /// Returns an error if no area remains, if the aspect ratio is too extreme, or if the outline has too many corners.
    pub fn from_outlines(outlines: &[Vec<DVec2>]) -> Result<Self, TargetError> {
        let points = || outlines.iter().flatten().copied();
        let end = |of: fn(DVec2, DVec2) -> DVec2| points().reduce(of).unwrap_or_default();
        let (least, size) = (end(DVec2::min), end(DVec2::max) - end(DVec2::min));
        if !(size.x > 0.0 && size.y > 0.0 && size.is_finite()) {
            return refused("the logo has no black area");
        }
        if size.x > MAX_RATIO * size.y || size.y > MAX_RATIO * size.x {
            let [x, y] = [size.x, size.y].map(|side| side / size.min_element());
            return refused(format!(
                "the aspect ratio is {x:.0} to {y:.0}: use a logo whose longer side is at most {MAX_RATIO} times \
                 the shorter"
            ));
        }
        let scale = f64::from(UNITS) / size.y;
        let ring = |outline: &Vec<DVec2>| {
            let whole = outline.iter().map(|&point| {
                let place = ((point - least) * scale).round();
                [place.x as i32, place.y as i32]
            });
            let mut ring: Vec<[i32; 2]> = whole.collect();
            ring.dedup();
            if ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            ring
        };
        let rings: Vec<_> = outlines.iter().map(ring).filter(|ring| ring.len() > 2).collect();
        let logo = Self::new(rings).or_else(refused)?;
        if logo.to_string().len() > MAX_LOGO_BYTES {
            return refused(format!(
                "the outline has {} vertices, but a target file can hold only about 6,000: \
                 simplify the paths",
                logo.rings.iter().map(Vec::len).sum::<usize>()
            ));
        }
        Ok(logo)
    }

    fn new(rings: Vec<Vec<[i32; 2]>>) -> Result<Self, String> {
        let end = |axis: usize| {
            let values = || rings.iter().flatten().map(move |point| point[axis]);
            [values().min().unwrap_or_default(), values().max().unwrap_or_default()]
        };
        let ([left, right], [upper, lower]) = (end(0), end(1));
        if rings.iter().any(|ring| ring.len() < 3) {
            return Err("an outline has fewer than three corners".to_owned());
        }
        if [left, upper, lower] != [0, 0, UNITS] {
            return Err(format!("the outlines must begin at x = 0, y = 0 and be {UNITS} high"));
        }
        let ratio = f64::from(right) / f64::from(UNITS);
        // Coordinates are rounded, so the ratio may exceed the limit slightly.
        if !(0.99 / MAX_RATIO..=1.01 * MAX_RATIO).contains(&ratio) {
            return Err(format!("its longer side is more than {MAX_RATIO} times the shorter"));
        }
        Ok(Self { rings, width: right })
    }

    /// Returns the width, in heights.
    pub fn width(&self) -> f64 {
        f64::from(self.width) / f64::from(UNITS)
    }

    /// Returns the closed outlines at their position on the page, mm, without those narrower than 0.02 mm.
    pub fn outlines_mm(&self, place: &LogoPlacement) -> Vec<Vec<DVec2>> {
        let turn = DVec2::from_angle(place.angle_rad);
        let unit = place.height_mm / f64::from(UNITS);
        let at = |&[x, y]: &[i32; 2]| {
            let (x, y) = (f64::from(x), f64::from(UNITS - y));
            place.at_mm + turn.rotate(unit * DVec2::new(x, y))
        };
        let outlines = self.rings.iter().map(|ring| ring.iter().map(at).collect());
        outlines.filter(|outline: &Vec<DVec2>| width(outline) >= SLIVER_MM).collect()
    }
}

/// Returns twice the area of a closed outline divided by its perimeter: the width of a long shape.
fn width(outline: &[DVec2]) -> f64 {
    let next = outline.iter().cycle().skip(1);
    let length: f64 = outline.iter().zip(next).map(|(a, b)| a.distance(*b)).sum();
    2.0 * polygon::area(outline).abs() / length.max(f64::MIN_POSITIVE)
}

pub(super) fn refused<T>(problem: impl Into<String>) -> Result<T, TargetError> {
    Err(TargetError::invalid(PaperLogo, problem.into()))
}

impl fmt::Display for Logo {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for ring in &self.rings {
            for (index, [x, y]) in ring.iter().enumerate() {
                write!(f, "{}{x} {y}", if index == 0 { 'M' } else { 'L' })?;
            }
            f.write_str("Z")?;
        }
        Ok(())
    }
}

impl From<Logo> for String {
    fn from(logo: Logo) -> Self {
        logo.to_string()
    }
}

impl TryFrom<String> for Logo {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        if text.len() > MAX_LOGO_BYTES {
            return Err(format!("it is longer than {MAX_LOGO_BYTES} characters"));
        }
        let path = BezPath::from_svg(&text).map_err(|_| "it is not valid SVG path data")?;
        let whole = |Point { x, y }: Point| {
            let is_whole = [x, y]
                .iter()
                .all(|value| (0.0..=f64::from(i32::MAX)).contains(value) && value.fract() == 0.0);
            is_whole
                .then_some([x as i32, y as i32])
                .ok_or("its coordinates must be non-negative whole numbers")
        };
        let mut rings: Vec<Vec<[i32; 2]>> = Vec::new();
        for element in path.elements() {
            match (*element, rings.last_mut()) {
                (PathEl::MoveTo(to), _) => rings.push(vec![whole(to)?]),
                (PathEl::LineTo(to), Some(ring)) => ring.push(whole(to)?),
                (PathEl::ClosePath, _) => {}
                _ => return Err("it must consist of straight lines only".to_owned()),
            }
        }
        Self::new(rings)
    }
}

/// Position of a logo on a page.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogoPlacement {
    /// Lower-left corner on the page, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub at_mm: DVec2,
    /// Counter-clockwise rotation about that corner, radians.
    #[serde(deserialize_with = "quantity::angle_rad::de")]
    pub angle_rad: f64,
    /// Height, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub height_mm: f64,
}
