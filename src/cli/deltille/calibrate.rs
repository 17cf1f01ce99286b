//! `deltille calibrate`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::ValueEnum;

use super::sightings::{Sightings, SightingsArgs};
use crate::calibrate::{self, Loss, Model, Options, Solution, Weights};
use crate::camera::Camera;
use crate::cli::output::{self, say};
use crate::export::calibration;

/// Arguments of `deltille calibrate`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    sightings: SightingsArgs,
    /// What is to be found beside fx, fy, cx, cy: radtan (k1 k2 p1 p2), radtan5 (and k3), rational
    /// (and k4 k5 k6), thin-prism (and s1 … s4), kannala-brandt (4 terms; kannala-brandt-5 …),
    /// eucm, double-sphere, or pupil (fisheye with a moving entrance pupil)
    #[arg(long, required_unless_present = "fixed_intrinsics")]
    model: Option<Model>,
    /// Find only the poses of this camera
    #[arg(long, value_name = "CAMERA", conflicts_with = "model")]
    fixed_intrinsics: Option<PathBuf>,
    /// Keep every N-th view out of the calibration and tell the error there
    #[arg(long, value_name = "N", conflicts_with = "fixed_intrinsics",
          value_parser = clap::value_parser!(u32).range(2..))]
    holdout: Option<u32>,
    /// How corners far off their prediction count
    #[arg(long, default_value = "huber")]
    robust: Robust,
    /// How corners are weighted
    #[arg(long, default_value = "covariance")]
    weights: Weighting,
    /// The camera file, .yaml, or a folder for camera.yaml; what belongs to it is written beside it
    #[arg(short, long, value_name = "FILE", default_value = "camera.yaml")]
    output: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
enum Robust {
    /// Least squares: every corner counts in full
    None,
    /// Beyond three standard deviations with a constant force
    Huber,
    /// Beyond three standard deviations hardly
    Cauchy,
}

#[derive(Clone, Copy, ValueEnum)]
enum Weighting {
    /// All corners alike
    Equal,
    /// By the detections' covariances, with a common deviation found beside them
    Covariance,
}

/// Calibrates and writes the camera.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let path = output::file(&args.output, "camera", "yaml")?;
    let Sightings { views, panels, empty } = args.sightings.read()?;
    if empty > 0 {
        eprintln!("{empty} pictures show no board");
    }
    let loss = match args.robust {
        Robust::None => Loss::Squared,
        Robust::Huber => Loss::Huber,
        Robust::Cauchy => Loss::Cauchy,
    };
    let weights = match args.weights {
        Weighting::Equal => Weights::Equal,
        Weighting::Covariance => Weights::Covariance,
    };
    let (solution, name) = match (&args.fixed_intrinsics, args.model) {
        (Some(camera), _) => {
            let show = || format!("--fixed-intrinsics: {}", camera.display());
            let text = std::fs::read_to_string(camera).with_context(show)?;
            let camera = Camera::from_yaml(&text).with_context(show)?;
            (calibrate::poses(&views, &panels, &camera, loss, weights)?, "fixed".to_owned())
        }
        (None, Some(model)) => {
            let options = Options { model, loss, weights };
            (calibrate::calibrate(&views, &panels, options)?, model.to_string())
        }
        (None, None) => unreachable!("clap requires one"),
    };
    output::write(&path, solution.camera.to_yaml().as_bytes())?;
    let json = calibration::write(&solution, &name);
    output::write(&path.with_extension("json"), json.as_bytes())?;
    say!("{}", table(&solution));
    Ok(ExitCode::SUCCESS)
}

fn table(solution: &Solution) -> String {
    let mut text = String::new();
    for p in &solution.parameters {
        text += &format!("{:6} {:>14.6}", p.name, p.value);
        if let Some(sd) = p.sd {
            text += &format!(" ± {sd:.6}");
        }
        text.push('\n');
    }
    text += &format!(
        "rms {:.4} px, sigma {:.4}, common {:?}, {} views, steps {}\n",
        solution.rms_px,
        solution.sigma,
        solution.common_px,
        solution.views.len(),
        solution.steps
    );
    for (n, w) in &solution.excluded {
        text += &format!("{n}: {w}\n");
    }
    text
}
