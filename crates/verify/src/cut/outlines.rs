//! Verification of drawings for a cutter (`.dxf`): outlines, folds and numbers must be those of the target, each on
//! its layer and at its position.

use std::path::Path;

use crate::error::VerifyError;
use crate::finding::any::Finding;
use crate::finding::construct::ConstructFinding;
use crate::finding::cut::CutFinding;
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::reader::Reader;
use crate::verdict::{CutVerdict, Verdict};
use crate::verifier::Verifier;
use deltille_files::export::dxf::{self, DxfError};
use deltille_layout::artwork;
use deltille_layout::artwork::{CutDrawing, CutLayer, CutPath};

/// Largest accepted deviation of a point, mm: a hundredth of the accuracy of a cutter.
const CUT_TOLERANCE_MM: f64 = 0.001;

/// Distance within which a path is treated as a displaced stated path, mm.
const MOVED_MM: f64 = 20.0;

/// Reads a `.dxf` and compares it with the target's panels or its net, depending on the file name.
pub(crate) fn verify(
    verifier: &Verifier,
    reader: &Reader,
    path: &Path,
) -> Result<Verdict, VerifyError> {
    let stated = stated(verifier, path)?;
    let text = reader.read_text(path)?;
    let mut cut = CutVerdict::default();
    let findings = match dxf::read(&text) {
        Ok(found) => compare(found, stated, &mut cut),
        Err(DxfError::Construct { line, construct }) => {
            vec![ConstructFinding::Construct { place: format!("line {line}"), construct }.into()]
        }
        Err(error) => {
            return Err(DocumentError::unreadable(path, error.to_string()).into());
        }
    };
    Ok(Verdict { cut: Some(cut), ..Verdict::new(path, Format::Dxf, findings) })
}

/// Returns the drawing of the target.
fn stated(verifier: &Verifier, path: &Path) -> Result<CutDrawing, VerifyError> {
    let target = verifier.target();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let drawing = match stem.rsplit_once('-').map(|(_, last)| last) {
        Some("panels") => artwork::panels_to_cut(target),
        Some("net") => artwork::net_to_cut(&verifier.printing),
        _ => {
            let (path, target) = (path.to_owned(), target.name.to_string());
            return Err(VerifyError::WhichDrawing { path, target });
        }
    };
    drawing.map_err(|source| VerifyError::NothingToCut { path: path.to_owned(), source })
}

/// Matches every stated path with a path of the file, and reports the unmatched ones on either side.
pub(super) fn compare(found: CutDrawing, stated: CutDrawing, cut: &mut CutVerdict) -> Vec<Finding> {
    let [left, lower, right, upper] = found.bounds_mm().unwrap_or_default();
    cut.size_mm = [right - left, upper - lower];
    let mut left: Vec<CutPath> = found.paths;
    let mut missing = Vec::new();
    for path in stated.paths.into_iter().flat_map(pieces) {
        match nearest(&left, &path).filter(|(_, by_mm)| *by_mm <= CUT_TOLERANCE_MM) {
            Some((index, by_mm)) => {
                // Paths are matched in the order in which they were written.
                left.remove(index);
                cut.count(path.layer, by_mm);
            }
            None => missing.push(path),
        }
    }
    let mut findings = Vec::new();
    for path in missing {
        let (layer, at_mm) = (dxf::layer_name(path.layer), path.points_mm[0]);
        match nearest(&left, &path).filter(|(_, by_mm)| *by_mm < MOVED_MM) {
            Some((index, by_mm)) => {
                left.remove(index);
                findings.push(CutFinding::PathOff { layer, at_mm, by_mm }.into());
            }
            None => findings.push(CutFinding::PathMissing { layer, at_mm }.into()),
        }
    }
    let extra = left.into_iter().map(|path| CutFinding::PathExtra {
        layer: dxf::layer_name(path.layer),
        at_mm: path.points_mm.first().copied().unwrap_or_default(),
    });
    findings.extend(extra.map(Finding::from));
    findings
}

/// Splits an open path into its straight segments.
fn pieces(path: CutPath) -> Vec<CutPath> {
    if path.closed {
        return vec![path];
    }
    let pieces = path.points_mm.windows(2);
    pieces.map(|ends| CutPath { points_mm: ends.to_vec(), ..path.clone() }).collect()
}

/// Returns the nearest path of the same kind to a stated one, and the largest distance of a point.
fn nearest(paths: &[CutPath], stated: &CutPath) -> Option<(usize, f64)> {
    let mut best: Option<(usize, f64)> = None;
    for (index, path) in paths.iter().enumerate() {
        let same = path.layer == stated.layer
            && path.closed == stated.closed
            && path.points_mm.len() == stated.points_mm.len();
        if !same {
            continue;
        }
        let pairs = path.points_mm.iter().zip(&stated.points_mm);
        let offs = pairs.map(|(a, b)| a - b);
        let by_mm = offs.map(|off| off.x.hypot(off.y)).fold(0.0, f64::max);
        if best.is_none_or(|(_, least)| by_mm < least) {
            best = Some((index, by_mm));
        }
        if by_mm <= CUT_TOLERANCE_MM {
            break;
        }
    }
    best
}

impl CutVerdict {
    /// Counts a path that was found.
    fn count(&mut self, layer: CutLayer, by_mm: f64) {
        match layer {
            CutLayer::Cut => self.outlines += 1,
            CutLayer::Fold | CutLayer::Valley => self.folds += 1,
            CutLayer::Engrave => self.engraved += 1,
        }
        self.max_deviation_mm = self.max_deviation_mm.max(by_mm);
    }
}
