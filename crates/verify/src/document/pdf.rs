//! Pages of a PDF, rendered by hayro.

use std::sync::Arc;
use std::time::Instant;

use glam::{DVec2, Vec2Swizzles as _};
use hayro::hayro_interpret::InterpreterSettings;
use hayro::hayro_syntax::page::Page;
use hayro::kurbo::Affine;
use hayro::vello_cpu::color::palette::css::WHITE;
use hayro::vello_cpu::{Pixmap, RasterizerSettings, RenderContext, Resources, TargetInit};
use hayro::{RenderCache, RenderSettings, hayro_syntax, render_into};

use crate::document::drawing::{is_over, luma, pixels};
use deltille_core::raster::Gray;

const MM_PER_PT: f64 = 25.4 / 72.0;

/// Number of pixel rows rendered at a time, which limits the memory for a large page.
const BAND: usize = 1024;

/// A parsed PDF with at least one page.
pub(super) struct Pdf(hayro_syntax::Pdf);

impl Pdf {
    /// Parses a PDF. Returns an error with the reason if that fails.
    pub(super) fn parse(bytes: Arc<Vec<u8>>) -> Result<Self, String> {
        let pdf = hayro_syntax::Pdf::new(bytes)
            .map_err(|_| "not a readable PDF; it may be truncated".to_owned())?;
        if pdf.pages().is_empty() { Err("a PDF without pages".to_owned()) } else { Ok(Self(pdf)) }
    }

    /// Number of pages.
    pub(super) fn pages(&self) -> usize {
        self.0.pages().len()
    }

    /// Returns width and height of the visible part of a page, mm, after its rotation.
    pub(super) fn size_mm(&self, index: usize) -> DVec2 {
        let page = &self.0.pages()[index];
        let visible = page.intersected_crop_box();
        let unit: f64 = page.raw().get::<f64>("UserUnit").unwrap_or(1.0) * MM_PER_PT;
        let size = DVec2::new(visible.width(), visible.height()) * unit;
        // The page is rotated by 90° or 270° if its rendered width and height are swapped.
        let (upright, shown) = (page.base_dimensions(), page.render_dimensions());
        if upright == shown { size } else { size.yx() }
    }

    /// Renders a page at a resolution; parts not rendered before `end` stay white.
    pub(super) fn render(&self, index: usize, px_per_mm: f64, end: Option<Instant>) -> Gray<u8> {
        let page = &self.0.pages()[index];
        let DVec2 { x: width_mm, y: height_mm } = self.size_mm(index);
        let (width, height) = (pixels(width_mm, px_per_mm), pixels(height_mm, px_per_mm));
        let scale = width_mm * px_per_mm / f64::from(page.render_dimensions().0);
        let cache = RenderCache::new();
        let mut grey = Vec::with_capacity(width * height);
        for y in (0..height).step_by(BAND) {
            if is_over(end) {
                grey.resize(width * height, 255);
                break;
            }
            band(page, &cache, scale, [width, BAND.min(height - y)], y, &mut grey);
        }
        stretch(Gray::from_vec(width, height, grey).expect("bands fill the page"))
    }
}

/// Stretches the grey values so that the darkest pixel is 0 and the brightest 255: pure K is not quite black on
/// screen.
fn stretch(mut image: Gray<u8>) -> Gray<u8> {
    let (least, most) = image.pixels().iter().fold((255, 0), |(lo, hi), &v| (v.min(lo), v.max(hi)));
    if most - least.min(most) >= 128 {
        let range = f32::from(most - least);
        let table: Vec<u8> = (0..=255u8)
            .map(|v| (f32::from(v.saturating_sub(least)) * 255.0 / range).round() as u8)
            .collect();
        image.pixels_mut().iter_mut().for_each(|v| *v = table[usize::from(*v)]);
    }
    image
}

/// Renders a band of a page with this width and height, px, starting at row `y`, and appends its grey values. `scale`
/// is in px per unit of the page.
fn band<'a>(
    page: &'a Page<'a>,
    cache: &RenderCache<'a>,
    scale: f64,
    [width, height]: [usize; 2],
    y: usize,
    grey: &mut Vec<u8>,
) {
    // The renderer counts in 16 bits, so the part of a page beyond 65535 px stays white.
    let side = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
    let mut context = RenderContext::new(side(width), side(height));
    let transform = Affine::translate((0.0, -(y as f64)))
        * Affine::scale(scale)
        * page.initial_transform(true).to_kurbo_affine();
    let interpreter = InterpreterSettings::default();
    render_into(page, cache, &interpreter, &RenderSettings::default(), &mut context, transform);
    context.flush();
    let mut pixmap = Pixmap::new(context.width(), context.height());
    let settings =
        RasterizerSettings { target_init: TargetInit::Clear(WHITE), ..Default::default() };
    context.render_with(&mut pixmap, &mut Resources::default(), settings);
    for row in pixmap.data().chunks_exact(usize::from(pixmap.width())) {
        grey.extend(row.iter().map(|p| luma([p.r, p.g, p.b])));
        grey.extend(std::iter::repeat_n(255, width - row.len()));
    }
}

/// Converts a hayro transform to a kurbo one; hayro's own conversion is private to its crates.
trait ToKurbo {
    fn to_kurbo_affine(self) -> Affine;
}

impl ToKurbo for hayro_syntax::transform::Transform {
    fn to_kurbo_affine(self) -> Affine {
        Affine::new(self.as_coeffs())
    }
}
