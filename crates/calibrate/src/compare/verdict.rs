//! Whether two calibrations are of the same camera, in one word.

use super::comparison::{CameraMotion, Comparison};

/// Differences up to this are rounding: what a pixel shows is found by iteration, to about 10⁻⁹ px.
const ROUNDING_PX: f64 = 1e-6;

/// Whether a camera or a rig has changed from one calibration to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Verdict {
    /// Nothing differs significantly, or by more than is tolerated.
    Same,
    /// A camera, or its pose on the rig, differs significantly.
    Changed,
    /// Nothing that can be judged differs, and something cannot be judged: uncertainties are missing.
    Undecided,
}

impl Verdict {
    /// The verdict on all cameras that were compared, of which differences up to a tolerance, px rms a coordinate, do not
    /// count, and on their motions.
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

    /// Its word in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Changed => "changed",
            Self::Undecided => "undecided",
        }
    }
}

impl Comparison {
    /// Why it cannot be judged whether the camera has changed; `None` where it can.
    pub fn why_undecided(&self) -> Option<&'static str> {
        match (self.chance, self.lacks_uncertainty) {
            (Some(_), _) => None,
            (None, [true, true]) => Some("the uncertainties of both are not known"),
            (None, [true, false]) => Some("the uncertainties of the first are not known"),
            (None, [false, true]) => Some("the uncertainties of the second are not known"),
            (None, [false, false]) => Some("the region leaves the motion between the two open"),
        }
    }
}

impl CameraMotion {
    /// Why it cannot be judged whether the camera has moved; `None` where it can.
    pub fn why_undecided(&self) -> Option<&'static str> {
        self.chance.is_none().then_some("deviations of its pose are not known in both")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn comparison(rms_px: f64, chance: Option<f64>) -> Comparison {
        Comparison { rms_px, chance, ..Comparison::default() }
    }

    #[test]
    fn what_cannot_be_judged_is_not_the_same() {
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
        // One camera file given twice.
        assert_eq!(of(&[&comparison(1e-10, None)], 0.0), Verdict::Same);
    }
}
