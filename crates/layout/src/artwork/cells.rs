//! Outlines of the white areas of a tag.

use std::collections::BTreeMap;

use deltille_core::lattice::{GridKind, TagCells, Tile, Vertex};

/// Returns the outlines of the white areas of a tag, as vertices of the lattice of its cells (triangles or squares).
///
/// ```text
///      ·───·───·            White cells that share an edge form one area. Its outline runs with
///     ╱ ╲w╱w╲ ╱             white on the left; an area with a black island has two loops. Areas
///    ·───·═══·───·          that touch only in a vertex keep separate loops. So every loop is
///   ╱ ╲ ╱ ╲w╱ ╲ ╱ ╲         simple, and filling all of them by the even-odd rule is exact.
/// ```
///
/// A vertex (row, col) lies at tile coordinates u = (inset + col) / width, v = (inset + row) / width, where `width` is
/// [`TagCells::width`]. Vertices inside a straight run are omitted. The order of the loops is deterministic.
pub fn white_outlines(cells: &TagCells, word: u64) -> Vec<Vec<Vertex>> {
    let mut edges = boundary_edges(cells.kind(), white_cells(cells, word));
    let mut loops = Vec::new();
    while let Some((&start, directions)) = edges.first_key_value() {
        let heading = directions[0];
        trace(cells.kind(), &mut edges, start, heading, &mut loops);
    }
    loops
}

/// Iterates over the white cells of a tag, as tiles of the lattice of its cells.
pub(super) fn white_cells(cells: &TagCells, word: u64) -> impl Iterator<Item = Tile> {
    let kind = cells.kind();
    let white = cells.cells().iter().enumerate().filter(move |&(bit, _)| word >> bit & 1 == 1);
    white.map(move |(_, cell)| {
        let anchor = Vertex::new(cell.row as i32, cell.col as i32);
        if cell.upright { kind.tag_tile(anchor) } else { Tile::inverted(anchor) }
    })
}

/// A closed path along an outline: the vertices, and the direction in which each is left.
pub(super) type Walk = Vec<(Vertex, usize)>;

/// Traces closed paths around tiles, with the tiles on the left, or on the right if not `inside`. Areas on the left
/// that meet only in a vertex stay separate: the path turns left as sharply as possible there, so it may pass a vertex
/// twice.
pub(super) fn walks(kind: GridKind, tiles: impl Iterator<Item = Tile>, inside: bool) -> Vec<Walk> {
    let mut edges = boundary_edges(kind, tiles);
    if !inside {
        let half = kind.steps().len() / 2;
        let all = std::mem::take(&mut edges).into_iter();
        for (from, heading) in all.flat_map(|(from, all)| all.into_iter().map(move |h| (from, h))) {
            let back = (heading + half) % (2 * half);
            edges.entry(from + kind.steps()[heading]).or_default().push(back);
        }
        edges.values_mut().for_each(|directions| directions.sort_unstable());
    }
    let mut walks = Vec::new();
    while let Some((&start, directions)) = edges.first_key_value() {
        let first = (start, directions[0]);
        walks.push(walk(kind, &mut edges, first));
    }
    walks
}

/// Traces the path that begins with a step, and removes its edges.
fn walk(kind: GridKind, edges: &mut BTreeMap<Vertex, Vec<usize>>, first: (Vertex, usize)) -> Walk {
    remove(edges, first.0, first.1);
    let mut steps = vec![first];
    loop {
        let (from, heading) = steps[steps.len() - 1];
        let at = from + kind.steps()[heading];
        let is_open =
            |turn: &usize| edges.get(&at).is_some_and(|directions| directions.contains(turn));
        let next = left_first(kind, heading).find(|turn| (at, *turn) == first || is_open(turn));
        let next = (at, next.expect("as many outlines leave a vertex as reach it"));
        if next == first {
            return steps;
        }
        remove(edges, next.0, next.1);
        steps.push(next);
    }
}

/// Splits a path into parts that pass every vertex once.
pub(super) fn simple(walk: Walk) -> Vec<Walk> {
    let mut parts = Vec::new();
    let mut steps = Walk::new();
    for step in walk {
        if let Some(again) = steps.iter().position(|&(vertex, _)| vertex == step.0) {
            parts.push(steps.split_off(again));
        }
        steps.push(step);
    }
    parts.push(steps);
    parts
}

/// Returns the edges between tiles and their surroundings, tiles on the left: for each vertex the directions of the
/// edges that start there, as ascending indices into [`GridKind::steps`].
fn boundary_edges(
    kind: GridKind,
    tiles: impl Iterator<Item = Tile>,
) -> BTreeMap<Vertex, Vec<usize>> {
    let mut edges = BTreeMap::<Vertex, Vec<usize>>::new();
    for tile in tiles {
        let vertices = tile.vertices();
        let ends = vertices.clone().cycle().skip(1);
        for (from, to) in vertices.zip(ends) {
            if !remove(&mut edges, to, direction(kind, to, from)) {
                edges.entry(from).or_default().push(direction(kind, from, to));
            }
        }
    }
    edges.values_mut().for_each(|directions| directions.sort_unstable());
    edges
}

fn direction(kind: GridKind, from: Vertex, to: Vertex) -> usize {
    let step = to - from;
    kind.steps().iter().position(|&s| s == step).expect("cell edges join neighbours")
}

fn remove(edges: &mut BTreeMap<Vertex, Vec<usize>>, from: Vertex, direction: usize) -> bool {
    let Some(directions) = edges.get_mut(&from) else {
        return false;
    };
    let Some(at) = directions.iter().position(|&d| d == direction) else {
        return false;
    };
    directions.remove(at);
    if directions.is_empty() {
        edges.remove(&from);
    }
    true
}

/// Traces an outline from a start vertex and heading, turning left as sharply as possible at every vertex. This keeps
/// to the same white area where several meet. When the path reaches a vertex for the second time, the part in between
/// becomes a separate loop.
fn trace(
    kind: GridKind,
    edges: &mut BTreeMap<Vertex, Vec<usize>>,
    start: Vertex,
    heading: usize,
    loops: &mut Vec<Vec<Vertex>>,
) {
    let mut steps = vec![(start, heading)];
    while let Some(&(from, heading)) = steps.last() {
        remove(edges, from, heading);
        let at = from + kind.steps()[heading];
        if let Some(again) = steps.iter().position(|&(vertex, _)| vertex == at) {
            loops.push(bends(&steps.split_off(again)));
            if steps.is_empty() {
                break;
            }
        }
        let next = left_first(kind, heading).find(|turn| edges[&at].contains(turn));
        steps.push((at, next.expect("as many outlines leave a vertex as reach it")));
    }
}

/// Iterates over all directions except straight back, starting with the sharpest left turn.
fn left_first(kind: GridKind, heading: usize) -> impl Iterator<Item = usize> {
    let full = kind.steps().len();
    (1..full).map(move |right| (heading + full / 2 + full - right) % full)
}

/// Returns the vertices of a loop at which its direction changes.
fn bends(steps: &[(Vertex, usize)]) -> Vec<Vertex> {
    let before = |i: usize| steps[(i + steps.len() - 1) % steps.len()].1;
    let bends = steps.iter().enumerate().filter(|&(i, &(_, heading))| heading != before(i));
    bends.map(|(_, &(vertex, _))| vertex).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use deltille_core::lattice::Dimension;

    /// Signed area, in units in which a triangular cell has 1 and a square one 2.
    fn area(outline: &[Vertex]) -> i32 {
        let next = outline.iter().cycle().skip(1);
        outline.iter().zip(next).map(|(a, b)| a.col * b.row - a.row * b.col).sum()
    }

    fn cells(bits: u32) -> TagCells {
        TagCells::new(Dimension::from_bits(bits).unwrap())
    }

    #[test]
    fn one_cell_is_one_triangle_and_a_ring_has_two_loops() {
        let cells = cells(9);
        assert_eq!(
            white_outlines(&cells, 1 << 8),
            [[(2, 0), (2, 1), (3, 0)].map(|(row, col)| Vertex::new(row, col))]
        );
        // All white but bit 13, the lowest upright cell that does not touch the outside.
        let ring = white_outlines(&self::cells(25), 0x1ff_ffff ^ (1 << 13));
        let areas: Vec<i32> = ring.iter().map(|l| area(l)).collect();
        assert_eq!(areas, [25, -1]);
    }

    proptest! {
        /// The loops enclose exactly the white cells, and each passes a vertex once.
        #[test]
        fn loops_are_simple_and_enclose_the_white_cells(
            bits in 3u32..9, seed: u64, square: bool,
        ) {
            let kind = if square { GridKind::Checker } else { GridKind::Deltille };
            let cells = TagCells::of(kind, Dimension::from_bits(bits * bits).unwrap());
            let word = seed & cells.dimension().mask();
            let outlines = white_outlines(&cells, word);
            let total: i32 = outlines.iter().map(|l| area(l)).sum();
            prop_assert_eq!(total, word.count_ones() as i32 * if square { 2 } else { 1 });
            for outline in &outlines {
                let mut sorted = outline.clone();
                sorted.sort();
                sorted.dedup();
                prop_assert_eq!(sorted.len(), outline.len());
            }
        }
    }
}
