//! Verdicts on an artifact, its sheets and its faces, as values and as text.

use std::fmt;
use std::path::Path;

use glam::DVec2;
use serde::Serialize;

use crate::document::page::Page;
use crate::finding::any::Finding;
use crate::reading::format::Format;
use crate::reading::names::file_name;
use deltille_core::words::counted;

/// The result for one artifact.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Verdict {
    /// File name of the artifact.
    pub artifact: String,
    /// Format of the file.
    pub format: Format,
    /// Whether the artifact agrees with the target, that is, has no findings.
    pub passed: bool,
    /// Findings about the file as a whole.
    pub findings: Vec<Finding>,
    /// Pages of a document, in order; empty for other files.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sheets: Vec<SheetVerdict>,
    /// Faces of a mesh, in order; empty for other files.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faces: Vec<FaceVerdict>,
    /// Result for a body to print; `None` for other files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<BodyVerdict>,
    /// Result for two bodies to print; `None` for other files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inlay: Option<InlayVerdict>,
    /// Result for a list for other detectors; `None` for other files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub list: Option<ListVerdict>,
    /// Result for a drawing for a cutter; `None` for other files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut: Option<CutVerdict>,
}

/// The result for a list of boards for other detectors.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ListVerdict {
    /// Boards of the target that are listed.
    pub boards: usize,
    /// Corners of these boards that are listed.
    pub corners: usize,
    /// Tags of these boards that are listed at their positions.
    pub tags: usize,
    /// Largest distance of a listed corner from its stated position, mm.
    pub max_deviation_mm: f64,
}

/// The result for a drawing for a cutter.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CutVerdict {
    /// Width and height of the drawing, or of a plate that is cut with it, mm.
    pub size_mm: [f64; 2],
    /// Outlines found at their positions.
    pub outlines: usize,
    /// Fold lines found at their positions.
    pub folds: usize,
    /// Engraved outlines found at their positions.
    pub engraved: usize,
    /// Largest distance of a point of these from its stated position, mm.
    pub max_deviation_mm: f64,
    /// Allowance for the width of the laser beam in the drawing of a board, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kerf_mm: Option<f64>,
}

/// The result for a body to print.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct BodyVerdict {
    /// Number of triangles of its surface.
    pub triangles: usize,
    /// Volume of the body, mm³.
    pub volume_mm3: f64,
    /// Number of seats of a skeleton with the stated depth and outline.
    pub seats: usize,
    /// Largest distance of a vertex, or of the floor of a seat, from its stated position, mm.
    pub max_deviation_mm: f64,
}

/// The result for a black body inlaid in a white one.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct InlayVerdict {
    /// Number of triangles of both bodies.
    pub triangles: usize,
    /// Depth of the black body, mm.
    pub inlay_mm: f64,
    /// Thickness of the plate of a board, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plate_mm: Option<f64>,
    /// Volume of the white body, mm³.
    pub white_mm3: f64,
    /// Volume of the black body, mm³.
    pub black_mm3: f64,
}

/// The result for one face of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FaceVerdict {
    /// Panel id.
    pub panel: u32,
    /// Resolution of the rendered face, px/mm.
    pub px_per_mm: f64,
    /// Corners that the target has on this face.
    pub corners: usize,
    /// Corners found with the right label.
    pub corners_found: usize,
    /// Tags that the target has on this face.
    pub tags: usize,
    /// Tags read without a wrong bit.
    pub tags_exact: usize,
    /// Largest distance of a found corner on the mesh from its stated position, mm.
    pub max_deviation_mm: f64,
    /// Findings about this face.
    pub findings: Vec<Finding>,
}

/// The result for one sheet.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SheetVerdict {
    /// Whether its corners are the centres of circles.
    #[serde(skip)]
    pub has_discs: bool,
    /// Number of the sheet of the target, from 1.
    pub sheet: usize,
    /// Resolution of the rendered page, px/mm.
    pub px_per_mm: f64,
    /// Page size as the file states it, mm.
    pub size_mm: DVec2,
    /// Lengths of the check bars, mm: stated, and measured where both ends were found.
    pub check_bars_mm: Vec<(f64, Option<f64>)>,
    /// Corners that the target has on this sheet.
    pub corners: usize,
    /// Corners found with the right label.
    pub corners_found: usize,
    /// Tags that the target has on this sheet.
    pub tags: usize,
    /// Tags that read exactly as stated in every cell.
    pub tags_exact: usize,
    /// Largest distance of a found corner from its stated position, mm.
    pub max_deviation_mm: f64,
    /// Number of pages on which the sheet is printed.
    pub pages: usize,
    /// Result of folding the net.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fold: Option<FoldVerdict>,
    /// Findings about this sheet.
    pub findings: Vec<Finding>,
}

/// The result of folding the faces on one sheet of a net.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FoldVerdict {
    /// Largest distance of a folded corner from its stated position in space, or between the ends of the two sides of
    /// an edge, mm.
    pub max_deviation_mm: f64,
    /// Number of edges whose second side is on this sheet and meets the first.
    pub edges: usize,
}

/// Number of findings named in the line of text; the JSON report lists all.
const NAMED: usize = 4;

impl Verdict {
    /// Creates the verdict on a file as a whole; the caller adds the results for its parts.
    pub(super) fn new(path: &Path, format: Format, findings: Vec<Finding>) -> Self {
        Self {
            artifact: file_name(path),
            format,
            passed: findings.is_empty(),
            findings,
            sheets: Vec::new(),
            faces: Vec::new(),
            body: None,
            inlay: None,
            list: None,
            cut: None,
        }
    }

    /// Adds the findings of the inspection of the file.
    pub(super) fn with(mut self, refused: Vec<Finding>) -> Self {
        self.passed &= refused.is_empty();
        self.findings.extend(refused);
        self
    }

    /// Writes the numbers of corners and tags on the surfaces.
    fn corners_and_tags(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, ", {}", self.corners())?;
        write_tags(f, self.sheets.iter().map(|s| s.tags_exact).sum())
    }

    /// Describes the corners or circles on the surfaces.
    fn corners(&self) -> String {
        let deviation = self.sheets.iter().map(|s| s.max_deviation_mm).fold(0.0, f64::max);
        let what = if self.sheets.iter().all(|s| s.has_discs) { "circle" } else { "corner" };
        let corners = counted(self.sheets.iter().map(|s| s.corners_found).sum(), what);
        format!("{corners} within {deviation:.4} mm")
    }
}

/// Writes the number of exact tags, if there are any.
fn write_tags(f: &mut fmt::Formatter<'_>, tags: usize) -> fmt::Result {
    match tags {
        0 => Ok(()),
        _ => write!(f, ", {} exact", counted(tags, "tag")),
    }
}

impl fmt::Display for ListVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { boards, corners, tags, max_deviation_mm } = self;
        let (boards, corners) = (counted(*boards, "board"), counted(*corners, "corner"));
        write!(f, "verified, {boards}, {corners} listed within {max_deviation_mm:.4} mm, ")?;
        write!(f, "{}", counted(*tags, "tag"))
    }
}

impl fmt::Display for CutVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { size_mm: [width, height], outlines, folds, engraved, max_deviation_mm, kerf_mm } =
            self;
        let (outlines, folds) = (counted(*outlines, "outline"), counted(*folds, "line"));
        write!(f, "verified, {width:.1} × {height:.1} mm, {outlines} to cut, ")?;
        match kerf_mm {
            None => write!(f, "{folds} to fold, {engraved} engraved, ")?,
            Some(0.0) => write!(f, "{engraved} engraved, ")?,
            Some(kerf) => write!(f, "{engraved} engraved, for a kerf of {kerf:.3} mm, ")?,
        }
        write!(f, "within {max_deviation_mm:.4} mm")
    }
}

impl fmt::Display for InlayVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { triangles, inlay_mm, plate_mm, white_mm3, black_mm3 } = self;
        let [white, black] = [white_mm3, black_mm3].map(|mm3| mm3 / 1e3);
        write!(f, "verified, two closed bodies of {}, ", counted(*triangles, "triangle"))?;
        write!(f, "{black:.2} cm³ black, {inlay_mm:.2} mm deep, in {white:.2} cm³ white")?;
        plate_mm.map_or(Ok(()), |mm| write!(f, ", {mm:.2} mm thick"))
    }
}

impl fmt::Display for Verdict {
    /// Writes one line that lists the verified items or the findings.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.artifact)?;
        if !self.passed {
            return self.failure(f);
        }
        if let Some(list) = &self.list {
            return write!(f, "{list}");
        }
        if let Some(cut) = &self.cut {
            write!(f, "{cut}")?;
            return if self.sheets.is_empty() { Ok(()) } else { self.corners_and_tags(f) };
        }
        if let Some(body) = &self.body {
            return body.describe(f);
        }
        if let Some(inlay) = &self.inlay {
            write!(f, "{inlay}")?;
            return self.corners_and_tags(f);
        }
        if self.faces.is_empty() { self.pages(f) } else { self.in_space(f) }
    }
}

impl BodyVerdict {
    fn describe(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { triangles, volume_mm3, seats, max_deviation_mm } = self;
        write!(f, "verified, closed body of {}, ", counted(*triangles, "triangle"))?;
        write!(f, "{:.1} cm³, ", volume_mm3 / 1e3)?;
        match seats {
            0 => write!(f, "vertices within {max_deviation_mm:.4} mm"),
            _ => write!(f, "{} within {max_deviation_mm:.4} mm", counted(*seats, "seat")),
        }
    }
}

impl Verdict {
    /// Writes what was verified on the faces of a mesh.
    fn in_space(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sum = |count: fn(&FaceVerdict) -> usize| self.faces.iter().map(count).sum::<usize>();
        let deviation = self.faces.iter().map(|s| s.max_deviation_mm).fold(0.0, f64::max);
        let corners = counted(sum(|s| s.corners_found), "corner");
        let faces = counted(self.faces.len(), "face");
        write!(f, "verified, {faces}, {corners} in space within {deviation:.4} mm")?;
        write_tags(f, sum(|s| s.tags_exact))
    }

    /// Writes what was verified on pages.
    fn pages(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sum = |count: fn(&SheetVerdict) -> usize| self.sheets.iter().map(count).sum::<usize>();
        write!(f, "verified, ")?;
        let pages = sum(|s| s.pages);
        if pages > 1 {
            write!(f, "{pages} pages, ")?;
        }
        // A sheet of single tags has no corners.
        if sum(|s| s.corners_found) > 0 {
            write!(f, "{}, ", self.corners())?;
        }
        let folds: Vec<&FoldVerdict> = self.sheets.iter().filter_map(|s| s.fold.as_ref()).collect();
        if !folds.is_empty() {
            let off = folds.iter().map(|fold| fold.max_deviation_mm).fold(0.0, f64::max);
            let edges: usize = folds.iter().map(|fold| fold.edges).sum();
            write!(f, "folds into the solid within {off:.4} mm, ")?;
            write!(f, "{} matched, ", counted(edges, "edge"))?;
        }
        let tags = sum(|s| s.tags_exact);
        if tags > 0 {
            write!(f, "{} exact, ", counted(tags, "tag"))?;
        }
        let bars = self.sheets.iter().flat_map(|s| &s.check_bars_mm);
        let bars: Vec<String> =
            bars.filter_map(|(_, found)| Some(format!("{:.2}", (*found)?))).collect();
        match bars.as_slice() {
            [] => write!(f, "page size exact"),
            bars if bars.len() > NAMED => write!(f, "{} check bars, page size exact", bars.len()),
            bars => write!(f, "check bars {} mm, page size exact", bars.join(" and ")),
        }
    }

    /// Writes the findings.
    fn failure(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let everywhere = self.findings.iter().map(ToString::to_string);
        let on_sheets = self.sheets.iter().flat_map(|sheet| {
            let page = if self.sheets.len() > 1 {
                format!("{} {}: ", if sheet.pages > 1 { "sheet" } else { "page" }, sheet.sheet)
            } else {
                String::new()
            };
            sheet.findings.iter().map(move |finding| format!("{page}{finding}"))
        });
        let on_faces = self.faces.iter().flat_map(|face| {
            face.findings.iter().map(move |finding| format!("on board {}: {finding}", face.panel))
        });
        let all: Vec<String> = everywhere.chain(on_sheets).chain(on_faces).collect();
        write!(f, "FAILED, {}", all[..all.len().min(NAMED)].join("; "))?;
        match all.len().saturating_sub(NAMED) {
            0 => Ok(()),
            more => write!(f, "; and {more} more"),
        }
    }
}

impl SheetVerdict {
    /// Creates the verdict on a page of which only the size has been checked.
    pub(crate) fn new(index: usize, page: &Page, findings: Vec<Finding>) -> Self {
        Self {
            sheet: index + 1,
            has_discs: false,
            px_per_mm: page.px_per_mm,
            size_mm: DVec2::new(page.width_mm, page.height_mm),
            check_bars_mm: Vec::new(),
            corners: 0,
            corners_found: 0,
            tags: 0,
            tags_exact: 0,
            max_deviation_mm: 0.0,
            pages: 1,
            fold: None,
            findings,
        }
    }
}
