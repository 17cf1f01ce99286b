//! The image of a face with polygons filled in black, as a separate sheet.

use glam::DVec2;

use crate::document::drawing::MAX_PIXELS;
use crate::document::page::Page;
use crate::sheet::source::wish_px_per_mm;
use crate::verifier::Verifier;
use deltille_core::raster::{Coverage, Gray};
use deltille_core::targets::Panel;
use deltille_layout::{Placement, SheetLayout};

/// White margin around a face in its image, mm.
const AROUND_MM: f64 = 5.0;

/// An image of a face, for comparison with its expected appearance.
pub(crate) struct FacePicture {
    page: Page,
    layout: SheetLayout,
    /// Width and height, px.
    size_px: [usize; 2],
    /// Its lower left corner in the frame of the panel, mm.
    low: DVec2,
}

impl FacePicture {
    /// Creates a blank image of a face with this outline in the frame of its panel, mm.
    pub(crate) fn new(verifier: &Verifier, panel: &Panel, outline: &[DVec2]) -> Self {
        let least = outline.iter().copied().reduce(DVec2::min).unwrap_or_default();
        let most = outline.iter().copied().reduce(DVec2::max).unwrap_or_default();
        let low = least - AROUND_MM;
        let size = most + AROUND_MM - low;
        let placement = Placement { panel: panel.id, angle_rad: 0.0, origin_mm: -low };
        let layout = SheetLayout {
            width_mm: size.x,
            height_mm: size.y,
            placements: vec![placement],
            check_bars: Vec::new(),
            lines: Vec::new(),
            texts: Vec::new(),
            logos: Vec::new(),
            pages: Vec::new(),
        };
        let finest = (MAX_PIXELS / (size.x * size.y)).sqrt();
        let px_per_mm = wish_px_per_mm(verifier, &layout).min(finest);
        let size_px = size.to_array().map(|mm| (mm * px_per_mm).ceil() as usize);
        let page = Page {
            width_mm: size.x,
            height_mm: size.y,
            px_per_mm,
            image: Gray::new(1, 1),
            smear_px: 0.0,
            texel_px: 0.0,
            left_px: 0.0,
        };
        Self { page, layout, size_px, low }
    }

    /// Returns the position of a pixel in the frame of the panel, mm.
    pub(crate) fn place(&self, index: usize) -> DVec2 {
        let width = self.size_px[0];
        let pixel = DVec2::new((index % width) as f64, (index / width) as f64);
        self.page.page_from_px(pixel) + self.low
    }

    /// Returns the coverage of each pixel by polygons in the frame of the panel, weighted by their values; clockwise
    /// polygons count negative.
    pub(crate) fn covered<'p>(&self, parts: impl Iterator<Item = (&'p [DVec2], f64)>) -> Gray<f32> {
        let mut cover = Coverage::new(self.size_px[0], self.size_px[1]);
        for (corners, value) in parts {
            // Clockwise on the screen counts positive.
            let pixels = corners.iter().rev();
            let pixels = pixels.map(|&corner| self.page.px_from_page(corner - self.low));
            cover.add(&pixels.collect::<Vec<DVec2>>(), value);
        }
        cover.finish()
    }

    /// Returns the face with these polygons in black, and its expected appearance.
    pub(crate) fn inked<'p>(
        mut self,
        dark: impl Iterator<Item = (&'p [DVec2], f64)>,
    ) -> (Page, SheetLayout) {
        let light = |ink: f32| (255.0 * (1.0 - ink)).round().clamp(0.0, 255.0) as u8;
        self.page.image = self.covered(dark).map(light);
        (self.page, self.layout)
    }
}
