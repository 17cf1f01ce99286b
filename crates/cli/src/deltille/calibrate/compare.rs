//! `deltille compare`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, anyhow, ensure};
use glam::DVec2;

use crate::deltille::files::camera_file;
use crate::deltille::files::written::{File, check_places, sample_of, text_file, write_all};
use crate::output::{self, Overwrite, log, report};
use crate::run::{FAILED, UNDECIDED};
use crate::values::distance;
use deltille::calibrate::{
    CameraEstimate, CameraMotion, Comparison, Estimate, Region, Verdict, compare_boards,
};
use deltille::camera::Pose;
use deltille::export::{comparison, saved};
use deltille::limits::Limits;
use deltille::report::comparison_svg;
use deltille::targets::check_same_board;
use deltille_core::words::{counted, p_value, shown};

/// Arguments of `deltille compare`.
#[derive(clap::Args)]
pub struct Args {
    /// A calibration (the .json of `deltille calibrate` or `rig`), or a camera file, whose uncertainty is unknown
    #[arg(value_name = "FIRST")]
    first: PathBuf,
    /// Another calibration of the same camera or rig
    #[arg(value_name = "SECOND")]
    second: PathBuf,
    /// Distance of the points at which cameras are compared, such as 2m [default: infinity]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = distance)]
    distance: Option<f64>,
    /// Image region to compare: seen (where both calibrations have corners), image (the whole image), or pixels
    /// LEFT,TOP,RIGHT,BOTTOM
    #[arg(long, value_name = "PART", default_value = "seen", value_parser = region)]
    region: Region,
    /// Differences up to this RMS per axis in px do not cause exit code 1, even if significant
    #[arg(long, value_name = "PX", default_value_t = 0.0, value_parser = tolerance)]
    tolerance: f64,
    /// Write the comparison, and an .svg plot of each camera beside it
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    /// Compare even if the calibrations used boards with the same tags but different sizes
    #[arg(long)]
    assume_target: bool,
    #[command(flatten)]
    overwrite: Overwrite,
}

fn region(text: &str) -> Result<Region, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match (text, numbers.as_deref()) {
        ("seen", _) => Ok(Region::Seen),
        ("image", _) => Ok(Region::Image),
        (_, Some(&[left, top, right, bottom])) if left < right && top < bottom => {
            Ok(Region::Within(DVec2::new(left, top), DVec2::new(right, bottom)))
        }
        _ => Err("expected seen, image, or four pixels LEFT,TOP,RIGHT,BOTTOM".to_owned()),
    }
}

fn tolerance(text: &str) -> Result<f64, String> {
    let px = text.strip_suffix("px").unwrap_or(text).trim().parse::<f64>().ok();
    px.filter(|px| (0.0..=1e6).contains(px)).ok_or("expected px, such as 0.05".to_owned())
}

/// Compares two calibrations. The exit code is 1 if they differ by more than their uncertainties and the tolerance
/// explain, and 3 if uncertainties are missing.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let path = args.output.as_deref().map(|path| output::file(path, "comparison", "json"));
    let path = path.transpose()?;
    let (mut first, mut second) = (read("FIRST", &args.first)?, read("SECOND", &args.second)?);
    let [one, other] = [&args.first, &args.second].map(|path| path.display().to_string());
    if args.assume_target
        && check_same_board([&one, &other], [&first.calibrated_with, &second.calibrated_with])
            .is_err()
    {
        log!(
            "note: --assume-target: {one} and {other} were calibrated with different boards; comparing them unchanged"
        );
    }
    compare_boards([&one, &other], [&mut first, &mut second], args.assume_target)
        .map_err(|problem| anyhow!(problem))?;
    let pairs = pairs([&one, &other], [&first.cameras, &second.cameras])?;
    if let Some(path) = &path {
        let json = sample_of(comparison::SCHEMA);
        check_places(output::folder_of(path), &files(path, &pairs, &[], &json), args.overwrite)?;
    }
    let mut found = Vec::new();
    for (one, other) in &pairs {
        let compared = Comparison::of(one, other, args.distance, args.region);
        found.push(match one.name.as_str() {
            "" => compared?,
            name => compared.with_context(|| name.to_owned())?,
        });
    }
    let motions = CameraMotion::of_rig(&pairs);
    let mut text = String::new();
    for ((one, _), found) in pairs.iter().zip(&found) {
        text += &describe(one, found, args.tolerance);
    }
    for motion in &motions {
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{} relative to {}: rotated by {:.4}°, translated by {:.3} mm: {}",
            shown(&motion.to),
            shown(&motion.from),
            motion.rotation_rad.length().to_degrees(),
            motion.translation_mm.length(),
            match motion.why_undecided() {
                Some(why) => format!("cannot determine whether it has moved: {why}"),
                None => verdict(motion.p_value, motion.is_significant(), "it has moved"),
            }
        );
    }
    let mut written = Vec::new();
    if let Some(path) = &path {
        let names: Vec<&str> = pairs.iter().map(|(one, _)| one.name.as_str()).collect();
        let json = comparison::write(&names, &found, &motions);
        let files = files(path, &pairs, &found, &json);
        written = write_all(output::folder_of(path), &files, args.overwrite)?;
    }
    output::print(&text)?;
    for path in written {
        report!("{}", output::wrote(&path));
    }
    Ok(match Verdict::of(&found, &motions, args.tolerance) {
        Verdict::Changed => ExitCode::from(FAILED),
        Verdict::Undecided => ExitCode::from(UNDECIDED),
        _ => ExitCode::SUCCESS,
    })
}

/// Reads a calibration or rig, or the camera of a camera file.
fn read(option: &'static str, path: &Path) -> anyhow::Result<Estimate> {
    let is_json = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("json"));
    if !is_json {
        let file = camera_file::read_with_targets(option, path)?;
        let mut given = Estimate::default();
        given.cameras = vec![CameraEstimate::given("", file.camera)];
        given.calibrated_with = file.calibrated_with;
        return Ok(given);
    }
    let text = Limits::default().read_text(path).context(option)?;
    let found = saved::read_without_target(&text);
    let mut found = found.with_context(|| format!("{option}: {}", path.display()))?;
    // The uncertainties of a failed calibration are meaningless.
    if camera_file::warn_if_failed(path, &text).is_some() {
        found.cameras.iter_mut().for_each(CameraEstimate::forget_uncertainties);
    }
    Ok(found)
}

/// Pairs the cameras that both calibrations contain.
fn pairs<'a>(
    [first_path, second_path]: [&str; 2],
    [first, second]: [&'a [CameraEstimate]; 2],
) -> anyhow::Result<Vec<(&'a CameraEstimate, &'a CameraEstimate)>> {
    if let ([one], [other]) = (first, second) {
        return Ok(vec![(one, other)]);
    }
    let same = |one: &'a CameraEstimate| {
        second.iter().find(|other| other.name == one.name).map(|other| (one, other))
    };
    let pairs: Vec<_> = first.iter().filter_map(same).collect();
    let names = |of: &[CameraEstimate]| match of {
        [only] if only.name.is_empty() => "an unnamed camera".to_owned(),
        all => all.iter().map(|camera| shown(&camera.name)).collect::<Vec<_>>().join(", "),
    };
    ensure!(
        !pairs.is_empty(),
        "no camera is in both calibrations: {first_path} has {}, {second_path} has {}; compare two calibrations of the same rig or \
         of the same camera",
        names(first),
        names(second)
    );
    Ok(pairs)
}

/// Returns the comparison, and a plot of each compared camera.
fn files(
    path: &Path,
    pairs: &[(&CameraEstimate, &CameraEstimate)],
    found: &[Comparison],
    json: &str,
) -> Vec<File> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut files = vec![text_file(format!("{stem}.json"), json.to_owned())];
    for (index, (camera, _)) in pairs.iter().enumerate() {
        let name = match camera.name.as_str() {
            "" => format!("{stem}.svg"),
            name => format!("{stem}-{name}.svg"),
        };
        let size_px = [camera.camera.width, camera.camera.height];
        // An empty plot is a placeholder for the checks before the computation.
        let nothing = Comparison::default();
        let found = found.get(index).unwrap_or(&nothing);
        files.push(text_file(name, comparison_svg(size_px, found)));
    }
    files
}

/// Describes how two cameras differ.
fn describe(camera: &CameraEstimate, found: &Comparison, tolerance: f64) -> String {
    let name = match camera.name.as_str() {
        "" => String::new(),
        name => format!("{}: ", shown(name)),
    };
    let far = found.distance_mm.map_or("infinity".to_owned(), |mm| format!("{mm:.0} mm"));
    let [turn, moved] = found.second_from_first.off(&Pose::IDENTITY);
    let moved = match found.distance_mm {
        Some(_) => format!(" and translated by {:.3} mm", moved.length()),
        None => String::new(),
    };
    let meaning = match found.rms_px <= tolerance {
        true => format!("within the tolerance of {tolerance} px"),
        false => {
            "the camera has changed, or the model or the board does not fit in one of the calibrations".to_owned()
        }
    };
    let verdict_of = |found: &Comparison| Verdict::of(std::slice::from_ref(found), &[], tolerance);
    let expected = match (found.expected_px, found.why_undecided()) {
        (Some(px), _) => format!(
            "{name}expected from both uncertainties: {px:.4} px: {}\n",
            verdict(found.p_value, found.is_significant(), &meaning)
        ),
        (None, _) if verdict_of(found) == Verdict::Same && tolerance > 0.0 => {
            format!("{name}{meaning}\n")
        }
        (None, _) if verdict_of(found) == Verdict::Same => format!("{name}both are identical\n"),
        (None, why) => {
            let advice = match found.lacks_uncertainty {
                [false, false] => "use a larger --region",
                _ => {
                    "use the .json of `deltille calibrate` or `rig`, which contains them unless the camera was fixed or the calibration failed"
                }
            };
            format!(
                "{name}cannot determine whether the camera has changed: {}; {advice}, or set --tolerance\n",
                why.unwrap_or_default()
            )
        }
    };
    format!(
        "{name}difference {:.4} px (RMS per axis), at most {:.4} px, over {} at {far}, after a rotation by \
         {:.4}°{moved}\n{expected}",
        found.rms_px,
        found.largest_px(),
        counted(found.compared().count(), "point"),
        turn.length().to_degrees()
    )
}

/// States whether a difference is significant.
fn verdict(probability: Option<f64>, is_significant: Option<bool>, changed: &str) -> String {
    match (probability, is_significant) {
        (Some(probability), Some(true)) => {
            format!("significant ({}): {changed}", p_value(probability))
        }
        (Some(probability), _) => format!("not significant ({})", p_value(probability)),
        (None, _) => String::new(),
    }
}
