//! Solids with a board of tiles on each face.

use std::collections::BTreeMap;

use glam::DVec3;

use super::solid_spec::mean_side;
use crate::family::Family;
use crate::lattice::{GridKind, Vertex};
use crate::setting::Setting::{SolidEdgeMm, SolidMarginMm, SolidTiles};
use crate::targets::boards::board::tagged_tiles;
use crate::targets::boards::capacity::{TagSettings, check_family, wider_spacing};
use crate::targets::boards::tag_spec::MAX_ROWS;
use crate::targets::length::format_mm;
use crate::targets::{
    Corner, Face, FaceBoard, FamilyRef, Incircle, Panel, Polyhedron, Skeleton, SolidShape,
    SolidSpec, TagSpec, TagsIn, TargetError,
};

/// Least blank margin along the edges of a panel in a skeleton, mm: room for the number of its face, and for
/// inaccurate cuts.
const MIN_PANEL_MARGIN_MM: f64 = 3.0;

impl SolidSpec {
    /// Returns the solid.
    pub fn polyhedron(&self) -> Polyhedron {
        match &self.shape {
            SolidShape::Tetrahedron => Polyhedron::tetrahedron(self.edge_mm),
            SolidShape::Octahedron => Polyhedron::octahedron(self.edge_mm),
            SolidShape::Icosahedron => Polyhedron::icosahedron(self.edge_mm),
            SolidShape::Cube => Polyhedron::cuboid(DVec3::splat(self.edge_mm)),
            SolidShape::Cuboid(sides) => {
                Polyhedron::cuboid(*sides * (self.edge_mm / mean_side(*sides)))
            }
            SolidShape::Mesh(mesh) => {
                let scale = self.edge_mm / mesh.mean_edge();
                let vertices_mm = mesh.vertices().iter().map(|&v| v * scale).collect();
                Polyhedron { vertices_mm, faces: mesh.faces().to_vec() }
            }
        }
    }

    /// Returns the faces with their boards, in the order of the panels.
    ///
    /// # Errors
    /// Returns an error if the margin leaves no room for tiles.
    pub fn faces(&self) -> Result<Vec<Face>, TargetError> {
        self.check()?;
        let solid = self.polyhedron();
        let square_edge_mm = solid.square_edge_mm(self.tiles, self.margin_mm);
        (0..solid.faces.len())
            .map(|index| {
                let face =
                    solid.face_with_squares(index, self.tiles, self.margin_mm, square_edge_mm);
                let face = face
                    .filter(|face| face.tile_edge_mm >= Self::MIN_TILE_MM)
                    .ok_or_else(|| self.too_fine(&solid))?;
                let most = face.board.matrix().into_iter().max().unwrap_or_default();
                if most > MAX_ROWS {
                    let problem = format!(
                        "face {index} would have {most} corners in a row, more than {MAX_ROWS}: use fewer tiles, or sides of more similar length"
                    );
                    return Err(TargetError::invalid(SolidTiles, problem));
                }
                let is_filled = matches!(face.board, FaceBoard::Filled { .. });
                let is_bare = |tags: &TagSpec| tagged(&face.board, tags).is_empty();
                if is_filled && self.tags.as_ref().is_some_and(is_bare) {
                    let problem = format!(
                        "{} tiles leave no room for a tag on face {index} with {} sides: use more tiles",
                        self.tiles,
                        face.outline_mm.len()
                    );
                    return Err(TargetError::invalid(SolidTiles, problem));
                }
                Ok(face)
            })
            .collect()
    }

    /// Returns the faces as they are cut to panels: whole, or the part that the seats of the skeleton accept.
    ///
    /// # Errors
    /// Returns an error if the margin leaves no room for tiles, or the seats take more than the margin.
    pub fn panel_faces(&self) -> Result<Vec<Face>, TargetError> {
        let (mut faces, inset_mm) = (self.faces()?, self.panel_inset_mm()?);
        for face in &mut faces {
            let corners: Vec<DVec3> = face.outline_mm.iter().map(|v| v.extend(0.0)).collect();
            let inner = Incircle::of(&corners).inset(&corners, inset_mm, 0.0);
            face.outline_mm = inner.into_iter().map(DVec3::truncate).collect();
        }
        Ok(faces)
    }

    /// Returns a margin with room for numbers and glue, in whole millimetres: that of [`Self::new`], or more if the
    /// panels of the skeleton need it for their white border.
    ///
    /// # Errors
    /// Returns an error if there is no room for seats, ledges and windows.
    pub fn comfortable_margin_mm(&self) -> Result<f64, TargetError> {
        let usual = self.usual_margin_mm();
        let Some(skeleton) = &self.skeleton else { return Ok(usual) };
        let inset_mm = Skeleton::new(&self.polyhedron(), skeleton)?.panel_inset_mm;
        Ok(usual.max(self.margin_around_mm(inset_mm + MIN_PANEL_MARGIN_MM).ceil()))
    }

    /// Returns the distance of the edges of panels from those of their faces, mm: 0 without a skeleton.
    ///
    /// # Errors
    /// Returns an error if it exceeds the white margin: the tiles, or the black field of an
    /// inverted board, would lie on the ribs.
    pub fn panel_inset_mm(&self) -> Result<f64, TargetError> {
        let Some(skeleton) = &self.skeleton else { return Ok(0.0) };
        let inset_mm = Skeleton::new(&self.polyhedron(), skeleton)?.panel_inset_mm;
        if inset_mm > self.white_margin_mm() {
            let what = if self.inverted { "the black around tiles" } else { "tiles" };
            let problem = format!(
                "{what} {} from the edges would lie on the ribs: use at least {:.1} mm, or thinner \
                 panels",
                format_mm(self.margin_mm),
                (self.margin_around_mm(inset_mm) * 10.0).ceil() / 10.0
            );
            return Err(TargetError::invalid(SolidMarginMm, problem));
        }
        Ok(inset_mm)
    }

    /// Creates the error for faces without room for their tiles; it states the edge at which all have room.
    ///
    /// Tiles of a face without margin grow with the edge of the face, but a margin takes the same from faces of all
    /// sizes. So tiles of edge t within a margin need a face (t + taken) / bare times as large.
    fn too_fine(&self, solid: &Polyhedron) -> TargetError {
        let edge_of = |margin_mm: f64| {
            (0..solid.faces.len())
                .filter_map(move |face| solid.face(face, self.tiles, margin_mm))
                .map(|face| face.tile_edge_mm)
        };
        // The effect of a margin is proportional to it; any face has room for this one.
        let small = 1e-6 * self.edge_mm;
        let needed = edge_of(0.0).zip(edge_of(small)).map(|(bare, less)| {
            let taken = (bare - less) / small * self.margin_mm;
            (Self::MIN_TILE_MM + taken) / bare * self.edge_mm
        });
        let least = needed.fold(Self::MIN_EDGE_MM, f64::max).ceil();
        let problem = format!(
            "{} leaves no room for {} tiles of at least {} per side within margins of {}: use \
             {SolidEdgeMm} of at least {least} mm, fewer {SolidTiles}, or a smaller \
             {SolidMarginMm}",
            format_mm(self.edge_mm),
            self.tiles,
            format_mm(Self::MIN_TILE_MM),
            format_mm(self.margin_mm),
        );
        TargetError::invalid(SolidEdgeMm, problem)
    }
}

/// Returns the tiles of a face that carry tags.
fn tagged(board: &FaceBoard, tags: &TagSpec) -> Vec<Vertex> {
    tagged_tiles(board.kind(), &board.corners(), tags.spacing, tags.tags_in)
}

/// Returns the number of tags that the faces of a tiling need.
fn tag_count(faces: &[Face], kind: GridKind, tags: &TagSpec) -> u64 {
    let mut of_board = BTreeMap::new();
    let counts = faces.iter().filter(|face| face.board.kind() == kind).map(|face| {
        let count = || tagged(&face.board, tags).len() as u64;
        *of_board.entry(&face.board).or_insert_with(count)
    });
    counts.sum()
}

/// Returns the panels of a checked spec, one per face, and the family of their tags.
pub(crate) fn panels(
    spec: &SolidSpec,
    family: Option<&Family>,
) -> Result<(Vec<Panel>, Option<FamilyRef>), TargetError> {
    let faces = spec.faces()?;
    let has = |kind: GridKind| faces.iter().any(|face| face.board.kind() == kind);
    let of_kind = |kind: GridKind| {
        let tags = spec.tags_of(kind);
        tags.map(|tags| family_of(spec, tags, &faces, kind, family)).transpose()
    };
    let family = match [GridKind::Deltille, GridKind::Checker].map(has) {
        [true, true] => {
            let squares = of_kind(GridKind::Checker)?.map(Box::new);
            of_kind(GridKind::Deltille)?.map(|family| FamilyRef { squares, ..family })
        }
        [false, _] => of_kind(GridKind::Checker)?,
        [true, false] => of_kind(GridKind::Deltille)?,
    };
    Ok((on_faces(spec, &faces), family))
}

/// Returns the family of the tags on faces of a tiling.
fn family_of(
    spec: &SolidSpec,
    tags: &TagSpec,
    faces: &[Face],
    kind: GridKind,
    family: Option<&Family>,
) -> Result<FamilyRef, TargetError> {
    let has_both = spec.square_tags.is_some();
    let instead = |available: u64| {
        let count = |spacing| tag_count(faces, kind, &TagSpec { spacing, ..tags.clone() });
        // Square tags beside triangular ones have the usual spacing.
        let is_free = !has_both || kind == GridKind::Deltille;
        let wider = is_free.then(|| wider_spacing(tags, available, count)).flatten();
        let has_enough = |&tiles: &u32| {
            let faces = SolidSpec { tiles, ..spec.clone() }.faces();
            faces.is_ok_and(|faces| tag_count(&faces, kind, tags) <= available)
        };
        let fewer = (SolidSpec::MIN_TILES..spec.tiles)
            .rev()
            .find(has_enough)
            .map(|tiles| format!("use at most {tiles} {SolidTiles}"));
        wider.into_iter().chain(fewer).collect()
    };
    let needed = tag_count(faces, kind, tags);
    let edges = faces.iter().filter(|face| face.board.kind() == kind).map(|face| face.tile_edge_mm);
    let finest_mm = edges.fold(f64::INFINITY, f64::min);
    check_family(kind, tags, finest_mm, family, needed, TagSettings::of(kind, has_both), instead)
}

/// Returns the panels of a checked spec, regardless of the size of its family.
pub(crate) fn untied_panels(spec: &SolidSpec) -> Result<Vec<Panel>, TargetError> {
    Ok(on_faces(spec, &spec.faces()?))
}

/// Returns the panels of a solid's faces, with ids that continue from face to face.
fn on_faces(spec: &SolidSpec, faces: &[Face]) -> Vec<Panel> {
    let mut of_board = BTreeMap::new();
    let mut next_corner = 0u32;
    let mut next_tags = [GridKind::Deltille, GridKind::Checker]
        .map(|kind| spec.tags_of(kind).map_or(0, |tags| tags.first_id));
    let numbered = (spec.board_id..).zip(faces);
    let panels = numbered.map(|(id, face)| {
        let board = &face.board;
        let tags = spec.tags_of(board.kind());
        let (vertices, tiles) = of_board.entry(board).or_insert_with(|| {
            (board.corners(), tags.map_or_else(Vec::new, |tags| tagged(board, tags)))
        });
        let next_tag = &mut next_tags[usize::from(board.kind() == GridKind::Checker)];
        let (first_corner, first_tag) = (next_corner, *next_tag);
        next_corner += vertices.len() as u32;
        *next_tag = first_tag.saturating_add(tiles.len() as u32);
        Panel {
            id,
            kind: board.kind(),
            edge_mm: face.tile_edge_mm,
            border_bits: tags.map(|tags| tags.border_bits),
            tags_in: tags.map_or_else(TagsIn::default, |tags| tags.tags_in),
            tag_margin_bits: None,
            gap_edges: None,
            discs_mm: None,
            hole_mm: tags.and_then(|tags| tags.hole_mm),
            inverted: spec.inverted,
            rim_mm: spec.rim_mm(),
            outline: board.outline(),
            matrix: board.matrix(),
            pose: face.pose,
            corners: vertices
                .iter()
                .zip(first_corner..)
                .map(|(v, id)| {
                    let panel_mm =
                        board.kind().position(v.row.into(), v.col.into()) * face.tile_edge_mm;
                    let target_mm = face.pose.target_from_panel(panel_mm);
                    Corner { id, row: v.row, col: v.col, panel_mm, target_mm, measured: None }
                })
                .collect(),
            tags: tags.map_or_else(Vec::new, |tags| tags.placements(id, first_tag, tiles)),
        }
    });
    panels.collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;
    use crate::targets::{Target, TargetSpec};

    const SHAPES: [SolidShape; 5] = [
        SolidShape::Tetrahedron,
        SolidShape::Octahedron,
        SolidShape::Icosahedron,
        SolidShape::Cube,
        SolidShape::Cuboid(DVec3::new(2.0, 1.5, 1.0)),
    ];

    fn build(spec: &SolidSpec) -> Result<Target, TargetError> {
        let family = Family::shipped(&spec.tags.as_ref().unwrap().family).unwrap();
        Target::build("solid", &TargetSpec::Solid(spec.clone()), Some(&family))
    }

    /// The published icosahedron has 13 tiles a side, 66 corners and 10 tags on a face.
    #[test]
    fn thirteen_tiles_give_the_published_icosahedron() {
        let spec = SolidSpec { tiles: 13, ..SolidSpec::new(SolidShape::Icosahedron) };
        let target = build(&spec).unwrap();
        assert_eq!(target.panels.len(), 20);
        for panel in &target.panels {
            assert_eq!((panel.corners.len(), panel.tags.len()), (66, 10));
            assert_eq!(panel.dark_tiles().len(), 13 * 14 / 2);
        }
    }

    #[test]
    fn missing_ids_are_rejected_with_a_remedy() {
        let mut spec = SolidSpec { tiles: 13, ..SolidSpec::new(SolidShape::Icosahedron) };
        spec.tags.as_mut().unwrap().first_id = 200;
        let message = build(&spec).unwrap_err().to_string();
        assert!(message.contains("lower it to at most 143"), "{message}");
        spec.tags.as_mut().unwrap().family = "delTag16h5".to_owned();
        let message = build(&spec).unwrap_err().to_string();
        // Twenty faces with a tag each need more ids than the family has left.
        assert!(message.contains("use `TagSpec::family` d25h7 with its"), "{message}");
        spec.tags.as_mut().unwrap().first_id = 0;
        let message = build(&spec).unwrap_err().to_string();
        assert!(
            message.contains(
                "raise `TagSpec::spacing` to at least 10, or use at most 6 `SolidSpec::tiles`"
            ),
            "{message}"
        );
        let small = SolidSpec { edge_mm: 20.0, ..SolidSpec::new(SolidShape::Icosahedron) };
        let message = build(&small).unwrap_err().to_string();
        assert!(message.contains("`SolidSpec::edge_mm` of at least "), "{message}");
    }

    proptest! {
        /// Every tag occurs once, every corner lies on the plane of its face at its distance from the centre, and the
        /// target file preserves all.
        #[test]
        fn every_solid_is_consistent(
            shape in 0usize..5, tiles in 6u32..16, edge_mm in 100.0f64..400.0, spacing in 3u32..5,
        ) {
            let mut spec = SolidSpec { tiles, edge_mm, ..SolidSpec::new(SHAPES[shape].clone()) };
            spec.tags.as_mut().unwrap().spacing = spacing;
            if shape < 3 {
                spec.tags.as_mut().unwrap().family = "delTag36h11".to_owned();
            }
            let target = build(&spec).unwrap();
            let ids: BTreeSet<u32> =
                target.panels.iter().flat_map(|p| &p.tags).map(|tag| tag.id).collect();
            prop_assert_eq!(ids.len(), target.panels.iter().map(|p| p.tags.len()).sum::<usize>());
            prop_assert_eq!(Target::from_json(&target.to_json()).unwrap(), target.clone());
            for panel in &target.panels {
                let outwards = panel.pose.matrix().z_axis;
                let plane = outwards.dot(panel.pose.translation_mm);
                prop_assert!(plane > 0.0);
                for corner in &panel.corners {
                    prop_assert!((outwards.dot(corner.target_mm) - plane).abs() < 1e-9);
                }
            }
        }
    }
}
