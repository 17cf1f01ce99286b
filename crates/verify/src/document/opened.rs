//! A document of printed pages, rendered one at a time.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec2;

use crate::document::drawing::{MAX_PIXELS, pixels};
use crate::document::page::Page;
use crate::document::{pdf, png, svg};
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::reader::{self, Artifact, OnDisk, Reader};
use deltille_files::limits::{Guard, Limits};

/// An opened document of printed pages.
pub struct Document {
    path: PathBuf,
    content: Arc<Content>,
    format: Format,
    limits: Limits,
    guard: Guard,
}

enum Content {
    Pdf(pdf::Pdf),
    Svg(Box<svg::Svg>),
    Png(png::Png),
}

impl Document {
    /// Parses a `.pdf`, `.svg` or `.png` file in memory, within limits.
    ///
    /// # Errors
    /// Returns an error if the file does not have the format of its extension, is damaged, or exceeds a limit.
    pub fn read(artifact: &Artifact, limits: &Limits) -> Result<Self, DocumentError> {
        let files = std::slice::from_ref(artifact);
        let reader = Reader { files: &files, limits: *limits, guard: Guard::Here };
        Self::read_by(&reader, Path::new(artifact.name()))
    }

    /// Reads and parses a file.
    pub(crate) fn read_by(reader: &Reader, path: &Path) -> Result<Self, DocumentError> {
        let unreadable = |problem: String| DocumentError::unreadable(path, problem);
        let Some(format) = Format::of(path).filter(|format| format.is_document()) else {
            return Err(unreadable("not a .pdf, .svg or .png file".to_owned()));
        };
        let (bytes, limits, guard) = (reader.read(path)?, reader.limits, reader.guard);
        let content = reader.run(path, move || {
            Ok(match format {
                Format::Pdf => Content::Pdf(pdf::Pdf::parse(bytes)?),
                Format::Svg => Content::Svg(Box::new(svg::Svg::parse(&bytes)?)),
                _ => Content::Png(png::Png::parse(&bytes, &limits)?),
            })
        })?;
        Ok(Self { path: path.to_owned(), content: Arc::new(content), format, limits, guard })
    }

    /// Returns the format of the file.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Returns the number of pages.
    pub fn pages(&self) -> usize {
        match &*self.content {
            Content::Pdf(pdf) => pdf.pages(),
            Content::Svg(_) | Content::Png(_) => 1,
        }
    }

    /// Returns width and height of a page (counted from 0) as stated in the file, mm.
    pub fn size_mm(&self, page: usize) -> DVec2 {
        match &*self.content {
            Content::Pdf(pdf) => pdf.size_mm(page),
            Content::Svg(svg) => svg.size_mm(),
            Content::Png(png) => png.size_mm(),
        }
    }

    /// Creates the error about a page that is far larger than stated.
    pub(crate) fn too_large(&self, found_mm: DVec2, stated_mm: DVec2) -> DocumentError {
        let problem = format!(
            "the page measures {} x {} mm instead of {} x {} mm; too large to compare",
            found_mm.x, found_mm.y, stated_mm.x, stated_mm.y
        );
        DocumentError::unreadable(&self.path, problem)
    }

    /// Returns the largest difference between stated and true size that the format allows, mm.
    pub fn size_tolerance_mm(&self) -> f64 {
        match &*self.content {
            // Points in single precision, written as decimals.
            Content::Pdf(_) | Content::Svg(_) => 1e-3,
            // Whole pixels: half a pixel, and the same again for the rounding of the resolution.
            Content::Png(png) => 0.5001 / png.px_per_mm() + 1e-3,
        }
    }

    /// Renders a page (counted from 0) on white. `px_per_mm` is the desired resolution: a PNG has its own, and large
    /// pages are rendered more coarsely to limit memory.
    ///
    /// # Errors
    /// Returns an error if the page cannot be rendered or exceeds a limit.
    pub fn render(&self, page: usize, px_per_mm: f64) -> Result<Page, DocumentError> {
        let DVec2 { x: width_mm, y: height_mm } = self.size_mm(page);
        let most = (MAX_PIXELS / (width_mm * height_mm)).sqrt();
        let px_per_mm = match &*self.content {
            Content::Png(png) => png.image_px_per_mm(),
            _ => px_per_mm.min(most),
        };
        let content = Arc::clone(&self.content);
        let image = match &*self.content {
            Content::Png(png) => png.image().clone(),
            _ => {
                // A page of zero width is rendered one pixel wide, at its full height.
                let [width, height] = [width_mm, height_mm].map(|mm| pixels(mm, px_per_mm));
                if width.saturating_mul(height) as f64 > 2.0 * MAX_PIXELS {
                    let problem =
                        format!("a page of {width_mm} x {height_mm} mm cannot be rendered");
                    return Err(DocumentError::unreadable(&self.path, problem));
                }
                let end = self.guard.end(self.limits.time());
                reader::run(&self.path, &self.limits, self.guard, move || match &*content {
                    Content::Pdf(pdf) => Ok(pdf.render(page, px_per_mm, end)),
                    Content::Svg(svg) => svg.render(px_per_mm, end),
                    Content::Png(png) => Ok(png.image().clone()),
                })?
            }
        };
        let (smear_px, texel_px, left_px) = (0.0, 0.0, 0.0);
        Ok(Page { width_mm, height_mm, px_per_mm, image, smear_px, texel_px, left_px })
    }

    /// Opens a `.pdf`, `.svg` or `.png` file within the default limits.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, does not have the format of its extension, or exceeds a limit.
    pub fn open(path: &Path) -> Result<Self, DocumentError> {
        Self::open_within(path, &Limits::default())
    }

    /// Opens a `.pdf`, `.svg` or `.png` file within limits other than the default.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, does not have the format of its extension, or exceeds a limit.
    pub fn open_within(path: &Path, limits: &Limits) -> Result<Self, DocumentError> {
        let files = OnDisk(*limits);
        Self::read_by(&Reader { files: &files, limits: *limits, guard: Guard::Timed }, path)
    }
}
