//! Verification of corner lists for other detectors (`.dsc`): boards, corners and tags must be those of the target,
//! with positions in millimetres.

use std::path::Path;

use crate::finding::any::Finding;
use crate::finding::construct::ConstructFinding;
use crate::finding::list::ListFinding;
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::reader::Reader;
use crate::verdict::{ListVerdict, Verdict};
use crate::verifier::Verifier;
use deltille_core::targets::{Panel, Target};
use deltille_files::export::dsc::{self, Dialect};

/// Largest accepted deviation of a position or an edge length, mm, given the number of digits written.
const LIST_TOLERANCE_MM: f64 = 1e-6;

/// Reads a `.dsc` and compares it with the target.
pub(super) fn verify(
    verifier: &Verifier,
    reader: &Reader,
    path: &Path,
) -> Result<Verdict, DocumentError> {
    let text = &reader.read_text(path)?;
    if text.lines().next().is_none_or(|head| head.split(',').count() != 4) {
        let problem = "not a .dsc: the first line is not `id,A,B,size`";
        return Err(DocumentError::unreadable(path, problem));
    }
    let mut list = ListVerdict::default();
    let mut findings = unlisted(text);
    if findings.is_empty() {
        match dsc::read_in_mm(text, &verifier.target().name) {
            Ok(listed) => {
                findings = compare(&listed, verifier.target(), &mut list);
                findings.extend(differently_written(text, &listed).filter(|_| findings.is_empty()));
            }
            Err(error) => findings.push(ListFinding::Listed { problem: error.to_string() }.into()),
        }
    }
    Ok(Verdict { list: Some(list), ..Verdict::new(path, Format::Dsc, findings) })
}

/// Finds lines with anything other than words, numbers and commas: readers skip different characters.
fn unlisted(text: &str) -> Vec<Finding> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, ',' | '.' | '-');
    let lines = text.split_terminator('\n').enumerate();
    let odd = lines.filter(|(_, line)| line.is_empty() || !line.chars().all(plain));
    let construct = "a blank or a special character";
    let finding = |index| ConstructFinding::Construct {
        place: format!("line {}", index + 1),
        construct: construct.to_owned(),
    };
    odd.map(|(index, _)| finding(index).into()).collect()
}

/// Finds the first line that this program would write differently for the same content: readers
/// parse numbers, and the order of lines, differently.
fn differently_written(text: &str, listed: &Target) -> Option<Finding> {
    let dialect = Dialect::of(listed);
    let rewritten = dsc::write(listed, dialect).unwrap_or_default();
    if text == rewritten {
        return None;
    }
    let same = text
        .lines()
        .zip(rewritten.lines())
        .take_while(|(found, rewritten)| found == rewritten)
        .count();
    let construct = "numbers or line order not as deltille writes them".to_owned();
    Some(ConstructFinding::Construct { place: format!("line {}", same + 1), construct }.into())
}

fn compare(listed: &Target, target: &Target, list: &mut ListVerdict) -> Vec<Finding> {
    let mut problems = Vec::new();
    let name = |target: &Target| target.family.as_ref().map(|family| family.name.clone());
    let [found, stated] = [listed, target].map(|t| name(t).unwrap_or_else(|| "none".to_owned()));
    if found != stated {
        problems.push(format!("family {found} instead of {stated}"));
    }
    for panel in &target.panels {
        match listed.panels.iter().find(|listed| listed.id == panel.id) {
            Some(found) => {
                list.boards += 1;
                let matrix = Dialect::of(listed) == Dialect::Fork;
                compare_board(found, panel, matrix, list, &mut problems);
            }
            None => problems.push(format!("board {} is not listed", panel.id)),
        }
    }
    for panel in &listed.panels {
        if !target.panels.iter().any(|stated| stated.id == panel.id) {
            problems.push(format!("board {} is listed, but is not part of the target", panel.id));
        }
    }
    problems.into_iter().map(|problem| ListFinding::Listed { problem }.into()).collect()
}

/// Compares a board. The numbers of columns and rows are those of the corners in only one dialect.
fn compare_board(
    found: &Panel,
    stated: &Panel,
    matrix: bool,
    list: &mut ListVerdict,
    problems: &mut Vec<String>,
) {
    let board = format!("board {}", stated.id);
    if found.kind != stated.kind {
        return problems.push(format!("{board} has a different kind of grid"));
    }
    if matrix && found.matrix != stated.matrix {
        let [[a, b], [c, d]] = [found.matrix, stated.matrix];
        problems.push(format!("{board} has {a} columns and {b} rows instead of {c} and {d}"));
    }
    if (found.edge_mm - stated.edge_mm).abs() > LIST_TOLERANCE_MM {
        let [found, stated] = [found.edge_mm, stated.edge_mm];
        problems.push(format!("{board} has an edge of {found} mm instead of {stated} mm"));
    }
    if found.border_bits != stated.border_bits {
        let [found, stated] = [found, stated].map(|panel| panel.border_bits.unwrap_or_default());
        problems.push(format!("{board} has a border of {found} bits instead of {stated}"));
    }
    compare_corners(found, stated, list, problems);
    compare_tags(found, stated, list, problems);
}

fn compare_corners(
    found: &Panel,
    stated: &Panel,
    list: &mut ListVerdict,
    problems: &mut Vec<String>,
) {
    for corner in &stated.corners {
        let (row, col) = (corner.row, corner.col);
        let place = format!("board {}: the corner at row {row} col {col}", stated.id);
        let listed = found.corners.iter().find(|c| (c.row, c.col) == (row, col));
        let Some(listed) = listed else {
            problems.push(format!("{place} is not listed"));
            continue;
        };
        list.corners += 1;
        let off = listed.target_mm.distance(corner.target_mm);
        list.max_deviation_mm = list.max_deviation_mm.max(off);
        if off > LIST_TOLERANCE_MM {
            problems.push(format!("{place} is off by {off:.6} mm"));
        }
    }
    let extra = found.corners.len().saturating_sub(stated.corners.len());
    if extra > 0 {
        problems.push(format!("board {} lists {extra} extra corners", stated.id));
    }
}

fn compare_tags(found: &Panel, stated: &Panel, list: &mut ListVerdict, problems: &mut Vec<String>) {
    let at = |panel: &Panel, row: i32, col: i32| {
        panel.tags.iter().find(|tag| (tag.row, tag.col) == (row, col)).map(|tag| tag.id)
    };
    for tag in &stated.tags {
        let (id, row, col) = (tag.id, tag.row, tag.col);
        let place = format!("board {}: tag {id} at row {row} col {col}", stated.id);
        match at(found, row, col) {
            Some(listed) if listed == id => list.tags += 1,
            Some(listed) => problems.push(format!("{place} is listed as tag {listed}")),
            None => problems.push(format!("{place} is not listed")),
        }
    }
    for tag in found.tags.iter().filter(|tag| at(stated, tag.row, tag.col).is_none()) {
        let (id, row, col) = (tag.id, tag.row, tag.col);
        problems.push(format!("board {}: unexpected tag {id} at row {row} col {col}", stated.id));
    }
}
