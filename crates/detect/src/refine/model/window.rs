//! The pixels that a corner is fitted to.

use glam::DVec2;

use crate::lanes::LANES;
use crate::refine::pattern::BLOCK;
use deltille_core::raster::ImageView;

/// Largest radius of a window, px.
pub(crate) const MAX_RADIUS: usize = 15;

/// Number of pixels of the largest window, rounded up to whole blocks.
pub(super) const MAX_PIXELS: usize =
    ((2 * MAX_RADIUS + 1) * (2 * MAX_RADIUS + 1)).next_multiple_of(BLOCK);

/// The corners of the border of a tag in a tile beside the corner, px from the corner, the nearest first. Its colour is
/// opposite to that of the tile.
pub(crate) type Border = [DVec2; 4];

/// Returns whether a displacement from the apex lies in the quadrant that two sides of a border span there.
fn is_beyond([first, second, _, last]: &Border, off: DVec2) -> bool {
    let (along, beside) = (*second - *first, *last - *first);
    let turn = along.perp_dot(beside).signum();
    turn * along.perp_dot(off) > 0.0 && turn * off.perp_dot(beside) > 0.0
}

/// Pixels around a corner, relative to the centre pixel.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    pub(super) radius: usize,
    pub(super) count: usize,
    /// Columns, padded with zeros to whole vectors.
    pub(super) u: Vec<f32>,
    /// Rows, likewise.
    pub(super) v: Vec<f32>,
    /// Runs of adjacent pixels: the first, and their number.
    pub(super) runs: Vec<([i32; 2], usize)>,
    /// Borders of tags that are visible.
    pub(super) borders: Vec<Border>,
}

impl Window {
    /// Creates the window of (2 · radius + 1)² pixels; radii above [`MAX_RADIUS`] are limited to it.
    pub(crate) fn new(radius: usize) -> Self {
        Self::of(radius, |_| true)
    }

    /// Creates a window of those pixels (u, v) that are `seen`.
    pub(crate) fn of(radius: usize, seen: impl Fn(DVec2) -> bool) -> Self {
        Self::within(radius, |_| [f64::NEG_INFINITY, f64::INFINITY], seen)
    }

    /// Creates a window of those pixels of each row v that lie in its `span` and are `seen`.
    pub(crate) fn within(
        radius: usize,
        span: impl Fn(f64) -> [f64; 2],
        seen: impl Fn(DVec2) -> bool,
    ) -> Self {
        let radius = radius.min(MAX_RADIUS);
        let reach = radius as i32;
        let room = (2 * radius + 1).pow(2).next_multiple_of(LANES);
        let mut window = Self {
            radius,
            count: 0,
            u: Vec::with_capacity(room),
            v: Vec::with_capacity(room),
            runs: Vec::with_capacity(2 * radius + 1),
            borders: Vec::new(),
        };
        for v in -reach..=reach {
            let [first, last] = span(f64::from(v));
            let first = first.max(f64::from(-reach)).ceil() as i32;
            let last = last.min(f64::from(reach)).floor() as i32;
            let mut before = None;
            for u in (first..=last).filter(|&u| seen(DVec2::new(u.into(), v.into()))) {
                match window.runs.last_mut() {
                    Some((_, length)) if before == Some(u - 1) => *length += 1,
                    _ => window.runs.push(([u, v], 1)),
                }
                before = Some(u);
                window.u.push(u as f32);
                window.v.push(v as f32);
            }
        }
        window.count = window.u.len();
        window.u.resize(window.count.next_multiple_of(LANES), 0.0);
        window.v.resize(window.count.next_multiple_of(LANES), 0.0);
        window
    }

    /// Returns half the side, px.
    pub(crate) fn radius(&self) -> usize {
        self.radius
    }

    /// Returns the number of pixels.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Returns columns and rows of the pixels.
    pub(crate) fn places(&self) -> [&[f32]; 2] {
        [&self.u[..self.count], &self.v[..self.count]]
    }

    /// Returns the window with these borders of tags.
    pub(crate) fn with_borders(self, borders: &[Border]) -> Self {
        Self { borders: borders.to_vec(), ..self }
    }

    /// Returns the number of pixels in the tile of a border, for a corner at this offset from the centre pixel.
    pub(crate) fn count_beside(&self, border: &Border, offset: DVec2) -> usize {
        let [us, vs] = self.places();
        let places = us.iter().zip(vs).map(|(&u, &v)| DVec2::new(u.into(), v.into()));
        places.filter(|&place| is_beyond(border, place - offset)).count()
    }

    /// Returns the columns, rows and values of the pixels that show no border of a tag, for a corner at this offset from
    /// the centre pixel. Returns `None` if no border is visible.
    pub(crate) fn off_borders(&self, pixels: &[f32], offset: DVec2) -> Option<[Vec<f32>; 3]> {
        if self.borders.is_empty() {
            return None;
        }
        let mut off: [Vec<f32>; 3] = Default::default();
        for ((&u, &v), &pixel) in self.u.iter().zip(&self.v).zip(pixels) {
            let place = DVec2::new(u.into(), v.into()) - offset;
            if !self.borders.iter().any(|border| is_beyond(border, place - border[0])) {
                off.iter_mut().zip([u, v, pixel]).for_each(|(values, value)| values.push(value));
            }
        }
        Some(off)
    }

    /// Reads the pixels around `centre`; full scale is 1. Returns `None` if one lies outside the
    /// image.
    pub(super) fn read(
        &self,
        image: ImageView,
        centre: DVec2,
        pixels: &mut [f32; MAX_PIXELS],
    ) -> Option<()> {
        let [x, y] = centre.as_ivec2().to_array();
        let mut rest = &mut pixels[..];
        for &([u, v], length) in &self.runs {
            let (first, row) = (usize::try_from(x + u).ok()?, usize::try_from(y + v).ok()?);
            let (run, after) = rest.split_at_mut(length);
            image.read_row(first, row, run)?;
            rest = after;
        }
        Some(())
    }
}

/// The pixels of a window about a pixel of an image.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    /// The window.
    pub window: Window,
    /// The pixel at its centre.
    pub centre: DVec2,
}
