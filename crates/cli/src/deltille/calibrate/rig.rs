//! `deltille rig`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, anyhow, bail, ensure};

use super::compensation::{self, AllFrames, Times, prepare, times_ns};
use super::detection_files::is_same;
use super::filming::{self, Given};
use super::report_page::{Outputs, check_images, note_missing};
use super::rig_cameras::{CamerasArgs, Source, check_named, follow, named};
use super::sightings::{self, GridArgs, SheetArgs, check_every};
use super::solving::{
    Calibrated, ModelChoice, SolveArgs, chosen, pose_uncertainty, projection_uncertainty, richest,
    sample, with_constraints, within, without_outliers,
};
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::written::{
    File, check_places, keep_inputs, same_file, sample_of, text_file,
};
use crate::deltille::files::{camera_file, target_file};
use crate::output::{self, Overwrite, fixed, log, say};
use crate::run::{FAILED, report};
use crate::values::format;
use deltille::calibrate::{
    Calibration, CameraEstimate, CameraViews, Estimate, Excluded, Intrinsics, Model,
    PoseUncertainty, Reference, TargetMap, View,
};
use deltille::camera::{Camera, CameraFile, Pose};
use deltille::detect::{Detection, InkEstimate};
use deltille::export::calibration::Print;
use deltille::export::camera::FormatError;
use deltille::export::sheet::Sheet;
use deltille::export::{RIG_FORMATS, RigFile, RigFormat, rig, saved};
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::report::target_map_svg;
use deltille::targets::Target;
use deltille_core::words::counted;

/// Arguments of `deltille rig`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    cameras: CamerasArgs,
    /// Target description: the .json written with the target; repeatable for several targets that do not move
    /// relative to each other (no camera needs to see more than one)
    #[arg(long, required_unless_present = "grid", value_name = "FILE")]
    target: Vec<PathBuf>,
    /// Family file, if the target uses a family that does not ship with the program
    #[arg(long, requires = "target")]
    family: Option<String>,
    #[command(flatten)]
    grid: GridArgs,
    /// Camera model of every camera, see `deltille calibrate`
    #[arg(long, default_value = "auto")]
    model: ModelChoice,
    /// Camera with known, fixed intrinsics, and its file
    #[arg(long, value_name = "NAME=FILE", value_parser = named)]
    known: Vec<(String, PathBuf)>,
    /// Keep the relative poses of the cameras as in this rig, the .json of an earlier calibration; those of cameras that it does
    /// not have are estimated
    #[arg(long, value_name = "RIG.json")]
    known_poses: Option<PathBuf>,
    /// Use --target even if the detections or the camera files refer to another target
    #[arg(long)]
    assume_target: bool,
    #[command(flatten)]
    sheet: SheetArgs,
    /// Also estimate the poses of the target's panels, and write them as <target>-refined.json
    #[arg(long, conflicts_with_all = ["print_scale", "measured", "grid"])]
    refine_target: bool,
    #[command(flatten)]
    solve: SolveArgs,
    /// Camera and the folder of its photographs, for thumbnails in the report
    #[arg(long, value_name = "NAME=FOLDER", value_parser = named, requires = "report")]
    images: Vec<(String, PathBuf)>,
    /// Output formats in addition to rig.json and <camera>.yaml, separated by commas. For stereo in ROS and OpenCV, `deltille
    /// rectify` writes R and P of both cameras
    #[arg(long, value_delimiter = ',', value_parser = format(RIG_FORMATS))]
    format: Vec<&'static RigFormat>,
    /// Output folder for rig.json, <camera>.yaml and the refined target; or another name of rig.json, such as stereo.json
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    /// Stem of rig.json.
    #[arg(skip = "rig")]
    stem: String,
    #[command(flatten)]
    limits: ImageLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Calibrates a rig and writes it.
pub fn run(mut args: Args) -> anyhow::Result<ExitCode> {
    let place = output::place(&args.output, &["json"])?;
    args.output = place.folder;
    args.stem = place.file.map_or(args.stem, |file| file.stem);
    let sources = args.cameras.sources(&[], args.refine_target)?;
    let names: Vec<&str> = sources.iter().map(|source| source.name.as_str()).collect();
    args.check_names(&names)?;
    let limits = args.limits.limits();
    let (mut printed, grid) = args.grid.or_targets(&args.target, &limits)?;
    target_file::set_given_family(&mut printed, args.family.as_deref())?;
    let targets: Vec<Target> = printed.iter().map(|one| one.target.clone()).collect();
    let reference = sightings::reference(grid, &targets);
    let sheet = args.sheet.read(&limits, &reference.identities(), &printed)?;
    let panels = sightings::panels(&reference, &sheet)?;
    let candidates = args.candidates(&names);
    let cameras = names.iter().map(|name| args.intrinsics(name, &targets, &candidates));
    let cameras = cameras.collect::<anyhow::Result<Vec<Intrinsics>>>()?;
    let known_poses = args.known_poses(&names)?;
    args.solve.constraints.check_cameras(&names)?;
    for (name, intrinsics) in names.iter().zip(&cameras) {
        let checked = args.solve.constraints.check(name, intrinsics, &candidates);
        checked.with_context(|| format!("camera {name}"))?;
    }
    args.check_files(&names, &cameras, &printed)?;
    let outputs = Outputs::of(&args.solve, &args.output, &args.stem, &args.target, args.overwrite)?;
    let given = args.given(&sources, &reference, &cameras, &limits)?;
    let mut seen = Seen::default();
    let mut calibration = Calibration::of(&reference, panels).refine_panels(args.refine_target);
    for ((source, given), intrinsics) in sources.iter().zip(given).zip(cameras) {
        let views = args.views(source, given, &reference, &sheet, &mut seen)?;
        let constraints = args.solve.constraints.of(&source.name, &intrinsics);
        let camera_from_rig = known_poses.get(&source.name).copied();
        let camera = CameraViews::new(&source.name, views, intrinsics);
        calibration = calibration.with(CameraViews { constraints, camera_from_rig, ..camera });
    }
    let Seen { detections, left_out, ink, times_ns } = seen;
    let frames = args.solve.estimate_timing.then(|| AllFrames {
        times_ns,
        most: args.cameras.views.unwrap_or(filming::VIEWS) as usize,
    });
    let options: Vec<String> = sources.iter().map(|source| source.option.clone()).collect();
    let prepared = prepare(&mut calibration, args.model, &candidates, &options, frames.as_ref())?;
    let listed = names.iter().zip(&prepared.tried).filter(|(_, tried)| !tried.is_empty());
    let listed = listed.map(|(name, tried)| format!("{name}:\n{}", chosen(tried)));
    let mut text = listed.collect::<String>() + &prepared.describe();
    let timing = prepared.file(&args.stem);
    let print = Print { scale: sheet.print_scale, ink: InkEstimate::of_all(&ink) };
    let mut solved = args.solve.solve(calibration, print, prepared.tried)?;
    for (index, (_, detections)) in detections.iter().enumerate() {
        solved.add_notes(index, detections);
    }
    let detections = detections.iter().flat_map(|(_, detections)| detections);
    if let (Some(note), false) = (sightings::unnamed(detections, &reference), args.assume_target) {
        log!("{note}");
    }
    for out in solved.excluded() {
        log!("{}: excluded: {}", out.shown(), out.reason);
    }
    if let Err(foreign) = solved.print_diagnoses() {
        report(&foreign.context("--known"));
        return Ok(ExitCode::from(FAILED));
    }
    let poses = solved.estimate.pose_uncertainties(&targets);
    text += &summary(&solved, &poses);
    solved.estimate.excluded.splice(0..0, left_out);
    let (mut files, refused) = args.files_of(&solved, &poses, &printed)?;
    files.extend(timing);
    let folders: Vec<_> = names.iter().map(|name| of_name(&args.images, name)).collect();
    let written = outputs.write(&solved, &files, &folders, &poses)?;
    for line in text.lines() {
        say!("{line}");
    }
    solved.end(&written, &refused)
}

/// What the images of all cameras show, except the views.
#[derive(Default)]
struct Seen<'a> {
    /// Names of the cameras, and their detections.
    detections: Vec<(&'a String, Vec<(String, Detection)>)>,
    left_out: Vec<Excluded>,
    ink: Vec<InkEstimate>,
    /// By camera, if all frames are used.
    times_ns: Vec<Times>,
}

impl Args {
    /// Rejects options for other cameras, and names of cameras or of the rig that are ambiguous.
    fn check_names(&self, names: &[&str]) -> anyhow::Result<()> {
        for (option, given) in [("--known", &self.known), ("--images", &self.images)] {
            check_named(option, given.iter().map(|(name, _)| name.as_str()), names)?;
        }
        check_images(self.images.iter().map(|(_, path)| path))?;
        ensure!(
            !names.contains(&self.stem.as_str()),
            "-o: {0}.json is not a file of the rig, because one of its cameras is called {0}; use another name",
            self.stem
        );
        Ok(())
    }

    /// Returns the views of a camera that are used, and adds everything else in its detections to `seen`.
    fn views<'a>(
        &self,
        Source { name, option, .. }: &'a Source,
        given: Given,
        reference: &Reference,
        sheet: &Sheet,
        seen: &mut Seen<'a>,
    ) -> anyhow::Result<Vec<View>> {
        let read = sightings::views_of(given, reference, self.assume_target);
        let read = read.and_then(sightings::shown).with_context(|| option.clone())?;
        let sightings::Read { mut views, left_out: foreign, ink, detections, .. } = read;
        check_own(option, &detections, &seen.detections)?;
        if self.solve.estimate_timing {
            let times_ns = times_ns(&detections).with_context(|| option.clone());
            seen.times_ns.push(times_ns.context("--estimate-timing")?);
        }
        seen.detections.push((name, detections));
        let mut left_out = sightings::take_known(&mut views, reference);
        if self.solve.measures_target() {
            left_out.extend(sightings::take_sure(&mut views, reference)?);
        }
        sightings::put_on(sheet, reference.targets().first(), &mut views)?;
        left_out.extend(foreign);
        let left_out = left_out.into_iter();
        seen.left_out.extend(left_out.map(|out| Excluded { camera: Some(name.clone()), ..out }));
        seen.ink.extend(ink);
        if let Some(folder) = of_name(&self.images, name) {
            note_missing(folder, &views);
        }
        Ok(views)
    }

    /// Returns the known poses of cameras relative to the first one, by name.
    fn known_poses(&self, names: &[&str]) -> anyhow::Result<BTreeMap<String, Pose>> {
        let Some(path) = &self.known_poses else { return Ok(BTreeMap::new()) };
        let known = camera_file::read_estimate("--known-poses", path)?;
        let of = |name: &str| known.cameras.iter().find(|camera| camera.name == name);
        let cameras: Vec<&CameraEstimate> = names.iter().filter_map(|name| of(name)).collect();
        let first = names.first().and_then(|name| of(name)).filter(|_| cameras.len() > 1);
        let first = first.with_context(|| {
            let all: Vec<&str> = known.cameras.iter().map(|of| of.name.as_str()).collect();
            format!(
                "--known-poses: {} needs {} and another of the cameras (its cameras: {})",
                path.display(),
                names.first().unwrap_or(&"a camera"),
                all.join(", ")
            )
        })?;
        let rig_from_first = first.camera_from_rig.inverse();
        let pose =
            |of: &&CameraEstimate| (of.name.clone(), of.camera_from_rig.after(&rig_from_first));
        Ok(cameras.iter().map(pose).collect())
    }

    /// Returns the intrinsics of a camera.
    fn intrinsics(
        &self,
        name: &str,
        targets: &[Target],
        candidates: &[Model],
    ) -> anyhow::Result<Intrinsics> {
        let known = of_name(&self.known, name)
            .map(|path| camera_file::read_to_keep("--known", path).map(|file| (path, file)));
        let known = known.transpose()?;
        if let Some((path, file)) = &known {
            let of_file = &file.calibrated_with;
            camera_file::check_or_note(path, of_file, targets, self.assume_target)?;
        }
        let known = known.map(|(_, file)| Intrinsics::Known(file.camera));
        Ok(known.unwrap_or(Intrinsics::Unknown(richest(candidates))))
    }

    /// Returns the detections of each camera.
    fn given(
        &self,
        sources: &[Source],
        reference: &Reference,
        cameras: &[Intrinsics],
        limits: &Limits,
    ) -> anyhow::Result<Vec<Given>> {
        if !self.solve.estimate_timing {
            return self.cameras.read(sources, reference, cameras, limits);
        }
        let given = match reference {
            Reference::Scene(_) => {
                Err(anyhow!("the path of one target is needed; give one --target"))
            }
            _ => check_every(self.cameras.every).and_then(|()| follow(sources, reference, limits)),
        };
        given.context("--estimate-timing")
    }

    /// Returns the models that are compared.
    fn candidates(&self, names: &[&str]) -> Vec<Model> {
        self.model.candidates(|camera| {
            let cameras: Vec<_> =
                names.iter().map(|&name| (name, camera, Pose::IDENTITY)).collect();
            let files = self.files(&cameras, &sample_of(rig::SCHEMA), &Estimate::default(), &[]);
            files.is_ok_and(|(_, refused)| refused.is_empty())
        })
    }

    /// Rejects files that could not be written, before the work starts.
    fn check_files(
        &self,
        names: &[&str],
        cameras: &[Intrinsics],
        printed: &[Printing],
    ) -> anyhow::Result<()> {
        let samples: Vec<Camera> = cameras.iter().map(sample).collect();
        let cameras = names.iter().zip(&samples);
        let cameras = cameras.map(|(&name, camera)| (name, camera, Pose::IDENTITY));
        let mut found = Estimate::default();
        found.map = self.solve.measures_target().then(|| TargetMap::new(Vec::new(), [0.0; 2]));
        let json = sample_of(rig::SCHEMA);
        let (mut files, _) = self.files(&cameras.collect::<Vec<_>>(), &json, &found, printed)?;
        files.extend(self.solve.estimate_timing.then(|| compensation::planned(&self.stem)));
        check_places(&self.output, &files, self.overwrite)?;
        keep_inputs(&self.output, &files, &self.target)
    }

    /// Returns all files of a calibrated rig, and errors for the formats that failed.
    fn files_of(
        &self,
        Calibrated { estimate, diagnoses, print, .. }: &Calibrated,
        poses: &[PoseUncertainty],
        printed: &[Printing],
    ) -> anyhow::Result<(Vec<File>, Vec<FormatError>)> {
        let residuals = self.solve.residuals();
        let json = rig::write(estimate, diagnoses, &self.model.name(), *print, residuals, poses);
        let cameras = estimate.cameras.iter();
        let cameras = cameras.map(|c| (c.name.as_str(), &c.camera, c.camera_from_rig));
        self.files(&cameras.collect::<Vec<_>>(), &json, estimate, printed)
    }

    /// Returns all files, and errors for the formats that failed; `json` is the complete result.
    fn files(
        &self,
        cameras: &[(&str, &Camera, Pose)],
        json: &str,
        found: &Estimate,
        printed: &[Printing],
    ) -> anyhow::Result<(Vec<File>, Vec<FormatError>)> {
        let mut refused = Vec::new();
        let mut files = vec![text_file(format!("{}.json", self.stem), json.to_owned())];
        let failed = saved::failures(json).into_iter().next();
        for (name, camera, _) in cameras {
            let camera = (*camera).clone();
            // A known camera was calibrated before.
            let is_known = of_name(&self.known, name).is_some();
            let calibrated_with = if is_known { Vec::new() } else { found.calibrated_with.clone() };
            let failed = failed.clone().filter(|_| !is_known);
            let yaml = CameraFile { camera, calibrated_with, failed }.to_yaml();
            let found = found.cameras.iter().find(|found| found.name == **name);
            files.push(text_file(format!("{name}.yaml"), with_constraints(&yaml, found)));
        }
        if failed.is_some() {
            // Only rig.json contains the reason for a failure.
            if !self.format.is_empty() || self.refine_target || found.map.is_some() {
                log!(
                    "warning: only {}.json and the cameras were written, because the calibration failed",
                    self.stem
                );
            }
            return Ok((files, refused));
        }
        let overlaps = found.overlaps();
        for format in &self.format {
            let text = |file: &RigFile| {
                let text = file.text(cameras, &overlaps)?;
                Ok(text_file(file.file.to_owned(), text))
            };
            match format.files.iter().map(text).collect::<Result<Vec<_>, _>>() {
                Ok(of_format) => files.extend(of_format),
                Err(error) => refused.push(error),
            }
        }
        for (index, printing) in printed.iter().enumerate() {
            files.extend(self.files_of_target(&found.of_target(index), printing)?);
        }
        Ok((files, refused))
    }

    /// Returns the estimated target, if requested.
    fn files_of_target(&self, found: &Estimate, printing: &Printing) -> anyhow::Result<Vec<File>> {
        let target = &printing.target;
        let refined = self.refine_target.then(|| found.refined(target));
        let measured = found.map.as_ref().map(|map| map.on(refined.as_ref().unwrap_or(target)));
        let end = if measured.is_some() { "-measured" } else { "" };
        let Some(target) = measured.or(refined) else { return Ok(Vec::new()) };
        let name = format!("{}{end}", target.name);
        let place = self.output.join(format!("{name}.json"));
        ensure!(
            !self.target.iter().any(|given| same_file(&place, given)),
            "-o: {} would overwrite the target description; use another folder",
            place.display()
        );
        let printing = Printing { target, ..printing.clone() };
        let file = text_file(format!("{name}.json"), printing.to_json());
        let drawn = found.map.as_ref().map(target_map_svg);
        let drawn = drawn.map(|svg| text_file(format!("{name}.svg"), svg));
        Ok([file].into_iter().chain(drawn).collect())
    }
}

/// Rejects images that also belong to another camera: two cameras never detect exactly the same
/// corners.
pub fn check_own(
    option: &str,
    detections: &[(String, Detection)],
    others: &[(&String, Vec<(String, Detection)>)],
) -> anyhow::Result<()> {
    for (other, theirs) in others {
        let is_theirs = |own: &&(String, Detection)| {
            theirs.iter().any(|(_, of_other)| is_same(&own.1, of_other))
        };
        if let Some((picture, _)) = detections.iter().find(is_theirs) {
            bail!("{option}: {picture} has the same corners as an image of {other}");
        }
    }
    Ok(())
}

/// Returns the path given for a camera.
fn of_name<'a>(given: &'a [(String, PathBuf)], name: &str) -> Option<&'a Path> {
    given.iter().find(|(of, _)| of == name).map(|(_, path)| path.as_path())
}

fn summary(solved: &Calibrated, poses: &[PoseUncertainty]) -> String {
    let estimate = &solved.estimate;
    let headline = |estimate: &Estimate| {
        format!(
            "{}, RMS {:.4} px{}",
            counted(estimate.frames.len(), "frame"),
            estimate.rms_px,
            without_outliers(estimate.outlier_count(), estimate.inlier_rms_px())
        )
    };
    let mut lines =
        vec![format!("{}, {}", counted(estimate.cameras.len(), "camera"), headline(estimate))];
    for camera in &estimate.cameras {
        let (fx, fy) = camera.camera.focal_px.into();
        let at = camera.camera_from_rig.inverse().translation;
        let deviation = camera.pose_sd.map_or(String::new(), |sd| within(&sd));
        lines.push(format!(
            "{}: {} corners, RMS {:.4} px{}, fx {fx:.2}, fy {fy:.2}; at ({}) mm{deviation}",
            camera.name,
            camera.corner_count(),
            camera.rms_px,
            without_outliers(camera.outlier_count(), camera.inlier_rms_px()),
            at.to_array().map(|mm| fixed(mm, 2)).join(", ")
        ));
        let constraints = camera.described_constraints();
        lines.extend(constraints.map(|said| format!("{}: constraints: {said}", camera.name)));
        lines.extend(projection_uncertainty(camera).map(|line| format!("{}: {line}", camera.name)));
    }
    for ([first, second], depth) in estimate.depth_uncertainties() {
        let [first, second] = [first, second].map(|index| &estimate.cameras[index].name);
        lines.push(format!(
            "{first} and {second}: triangulated distances at {:.0} mm: σ {:.4} mm from the calibration, and {:.3} mm for each \
             px of noise",
            depth.distance_mm, depth.sd_mm, depth.mm_per_px
        ));
    }
    lines.extend(pose_uncertainty(estimate, poses));
    lines.extend(solved.lines());
    lines.extend(estimate.held_out.iter().map(|test| format!("held out: {}", headline(test))));
    lines.join("\n")
}
