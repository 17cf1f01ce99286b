//! From new views to an answer.

use super::answer::{Answer, Check, Missing, Quantity, QuantityTest, Suspect};
use super::earlier::Earlier;
use super::equations::Equations;
use super::hypotheses::Evidence;
use super::views::{LOOSE, TIGHT, Views};
use crate::estimate::values::Estimate;
use crate::input::calibration::Calibration;

/// Largest RMS residual of the best fit, relative to the longer side of the image.
const FITS: f64 = 0.005;

impl Calibration {
    /// Tests whether the cameras are still as in an earlier estimate of the same cameras in the same order. Of this
    /// calibration, the views, the panels and [`board_accuracy_mm`](Self::board_accuracy_mm) are used; intrinsics are
    /// ignored. Views of several cameras that were taken at the same time have the same name.
    pub fn check(&self, before: &Estimate) -> Check {
        let found = self.checked(before);
        let is_unfit = found.missing.iter().any(|missing| matches!(missing, Missing::Fit { .. }));
        let exchanged = match found.answer == Answer::Changed || is_unfit {
            true => self.exchanged(before),
            false => None,
        };
        Check { exchanged, ..found }
    }

    /// The names of two cameras whose views agree with the calibration if they are exchanged.
    fn exchanged(&self, before: &Estimate) -> Option<[String; 2]> {
        let pairs = (0..self.cameras.len()).flat_map(|b| (0..b).map(move |a| [a, b]));
        let agree = |&[a, b]: &[usize; 2]| {
            let mut cameras = self.cameras.clone();
            cameras[a].views.clone_from(&self.cameras[b].views);
            cameras[b].views.clone_from(&self.cameras[a].views);
            agrees(&self.of_cameras(cameras).checked(before))
        };
        pairs.into_iter().find(agree).map(|pair| pair.map(|of| before.cameras[of].name.clone()))
    }

    fn checked(&self, before: &Estimate) -> Check {
        let sizes = before.cameras.iter().zip(&self.cameras).filter_map(|(known, of)| {
            let size_px = [known.camera.width, known.camera.height];
            Some((&known.name, size_px, of.views.first()?.size_px))
        });
        let sizes: Vec<_> = sizes.collect();
        let is_other = |of: &&(_, [u32; 2], [u32; 2])| of.1 != of.2;
        let first = sizes.iter().find(is_other).or(sizes.first());
        let sizes_px = first.map_or([[0; 2]; 2], |&(_, known, of)| [known, of]);
        let check = Check { sizes_px, ..undecided(Vec::new()) };
        let changed = sizes.iter().filter(is_other).map(|&(camera, known, of)| Suspect {
            camera: camera.clone(),
            quantity: of_sizes(known, of),
        });
        let changed: Vec<Suspect> = changed.collect();
        if !changed.is_empty() {
            return Check { answer: Answer::Changed, changed, ..check };
        }
        let found = Earlier::of(before).and_then(|earlier| {
            let of = |width| {
                let views = Views::of(self, &earlier, width)?;
                Ok(answer(&views, &earlier, self.board_accuracy_mm, check.clone()))
            };
            let found = of(LOOSE)?;
            // A few views may drive parameters so far that the equations are no longer linear. A change is certain only if
            // it is also found where nothing has changed.
            let kept = match found.answer == Answer::Changed {
                true => of(TIGHT).ok().filter(agrees),
                false => None,
            };
            Ok(kept.unwrap_or(found))
        });
        found.unwrap_or_else(|missing| Check { missing: vec![missing], ..check })
    }
}

/// Whether the views fit the calibration, although they may not determine every change.
fn agrees(found: &Check) -> bool {
    let is_open = |missing: &Missing| matches!(missing, Missing::Undetermined { .. });
    found.answer != Answer::Changed && found.missing.iter().all(is_open)
}

/// The answer from the equations of the views.
fn answer(views: &Views, earlier: &Earlier, board_accuracy_mm: Option<f64>, check: Check) -> Check {
    let (rms_px, problem) = (views.rms_px, &views.problem);
    let check = Check { views: views.count, corners: problem.count(), rms_px, ..check };
    let sides = earlier.cameras.iter().map(|of| of.camera.width.max(of.camera.height));
    if rms_px > FITS * f64::from(sides.max().unwrap_or(0)) {
        return Check { missing: vec![Missing::Fit { rms_px }], ..check };
    }
    let equations = Equations::of(views, earlier, board_accuracy_mm);
    let found = equations.and_then(|of| Some((Evidence::of(&of, earlier)?, of)));
    let Some((evidence, equations)) = found else {
        return Check { missing: vec![Missing::Views { camera: String::new() }], ..check };
    };
    let tests = evidence.tests(&equations, earlier, views);
    let p_value = Some(evidence.p_value());
    let (changed, or) = evidence.changed();
    let missing = tests.iter().filter(|test| !test.is_determined());
    let missing: Vec<Missing> = missing.map(|test| undetermined(test, views, earlier)).collect();
    let answer = match (changed.is_empty(), missing.is_empty()) {
        (false, _) => Answer::Changed,
        (true, true) => Answer::Unchanged,
        (true, false) => Answer::CannotTell,
    };
    Check { answer, changed, or, missing, tests, p_value, ..check }
}

/// A check that has no answer.
fn undecided(missing: Vec<Missing>) -> Check {
    Check {
        answer: Answer::CannotTell,
        changed: Vec::new(),
        or: Vec::new(),
        missing,
        tests: Vec::new(),
        p_value: None,
        views: 0,
        corners: 0,
        rms_px: 0.0,
        sizes_px: [[0; 2]; 2],
        exchanged: None,
    }
}

/// What changes the size of an image.
fn of_sizes(from: [u32; 2], to: [u32; 2]) -> Quantity {
    let [[width, height], [to_width, to_height]] = [from, to].map(|size| size.map(u64::from));
    match width * to_height == height * to_width {
        true => Quantity::Resolution,
        false if [width, height] == [to_height, to_width] => Quantity::Orientation,
        false => Quantity::Crop,
    }
}

fn undetermined(test: &QuantityTest, views: &Views, earlier: &Earlier) -> Missing {
    let camera = earlier.cameras.iter().position(|camera| camera.name == test.of.camera);
    let limit = test.limit.unwrap_or(f64::INFINITY);
    Missing::Undetermined {
        of: test.of.clone(),
        detectable: test.detectable,
        limit,
        shown: (test.attainable <= limit).then(|| views.shown(camera.unwrap_or(0))),
    }
}
