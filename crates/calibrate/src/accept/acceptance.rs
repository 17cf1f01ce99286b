//! The result of an acceptance test.

use super::request::{AcceptanceRequest, CornerLabel, KnownLength};
use deltille_core::statistics::f_p_value;

/// The result of an acceptance test.
///
/// A rig measures corners by triangulation, with the scale of its calibration. One camera measures them in the plane of their
/// panel, whose pose it estimates from the same image; the scale is that of the target, so that a common error of scale of
/// camera and target is not seen.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Acceptance {
    /// Whether corners were triangulated by several cameras.
    pub is_triangulated: bool,
    /// The measured lengths, in the order of the frames.
    pub lengths: Vec<LengthError>,
    /// Deviations of the measured corners from the target.
    pub probing: Probing,
    /// Names of the measured frames: images of one camera, or simultaneous images of a rig.
    pub measured: Vec<String>,
    /// Names of frames in which no length was measured, because too few corners were seen.
    pub unmeasured: Vec<String>,
    /// Names of views that were not measured, because their pose is that of a view of the calibration.
    pub reused: Vec<String>,
    /// Number of corners of the measured frames, in the images of each camera whose calibration lists where it saw corners.
    pub observations: usize,
    /// Number of these where the calibration saw no corners, so that the lens is extrapolated.
    pub extrapolated: usize,
    /// Standard deviation of a corner of the target per axis that was assumed, mm; zero for an exact target.
    pub board_accuracy_mm: f64,
    /// The terms of the test.
    pub request: AcceptanceRequest,
}

/// A measured length.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LengthError {
    /// Name of the frame.
    pub frame: String,
    /// The corners at its ends.
    pub ends: [CornerLabel; 2],
    /// The known length at the temperature of the target, mm.
    pub known_mm: f64,
    /// The measured length, mm.
    pub measured_mm: f64,
    /// The standard uncertainties of the error.
    pub budget: Budget,
}

/// Standard uncertainties of the error of a length, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Budget {
    /// From noise of the corners in the images: their covariances.
    pub noise_mm: f64,
    /// From errors of the corners that the lens model does not explain: the common standard deviation of the calibration.
    pub lens_mm: f64,
    /// From the uncertainty of the calibrated parameters and poses: their observed covariance.
    pub calibration_mm: f64,
    /// From errors of the target, or of the known length if it was measured.
    pub target_mm: f64,
    /// From the temperature of the target.
    pub temperature_mm: f64,
    /// Degrees of freedom of the calibration's covariance.
    pub calibration_freedom: f64,
}

/// Deviations of measured corners from those of the target: for a rig, after the rigid motion that fits best in each frame;
/// for one camera, at the estimated pose, in the plane of the panel.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Probing {
    /// The probing error: the largest deviation, mm.
    pub largest_mm: f64,
    /// Its corner and the name of its frame; `None` without corners.
    pub at: Option<(CornerLabel, String)>,
    /// Root mean square of the deviations, mm.
    pub rms_mm: f64,
    /// Number of measured corners.
    pub corners: usize,
}

/// The judgement of an error against a limit, with its uncertainty (ISO 14253-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Conformity {
    /// The error is within the limit by more than its expanded uncertainty.
    Conforms,
    /// The limit is within the expanded uncertainty.
    Undecided,
    /// The error exceeds the limit by more than its expanded uncertainty.
    Fails,
}

impl Conformity {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Conforms => "conforms",
            Self::Undecided => "undecided",
            Self::Fails => "fails",
        }
    }
}

impl Acceptance {
    /// The level of confidence of expanded uncertainties.
    pub const CONFIDENCE: f64 = 0.95;

    /// The length with the largest error.
    pub fn largest(&self) -> Option<&LengthError> {
        let size = |of: &&LengthError| of.error_mm().abs();
        self.lengths.iter().max_by(|a, b| size(a).total_cmp(&size(b)))
    }

    /// The lengths in the order of their weight: those that fail, those that are undecided, then by their error with its
    /// expanded uncertainty relative to the limit; without a limit, by their error.
    pub fn by_weight(&self) -> Vec<&LengthError> {
        let weight = |of: &LengthError| match self.request.limit {
            Some(limit) => {
                let (error, expanded) = (of.error_mm().abs(), of.budget.expanded_mm());
                (self.conformity(of), (error + expanded) / limit.of(of.known_mm))
            }
            None => (None, of.error_mm().abs()),
        };
        let mut all: Vec<_> = self.lengths.iter().map(|of| (weight(of), of)).collect();
        all.sort_by(|(a, _), (b, _)| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)));
        all.into_iter().map(|(_, of)| of).collect()
    }

    /// Number of lengths with this judgement.
    pub fn count(&self, conformity: Conformity) -> usize {
        self.lengths.iter().filter(|of| self.conformity(of) == Some(conformity)).count()
    }

    /// The given lengths that no frame measured, because their ends were never seen together.
    pub fn missing(&self) -> impl Iterator<Item = &KnownLength> {
        let is_measured = |known: &KnownLength| self.lengths.iter().any(|of| of.ends == known.ends);
        self.request.lengths.iter().filter(move |known| !is_measured(known))
    }

    /// Whether the lengths are on several panels.
    pub fn has_panels(&self) -> bool {
        let mut panels = self.lengths.iter().flat_map(|of| of.ends.map(|end| end.panel));
        let first = panels.next();
        panels.any(|panel| Some(panel) != first)
    }

    /// Number of lengths whose error is within its expanded uncertainty.
    pub fn within(&self) -> usize {
        self.lengths.iter().filter(|of| of.error_mm().abs() <= of.budget.expanded_mm()).count()
    }

    /// The judgement of a length; `None` without a limit.
    pub fn conformity(&self, of: &LengthError) -> Option<Conformity> {
        let limit = self.request.limit?.of(of.known_mm);
        let (error, expanded) = (of.error_mm().abs(), of.budget.expanded_mm());
        Some(if error + expanded <= limit {
            Conformity::Conforms
        } else if error - expanded > limit {
            Conformity::Fails
        } else {
            Conformity::Undecided
        })
    }

    /// The judgement of all lengths, the worst of single ones; `None` without a limit. It is not positive if a given length was
    /// not measured.
    pub fn verdict(&self) -> Option<Conformity> {
        let worst = self.lengths.iter().filter_map(|of| self.conformity(of)).max()?;
        let is_missing = self.missing().next().is_some();
        Some(if is_missing { worst.max(Conformity::Undecided) } else { worst })
    }
}

impl LengthError {
    /// The measured length minus the known one, mm.
    pub fn error_mm(&self) -> f64 {
        self.measured_mm - self.known_mm
    }
}

impl Budget {
    /// The combined standard uncertainty, mm.
    pub fn combined_mm(&self) -> f64 {
        let parts =
            [self.noise_mm, self.lens_mm, self.calibration_mm, self.target_mm, self.temperature_mm];
        parts.iter().map(|mm| mm * mm).sum::<f64>().sqrt()
    }

    /// The effective degrees of freedom of the combined uncertainty, by Welch and Satterthwaite (GUM, G.4.1). Only that of the
    /// calibration is estimated from few values.
    pub fn freedom(&self) -> f64 {
        match self.calibration_mm > 0.0 {
            true => self.calibration_freedom * (self.combined_mm() / self.calibration_mm).powi(4),
            false => f64::INFINITY,
        }
    }

    /// The coverage factor for a level of confidence of 95 %.
    pub fn coverage_factor(&self) -> f64 {
        coverage_factor(self.freedom())
    }

    /// The expanded uncertainty for a level of confidence of 95 %, mm.
    pub fn expanded_mm(&self) -> f64 {
        self.coverage_factor() * self.combined_mm()
    }
}

/// Degrees of freedom beyond which Student's distribution is normal.
const MANY: f64 = 1e4;

/// The quantile of Student's distribution that leaves 5 % on both sides together.
fn coverage_factor(freedom: f64) -> f64 {
    let freedom = freedom.clamp(1.0, MANY);
    let [mut low, mut high] = [1.9, 13.0];
    for _ in 0..40 {
        let t: f64 = 0.5 * (low + high);
        let is_small = f_p_value(t * t, 1.0, freedom) > 1.0 - Acceptance::CONFIDENCE;
        *(if is_small { &mut low } else { &mut high }) = t;
    }
    high
}

#[cfg(test)]
mod tests {
    use super::super::request::Limit;
    use super::*;

    /// Values of table G.2 of the GUM.
    #[test]
    fn coverage_factors_are_those_of_student() {
        for (freedom, expected) in [(1.0, 12.71), (5.0, 2.57), (20.0, 2.09), (1e9, 1.960)] {
            let found = coverage_factor(freedom);
            assert!((found - expected).abs() < 0.006, "{freedom}: {found}");
        }
    }

    #[test]
    fn an_uncertainty_that_reaches_the_limit_leaves_the_judgement_open() {
        let of = |error: f64| LengthError {
            frame: String::new(),
            ends: [CornerLabel { panel: crate::PanelRef::ONLY, row: 0, col: 0 }; 2],
            known_mm: 100.0,
            measured_mm: 100.0 + error,
            budget: Budget { noise_mm: 0.01, ..Budget::default() },
        };
        let lengths = [0.02, -0.05, 0.09].map(of).to_vec();
        let limit = Some(Limit { constant_mm: 0.03, per_length: 2e-4 });
        let elsewhere = CornerLabel { panel: crate::PanelRef::ONLY, row: 3, col: 0 };
        let unseen = KnownLength { ends: [elsewhere; 2], length_mm: 60.0, sd_mm: 0.0 };
        let seen = KnownLength { ends: lengths[0].ends, ..unseen };
        let found = Acceptance {
            is_triangulated: true,
            lengths,
            probing: Probing::default(),
            measured: vec![String::new()],
            unmeasured: Vec::new(),
            reused: Vec::new(),
            observations: 0,
            extrapolated: 0,
            board_accuracy_mm: 0.0,
            request: AcceptanceRequest {
                lengths: vec![seen, unseen],
                limit,
                ..AcceptanceRequest::default()
            },
        };
        assert_eq!(found.missing().collect::<Vec<_>>(), [&unseen]);
        let each: Vec<_> = found.lengths.iter().map(|of| found.conformity(of).unwrap()).collect();
        assert_eq!(each, [Conformity::Conforms, Conformity::Undecided, Conformity::Fails]);
        assert_eq!(found.verdict(), Some(Conformity::Fails));
        let errors: Vec<f64> = found.by_weight().iter().map(|of| of.error_mm()).collect();
        assert!(errors[0] > 0.08 && errors[1] < 0.0, "{errors:?}");
    }
}
