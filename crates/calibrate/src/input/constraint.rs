//! Constraints on the parameters of a camera: fixed, equal, or known from elsewhere with a standard deviation.

use std::fmt;

use super::intrinsics::Intrinsics;
use crate::error::ConstraintError;
use deltille_core::camera::{Camera, Lens, PROJECTION_PARAMETERS};
use deltille_core::quantity::{coefficient, focal_px, place_px};

/// A constraint on the parameters of a camera that are estimated. Parameters are named as in
/// [`Camera::parameter_names`]. Its text, such as `k3=0.01`, `fx,fy` or `cx=960±2`, is what [`Self::fixed`],
/// [`Self::equal`] and [`Self::prior`] parse.
#[derive(Clone, Debug, PartialEq)]
pub enum Constraint {
    /// A parameter that is not estimated.
    Fixed {
        /// Name of the parameter.
        parameter: String,
        /// Its value, in the unit of [`Parameter::value`](crate::Parameter::value). `None` for the image centre for `cx`
        /// and `cy`, and for zero for a coefficient of distortion; other parameters need a value.
        value: Option<f64>,
    },
    /// Parameters that have one common value, which is estimated.
    Equal {
        /// Names of two or more parameters.
        parameters: Vec<String>,
    },
    /// A parameter that was measured before, independently of the images. The measurement counts as one more observation.
    Prior {
        /// Name of the parameter.
        parameter: String,
        /// The measured value.
        value: f64,
        /// Its standard deviation, in the same unit; positive.
        sd: f64,
    },
}

const FIXED: &str = "a parameter, such as k3, or a parameter with its value, such as k3=0.01";
const EQUAL: &str = "two or more different parameters of one camera, such as fx,fy";
const PRIOR: &str =
    "a parameter with its value and standard deviation, such as cx=960±2 or cx=960+-2";

/// The ways to write ±.
const PLUS_MINUS: [&str; 3] = ["±", "+/-", "+-"];

impl Constraint {
    /// Parses a fixed parameter, such as `k3` or `k3=0.01`.
    ///
    /// # Errors
    /// Returns [`ConstraintError::Syntax`] for any other text.
    pub fn fixed(text: &str) -> Result<Self, ConstraintError> {
        let parsed = match text.split_once('=') {
            None => named(text).map(|parameter| (parameter, None)),
            Some((name, value)) => named(name).zip(number(value).map(Some)),
        };
        let (parameter, value) = parsed.ok_or_else(|| syntax(text, FIXED))?;
        Ok(Self::Fixed { parameter, value })
    }

    /// Parses equal parameters, such as `fx,fy`.
    ///
    /// # Errors
    /// Returns [`ConstraintError::Syntax`] for any other text, or for fewer than two different parameters.
    pub fn equal(text: &str) -> Result<Self, ConstraintError> {
        let parameters: Option<Vec<String>> = text.split(',').map(named).collect();
        let are_different = |names: &Vec<String>| {
            names.len() > 1 && (1..names.len()).all(|i| !names[..i].contains(&names[i]))
        };
        let parameters = parameters.filter(are_different).ok_or_else(|| syntax(text, EQUAL))?;
        Ok(Self::Equal { parameters })
    }

    /// Parses a prior, such as `cx=960±2`; `+-` and `+/-` equal `±`.
    ///
    /// # Errors
    /// Returns [`ConstraintError::Syntax`] for any other text.
    pub fn prior(text: &str) -> Result<Self, ConstraintError> {
        let parsed = text.split_once('=').and_then(|(name, rest)| {
            let (value, sd) = PLUS_MINUS.iter().find_map(|sign| rest.split_once(sign))?;
            Some((named(name)?, number(value)?, number(sd)?))
        });
        let (parameter, value, sd) = parsed.ok_or_else(|| syntax(text, PRIOR))?;
        Ok(Self::Prior { parameter, value, sd })
    }

    /// Checks constraints for a camera with these intrinsics before it is calibrated.
    ///
    /// # Errors
    /// Returns an error if the camera does not estimate a parameter, or if constraints contradict each other.
    pub fn check(some: &[Self], intrinsics: &Intrinsics) -> Result<(), ConstraintError> {
        Constrained::of(some, intrinsics, [1, 1]).map(|_| ())
    }

    /// The parameters that it names.
    pub fn parameters(&self) -> &[String] {
        match self {
            Self::Fixed { parameter, .. } | Self::Prior { parameter, .. } => {
                std::slice::from_ref(parameter)
            }
            Self::Equal { parameters } => parameters,
        }
    }
}

impl fmt::Display for Constraint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fixed { parameter, value: None } => f.write_str(parameter),
            Self::Fixed { parameter, value: Some(value) } => write!(f, "{parameter}={value}"),
            Self::Equal { parameters } => f.write_str(&parameters.join(",")),
            Self::Prior { parameter, value, sd } => write!(f, "{parameter}={value}±{sd}"),
        }
    }
}

fn syntax(text: &str, expected: &'static str) -> ConstraintError {
    ConstraintError::Syntax { text: text.to_owned(), expected }
}

/// A name of a parameter; `None` for other texts.
fn named(text: &str) -> Option<String> {
    let name = text.trim();
    let is_name = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    is_name.then(|| name.to_owned())
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite())
}

/// The constraints of a camera, with indices of parameters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Constrained {
    /// Which parameters are estimated.
    pub free: Vec<bool>,
    /// Groups of equal parameters.
    pub equal: Vec<Vec<usize>>,
    /// Index, value and standard deviation of parameters with a prior.
    pub priors: Vec<(usize, f64, f64)>,
    /// Index and value of fixed parameters.
    pub fixed: Vec<(usize, f64)>,
}

impl Constrained {
    pub(crate) fn of(
        some: &[Constraint],
        intrinsics: &Intrinsics,
        [width, height]: [u32; 2],
    ) -> Result<Self, ConstraintError> {
        let mut all = Self { free: intrinsics.free(), ..Self::default() };
        if some.is_empty() {
            return Ok(all);
        }
        let start = match intrinsics {
            Intrinsics::Unknown(model) => Camera::centred(width, height, 1.0, model.lens()),
            Intrinsics::Known(camera) | Intrinsics::Near { camera, .. } => camera.clone(),
        };
        let names = start.parameter_names();
        let estimated = all.free.clone();
        // Knots of a spline have no meaning, and its projection is that of another lens.
        let can_be_named = |i: usize| estimated[i] && !matches!(start.lens, Lens::Spline(_));
        let index = |name: &String| {
            let found = names.iter().position(|other| other == name);
            found.filter(|&i| can_be_named(i)).ok_or_else(|| {
                let known = (0..names.len()).filter(|&i| can_be_named(i));
                let known: Vec<&str> = known.map(|i| names[i].as_str()).collect();
                ConstraintError::Unknown {
                    parameter: name.clone(),
                    model: intrinsics
                        .model()
                        .map_or("the given camera".to_owned(), |model| format!("model {model}")),
                    known: if known.is_empty() { "none".to_owned() } else { known.join(", ") },
                }
            })
        };
        for one in some {
            match one {
                Constraint::Fixed { parameter, value } => {
                    let i = index(parameter)?;
                    let value = value.or_else(|| default(&start, i));
                    let value = value.ok_or_else(|| ConstraintError::NoDefault {
                        parameter: parameter.clone(),
                    })?;
                    in_range(&start.lens, parameter, i, value)?;
                    all.free[i] = false;
                    all.fixed.push((i, value));
                }
                Constraint::Equal { parameters } => {
                    let mut group: Vec<usize> =
                        parameters.iter().map(index).collect::<Result<_, _>>()?;
                    group.sort_unstable();
                    let kind = |i: usize| (i / 2).min(PROJECTION_PARAMETERS.len() / 2);
                    if group.iter().any(|&i| kind(i) != kind(group[0])) {
                        let parameters = parameters.join(", ");
                        return Err(ConstraintError::DifferentKinds { parameters });
                    }
                    all.equal.push(group);
                }
                Constraint::Prior { parameter, value, sd } => {
                    positive(parameter, "the standard deviation", *sd)?;
                    let i = index(parameter)?;
                    in_range(&start.lens, parameter, i, *value)?;
                    all.priors.push((i, *value, *sd));
                }
            }
        }
        all.check_once(&names).map(|()| all)
    }

    /// Rejects a parameter with two constraints of a kind, or that is fixed and not only fixed.
    fn check_once(&self, names: &[String]) -> Result<(), ConstraintError> {
        let fixed = self.fixed.iter().map(|of| of.0);
        let equal = self.equal.iter().flatten().copied();
        let priors = self.priors.iter().map(|of| of.0);
        let twice = [fixed.clone().chain(equal).collect(), fixed.chain(priors).collect()];
        let twice = twice.iter().find_map(|some: &Vec<usize>| {
            (1..some.len()).find(|&k| some[..k].contains(&some[k])).map(|k| some[k])
        });
        match twice {
            Some(i) => Err(ConstraintError::Twice { parameter: names[i].clone() }),
            None => Ok(()),
        }
    }

    /// The camera with fixed parameters at their values, and equal ones at their mean.
    pub(crate) fn apply(&self, camera: &Camera) -> Camera {
        if self.fixed.is_empty() && self.equal.is_empty() {
            return camera.clone();
        }
        let mut values = camera.parameters();
        self.fixed.iter().for_each(|&(i, value)| values[i] = value);
        for group in &self.equal {
            let mean = group.iter().map(|&i| values[i]).sum::<f64>() / group.len() as f64;
            group.iter().for_each(|&i| values[i] = mean);
        }
        camera.with_parameters(&values)
    }
}

/// The value of a parameter that is fixed without a value.
fn default(start: &Camera, i: usize) -> Option<f64> {
    let centre = (i == 2 || i == 3).then(|| {
        let size = [start.width, start.height][i - 2];
        f64::from(size) / 2.0 - 0.5
    });
    let is_zero = i >= PROJECTION_PARAMETERS.len() && start.parameters()[i] == 0.0;
    centre.or(is_zero.then_some(0.0))
}

/// Rejects a value that a camera file may not have.
fn in_range(lens: &Lens, parameter: &str, i: usize, value: f64) -> Result<(), ConstraintError> {
    let of_lens = i.checked_sub(PROJECTION_PARAMETERS.len());
    let range = match of_lens {
        None if i < 2 => focal_px::RANGE,
        None => place_px::RANGE,
        Some(i) => lens.ranges().get(i).copied().unwrap_or(coefficient::RANGE),
    };
    let checked = range.check(value).map(|_| ());
    checked.map_err(|problem| ConstraintError::Value { parameter: parameter.to_owned(), problem })
}

fn positive(parameter: &str, what: &'static str, value: f64) -> Result<(), ConstraintError> {
    match value > 0.0 && value.is_finite() {
        true => Ok(()),
        false => Err(ConstraintError::OutOfRange { parameter: parameter.to_owned(), what, value }),
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::{
        Calibration, CameraEstimate, CameraViews, Messages, Model, Observation, PanelRef, Sighting,
        View,
    };
    use deltille_core::camera::{BrownConrady, Pose};
    use glam::{DVec2, DVec3};

    const SIGMA_PX: f64 = 0.1;

    /// A number with mean 0 and variance 1.
    fn normal(rng: &mut ChaCha8Rng) -> f64 {
        (0..12).map(|_| rng.random_range(-0.5..0.5)).sum()
    }

    fn truth() -> Camera {
        let lens = BrownConrady { radial: [-0.15, 0.04, 0.0], ..BrownConrady::default() };
        Camera::centred(1280, 960, 1100.0, Lens::BrownConrady(lens))
    }

    /// Views of a board with noise.
    fn views(rng: &mut ChaCha8Rng) -> Vec<View> {
        let view = |index: u32| {
            let [i, j] = [f64::from(index % 4), f64::from(index / 4)];
            let eye = DVec3::new(130.0 * i - 100.0, 180.0 * j - 90.0, -330.0 - 30.0 * i);
            let pose = Pose::looking_at(eye, DVec3::new(60.0 + 20.0 * i, 80.0, 0.0), DVec3::Y);
            let corners = (0..48).map(|k| (k / 8, k % 8)).map(|(row, col)| {
                let panel_mm = DVec3::new(25.0 * f64::from(col), 25.0 * f64::from(row), 0.0);
                let off = DVec2::new(normal(rng), normal(rng)) * SIGMA_PX;
                let pixel = truth().project(pose.apply(panel_mm)).unwrap() + off;
                let cov = Some([SIGMA_PX.powi(2), 0.0, SIGMA_PX.powi(2)]);
                Observation { row, col, panel_mm, pixel, cov }
            });
            let sighting = Sighting { panel: PanelRef::ONLY, observations: corners.collect() };
            let name = index.to_string();
            View { name, image: String::new(), size_px: [1280, 960], sightings: vec![sighting] }
        };
        (0..12).map(view).collect()
    }

    fn calibrated(views: Vec<View>, constraints: &[Constraint]) -> CameraEstimate {
        let constraints = constraints.to_vec();
        let camera = CameraViews { constraints, ..CameraViews::new("c", views, Model::Radtan5) };
        let found = Calibration::new([Pose::IDENTITY]).board_accuracy_mm(Some(0.0)).with(camera);
        found.solve().unwrap().cameras.remove(0)
    }

    fn value(of: &CameraEstimate, name: &str) -> (f64, Option<f64>) {
        let found = of.parameters.iter().find(|p| p.name == name).unwrap();
        (found.value, found.sd)
    }

    #[test]
    fn constraints_are_parsed_and_printed() {
        for text in ["k3", "k3=-0.01"] {
            assert_eq!(Constraint::fixed(text).unwrap().to_string(), text);
        }
        assert_eq!(Constraint::equal(" fx, fy").unwrap().to_string(), "fx,fy");
        for text in ["cx=960±2", "cx=960+-2", "cx = 960 +/- 2"] {
            assert_eq!(Constraint::prior(text).unwrap().to_string(), "cx=960±2");
        }
        for text in ["", "k3=", "k3=x", "=1", "k3=inf", "cx=960±2"] {
            assert!(Constraint::fixed(text).is_err(), "{text}");
        }
        for text in ["fx", "fx,fx", "fx,,fy"] {
            assert!(Constraint::equal(text).is_err(), "{text}");
        }
        for text in ["cx=960", "cx±2", "cx=960±", "cx=±2"] {
            assert!(Constraint::prior(text).is_err(), "{text}");
        }
    }

    #[test]
    fn unusable_constraints_name_the_parameter() {
        let check = |some: &[Result<Constraint, ConstraintError>], model: Model| {
            let some: Vec<Constraint> = some.iter().cloned().map(Result::unwrap).collect();
            Constraint::check(&some, &Intrinsics::Unknown(model)).map_err(|error| error.to_string())
        };
        let wrong = check(&[Constraint::fixed("k3")], Model::Radtan).unwrap_err();
        let known =
            "model radtan has no parameter k3 to estimate; it has fx, fy, cx, cy, k1, k2, p1, p2";
        assert_eq!(wrong, known);
        assert!(check(&[Constraint::fixed("fx")], Model::Radtan).unwrap_err().contains("fx=1.5"));
        let negative = check(&[Constraint::prior("fx=900±-1")], Model::Radtan);
        assert!(negative.unwrap_err().contains("not -1"));
        let both = [Constraint::fixed("cx"), Constraint::prior("cx=600±1")];
        assert!(check(&both, Model::Radtan).unwrap_err().contains("cx has two"));
        assert!(check(&[Constraint::fixed("cx")], Model::SPLINE).unwrap_err().contains("has none"));
        assert_eq!(check(&[Constraint::fixed("k3")], Model::Radtan5), Ok(()));
    }

    /// Fixed parameters have no standard deviation, and equal ones share a value and a variance. A prior with a small
    /// standard deviation fixes a parameter; with a large one, it has no effect.
    #[test]
    fn constraints_hold_and_have_the_right_limits() {
        let views = views(&mut ChaCha8Rng::seed_from_u64(3));
        let found = |constraints: &[Constraint]| calibrated(views.clone(), constraints);
        let free = found(&[]);
        let equal = found(&[Constraint::equal("fx,fy").unwrap(), Constraint::fixed("cx").unwrap()]);
        assert_eq!(value(&equal, "cx"), (639.5, None));
        assert_eq!(value(&equal, "fx"), value(&equal, "fy"));
        assert!((equal.correlation(0, 1) - 1.0).abs() < 1e-12);
        assert!(value(&equal, "fx").1 < value(&free, "fx").1);
        assert_eq!(equal.unknown_count(), free.unknown_count() - 2);
        let observed = equal.projection.unwrap().observed.unwrap().covariance;
        assert!((observed[(0, 0)] - observed[(0, 1)]).abs() < 1e-9 * observed[(0, 0)]);
        let same = |one: &CameraEstimate, other: &CameraEstimate, part: f64| {
            for (a, b) in one.parameters.iter().zip(&other.parameters) {
                let Some(sd) = a.sd.filter(|_| a.name != "k3") else { continue };
                assert!((a.value - b.value).abs() < part * sd, "{}", a.name);
                assert!((b.sd.unwrap() / sd - 1.0).abs() < part, "{}", a.name);
            }
        };
        let fixed = found(&[Constraint::fixed("k3=0.02").unwrap()]);
        let tight = found(&[Constraint::prior("k3=0.02±1e-7").unwrap()]);
        assert_eq!(value(&fixed, "k3"), (0.02, None));
        assert!((value(&tight, "k3").1.unwrap() / 1e-7 - 1.0).abs() < 0.01);
        same(&fixed, &tight, 0.01);
        same(&free, &found(&[Constraint::prior("k3=5±1e6").unwrap()]), 0.01);
    }

    /// A wrong constraint is not taken for another lens.
    #[test]
    fn a_wrong_constraint_is_named() {
        let views = views(&mut ChaCha8Rng::seed_from_u64(5));
        let of = |constraints: &[&str]| {
            let camera = CameraViews::new("c", views.clone(), Model::Radtan5);
            let constraints = constraints.iter().map(|of| match of.contains('±') {
                true => Constraint::prior(of).unwrap(),
                false => Constraint::fixed(of).or_else(|_| Constraint::equal(of)).unwrap(),
            });
            let camera = CameraViews { constraints: constraints.collect(), ..camera };
            let calibration =
                Calibration::new([Pose::IDENTITY]).board_accuracy_mm(Some(0.0)).with(camera);
            let found = calibration.solve().unwrap();
            let said = calibration.explain(&found);
            said.iter().map(|of| Messages::new(&found, None).sentence(of)).collect::<Vec<_>>()
        };
        for wrong in [&["k1=-0.1", "k2=0.04", "k3=0"][..], &["fx=1060"], &["cx=560"]] {
            let said = of(wrong);
            assert!(
                said.iter().any(|of| of.contains("a constraint is wrong")),
                "{wrong:?}: {said:?}"
            );
            assert!(
                said.iter().all(|of| !of.contains("does not fit the lens")),
                "{wrong:?}: {said:?}"
            );
        }
        for contradicted in ["fx=1003", "cx,cy", "cx=645±0.1", "cx=645±0.0001"] {
            let said = of(&[contradicted]);
            let named = format!("the views contradict the constraint {contradicted}");
            assert!(said.iter().any(|of| of.starts_with(&named)), "{contradicted}: {said:?}");
        }
        let fx = format!("fx={}", truth().focal_px.x);
        for right in ["k1=-0.15", "k1=-0.15±1e-9", &fx, &format!("{fx}±0.0001")] {
            let said = of(&[right]);
            assert!(said.iter().all(|of| !of.contains("constraint")), "{right}: {said:?}");
        }
    }

    /// Constraints with which no view fits.
    #[test]
    fn constraints_that_prevent_a_calibration_are_named() {
        let views = views(&mut ChaCha8Rng::seed_from_u64(6));
        let failed = |model: Model, constraints: &[&str]| {
            let constraints = constraints.iter().map(|of| Constraint::fixed(of).unwrap()).collect();
            let camera = CameraViews { constraints, ..CameraViews::new("c", views.clone(), model) };
            let calibration = Calibration::new([Pose::IDENTITY]).with(camera);
            calibration.solve().unwrap_err().to_string()
        };
        let said = failed(Model::Radtan, &["k1=1000000000"]);
        assert!(said.starts_with("the constraints (k1=1000000000) contradict the views"), "{said}");
        let said = failed(Model::Radtan, &["k9"]);
        assert!(said.contains("no parameter k9") && !said.contains("contradict"), "{said}");
    }

    /// Over many calibrations with a new measurement each, errors agree with the standard deviations, both those from
    /// noise and those observed.
    #[test]
    fn standard_deviations_are_right_with_constraints() {
        const RUNS: usize = 60;
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let (mut squares, mut observed_squares, mut count) = (0.0, 0.0, 0.0);
        for _ in 0..RUNS {
            let views = views(&mut rng);
            let (cx, sd) = (639.5 + 0.5 * normal(&mut rng), 0.5);
            let found = calibrated(
                views,
                &[
                    Constraint::equal("fx,fy").unwrap(),
                    Constraint::fixed("k3").unwrap(),
                    Constraint::Prior { parameter: "cx".to_owned(), value: cx, sd },
                ],
            );
            let observed = found.observed_sd();
            for ((p, exact), observed) in
                found.parameters.iter().zip(truth().parameters()).zip(observed)
            {
                let Some(sd) = p.sd.filter(|_| p.name != "fy") else { continue };
                squares += ((p.value - exact) / sd).powi(2);
                observed_squares += ((p.value - exact) / observed.unwrap()).powi(2);
                count += 1.0;
            }
        }
        let (noise, observed) = ((squares / count).sqrt(), (observed_squares / count).sqrt());
        println!("errors over standard deviation: {noise:.3} from noise, {observed:.3} observed");
        assert!((noise - 1.0).abs() < 0.12, "{noise}");
        assert!((observed - 1.0).abs() < 0.2, "{observed}");
    }
}
