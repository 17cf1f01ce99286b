//! The pixels that a corner is fitted to.

use glam::DVec2;

use crate::lanes::LANES;
use deltille_core::raster::ImageView;

/// Largest radius of a window, px.
pub(crate) const MAX_RADIUS: usize = 15;

/// Pixels of the largest window, rounded up to whole vectors.
pub(super) const MAX_PIXELS: usize =
    ((2 * MAX_RADIUS + 1) * (2 * MAX_RADIUS + 1)).next_multiple_of(LANES);

/// Pixels around a corner, by their distance from the pixel in the middle.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    pub(super) radius: usize,
    pub(super) count: usize,
    /// Columns, padded with zeros to whole vectors.
    pub(super) u: Vec<f32>,
    /// Rows alike.
    pub(super) v: Vec<f32>,
    /// Pixels beside each other: the first, and how many.
    pub(super) runs: Vec<([i32; 2], usize)>,
}

impl Window {
    /// The window of (2 · radius + 1)² pixels; radii above [`MAX_RADIUS`] are cut to it.
    pub(crate) fn new(radius: usize) -> Self {
        Self::of(radius, |_| true)
    }

    /// Those pixels (u, v) of such a window that are `seen`.
    pub(crate) fn of(radius: usize, seen: impl Fn(DVec2) -> bool) -> Self {
        Self::within(radius, |_| [f64::NEG_INFINITY, f64::INFINITY], seen)
    }

    /// Those of each row v that lie in its `span` and are `seen`.
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

    /// Half the side, px.
    pub(crate) fn radius(&self) -> usize {
        self.radius
    }

    /// How many pixels.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Columns and rows of the pixels.
    pub(crate) fn places(&self) -> [&[f32]; 2] {
        [&self.u[..self.count], &self.v[..self.count]]
    }

    /// Takes the pixels around `centre`, full scale 1; `None` where one lies outside the image.
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

/// The pixels of a window about a pixel of a picture.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    /// The window.
    pub window: Window,
    /// The pixel in its middle.
    pub centre: DVec2,
}
