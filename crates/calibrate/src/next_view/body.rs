//! The geometry of a target in a proposed view: its corners, its outline, and the corners that a detector finds.

use glam::{DMat3, DVec2, DVec3};

use crate::input::panel::PanelRef;
use deltille_core::camera::{Camera, Pose, Projection};
use deltille_core::polygon::hull;
use deltille_core::targets::{Panel, Target};

/// Number of corners used to evaluate a panel of a board or of a solid; more corners cost time
/// without a benefit. A solid shows several panels, so each has fewer.
const SAMPLED: [usize; 2] = [40, 14];

/// Length of the arrow towards the upper side, as a fraction of the reach of the board.
const UPWARDS: f64 = 0.4;

/// Number of points along a side of an outline, which lens distortion bends.
const STEPS: usize = 18;

/// Stride over these points that suffices to measure the size of an outline.
pub(super) const COARSE: usize = 3;

/// Minimum edge length in the most foreshortened direction, px. Tags can be read from 12 px,
/// untagged grids can be found from 7 px (`docs/choosing.md`), and a person holds the board up to a
/// quarter too far away.
const TAGGED_EDGE_PX: f64 = 15.0;
const PLAIN_EDGE_PX: f64 = 8.75;

/// Cosine of the largest tilt. Corners are found up to 75°. The limit leaves a margin of 12° for
/// errors of the person.
const MAX_TILT_COS: f64 = 0.454;

/// Margin that the window of the detector needs around a corner, px.
const MARGIN_PX: f64 = 8.0;

/// Minimum fraction of the corners inside the image: a board that is cut off is labelled if some
/// tags are whole, and this fraction determines its pose well enough.
const MIN_PART: f64 = 0.5;

/// A panel of a target.
#[derive(Clone, Debug)]
pub(super) struct BodyPanel {
    pub panel: PanelRef,
    /// The direction of its front in the target frame.
    normal: DVec3,
    pub corners: Vec<BodyCorner>,
    /// Indices of the corners used for evaluation.
    sampled: Vec<usize>,
    /// Indices of the outermost corners, which enclose all others.
    rim: Vec<usize>,
    edge_mm: f64,
    has_tags: bool,
    /// Outline of its tiles in the target frame, mm.
    outline: Vec<DVec3>,
}

/// A corner of a panel.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyCorner {
    pub row: i32,
    pub col: i32,
    /// Planned position in the panel frame, mm.
    pub panel_mm: DVec3,
    /// Measured position in the target frame, mm; the planned one if it was not measured.
    pub target_mm: DVec3,
}

/// A target and its front.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub panels: Vec<BodyPanel>,
    /// The pose `target_from_front`: origin at the centre of the first panel, x to its right, y up, z out of it.
    pub front: Pose,
    /// Rotation from the panel frame to the target frame, for each panel.
    pub rotations: Vec<DMat3>,
}

/// A corner that a camera sees, with the number of corners it represents.
pub(super) struct Seen {
    /// Index of its panel in the body.
    pub panel: usize,
    /// Index of the corner.
    pub corner: usize,
    /// Position in the camera frame, mm.
    pub point: DVec3,
    pub at: Projection,
    pub weight: f64,
}

impl Body {
    /// Creates the body; `None` if the target has no corners. Of several loose boards only the first is used.
    pub(super) fn new(target: &Target) -> Option<Self> {
        let count = if target.spec.is_rigid() { target.panels.len() } else { 1 };
        let panels = target.panels.iter().enumerate().filter(|(_, of)| !of.corners.is_empty());
        let panels = panels.take(count);
        let panels: Vec<(usize, &Panel)> = panels.collect();
        let most = SAMPLED[usize::from(panels.len() > 1)];
        let &(_, first) = panels.first()?;
        let turn = glam::DQuat::from_mat3(&first.pose.matrix());
        let front = Pose { rotation: turn, translation: first.middle_mm() };
        let rotations = panels.iter().map(|(_, panel)| panel.pose.matrix()).collect();
        let panels = panels.into_iter().map(|(index, panel)| BodyPanel::new(index, panel, most));
        Some(Self { panels: panels.collect(), front, rotations })
    }

    /// The corners that a detector finds with the target at a pose: all, or those used for
    /// evaluation. `None` if it finds none, or too few for a view.
    pub(super) fn seen(&self, camera: &Camera, pose: &Pose, all: bool) -> Option<Vec<Seen>> {
        let mut seen = Vec::new();
        for (index, panel) in self.panels.iter().enumerate() {
            panel.seen(index, camera, pose, &self.rotations[index], all, &mut seen);
        }
        (!seen.is_empty()).then_some(seen)
    }

    /// Outlines of the panels seen from the front, with every `every`-th point, px, limited to the
    /// points that the lens images.
    pub(super) fn outlines(&self, camera: &Camera, pose: &Pose, every: usize) -> Vec<Vec<DVec2>> {
        let panels = self.panels.iter().filter(|panel| panel.is_towards(pose));
        let outlines = panels.map(|panel| {
            let points = panel.outline.iter().step_by(every).map(|&point| pose.apply(point));
            points.filter_map(|point| camera.project(point)).collect::<Vec<DVec2>>()
        });
        outlines.filter(|outline| outline.len() > 2).collect()
    }

    /// Arrow from its centre towards its upper side, px.
    pub(super) fn upwards(&self, camera: &Camera, pose: &Pose) -> Option<[DVec2; 2]> {
        let upper = self.front.rotation * DVec3::Y * (UPWARDS * self.reach_mm());
        let place = |target_mm: DVec3| camera.project(pose.apply(target_mm));
        Some([place(self.front.translation)?, place(self.front.translation + upper)?])
    }
}

impl BodyPanel {
    fn new(index: usize, panel: &Panel, most: usize) -> Self {
        let corners: Vec<BodyCorner> = panel
            .corners
            .iter()
            .map(|corner| BodyCorner {
                row: corner.row,
                col: corner.col,
                panel_mm: corner.panel_mm.extend(0.0),
                target_mm: panel.position_mm(corner),
            })
            .collect();
        let around = hull(corners.iter().map(|corner| corner.panel_mm.truncate()).collect());
        let is_rim = |corner: &BodyCorner| around.contains(&corner.panel_mm.truncate());
        let rim = (0..corners.len()).filter(|&index| is_rim(&corners[index])).collect();
        let mut step = corners.len().div_ceil(most).max(1);
        let across = panel.matrix[0] as usize;
        // Otherwise only some columns would be sampled.
        while step > 1 && across.is_multiple_of(step) {
            step += 1;
        }
        let tiles = panel.dark_tiles();
        let vertices = tiles.iter().flat_map(|tile| tile.vertices());
        let places = hull(vertices.map(|vertex| panel.lattice_mm(vertex)).collect());
        let next = |i: usize| places[(i + 1) % places.len()];
        let outline = places.iter().enumerate().flat_map(|(i, &place)| {
            let next = next(i);
            (0..STEPS).map(move |k| place.lerp(next, k as f64 / STEPS as f64))
        });
        Self {
            panel: PanelRef::new(index, panel.id),
            normal: panel.pose.matrix() * DVec3::Z,
            sampled: (0..corners.len()).step_by(step).collect(),
            rim,
            edge_mm: panel.edge_mm,
            has_tags: !panel.tags.is_empty(),
            outline: outline.map(|place| panel.pose.target_from_panel(place)).collect(),
            corners,
        }
    }

    /// Whether the centre of its front faces the camera.
    fn is_towards(&self, pose: &Pose) -> bool {
        let middle = self.corners.iter().map(|corner| corner.target_mm).sum::<DVec3>();
        let middle = pose.apply(middle / self.corners.len() as f64);
        (pose.rotation * self.normal).dot(middle) < 0.0
    }

    fn seen(
        &self,
        index: usize,
        camera: &Camera,
        pose: &Pose,
        turn: &DMat3,
        all: bool,
        seen: &mut Vec<Seen>,
    ) {
        let first = seen.len();
        let turn = DMat3::from_quat(pose.rotation) * *turn;
        let normal = turn.z_axis;
        let least_px = if self.has_tags { TAGGED_EDGE_PX } else { PLAIN_EDGE_PX };
        let size = DVec2::new(camera.width.into(), camera.height.into());
        let weight = if all { 1.0 } else { self.corners.len() as f64 / self.sampled.len() as f64 };
        let chosen = if all { self.corners.len() } else { self.sampled.len() };
        let find = |corner: usize| {
            let point = pose.apply(self.corners[corner].target_mm);
            if -normal.dot(point) < MAX_TILT_COS * point.length() {
                return None;
            }
            let at = camera.project_with_derivatives(point)?;
            let is_inside = at.pixel.cmpge(DVec2::splat(MARGIN_PX)).all()
                && at.pixel.cmple(size - 1.0 - MARGIN_PX).all();
            let is_found = is_inside && self.edge_mm * narrowest(&at, &turn) >= least_px;
            is_found.then_some(Seen { panel: index, corner, point, at, weight })
        };
        // Without tags, rows and columns are known only if the whole board is visible.
        if !self.has_tags && !self.rim.iter().all(|&corner| find(corner).is_some()) {
            return;
        }
        seen.extend((0..chosen).filter_map(|k| find(if all { k } else { self.sampled[k] })));
        let found = (seen.len() - first) as f64;
        let least = if self.has_tags { MIN_PART * chosen as f64 } else { chosen as f64 };
        if found < least {
            seen.truncate(first);
        }
    }
}

/// Scale of a plane in its most foreshortened direction, px/mm.
fn narrowest(at: &Projection, turn: &DMat3) -> f64 {
    let rows = at.by_point.map(DVec3::from);
    let [a, b] = rows.map(|row| row.dot(turn.x_axis));
    let [c, d] = rows.map(|row| row.dot(turn.y_axis));
    let (sum, product) = (a * a + b * b + c * c + d * d, a * d - b * c);
    (0.5 * (sum - (sum * sum - 4.0 * product * product).max(0.0).sqrt())).max(0.0).sqrt()
}
