//! What is known of the printed sheet beforehand, put on views before they are calibrated.

use deltille_calibrate::{PanelPlace, Reference, View};
use deltille_core::setting::Setting::{CalibrationRefinePanels, PrintScale, SightingBend};
use deltille_core::targets::{Target, TargetSpec};
use deltille_layout::SheetLayout;

use crate::export::sheet::Sheet;

/// Why what is known of a sheet cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SheetUseError {
    /// A print scale of several targets.
    #[error("{PrintScale}: it is that of one target")]
    ScaleOfMany,
    /// A shape of several targets.
    #[error("{SightingBend}: it is that of one board")]
    ShapeOfMany,
    /// Boards that lie about, in a scene.
    #[error(
        "boards of one file that lie about have no place in a scene: make a file for each, and give all of them"
    )]
    Loose,
    /// Two scales of a solid's net.
    #[error(
        "{PrintScale}: faces that are stretched in one direction do not close to the solid that was planned: give \
         one number for both, or find their places by {CalibrationRefinePanels}"
    )]
    Skewed,
    /// A solid whose faces were printed one by one.
    #[error(
        "{PrintScale}: faces that are printed one by one keep their places on the solid: those are found by \
         {CalibrationRefinePanels}"
    )]
    OneByOne,
    /// A board with two sides.
    #[error(
        "{PrintScale}: the sides of a board are printed one by one, and how they lie to each other is found by \
         {CalibrationRefinePanels}: leave it out"
    )]
    Sides,
    /// A scale of a target that was measured.
    #[error("{PrintScale}: {0} says where its corners were measured, as they were printed")]
    ScaleOfMeasured(String),
    /// A shape of a target that was measured.
    #[error("{SightingBend}: {0} says where its corners were measured, as they were printed")]
    ShapeOfMeasured(String),
    /// A shape of a target of several panels.
    #[error("{SightingBend}: it is that of one board, and the target has several panels")]
    ShapeOfPanels,
}

impl Sheet {
    /// Where the panels of what was photographed are, on a solid as large as its net was printed.
    ///
    /// # Errors
    /// Where what is known is not of this reference.
    pub fn panels(&self, reference: &Reference) -> Result<Vec<PanelPlace>, SheetUseError> {
        let scale = match reference {
            Reference::Target(target) => self.solid_scale(target)?,
            Reference::Scene(_) => {
                if self.print_scale.is_some() {
                    return Err(SheetUseError::ScaleOfMany);
                }
                if self.shape.is_some() {
                    return Err(SheetUseError::ShapeOfMany);
                }
                if reference.is_loose() {
                    return Err(SheetUseError::Loose);
                }
                1.0
            }
            Reference::Grid(_) => 1.0,
        };
        let mut panels = reference.panels();
        panels.iter_mut().for_each(|panel| panel.target_from_panel.translation *= scale);
        Ok(panels)
    }

    /// How much larger than planned a solid is whose net was printed like this; 1 for a board.
    fn solid_scale(&self, target: &Target) -> Result<f64, SheetUseError> {
        let Some([across, up]) = self.print_scale.filter(|_| is_solid(target)) else {
            return Ok(1.0);
        };
        if matches!(target.spec, TargetSpec::Board(_)) {
            return Err(SheetUseError::Sides);
        }
        if across != up {
            return Err(SheetUseError::Skewed);
        }
        let with_skeleton =
            matches!(&target.spec, TargetSpec::Solid(spec) if spec.skeleton.is_some());
        let is_single = |sheet: &SheetLayout| sheet.placements.len() == 1;
        let is_one_by_one = self.sheets.len() > 1 && self.sheets.iter().all(is_single);
        if with_skeleton || is_one_by_one {
            return Err(SheetUseError::OneByOne);
        }
        Ok(across)
    }

    /// Moves the corners of all views to where this sheet has them.
    ///
    /// # Errors
    /// Where what is known is not of this target.
    pub fn put_on(&self, target: Option<&Target>, views: &mut [View]) -> Result<(), SheetUseError> {
        if let Some(target) = target {
            self.solid_scale(target)?;
            if target.is_measured() {
                let name = target.name.to_string();
                if self.print_scale.is_some() {
                    return Err(SheetUseError::ScaleOfMeasured(name));
                }
                if self.shape.is_some() {
                    return Err(SheetUseError::ShapeOfMeasured(name));
                }
            }
        }
        if self.shape.is_some() && target.is_some_and(|target| target.panels.len() > 1) {
            return Err(SheetUseError::ShapeOfPanels);
        }
        for sighting in views.iter_mut().flat_map(|view| &mut view.sightings) {
            if let Some(scale) = self.print_scale {
                let angle_rad = angle_on_sheet(&self.sheets, sighting.panel.id());
                sighting.stretch(scale, angle_rad);
            }
            // The shape was found on corners that the scale had moved.
            if let Some(shape) = &self.shape {
                sighting.bend(shape);
            }
        }
        Ok(())
    }
}

/// Whether panels are fixed to each other in space.
fn is_solid(target: &Target) -> bool {
    target.panels.len() > 1 && !target.is_loose()
}

/// How the panel of an id is turned on its sheet, rad; 0 where no sheet is described.
fn angle_on_sheet(sheets: &[SheetLayout], id: u32) -> f64 {
    let mut placements = sheets.iter().flat_map(|sheet| &sheet.placements);
    placements.find(|placement| placement.panel == id).map_or(0.0, |placement| placement.angle_rad)
}
