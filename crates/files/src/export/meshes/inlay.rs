//! A target as two bodies, one inlaid into the other: the dark parts, with the requested depth and flush with the surface, and the
//! rest of the plate or solid.
//!
//! ```text
//!        black   black            Each face is cut into triangles of one colour. The dark ones are
//!      ▄▄▄███▄▄▄▄███▄▄▄  surface  lowered; walls join their outlines with those of the white ones.
//!      ███▀▀▀████▀▀▀███           Where tiles touch in a corner, each pocket has a wall down to
//!      ████████████████           a vertex of its own, so that every edge has two triangles.
//! ```

use std::collections::{BTreeMap, VecDeque};

use glam::{DVec2, DVec3, Vec2Swizzles};
use kurbo::PathEl;
use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::mesh::smallest_cell_mm;
pub use super::meshing::{INLAY_MM, MIN_INLAY_MM};
use super::meshing::{MeshError, Meshing};
use deltille_core::polygon::{bounds, hull, rectangle};
use deltille_core::targets::{Panel, Polyhedron, Target, TargetError, TargetSpec};
use deltille_layout::artwork::{Part, Shape, panel_shapes, subject};

/// Distance below which two points are the same corner computed in two ways, mm.
const SAME_MM: f64 = 1e-6;

/// Maximum distance of a polygon from the curve that it replaces, mm.
const CURVE_MM: f64 = 0.002;

/// A closed body, mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Body {
    /// Vertices in the target frame, mm.
    pub vertices_mm: Vec<DVec3>,
    /// Indices of the vertices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[usize; 3]>,
}

impl Body {
    fn vertex(&mut self, place: DVec3) -> usize {
        self.vertices_mm.push(place);
        self.vertices_mm.len() - 1
    }
}

/// A white and a black body that together fill a plate or a solid.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct InlaidBodies {
    /// Name of the target.
    pub name: String,
    /// One-line description of the target.
    pub subject: String,
    /// The body without the black parts.
    pub white: Body,
    /// The dark parts of the drawing, flush with the surface.
    pub black: Body,
    /// Edge of the smallest cell of a tag, mm; `None` without tags.
    pub cell_mm: Option<f64>,
    /// Directions of the fronts of the boards in the target frame.
    fronts: Vec<DVec3>,
}

impl InlaidBodies {
    /// Makes the bodies of a convex solid, or of a plate with a board and its quiet zone. The front of the plate is the plane of
    /// the board.
    ///
    /// # Errors
    /// Returns an error if the target is neither, or has several boards, if the family of its tags is unknown, or if the inlay
    /// reaches through the plate or meets the inlay of another face.
    pub fn new(target: &Target, meshing: Meshing) -> Result<Self, MeshError> {
        let name = target.name.to_string();
        if meshing.inlay_mm.is_nan() || meshing.inlay_mm < MIN_INLAY_MM {
            return Err(MeshError::ThinInlay(meshing.inlay_mm));
        }
        let [white, black] = match (&target.spec, target.panels.as_slice()) {
            (spec, [panel]) if spec.is_on_plate() => {
                plate(panel, &panel_shapes(target, panel)?, meshing)?
            }
            (TargetSpec::Board(spec), _) if spec.two_sided_mm.is_some() => {
                return Err(MeshError::TwoSides(name));
            }
            (TargetSpec::Board(_), panels) => {
                return Err(MeshError::SeveralBoards(name, panels.len()));
            }
            (TargetSpec::Solid(spec), _) => solid(target, &spec.polyhedron(), meshing.inlay_mm)?,
            _ => return Err(MeshError::NoShape(name)),
        };
        let family = target.family().map_err(TargetError::from)?;
        let cell_mm = family.map(|family| smallest_cell_mm(target, Some(family)));
        let fronts = target.panels.iter().map(|panel| panel.pose.matrix() * DVec3::Z).collect();
        Ok(Self { name, subject: subject(target), white, black, cell_mm, fronts })
    }

    /// Returns width, depth and height, mm, of the bodies with a board on the bed of a printer, and the scale at which
    /// they just fit on a bed of this width and depth. Uses the board and the rotation with a side along the bed that
    /// fit best, or any rotation if none of these fits.
    pub fn on_bed(&self, [width_mm, depth_mm]: [f64; 2]) -> (DVec3, f64) {
        let mut best = (DVec3::ZERO, 0.0);
        for &front in &self.fronts {
            let (x, y) = front.any_orthonormal_pair();
            let vertices = || self.white.vertices_mm.iter();
            let footprint = hull(vertices().map(|at| DVec2::new(x.dot(*at), y.dot(*at))).collect());
            let heights = vertices().map(|at| front.dot(*at));
            let (low, high) = (
                heights.clone().fold(f64::INFINITY, f64::min),
                heights.fold(f64::NEG_INFINITY, f64::max),
            );
            let sides = (0..footprint.len())
                .map(|i| footprint[(i + 1) % footprint.len()] - footprint[i])
                .map(|side| (true, DVec2::new(side.x, -side.y).normalize_or(DVec2::X)));
            let steps = (0..90).map(|degrees| f64::from(degrees).to_radians());
            let steps = steps.map(|angle| (false, DVec2::from_angle(angle)));
            for (is_side, along) in sides.chain(steps) {
                let turned: Vec<DVec2> = footprint.iter().map(|at| along.rotate(*at)).collect();
                let [left, lower, right, upper] = bounds(&turned);
                let size = DVec2::new(right - left, upper - lower);
                for size in [size, size.yx()] {
                    let scale = (width_mm / size.x).min(depth_mm / size.y);
                    if scale > best.1 && (is_side || best.1 < 1.0) {
                        best = (size.extend(high - low), scale);
                    }
                }
            }
        }
        best
    }
}

/// The white and the black body of a plate.
fn plate(panel: &Panel, shapes: &[Shape], meshing: Meshing) -> Result<[Body; 2], MeshError> {
    let (plate_mm, inlay_mm) = (meshing.plate_mm, meshing.inlay_mm);
    if !(0.1..=1000.0).contains(&plate_mm) {
        return Err(MeshError::Thickness(plate_mm));
    }
    if inlay_mm >= plate_mm {
        return Err(MeshError::DeepInlay { inlay_mm, most_mm: plate_mm });
    }
    let outline = rectangle(panel.field_mm());
    let face = Face::new(&outline, shapes)?;
    let place = |point: DVec2, depth_mm: f64| below(panel, point, depth_mm);
    let (mut white, mut black) = (Body::default(), Body::default());
    let rim_mm = if face.is_rim_dark() { inlay_mm } else { 0.0 };
    let rim = outline.map(|point| white.vertex(place(point, rim_mm)));
    face.inlay(&mut white, &mut black, &rim, inlay_mm, place);
    let back = outline.map(|point| white.vertex(place(point, plate_mm)));
    for i in 0..rim.len() {
        let next = (i + 1) % rim.len();
        white.triangles.extend(wall([rim[next], rim[i]], [back[next], back[i]]));
    }
    let [a, b, c, d] = back;
    white.triangles.extend([[d, c, b], [d, b, a]]);
    Ok([white, black])
}

/// The white and the black body of a solid.
fn solid(target: &Target, solid: &Polyhedron, inlay_mm: f64) -> Result<[Body; 2], MeshError> {
    let planes: Vec<(DVec3, DVec3)> = (0..solid.faces.len())
        .map(|face| (solid.normal(face), solid.corners_mm(face)[0]))
        .collect();
    let is_behind = |&(normal, at): &(DVec3, DVec3)| {
        solid.vertices_mm.iter().all(|&vertex| normal.dot(vertex - at) < SAME_MM)
    };
    if !planes.iter().all(is_behind) {
        return Err(MeshError::Dented(target.name.to_string()));
    }
    let mut white = Body { vertices_mm: solid.vertices_mm.clone(), triangles: Vec::new() };
    let mut black = Body::default();
    let mut most_mm = f64::INFINITY;
    for (index, panel) in target.panels.iter().enumerate() {
        let outline: Vec<DVec2> = solid
            .corners_mm(index)
            .into_iter()
            .map(|vertex| panel.pose.panel_from_target(vertex).truncate())
            .collect();
        let face = Face::new(&outline, &panel_shapes(target, panel)?)?;
        let dark = face.dark_points().map(|point| below(panel, point, 0.0));
        most_mm = dark.fold(most_mm, |most, place| most.min(deepest(place, &planes, index)));
        let place = |point: DVec2, depth_mm: f64| below(panel, point, depth_mm);
        face.inlay(&mut white, &mut black, &solid.faces[index], inlay_mm, place);
    }
    match inlay_mm < most_mm {
        true => Ok([white, black]),
        false => Err(MeshError::DeepInlay { inlay_mm, most_mm }),
    }
}

/// Maximum depth of an inlay at a position on a face, mm. An inlay of at most this depth stays
/// nearer to this face than to any other, so it meets no other inlay.
fn deepest(place: DVec3, planes: &[(DVec3, DVec3)], face: usize) -> f64 {
    let inwards = planes[face].0;
    let others = planes.iter().enumerate().filter(|&(other, _)| other != face);
    let depths = others.map(|(_, &(normal, at))| {
        let away = 1.0 - inwards.dot(normal);
        // A face in the same plane does not limit the depth.
        if away < 1e-9 { f64::INFINITY } else { normal.dot(at - place) / away }
    });
    depths.fold(f64::INFINITY, f64::min)
}

/// The position behind a point of the surface of a panel, in the target frame.
fn below(panel: &Panel, point: DVec2, depth_mm: f64) -> DVec3 {
    panel.pose.target_from_panel(point) - depth_mm * panel.pose.matrix().z_axis
}

/// The two triangles of a wall below the edge `from` – `to`, facing the left of that edge; `below_from` and `below_to` are the
/// vertices below its ends.
fn wall([from, to]: [usize; 2], [below_from, below_to]: [usize; 2]) -> [[usize; 3]; 2] {
    [[from, to, below_to], [from, below_to, below_from]]
}

/// A face divided into triangles of one colour each.
struct Face {
    /// Corners of the outline, then those of the drawing, in the frame of the panel, mm.
    points: Vec<DVec2>,
    /// Counter-clockwise.
    triangles: Vec<[usize; 3]>,
    /// Whether each triangle is dark.
    is_dark: Vec<bool>,
    /// For each directed edge, the triangle on its left.
    left_of: BTreeMap<[usize; 2], usize>,
}

impl Face {
    /// Cuts a convex, counter-clockwise outline along the edges of the drawing in it.
    fn new(outline: &[DVec2], shapes: &[Shape]) -> Result<Self, MeshError> {
        let mut points = Points::default();
        let rim: Vec<usize> = outline.iter().map(|&point| points.index_of(point)).collect();
        let loops: Vec<Vec<usize>> = shapes
            .iter()
            .flat_map(|shape| {
                let mut loops = loops(shape.path.elements());
                // The field of an inverted board fills the outline exactly.
                if let (Part::Field { .. }, Some(field)) = (shape.part, loops.first_mut())
                    && field.iter().zip(outline).all(|(p, q)| p.distance(*q) < SAME_MM)
                {
                    *field = outline.to_vec();
                }
                loops
            })
            .map(|corners| corners.into_iter().map(|corner| points.index_of(corner)).collect())
            .collect();
        // Even-odd rule: the colour changes across an edge that occurs an odd number of times.
        let mut edges = BTreeMap::<[usize; 2], bool>::new();
        for corners in &loops {
            for (i, &from) in corners.iter().enumerate() {
                let to = corners[(i + 1) % corners.len()];
                for [from, to] in points.parts(from, to) {
                    *edges.entry([from.min(to), from.max(to)]).or_default() ^= true;
                }
            }
        }
        let changes = |[from, to]: [usize; 2]| {
            edges.get(&[from.min(to), from.max(to)]).copied().unwrap_or_default()
        };
        let constraints = edges.keys().copied().collect();
        let places = points.places;
        let vertices = places.iter().map(|p| Point2::new(p.x, p.y)).collect();
        let mut crossed = false;
        let map = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(
            vertices,
            constraints,
            |_| crossed = true,
        );
        let map = map.ok().filter(|map| !crossed && map.num_vertices() == places.len());
        let map = map.ok_or(MeshError::Crossing)?;
        let triangles: Vec<[usize; 3]> = map
            .inner_faces()
            .map(|face| face.vertices().map(|vertex| vertex.fix().index()))
            .collect();
        let left_of: BTreeMap<[usize; 2], usize> = (triangles.iter().enumerate())
            .flat_map(|(index, &triangle)| edges_of(triangle).map(|edge| (edge, index)))
            .collect();
        let mut is_dark = vec![None; triangles.len()];
        let first = [rim[0], rim[1]];
        let start = *left_of.get(&first).ok_or(MeshError::Crossing)?;
        is_dark[start] = Some(changes(first));
        let mut open = VecDeque::from([start]);
        while let Some(here) = open.pop_front() {
            for [from, to] in edges_of(triangles[here]) {
                if let Some(&beyond) = left_of.get(&[to, from])
                    && is_dark[beyond].is_none()
                {
                    is_dark[beyond] = is_dark[here].map(|dark| dark ^ changes([from, to]));
                    open.push_back(beyond);
                }
            }
        }
        let is_dark = is_dark.into_iter().map(|dark| dark == Some(true)).collect();
        Ok(Self { points: places, triangles, is_dark, left_of })
    }

    /// The corners of the dark triangles.
    fn dark_points(&self) -> impl Iterator<Item = DVec2> {
        let dark = self.triangles.iter().zip(&self.is_dark).filter(|(_, is_dark)| **is_dark);
        dark.flat_map(|(triangle, _)| triangle.map(|point| self.points[point]))
    }

    /// Whether the outline is dark; it has one colour.
    fn is_rim_dark(&self) -> bool {
        self.left_of.get(&[0, 1]).is_some_and(|&index| self.is_dark[index])
    }

    /// Adds the surface of the face, with pockets for the dark parts, to the white body, and the dark parts to the black body.
    /// `rim` contains the vertices of the white body at the corners of the outline, at their depth. `place` returns the position
    /// of a point at a depth below the face.
    fn inlay(
        &self,
        white: &mut Body,
        black: &mut Body,
        rim: &[usize],
        depth_mm: f64,
        place: impl Fn(DVec2, f64) -> DVec3,
    ) {
        let fans = self.dark_fans();
        // For each fan of dark triangles around a point: the upper and lower vertex of the black body, and the vertex on
        // the floor of the pocket.
        let mut of_fan = BTreeMap::new();
        let mut of_point = BTreeMap::new();
        for (index, triangle) in self.triangles.iter().enumerate() {
            for (corner, &point) in triangle.iter().enumerate() {
                let at = |depth_mm| place(self.points[point], depth_mm);
                if self.is_dark[index] {
                    of_fan.entry(fans[3 * index + corner]).or_insert_with(|| {
                        let floor = rim.get(point).copied();
                        let floor = floor.unwrap_or_else(|| white.vertex(at(depth_mm)));
                        [black.vertex(at(0.0)), black.vertex(at(depth_mm)), floor]
                    });
                } else {
                    let vertex = || white.vertex(at(0.0));
                    let on_rim = rim.get(point).copied();
                    of_point.entry(point).or_insert_with(|| on_rim.unwrap_or_else(vertex));
                }
            }
        }
        for (index, &triangle) in self.triangles.iter().enumerate() {
            if !self.is_dark[index] {
                white.triangles.push(triangle.map(|point| of_point[&point]));
                continue;
            }
            let [a, b, c] = [0, 1, 2].map(|corner| of_fan[&fans[3 * index + corner]]);
            let [above, under, floor] = [0, 1, 2].map(|level| [a[level], b[level], c[level]]);
            black.triangles.push(above);
            black.triangles.push([under[0], under[2], under[1]]);
            white.triangles.push(floor);
            for (i, [from, to]) in edges_of(triangle).into_iter().enumerate() {
                let next = (i + 1) % 3;
                let beyond = self.left_of.get(&[to, from]);
                if beyond.is_some_and(|&beyond| self.is_dark[beyond]) {
                    continue;
                }
                black.triangles.extend(wall([above[next], above[i]], [under[next], under[i]]));
                if beyond.is_some() {
                    let upper = [from, to].map(|point| of_point[&point]);
                    white.triangles.extend(wall(upper, [floor[i], floor[next]]));
                }
            }
        }
    }

    /// The fan of each corner of each triangle. A fan consists of the dark triangles around a point that are connected by edges; its
    /// number is the smallest value of 3 · triangle + corner in it.
    fn dark_fans(&self) -> Vec<usize> {
        let mut fans: Vec<usize> = (0..3 * self.triangles.len()).collect();
        fn root(fans: &[usize], mut of: usize) -> usize {
            while fans[of] != of {
                of = fans[of];
            }
            of
        }
        for (&[from, to], &here) in &self.left_of {
            let Some(&beyond) = self.left_of.get(&[to, from]) else { continue };
            if !(self.is_dark[here] && self.is_dark[beyond]) {
                continue;
            }
            for point in [from, to] {
                let corners = [here, beyond].map(|index| {
                    let corner = self.triangles[index].iter().position(|&p| p == point);
                    root(&fans, 3 * index + corner.unwrap_or_default())
                });
                let [a, b] = corners;
                fans[a.max(b)] = a.min(b);
            }
        }
        (0..fans.len()).map(|of| root(&fans, of)).collect()
    }
}

fn edges_of([a, b, c]: [usize; 3]) -> [[usize; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Distinct points with their indices.
#[derive(Default)]
struct Points {
    places: Vec<DVec2>,
    tree: RTree<GeomWithData<[f64; 2], usize>>,
}

impl Points {
    /// Returns the index of a point, and adds the point if it is new.
    fn index_of(&mut self, point: DVec2) -> usize {
        let near = self.tree.nearest_neighbor(point.to_array()).map(|near| near.data);
        if let Some(index) = near.filter(|&index| self.places[index].distance(point) < SAME_MM) {
            return index;
        }
        let index = self.places.len();
        self.places.push(point);
        self.tree.insert(GeomWithData::new(point.to_array(), index));
        index
    }

    /// The parts of an edge between the points on it.
    fn parts(&self, from: usize, to: usize) -> Vec<[usize; 2]> {
        let (start, end) = (self.places[from], self.places[to]);
        let along = (end - start).normalize_or_zero();
        let slack = DVec2::splat(SAME_MM);
        let low = start.min(end) - slack;
        let high = start.max(end) + slack;
        let around = AABB::from_corners(low.to_array(), high.to_array());
        let here = self.tree.locate_in_envelope(around).map(|point| point.data);
        let mut on_edge: Vec<(f64, usize)> = here
            .filter(|&index| along.perp_dot(self.places[index] - start).abs() < SAME_MM)
            .map(|index| (along.dot(self.places[index] - start), index))
            .collect();
        on_edge.sort_by(|a, b| a.0.total_cmp(&b.0));
        on_edge.windows(2).map(|ends| [ends[0].1, ends[1].1]).collect()
    }
}

/// The closed loops of a path, with curves replaced by straight lines within [`CURVE_MM`].
fn loops(path: &[PathEl]) -> Vec<Vec<DVec2>> {
    let mut loops: Vec<Vec<DVec2>> = Vec::new();
    kurbo::flatten(path.iter().copied(), CURVE_MM, |element| match element {
        PathEl::MoveTo(p) => loops.push(vec![DVec2::new(p.x, p.y)]),
        PathEl::LineTo(p) => {
            if let Some(last) = loops.last_mut() {
                last.push(DVec2::new(p.x, p.y));
            }
        }
        _ => {}
    });
    // A closed curve ends at its start.
    for corners in &mut loops {
        if let [first, .., last] = corners[..]
            && first.distance(last) < SAME_MM
        {
            corners.pop();
        }
    }
    loops
}
