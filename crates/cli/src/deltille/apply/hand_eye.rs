//! `deltille handeye`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, ensure};

use crate::deltille::calibrate::sightings::{Sightings, SightingsArgs};
use crate::deltille::calibrate::solving::print_diagnoses;
use crate::deltille::files::camera_file;
use crate::interrupt;
use crate::output::{self, Overwrite, log, report};
use crate::run::FAILED;
use deltille::calibrate::{
    CameraEstimate, Contradiction, Diagnosis, HandEye, HandEyeRequest, Intrinsics, Messages, Model,
    Mounting, RobotNoise,
};
use deltille::camera::Pose;
use deltille::export::kind::Kind;
use deltille::export::{hand_eye, saved};
use deltille::limits::Limits;
use deltille::robot_poses;
use deltille::targets::{TargetIdentity, parse_length_mm};
use deltille_core::words::{counted, places, shown};

/// Arguments of `deltille handeye`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    sightings: SightingsArgs,
    /// Poses of the robot's flange in its base: CSV with named columns, JSON, TUM, or ROS messages as text
    #[arg(long, value_name = "FILE")]
    robot: PathBuf,
    /// The camera is fixed to the base, and the board is on the flange [default: eye-in-hand]
    #[arg(long)]
    eye_to_hand: bool,
    /// The poses are flange_from_base, the inverse of what robots report
    #[arg(long)]
    inverse_poses: bool,
    /// Calibrated camera: the .json of `deltille calibrate`, whose uncertainties count, or a camera file
    /// [default: calibrate it from the same photographs]
    #[arg(long, value_name = "CAMERA", conflicts_with = "model")]
    camera: Option<PathBuf>,
    /// Model of a camera that is calibrated from the same photographs
    #[arg(long, default_value = "radtan")]
    model: Model,
    /// Known standard deviations of the robot's rotation and translation per axis, such as 0.02deg,0.1mm
    /// [default: estimated]
    #[arg(long, value_name = "ANGLE,LENGTH", value_parser = noise)]
    robot_noise: Option<RobotNoise>,
    /// Also estimate a scale of the robot's translations
    #[arg(long)]
    scale: bool,
    /// Result
    #[arg(short, long, value_name = "FILE.json", default_value = "handeye.json")]
    output: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
}

fn noise(text: &str) -> Result<RobotNoise, String> {
    let wrong = || "expected an angle in degrees and a length, such as 0.02deg,0.1mm".to_owned();
    let (angle, length) = text.split_once(',').ok_or_else(wrong)?;
    let angle = angle.trim().strip_suffix("deg").and_then(|angle| angle.trim().parse::<f64>().ok());
    let rotation_rad = angle.ok_or_else(wrong)?.to_radians();
    let translation_mm = parse_length_mm(length.trim()).map_err(|error| error.to_string())?;
    let noise = RobotNoise { rotation_rad, translation_mm };
    match noise.is_valid() {
        true => Ok(noise),
        false => Err("expected 0.0001deg to 57deg, and 0.001mm to 1000mm".to_owned()),
    }
}

/// Locates camera and board on the robot.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let path = output::file(&args.output, "handeye", "json")?;
    args.overwrite.check(&path, &Kind::of_schema(hand_eye::SCHEMA))?;
    let mut robot = robot_poses::read(&args.robot, &Limits::default()).context("--robot")?;
    robot.are_inverse |= args.inverse_poses;
    let known = args.camera.as_deref().map(known).transpose()?;
    let (intrinsics, earlier) = match &known {
        Some((camera, _)) => (Intrinsics::Known(camera.camera.clone()), Some(camera.clone())),
        None => (Intrinsics::Unknown(args.model), None),
    };
    let Sightings { calibration, views, printed, detections, unnamed, .. } =
        args.sightings.read(&intrinsics, false, false)?;
    ensure!(printed.len() < 2, "--target: give the one target that is mounted");
    if let (Some(path), Some((_, with)), [printing]) = (&args.camera, &known, &printed[..]) {
        let targets = std::slice::from_ref(&printing.target);
        camera_file::check_or_note(path, with, targets, args.sightings.assumes_target())?;
    }
    let mounting = if args.eye_to_hand { Mounting::EyeToHand } else { Mounting::EyeInHand };
    let (noise, scale) = (args.robot_noise, args.scale);
    let request = HandEyeRequest { robot, mounting, noise, scale, earlier };
    let calibration = calibration.camera("camera", views, intrinsics);
    let found = calibration.hand_eye(&request, &detections)?;
    unnamed.iter().for_each(|note| log!("{note}"));
    if let (Some(path), Some(camera)) = (&args.camera, &request.earlier)
        && camera.covariance.rows() == 0
    {
        log!(
            "note: {} has no uncertainties, so those of the result assume an exact camera; pass the .json of \
             `deltille calibrate`",
            path.display()
        );
    }
    for out in &found.cameras.excluded {
        log!("{}: excluded: {}", out.view, out.reason);
    }
    print_warnings(&found);
    output::write(&path, hand_eye::write(&found).as_bytes(), args.overwrite)?;
    output::print(&describe(&found))?;
    report!("{}", output::wrote(&path));
    if interrupt::has_ended_input() {
        return Ok(ExitCode::from(interrupt::exit_code()));
    }
    Ok(match found.diagnoses.iter().any(Diagnosis::is_failure) {
        true => ExitCode::from(FAILED),
        false => ExitCode::SUCCESS,
    })
}

/// Reads a known camera, with its uncertainties if the file has them.
fn known(path: &Path) -> anyhow::Result<(CameraEstimate, Vec<TargetIdentity>)> {
    let is_json = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("json"));
    if !is_json {
        let file = camera_file::read_to_keep("--camera", path)?;
        return Ok((CameraEstimate::given("camera", file.camera), file.calibrated_with));
    }
    let text = Limits::default().read_text(path).context("--camera")?;
    let shown = || format!("--camera: {}", path.display());
    let before = saved::read_without_target(&text).with_context(shown)?;
    if let Some(failed) = saved::failures(&text).first() {
        anyhow::bail!("{}: the calibration failed: {failed}; calibrate the camera again", shown());
    }
    let mut cameras = before.cameras.into_iter();
    let only = cameras.next().filter(|_| cameras.next().is_none());
    ensure!(only.is_some(), "{}: this is a rig; pass the file of one camera", shown());
    Ok((only.context("no camera")?, before.calibrated_with))
}

fn print_warnings(found: &HandEye) {
    print_diagnoses(&Messages::new(&found.cameras, None), &found.diagnoses);
    for contradiction in &found.contradictions {
        log!(
            "warning: {contradiction} ({})",
            match contradiction {
                Contradiction::Scale { .. } => "--scale",
                _ => "--robot-noise",
            }
        );
    }
    let wrong: Vec<_> = found.wrong().collect();
    if found.blames_camera() && !wrong.is_empty() {
        let count = counted(wrong.len(), "pose");
        log!("warning: {count} of the robot not used, which may fit the right camera");
    } else {
        for view in wrong {
            log!(
                "warning: {}: the robot's pose is {:.2}° and {:.2} mm off; not used",
                view.name,
                view.rotation_rad.length().to_degrees(),
                view.translation_mm.length()
            );
        }
    }
    found.few_views().iter().for_each(|said| log!("warning: {said}"));
    if !found.unpaired.is_empty() {
        let (count, first) = (counted(found.unpaired.len(), "photograph"), &found.unpaired[0]);
        log!("warning: {count} without a pose of the robot, such as {first}");
    }
    if found.spare_poses > 0 {
        log!("note: {} without a photograph", counted(found.spare_poses, "pose"));
    }
}

/// Describes the result in a few lines.
fn describe(found: &HandEye) -> String {
    let mut text = String::new();
    let digits = |view: &deltille::calibrate::HandEyeView| {
        let angle = view.rotation_rad.length().to_degrees();
        format!("{angle:9.4} {:9.3}", view.translation_mm.length())
    };
    // Writing to a String cannot fail.
    let _ = writeln!(text, "view              RMS px  robot px  off (°)  off (mm)");
    for view in &found.views {
        let name = shown(&view.name);
        let note = if view.is_used { "" } else { "  not used" };
        let (own, robot) = (view.rms_px, view.robot_rms_px);
        let _ = writeln!(text, "{name:16} {own:7.4} {robot:9.3} {}{note}", digits(view));
    }
    let [camera, board] = hand_eye::names(found.mounting);
    let [camera_sd, board_sd] = found.pose_sd();
    text += &of_pose(&camera, &found.mount_from_camera, camera_sd);
    text += &of_pose(&board, &found.ground_from_board, board_sd);
    if let Some(sd) = found.scale_sd() {
        let _ = writeln!(text, "scale of translations {:.6} ± {sd:.6}", found.scale);
    }
    let origin = match found.noise_freedom {
        Some([rotation, translation]) => {
            format!("estimated with {rotation:.0} and {translation:.0} degrees of freedom")
        }
        None => "given".to_owned(),
    };
    let _ = writeln!(
        text,
        "robot: σ {:.4}° and {:.3} mm per axis, {origin}",
        found.noise.rotation_rad.to_degrees(),
        found.noise.translation_mm
    );
    let [most, second, _] = found.rotation_spread.map(|(rms, _)| rms.to_degrees());
    let _ = writeln!(
        text,
        "{}, {}, paired by {}, rotations {most:.0}° and {second:.0}° RMS about two axes, RMS {:.4} px per axis",
        found.mounting,
        counted(found.used().count(), "view"),
        found.paired_by,
        found.rms_px
    );
    text
}

/// A pose with its standard deviations, and as a static transform of ROS.
fn of_pose(name: &str, pose: &Pose, sd: [f64; 6]) -> String {
    let [x, y, z] = pose.translation.to_array();
    let [.., sx, sy, sz] = sd;
    let n = places(sx.min(sy).min(sz)).max(1);
    let angles = [sd[0], sd[1], sd[2]].map(|sd| format!("{:.4}", sd.to_degrees()));
    let t = pose.translation / 1000.0;
    let q = pose.rotation;
    format!(
        "{name}: ({x:.n$}, {y:.n$}, {z:.n$}) ± ({sx:.n$}, {sy:.n$}, {sz:.n$}) mm, rotation ± ({}) °\n  \
         --x {:.6} --y {:.6} --z {:.6} --qx {:.7} --qy {:.7} --qz {:.7} --qw {:.7}\n",
        angles.join(", "),
        t.x,
        t.y,
        t.z,
        q.x,
        q.y,
        q.z,
        q.w
    )
}
