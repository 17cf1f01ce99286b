//! Positions of corners on their targets, for tables.

use std::collections::HashMap;

use glam::DVec3;

use deltille_core::detection::Grid;
use deltille_core::targets::Target;

/// Positions of the corners of a panel by row and column, mm in the frame of the target.
pub(super) type PanelPositions = HashMap<(i32, i32), DVec3>;

/// Positions of all corners of targets.
pub(super) struct Positions {
    /// By the name of the target (with several targets, otherwise empty) and the id of the panel.
    panels: HashMap<(String, u32), PanelPositions>,
    /// Whether grids name their targets.
    are_several: bool,
}

impl Positions {
    /// The positions on these targets, measured where they are known.
    pub(super) fn of(targets: &[&Target]) -> Self {
        let are_several = targets.len() > 1;
        let panels = targets.iter().flat_map(|target| {
            let name = if are_several { target.name.to_string() } else { String::new() };
            target.panels.iter().map(move |panel| {
                let pose = panel.pose.to_pose();
                let corners = panel.corners.iter().map(|corner| {
                    // Without a measurement, the nominal position is written exactly.
                    let position = match corner.measured {
                        None => corner.target_mm,
                        Some(_) => {
                            pose.apply(pose.inverse().apply(corner.target_mm) + corner.offset_mm())
                        }
                    };
                    ((corner.row, corner.col), position)
                });
                ((name.clone(), panel.id), corners.collect())
            })
        });
        Self { panels: panels.collect(), are_several }
    }

    /// The positions of the panel that a grid shows; `None` if the grid is not labelled or the target is not known.
    pub(super) fn of_grid(&self, grid: &Grid) -> Option<&PanelPositions> {
        let name = grid.target.as_ref().filter(|_| self.are_several);
        self.panels.get(&(name.cloned().unwrap_or_default(), grid.panel?))
    }
}
