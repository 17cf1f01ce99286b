//! What pictures show: corners of a panel, panels of a picture.

use glam::{DQuat, DVec2, DVec3};

use super::panel::PanelRef;
use crate::excluded::{Excluded, Reason};

/// Corners that a panel needs in a view, so that a few wrong ones show.
pub(crate) const LEAST_CORNERS: usize = 6;

/// A corner of a panel that a camera detected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Lattice row on its panel.
    pub row: i32,
    /// Lattice column on its panel.
    pub col: i32,
    /// Position in the panel frame, mm.
    pub panel_mm: DVec3,
    /// Detected position, px.
    pub pixel: DVec2,
    /// Covariance xx, xy, yy of the detected position, px²; `None` where it is not known.
    pub cov: Option<[f64; 3]>,
}

/// What one picture shows of one rigid target.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Name of the view, such as that of the detection's file; views of several cameras with the same name belong to
    /// one frame.
    pub name: String,
    /// File name of the picture.
    pub image: String,
    /// Width and height of the picture, px.
    pub size_px: [u32; 2],
    /// The panels that were found.
    pub sightings: Vec<Sighting>,
}

/// A panel in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// The panel.
    pub panel: PanelRef,
    /// Its detected corners.
    pub observations: Vec<Observation>,
}

impl View {
    /// How many corners it shows.
    pub fn corner_count(&self) -> usize {
        self.sightings.iter().map(|sighting| sighting.observations.len()).sum()
    }

    /// The view as one that does not fit as a whole.
    pub(crate) fn excluded(&self, reason: Reason) -> Excluded {
        Excluded {
            camera: None,
            view: self.name.clone(),
            image: self.image.clone(),
            panel: None,
            corners: self.corner_count(),
            reason,
        }
    }
}

impl Sighting {
    /// Moves the corners to where a print has them that is stretched across and up its sheet;
    /// the panel is turned by `angle_rad` on it.
    pub fn stretch(&mut self, [across, up]: [f64; 2], angle_rad: f64) {
        let turn = DQuat::from_rotation_z(angle_rad);
        for seen in &mut self.observations {
            let on_sheet = turn * seen.panel_mm * DVec3::new(across, up, 1.0);
            seen.panel_mm = turn.conjugate() * on_sheet;
        }
    }
}
