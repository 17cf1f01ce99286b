//! PDF: all sheets in one file, one page each.
//!
//! Black is pure K (CMYK). A finish may name spot colours: a white beneath the whole page, and a
//! colour for cut lines. All of them overprint, so no separation is knocked out under another.
//! Devices without these inks show the white as paper and the lines as black. The page boxes have
//! the size of the page in points, and viewers are asked to print without scaling. The same artwork
//! gives the same bytes: there are no dates, and the identifier of the file is a digest of its
//! content.

use std::path::Path;

use kurbo::{BezPath, PathEl, Point, Rect, Shape as _};
use lopdf::content::{Content, Operation};
use lopdf::xref::XrefType;
use lopdf::{Dictionary, Document, Object, Stream, StringFormat, dictionary};
use sha2::{Digest, Sha256};

use crate::export::writing::atomic;
use crate::export::{ExportError, GENERATOR};
use deltille_layout::artwork::{Artwork, Paint, Part, Sheet};
use deltille_layout::{Finish, LineKind};

/// Version of the PDF format.
pub const VERSION: &str = "1.6";

/// Points per millimetre.
const PT_PER_MM: f64 = 72.0 / 25.4;

/// Maximum side of a page that all readers accept, mm: 14400 points.
const MAX_PAGE_MM: f64 = 5080.0;

/// Resource names in the content of a page: the colour space of the white, that of the cut lines, and the state in which
/// everything overprints.
pub const WHITE: &str = "White";
/// See [`WHITE`].
pub const CONTOUR: &str = "Contour";
/// See [`WHITE`].
pub const OVERPRINT: &str = "Overprint";

/// The colour spaces of a finish: a separation for each spot colour. Devices without the ink show nothing or black.
pub fn color_spaces(finish: &Finish) -> Dictionary {
    let mut spaces = Dictionary::new();
    for (key, name, black) in [(WHITE, &finish.white, 0), (CONTOUR, &finish.contour, 1)] {
        let Some(name) = name else { continue };
        let cmyk = |black: i64| -> Vec<Object> { [0, 0, 0, black].map(Object::from).to_vec() };
        let tint = dictionary! {
            "FunctionType" => 2, "Domain" => vec![0.into(), 1.into()], "C0" => cmyk(0), "C1" => cmyk(black), "N" => 1,
        };
        let name = Object::Name(name.clone().into_bytes());
        let space = vec!["Separation".into(), name, "DeviceCMYK".into(), tint.into()];
        spaces.set(key, space);
    }
    spaces
}

/// The graphics states of a finish: with spot colours, the state in which everything overprints.
pub fn graphics_states(finish: &Finish) -> Dictionary {
    let mut states = Dictionary::new();
    if finish.spots().next().is_some() {
        let state = dictionary! { "Type" => "ExtGState", "OP" => true, "op" => true, "OPM" => 1 };
        states.set(OVERPRINT, state);
    }
    states
}

/// Writes all sheets as one PDF file.
///
/// # Errors
/// Returns an error if a page is larger than PDF allows, or if the file cannot be written.
pub fn write(artwork: &Artwork, path: &Path) -> Result<(), ExportError> {
    let long = |sheet: &&Sheet| sheet.width_mm.max(sheet.height_mm) > MAX_PAGE_MM;
    if let Some(sheet) = artwork.sheets.iter().find(long) {
        return Err(ExportError::TooLarge {
            path: path.to_owned(),
            width_mm: sheet.width_mm,
            height_mm: sheet.height_mm,
            limit: format!("PDF allows at most {MAX_PAGE_MM} mm: choose smaller paper"),
        });
    }
    let bytes = to_bytes(artwork);
    Ok(atomic::write(path, |file| file.write_all(&bytes))?)
}

/// Returns the bytes of one PDF file with all sheets; the same artwork gives the same bytes.
///
/// ```
/// use deltille_layout::Printing;
/// use deltille_core::targets::BoardSpec;
/// use deltille_files::export::pdf;
///
/// let board = Printing::new("desk", BoardSpec::deltille(4, 5, 20.0))?;
/// assert!(pdf::to_bytes(&board.draw()?).starts_with(b"%PDF-1.6"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn to_bytes(artwork: &Artwork) -> Vec<u8> {
    let mut document = document(artwork);
    document.compress();
    let identifier = identifier(&mut document);
    document.trailer.set("ID", identifier);
    saved(&mut document)
}

/// The document without its identifier; objects in the order of their numbers.
fn document(artwork: &Artwork) -> Document {
    let mut document = Document::with_version(VERSION);
    document.reference_table.cross_reference_type = XrefType::CrossReferenceTable;
    let pages = document.new_object_id();
    let states = graphics_states(&artwork.finish);
    let [font, xobject, state, shading] =
        [Dictionary::new(), Dictionary::new(), states, Dictionary::new()]
            .map(|resource| document.add_object(resource));
    let spaces = color_spaces(&artwork.finish);
    let spaces = (!spaces.is_empty()).then(|| document.add_object(spaces));
    let kids: Vec<_> = artwork.sheets.iter().map(|_| document.new_object_id()).collect();
    for (sheet, &kid) in artwork.sheets.iter().zip(&kids) {
        let mut resources = dictionary! {
            "Font" => font, "XObject" => xobject, "ExtGState" => state, "Shading" => shading,
        };
        if let Some(spaces) = spaces {
            resources.set("ColorSpace", spaces);
        }
        let resources = document.add_object(resources);
        let content = Content { operations: operations(sheet, &artwork.finish) }.encode();
        let content = content.expect("writing to memory does not fail");
        let content = document.add_object(Stream::new(Dictionary::new(), content));
        let size = vec![0f32.into(), 0f32.into(), pt(sheet.width_mm), pt(sheet.height_mm)];
        let page = dictionary! {
            "Type" => "Page", "MediaBox" => size.clone(), "TrimBox" => size.clone(), "CropBox" => size,
            "Parent" => pages, "Resources" => resources, "Contents" => content,
            "Annots" => Vec::<Object>::new(),
        };
        document.set_object(kid, page);
    }
    let count = kids.len() as i64;
    let kids: Vec<Object> = kids.into_iter().map(Object::from).collect();
    document.set_object(pages, dictionary! { "Type" => "Pages", "Count" => count, "Kids" => kids });
    let catalog = document.add_object(dictionary! {
        "Type" => "Catalog", "PageLayout" => "SinglePage", "PageMode" => "UseNone", "Pages" => pages,
        "ViewerPreferences" => dictionary! { "PrintScaling" => "None" },
    });
    let info = document.add_object(dictionary! {
        "Title" => lopdf::text_string(&artwork.title),
        "Subject" => lopdf::text_string(&artwork.subject),
        "Creator" => lopdf::text_string(GENERATOR),
    });
    document.trailer.set("Root", catalog);
    document.trailer.set("Info", info);
    document
}

/// The identifier: a digest of the content instead of a random number, which makes the file reproducible.
fn identifier(document: &mut Document) -> Vec<Object> {
    let digest = Sha256::digest(saved(document))[..16].to_vec();
    vec![Object::String(digest, StringFormat::Hexadecimal); 2]
}

fn saved(document: &mut Document) -> Vec<u8> {
    let mut bytes = Vec::new();
    document.save_to(&mut bytes).expect("writing to memory does not fail");
    bytes
}

/// The operators that draw a sheet: the background, then all marks in black, except lines in a spot colour.
fn operations(sheet: &Sheet, finish: &Finish) -> Vec<Operation> {
    let black: Vec<Object> = [0f32, 0.0, 0.0, 1.0].map(Object::from).to_vec();
    let mut operations = beneath(sheet, finish);
    operations.extend([Operation::new("k", black.clone()), Operation::new("K", black.clone())]);
    for shape in &sheet.shapes {
        let in_spot = matches!(shape.part, Part::Line { kind: LineKind::Cut, .. })
            && finish.contour.is_some();
        if in_spot {
            operations.push(Operation::new("CS", vec![CONTOUR.into()]));
            operations.push(Operation::new("SCN", vec![1.into()]));
        }
        match shape.paint {
            Paint::Fill => {
                operations
                    .extend(contours(&shape.path).into_iter().flat_map(|contour| contour.drawn));
                operations.extend([Operation::new("h", vec![]), Operation::new("f*", vec![])]);
            }
            Paint::Stroke { width_mm } => {
                operations.push(Operation::new("w", vec![pt(width_mm)]));
                for Contour { drawn, is_closed } in contours(&shape.path) {
                    operations.extend(drawn);
                    operations.extend(is_closed.then(|| Operation::new("h", vec![])));
                    operations.push(Operation::new("S", vec![]));
                }
            }
        }
        if in_spot {
            operations.push(Operation::new("K", black.clone()));
        }
    }
    operations
}

/// The operators before the marks of a sheet: with spot colours, the overprint state and the white.
fn beneath(sheet: &Sheet, finish: &Finish) -> Vec<Operation> {
    let mut operations = Vec::new();
    if finish.spots().next().is_some() {
        operations.push(Operation::new("gs", vec![OVERPRINT.into()]));
    }
    if finish.white.is_some() {
        operations.push(Operation::new("cs", vec![WHITE.into()]));
        operations.push(Operation::new("scn", vec![1.into()]));
        let page = Rect::new(0.0, 0.0, sheet.width_mm, sheet.height_mm).to_path(1.0);
        operations.extend(contours(&page).into_iter().flat_map(|contour| contour.drawn));
        operations.extend([Operation::new("h", vec![]), Operation::new("f*", vec![])]);
    }
    operations
}

/// One piece of a path.
struct Contour {
    drawn: Vec<Operation>,
    is_closed: bool,
}

/// The contours of a path. PDF has only cubic curves, so quadratic curves are converted.
fn contours(path: &BezPath) -> Vec<Contour> {
    let mut contours = Vec::<Contour>::new();
    let mut at = Point::ZERO;
    for element in path.elements() {
        let (operator, points): (&str, &[Point]) = match *element {
            PathEl::MoveTo(p) => {
                contours.push(Contour { drawn: Vec::new(), is_closed: false });
                ("m", &[p])
            }
            PathEl::LineTo(p) => ("l", &[p]),
            PathEl::QuadTo(c, p) => ("c", &[at.lerp(c, 2.0 / 3.0), p.lerp(c, 2.0 / 3.0), p]),
            PathEl::CurveTo(a, b, p) => ("c", &[a, b, p]),
            PathEl::ClosePath => {
                contours.last_mut().expect("a path starts with a move").is_closed = true;
                continue;
            }
        };
        let operands = points.iter().flat_map(|p| [pt(p.x), pt(p.y)]).collect();
        let contour = contours.last_mut().expect("a path starts with a move");
        contour.drawn.push(Operation::new(operator, operands));
        at = points.last().copied().unwrap_or(at);
    }
    contours
}

fn pt(mm: f64) -> Object {
    Object::Real((mm * PT_PER_MM) as f32)
}
