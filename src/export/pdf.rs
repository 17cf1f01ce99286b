//! PDF: all sheets in one file, a page each.
//!
//! Black is pure K. The page boxes are the page's size in points, and viewers are asked to print
//! without scaling. The same artwork gives the same bytes: no dates, and the file's identifier is
//! a digest of its content.

use std::path::Path;

use kurbo::{BezPath, PathEl, Point};
use lopdf::{Dictionary, Object, StringFormat};
use printpdf::{
    Cmyk, Color, Line, LinePoint, Op, PaintMode, PdfDocument, PdfPage, PdfSaveOptions, Polygon,
    PolygonRing, Pt, Rect, WindingOrder,
};
use sha2::{Digest, Sha256};

use super::{ExportError, GENERATOR, atomic};
use crate::artwork::{Artwork, Paint, Shape, Sheet};

/// Version of the format.
pub(crate) const VERSION: &str = "1.6";

/// Points per millimetre.
const PT_PER_MM: f64 = 72.0 / 25.4;

/// Longest side of a page that readers must accept, mm: 14400 points.
const MAX_PAGE_MM: f64 = 5080.0;

/// Writes all sheets as one PDF.
pub fn write(artwork: &Artwork, path: &Path) -> Result<(), ExportError> {
    let long = |sheet: &&Sheet| sheet.width_mm.max(sheet.height_mm) > MAX_PAGE_MM;
    if let Some(sheet) = artwork.sheets.iter().find(long) {
        return Err(ExportError::TooLarge {
            path: path.to_owned(),
            width_mm: sheet.width_mm,
            height_mm: sheet.height_mm,
            limit: format!("PDF allows {MAX_PAGE_MM} mm: choose smaller paper"),
        });
    }
    let bytes = to_bytes(artwork);
    Ok(atomic::write(path, |file| file.write_all(&bytes))?)
}

/// All sheets as one PDF.
pub fn to_bytes(artwork: &Artwork) -> Vec<u8> {
    let mut document = PdfDocument::new(&artwork.title);
    document.with_pages(artwork.sheets.iter().map(page).collect());
    let mut document = document.to_lopdf_document(&PdfSaveOptions::default(), &mut Vec::new());
    document.version = VERSION.to_owned();
    document.compress();
    finish(&mut document, artwork);
    let mut bytes = Vec::new();
    document.save_to(&mut bytes).expect("writing to memory does not fail");
    bytes
}

/// Sets what printpdf has no words for: print scaling, and metadata without dates or random ids.
fn finish(document: &mut lopdf::Document, artwork: &Artwork) {
    let name = |name: &str| Object::Name(name.as_bytes().to_vec());
    if let Ok(catalog) = document.catalog_mut() {
        let preferences = Dictionary::from_iter([("PrintScaling", name("None"))]);
        catalog.set("ViewerPreferences", preferences);
        catalog.set("PageLayout", name("SinglePage"));
    }
    let info = Dictionary::from_iter([
        ("Title", lopdf::text_string(&artwork.title)),
        ("Subject", lopdf::text_string(&artwork.subject)),
        ("Creator", lopdf::text_string(GENERATOR)),
    ]);
    if let Ok(id) = document.trailer.get(b"Info").and_then(Object::as_reference) {
        document.set_object(id, info);
    }
    document.trailer.remove(b"ID");
    let mut content = Vec::new();
    document.save_to(&mut content).expect("writing to memory does not fail");
    let digest = Sha256::digest(&content)[..16].to_vec();
    let id = Object::String(digest, StringFormat::Hexadecimal);
    document.trailer.set("ID", vec![id.clone(), id]);
}

fn page(sheet: &Sheet) -> PdfPage {
    let size = Rect::from_wh(pt(sheet.width_mm), pt(sheet.height_mm));
    let black = Color::Cmyk(Cmyk::new(0.0, 0.0, 0.0, 1.0, None));
    let mut ops = vec![Op::SetFillColor { col: black.clone() }, Op::SetOutlineColor { col: black }];
    sheet.shapes.iter().for_each(|shape| ops.extend(draw(shape)));
    PdfPage { media_box: size.clone(), trim_box: size.clone(), crop_box: size, ops }
}

fn draw(shape: &Shape) -> Vec<Op> {
    let contours = contours(&shape.path);
    match shape.paint {
        Paint::Fill => {
            let polygon = Polygon {
                rings: contours
                    .into_iter()
                    .map(|line| PolygonRing { points: line.points })
                    .collect(),
                mode: PaintMode::Fill,
                winding_order: WindingOrder::EvenOdd,
            };
            vec![Op::DrawPolygon { polygon }]
        }
        Paint::Stroke { width_mm } => {
            let width = Op::SetOutlineThickness { pt: pt(width_mm) };
            let lines = contours.into_iter().map(|line| Op::DrawLine { line });
            std::iter::once(width).chain(lines).collect()
        }
    }
}

/// The contours of a path in points; PDF knows cubic curves only.
fn contours(path: &BezPath) -> Vec<Line> {
    let mut contours = Vec::<Line>::new();
    let mut at = Point::ZERO;
    for element in path.elements() {
        let points: &[Point] = match *element {
            PathEl::MoveTo(p) => {
                contours.push(Line::default());
                &[p]
            }
            PathEl::LineTo(p) => &[p],
            PathEl::QuadTo(c, p) => &[at.lerp(c, 2.0 / 3.0), p.lerp(c, 2.0 / 3.0), p],
            PathEl::CurveTo(a, b, p) => &[a, b, p],
            PathEl::ClosePath => {
                contours.last_mut().expect("a path starts with a move").is_closed = true;
                continue;
            }
        };
        let contour = contours.last_mut().expect("a path starts with a move");
        for (i, &p) in points.iter().enumerate() {
            let p_pt = printpdf::Point { x: pt(p.x), y: pt(p.y) };
            contour.points.push(LinePoint { p: p_pt, bezier: i + 1 < points.len() });
            at = p;
        }
    }
    contours
}

fn pt(mm: f64) -> Pt {
    Pt((mm * PT_PER_MM) as f32)
}
