//! `deltille rig`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, anyhow, bail};
use clap::ValueEnum;

use super::calibrate::{Robust, Weighting, without_outliers};
use super::files::{File, same_file, text_file, write_all};
use super::limits::FileLimits;
use super::sightings::SheetArgs;
use super::{camera_file, sightings, target_file};
use crate::calibrate::{
    Excluded, Model, PanelPlace, Reference, RigOptions, RigSolution, RigViews, calibrate_rig,
    wrong_cameras,
};
use crate::camera::{Camera, Pose};
use crate::cli::output::{Overwrite, check_folder, fixed, say, tell};
use crate::export::camera::{colmap, colmap_rig, kalibr};
use crate::export::rig;
use crate::report::{Named, cannot_tell_apart, causes_of_rig};
use crate::targets::Name;
use crate::words::{counted, shown};

/// Arguments of `deltille rig`.
#[derive(clap::Args)]
pub struct Args {
    /// A camera and the folder of its detections, such as left=corners/left; once for each, the
    /// first is the rig's frame. Pictures of one moment have the same file name in each folder
    #[arg(long, required = true, value_name = "NAME=FOLDER", value_parser = named)]
    camera: Vec<(String, PathBuf)>,
    /// Description of the target: the .json that was written with it
    #[arg(long, value_name = "FILE")]
    target: PathBuf,
    /// What is to be found of each camera, see `deltille calibrate`
    #[arg(long, default_value = "radtan")]
    model: Model,
    /// A camera that is known already and kept, with its file
    #[arg(long, value_name = "NAME=FILE", value_parser = named)]
    known: Vec<(String, PathBuf)>,
    #[command(flatten)]
    sheet: SheetArgs,
    /// Find where the target's panels are on it, and write that as <target>-refined.json
    #[arg(long, conflicts_with = "print_scale")]
    refine_target: bool,
    /// How corners far off their prediction count
    #[arg(long, default_value = "huber")]
    robust: Robust,
    /// How corners are weighted
    #[arg(long, default_value = "covariance")]
    weights: Weighting,
    /// What to write beside rig.json and <camera>.yaml; several may be given, separated by commas
    #[arg(long, value_delimiter = ',')]
    format: Vec<Format>,
    /// Folder for rig.json, <camera>.yaml and the refined target
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    limits: FileLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// camchain.yaml
    Kalibr,
    /// cameras.txt and rig_config.json
    Colmap,
}

fn named(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, path)) if !path.is_empty() => {
            Name::new(name).map(|name| (name.to_string(), path.into()))
        }
        _ => Err("give a name and a path, such as left=corners/left".to_owned()),
    }
}

/// Calibrates a rig and writes it.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    if args.camera.len() < 2 {
        bail!("--camera: a rig has at least two; `deltille calibrate` takes one");
    }
    let mut names: Vec<&str> = args.camera.iter().map(|(name, _)| name.as_str()).collect();
    names.sort_unstable();
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        bail!("--camera: {} is named twice", twice[0]);
    }
    let bad = |name: &str| name.contains(['/', '\\']) || name.starts_with('.') || name == "rig";
    if let Some(name) = names.iter().find(|name| bad(name)) {
        bail!("--camera: {name} cannot be the name of a file");
    }
    let mut known: Vec<&str> = args.known.iter().map(|(name, _)| name.as_str()).collect();
    known.sort_unstable();
    if let Some(twice) = known.windows(2).find(|pair| pair[0] == pair[1]) {
        bail!("--known: {} has two files", twice[0]);
    }
    check_folders(&args.camera)?;
    check_folder(&args.output).context("-o")?;
    let limits = args.limits.limits();
    let target = target_file::read(&args.target, &limits).context("--target")?;
    let reference = Reference::Target(&target);
    let sheet = args.sheet.read(&limits)?;
    let scale = sightings::solid_scale(&sheet, &target)?;
    let mut cameras = Vec::with_capacity(args.camera.len());
    let mut left_out: Vec<Excluded> = Vec::new();
    for (name, folder) in &args.camera {
        let read = sightings::read(std::slice::from_ref(folder), &reference, &limits);
        let sightings::Read { mut views, left_out: out, .. } =
            read.with_context(|| format!("--camera {name}"))?;
        sightings::put_on(&sheet, Some(&target), &mut views)?;
        let of_camera = |out| Excluded { camera: Some(name.clone()), ..out };
        left_out.extend(out.into_iter().map(of_camera));
        cameras.push(RigViews { name: name.clone(), views, known: args.known(name)? });
    }
    if let Some((name, _)) = args.known.iter().find(|(name, _)| !names.contains(&name.as_str())) {
        bail!("--known: there is no --camera {name}");
    }
    let mut panels: Vec<PanelPlace> =
        target.panels.iter().map(|panel| (&panel.pose).into()).collect();
    panels.iter_mut().for_each(|panel| panel.target_from_panel.translation *= scale);
    let options = RigOptions {
        model: args.model,
        loss: args.robust.into(),
        weights: args.weights.into(),
        refine_target: args.refine_target,
    };
    let wrong = wrong_cameras(&cameras, &panels, options);
    let of_wrong = wrong.iter().map(|&camera| cameras[camera].name.as_str());
    let of_wrong: Vec<&str> = of_wrong.collect();
    let mut solution =
        calibrate_rig(&cameras, &panels, options).map_err(|error| match of_wrong.as_slice() {
            [] => anyhow!(error),
            names => anyhow!(error).context(format!(
                "--known: the camera given for {} did not take its pictures",
                names.join(", ")
            )),
        })?;
    for camera in &solution.cameras {
        if let Some(end) = &camera.lens_end {
            tell!("warning: camera {}: {end}", camera.name);
        }
    }
    let names: Vec<&str> = solution.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let named = Named { cameras: &names };
    for finding in &solution.findings {
        tell!("warning: {}", named.sentence(finding));
    }
    let is_given = |name: &str| args.known.iter().any(|(known, _)| known == name);
    for cause in causes_of_rig(&solution, args.model, is_given, &wrong, args.refine_target) {
        tell!("warning: {cause}");
    }
    if !solution.loose.is_empty() {
        tell!("warning: {}", cannot_tell_apart(&solution.loose, None));
    }
    let text = summary(&solution);
    solution.excluded.splice(0..0, left_out);
    let mut files =
        vec![text_file("rig.json".to_owned(), rig::write(&solution, &args.model.to_string()))];
    for camera in &solution.cameras {
        files.push(text_file(format!("{}.yaml", camera.name), camera.camera.to_yaml()));
    }
    for format in &args.format {
        files.extend(format.files(&solution).context("--format")?);
    }
    if args.refine_target {
        let refined = solution.refined(&target);
        let place = args.output.join(format!("{}.json", refined.name));
        if same_file(&place, &args.target) {
            bail!(
                "-o: {} would overwrite the target that was given: choose another folder",
                place.display()
            );
        }
        files.push(text_file(format!("{}.json", refined.name), refined.to_json()));
    }
    let written = write_all(&args.output, &files, args.overwrite)?;
    for line in text.lines() {
        say!("{line}");
    }
    for path in written {
        say!("wrote {}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}

/// Refuses a folder that is given for two cameras.
fn check_folders(cameras: &[(String, PathBuf)]) -> anyhow::Result<()> {
    let mut places: Vec<(PathBuf, &str)> = Vec::new();
    for (name, folder) in cameras {
        // What is not there is told where it is read.
        let Ok(place) = folder.canonicalize() else { continue };
        if let Some((_, other)) = places.iter().find(|(there, _)| *there == place) {
            bail!("--camera: {other} and {name} have the same folder, {}", folder.display());
        }
        places.push((place, name));
    }
    Ok(())
}

impl Args {
    fn known(&self, name: &str) -> anyhow::Result<Option<Camera>> {
        let known = self.known.iter().find(|(known, _)| known == name);
        known.map(|(_, path)| camera_file::read("--known", path)).transpose()
    }
}

impl Format {
    fn files(self, solution: &RigSolution) -> anyhow::Result<Vec<File>> {
        let cameras = solution.cameras.iter();
        let cameras: Vec<(&str, &Camera, Pose)> =
            cameras.map(|c| (c.name.as_str(), &c.camera, c.camera_from_rig)).collect();
        let alone: Vec<&Camera> = cameras.iter().map(|(_, camera, _)| *camera).collect();
        let placed: Vec<(&Camera, Pose)> = cameras.iter().map(|(_, c, pose)| (*c, *pose)).collect();
        Ok(match self {
            Self::Kalibr => vec![text_file("camchain.yaml".to_owned(), kalibr(&placed)?)],
            Self::Colmap => vec![
                text_file("cameras.txt".to_owned(), colmap(&alone)?),
                text_file("rig_config.json".to_owned(), colmap_rig(&cameras)?),
            ],
        })
    }
}

fn summary(solution: &RigSolution) -> String {
    let mut text = format!(
        "{}, {}, rms {:.4} px{}\n",
        counted(solution.cameras.len(), "camera"),
        counted(solution.frames.len(), "frame"),
        solution.rms_px,
        without_outliers(solution.outlier_count(), solution.inlier_rms_px())
    );
    for camera in &solution.cameras {
        let [fx, fy] = camera.camera.focal_px;
        let at = camera.camera_from_rig.inverse().translation;
        text += &format!(
            "{}: {} corners, rms {:.4} px{}, fx {fx:.2}, fy {fy:.2}; at ({}) mm",
            camera.name,
            camera.corners,
            camera.rms_px,
            without_outliers(camera.outliers, camera.inlier_rms_px),
            at.to_array().map(|mm| fixed(mm, 2)).join(", ")
        );
        if let Some(sd) = camera.pose_sd {
            let largest = |sd: &[f64]| sd.iter().copied().fold(0.0, f64::max);
            text +=
                &format!(" ± {:.3} mm, {:.4}°", largest(&sd[3..]), largest(&sd[..3]).to_degrees());
        }
        text.push('\n');
    }
    for out in &solution.excluded {
        text += &shown(&format!("left out {}: {}", out.shown(), out.reason));
        text.push('\n');
    }
    text.trim_end().to_owned()
}
