//! Borrowed images.

use super::Intensity;

/// A region of memory viewed as a grey image, row-major: rows of `width` pixels that start `stride`
/// pixels apart.
#[derive(Clone, Copy, Debug)]
pub struct View<'a, T> {
    width: usize,
    height: usize,
    stride: usize,
    pixels: &'a [T],
}

impl<'a, T: Intensity> View<'a, T> {
    /// Creates a view of `height` rows of `width` pixels that start `stride` pixels apart. Returns `None` if there
    /// are too few pixels or rows overlap.
    pub fn new(width: usize, height: usize, stride: usize, pixels: &'a [T]) -> Option<Self> {
        let before = height.saturating_sub(1).checked_mul(stride)?;
        let needed = if height == 0 { 0 } else { before.checked_add(width)? };
        let fits = stride >= width && pixels.len() >= needed;
        fits.then_some(Self { width, height, stride, pixels })
    }

    /// Creates a view of an image with all pixels and no gap between the rows.
    #[inline]
    pub(super) fn of(width: usize, height: usize, pixels: &'a [T]) -> Self {
        debug_assert_eq!(pixels.len(), width * height);
        Self { width, height, stride: width, pixels }
    }

    /// Returns the width in pixels.
    #[inline]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the height in pixels.
    #[inline]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns one row.
    #[inline]
    pub fn row(&self, y: usize) -> &'a [T] {
        &self.pixels[y * self.stride..y * self.stride + self.width]
    }

    /// Returns the pixel at (x, y), which must lie in the image.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> T {
        self.pixels[y * self.stride + x]
    }

    /// Interpolates bilinearly at (x, y); positions outside get the nearest border value.
    ///
    /// An empty image gives 0.
    #[inline]
    pub fn bilinear(&self, x: f64, y: f64) -> f32 {
        let inside =
            x >= 0.0 && y >= 0.0 && x + 1.0 < self.width as f64 && y + 1.0 < self.height as f64;
        if inside {
            let (left, top) = (x as i32, y as i32);
            let (fx, fy) = ((x - f64::from(left)) as f32, (y - f64::from(top)) as f32);
            let first = top as usize * self.stride + left as usize;
            let blended = |pair: &[T]| pair[0].to_f32() * (1.0 - fx) + pair[1].to_f32() * fx;
            let upper = blended(&self.pixels[first..first + 2]);
            let lower = blended(&self.pixels[first + self.stride..first + self.stride + 2]);
            return upper * (1.0 - fy) + lower * fy;
        }
        if self.width == 0 || self.height == 0 {
            return 0.0;
        }
        let x = x.clamp(0.0, (self.width - 1) as f64);
        let y = y.clamp(0.0, (self.height - 1) as f64);
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(self.width - 1), (y0 + 1).min(self.height - 1));
        let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
        let upper = self.at(x0, y0).to_f32() * (1.0 - fx) + self.at(x1, y0).to_f32() * fx;
        let lower = self.at(x0, y1).to_f32() * (1.0 - fx) + self.at(x1, y1).to_f32() * fx;
        upper * (1.0 - fy) + lower * fy
    }

    /// [`Self::bilinear`] for a position known to lie in the image, excluding its last row and column.
    #[inline(always)]
    pub fn bilinear_inside(&self, x: f64, y: f64) -> f64 {
        // Processors convert signed numbers directly, unlike unsigned ones.
        let (left, top) = (x as i32, y as i32);
        let (fx, fy) = ((x - f64::from(left)) as f32, (y - f64::from(top)) as f32);
        let first = top as usize * self.stride + left as usize;
        let upper = &self.pixels[first..first + 2];
        let lower = &self.pixels[first + self.stride..first + self.stride + 2];
        let across = |pair: &[T]| {
            let (a, b) = (pair[0].to_f32(), pair[1].to_f32());
            a + fx * (b - a)
        };
        let (upper, lower) = (across(upper), across(lower));
        f64::from(upper + fy * (lower - upper))
    }
}
