//! A page as an SVG, rendered by resvg.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use glam::DVec2;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{self, roxmltree};

use crate::document::drawing::{is_over, luma, pixels};
use deltille_core::raster::Gray;
use deltille_files::export::{Block, SUBPIXELS, supersample};
use deltille_files::limits::{self, Broken};

/// A parsed SVG with its size on paper.
pub(super) struct Svg {
    tree: usvg::Tree,
    /// Width and height of the page, mm.
    size_mm: DVec2,
}

impl Svg {
    /// Parses an SVG. Returns an error with the reason if that fails, such as a width that is not a length.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, String> {
        let text = std::str::from_utf8(bytes).map_err(|_| "not a text file".to_owned())?;
        let xml = roxmltree::Document::parse(text)
            .map_err(|error| format!("not a readable SVG ({error})"))?;
        let length = |name: &str| {
            let value = xml.root_element().attribute(name).unwrap_or_default();
            length_mm(value).ok_or_else(|| {
                format!("its {name} {value:?} is not a length in mm, cm, in, pt, pc or px")
            })
        };
        let size_mm = DVec2::new(length("width")?, length("height")?);
        let tree = usvg::Tree::from_xmltree(&xml, &usvg::Options::default())
            .map_err(|error| format!("not a readable SVG ({error})"))?;
        Ok(Self { tree, size_mm })
    }

    /// Returns width and height on paper as stated in the file, mm.
    pub(super) fn size_mm(&self) -> DVec2 {
        self.size_mm
    }

    /// Renders the page at a resolution; parts not rendered before `end` stay white. Returns an
    /// error if the renderer panics.
    pub(super) fn render(&self, px_per_mm: f64, end: Option<Instant>) -> Result<Gray<u8>, String> {
        let [width, height] = self.size_mm.to_array().map(|mm| pixels(mm, px_per_mm));
        let scale = px_per_mm * self.size_mm.x / f64::from(self.tree.size().width());
        let mut grey = Vec::with_capacity(width * height);
        // Blocks are rendered on other threads, where a panic would otherwise end the program.
        let is_broken = AtomicBool::new(false);
        let blank = |block: Block| vec![0; block.width * block.height * SUBPIXELS * SUBPIXELS];
        let coverage = |block| {
            if is_over(end) || is_broken.load(Ordering::Relaxed) {
                return blank(block);
            }
            limits::caught(|| self.coverage(block, scale)).unwrap_or_else(|_| {
                is_broken.store(true, Ordering::Relaxed);
                blank(block)
            })
        };
        let drawn = supersample(width, height, coverage, |band| {
            grey.extend_from_slice(band);
            Ok::<_, std::convert::Infallible>(())
        });
        if is_broken.into_inner() {
            return Err(Broken::Panic.to_string());
        }
        match drawn {
            Ok(()) => Ok(Gray::from_vec(width, height, grey).expect("bands fill the page")),
            Err(never) => match never {},
        }
    }

    /// Returns the ink coverage, 0 to 255, of the subpixels of a block of the page. `scale` is in px per unit of the
    /// drawing.
    fn coverage(&self, block: Block, scale: f64) -> Vec<u8> {
        let size = [block.width, block.height].map(|n| (n * SUBPIXELS) as u32);
        let mut pixmap = Pixmap::new(size[0], size[1]).expect("a block has pixels");
        pixmap.fill(Color::WHITE);
        let samples = SUBPIXELS as f64;
        let scale = (scale * samples) as f32;
        let [x, y] = [block.x, block.y].map(|n| -(n as f64 * samples) as f32);
        let transform = Transform::from_row(scale, 0.0, 0.0, scale, x, y);
        resvg::render(&self.tree, transform, &mut pixmap.as_mut());
        pixmap.pixels().iter().map(|p| 255 - luma([p.red(), p.green(), p.blue()])).collect()
    }
}

/// Parses a length with an absolute unit, mm. A px is a CSS pixel of 1/96 inch, and so is a bare number.
fn length_mm(text: &str) -> Option<f64> {
    let number = text.trim().trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let mm = match text.trim()[number.len()..].to_ascii_lowercase().as_str() {
        "mm" => 1.0,
        "cm" => 10.0,
        "in" => 25.4,
        "pt" => 25.4 / 72.0,
        "pc" => 25.4 / 6.0,
        "px" | "" => 25.4 / 96.0,
        _ => return None,
    };
    let value = number.trim().parse::<f64>().ok()? * mm;
    (value.is_finite() && value > 0.0).then_some(value)
}
