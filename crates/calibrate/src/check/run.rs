//! From new views to an answer.

use super::answer::{Answer, Check, Missing, Quantity, QuantityTest, Remedial};
use super::equations::{Earlier, Equations, SAME_BOARD};
use super::hypotheses::Evidence;
use crate::estimate::values::Estimate;
use crate::input::calibration::Calibration;
use crate::problem::bundle::Problem;
use crate::problem::camera_prior::CameraPrior;
use crate::problem::unknowns::Block;
use deltille_core::camera::Lens;
use glam::DVec3;

/// The largest angle between the line of sight and the normal of a board that counts as head-on, degrees.
const HEAD_ON_DEG: f64 = 15.0;

/// The reach of the corners from the image centre that counts as central, in half diagonals.
const CENTRAL: f64 = 0.6;

/// Largest RMS residual of the best fit, relative to the longer side of the image.
const FITS: f64 = 0.005;

impl Calibration {
    /// Tests whether a camera is still as in an earlier estimate, from the views of the only camera of this calibration;
    /// their intrinsics are ignored. The board is assumed to be as accurate as
    /// [`board_accuracy_mm`](Self::board_accuracy_mm) says.
    pub fn check(&self, before: &Estimate) -> Check {
        let Some(camera) = before.cameras.first() else { return undecided(Missing::Covariance) };
        let size_px = [camera.camera.width, camera.camera.height];
        let views = || self.cameras.iter().flat_map(|camera| &camera.views);
        let Some(view) = views().next() else { return undecided(Missing::Views) };
        let mut check = Check { sizes_px: [size_px, view.size_px], ..undecided(Missing::Views) };
        if view.size_px != size_px {
            check.missing.clear();
            (check.answer, check.changed) =
                (Answer::Changed, vec![of_sizes(size_px, view.size_px)]);
            return check;
        }
        if let Lens::Spline(_) = camera.camera.lens {
            return Check { missing: vec![Missing::Spline], ..check };
        }
        let noise = camera.covariance.inner();
        let observed = camera.projection.as_ref().and_then(|known| known.observed.as_ref());
        let of_noise = match noise.is_empty() {
            true => None,
            false => CameraPrior::new(&camera.camera, noise),
        };
        let (Some(of_noise), Some(observed)) = (of_noise, observed) else {
            let missing = if noise.is_empty() { Missing::Covariance } else { Missing::Observed };
            return Check { missing: vec![missing], ..check };
        };
        let scatter = observed.without_board();
        let excess = of_noise.information().component_mul(scatter.inner()).sum();
        let excess = (excess / noise.nrows() as f64).max(1.0);
        // With few frames, single directions of the scatter are too uncertain.
        let mut covariance = scatter.inner() + noise * excess;
        if let Some(of_board) = &observed.of_board {
            covariance += of_board.inner() * SAME_BOARD;
        }
        let earlier =
            Earlier { camera, covariance: &covariance, excess, common_px: before.common_px };
        let Some(equations) = Equations::of(self, &earlier) else { return check };
        let side_px = f64::from(size_px[0].max(size_px[1]));
        check.views = equations.problem.frames.len();
        check.corners = equations.problem.count();
        check.rms_px = equations.rms_px;
        if check.rms_px > FITS * side_px {
            return Check { missing: vec![Missing::Fit { rms_px: check.rms_px }], ..check };
        }
        let Some(evidence) = Evidence::of(&equations, &earlier, observed.freedom) else {
            return check;
        };
        check.tests = evidence.tests(&equations, &earlier);
        check.p_value = Some(evidence.p_value());
        (check.changed, check.or) = evidence.changed();
        let remedy = remedy(&equations.problem);
        let open = check.tests.iter().filter(|test| !test.is_determined());
        check.missing = open.map(|test| undetermined(test, remedy)).collect();
        check.answer = match (check.changed.is_empty(), check.missing.is_empty()) {
            (false, _) => Answer::Changed,
            (true, true) => Answer::Unchanged,
            (true, false) => Answer::CannotTell,
        };
        check
    }
}

/// A check that has no answer for one reason.
fn undecided(missing: Missing) -> Check {
    Check {
        answer: Answer::CannotTell,
        changed: Vec::new(),
        or: Vec::new(),
        missing: vec![missing],
        tests: Vec::new(),
        p_value: None,
        views: 0,
        corners: 0,
        rms_px: 0.0,
        sizes_px: [[0; 2]; 2],
    }
}

/// What changes the size of an image.
fn of_sizes(from: [u32; 2], to: [u32; 2]) -> Quantity {
    let [from, to] = [from, to].map(|size| size.map(u64::from));
    match from[0] * to[1] == from[1] * to[0] {
        true => Quantity::Resolution,
        false => Quantity::Crop,
    }
}

fn undetermined(test: &QuantityTest, remedy: Remedial) -> Missing {
    Missing::Undetermined {
        quantity: test.quantity,
        detectable: test.detectable,
        limit: test.limit.unwrap_or(f64::INFINITY),
        remedy,
    }
}

/// How to determine more of the camera than these views do.
fn remedy(problem: &Problem) -> Remedial {
    let camera = &problem.cameras[0].camera;
    let size = glam::DVec2::new(camera.width.into(), camera.height.into());
    let tilt = |block: &Block| {
        let pose = problem.frames[block.frame].after(&problem.scene_from_panel(block.panel));
        let points: Vec<DVec3> = problem.camera_points(block).collect();
        let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
        let cosine = (pose.rotation * DVec3::Z).dot(middle.normalize_or(DVec3::Z)).abs();
        cosine.min(1.0).acos().to_degrees()
    };
    let most = problem.blocks.iter().map(tilt).fold(0.0, f64::max);
    let corners = problem.blocks.iter().flat_map(|block| block.observations.iter());
    let reach = corners
        .map(|seen| (seen.pixel - (size - 1.0) / 2.0).length() / (0.5 * size.length()))
        .fold(0.0, f64::max);
    match (most < HEAD_ON_DEG, reach < CENTRAL) {
        (true, _) => Remedial::Tilt,
        (false, true) => Remedial::Spread,
        (false, false) => Remedial::More,
    }
}
