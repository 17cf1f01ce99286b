//! What an acceptance test compares with.

use crate::input::panel::PanelRef;
use deltille_core::targets::Target;

/// A corner of the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CornerLabel {
    /// The panel that it lies on.
    pub panel: PanelRef,
    /// Lattice row.
    pub row: i32,
    /// Lattice column.
    pub col: i32,
}

/// A length that was measured by other means, for example on a coordinate measuring machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownLength {
    /// The corners at its ends.
    pub ends: [CornerLabel; 2],
    /// The length at the reference temperature, mm.
    pub length_mm: f64,
    /// Its standard uncertainty, mm.
    pub sd_mm: f64,
}

/// The largest permitted error of a length L: `constant_mm` + `per_length` · L.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// The part that does not depend on the length, mm.
    pub constant_mm: f64,
    /// The part in proportion to the length, mm/mm.
    pub per_length: f64,
}

/// The temperature of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Temperature {
    /// Temperature minus the reference temperature of the known lengths (20 °C by ISO 1), K.
    pub above_reference_k: f64,
    /// Its standard uncertainty, K.
    pub sd_k: f64,
    /// Coefficient of linear expansion of the target, 1/K.
    pub expansion_per_k: f64,
    /// Its standard uncertainty, 1/K.
    pub expansion_sd_per_k: f64,
}

/// The terms of an acceptance test.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AcceptanceRequest {
    /// Lengths to measure; if there are none, lengths between corners as the target describes them.
    pub lengths: Vec<KnownLength>,
    /// The limit; without one, lengths are measured and not judged.
    pub limit: Option<Limit>,
    /// The temperature of the target; `None` if it is the reference temperature.
    pub temperature: Option<Temperature>,
}

/// A corner that a target does not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoCorner {
    /// The target has several panels, and none was named.
    #[error("the target has several panels: name that of each end")]
    Panel,
    /// No panel of the target has this corner.
    #[error("the target has no corner {row}, {col}{}", panel.map_or(String::new(), |id| format!(" on panel {id}")))]
    Corner {
        /// Id of the panel, if it was named.
        panel: Option<u32>,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
    },
}

impl CornerLabel {
    /// The corner of a target; `panel` is the id of its panel, which may be omitted if there is only one.
    ///
    /// # Errors
    /// Returns an error if the target has no such corner.
    pub fn on(target: &Target, panel: Option<u32>, row: i32, col: i32) -> Result<Self, NoCorner> {
        if panel.is_none() && target.panels.len() > 1 {
            return Err(NoCorner::Panel);
        }
        let panels = target.panels.iter().enumerate();
        let mut panels = panels.filter(|(_, of)| panel.is_none_or(|id| id == of.id));
        let found = panels
            .find(|(_, of)| of.corners.iter().any(|corner| (corner.row, corner.col) == (row, col)));
        let (index, of) = found.ok_or(NoCorner::Corner { panel, row, col })?;
        Ok(Self { panel: PanelRef::new(index, of.id), row, col })
    }
}

impl Limit {
    /// The largest permitted error of a length, mm.
    pub fn of(&self, length_mm: f64) -> f64 {
        self.constant_mm + self.per_length * length_mm
    }
}

impl Temperature {
    /// The reference temperature of lengths (ISO 1), °C.
    pub const REFERENCE_C: f64 = 20.0;

    /// The relative expansion of the target, and its standard uncertainty.
    pub(super) fn strain(&self) -> (f64, f64) {
        let strain = self.expansion_per_k * self.above_reference_k;
        let sd = f64::hypot(
            self.expansion_per_k * self.sd_k,
            self.expansion_sd_per_k * self.above_reference_k,
        );
        (strain, sd)
    }
}
