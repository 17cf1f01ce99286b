//! Reader of `.dsc` target descriptions.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{Dialect, DscError, FAMILIES};
use deltille_core::family::Family;
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::quantity::{Range, border_bits, edge_mm, position_mm};
use deltille_core::statistics::median;
use deltille_core::targets::{
    Corner, FamilyRef, ListFormat, Name, Outline, Panel, PanelPose, TagPlacement, TagsIn, Target,
};
use deltille_core::words::{counted, quoted};

/// Maximum number of boards in a file, and of columns or rows of a board: a larger number is taken
/// for a typo.
const MOST: u32 = 10_000;

/// Relative tolerance of the unit inferred from the distances of corners.
const UNIT_SLACK: f64 = 0.02;

/// Units of a file: number of coordinate units per edge unit, and both units in mm.
type Units = (f64, [f64; 2]);

/// Units of edge and coordinates: mm and mm, mm and cm, cm and m, mm and m.
const KNOWN: [Units; 4] =
    [(1.0, [1.0, 1.0]), (10.0, [1.0, 10.0]), (100.0, [10.0, 1e3]), (1e3, [1.0, 1e3])];

/// Reads the text of a `.dsc` file in either dialect as a target with the given name. Corner ids are
/// assigned consecutively by board, row and column; lengths are converted to mm.
///
/// # Errors
/// Returns an error if a line is not valid, the boards are not a valid target, or units cannot be inferred.
pub fn read(text: &str, name: &str) -> Result<Target, DscError> {
    read_in(text, name, &KNOWN)
}

/// Reads the text of a `.dsc` file with all lengths in millimetres, as written by
/// [`write`](super::write).
///
/// # Errors
/// Returns an error if a line is not valid, the boards are not a valid target, or lengths are in another unit.
pub fn read_in_mm(text: &str, name: &str) -> Result<Target, DscError> {
    read_in(text, name, &KNOWN[..1])
}

fn read_in(text: &str, name: &str, units: &[Units]) -> Result<Target, DscError> {
    let lines: Vec<Line> = text
        .lines()
        .enumerate()
        .map(|(i, text)| Line { number: i + 1, text: text.trim() })
        .filter(|line| !line.text.is_empty())
        .collect();
    let mut rest = lines.as_slice();
    let mut blocks = Vec::new();
    while !rest.is_empty() {
        let (block, after) = Block::read(rest)?;
        blocks.push(block);
        rest = after;
    }
    let first = blocks.first().ok_or_else(|| {
        let problem = "the file is empty; a .dsc starts with a line `id,A,B,size`";
        DscError::Target(problem.to_owned())
    })?;
    let family = first.family.clone();
    if let Some(other) = blocks.iter().find(|block| block.family != family) {
        let problem = format!("the family is {} here, but {family} above", other.family);
        return Err(other.head.fault(problem));
    }
    blocks.sort_by_key(|block| block.id);
    if let Some(pair) = blocks.windows(2).find(|pair| pair[0].id == pair[1].id) {
        let problem = format!("board {} is described twice", pair[1].id);
        return Err(pair[1].head.fault(problem));
    }
    let format = match blocks[0].dialect {
        Dialect::Original => ListFormat::DscOriginal,
        Dialect::Fork => ListFormat::DscFork,
    };
    let mut next_id = 0;
    let panels = blocks.iter().map(|block| block.panel(&mut next_id, units));
    let panels = panels.collect::<Result<_, _>>()?;
    Target::listed(Name::like(name), format, family_ref(&family, &blocks)?, panels)
        .map_err(|(field, problem)| DscError::Target(format!("{field}: {problem}")))
}

/// The family by its name in this crate, with its fingerprint if the crate has its codes.
fn family_ref(name: &str, blocks: &[Block]) -> Result<FamilyRef, DscError> {
    let Ok(family) = Family::shipped(name) else {
        return Ok(FamilyRef { name: name.to_owned(), fingerprint: String::new(), squares: None });
    };
    for block in blocks {
        for corner in &block.corners {
            if corner.tag.is_some_and(|tag| tag as usize >= family.len()) {
                let problem = format!("{name} has only {}", counted(family.len(), "code"));
                return Err(corner.line.fault(problem));
            }
        }
    }
    Ok(FamilyRef { name: name.to_owned(), ..FamilyRef::of(&family) })
}

/// A line of the file.
#[derive(Clone, Copy)]
struct Line<'a> {
    number: usize,
    text: &'a str,
}

impl<'a> Line<'a> {
    fn fault(self, problem: impl Into<String>) -> DscError {
        DscError::Line { line: self.number, problem: problem.into() }
    }

    /// Returns the comma-separated fields; there must be exactly `N`.
    fn fields<const N: usize>(self, form: &str) -> Result<[&'a str; N], DscError> {
        let fields: Vec<&str> = self.text.split(',').map(str::trim).collect();
        fields.try_into().map_err(|_| self.fault(format!("{} is not `{form}`", quoted(self.text))))
    }

    fn number<T: std::str::FromStr>(self, field: &str, what: &str) -> Result<T, DscError> {
        field
            .parse()
            .map_err(|_| self.fault(format!("{what} {} is not a valid number", quoted(field))))
    }

    fn within(self, field: &str, what: &str, range: Range) -> Result<f64, DscError> {
        let value: f64 = self.number(field, what)?;
        range.check(value).map_err(|problem| self.fault(format!("{what} {problem}")))
    }
}

/// One board as the file lists it.
struct Block<'a> {
    head: Line<'a>,
    id: u32,
    dialect: Dialect,
    kind: GridKind,
    /// Columns and rows.
    matrix: [u32; 2],
    size: f64,
    family: String,
    border: f64,
    corners: Vec<ListedCorner<'a>>,
}

struct ListedCorner<'a> {
    line: Line<'a>,
    vertex: Vertex,
    tag: Option<u32>,
    position: DVec3,
}

impl<'a> Block<'a> {
    /// Reads one block, and returns it with the remaining lines.
    fn read<'l>(lines: &'l [Line<'a>]) -> Result<(Self, &'l [Line<'a>]), DscError> {
        let head = lines[0];
        let [id, a, b, size] = head.fields("id,A,B,size")?;
        let (id, size) = (head.number(id, "board id")?, head.within(size, "size", edge_mm::RANGE)?);
        let (a, b) = (head.number::<u32>(a, "A")?, head.number::<u32>(b, "B")?);
        if a > MOST || b > MOST {
            return Err(head.fault(format!("A and B must be at most {MOST}")));
        }
        let Some(second) = lines.get(1) else {
            return Err(
                head.fault("the file ends after this line: expected a line `family,border`")
            );
        };
        let [family, border] = second.fields("family,border")?;
        let border = second.within(border, "border", border_bits::RANGE)?;
        let (family, dialect, kind) = family_of(family, b).ok_or_else(|| {
            let names = FAMILIES.map(|f| format!("delTag{f}, aprilTag{f}, t{f}")).join(", ");
            second.fault(format!("unknown family {} (known: {names})", quoted(family)))
        })?;
        let matrix = match (dialect, kind) {
            (Dialect::Fork, _) => [a, b],
            (Dialect::Original, GridKind::Checker) => [a.saturating_sub(1), b.saturating_sub(1)],
            (Dialect::Original, GridKind::Deltille) => [a.saturating_sub(2); 2],
        };
        let body = &lines[2..];
        let end = body.iter().position(|line| line.text.split(',').count() != 6);
        let (body, after) = body.split_at(end.unwrap_or(body.len()));
        let corners = body.iter().map(|&line| ListedCorner::read(line, matrix));
        let corners = corners.collect::<Result<Vec<_>, _>>()?;
        let expected = match (dialect, kind) {
            (Dialect::Fork, _) => None,
            (Dialect::Original, GridKind::Checker) => Some(matrix[0] * matrix[1]),
            (Dialect::Original, GridKind::Deltille) => Some(matrix[0] * (matrix[0] + 1) / 2),
        };
        if let Some(expected) = expected.filter(|&n| n as usize != corners.len()) {
            let problem = format!(
                "board {id} must list {}, not {}: the file is truncated, or A and B are not in \
                 the original dialect",
                counted(expected as usize, "corner"),
                corners.len()
            );
            return Err(head.fault(problem));
        }
        if corners.is_empty() {
            return Err(head.fault(format!("board {id} lists no corners")));
        }
        Ok((Self { head, id, dialect, kind, matrix, size, family, border, corners }, after))
    }

    /// The board as a panel, with corners numbered from `next_id`.
    fn panel(&self, next_id: &mut u32, units: &[Units]) -> Result<Panel, DscError> {
        let mut by_vertex = BTreeMap::new();
        for corner in &self.corners {
            if by_vertex.insert(corner.vertex, corner).is_some() {
                let problem =
                    format!("{},{} is listed twice", corner.vertex.col, corner.vertex.row);
                return Err(corner.line.fault(problem));
            }
        }
        let [edge_mm, unit_mm] = self.units(&by_vertex, units)?;
        let mut panel = Panel {
            id: self.id,
            kind: self.kind,
            edge_mm,
            border_bits: Some(self.border),
            tags_in: TagsIn::Black,
            tag_margin_bits: None,
            gap_edges: None,
            discs_mm: None,
            hole_mm: None,
            rim_mm: None,
            inverted: false,
            outline: Outline::Touching,
            matrix: self.matrix,
            pose: PanelPose::IDENTITY,
            corners: Vec::new(),
            tags: Vec::new(),
        };
        for (&vertex, listed) in &by_vertex {
            let target_mm = listed.position * unit_mm;
            for place in target_mm.to_array() {
                position_mm::RANGE
                    .check(place)
                    .map_err(|what| listed.line.fault(what.to_string()))?;
            }
            panel.corners.push(Corner {
                id: *next_id,
                row: vertex.row,
                col: vertex.col,
                panel_mm: panel.lattice_mm(vertex),
                target_mm,
                measured: None,
            });
            *next_id += 1;
            if let Some(id) = listed.tag {
                panel.tags.push(TagPlacement { id, row: vertex.row, col: vertex.col });
            }
        }
        panel.pose = PanelPose::fit(&panel.corners).ok_or_else(|| {
            let problem = format!("the corners of board {} are collinear", self.id);
            self.head.fault(problem)
        })?;
        Ok(panel)
    }

    /// The edge in mm, and the unit of the coordinates in mm.
    fn units(
        &self,
        corners: &BTreeMap<Vertex, &ListedCorner>,
        known: &[Units],
    ) -> Result<[f64; 2], DscError> {
        // The next corner along the row is one edge away on both kinds of board.
        let steps: Vec<f64> = corners
            .iter()
            .filter_map(|(&vertex, from)| {
                let to = corners.get(&(vertex + Vertex::new(0, 1)))?;
                Some(from.position.distance(to.position))
            })
            .collect();
        let Some(step) = median(steps) else {
            return Err(self.head.fault("no row has two neighbouring corners"));
        };
        let ratio = self.size / step;
        let unit = known.iter().find(|(r, _)| (ratio / r - 1.0).abs() < UNIT_SLACK);
        let (_, [edge, unit]) = unit.ok_or_else(|| {
            let problem = format!(
                "board {}: the size is {}, but neighbouring corners are {step} apart; no pair of length units \
                 explains this ratio",
                self.id, self.size
            );
            self.head.fault(problem)
        })?;
        let edge_mm = edge_mm::RANGE.check(self.size * edge);
        Ok([edge_mm.map_err(|what| self.head.fault(format!("size {what}")))?, *unit])
    }
}

impl<'a> ListedCorner<'a> {
    fn read(line: Line<'a>, [cols, rows]: [u32; 2]) -> Result<Self, DscError> {
        let [tag, col, row, x, y, z] = line.fields("tag,column,row,x,y,z")?;
        let tag: i64 = line.number(tag, "tag")?;
        let (col, row): (u32, u32) = (line.number(col, "column")?, line.number(row, "row")?);
        if col >= cols || row >= rows {
            let problem = format!("{col},{row} is outside the board's {cols} × {rows} corners");
            return Err(line.fault(problem));
        }
        let tag = match tag {
            -1 => None,
            tag => {
                Some(u32::try_from(tag).map_err(|_| line.fault(format!("{tag} is not a tag id")))?)
            }
        };
        let position = [("x", x), ("y", y), ("z", z)];
        let [x, y, z] = position.map(|(what, field)| line.within(field, what, position_mm::RANGE));
        let position = DVec3::new(x?, y?, z?);
        Ok(Self { line, vertex: Vertex::new(row as i32, col as i32), tag, position })
    }
}

/// Family name in this crate, dialect and tiling, from the name in the file and B.
fn family_of(name: &str, b: u32) -> Option<(String, Dialect, GridKind)> {
    let known = |rest: &str| FAMILIES.contains(&rest);
    if name.strip_prefix("delTag").is_some_and(known) {
        return Some((name.to_owned(), Dialect::Fork, GridKind::Deltille));
    }
    if name.strip_prefix("aprilTag").is_some_and(known) {
        return Some((name.to_owned(), Dialect::Fork, GridKind::Checker));
    }
    let rest = name.strip_prefix('t').filter(|rest| known(rest))?;
    Some(match b {
        0 => (format!("delTag{rest}"), Dialect::Original, GridKind::Deltille),
        _ => (format!("aprilTag{rest}"), Dialect::Original, GridKind::Checker),
    })
}
