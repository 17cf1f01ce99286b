//! What an acceptance test compares with.

use std::collections::BTreeMap;

use glam::DVec3;

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

/// Largest difference of a known length from the description of the target, relative to it: beyond, the unit or a corner is
/// wrong.
const DIFFERENT: f64 = 0.02;

/// Ranges of temperatures, °C, and of coefficients of expansion, ppm/K, of usable targets; the smallest are those of glass
/// ceramics. A target may also not expand at all.
const CELSIUS: [f64; 2] = [-60.0, 200.0];
const PPM_PER_K: [f64; 2] = [0.001, 300.0];

/// What is wrong with a request.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RequestError {
    /// The target has several panels, and none was named.
    #[error("the target has several panels: name that of each end")]
    Panel,
    /// No panel of the target has this corner.
    #[error("the target has no corner in row {row} and column {col}{}", panel.map_or(String::new(), |id| format!(" on panel {id}")))]
    Corner {
        /// Id of the panel, if it was named.
        panel: Option<u32>,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
    },
    /// A length contradicts the target.
    #[error(
        "the length is {length_mm} mm, but {described_mm:.3} mm by the description of the target: check the unit and the corners"
    )]
    Length {
        /// The length, mm.
        length_mm: f64,
        /// That of the target, mm.
        described_mm: f64,
    },
    /// A temperature is out of its range.
    #[error("{0} °C is not a temperature from {low} to {high} °C", low = CELSIUS[0], high = CELSIUS[1])]
    Temperature(f64),
    /// A coefficient of expansion is out of its range.
    #[error(
        "{0} ppm/K is not 0, and not from {low} to {high} ppm/K (23e-6/K is 23 ppm/K)",
        low = PPM_PER_K[0], high = PPM_PER_K[1]
    )]
    Expansion(f64),
}

impl CornerLabel {
    /// The corner of a target; `panel` is the id of its panel, which may be omitted if there is only one.
    ///
    /// # Errors
    /// Returns an error if the target has no such corner.
    pub fn on(
        target: &Target,
        panel: Option<u32>,
        row: i32,
        col: i32,
    ) -> Result<Self, RequestError> {
        if panel.is_none() && target.panels.len() > 1 {
            return Err(RequestError::Panel);
        }
        let panels = target.panels.iter().enumerate();
        let mut panels = panels.filter(|(_, of)| panel.is_none_or(|id| id == of.id));
        let found = panels
            .find(|(_, of)| of.corners.iter().any(|corner| (corner.row, corner.col) == (row, col)));
        let (index, of) = found.ok_or(RequestError::Corner { panel, row, col })?;
        Ok(Self { panel: PanelRef::new(index, of.id), row, col })
    }

    /// Its position on the target, mm.
    fn on_target(&self, target: &Target) -> Option<DVec3> {
        let corners = &target.panels.get(self.panel.index())?.corners;
        let own = corners.iter().find(|of| (of.row, of.col) == (self.row, self.col));
        own.map(|corner| corner.target_mm)
    }
}

impl KnownLength {
    /// A length on a target, with its standard uncertainty, mm.
    ///
    /// # Errors
    /// Returns an error if the length differs from the description of the target by more than 2 %.
    pub fn on(
        target: &Target,
        ends: [CornerLabel; 2],
        length_mm: f64,
        sd_mm: f64,
    ) -> Result<Self, RequestError> {
        let [a, b] = ends.map(|end| end.on_target(target).unwrap_or(DVec3::NAN));
        let described_mm = a.distance(b);
        match (length_mm / described_mm - 1.0).abs() < DIFFERENT {
            true => Ok(Self { ends, length_mm, sd_mm }),
            false => Err(RequestError::Length { length_mm, described_mm }),
        }
    }

    /// The index of the first length between the same corners as an earlier one, and the index of that one.
    pub fn repeated(all: &[Self]) -> Option<[usize; 2]> {
        let mut seen = BTreeMap::new();
        let mut all = all.iter().map(|Self { ends: [a, b], .. }| (a.min(b), a.max(b))).enumerate();
        all.find_map(|(index, ends)| Some([index, seen.insert(ends, index)?]))
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

    /// The temperature of a target, °C, and its coefficient of linear expansion, ppm/K, each with its standard uncertainty.
    ///
    /// # Errors
    /// Returns an error if one of them is out of its range.
    pub fn new(celsius: (f64, f64), ppm_per_k: (f64, f64)) -> Result<Self, RequestError> {
        let is_within = |(value, sd): (f64, f64), [low, high]: [f64; 2]| {
            (low..=high).contains(&value) && (0.0..high - low).contains(&sd)
        };
        if !is_within(celsius, CELSIUS) {
            return Err(RequestError::Temperature(celsius.0));
        }
        let expands = ppm_per_k.0 != 0.0 || ppm_per_k.1 != 0.0;
        if expands && !is_within(ppm_per_k, PPM_PER_K) {
            return Err(RequestError::Expansion(ppm_per_k.0));
        }
        Ok(Self {
            above_reference_k: celsius.0 - Self::REFERENCE_C,
            sd_k: celsius.1,
            expansion_per_k: ppm_per_k.0 * 1e-6,
            expansion_sd_per_k: ppm_per_k.1 * 1e-6,
        })
    }

    /// The temperature, °C.
    pub fn celsius(&self) -> f64 {
        Self::REFERENCE_C + self.above_reference_k
    }

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
