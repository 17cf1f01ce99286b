//! PNG: one grey 8-bit image per sheet, with its physical resolution.

use std::io::{self, Write};
use std::path::Path;

use kurbo::{Affine, BezPath, PathEl, Point, Rect, Shape as _, Stroke, StrokeOpts};
use tiny_skia::{FillRule, Mask, PathBuilder, Transform};

use super::supersample::render as supersample;
use crate::export::writing::{atomic, kind};
use crate::export::{Block, ExportError, GENERATOR, SUBPIXELS};
use deltille_layout::artwork::{Paint, Shape, Sheet};

/// Maximum number of pixels of an image: 2 gigapixels, about an A0 sheet at 1200 dpi.
const MAX_PIXELS: f64 = 2.0e9;

/// Maximum distance of the outline of a stroke from its exact curve, mm.
const STROKE_TOLERANCE_MM: f64 = 1e-4;

/// Writes a sheet as a grey 8-bit PNG; `dpi` is the resolution in dots per inch.
///
/// PNG states its resolution in whole pixels per metre; the drawing is scaled by exactly the nearest value to `dpi`. The image
/// starts at the upper-left corner of the page and has the size of the page, rounded to whole pixels.
///
/// # Errors
/// Returns an error if the image would have more than 2 gigapixels, or if the file cannot be written.
pub fn write(sheet: &Sheet, title: &str, path: &Path, dpi: f64) -> Result<(), ExportError> {
    let raster = Raster::new(sheet, dpi);
    if raster.width as f64 * raster.height as f64 > MAX_PIXELS {
        return Err(ExportError::TooLarge {
            path: path.to_owned(),
            width_mm: sheet.width_mm,
            height_mm: sheet.height_mm,
            limit: format!("at {dpi} dpi it has more than 2 gigapixels: choose a lower resolution"),
        });
    }
    Ok(atomic::write(path, |file| raster.encode(title, file))?)
}

/// Returns the same PNG file in memory, for pages of moderate size.
///
/// # Errors
/// Returns an error if the image is larger than PNG allows.
pub fn to_bytes(sheet: &Sheet, title: &str, dpi: f64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    Raster::new(sheet, dpi).encode(title, &mut bytes)?;
    Ok(bytes)
}

/// A sheet prepared for drawing.
struct Raster {
    pixels_per_metre: u32,
    width: usize,
    height: usize,
    shapes: Vec<Inked>,
}

/// A path in pixels (y down), with its bounds.
struct Inked {
    path: BezPath,
    bounds: Rect,
    rule: FillRule,
}

impl Raster {
    fn new(sheet: &Sheet, dpi: f64) -> Self {
        let pixels_per_metre = (dpi / 0.0254).round().clamp(1.0, f64::from(u32::MAX)) as u32;
        let px_per_mm = f64::from(pixels_per_metre) / 1000.0;
        let pixels = |mm: f64| (mm * px_per_mm).round().max(1.0) as usize;
        let pixels_from_page =
            Affine::new([px_per_mm, 0.0, 0.0, -px_per_mm, 0.0, sheet.height_mm * px_per_mm]);
        Self {
            pixels_per_metre,
            width: pixels(sheet.width_mm),
            height: pixels(sheet.height_mm),
            shapes: sheet.shapes.iter().map(|shape| Inked::new(shape, pixels_from_page)).collect(),
        }
    }

    fn encode(&self, title: &str, file: &mut dyn Write) -> io::Result<()> {
        let mut encoder = png::Encoder::new(file, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: self.pixels_per_metre,
            yppu: self.pixels_per_metre,
            unit: png::Unit::Meter,
        }));
        encoder.add_text_chunk(kind::SOFTWARE.to_owned(), GENERATOR.to_owned())?;
        encoder.add_itxt_chunk("Title".to_owned(), title.to_owned())?;
        let mut writer = encoder.write_header()?;
        let mut stream = writer.stream_writer()?;
        supersample(
            self.width,
            self.height,
            |block| self.coverage(block),
            |band| stream.write_all(band),
        )?;
        stream.finish()?;
        Ok(writer.finish()?)
    }

    /// Coverage of the samples of a block; 255 is fully inked.
    fn coverage(&self, block: Block) -> Vec<u8> {
        let (x, y) = (block.x as f64, block.y as f64);
        let bounds = Rect::new(x, y, x + block.width as f64, y + block.height as f64);
        let samples = SUBPIXELS as f64;
        let samples_from_pixels = Affine::scale(samples) * Affine::translate((-x, -y));
        let size = [block.width, block.height].map(|n| (n * SUBPIXELS) as u32);
        let mut mask = Mask::new(size[0], size[1]).expect("a block has pixels");
        for shape in self.shapes.iter().filter(|shape| shape.bounds.overlaps(bounds)) {
            if let Some(path) = skia_path(samples_from_pixels * &shape.path) {
                mask.fill_path(&path, shape.rule, true, Transform::identity());
            }
        }
        mask.take()
    }
}

impl Inked {
    fn new(shape: &Shape, pixels_from_page: Affine) -> Self {
        let (path, rule) = match shape.paint {
            Paint::Fill => (pixels_from_page * &shape.path, FillRule::EvenOdd),
            Paint::Stroke { width_mm } => {
                let style = Stroke::new(width_mm).with_caps(kurbo::Cap::Butt);
                let style = style.with_join(kurbo::Join::Miter);
                let options = StrokeOpts::default();
                let outline = kurbo::stroke(&shape.path, &style, &options, STROKE_TOLERANCE_MM);
                (pixels_from_page * outline, FillRule::Winding)
            }
        };
        Self { bounds: path.bounding_box(), path, rule }
    }
}

fn skia_path(path: BezPath) -> Option<tiny_skia::Path> {
    let mut builder = PathBuilder::new();
    let f = |p: Point| (p.x as f32, p.y as f32);
    for element in path.elements() {
        match *element {
            PathEl::MoveTo(p) => builder.move_to(f(p).0, f(p).1),
            PathEl::LineTo(p) => builder.line_to(f(p).0, f(p).1),
            PathEl::QuadTo(c, p) => builder.quad_to(f(c).0, f(c).1, f(p).0, f(p).1),
            PathEl::CurveTo(a, b, p) => {
                builder.cubic_to(f(a).0, f(a).1, f(b).0, f(b).1, f(p).0, f(p).1);
            }
            PathEl::ClosePath => builder.close(),
        }
    }
    builder.finish()
}
