//! Measured positions of the corners of a target, with covariances.

use std::ops::Range;

use glam::DVec3;

use crate::input::observation::Sighting;
use crate::input::panel::PanelRef;
use deltille_core::statistics::chi_squared_p_value;
use deltille_core::targets::{MeasuredPosition, Target};

/// The positions of the corners of a target as measured by the views.
///
/// Offsets are relative to the best-fitting plan. They contain no translation or rotation of all
/// corners, because the poses of the views absorb these, and no common scale, because the distances
/// absorb it. If panel poses are also estimated, the offsets contain no translation or rotation of
/// each panel either.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetMap {
    /// Ordered by panel, row and column.
    corners: Vec<CornerOffset>,
    /// The estimated standard deviation of the offsets in the plane of the panels and out of it, mm. Corners seen in
    /// few views are shrunk towards zero accordingly.
    pub expected_mm: [f64; 2],
    /// Detected corners, by panel, row and column, that are not in the map because their positions would depend on
    /// outliers: fewer than two of their observations are inliers, or fewer than half.
    pub not_measured: Vec<(PanelRef, i32, i32)>,
}

/// The measured offset of a corner from its plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerOffset {
    /// The panel.
    pub panel: PanelRef,
    /// Lattice row.
    pub row: i32,
    /// Lattice column.
    pub col: i32,
    /// Planned position in the panel frame, mm.
    pub panel_mm: DVec3,
    /// Offset from the planned position, in the panel frame, mm.
    pub offset_mm: DVec3,
    /// Covariance of the offset, mm².
    pub covariance_mm2: [[f64; 3]; 3],
    /// Number of views that show it.
    pub views: usize,
}

/// Minimum number of views of a corner that makes measuring worthwhile: the remaining noise of its
/// position is then a third of that of a single view. A pattern matters at half of that noise.
pub const MIN_VIEWS_TO_MEASURE: usize = 8;

/// Probability that any corner of a perfect target is reported as off.
pub(super) const FALSE_ALARM: f64 = 0.01;

impl TargetMap {
    /// Creates a map of these corners; `expected_mm` as in [`Self::expected_mm`].
    pub fn new(mut corners: Vec<CornerOffset>, expected_mm: [f64; 2]) -> Self {
        corners.sort_by_key(CornerOffset::label);
        Self { corners, expected_mm, not_measured: Vec::new() }
    }

    /// The measured corners, by panel, row and column.
    pub fn corners(&self) -> &[CornerOffset] {
        &self.corners
    }

    /// Returns the target with its corners at the measured positions. It keeps its name, because
    /// prints are identified by it.
    ///
    /// Offsets are relative to the planned positions, so they include earlier corrections, for
    /// example a previous measurement or a print scale.
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
                corner.measured = Some(MeasuredPosition {
                    offset_mm: place - plan.apply(corner.target_mm),
                    covariance_mm2: [c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2]],
                });
            }
        }
        measured
    }

    /// The map of these panels only.
    pub(crate) fn of_panels(&self, panels: &Range<usize>) -> Self {
        let is_own = |panel: PanelRef| panels.contains(&panel.index());
        let renumbered = |panel: PanelRef| PanelRef::new(panel.index() - panels.start, panel.id());
        let own = self.corners.iter().filter(|corner| is_own(corner.panel));
        let own = own.map(|corner| CornerOffset { panel: renumbered(corner.panel), ..*corner });
        let left = self.not_measured.iter().filter(|(panel, ..)| is_own(*panel));
        let left = left.map(|&(panel, row, col)| (renumbered(panel), row, col));
        Self { corners: own.collect(), expected_mm: self.expected_mm, not_measured: left.collect() }
    }

    /// Finds the corner with a label.
    fn corner(&self, label: (PanelRef, i32, i32)) -> Option<&CornerOffset> {
        let found = self.corners.binary_search_by_key(&label, CornerOffset::label);
        found.ok().map(|index| &self.corners[index])
    }

    /// RMS of the offsets in the plane of the panels, per axis, and out of it, mm.
    pub fn rms_mm(&self) -> [f64; 2] {
        let count = self.corners.len().max(1) as f64;
        let sum = |square: fn(DVec3) -> f64| {
            self.corners.iter().map(|corner| square(corner.offset_mm)).sum::<f64>()
        };
        let plane = sum(|offset| offset.truncate().length_squared()) / 2.0;
        [plane, sum(|offset| offset.z * offset.z)].map(|sum| (sum / count).sqrt())
    }

    /// Offset of a corner from its planned position, mm; zero for a corner that was not seen.
    pub fn offset_mm(&self, panel: PanelRef, row: i32, col: i32) -> DVec3 {
        self.corner((panel, row, col)).map_or(DVec3::ZERO, |corner| corner.offset_mm)
    }

    /// The corners whose offset is significant: larger than noise explains for any corner of a perfect target.
    pub fn significant(&self) -> impl Iterator<Item = &CornerOffset> {
        self.corners.iter().filter(|corner| self.is_significant(corner))
    }

    /// Whether the offset of a corner is significant.
    pub fn is_significant(&self, corner: &CornerOffset) -> bool {
        corner.p_value() < FALSE_ALARM / self.corners.len().max(1) as f64
    }
}

impl CornerOffset {
    fn label(&self) -> (PanelRef, i32, i32) {
        (self.panel, self.row, self.col)
    }

    /// Probability of an offset at least this large for a corner at its planned position.
    pub fn p_value(&self) -> f64 {
        let covariance = nalgebra::Matrix3::from_fn(|i, j| self.covariance_mm2[i][j]);
        let offset = nalgebra::Vector3::from(self.offset_mm.to_array());
        let Some(inverse) = covariance.try_inverse() else { return 1.0 };
        chi_squared_p_value(offset.dot(&(inverse * offset)), 3)
    }
}

impl Sighting {
    /// Moves the corners to the positions of a map; corners that are not in the map do not move.
    pub fn correct(&mut self, map: &TargetMap) {
        for seen in &mut self.observations {
            seen.panel_mm += map.offset_mm(self.panel, seen.row, seen.col);
        }
    }
}
