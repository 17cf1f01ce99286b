//! Verification of drawings of boards and faces for a laser or a plotter, as `.dxf` or `.svg`.
//!
//! The kerf is measured: it follows from the difference between the perimeters of the first cut
//! outline and of the finished plate. With that kerf, every outline must then be at
//! its position in the target.
//! Independently of that, the half kerf that the beam removes is added back to the engraved areas,
//! and the detector examines the resulting board like a printed page. resvg also renders an SVG,
//! which must show nothing but the parsed outlines.

use std::path::Path;

use glam::DVec2;
use rayon::prelude::*;

use crate::cut::outlines;
use crate::document::drawing::MAX_PIXELS;
use crate::document::opened::Document;
use crate::error::VerifyError;
use crate::finding::any::{Finding, PageFinding};
use crate::finding::construct::ConstructFinding;
use crate::finding::cut::CutFinding;
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::names::file_name;
use crate::reading::reader::Reader;
use crate::sheet::face_picture::FacePicture;
use crate::sheet::whole;
use crate::verdict::{CutVerdict, SheetVerdict, Verdict};
use crate::verifier::{PRINT_PX_PER_MM, Verifier};
use deltille_core::raster::Coverage;
use deltille_core::targets::Target;
use deltille_files::export::dxf::{self, DxfError};
use deltille_files::export::{laser_file_name, laser_svg};
use deltille_layout::artwork;
use deltille_layout::artwork::{CutDrawing, CutLayer, CuttingError, LaserBoard};

/// Kerfs closer than this to a round value are taken as that value, mm: coordinates are written with four digits.
const KERF_STEP_MM: f64 = 1e-4;

/// Largest difference between the ink of a pixel as sampled by resvg and its coverage, including a hairline.
const MAX_INK: f64 = 0.25;

/// Whether a file name is that of a drawing for a laser.
pub(crate) fn is_named(target: &Target, path: &Path) -> bool {
    let name = file_name(path);
    let ending = |extension: &str| laser_file_name("", extension);
    let ends = ["dxf", "svg"].iter().any(|extension| name.ends_with(&ending(extension)));
    // Exclude a page of a target whose own name has this ending.
    ends && !name.starts_with(&format!("{}.", target.name))
}

/// Reads a drawing and compares it with the boards of the target.
///
/// # Errors
///
/// Returns an error if the file cannot be read or the target does not have this drawing. Deviations are findings of
/// the verdict.
pub(crate) fn verify(
    verifier: &Verifier,
    reader: &Reader,
    path: &Path,
    format: Format,
) -> Result<Verdict, VerifyError> {
    let nothing = |source| VerifyError::NothingToCut { path: path.to_owned(), source };
    let boards = artwork::laser_boards(&verifier.printing).map_err(nothing)?;
    let mut cut = CutVerdict::default();
    let with = |cut, findings| Verdict { cut: Some(cut), ..Verdict::new(path, format, findings) };
    let found = match read(verifier, reader, path, format)? {
        Ok(found) => found,
        Err(refused) => return Ok(with(cut, vec![refused])),
    };
    let Some(by_mm) = kerf_of(&found, &boards) else {
        let missing =
            CutFinding::PathMissing { layer: dxf::layer_name(CutLayer::Cut), at_mm: DVec2::ZERO };
        return Ok(with(cut, vec![missing.into()]));
    };
    let kerf_mm = (by_mm / KERF_STEP_MM).round() * KERF_STEP_MM;
    let stated = match artwork::to_laser(&verifier.printing, kerf_mm.max(0.0)) {
        Ok(stated) if kerf_mm >= 0.0 => stated,
        Ok(_) | Err(CuttingError::Kerf { .. }) => {
            return Ok(with(cut, vec![CutFinding::NoKerf { by_mm }.into()]));
        }
        Err(error) => return Err(nothing(error)),
    };
    cut.kerf_mm = Some(kerf_mm);
    let found = if format == Format::Svg { moved(found, &stated) } else { found };
    let mut findings = outlines::compare(found.clone(), stated, &mut cut);
    cut.size_mm = cut.size_mm.map(|mm| mm - kerf_mm);
    // Render the drawing only if its outlines are at their positions, so that it is small enough.
    if format == Format::Svg && findings.is_empty() {
        findings = differs_when_rendered(reader, path, &found)?;
    }
    let mut verdict = with(cut, findings);
    if verdict.passed {
        verdict.sheets = surfaces(verifier, &boards, &found, kerf_mm);
        verdict.passed = verdict.sheets.iter().all(|sheet| sheet.findings.is_empty());
    }
    Ok(verdict)
}

/// Returns the drawing in a file, or the reason why it is rejected.
fn read(
    verifier: &Verifier,
    reader: &Reader,
    path: &Path,
    format: Format,
) -> Result<Result<CutDrawing, Finding>, DocumentError> {
    let text = reader.read_text(path)?;
    let refused = |line: usize, construct: String| -> Finding {
        ConstructFinding::Construct { place: format!("line {line}"), construct }.into()
    };
    Ok(match format {
        Format::Svg => {
            let subject = artwork::subject(verifier.target());
            laser_svg::read(&text, &verifier.target().name, &subject).map_err(|line| {
                refused(line, "an element that does not belong in a drawing for a laser".to_owned())
            })
        }
        _ => match dxf::read(&text) {
            Ok(drawing) => Ok(drawing),
            Err(DxfError::Construct { line, construct }) => Err(refused(line, construct)),
            Err(error) => return Err(DocumentError::unreadable(path, error.to_string())),
        },
    })
}

/// Returns the kerf of the first cut outline, mm, from its length; `None` without an outline.
fn kerf_of(found: &CutDrawing, boards: &[LaserBoard]) -> Option<f64> {
    let length = |outline: &[DVec2]| {
        let next = outline.iter().cycle().skip(1);
        outline.iter().zip(next).map(|(from, to)| from.distance(*to)).sum::<f64>()
    };
    let board = boards.first()?;
    let holes = if board.panel.hole_mm.is_some() { board.panel.tags.len() } else { 0 };
    let cut = found.paths.iter().filter(|path| path.layer == CutLayer::Cut).nth(holes)?;
    // All edges move by the same distance, so the number of corners is unchanged and the length
    // grows linearly.
    let finished = length(&board.plate_mm);
    let by_a_millimetre = length(&artwork::moved_inwards(&board.plate_mm, -0.5)) - finished;
    Some((length(&cut.points_mm) - finished) / by_a_millimetre)
}

/// Moves a drawing so that its cut outlines start where the stated ones do: the origin of an SVG is arbitrary.
fn moved(mut found: CutDrawing, stated: &CutDrawing) -> CutDrawing {
    let lower_left = |drawing: &CutDrawing| {
        let cuts = drawing.paths.iter().filter(|path| path.layer == CutLayer::Cut);
        let points = cuts.flat_map(|path| &path.points_mm).copied();
        points.reduce(DVec2::min).unwrap_or_default()
    };
    let by = lower_left(stated) - lower_left(&found);
    let points = found.paths.iter_mut().flat_map(|path| &mut path.points_mm);
    points.for_each(|point| *point += by);
    found
}

/// Returns the first location where an SVG, as resvg renders it, differs from the parsed outlines.
fn differs_when_rendered(
    reader: &Reader,
    path: &Path,
    found: &CutDrawing,
) -> Result<Vec<Finding>, DocumentError> {
    let document = Document::read_by(reader, path)?;
    let size = document.size_mm(0);
    let [left, lower, right, upper] = found.bounds_mm().unwrap_or_default();
    let stated = DVec2::new(right - left, upper - lower) + 2.0 * laser_svg::AROUND_MM;
    if (size - stated).abs().max_element() > document.size_tolerance_mm() {
        return Ok(vec![PageFinding::PageSize { found_mm: size, stated_mm: stated }.into()]);
    }
    let finest = (MAX_PIXELS / size.element_product()).sqrt();
    let page = document.render(0, PRINT_PX_PER_MM.min(finest))?;
    // The drawing is in the centre of the image.
    let origin = (size - DVec2::new(right - left, upper - lower)) / 2.0 - DVec2::new(left, lower);
    let mut cover = Coverage::new(page.image.width(), page.image.height());
    for path in found.paths.iter().filter(|path| path.layer == CutLayer::Engrave) {
        let pixels = path.points_mm.iter().rev().map(|&point| page.px_from_page(point + origin));
        cover.add(&pixels.collect::<Vec<DVec2>>(), 1.0);
    }
    let stated = cover.finish();
    let shown = page.image.pixels().iter().map(|&pixel| 1.0 - f64::from(pixel) / 255.0);
    let differs = |(stated, shown): (&f32, f64)| (f64::from(stated.abs()) - shown).abs() > MAX_INK;
    let first = stated.pixels().iter().zip(shown).position(differs);
    Ok(first.map_or_else(Vec::new, |index| {
        let width = page.image.width();
        let pixel = DVec2::new((index % width) as f64, (index / width) as f64);
        vec![CutFinding::DrawnOtherwise { at_mm: page.page_from_px(pixel) }.into()]
    }))
}

/// Compares the boards as they are after engraving, like printed pages.
fn surfaces(
    verifier: &Verifier,
    boards: &[LaserBoard],
    found: &CutDrawing,
    kerf_mm: f64,
) -> Vec<SheetVerdict> {
    let surface = |(index, board): (usize, &LaserBoard)| {
        let on_board = found.paths.iter().filter(|path| {
            path.layer == CutLayer::Engrave
                && path.points_mm.first().is_some_and(|&p| board.holds(p))
        });
        let engraved: Vec<Vec<DVec2>> = on_board
            .map(|path| {
                let burnt = artwork::moved_inwards(&path.points_mm, -kerf_mm / 2.0);
                let seen = burnt.into_iter().map(|point| board.board_from_drawing(point));
                let mut seen: Vec<DVec2> = seen.collect();
                if verifier.printing.finish.mirrored {
                    seen.reverse();
                }
                seen
            })
            .collect();
        let picture = FacePicture::new(verifier, board.panel, &board.plate_mm);
        let dark = engraved.iter().map(|outline| (outline.as_slice(), 1.0));
        let (page, layout) = picture.inked(dark);
        let mut sheet = SheetVerdict::new(index, &page, Vec::new());
        whole::compare(verifier, &page, &layout, &mut sheet);
        sheet
    };
    boards.par_iter().enumerate().map(surface).collect()
}
