//! The figure of a target: its faces, tiles and edges as lines in parallel projection.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use deltille_core::angles::direction;
use deltille_core::lattice::{GridKind, Tile};
use deltille_core::polygon::rectangle;
use deltille_core::targets::{Corner, Panel, Polyhedron, Target, TargetSpec};

/// Widths of the lines of the figure and of the marks of the ruler, mm.
pub(super) const THICK_MM: f64 = 0.3;
pub(super) const THIN_MM: f64 = 0.15;
/// Number of pieces into which a line is divided; each is either hidden or drawn.
const PIECES: usize = 60;
/// Maximum number of tiles of a board that are drawn: more would run together.
const MAX_TILES: usize = 250;
/// Thickness of the plate in the figure, as a fraction of its diagonal.
const PLATE_PART: f64 = 0.02;
/// Number of sides of the polygon that approximates a circle.
const DISC_SIDES: usize = 24;
/// Heights of the hatching lines of a black tile, as fractions of its height.
const HATCHING: [f64; 6] = [0.0, 0.16, 0.32, 0.48, 0.64, 0.8];
/// Viewing directions: of solids, and of boards in the panel frame.
const SOLID_FROM: DVec3 = DVec3::new(0.55, -0.75, 0.42);
const BOARD_FROM: DVec3 = DVec3::new(-0.3, 0.4, 0.85);

#[derive(Clone, Copy)]
pub(super) struct View {
    right: DVec3,
    up: DVec3,
    pub(super) towards: DVec3,
}

impl View {
    /// Returns the view from a direction, with the axis `upwards` vertical in the figure.
    pub(super) fn from(direction: DVec3, upwards: DVec3) -> Self {
        let towards = direction.normalize();
        let right = upwards.cross(towards).normalize();
        Self { right, up: towards.cross(right), towards }
    }

    pub(super) fn projected(&self, point: DVec3) -> DVec2 {
        DVec2::new(point.dot(self.right), point.dot(self.up))
    }
}

/// The content of the figure, in the target frame, mm.
pub(super) struct Model {
    pub(super) view: View,
    /// Faces that hide what is behind them; the faces of a solid have numbers.
    pub(super) faces: Vec<Vec<DVec3>>,
    /// Direction of the upper end of each face.
    pub(super) up: Vec<DVec3>,
    pub(super) numbers: Vec<String>,
    /// Lines, with their widths on the page.
    pub(super) lines: Vec<([DVec3; 2], f64)>,
}

impl Model {
    pub(super) fn of(target: &Target) -> Self {
        match (&target.spec, target.panels.first()) {
            (TargetSpec::Solid(spec), _) => Self::of_solid(&spec.polyhedron(), &target.panels),
            (_, Some(panel)) => Self::of_board(panel),
            (_, None) => Self::blank(BOARD_FROM, DVec3::Y),
        }
    }

    fn blank(from: DVec3, upwards: DVec3) -> Self {
        let view = View::from(from, upwards);
        let (faces, up, numbers) = (Vec::new(), Vec::new(), Vec::new());
        Self { view, faces, up, numbers, lines: Vec::new() }
    }

    fn of_solid(solid: &Polyhedron, panels: &[Panel]) -> Self {
        let edges = solid
            .edges()
            .into_iter()
            .map(|ends| (ends.map(|end| solid.vertices_mm[end]), THICK_MM));
        Self {
            faces: (0..solid.faces.len()).map(|face| solid.corners_mm(face)).collect(),
            up: panels.iter().map(|panel| panel.pose.matrix().y_axis).collect(),
            numbers: (0..panels.len()).map(|face| face.to_string()).collect(),
            lines: edges.collect(),
            ..Self::blank(SOLID_FROM, DVec3::Z)
        }
    }

    /// Builds the model of a board on its plate, with its black tiles.
    fn of_board(panel: &Panel) -> Self {
        let at = |point: DVec2| panel.pose.target_from_panel(point);
        let plate = rectangle(panel.field_mm()).map(at);
        let front = panel.pose.matrix();
        let depth = PLATE_PART * plate[0].distance(plate[2]);
        let behind = plate.map(|corner| corner - depth * panel.pose.matrix().z_axis);
        let next = |i: usize| (i + 1) % 4;
        let rims = (0..4).map(|i| vec![plate[next(i)], plate[i], behind[i], behind[next(i)]]);
        let edges = (0..4).flat_map(|i| {
            [[plate[i], plate[next(i)]], [plate[i], behind[i]], [behind[i], behind[next(i)]]]
        });
        let tiles = tile_lines(panel).into_iter().map(|line| (line.map(at), THIN_MM));
        Self {
            faces: [plate.to_vec()].into_iter().chain(rims).collect(),
            lines: edges.map(|edge| (edge, THICK_MM)).chain(tiles).collect(),
            ..Self::blank(front * BOARD_FROM, front * DVec3::Y)
        }
    }

    /// Returns the visible pieces of a line, projected into the figure.
    pub(super) fn seen_of(&self, [from, to]: [DVec3; 2]) -> Vec<[DVec2; 2]> {
        let at = |share: f64| from.lerp(to, share / PIECES as f64);
        let mut pieces: Vec<[usize; 2]> = Vec::new();
        for piece in (0..PIECES).filter(|&piece| !self.is_hidden(at(piece as f64 + 0.5), None)) {
            match pieces.last_mut() {
                Some([_, end]) if *end == piece => *end = piece + 1,
                _ => pieces.push([piece, piece + 1]),
            }
        }
        let ends = |piece: [usize; 2]| piece.map(|end| self.view.projected(at(end as f64)));
        pieces.into_iter().map(ends).collect()
    }

    /// Returns whether a face other than `own` lies between a point and the eye.
    pub(super) fn is_hidden(&self, point: DVec3, own: Option<usize>) -> bool {
        let others = self.faces.iter().enumerate().filter(|(index, _)| Some(*index) != own);
        others.into_iter().any(|(_, face)| self.hides(face, point))
    }

    /// Returns whether a flat convex face hides a point, that is, whether the ray from the point to the eye passes
    /// through its interior.
    fn hides(&self, face: &[DVec3], point: DVec3) -> bool {
        let normal = (1..face.len() - 1)
            .map(|i| (face[i] - face[0]).cross(face[i + 1] - face[0]))
            .sum::<DVec3>()
            .normalize_or_zero();
        let slope = normal.dot(self.view.towards);
        let reach = face[0].distance(face[1]);
        let distance = normal.dot(face[0] - point) / slope;
        // A face does not hide points in its own plane, and a face seen edge-on hides nothing.
        if slope.abs() < 1e-9 || distance < 1e-6 * reach {
            return false;
        }
        let through = point + distance * self.view.towards;
        (0..face.len()).all(|i| {
            let (a, b) = (face[i], face[(i + 1) % face.len()]);
            normal.cross(b - a).normalize_or_zero().dot(through - a) > 1e-6 * reach
        })
    }
}

/// Returns the outlines and the hatching of the black tiles of a panel, in its frame, mm; empty if
/// there are too many to be
/// visible.
fn tile_lines(panel: &Panel) -> Vec<[DVec2; 2]> {
    let tiles = panel.dark_tiles();
    if tiles.len().max(panel.corners.len()) > MAX_TILES || panel.corners.is_empty() {
        return Vec::new();
    }
    if let Some(diameter) = panel.discs_mm {
        let rim = |corner: &Corner, n: usize| {
            let angle = TAU * n as f64 / DISC_SIDES as f64;
            corner.panel_mm + diameter / 2.0 * direction(angle)
        };
        let of_disc = |corner| (0..DISC_SIDES).map(move |n| [rim(corner, n), rim(corner, n + 1)]);
        return panel.corners.iter().flat_map(of_disc).collect();
    }
    let of_tile = |tile: Tile| {
        let [a, b, c] = tile.frame().map(|vertex| panel.lattice_mm(vertex));
        let last = match panel.kind {
            GridKind::Deltille => c,
            GridKind::Checker => b + c - a,
        };
        let sides = [[a, c], [b, last]];
        // For a triangle, the upper side is a point.
        let top = (panel.kind == GridKind::Checker).then_some([c, last]);
        let hatched = HATCHING.map(|part| sides.map(|[foot, top]| foot.lerp(top, part)));
        sides.into_iter().chain(top).chain(hatched)
    };
    tiles.into_iter().flat_map(of_tile).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Printing;
    use deltille_core::targets::{SolidShape, SolidSpec};

    /// Every edge of a front-facing face of a convex solid is visible in full; the other edges are hidden.
    #[test]
    fn a_convex_solid_shows_its_front_faces() {
        let solid = SolidSpec::new(SolidShape::Icosahedron);
        let target = Printing::new("target", solid.clone()).unwrap();
        let model = Model::of(&target.target);
        let (polyhedron, edges) = (solid.polyhedron(), solid.polyhedron().edges());
        let is_front = |face: usize| polyhedron.normal(face).dot(model.view.towards) > 0.0;
        for (edge, (line, _)) in edges.iter().zip(&model.lines) {
            let mut faces =
                (0..20).filter(|&f| edge.iter().all(|v| polyhedron.faces[f].contains(v)));
            let seen = model.seen_of(*line);
            assert_eq!(!seen.is_empty(), faces.any(is_front), "{edge:?}");
            let length: f64 = seen.iter().map(|[a, b]| a.distance(*b)).sum();
            let [a, b] = line.map(|end| model.view.projected(end));
            assert!(seen.is_empty() || (length - a.distance(b)).abs() < 1e-9, "{edge:?}");
        }
    }
}
