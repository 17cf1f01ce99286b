//! SVG: one file for each sheet; user units are millimetres.

use std::fmt::Write as _;
use std::path::Path;

use ::svg::Document;
use ::svg::node::element::{Description, Group, Path as PathElement, Rectangle, Title};
use kurbo::{Affine, BezPath, PathEl, Point};

use crate::export::ExportError;
use crate::export::writing::atomic;
use deltille_layout::artwork::{Artwork, Paint, Part, Shape};

/// Decimals of a coordinate: a tenth of a micrometre.
const DECIMALS: usize = 4;

/// The first lines of a file.
pub const HEAD: &str = concat!(
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- deltille ",
    env!("CARGO_PKG_VERSION"),
    " -->\n"
);

/// Writes sheet `sheet` (counted from 0) as an SVG file.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write(artwork: &Artwork, sheet: usize, path: &Path) -> Result<(), ExportError> {
    let text = to_string(artwork, sheet);
    Ok(atomic::write(path, |file| file.write_all(text.as_bytes()))?)
}

/// Returns the text of sheet `sheet` (counted from 0) as SVG: one path for each shape, named after its
/// part.
///
/// # Panics
/// Panics if the artwork has no such sheet.
///
/// ```
/// use deltille_layout::Printing;
/// use deltille_core::targets::BoardSpec;
/// use deltille_files::export::svg;
///
/// let board = Printing::new("desk", BoardSpec::deltille(4, 5, 20.0))?;
/// assert!(svg::to_string(&board.draw()?, 0).contains("width=\"297mm\""));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn to_string(artwork: &Artwork, sheet: usize) -> String {
    let sheet = &artwork.sheets[sheet];
    let (width, height) = (number(sheet.width_mm), number(sheet.height_mm));
    let svg_from_page = Affine::new([1.0, 0.0, 0.0, -1.0, 0.0, sheet.height_mm]);
    let marks = sheet
        .shapes
        .iter()
        .fold(Group::new().set("fill", "#000").set("fill-rule", "evenodd"), |group, shape| {
            group.add(element(shape, svg_from_page))
        });
    // Without it, the page would be transparent, and black in a viewer with a dark background.
    let paper = Rectangle::new().set("width", "100%").set("height", "100%").set("fill", "#fff");
    let document = Document::new()
        .set("width", format!("{width}mm"))
        .set("height", format!("{height}mm"))
        .set("viewBox", format!("0 0 {width} {height}"))
        .add(Title::new(&artwork.title))
        .add(Description::new().add(::svg::node::Text::new(&artwork.subject)))
        .add(paper)
        .add(marks);
    format!("{HEAD}{document}\n")
}

fn element(shape: &Shape, svg_from_page: Affine) -> PathElement {
    let path = PathElement::new()
        .set("id", name(shape.part))
        .set("d", data(&(svg_from_page * &shape.path)));
    match shape.paint {
        Paint::Fill => path,
        Paint::Stroke { width_mm } => {
            path.set("fill", "none").set("stroke", "#000").set("stroke-width", number(width_mm))
        }
    }
}

fn name(part: Part) -> String {
    match part {
        Part::Tile { panel, row, col } => format!("tile-{panel}-r{row}-c{col}"),
        Part::Field { panel } => format!("field-{panel}"),
        Part::CheckBar { index } => format!("check-bar-{index}"),
        Part::Line { kind, index } => format!("{}-{index}", kind.name()),
        Part::Label { index } => format!("label-{index}"),
        Part::Logo { index } => format!("logo-{index}"),
    }
}

/// The data of a path.
pub(in crate::export) fn data(path: &BezPath) -> String {
    let mut data = String::new();
    let p = |p: Point| format!("{} {}", number(p.x), number(p.y));
    for element in path.elements() {
        // Writing to a string does not fail.
        let _ = match *element {
            PathEl::MoveTo(to) => write!(data, "M{}", p(to)),
            PathEl::LineTo(to) => write!(data, "L{}", p(to)),
            PathEl::QuadTo(c, to) => write!(data, "Q{} {}", p(c), p(to)),
            PathEl::CurveTo(a, b, to) => write!(data, "C{} {} {}", p(a), p(b), p(to)),
            PathEl::ClosePath => write!(data, "Z"),
        };
    }
    data
}

/// A number without trailing zeros.
pub(in crate::export) fn number(value: f64) -> String {
    let fixed = format!("{value:.DECIMALS$}");
    match fixed.trim_end_matches('0').trim_end_matches('.') {
        "-0" => "0".to_owned(),
        short => short.to_owned(),
    }
}
