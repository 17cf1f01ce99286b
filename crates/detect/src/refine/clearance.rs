//! The clear area around a corner: the pixels that show only this corner.
//!
//! ```text
//!        2 ╱╲ 1        the tiles around a corner end at their far sides; in tiles with a tag the
//!       ╱▒▒▒▒────╲      cells of the tag (▒) are cut out, and the area between them and the edges
//!    3 ╱ ▒▒ ·     ╲ 0   stays. A margin for the blur is kept from all of them.
//!      ╲    ▒▒    ╱
//!     4 ╲──▒▒▒▒──╱ 5
//! ```

use std::cell::LazyCell;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use glam::{DMat2, DVec2};

use crate::grid::gaps::edge_crossing::Neighbour;
use crate::grid::map::local_map::{LocalMap, Shape};
use crate::grid::map::spacing::Spacing;
use crate::refine::model::window::Border;
use crate::tiling::{CHECKER, DELTILLE};
use deltille_core::detection::{Grid, GridCorner};
use deltille_core::family::Family;
use deltille_core::lattice::{GridKind, Tile, Vertex};
use deltille_core::targets::{Panel, TagsIn, Target};

/// Margin from other edges, in standard deviations of the blur. Beyond it, an edge changes grey values by less than 2.5
/// % of its contrast.
const BLUR_MARGIN_SIGMAS: f64 = 2.0;

/// Minimum determinant of the second moments of displacements, in mean spacings, that are not collinear: with gaps of a
/// tenth of a tag, two have 0.18² · 0.18²; collinear ones have zero.
const MIN_SPREAD: f64 = 1e-4;

/// Distances from the edges of a tile to parts of its tag, measured along the adjacent edges, in edge lengths.
#[derive(Clone, Copy, Debug, Default)]
struct Insets {
    /// To the visible tag.
    tag: f64,
    /// To its cells: the area between them is a border of one colour.
    cells: f64,
}

/// The tiles of a panel with tags, and the area of the tag in its tile.
#[derive(Clone, Debug)]
struct TagsOfPanel {
    tiles: BTreeSet<Tile>,
    insets: Insets,
}

/// The tiles of targets with tags, and the area of the tag in its tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct TagAreas {
    /// Panels with tags by id, for each target; with its name if there are several.
    targets: Vec<(Option<String>, BTreeMap<u32, TagsOfPanel>)>,
}

impl TagAreas {
    /// Returns the tag areas of `target` with the tags of this family.
    pub(crate) fn of(target: &Target, family: &Family) -> Self {
        let tagged = target.panels.iter().filter(|panel| !panel.tags.is_empty());
        let tags = |panel: &Panel| {
            let width = family.cells().width(panel.tag_inset_bits());
            let cells = panel.tag_inset_bits() / width;
            let tag = match panel.tags_in {
                TagsIn::Black => cells,
                TagsIn::White => panel.tag_margin_bits() / width,
            };
            let tiles: BTreeSet<Tile> = panel.tags.iter().map(|tag| panel.tag_tile(tag)).collect();
            (panel.id, TagsOfPanel { tiles, insets: Insets { tag, cells } })
        };
        Self { targets: vec![(None, tagged.map(tags).collect())] }
    }

    /// Returns the tag areas of several targets, by their names.
    pub(crate) fn of_scene(targets: impl IntoIterator<Item = (String, Self)>) -> Self {
        let named = |(name, of_target): (String, Self)| {
            let panels = of_target.targets.into_iter();
            panels.map(move |(_, panels)| (Some(name.clone()), panels))
        };
        Self { targets: targets.into_iter().flat_map(named).collect() }
    }

    /// Returns whether no tile shows a tag.
    pub(crate) fn is_empty(&self) -> bool {
        self.targets.iter().all(|(_, panels)| panels.is_empty())
    }

    /// Returns the distances from the edges of dark and bright tiles to their tags, in edge lengths; infinite without
    /// tags.
    pub(crate) fn insets(&self, grid: &Grid) -> [f64; 2] {
        let panels = self.targets.iter().flat_map(|(_, panels)| panels);
        let of_grid = panels.filter(|(id, _)| grid.panel.is_none_or(|panel| panel == **id));
        let mut insets = [f64::INFINITY; 2];
        for (_, tags) in of_grid {
            let in_bright = tags.tiles.first().is_some_and(|tile| !tile.is_dark());
            let inset = &mut insets[usize::from(in_bright)];
            *inset = inset.min(tags.insets.tag);
        }
        insets
    }

    /// Returns the area of the tag that a tile of a grid may show: as on its panel, or in any suitable tile the largest
    /// one if the panel is unknown.
    fn of_tile(&self, grid: &Grid, tile: Tile) -> Option<Insets> {
        let Some(panel) = grid.panel else {
            let tags = self.targets.iter().flat_map(|(_, panels)| panels.values());
            let inset = tags.map(|panel| panel.insets.tag).reduce(f64::min)?;
            let is_suitable = tile == tile.kind().tag_tile(tile.anchor);
            return is_suitable.then_some(Insets { tag: inset, cells: inset });
        };
        let (_, panels) = self.targets.iter().find(|(name, _)| *name == grid.target)?;
        let tags = panels.get(&panel).filter(|tags| tags.tiles.contains(&tile))?;
        Some(tags.insets)
    }
}

/// An empty span.
pub(crate) const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// Signed distance from a line, px: a·u + b·v + c.
type Line = [f64; 3];

/// Distance from other edges at which a blur shows nothing of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Margin {
    /// In the mean over all directions, px.
    px: f64,
    /// e₁ and e₂ of the squared blur.
    astigmatism: [f64; 2],
}

impl Margin {
    /// Returns the margin of a blur of this standard deviation, px.
    pub(crate) fn of(blur_px: f64) -> Self {
        Self { px: BLUR_MARGIN_SIGMAS * blur_px, astigmatism: [0.0; 2] }
    }

    /// Returns this margin for a blur with this astigmatism.
    pub(crate) fn with_astigmatism(self, astigmatism: [f64; 2]) -> Self {
        Self { astigmatism, ..self }
    }

    /// Returns the margin from a line, px.
    fn from(self, [a, b, _]: &Line) -> f64 {
        let [e1, e2] = self.astigmatism;
        self.px * (1.0 + e1 * (a * a - b * b) + 2.0 * e2 * a * b).sqrt()
    }
}

/// The surroundings of a corner, in px relative to it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surroundings {
    /// Far sides of the tiles, positive towards the corner.
    sides: Vec<Line>,
    /// Sides of the tags, positive outside.
    tags: Vec<Vec<Line>>,
    /// Sides of the cells of the tags, positive outside.
    cells: Vec<Vec<Line>>,
    /// Borders of the tags that lie in tiles of the opposite colour.
    pub borders: Vec<Border>,
    /// Edges through the corner by increasing angle; empty if nothing is known.
    pub edges: Vec<Edge>,
    /// Its neighbours, counter-clockwise on the print; those outside the grid are predicted. Empty if
    /// nothing is known.
    pub neighbours: Vec<Neighbour>,
    /// Whether all its neighbours are in the grid.
    pub is_inner: bool,
}

/// An edge through a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    /// Direction within 180°, radians.
    pub angle_rad: f64,
    /// Curvature to the left of that direction (towards greater v for the direction u), 1/px.
    pub bend: f64,
    /// Distance in the image, perpendicular to the edge, of a point one edge length away on the print, px.
    pub across_px: f64,
}

impl Surroundings {
    /// Returns the ends of the clear part of a row at distance `v` from the corner, px. It lies between the far sides
    /// of the tiles.
    pub(crate) fn span(&self, v: f64, margin: Margin) -> [f64; 2] {
        if self.sides.is_empty() {
            return NOTHING;
        }
        let [mut first, mut last] = [f64::NEG_INFINITY, f64::INFINITY];
        for side @ [a, b, c] in &self.sides {
            let rest = margin.from(side) - b * v - c;
            if *a > 0.0 {
                first = first.max(rest / a);
            } else if *a < 0.0 {
                last = last.min(rest / a);
            } else if rest > 0.0 {
                return NOTHING;
            }
        }
        [first, last]
    }

    /// Returns a predicate for positions, px from the corner: whether no tag is visible there with this margin; or only
    /// its border, if `with_borders`.
    pub(crate) fn off_tags(&self, margin: Margin, with_borders: bool) -> impl Fn(DVec2) -> bool {
        let areas = grown(if with_borders { &self.cells } else { &self.tags }, margin);
        let circle2 = clear_of(&areas, DVec2::ZERO).max(0.0).powi(2);
        move |place| place.length_squared() < circle2 || clear_of(&areas, place) >= 0.0
    }

    /// Returns half the side of the largest clear square around the corner, px, with this margin.
    pub(crate) fn clear_square_px(&self, margin: Margin) -> f64 {
        let nearest = self.sides.iter().map(|side| side[2] - margin.from(side)).reduce(f64::min);
        let clear = nearest.unwrap_or(0.0).min(clear_of(&grown(&self.tags, margin), DVec2::ZERO));
        clear.max(0.0) * std::f64::consts::FRAC_1_SQRT_2
    }
}

/// Returns areas with this margin around them.
fn grown(areas: &[Vec<Line>], margin: Margin) -> Vec<Vec<Line>> {
    let moved = |side: &Line| [side[0], side[1], side[2] - margin.from(side)];
    areas.iter().map(|area| area.iter().map(moved).collect()).collect()
}

/// Returns a lower bound of the distance from a point to the nearest of some areas, px.
fn clear_of(areas: &[Vec<Line>], DVec2 { x: u, y: v }: DVec2) -> f64 {
    let from = |side: &Line| side[0] * u + side[1] * v + side[2];
    let outside = |area: &Vec<Line>| area.iter().map(from).fold(f64::NEG_INFINITY, f64::max);
    areas.iter().map(outside).fold(f64::INFINITY, f64::min)
}

/// Returns the surroundings of every corner of a grid, in order, in pixels of `scale` times the size of the grid's
/// pixels. If the neighbours of a corner are collinear, nothing is known about its surroundings,
/// and no area counts as clear.
pub(crate) fn surroundings(grid: &Grid, tags: &TagAreas, scale: f64) -> Vec<Surroundings> {
    surroundings_of(grid, tags, scale, 0..grid.corners.len())
}

/// Returns the surroundings of some of the corners, by index.
pub(crate) fn surroundings_of(
    grid: &Grid,
    tags: &TagAreas,
    scale: f64,
    corners: impl Iterator<Item = usize>,
) -> Vec<Surroundings> {
    let places = Places::of(grid, scale);
    let shape = LazyCell::new(|| places.shape(grid));
    let vertices = grid.corners.iter().map(|corner| Vertex::new(corner.row, corner.col));
    let spacing = Spacing::of(grid.kind, vertices, |v| places.get(v));
    let around = |corner: &GridCorner| {
        let vertex = Vertex::new(corner.row, corner.col);
        let here = places.get(vertex)?;
        let seen = |step: Vertex| places.get(vertex + step).map(|place| place - here);
        let way = |step| spacing.way(vertex, step);
        let near = affine(grid.kind.steps().iter().filter_map(|&s| Some((way(s), seen(s)?))));
        // For a single corner, the corners beyond its neighbours predict the positions of missing neighbours.
        let map = match &near {
            Some(_) => None,
            None => Some(places.map_about(grid.kind, vertex, *shape)?),
        };
        let usual = |step| match &near {
            Some(near) => near(way(step)),
            None => map.map_or(DVec2::ZERO, |map| map.along(step)),
        };
        let width = |from: Vertex, step| spacing.width(vertex + from, step);
        let place =
            |step| seen(step).or_else(|| beyond(step, seen, width)).unwrap_or_else(|| usual(step));
        let mut edges = edges(grid, &places, vertex, place);
        // Edges of a tile with a tag are the wide spacings.
        edges.iter_mut().for_each(|edge| edge.across_px *= spacing.widest());
        let is_inner = grid.kind.steps().iter().all(|&step| seen(step).is_some());
        let neighbour = |&step| Neighbour { way: place(step), is_seen: seen(step).is_some() };
        let neighbours = grid.kind.steps().iter().map(neighbour).collect();
        let mut found = Surroundings { edges, neighbours, is_inner, ..Default::default() };
        for tile in grid.kind.tiles_around(vertex) {
            let corners: Vec<Vertex> = tile.vertices().map(|v| v - vertex).collect();
            let polygon: Vec<DVec2> = corners.iter().map(|&step| place(step)).collect();
            let n = corners.len();
            for (i, j) in (0..n).map(|i| (i, (i + 1) % n)) {
                if corners[i] != Vertex::new(0, 0) && corners[j] != Vertex::new(0, 0) {
                    found.sides.push(line(polygon[i], polygon[j], DVec2::ZERO));
                }
            }
            if let Some(Insets { tag, cells }) = tags.of_tile(grid, tile) {
                found.tags.push(outline(&inner(&polygon, tag)));
                found.cells.push(outline(&inner(&polygon, cells)));
                let corner = |&step: &Vertex| {
                    let map = || places.map_about(grid.kind, vertex + step, *shape);
                    seen(step).or_else(|| Some(map()?.place - here))
                };
                let seen: Option<Vec<DVec2>> = corners.iter().map(corner).collect();
                let first = corners.iter().position(|&corner| corner == Vertex::new(0, 0));
                if cells > tag
                    && let Some(Ok(mut tile)) = seen.map(<[DVec2; 4]>::try_from)
                {
                    tile.rotate_left(first.unwrap_or_default());
                    found.borders.extend(border(tile, tag));
                }
            }
        }
        Some(found)
    };
    corners.map(|i| around(&grid.corners[i]).unwrap_or_default()).collect()
}

/// Predicts corners from those of a grid.
pub(crate) struct Prediction {
    kind: GridKind,
    places: Places,
    shape: Shape,
}

impl Prediction {
    /// Creates the prediction from the corners of `grid`.
    pub(crate) fn from(grid: &Grid) -> Self {
        let places = Places::of(grid, 1.0);
        Self { kind: grid.kind, shape: places.shape(grid), places }
    }

    /// Returns the position of the corner at `vertex`, and its standard deviation, px. The corner itself must not be in
    /// the grid.
    pub(crate) fn at(&self, vertex: Vertex) -> Option<(DVec2, f64)> {
        let map = self.places.map_about(self.kind, vertex, self.shape)?;
        let steps = self.kind.steps();
        let edge_px = steps.iter().map(|&step| map.along(step).length()).sum::<f64>();
        Some((map.place, map.sigma * edge_px / steps.len() as f64))
    }
}

/// Positions of corners in the rectangle of rows and columns that they span.
struct Places {
    first: Vertex,
    cols: usize,
    places: Vec<Option<DVec2>>,
}

impl Places {
    fn of(grid: &Grid, scale: f64) -> Self {
        let range = |of: fn(&GridCorner) -> i32| {
            let values = || grid.corners.iter().map(of);
            let first = values().min().unwrap_or(0);
            (first, values().max().map_or(0, |last| (last - first) as usize + 1))
        };
        let ((row, rows), (col, cols)) = (range(|c| c.row), range(|c| c.col));
        let mut found =
            Self { first: Vertex::new(row, col), cols, places: vec![None; rows * cols] };
        for corner in &grid.corners {
            if let Some(at) = found.index(Vertex::new(corner.row, corner.col)) {
                found.places[at] = Some(corner.position() / scale);
            }
        }
        found
    }

    fn index(&self, vertex: Vertex) -> Option<usize> {
        let Vertex { row, col } = vertex - self.first;
        let (row, col) = (usize::try_from(row).ok()?, usize::try_from(col).ok()?);
        (col < self.cols).then_some(row * self.cols + col)
    }

    fn get(&self, vertex: Vertex) -> Option<DVec2> {
        *self.places.get(self.index(vertex)?)?
    }

    fn shape(&self, grid: &Grid) -> Shape {
        let vertices = grid.corners.iter().map(|corner| Vertex::new(corner.row, corner.col));
        match grid.kind {
            GridKind::Deltille => Shape::of::<DELTILLE>(vertices, |v| self.get(v), 0),
            GridKind::Checker => Shape::of::<CHECKER>(vertices, |v| self.get(v), 0),
        }
    }

    fn map_about(&self, kind: GridKind, vertex: Vertex, shape: Shape) -> Option<LocalMap> {
        match kind {
            GridKind::Deltille => LocalMap::about::<DELTILLE>(vertex, |v| self.get(v), shape),
            GridKind::Checker => LocalMap::about::<CHECKER>(vertex, |v| self.get(v), shape),
        }
    }
}

/// Predicts an unseen vertex from the two opposite ones. Its distance is that of the first, reduced by as much as the
/// first is nearer than the second. The spacing gives the `width` of a step from a vertex.
fn beyond(
    step: Vertex,
    seen: impl Fn(Vertex) -> Option<DVec2>,
    width: impl Fn(Vertex, Vertex) -> f64,
) -> Option<DVec2> {
    let (here, back) = (Vertex::new(0, 0), Vertex::new(-step.row, -step.col));
    let (first, second) = (seen(back)?, seen(back + back)?);
    let [ahead, near, far] = [(here, step), (here, back), (back, back)].map(|(v, s)| width(v, s));
    let shrinks = first.length() / near / ((second - first).length() / far);
    Some(-first * (ahead / near) * shrinks.min(1.0))
}

/// Returns the affine map of displacements on the lattice that fits best; `None` if they are collinear.
fn affine(known: impl Iterator<Item = (DVec2, DVec2)>) -> Option<impl Fn(DVec2) -> DVec2> {
    let (mut normal, mut right) = (DMat2::ZERO, [DVec2::ZERO; 2]);
    for (way, place) in known {
        normal += DMat2::from_cols(way.x * way, way.y * way);
        right = [0, 1].map(|i| right[i] + place[i] * way);
    }
    let rows = (normal.determinant() > MIN_SPREAD).then(|| right.map(|r| normal.inverse() * r))?;
    Some(move |way: DVec2| DVec2::from(rows.map(|row| row.dot(way))))
}

/// Returns the edges through the corner at `vertex`, along the chords between its neighbours.
fn edges(
    grid: &Grid,
    places: &Places,
    vertex: Vertex,
    place: impl Fn(Vertex) -> DVec2,
) -> Vec<Edge> {
    let steps = grid.kind.steps();
    let at = |v: Vertex| places.get(v);
    let bend_at = |v: Vertex, step: Vertex| Some(bend([at(v - step)?, at(v)?, at(v + step)?]));
    let edge = |&step: &Vertex| {
        let chord = place(step) - place(Vertex::new(0, 0) - step);
        // Bends change slowly. Three along a line are more accurate than one. If the line is too short, the next ones
        // have a similar bend.
        let along = [vertex, vertex + step, vertex - step].into_iter();
        let bend = mean(along.filter_map(|v| bend_at(v, step)))
            .or_else(|| mean(grid.kind.neighbours(vertex).filter_map(|v| bend_at(v, step))))
            .unwrap_or(0.0);
        let along = chord.normalize_or_zero();
        let off = steps.iter().map(|&other| along.perp_dot(place(other)).abs());
        let across_px = off.sum::<f64>() / rows_apart(grid.kind);
        let angle_rad = chord.to_angle();
        // After a rotation by 180°, left is right.
        match angle_rad {
            ..0.0 => Edge { angle_rad: angle_rad + PI, bend: -bend, across_px },
            PI.. => Edge { angle_rad: angle_rad - PI, bend: -bend, across_px },
            _ => Edge { angle_rad, bend, across_px },
        }
    };
    let mut edges: Vec<Edge> = steps[..steps.len() / 2].iter().map(edge).collect();
    edges.sort_by(|a, b| a.angle_rad.total_cmp(&b.angle_rad));
    edges
}

/// Returns the sum of the distances of all neighbours from the line along one of them, in edges.
fn rows_apart(kind: GridKind) -> f64 {
    match kind {
        // Four of six lie off the line, by the height of a triangle.
        GridKind::Deltille => 4.0 * 3f64.sqrt() / 2.0,
        GridKind::Checker => 2.0,
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0, 0.0), |(count, sum), value| (count + 1, sum + value));
    (count > 0).then(|| sum / f64::from(count))
}

/// Returns the curvature at the second of three points of the parabola through them, to the left of the direction,
/// 1/px.
fn bend([a, b, c]: [DVec2; 3]) -> f64 {
    let along = (c - a).normalize_or_zero();
    let (before, after) = (b - a, c - b);
    let (t0, t1) = (along.dot(before), along.dot(after));
    let slopes = along.perp_dot(after) / t1 - along.perp_dot(before) / t0;
    let bend = 2.0 * slopes / (t0 + t1);
    if bend.is_finite() { bend } else { 0.0 }
}

/// Returns the corners of the area in a tile at this distance from its edges, in edge lengths.
fn inner(tile: &[DVec2], inset: f64) -> Vec<DVec2> {
    let n = tile.len();
    // Every corner moves along both edges that meet there.
    let corner = |i: usize| {
        let (here, next, last) = (tile[i], tile[(i + 1) % n], tile[(i + n - 1) % n]);
        here + inset * (next + last - 2.0 * here)
    };
    (0..n).map(corner).collect()
}

/// Returns the corners of a square in a square tile at this distance from its edges, in edge lengths, under perspective.
/// Returns `None` if three corners of the tile are collinear.
fn border([p0, p1, p2, p3]: [DVec2; 4], inset: f64) -> Option<Border> {
    let (first, second, rest) = (p1 - p2, p3 - p2, p0 - p1 + p2 - p3);
    let determinant = first.perp_dot(second);
    let nearer = DVec2::new(rest.perp_dot(second), first.perp_dot(rest)) / determinant;
    let (along, beside) = (p1 - p0 + nearer.x * p1, p3 - p0 + nearer.y * p3);
    let (near, far) = (inset, 1.0 - inset);
    let corners = [[near, near], [far, near], [far, far], [near, far]]
        .map(|[u, v]| (p0 + u * along + v * beside) / (1.0 + u * nearer.x + v * nearer.y));
    corners.iter().all(|corner| corner.is_finite()).then_some(corners)
}

/// Returns the sides of an area with these corners, positive outside.
fn outline(corners: &[DVec2]) -> Vec<Line> {
    let n = corners.len();
    let middle = corners.iter().sum::<DVec2>() / n as f64;
    let sides = (0..n).map(|i| line(corners[i], corners[(i + 1) % n], middle));
    sides.map(|side| side.map(|c| -c)).collect()
}

/// Returns the line through two points, positive on the side of a third.
fn line(a: DVec2, b: DVec2, inside: DVec2) -> Line {
    let way = b - a;
    let normal = way.perp() / way.x.hypot(way.y).max(f64::MIN_POSITIVE);
    let offset = -normal.dot(a);
    let sign = (normal.dot(inside) + offset).signum();
    [sign * normal.x, sign * normal.y, sign * offset]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Creates a grid of 5 × 5 corners in the image.
    fn grid(kind: GridKind, image: impl Fn(DVec2) -> DVec2) -> Grid {
        let corners = (0..25).map(|i| {
            let (row, col) = (i / 5, i % 5);
            let DVec2 { x, y } = image(kind.position(row.into(), col.into()));
            GridCorner { row, col, id: None, x, y, cov: None }
        });
        Grid {
            kind,
            target: None,
            panel: None,
            mirrored: false,
            corners: corners.collect(),
            tags: Vec::new(),
        }
    }

    #[test]
    fn corners_are_predicted_and_not_bent_under_perspective() {
        let image = |DVec2 { x, y }: DVec2| {
            let depth = 1.0 + 0.1 * x - 0.05 * y;
            DVec2::new(300.0 + 30.0 * (x - 0.2 * y) / depth, 200.0 - 25.0 * y / depth)
        };
        for kind in [GridKind::Deltille, GridKind::Checker] {
            let grid = grid(kind, image);
            for around in surroundings(&grid, &TagAreas::default(), 1.0) {
                assert!(around.edges.iter().all(|edge| edge.bend.abs() < 1e-9));
            }
            for corner in &grid.corners {
                let mut others = grid.clone();
                others.corners.retain(|other| other != corner);
                let vertex = Vertex::new(corner.row, corner.col);
                let (position, sd_px) = Prediction::from(&others).at(vertex).unwrap();
                let off_px = position.distance(corner.position());
                assert!(off_px < 3.0 * sd_px && sd_px < 10.0, "{off_px} {sd_px}");
            }
        }
    }

    #[test]
    fn lines_on_a_cylinder_are_bent_to_the_left_of_their_direction() {
        // Rows are arcs of radius 400 px that curve towards greater v.
        let image = |DVec2 { x, y }: DVec2| {
            let angle = 0.05 * (x - 2.0);
            let v = 200.0 - 20.0 * y + 400.0 * (1.0 - angle.cos());
            DVec2::new(300.0 + 400.0 * angle.sin(), v)
        };
        let grid = grid(GridKind::Checker, image);
        let around = surroundings(&grid, &TagAreas::default(), 1.0);
        let along_row = around[12].edges[0];
        assert!(along_row.angle_rad.abs() < 1e-9, "{along_row:?}");
        assert!((400.0 * along_row.bend - 1.0).abs() < 0.01, "{along_row:?}");
    }

    #[test]
    fn only_the_area_between_tags_and_far_sides_is_clear() {
        let grid = grid(GridKind::Checker, |place| {
            DVec2::new(100.0 + 40.0 * place.x, 300.0 - 40.0 * place.y)
        });
        let insets = Insets { tag: 0.25, cells: 0.25 };
        let panel = TagsOfPanel { tiles: BTreeSet::new(), insets };
        let tags = TagAreas { targets: vec![(None, BTreeMap::from([(0, panel)]))] };
        let around = &surroundings(&grid, &tags, 1.0)[12];
        // Cells begin 10 px from both edges; the blur reaches 2 px.
        let off_tags = around.off_tags(Margin::of(1.0), false);
        let clear = |u: f64, v: f64| {
            let [first, last] = around.span(v, Margin::of(1.0));
            (first..=last).contains(&u) && off_tags(DVec2::new(u, v))
        };
        assert!(clear(7.0, 7.0) && clear(35.0, 6.0) && clear(-6.0, 35.0));
        assert!(!clear(12.0, 12.0) && !clear(9.0, 20.0) && !clear(39.0, 0.0));
        let square_px = (10.0 - 2.0) * std::f64::consts::FRAC_1_SQRT_2;
        assert!((around.clear_square_px(Margin::of(1.0)) - square_px).abs() < 1e-9);
    }

    #[test]
    fn borders_follow_perspective() {
        let image = |DVec2 { x, y }: DVec2| {
            let depth = 1.0 + 0.3 * x - 0.2 * y;
            DVec2::new(30.0 * (x - 0.2 * y) / depth, -25.0 * y / depth)
        };
        let square = |low: f64, high: f64| {
            [[low, low], [high, low], [high, high], [low, high]].map(|at| image(at.into()))
        };
        let found = border(square(0.0, 1.0), 0.2).unwrap();
        for (found, seen) in found.iter().zip(square(0.2, 0.8)) {
            assert!(found.abs_diff_eq(seen, 1e-9), "{found} {seen}");
        }
        assert_eq!(border([DVec2::ZERO, DVec2::X, 2.0 * DVec2::X, 3.0 * DVec2::X], 0.2), None);
    }
}
