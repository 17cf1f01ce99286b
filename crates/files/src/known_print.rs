//! Known properties of the printed sheet, applied to views before calibration.

use deltille_calibrate::{PanelPrior, Reference, View};
use deltille_core::setting::Setting::{CalibrationRefinePanels, PrintScale, SightingBend};
use deltille_core::targets::{Target, TargetSpec};
use deltille_layout::SheetLayout;

use crate::export::sheet::Sheet;

/// Error of applying the known properties of a sheet.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SheetUseError {
    /// A print scale with several targets.
    #[error("{PrintScale}: the scale applies to one target only")]
    ScaleOfMany,
    /// A shape with several targets.
    #[error("{SightingBend}: the shape applies to one board only")]
    ShapeOfMany,
    /// Independent boards in a scene.
    #[error(
        "independent boards of one file cannot be used in a scene: make one file per board and give all of them"
    )]
    Loose,
    /// Two scales of a solid's net.
    #[error(
        "{PrintScale}: faces stretched in one direction do not form the planned solid: give \
         one number for both directions, or estimate the panel poses with {CalibrationRefinePanels}"
    )]
    Skewed,
    /// A solid whose faces were printed one by one.
    #[error(
        "{PrintScale}: the print scale does not change the poses of faces printed one by one: estimate them with \
         {CalibrationRefinePanels}"
    )]
    OneByOne,
    /// A board with two sides.
    #[error(
        "{PrintScale}: omit it, because the sides of a board are printed one by one; estimate their relative pose with \
         {CalibrationRefinePanels}"
    )]
    Sides,
    /// A print scale for a target whose corners were measured.
    #[error("{PrintScale}: {0} already contains the measured corner positions of the print")]
    ScaleOfMeasured(String),
    /// A shape for a target whose corners were measured.
    #[error("{SightingBend}: {0} already contains the measured corner positions of the print")]
    ShapeOfMeasured(String),
    /// A shape with a target of several panels.
    #[error("{SightingBend}: the shape applies to one board, but the target has several panels")]
    ShapeOfPanels,
}

impl Sheet {
    /// The poses of the panels of the target, on a solid scaled like its printed net.
    ///
    /// # Errors
    /// Returns an error if these properties do not apply to the reference.
    pub fn panels(&self, reference: &Reference) -> Result<Vec<PanelPrior>, SheetUseError> {
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

    /// The scale of a solid whose net was printed at this scale; 1 for a board.
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

    /// Moves the corners of all views to their positions on this sheet.
    ///
    /// # Errors
    /// Returns an error if these properties do not apply to the target.
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
            // The shape was estimated from corners after scaling.
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

/// Rotation of the panel with the given id on its sheet, rad; 0 if no sheet is described.
fn angle_on_sheet(sheets: &[SheetLayout], id: u32) -> f64 {
    let mut placements = sheets.iter().flat_map(|sheet| &sheet.placements);
    placements.find(|placement| placement.panel == id).map_or(0.0, |placement| placement.angle_rad)
}
