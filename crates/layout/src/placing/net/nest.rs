//! Nesting of pieces on pages, by a greedy search for few pages.
//!
//! ```text
//!   ┌─────────────┐   The page, and each piece in twelve rotations, are grids of cells. Pieces are placed
//!   │    ╱╲╱╲     │   in order of decreasing size. Each goes on the first page that has room, where its
//!   │ ╱╲╱╲╱╲╱╲ ╱╲ │   upper end is lowest, then as far left as possible. A cell belongs to a piece if any
//!   │ ╲╱╲╱╲╱  ╱╲╱ │   part of it is closer than half the gap between pieces, so that pieces never overlap.
//!   └─────────────┘
//! ```

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec2;

use super::plane::Motion;
use deltille_core::polygon::{area, bounds};

/// Gap between pieces, mm: wide enough for scissors.
const BLANK_MM: f64 = 2.0;

/// Number of cells along the longer side of a page: on A0 a cell is 4 mm, half a glue tab.
const CELLS: f64 = 300.0;

/// Smallest cell, mm.
const MIN_CELL_MM: f64 = 1.0;

/// Number of rotations tried for a piece.
const TURNS: usize = 12;

/// A piece to be nested: convex polygons in its own frame, mm.
pub(super) type Outline = Vec<Vec<DVec2>>;

/// Position of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Index of the page.
    pub page: usize,
    /// Transform from the frame of the piece to that of the usable page area, whose origin is its lower-left corner.
    pub room_from_piece: Motion,
}

/// Nests pieces in areas of this width and height, mm; `None` if a piece does not fit.
pub(super) fn nest(pieces: &[Outline], room: DVec2) -> Option<Vec<Place>> {
    let cell = (room.max_element() / CELLS).max(MIN_CELL_MM);
    let mut order: Vec<usize> = (0..pieces.len()).collect();
    let areas: Vec<f64> = pieces.iter().map(|piece| piece.iter().map(|p| area(p)).sum()).collect();
    order.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]).then(a.cmp(&b)));
    let mut pages: Vec<Page> = Vec::new();
    let mut places = vec![None; pieces.len()];
    for index in order {
        let stamps = stamps(&pieces[index], room, cell);
        let on_page = |(page, fields): (usize, &Page)| Some((page, fields.best(&stamps)?));
        let found = pages.iter().enumerate().find_map(on_page);
        let (page, (stamp, at)) = match found {
            Some(found) => found,
            None => {
                let fields = Page::new(room, cell);
                let best = fields.best(&stamps)?;
                pages.push(fields);
                (pages.len() - 1, best)
            }
        };
        let stamp = &stamps[stamp];
        pages[page].take(stamp, at);
        let shift = DVec2::new(at[0] as f64, at[1] as f64) * cell - stamp.lower_left;
        let room_from_piece = Motion { shift, ..stamp.turn };
        places[index] = Some(Place { page, room_from_piece });
    }
    places.into_iter().collect()
}

/// Returns whether a piece with these points, and a rim of this width around it, fits in an area.
pub(super) fn fits(points: &[DVec2], rim: f64, room: DVec2) -> bool {
    directions(points).into_iter().any(|turn| {
        let turned: Vec<DVec2> = points.iter().map(|&p| turn.apply(p)).collect();
        let [left, lower, right, upper] = bounds(&turned);
        let size = DVec2::new(right - left, upper - lower) + 2.0 * rim + BLANK_MM;
        size.cmple(room).all()
    })
}

/// Returns the rotations tried for a piece, evenly spaced over 360°, starting with the one that
/// minimises its bounding box.
fn directions(points: &[DVec2]) -> [Motion; TURNS] {
    // The smallest box touches an edge of the convex hull; one degree is accurate enough.
    let size = |degrees: u32| {
        let turn = Motion::turning(f64::from(degrees).to_radians());
        let turned: Vec<DVec2> = points.iter().map(|&p| turn.apply(p)).collect();
        let [left, lower, right, upper] = bounds(&turned);
        (right - left) * (upper - lower)
    };
    let smallest = (0..90).min_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(0);
    let first = f64::from(smallest).to_radians();
    std::array::from_fn(|n| {
        // Right angles come first, because the page has right angles.
        let (quarter, rest) = (n % 4, n / 4);
        let rest = rest as f64 * TAU / TURNS as f64;
        Motion::turning(first + quarter as f64 * FRAC_PI_2 + rest)
    })
}

/// A piece in one of its rotations.
struct Stamp {
    turn: Motion,
    /// Position of its first cell, in the frame of the rotated piece, mm.
    lower_left: DVec2,
    /// Width in cells.
    width: usize,
    /// Occupied cells by rows from below: first and last cell of each contiguous run.
    rows: Vec<Vec<[usize; 2]>>,
}

fn stamps(piece: &Outline, room: DVec2, cell: f64) -> Vec<Stamp> {
    let points: Vec<DVec2> = piece.iter().flatten().copied().collect();
    let half = BLANK_MM / 2.0;
    let stamp = |turn: Motion| {
        let turned: Vec<Vec<DVec2>> =
            piece.iter().map(|p| p.iter().map(|&v| turn.apply(v)).collect()).collect();
        let [left, lower, right, upper] = bounds(turned.iter().flatten());
        let lower_left = DVec2::new(left, lower) - half;
        let size = DVec2::new(right - left, upper - lower) + BLANK_MM;
        if size.cmpgt(room).any() {
            return None;
        }
        let [width, height] = [size.x, size.y].map(|side| (side / cell).ceil() as usize);
        let row = |row: usize| {
            let from = lower_left.y + row as f64 * cell - half;
            let column = |x: f64| ((x - lower_left.x) / cell).floor().max(0.0) as usize;
            let run = |polygon: &Vec<DVec2>| {
                let [first, last] = extent(polygon, [from, from + cell + BLANK_MM])?;
                Some([column(first - half), column(last + half).min(width - 1)])
            };
            joined(turned.iter().filter_map(run).collect())
        };
        let rows = (0..height).map(row).collect();
        Some(Stamp { turn, lower_left, width, rows })
    };
    directions(&points).into_iter().filter_map(stamp).collect()
}

/// Merges runs of cells that touch or overlap.
fn joined(mut runs: Vec<[usize; 2]>) -> Vec<[usize; 2]> {
    runs.sort_unstable();
    let mut joined: Vec<[usize; 2]> = Vec::with_capacity(runs.len());
    for [first, last] in runs {
        match joined.last_mut() {
            Some(run) if first <= run[1] + 1 => run[1] = run[1].max(last),
            _ => joined.push([first, last]),
        }
    }
    joined
}

/// Returns the ends of the part of a convex polygon within a horizontal strip.
fn extent(polygon: &[DVec2], [below, above]: [f64; 2]) -> Option<[f64; 2]> {
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    let mut take = |x: f64| ends = [ends[0].min(x), ends[1].max(x)];
    for (&p, &q) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        if (below..=above).contains(&p.y) {
            take(p.x);
        }
        for y in [below, above] {
            if (p.y < y) != (q.y < y) {
                take(p.x + (q.x - p.x) * (y - p.y) / (q.y - p.y));
            }
        }
    }
    (ends[0] <= ends[1]).then_some(ends)
}

/// The occupied cells of a page.
struct Page {
    width: usize,
    /// Rows from below, 64 cells per word.
    rows: Vec<Vec<u64>>,
}

impl Page {
    fn new(room: DVec2, cell: f64) -> Self {
        let [width, height] = [room.x, room.y].map(|side| (side / cell).floor() as usize);
        Self { width, rows: vec![vec![0; width.div_ceil(64)]; height] }
    }

    /// Returns the stamp and its position with the lowest upper end, then the leftmost one.
    fn best(&self, stamps: &[Stamp]) -> Option<(usize, [usize; 2])> {
        let mut best: Option<([usize; 2], usize, [usize; 2])> = None;
        for (index, stamp) in stamps.iter().enumerate() {
            let height = stamp.rows.len();
            let (Some(last_x), Some(last_y)) =
                (self.width.checked_sub(stamp.width), self.rows.len().checked_sub(height))
            else {
                continue;
            };
            for y in 0..=last_y {
                if best.is_some_and(|(least, ..)| y + height > least[0]) {
                    break;
                }
                let Some(x) = self.leftmost(stamp, y, last_x) else { continue };
                let value = [y + height, x];
                if best.is_none_or(|(least, ..)| value < least) {
                    best = Some((value, index, [x, y]));
                }
                break;
            }
        }
        best.map(|(_, stamp, at)| (stamp, at))
    }

    /// Returns the leftmost column up to `most` at which a stamp fits in a row.
    fn leftmost(&self, stamp: &Stamp, y: usize, most: usize) -> Option<usize> {
        let mut x = 0;
        while x <= most {
            let mut rows = self.rows[y..].iter().zip(&stamp.rows);
            let beyond = rows.find_map(|(taken, runs)| {
                runs.iter().find_map(|&[first, last]| {
                    // A run that overlaps an occupied cell is moved until it is past that cell.
                    Some(last_taken(taken, [x + first, x + last])? + 1 - first)
                })
            });
            match beyond {
                None => return Some(x),
                Some(beyond) => x = beyond,
            }
        }
        None
    }

    fn take(&mut self, stamp: &Stamp, [x, y]: [usize; 2]) {
        for (taken, runs) in self.rows[y..].iter_mut().zip(&stamp.rows) {
            for cell in runs.iter().flat_map(|&[first, last]| x + first..=x + last) {
                taken[cell / 64] |= 1 << (cell % 64);
            }
        }
    }
}

/// Returns the last occupied cell of a row within a range.
fn last_taken(row: &[u64], [first, last]: [usize; 2]) -> Option<usize> {
    (first / 64..=last / 64).rev().find_map(|word| {
        let mut cells = row[word];
        if word == last / 64 {
            cells &= u64::MAX >> (63 - last % 64);
        }
        if word == first / 64 {
            cells &= u64::MAX << (first % 64);
        }
        (cells != 0).then(|| 64 * word + 63 - cells.leading_zeros() as usize)
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::plane::gap_mm;
    use super::*;

    fn triangle(edge: f64) -> Outline {
        let corners = [0.0, 120.0, 240.0];
        let radius = edge / 3f64.sqrt();
        vec![corners.map(|at: f64| DVec2::from_angle(at.to_radians()) * radius).to_vec()]
    }

    /// Two equal triangles fill a parallelogram, and pieces that no longer fit go on another page.
    #[test]
    fn pages_are_filled_before_another_is_started() {
        let pieces = vec![triangle(100.0); 9];
        // Two rows of 87 mm with four triangles each.
        let places = nest(&pieces, DVec2::new(275.0, 190.0)).unwrap();
        let on = |page| places.iter().filter(|place| place.page == page).count();
        assert!(on(0) >= 8 && on(0) + on(1) == 9, "{places:?}");
        assert_eq!(nest(&pieces, DVec2::new(80.0, 60.0)), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Pieces of triangles keep the gap between them, and stay within the area.
        #[test]
        fn nested_pieces_are_apart(
            edges in prop::collection::vec(20.0f64..120.0, 2..14),
            room in (150.0f64..400.0, 150.0f64..400.0),
        ) {
            let room = DVec2::from(room);
            // Each has a tab of a third of its edge.
            let pieces: Vec<Outline> = edges.iter().map(|&edge| {
                let mut piece = triangle(edge);
                let [a, b] = [piece[0][0], piece[0][1]];
                let out = -(b - a).perp() / 3.0;
                piece.push(vec![b, a, a + out + (b - a) / 3.0, b + out - (b - a) / 3.0]);
                piece
            }).collect();
            let Some(places) = nest(&pieces, room) else { return Ok(()) };
            let moved: Vec<Outline> = pieces.iter().zip(&places).map(|(piece, place)| {
                let motion = place.room_from_piece;
                piece.iter().map(|p| p.iter().map(|&v| motion.apply(v)).collect()).collect()
            }).collect();
            for (n, piece) in moved.iter().enumerate() {
                let [left, lower, right, upper] = bounds(piece.iter().flatten());
                prop_assert!(left >= 0.0 && lower >= 0.0 && right <= room.x && upper <= room.y);
                for (m, other) in moved.iter().enumerate().skip(n + 1) {
                    if places[n].page == places[m].page {
                        let gap = |a: &Vec<DVec2>| {
                            other.iter().map(|b| gap_mm(a, b)).fold(f64::INFINITY, f64::min)
                        };
                        let least = piece.iter().map(gap).fold(f64::INFINITY, f64::min);
                        prop_assert!(least > 0.0, "{least}");
                    }
                }
            }
        }
    }
}
