//! The identity of a target: its corners in space and its tags. The name and the print layout do not count.

use sha2::{Digest, Sha256};

use crate::identity::{Fingerprint, TargetIdentity};
use crate::lattice::GridKind;
use crate::targets::{FamilyRef, Panel, Target};

/// Grid of corner positions, mm: closer corners count as the same point. It is a hundredth of a printer's resolution,
/// and a thousand times the rounding of any target file format.
const QUANTUM_MM: f64 = 1e-4;

/// Position of the rounding boundary between two multiples of [`QUANTUM_MM`], in quanta. Lengths that people choose
/// have few decimals, and so have their halves and quarters. None of them is near this fraction, so the last digit of
/// a coordinate cannot change the fingerprint.
const BOUNDARY: f64 = 0.382;

impl Target {
    /// Returns the identity of this target. Measured corners and refined panels change the positions, so a measured
    /// target has a different fingerprint than its plan. Its identity names the plan.
    pub fn identity(&self) -> TargetIdentity {
        let panels = &self.panels;
        let edges = panels.iter().map(|panel| panel.edge_mm);
        let least = edges.clone().fold(f64::INFINITY, f64::min);
        TargetIdentity {
            name: self.name.clone(),
            fingerprint: fingerprint(panels, self.family.as_ref()),
            plan: self.plan.as_ref().map(TargetIdentity::of_print),
            labels: hash(panels, self.family.as_ref(), false),
            panels: panels.len() as u32,
            corners: panels.iter().map(|panel| panel.corners.len() as u32).sum(),
            edge_mm: [least, edges.fold(0.0, f64::max)],
        }
    }

    /// Returns whether this description also fits prints of the other target: both have the same panels and tags, or
    /// were measured from the same print.
    pub fn has_prints_of(&self, other: &Self) -> bool {
        let are_both_measured = self.plan.is_some() && other.plan.is_some();
        (self.panels == other.panels && self.family == other.family)
            || (are_both_measured && self.identity().is_same_print(&other.identity()))
    }

    /// Returns the identity of the target as printed: that of the plan it was measured or refined from, or its own.
    #[doc(hidden)]
    pub fn printed(&self) -> TargetIdentity {
        self.plan.clone().unwrap_or_else(|| self.identity())
    }
}

/// Computes the fingerprint of the target with these panels.
pub fn fingerprint(panels: &[Panel], family: Option<&FamilyRef>) -> Fingerprint {
    hash(panels, family, true)
}

fn hash(panels: &[Panel], family: Option<&FamilyRef>, with_positions: bool) -> Fingerprint {
    let mut hash = Sha256::new();
    hash.update(if with_positions { "deltille/target\n" } else { "deltille/labels\n" });
    for panel in panels {
        let kind = match panel.kind {
            GridKind::Deltille => "deltille",
            GridKind::Checker => "checker",
        };
        hash.update(format!("panel {} {kind}\n", panel.id));
        for corner in &panel.corners {
            hash.update(format!("corner {} {}", corner.row, corner.col));
            if with_positions {
                let [x, y, z] = panel.position_mm(corner).to_array().map(quanta);
                hash.update(format!(" {x} {y} {z}"));
            }
            hash.update("\n");
        }
        // The family counts by name only: it may grow, which leaves its earlier codes unchanged.
        if let (Some(family), false) = (family, panel.tags.is_empty()) {
            hash.update(format!("family {}\n", family.of_tiling(panel.kind).name));
        }
        for tag in &panel.tags {
            hash.update(format!("tag {} {} {}\n", tag.row, tag.col, tag.id));
        }
    }
    let bytes = hash.finalize();
    Fingerprint::from_bits(u64::from_be_bytes(bytes[..8].try_into().expect("a hash has 32 bytes")))
}

/// Rounds a coordinate to a whole number of [`QUANTUM_MM`].
fn quanta(mm: f64) -> i64 {
    (mm / QUANTUM_MM + BOUNDARY).floor() as i64
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::targets::{BoardSpec, MeasuredPosition};

    fn board(name: &str, edit: impl Fn(&mut BoardSpec)) -> Target {
        let mut spec = BoardSpec::deltille(5, 6, 20.0);
        edit(&mut spec);
        Target::new(name, spec).unwrap()
    }

    #[test]
    fn a_fingerprint_depends_on_corners_and_tags_alone() {
        let desk = board("desk", |_| {}).identity();
        assert_eq!(desk.fingerprint, board("wall", |_| {}).identity().fingerprint);
        let others = [
            board("desk", |spec| spec.edge_mm = 20.001),
            board("desk", |spec| spec.rows = 6),
            board("desk", |spec| spec.board_id = 1),
            board("desk", |spec| spec.tags.as_mut().unwrap().first_id = 1),
            board("desk", |spec| spec.tags = None),
        ];
        for other in &others {
            assert_ne!(desk.fingerprint, other.identity().fingerprint);
        }
        let confusable = others.iter().filter(|other| desk.is_confusable(&other.identity()));
        assert_eq!(confusable.count(), 1, "labels distinguish everything but the size");
    }

    #[test]
    fn a_measured_target_names_its_plan() {
        let plan = board("desk", |_| {});
        let mut measured = Target { plan: Some(plan.identity()), ..plan.clone() };
        let place =
            MeasuredPosition { offset_mm: DVec3::new(0.01, 0.0, 0.0), covariance_mm2: [0.0; 6] };
        measured.panels[0].corners[3].measured = Some(place);
        let read = Target::from_json(&measured.to_json()).unwrap();
        assert_eq!(read.plan, Some(plan.identity()));
        assert!(read.identity().is_same_print(&plan.identity()));
        assert_ne!(read.identity().fingerprint, plan.identity().fingerprint);
        assert_eq!(read.identity().labels, plan.identity().labels);
        let larger = board("desk", |spec| spec.edge_mm = 25.0).identity();
        measured.plan = Some(larger);
        let refused = Target::from_json(&measured.to_json()).unwrap_err();
        assert!(refused.to_string().contains("plan.fingerprint"), "{refused}");
    }
}
