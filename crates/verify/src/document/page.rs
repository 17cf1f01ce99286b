//! A page as a picture, in millimetres.

use glam::DVec2;

use deltille_core::raster::Gray;

/// Tolerance of the ink of an area from 0 or 1 on a page that is rendered or read: the effect of
/// rounding to 255 grey values.
pub(crate) const MAX_INK_ERROR: f64 = 0.01;

/// The tolerance near an edge, within reach of its smear.
const SMEARED_INK_ERROR: f64 = 0.3;

/// One page as a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Page width as the file states it, mm.
    pub width_mm: f64,
    /// Page height as the file states it, mm.
    pub height_mm: f64,
    /// Resolution, px/mm; the picture's upper-left corner is the page's.
    pub px_per_mm: f64,
    /// The picture.
    pub image: Gray<u8>,
    /// Extra width of edges beyond the pixel that they cross, px, on a page that is resampled from
    /// others.
    pub smear_px: f64,
    /// Side of a pixel of the texture that it shows, px; 0 where it shows none.
    pub texel_px: f64,
    /// How far within the picture the left edge of the page lies, px: a part of a pixel on a page that was turned over,
    /// whose pictures begin at the other edge.
    pub left_px: f64,
}

impl Page {
    /// Tolerance of ink from 0 or 1 beside an edge.
    pub fn max_ink_error_at_edges(&self) -> f64 {
        if self.smear_px > 0.0 { SMEARED_INK_ERROR } else { MAX_INK_ERROR }
    }
}

impl Page {
    /// Pixel position of a point of the page frame (mm, y up).
    pub fn px_from_page(&self, place: DVec2) -> DVec2 {
        let from_top = DVec2::new(place.x, self.height_mm - place.y) * self.px_per_mm;
        from_top + DVec2::new(self.left_px, 0.0) - 0.5
    }

    /// Point of the page frame (mm, y up) of a pixel position.
    pub fn page_from_px(&self, pixel: DVec2) -> DVec2 {
        let from_top = (pixel + 0.5 - DVec2::new(self.left_px, 0.0)) / self.px_per_mm;
        DVec2::new(from_top.x, self.height_mm - from_top.y)
    }

    /// The page blurred as by a lens: each pixel with its neighbours, weighted 1 2 1 along both
    /// axes, which is a blur with a standard deviation of 0.71 px, in 16 bits.
    ///
    /// Corners are located by a model of blurred edges; of a sharp edge along the pixels a single
    /// grey value determines the place, and the model is then off by up to a quarter of a pixel.
    pub fn blurred(&self) -> Gray<u16> {
        let (width, height) = (self.image.width(), self.image.height());
        let near = |i: usize, size: usize| [i.saturating_sub(1), i, i, (i + 1).min(size - 1)];
        let mut blurred = Gray::new(width, height);
        for y in 0..height {
            let rows = near(y, height).map(|y| self.image.row(y));
            let down = |x: usize| rows.iter().map(|row| u32::from(row[x])).sum::<u32>();
            for (x, pixel) in blurred.row_mut(y).iter_mut().enumerate() {
                // A sum of sixteen pixels; 257 · 255 is full scale.
                let sum: u32 = near(x, width).into_iter().map(down).sum();
                *pixel = (sum * 257 / 16) as u16;
            }
        }
        blurred
    }

    /// The mirror image of the page, left and right exchanged.
    pub fn mirrored(&self) -> Self {
        let mut page = self.clone();
        let width = page.image.width();
        page.image.pixels_mut().chunks_exact_mut(width).for_each(<[u8]>::reverse);
        page.left_px = width as f64 - page.width_mm * page.px_per_mm - page.left_px;
        page
    }

    /// Ink at a pixel, 0 on paper to 1 in solid black; paper beyond the page.
    pub fn ink(&self, DVec2 { x, y }: DVec2) -> f64 {
        let inside = x > -0.5
            && y > -0.5
            && x < self.image.width() as f64 - 0.5
            && y < self.image.height() as f64 - 0.5;
        if inside { 1.0 - f64::from(self.image.bilinear(x, y)) / 255.0 } else { 0.0 }
    }
}
