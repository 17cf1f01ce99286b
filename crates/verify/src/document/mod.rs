//! Artifacts read back as pictures, by other code than wrote them: hayro for PDF, resvg for SVG,
//! the image crates for PNG.

mod pdf;
mod png;
mod svg;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use glam::DVec2;

use super::reader::{self, Artifact, Reader};
use deltille_core::raster::Gray;
use deltille_files::limits::{Guard, Limits, ReadError};

/// Largest picture that is drawn for a check, px.
pub(super) const MAX_PIXELS: f64 = 60.0e6;

/// Tolerance of the ink of an area from 0 or 1 on a page that is rendered or read: the effect of
/// rounding to 255 grey values.
pub(super) const MAX_INK_ERROR: f64 = 0.01;

/// The tolerance near an edge, within reach of its smear.
pub(super) const SMEARED_INK_ERROR: f64 = 0.3;

/// The format of an artifact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Format {
    /// Portable Document Format.
    Pdf,
    /// Scalable Vector Graphics.
    Svg,
    /// Portable Network Graphics.
    Png,
    /// glTF 2.0 binary.
    Glb,
    /// Wavefront OBJ.
    Obj,
    /// Binary STL.
    Stl,
    /// List of boards, corners and tags for other detectors.
    Dsc,
    /// Drawing for a cutter.
    Dxf,
    /// Model for Gazebo.
    Sdf,
    /// Model for ROS.
    Urdf,
    /// Model for MuJoCo.
    Mjcf,
    /// Universal Scene Description, as text.
    Usda,
    /// Two bodies to print in two colours.
    #[serde(rename = "3mf")]
    ThreeMf,
}

impl Format {
    /// All formats with the extensions of their files.
    pub const ALL: [(Self, &str); 13] = [
        (Self::Pdf, "pdf"),
        (Self::Svg, "svg"),
        (Self::Png, "png"),
        (Self::Glb, "glb"),
        (Self::Obj, "obj"),
        (Self::Stl, "stl"),
        (Self::Dsc, "dsc"),
        (Self::Dxf, "dxf"),
        (Self::Sdf, "sdf"),
        (Self::Urdf, "urdf"),
        (Self::Mjcf, "xml"),
        (Self::Usda, "usda"),
        (Self::ThreeMf, "3mf"),
    ];

    /// The format by the extension of a file name; `None` for other extensions.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_string_lossy().to_lowercase();
        Self::ALL.iter().find(|(_, known)| *known == extension).map(|(format, _)| *format)
    }

    /// Whether files of this format are printed pages.
    pub fn is_document(self) -> bool {
        matches!(self, Self::Pdf | Self::Svg | Self::Png)
    }
}

/// Why an artifact cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DocumentError {
    /// The file cannot be opened.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file that belongs to the artifact is not among those in memory.
    #[error("{}: not among the files that are given", path.display())]
    Absent {
        /// The file.
        path: PathBuf,
    },
    /// The file is not of the format of its extension, states no physical size, or exceeds the
    /// [`Limits`].
    #[error("{}: {problem}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
}

impl DocumentError {
    /// An error about the content of a file.
    pub(super) fn unreadable(path: &Path, problem: impl Into<String>) -> Self {
        Self::Unreadable { path: path.to_owned(), problem: problem.into() }
    }
}

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

impl Document {
    /// Reads a `.pdf`, `.svg` or `.png` file that is in memory, within limits.
    ///
    /// # Errors
    /// When it is not of the format of its extension, is damaged, or exceeds a limit.
    pub fn read(artifact: &Artifact, limits: &Limits) -> Result<Self, DocumentError> {
        let files = std::slice::from_ref(artifact);
        let reader = Reader { files: &files, limits: *limits, guard: Guard::Here };
        Self::read_by(&reader, Path::new(artifact.name()))
    }

    /// Reads a file.
    pub(super) fn read_by(reader: &Reader, path: &Path) -> Result<Self, DocumentError> {
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

    /// Format of the file.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Number of pages.
    pub fn pages(&self) -> usize {
        match &*self.content {
            Content::Pdf(pdf) => pdf.pages(),
            Content::Svg(_) | Content::Png(_) => 1,
        }
    }

    /// Width and height of a page (counted from 0) as the file states them, mm.
    pub fn size_mm(&self, page: usize) -> DVec2 {
        match &*self.content {
            Content::Pdf(pdf) => pdf.size_mm(page),
            Content::Svg(svg) => svg.size_mm(),
            Content::Png(png) => png.size_mm(),
        }
    }

    /// The error about a page that is far larger than stated.
    pub(super) fn too_large(&self, found_mm: DVec2, stated_mm: DVec2) -> DocumentError {
        let problem = format!(
            "a page of {} x {} mm instead of {} x {} mm is not looked at",
            found_mm.x, found_mm.y, stated_mm.x, stated_mm.y
        );
        DocumentError::unreadable(&self.path, problem)
    }

    /// Greatest difference of the stated size from the true one that the format allows, mm.
    pub fn size_tolerance_mm(&self) -> f64 {
        match &*self.content {
            // Points in single precision, and decimals written.
            Content::Pdf(_) | Content::Svg(_) => 1e-3,
            // Whole pixels: half of one, and as much again for the rounding of the resolution.
            Content::Png(png) => 0.5001 / png.px_per_mm() + 1e-3,
        }
    }

    /// Renders a page (counted from 0) on white. `px_per_mm` is a wish: a PNG has its own
    /// resolution, and large pages are rendered coarser to bound the memory.
    ///
    /// # Errors
    /// When the page cannot be rendered, or exceeds a limit.
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
                // A page of no breadth has a pixel across, and as many along as it is long.
                let [width, height] = [width_mm, height_mm].map(|mm| pixels(mm, px_per_mm));
                if width.saturating_mul(height) as f64 > 2.0 * MAX_PIXELS {
                    let problem = format!("a page of {width_mm} x {height_mm} mm cannot be drawn");
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

/// Whether the time for drawing is over; what is drawn after that is not looked at.
fn is_over(end: Option<Instant>) -> bool {
    end.is_some_and(|end| Instant::now() > end)
}

/// Whole pixels of a length.
fn pixels(mm: f64, px_per_mm: f64) -> usize {
    ((mm * px_per_mm).round() as usize).max(1)
}

/// Luma of an opaque colour, Rec. 709 weights.
fn luma([r, g, b]: [u8; 3]) -> u8 {
    (0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b)).round() as u8
}
