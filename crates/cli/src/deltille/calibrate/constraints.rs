//! Options for constraints on the parameters of cameras: fixed, equal, or with a prior.

use anyhow::{Context, anyhow, bail};

use deltille::calibrate::{Constraint, ConstraintError, Intrinsics, Model};

use crate::output::log;

/// Constraints on parameters of cameras.
#[derive(clap::Args)]
pub struct ConstraintArgs {
    /// Keep parameters of the camera at a value, such as k3 or k3=0.01, separated by commas; without a value, cx and cy
    /// are fixed at the image centre, and coefficients of distortion at 0. For one camera of a rig: left:k3
    #[arg(long, value_name = "NAME[=VALUE]", value_delimiter = ',', value_parser = |text: &str| Given::new(text, Constraint::fixed))]
    fix: Vec<Given>,
    /// Estimate one common value for parameters, such as fx,fy; repeatable. For one camera of a rig: left:fx,fy
    #[arg(long, value_name = "NAME,NAME", value_parser = |text: &str| Given::new(text, Constraint::equal))]
    equal: Vec<Given>,
    /// Value and standard deviation of a parameter that was measured before, such as cx=960±2 or cx=960+-2, separated by
    /// commas. For one camera of a rig: left:cx=960±2
    #[arg(long, value_name = "NAME=VALUE±SD", value_delimiter = ',', value_parser = |text: &str| Given::new(text, Constraint::prior))]
    prior: Vec<Given>,
}

/// A constraint, and the name of its camera if it is not for all.
#[derive(Clone)]
struct Given {
    camera: Option<String>,
    constraint: Constraint,
}

impl Given {
    fn new(
        text: &str,
        parse: fn(&str) -> Result<Constraint, ConstraintError>,
    ) -> Result<Self, String> {
        let (camera, rest) = match text.split_once(':') {
            Some((camera, rest)) => (Some(camera.trim().to_owned()), rest),
            None => (None, text),
        };
        let constraint = parse(rest).map_err(|error| error.to_string())?;
        Ok(Self { camera, constraint })
    }
}

impl ConstraintArgs {
    fn options(&self) -> [(&'static str, &[Given]); 3] {
        [("--fix", &self.fix), ("--equal", &self.equal), ("--prior", &self.prior)]
    }

    /// Returns the constraints of a camera of a rig. Those for all cameras do not apply to a given one.
    pub fn of(&self, camera: &str, intrinsics: &Intrinsics) -> Vec<Constraint> {
        let is_given = intrinsics.model().is_none();
        let applies = |given: &&Given| match &given.camera {
            Some(name) => name == camera,
            None => !is_given,
        };
        let given = self.options().into_iter().flat_map(|(_, given)| given);
        given.filter(applies).map(|given| given.constraint.clone()).collect()
    }

    /// Rejects names of unknown cameras; a single camera has no name.
    pub fn check_cameras(&self, names: &[&str]) -> anyhow::Result<()> {
        for (option, given) in self.options() {
            for Given { camera, constraint } in given {
                match camera {
                    Some(camera) if names.is_empty() => {
                        bail!(
                            "{option} {camera}:{constraint}: there is one camera; use {constraint}"
                        )
                    }
                    Some(camera) if !names.contains(&camera.as_str()) => {
                        bail!(
                            "{option}: no camera is named {camera} (cameras: {})",
                            names.join(", ")
                        )
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }

    /// Rejects constraints that a camera cannot have. Of several candidate models, one must have all parameters; notes the
    /// others.
    pub fn check(
        &self,
        camera: &str,
        intrinsics: &Intrinsics,
        candidates: &[Model],
    ) -> anyhow::Result<()> {
        let all = self.of(camera, intrinsics);
        let is_unknown = |error: &ConstraintError| matches!(error, ConstraintError::Unknown { .. });
        let checked = |some: &[Constraint]| match intrinsics {
            Intrinsics::Unknown(_) => {
                let models = candidates.iter().map(|model| Intrinsics::Unknown(*model));
                let results = models.map(|model| Constraint::check(some, &model));
                // An error of a model that has all parameters says more.
                let better = results.reduce(|one, other| match (&one, &other) {
                    (Ok(()), _) => one,
                    (_, Ok(())) => other,
                    (Err(error), Err(next)) if is_unknown(error) && !is_unknown(next) => other,
                    _ => one,
                });
                better.unwrap_or(Ok(()))
            }
            given => Constraint::check(some, given),
        };
        let Err(error) = checked(&all) else {
            let lacks =
                |model: &&Model| Constraint::check(&all, &Intrinsics::Unknown(**model)).is_err();
            let lacking: Vec<String> =
                candidates.iter().filter(lacks).map(ToString::to_string).collect();
            if !lacking.is_empty() && matches!(intrinsics, Intrinsics::Unknown(_)) {
                log!(
                    "note: not compared, because they lack a constrained parameter: {}",
                    lacking.join(", ")
                );
            }
            return Ok(());
        };
        // The option whose constraint is wrong; else, constraints contradict each other.
        let is_wrong = |given: &&Given| {
            all.contains(&given.constraint)
                && checked(std::slice::from_ref(&given.constraint)).is_err()
        };
        let of_option = self.options().into_iter();
        let wrong =
            of_option.filter_map(|(option, given)| Some((option, given.iter().find(is_wrong)?)));
        let option = match wrong.into_iter().next() {
            Some((option, given)) => format!("{option} {}", given.constraint),
            None => "--fix, --equal, --prior".to_owned(),
        };
        let is_auto = candidates.len() > 1 && intrinsics.model().is_some();
        let error = match is_auto && is_unknown(&error) {
            true => {
                anyhow!(error).context("no candidate of --model auto has all of these parameters")
            }
            false => anyhow!(error),
        };
        Err(error).context(option)
    }
}
