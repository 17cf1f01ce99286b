//! The verdict on whether two calibrations describe the same camera.

use super::comparison::{CameraMotion, Comparison};

/// Largest difference that counts as rounding, px: unprojection iterates to about 10⁻⁹ px.
const ROUNDING_PX: f64 = 1e-6;

/// Whether a camera or a rig has changed from one calibration to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Verdict {
    /// No difference is both significant and larger than the tolerance.
    Same,
    /// A camera, or its pose on the rig, differs significantly.
    Changed,
    /// None of the tested differences is significant, but some cannot be tested because
    /// uncertainties are missing.
    Undecided,
}

impl Verdict {
    /// Returns the verdict on all compared cameras and their motions. Differences between cameras up to the tolerance
    /// (px, RMS per axis) do not count.
    pub fn of(found: &[Comparison], motions: &[CameraMotion], tolerance_px: f64) -> Self {
        let of_cameras =
            found.iter().map(|found| match found.rms_px <= tolerance_px.max(ROUNDING_PX) {
                true => Some(false),
                false => found.is_significant(),
            });
        let of_motions = motions.iter().map(CameraMotion::is_significant);
        let all: Vec<Option<bool>> = of_cameras.chain(of_motions).collect();
        if all.contains(&Some(true)) {
            Self::Changed
        } else if all.contains(&None) {
            Self::Undecided
        } else {
            Self::Same
        }
    }

    /// The word for the verdict in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Changed => "changed",
            Self::Undecided => "undecided",
        }
    }
}

impl Comparison {
    /// Why the comparison cannot decide whether the camera has changed; `None` if it can.
    pub fn why_undecided(&self) -> Option<&'static str> {
        match (self.p_value, self.lacks_uncertainty) {
            (Some(_), _) => None,
            (None, [true, true]) => Some("both calibrations lack uncertainties"),
            (None, [true, false]) => Some("the first calibration lacks uncertainties"),
            (None, [false, true]) => Some("the second calibration lacks uncertainties"),
            (None, [false, false]) => {
                Some("the region does not determine the motion between the two cameras")
            }
        }
    }
}

impl CameraMotion {
    /// Why the comparison cannot decide whether the camera has moved; `None` if it can.
    pub fn why_undecided(&self) -> Option<&'static str> {
        self.p_value
            .is_none()
            .then_some("the pose uncertainty is missing in at least one calibration")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn comparison(rms_px: f64, p_value: Option<f64>) -> Comparison {
        Comparison { rms_px, p_value, ..Comparison::default() }
    }

    #[test]
    fn missing_uncertainties_do_not_count_as_the_same() {
        let (same, changed, open) =
            (comparison(0.1, Some(0.5)), comparison(0.1, Some(1e-9)), comparison(0.1, None));
        let of = |found: &[&Comparison], tolerance| {
            let found: Vec<Comparison> = found.iter().map(|&of| of.clone()).collect();
            Verdict::of(&found, &[], tolerance)
        };
        assert_eq!(of(&[&same], 0.0), Verdict::Same);
        assert_eq!(of(&[&same, &open], 0.0), Verdict::Undecided);
        assert_eq!(of(&[&changed, &open], 0.0), Verdict::Changed);
        assert_eq!(of(&[&changed, &open], 0.2), Verdict::Same);
        // The same camera file given twice.
        assert_eq!(of(&[&comparison(1e-10, None)], 0.0), Verdict::Same);
    }
}
