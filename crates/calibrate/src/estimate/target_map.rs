//! Measured places of the corners of a target, with covariances.

use std::ops::Range;

use glam::DVec3;

use crate::input::observation::Sighting;
use crate::input::panel::PanelRef;
use deltille_core::statistics::chi_squared_chance;
use deltille_core::targets::{MeasuredPlace, Target};

/// Where the corners of a target are, as the views have it.
///
/// Offsets are relative to a plan that lies as well as it can: poses of the views take up any move and turn
/// of all corners, and distances a common scale, so that these are not in them. Where the poses of panels
/// are found too, moves and turns of each panel are not in them either.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetMap {
    /// By panel, row and column.
    corners: Vec<CornerOffset>,
    /// The deviation of the offsets that was found, in the plane of the panels and out of it, mm: corners that
    /// few views show are drawn to zero accordingly.
    pub expected_mm: [f64; 2],
    /// The number of corners that were seen and are not in the map, as their positions would rest on outliers:
    /// fewer than two observations count, or less than half of them.
    pub few: usize,
}

/// A corner that is not quite where its plan has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerOffset {
    /// The panel.
    pub panel: PanelRef,
    /// Lattice row.
    pub row: i32,
    /// Lattice column.
    pub col: i32,
    /// Its place in the plan, in the panel frame, mm.
    pub panel_mm: DVec3,
    /// How far it is from there, in the panel frame, mm.
    pub offset_mm: DVec3,
    /// Covariance of that, mm².
    pub covariance_mm2: [[f64; 3]; 3],
    /// How many views show it.
    pub views: usize,
}

/// From so many views of a corner on measuring pays: what is left of the noise in its place is then a third of
/// that of a view, less than the half from which a pattern matters.
pub const LEAST_TO_MEASURE: usize = 8;

/// Of a perfect target one in a hundred has a corner that is said to be off.
const FALSE_ALARM: f64 = 0.01;

impl TargetMap {
    /// A map of these corners; `expected_mm` as in [`Self::expected_mm`].
    pub fn new(mut corners: Vec<CornerOffset>, expected_mm: [f64; 2]) -> Self {
        corners.sort_by_key(CornerOffset::label);
        Self { corners, expected_mm, few: 0 }
    }

    /// Every corner that was measured, by panel, row and column.
    pub fn corners(&self) -> &[CornerOffset] {
        &self.corners
    }

    /// A target with its corners where the map has them. It keeps its name, by which its prints are known.
    ///
    /// Offsets are from the plan to where the views have a corner: what had moved the corners before, an
    /// earlier measurement or a print scale, is in them.
    pub fn on(&self, target: &Target) -> Target {
        let mut measured = target.clone();
        measured.plan = Some(target.printed());
        for (index, panel) in measured.panels.iter_mut().enumerate() {
            let of_panel = PanelRef::new(index, panel.id);
            let plan = panel.pose.to_pose().inverse();
            for corner in &mut panel.corners {
                let label = (of_panel, corner.row, corner.col);
                let Some(found) = self.corner(label) else { continue };
                let place = found.panel_mm + found.offset_mm;
                let c = found.covariance_mm2;
                corner.measured = Some(MeasuredPlace {
                    offset_mm: place - plan.apply(corner.target_mm),
                    covariance_mm2: [c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2]],
                });
            }
        }
        measured
    }

    /// The map of these panels, as if there were no others.
    pub(crate) fn of_panels(&self, panels: &Range<usize>) -> Self {
        let own = self.corners.iter().filter(|corner| panels.contains(&corner.panel.index()));
        let own = own.map(|corner| {
            let panel = PanelRef::new(corner.panel.index() - panels.start, corner.panel.id());
            CornerOffset { panel, ..*corner }
        });
        Self { corners: own.collect(), expected_mm: self.expected_mm, few: self.few }
    }

    /// The corner with a label.
    fn corner(&self, label: (PanelRef, i32, i32)) -> Option<&CornerOffset> {
        let found = self.corners.binary_search_by_key(&label, CornerOffset::label);
        found.ok().map(|index| &self.corners[index])
    }

    /// Root mean square of the offsets in the plane of the panels, a coordinate, and out of it, mm.
    pub fn rms_mm(&self) -> [f64; 2] {
        let count = self.corners.len().max(1) as f64;
        let sum = |square: fn(DVec3) -> f64| {
            self.corners.iter().map(|corner| square(corner.offset_mm)).sum::<f64>()
        };
        let plane = sum(|offset| offset.truncate().length_squared()) / 2.0;
        [plane, sum(|offset| offset.z * offset.z)].map(|sum| (sum / count).sqrt())
    }

    /// How far a corner is from its place in the plan, mm; zero of one that was not seen.
    pub fn offset_mm(&self, panel: PanelRef, row: i32, col: i32) -> DVec3 {
        self.corner((panel, row, col)).map_or(DVec3::ZERO, |corner| corner.offset_mm)
    }

    /// The corners that are off by more than chance makes of any corner of a perfect target.
    pub fn significant(&self) -> impl Iterator<Item = &CornerOffset> {
        self.corners.iter().filter(|corner| self.is_significant(corner))
    }

    /// Whether a corner is one of these.
    pub fn is_significant(&self, corner: &CornerOffset) -> bool {
        corner.chance() < FALSE_ALARM / self.corners.len().max(1) as f64
    }
}

impl CornerOffset {
    fn label(&self) -> (PanelRef, i32, i32) {
        (self.panel, self.row, self.col)
    }

    /// How often chance makes as large an offset of a corner that is in its place.
    pub fn chance(&self) -> f64 {
        let covariance = nalgebra::Matrix3::from_fn(|i, j| self.covariance_mm2[i][j]);
        let offset = nalgebra::Vector3::from(self.offset_mm.to_array());
        let Some(inverse) = covariance.try_inverse() else { return 1.0 };
        chi_squared_chance(offset.dot(&(inverse * offset)), 3)
    }
}

impl Sighting {
    /// Moves the corners to where a map has them; those that it does not have stay.
    pub fn correct(&mut self, map: &TargetMap) {
        for seen in &mut self.observations {
            seen.panel_mm += map.offset_mm(self.panel, seen.row, seen.col);
        }
    }
}
