//! The content of images: corners of a panel, panels of an image.

use glam::{DQuat, DVec2, DVec3};

use super::panel::PanelRef;
use crate::excluded::{Excluded, Reason};

/// Minimum number of corners of a panel in a view; with fewer, outliers cannot be identified.
pub(crate) const MIN_CORNERS: usize = 6;

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
    /// Covariance xx, xy, yy of the detected position, px²; `None` if it is not known.
    pub cov: Option<[f64; 3]>,
}

/// The corners of one rigid target in one image.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Name of the view, for example the name of the detection file; views of several cameras with
    /// the same name belong to one frame.
    pub name: String,
    /// File name of the image.
    pub image: String,
    /// Width and height of the image, px.
    pub size_px: [u32; 2],
    /// The detected panels.
    pub sightings: Vec<Sighting>,
}

/// A panel in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// The panel.
    pub panel: PanelRef,
    /// Its detected corners.
    pub observations: Vec<Observation>,
}

impl View {
    /// The number of its corners.
    pub fn corner_count(&self) -> usize {
        self.sightings.iter().map(|sighting| sighting.observations.len()).sum()
    }

    /// The record of the view as excluded.
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
    /// Moves the corners to their positions on a print that is stretched across and up its sheet; the panel is rotated
    /// by `angle_rad` on the sheet.
    pub fn stretch(&mut self, [across, up]: [f64; 2], angle_rad: f64) {
        let turn = DQuat::from_rotation_z(angle_rad);
        for seen in &mut self.observations {
            let on_sheet = turn * seen.panel_mm * DVec3::new(across, up, 1.0);
            seen.panel_mm = turn.conjugate() * on_sheet;
        }
    }
}
