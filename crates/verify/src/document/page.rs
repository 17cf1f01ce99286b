//! A page as an image, in millimetres.

use glam::DVec2;

use deltille_core::raster::Gray;

/// Maximum deviation of the ink of an area from 0 or 1 on a rendered page: the effect of rounding
/// to 255 grey values.
pub(crate) const MAX_INK_ERROR: f64 = 0.01;

/// Tolerance of ink near an edge, where the edge is smeared.
const SMEARED_INK_ERROR: f64 = 0.3;

/// One page as an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Page width as stated in the file, mm.
    pub width_mm: f64,
    /// Page height as stated in the file, mm.
    pub height_mm: f64,
    /// Resolution, px/mm; the upper left corners of image and page coincide.
    pub px_per_mm: f64,
    /// The image.
    pub image: Gray<u8>,
    /// Additional edge width beyond the crossed pixel, px, on a page resampled from others.
    pub smear_px: f64,
    /// Size of a pixel of the displayed texture, px; 0 without a texture.
    pub texel_px: f64,
    /// Distance of the left page edge from the left image edge, px: a fraction of a pixel on a mirrored page, whose
    /// image started at the other edge.
    pub left_px: f64,
}

impl Page {
    /// Returns the maximum deviation of ink from 0 or 1 beside an edge.
    pub fn max_ink_error_at_edges(&self) -> f64 {
        if self.smear_px > 0.0 { SMEARED_INK_ERROR } else { MAX_INK_ERROR }
    }
}

impl Page {
    /// Returns the pixel position of a point of the page frame (mm, y up).
    pub fn px_from_page(&self, place: DVec2) -> DVec2 {
        let from_top = DVec2::new(place.x, self.height_mm - place.y) * self.px_per_mm;
        from_top + DVec2::new(self.left_px, 0.0) - 0.5
    }

    /// Returns the point of the page frame (mm, y up) at a pixel position.
    pub fn page_from_px(&self, pixel: DVec2) -> DVec2 {
        let from_top = (pixel + 0.5 - DVec2::new(self.left_px, 0.0)) / self.px_per_mm;
        DVec2::new(from_top.x, self.height_mm - from_top.y)
    }

    /// Returns the page with a blur like that of a lens: each pixel averaged with its neighbours,
    /// weighted 1 2 1 along both axes, in 16 bits. This is a blur with a standard deviation of 0.71
    /// px.
    ///
    /// Corners are located with a model of blurred edges. A single grey value determines the position of a sharp edge
    /// along the pixels, and the model would then be off by up to a quarter of a pixel.
    pub fn blurred(&self) -> Gray<u16> {
        let (width, height) = (self.image.width(), self.image.height());
        let mut blurred = Gray::new(width, height);
        // Sums over columns, and the first and the last once more beyond the borders.
        let mut sums = vec![0; width + 2];
        for y in 0..height {
            let row = |y: usize| self.image.row(y).iter().map(|&v| u32::from(v));
            let beside = row(y.saturating_sub(1)).zip(row((y + 1).min(height - 1)));
            for ((sum, here), (above, below)) in sums[1..].iter_mut().zip(row(y)).zip(beside) {
                *sum = above + 2 * here + below;
            }
            (sums[0], sums[width + 1]) = (sums[1], sums[width]);
            for (pixel, near) in blurred.row_mut(y).iter_mut().zip(sums.windows(3)) {
                // The weights of the sixteen samples sum to 16; full scale is 257 · 255.
                *pixel = ((near[0] + 2 * near[1] + near[2]) * 257 / 16) as u16;
            }
        }
        blurred
    }

    /// Returns the mirror image of the page, with left and right swapped.
    pub fn mirrored(&self) -> Self {
        let mut page = self.clone();
        let width = page.image.width();
        page.image.pixels_mut().chunks_exact_mut(width).for_each(<[u8]>::reverse);
        page.left_px = width as f64 - page.width_mm * page.px_per_mm - page.left_px;
        page
    }

    /// Returns the ink at a pixel, from 0 on paper to 1 in solid black; there is paper beyond the page.
    pub fn ink(&self, DVec2 { x, y }: DVec2) -> f64 {
        let inside = x > -0.5
            && y > -0.5
            && x < self.image.width() as f64 - 0.5
            && y < self.image.height() as f64 - 0.5;
        if inside { 1.0 - f64::from(self.image.bilinear(x, y)) / 255.0 } else { 0.0 }
    }
}
