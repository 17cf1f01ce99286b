//! Overlay: the photograph with its detection drawn on it.
//!
//! Edges of grids are lines, and corners are rings around the unmarked point. Corner ids (or row and column in an unlabelled
//! grid) are beside the corners, tag ids in their tiles. Every grid has its own colour. Line widths and text scale with the size
//! of the tiles, and a small photograph is enlarged, so all text is legible. A photograph of large tiles is reduced.

use glam::DVec2;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PixmapPaint, Stroke,
    Transform,
};

use crate::export::writing::kind::{signed_jpeg, signed_png};
use deltille_core::detection::{Detection, Grid};
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::raster::{AnyGray, Gray, Intensity};
use deltille_layout::artwork::text;

/// Colours of successive grids: far apart in hue, bright enough on black.
const COLOURS: [[u8; 3]; 6] =
    [[255, 80, 60], [60, 170, 255], [80, 220, 80], [255, 180, 0], [230, 90, 255], [0, 220, 210]];

/// Minimum length of a tile edge in the overlay, px, if enlarging allows it: ids of three digits are then
/// legible beside their corners.
const READABLE_EDGE_PX: f64 = 52.0;
/// Maximum enlargement of a photograph, and the maximum side length after it, px.
const MAX_ENLARGED: u32 = 8;
const MAX_SIDE_PX: u32 = 4096;
/// Quality of the JPEG file. Text has no visible halo.
const QUALITY: u8 = 88;
/// Text height, line width and ring radius as fractions of the tile edge.
const TEXT_EDGES: f64 = 0.17;
const TAG_TEXT_EDGES: f64 = 0.3;
const LINE_EDGES: f64 = 0.03;
const RING_EDGES: f64 = 0.09;

/// Error of making an overlay.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OverlayError {
    /// The image is too large for memory.
    #[error("an image of {0} × {1} pixels is too large to draw on")]
    TooLarge(u32, u32),
    /// The encoder failed.
    #[error("the overlay cannot be encoded: {0}")]
    Encode(String),
}

/// Returns the JPEG file of a photograph with its detection drawn on it. `detection` has positions in px of `image`.
///
/// # Errors
/// Returns an error if the image is too large to draw on, or if it cannot be encoded.
pub fn jpeg(image: &AnyGray, detection: &Detection) -> Result<Vec<u8>, OverlayError> {
    let (opaque, [width, height]) = rgb(image, detection, true)?;
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
        .encode(&opaque, width as u32, height as u32, ExtendedColorType::Rgb8)
        .map_err(|error| OverlayError::Encode(error.to_string()))?;
    Ok(signed_jpeg(jpeg))
}

/// Returns a photograph with its detection drawn on it: red, green and blue, row by row, and the width and height. They are
/// those of the photograph, or such that the text is legible. `detection` has positions in px of `image`.
///
/// # Errors
/// Returns an error if the image is too large to draw on.
pub fn rgb(
    image: &AnyGray,
    detection: &Detection,
    is_legible: bool,
) -> Result<(Vec<u8>, [usize; 2]), OverlayError> {
    let scale = match is_legible {
        true => Scale::of([image.width(), image.height()].map(|side| side as u32), detection),
        false => Scale::ONE,
    };
    let mut canvas = match image {
        AnyGray::U8(image) => background(image, scale)?,
        AnyGray::U16(image) => background(image, scale)?,
    };
    for (index, grid) in detection.grids.iter().enumerate() {
        let [r, g, b] = COLOURS[index % COLOURS.len()];
        draw_grid(&mut canvas, grid, Color::from_rgba8(r, g, b, 255), scale.factor());
    }
    let opaque = canvas.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    Ok((opaque, [canvas.width(), canvas.height()].map(|side| side as usize)))
}

/// Returns a PNG file with outlines and dots drawn over a photograph, or over a black image of the
/// given size, px, if there is none.
pub(in crate::export) fn outlined(
    image: Option<&AnyGray>,
    [width, height]: [u32; 2],
    drawn: Option<&Outlined>,
) -> Result<Vec<u8>, OverlayError> {
    let mut canvas = match image {
        Some(AnyGray::U8(image)) => background(image, Scale::ONE)?,
        Some(AnyGray::U16(image)) => background(image, Scale::ONE)?,
        None => {
            let mut black =
                Pixmap::new(width, height).ok_or(OverlayError::TooLarge(width, height))?;
            black.fill(Color::BLACK);
            black
        }
    };
    if let Some(drawn) = drawn {
        drawn.draw(&mut canvas);
    }
    let png = canvas.encode_png().map_err(|error| OverlayError::Encode(error.to_string()))?;
    Ok(signed_png(png))
}

/// Faintly filled polygons, a line of twice the width of their outlines, and dots, px.
pub(in crate::export) struct Outlined<'a> {
    pub polygons: &'a [Vec<DVec2>],
    pub line: Vec<DVec2>,
    pub dots: Vec<DVec2>,
    pub line_px: f64,
    pub colour: [u8; 3],
}

impl Outlined<'_> {
    fn draw(&self, canvas: &mut Pixmap) {
        let [r, g, b] = self.colour;
        let colour = Color::from_rgba8(r, g, b, 255);
        // Pixel centres are at integers here, at halves in tiny-skia.
        let at = |place: DVec2| ((place.x + 0.5) as f32, (place.y + 0.5) as f32);
        let path = |places: &[DVec2]| {
            let mut path = PathBuilder::new();
            for (index, &place) in places.iter().enumerate() {
                let (x, y) = at(place);
                if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
            }
            path
        };
        for polygon in self.polygons {
            let mut path = path(polygon);
            path.close();
            let Some(path) = path.finish() else { continue };
            let mut faint = colour;
            faint.set_alpha(0.15);
            let identity = Transform::identity();
            canvas.fill_path(&path, &solid(faint), FillRule::Winding, identity, None);
            stroke(canvas, Some(path), colour, self.line_px);
        }
        stroke(canvas, path(&self.line).finish(), colour, 2.0 * self.line_px);
        let mut dots = PathBuilder::new();
        for &place in &self.dots {
            let (x, y) = at(place);
            dots.push_circle(x, y, self.line_px as f32);
        }
        if let Some(dots) = dots.finish() {
            canvas.fill_path(&dots, &solid(colour), FillRule::Winding, Transform::identity(), None);
        }
    }
}

/// Size of the overlay relative to the photograph.
#[derive(Clone, Copy, PartialEq)]
enum Scale {
    /// Enlarged by this factor.
    Up(u32),
    /// Reduced: the mean over squares with this side, px.
    Down(u32),
}

impl Scale {
    const ONE: Self = Self::Up(1);

    /// Returns the scale at which the text of a detection is legible, and not much larger.
    fn of([width, height]: [u32; 2], detection: &Detection) -> Self {
        let longest = width.max(height).max(1);
        let edges = detection.grids.iter().filter_map(Grid::edge_px);
        let shortest = edges.reduce(f64::min).unwrap_or(f64::INFINITY).max(1.0);
        let fits = longest.div_ceil(MAX_SIDE_PX);
        // Without a grid, there is nothing to read.
        let largest = longest.div_ceil(MAX_SIDE_PX / 2).max(fits);
        match ((shortest / READABLE_EDGE_PX) as u32).clamp(fits, largest) {
            1 => {
                let wanted = (READABLE_EDGE_PX / shortest).ceil() as u32;
                Self::Up(wanted.clamp(1, (MAX_SIDE_PX / longest).clamp(1, MAX_ENLARGED)))
            }
            down => Self::Down(down),
        }
    }

    fn factor(self) -> f64 {
        match self {
            Self::Up(up) => f64::from(up),
            Self::Down(down) => 1.0 / f64::from(down),
        }
    }
}

fn background<T: Intensity>(image: &Gray<T>, scale: Scale) -> Result<Pixmap, OverlayError> {
    let down = if let Scale::Down(down) = scale { down as usize } else { 1 };
    let [width, height] = [image.width(), image.height()].map(|side| (side / down) as u32);
    let too_large = || OverlayError::TooLarge(width, height);
    let mut canvas = Pixmap::new(width, height).ok_or_else(too_large)?;
    let part = 255.0 / (T::FULL_SCALE * (down * down) as f32);
    let mut sums = vec![0.0; width as usize];
    for (y, row) in canvas.pixels_mut().chunks_mut(width as usize).enumerate() {
        sums.fill(0.0);
        for inner in down * y..down * (y + 1) {
            for (sum, square) in sums.iter_mut().zip(image.row(inner).chunks(down)) {
                *sum += square.iter().map(|value| value.to_f32()).sum::<f32>();
            }
        }
        for (pixel, sum) in row.iter_mut().zip(&sums) {
            let grey = (sum * part).round() as u8;
            *pixel = tiny_skia::ColorU8::from_rgba(grey, grey, grey, 255).premultiply();
        }
    }
    let Scale::Up(up @ 2..) = scale else { return Ok(canvas) };
    let mut large = Pixmap::new(width * up, height * up).ok_or_else(too_large)?;
    let enlarge = Transform::from_scale(up as f32, up as f32);
    large.draw_pixmap(0, 0, canvas.as_ref(), &PixmapPaint::default(), enlarge, None);
    Ok(large)
}

/// The steps along which corners of a tiling are joined, each edge once.
fn steps(kind: GridKind) -> &'static [Vertex] {
    const STEPS: [Vertex; 3] = [Vertex::new(0, 1), Vertex::new(1, 0), Vertex::new(1, -1)];
    match kind {
        GridKind::Deltille => &STEPS,
        GridKind::Checker => &STEPS[..2],
    }
}

/// Image positions of both ends of every edge between two corners, px.
fn edges(grid: &Grid) -> Vec<[DVec2; 2]> {
    let at: std::collections::BTreeMap<Vertex, DVec2> =
        grid.corners.iter().map(|c| (Vertex::new(c.row, c.col), c.position())).collect();
    let joined = |(&from, &p): (&Vertex, &DVec2)| {
        let ends = steps(grid.kind).iter().filter_map(|&step| at.get(&(from + step)));
        ends.map(|&q| [p, q]).collect::<Vec<_>>()
    };
    at.iter().flat_map(joined).collect()
}

fn draw_grid(canvas: &mut Pixmap, grid: &Grid, colour: Color, scale: f64) {
    let Some(edge) = grid.edge_px().map(|px| px * scale) else { return };
    // Pixel centres are at integers here, at halves in tiny-skia.
    let at = |p: DVec2| (p + 0.5) * scale;
    let line = (LINE_EDGES * edge).clamp(1.0, 12.0);
    let mut lines = PathBuilder::new();
    for [p, q] in edges(grid).into_iter().map(|ends| ends.map(at)) {
        lines.move_to(p.x as f32, p.y as f32);
        lines.line_to(q.x as f32, q.y as f32);
    }
    let mut rings = PathBuilder::new();
    for corner in &grid.corners {
        let middle = at(corner.position());
        rings.push_circle(middle.x as f32, middle.y as f32, (RING_EDGES * edge).max(2.5) as f32);
    }
    let mut faint = colour;
    faint.set_alpha(0.7);
    stroke(canvas, lines.finish(), faint, line);
    stroke(canvas, rings.finish(), colour, line);

    let place: std::collections::BTreeMap<Vertex, DVec2> =
        grid.corners.iter().map(|c| (Vertex::new(c.row, c.col), at(c.position()))).collect();
    for corner in &grid.corners {
        let words = match corner.id {
            Some(id) => id.to_string(),
            None => format!("{},{}", corner.row, corner.col),
        };
        let offset = DVec2::new(1.0, -1.0) * (1.4 * RING_EDGES * edge);
        let beside = at(corner.position()) + offset;
        write(canvas, &words, beside, TEXT_EDGES * edge, false, Color::WHITE);
    }
    for tag in &grid.tags {
        let anchor = Vertex::new(tag.row, tag.col);
        let tile = grid.kind.tag_tile(anchor).vertices();
        let ends: Option<Vec<DVec2>> = tile.map(|v| place.get(&v).copied()).collect();
        if let Some(ends) = ends {
            let centre = ends.iter().sum::<DVec2>() / ends.len() as f64;
            write(canvas, &tag.id.to_string(), centre, TAG_TEXT_EDGES * edge, true, colour);
        }
    }
}

fn solid(colour: Color) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(colour);
    paint.anti_alias = true;
    paint
}

fn stroke(canvas: &mut Pixmap, path: Option<Path>, colour: Color, width: f64) {
    let Some(path) = path else { return };
    let stroke = Stroke {
        width: width as f32,
        line_cap: LineCap::Round,
        line_join: LineJoin::Round,
        ..Stroke::default()
    };
    canvas.stroke_path(&path, &solid(colour), &stroke, Transform::identity(), None);
}

/// Draws text from its lower left corner, or centred. A dark outline makes it legible on black, white and grey.
fn write(canvas: &mut Pixmap, words: &str, at: DVec2, size: f64, centred: bool, colour: Color) {
    let size = size.clamp(7.0, 160.0);
    // The font contains digits, commas and minus signs.
    let Ok((outline, width)) = text::outline(words, size) else { return };
    let DVec2 { mut x, mut y } = at;
    if centred {
        x -= width / 2.0;
        y += 0.36 * size;
    }
    let mut path = PathBuilder::new();
    for element in outline.elements() {
        let p = |point: kurbo::Point| ((x + point.x) as f32, (y - point.y) as f32);
        match *element {
            kurbo::PathEl::MoveTo(a) => path.move_to(p(a).0, p(a).1),
            kurbo::PathEl::LineTo(a) => path.line_to(p(a).0, p(a).1),
            kurbo::PathEl::QuadTo(a, b) => path.quad_to(p(a).0, p(a).1, p(b).0, p(b).1),
            kurbo::PathEl::CurveTo(a, b, c) => {
                path.cubic_to(p(a).0, p(a).1, p(b).0, p(b).1, p(c).0, p(c).1);
            }
            kurbo::PathEl::ClosePath => path.close(),
        }
    }
    let Some(path) = path.finish() else { return };
    stroke(canvas, Some(path.clone()), Color::from_rgba8(0, 0, 0, 200), 0.25 * size);
    canvas.fill_path(&path, &solid(colour), FillRule::Winding, Transform::identity(), None);
}
