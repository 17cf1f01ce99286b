//! `deltille undistort` and `deltille rectify`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;
use std::sync::Mutex;

use anyhow::{Context, anyhow, bail, ensure};

use crate::deltille::files::images::{Images, RecordingArgs, Stems};
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::written::{
    File, Staged, bytes_file, check_places, same_file, sample_of, text_file,
};
use crate::deltille::files::{camera_file, images_at_once};
use crate::output::{self, Overwrite, Place, report, say};
use crate::run::{self, BAD_INPUT, FAILED, Interrupted};
use crate::values::distance;
use crate::{interrupt, progress};
use deltille::calibrate::{Estimate, Source, ViewUncertainty};
use deltille::camera::{Camera, CameraFile, Field, PixelMap, Rectification, Undistortion};
use deltille::export::camera::{opencv, ros};
use deltille::export::kind::{Kind, signed_png};
use deltille::export::{atomic, undistortion};
use deltille::frames::{Frame, FrameOptions, is_recording};
use deltille::remap::remapped;
use deltille_core::words::counted;

/// Options of the output views.
#[derive(clap::Args)]
struct ViewArgs {
    /// Field of view: inside (as large as possible without black pixels), whole (everything the camera sees, up to
    /// 150°), a horizontal angle such as 90deg, or a focal length such as 800px
    #[arg(long, value_name = "FIELD", default_value = "inside", value_parser = field)]
    field: Field,
    /// Width and height of the output images in px, such as 1280x960 [default: those of the camera]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Object distance for which the mapping is exact (model pupil only), such as 2m [default: infinity]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = distance)]
    distance: Option<f64>,
    /// Also write the remap tables for OpenCV's remap, as float32 arrays for NumPy
    #[arg(long)]
    maps: bool,
    /// Output folder; for the undistorted image of one photograph, also a file such as straight.png
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    limits: ImageLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Arguments of `deltille undistort`.
#[derive(clap::Args)]
pub struct Args {
    /// Photographs taken by the camera: files, folders, patterns, or - for a list on standard input; videos, MCAP files and bags,
    /// whose frames become grey. Without any, only the new camera and the remap tables are written
    #[arg(value_name = "IMAGES")]
    images: Vec<PathBuf>,
    #[command(flatten)]
    recording: RecordingArgs,
    /// Camera file of `deltille calibrate`, OpenCV, ROS, Kalibr (FILE:cam0), COLMAP (FILE:1) or mrcal; with the .json of `deltille
    /// calibrate`, the uncertainty of positions in the undistorted images is reported
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    #[command(flatten)]
    view: ViewArgs,
}

/// Arguments of `deltille rectify`.
#[derive(clap::Args)]
pub struct PairArgs {
    /// Rig file: the .json of `deltille rig`
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// Names of the two cameras, such as left,right
    #[arg(long, value_name = "NAME,NAME", value_parser = pair)]
    pair: [String; 2],
    /// Photographs of the first camera: files, folders or patterns
    #[arg(long, value_name = "IMAGES")]
    first: Vec<PathBuf>,
    /// Photographs of the second camera
    #[arg(long, value_name = "IMAGES")]
    second: Vec<PathBuf>,
    #[command(flatten)]
    view: ViewArgs,
}

fn field(text: &str) -> Result<Field, String> {
    let number = |end: &str| text.strip_suffix(end).map(f64::from_str).and_then(Result::ok);
    match (text, number("deg"), number("px")) {
        ("inside", ..) => Ok(Field::Inside),
        ("whole", ..) => Ok(Field::Whole),
        (_, Some(degrees), _) if degrees > 0.0 && degrees < 180.0 => {
            Ok(Field::Horizontal(degrees.to_radians()))
        }
        (_, Some(_), _) => {
            Err("the field of view of a pinhole must be more than 0° and less than 180°".to_owned())
        }
        (_, _, Some(focal)) if (1.0..=1e6).contains(&focal) => Ok(Field::Focal(focal)),
        _ => Err("expected inside, whole, an angle such as 90deg, or a focal length such as 800px"
            .to_owned()),
    }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let side =
        |text: &str| text.parse().ok().filter(|side| (2..=u32::from(u16::MAX)).contains(side));
    let sides =
        text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?]));
    sides.ok_or_else(|| format!("`{text}` is not a valid width and height in px, such as 1280x960"))
}

fn pair(text: &str) -> Result<[String; 2], String> {
    match text.split_once(',') {
        Some((first, second)) if first != second && !first.is_empty() && !second.is_empty() => {
            Ok([first.to_owned(), second.to_owned()])
        }
        _ => Err("expected the names of two different cameras, such as left,right".to_owned()),
    }
}

impl ViewArgs {
    /// Computes the pixel map of a view.
    fn map(&self, made: &Undistortion) -> PixelMap {
        match self.distance {
            Some(distance_mm) => made.clone().at_distance(distance_mm).map(),
            None => made.map(),
        }
    }

    fn size_of(&self, camera: &Camera) -> anyhow::Result<[u32; 2]> {
        let size = self.size.unwrap_or([camera.width, camera.height]);
        let (pixels, most) =
            (u64::from(size[0]) * u64::from(size[1]), self.limits.limits().max_pixels);
        ensure!(
            pixels <= most,
            "--size: {pixels} pixels exceed the limit of {most}; raise it with --max-pixels"
        );
        Ok(size)
    }

    /// Returns the files of a view other than its images.
    fn files(&self, stem: &str, file: &CameraFile, map: &PixelMap) -> anyhow::Result<Vec<File>> {
        let view = &file.camera;
        let mut files = vec![
            text_file(format!("{stem}.yaml"), file.to_yaml()),
            text_file(format!("{stem}-opencv.yaml"), opencv(view)?),
            text_file(format!("{stem}-ros.yaml"), ros(view, stem)?),
        ];
        if self.maps {
            let [x, y] = undistortion::maps(map);
            files.push(bytes_file(format!("{stem}-map-x.npy"), x));
            files.push(bytes_file(format!("{stem}-map-y.npy"), y));
        }
        Ok(files)
    }
}

/// Creates a pinhole view of a camera, and undistorts its images.
pub fn run(mut args: Args) -> anyhow::Result<ExitCode> {
    let images = Images::of(&args.images)?;
    let Place { folder, file } = output::place(&args.view.output, &["png"])?;
    ensure!(
        file.is_none() || images.is_one_photograph(),
        "-o: {} is one file, but there is not exactly one photograph; use a folder",
        args.view.output.display()
    );
    ensure!(
        !args.images.iter().any(|path| path.is_dir() && same_file(path, &folder)),
        "-o: {} is the folder of the photographs, and would mix them with the results; use another folder",
        folder.display()
    );
    let stem_of_one = file.map(|file| file.stem);
    args.view.output = folder;
    let args = args;
    let (found, failed) = camera_file::read_calibration("--camera", &args.camera)?;
    let [known] = found.cameras.as_slice() else {
        bail!(
            "--camera: {}: this file contains {}; use `deltille rectify`, or the .yaml of one of them",
            args.camera.display(),
            counted(found.cameras.len(), "camera")
        );
    };
    let (camera, calibrated_with) = (known.camera.clone(), found.calibrated_with.clone());
    let stem = args.camera.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let stem = format!("{stem}-undistorted");
    let made = Undistortion::new(&camera, args.view.size_of(&camera)?, args.view.field);
    let made = made.context("--field")?;
    let (folder, end) = (args.view.output.as_path(), "undistorted");
    let options = args.recording.options(args.view.limits.limits(), &images)?;
    let pictures =
        Pictures { args: &args.view, options, folder, camera: &camera, end, stem_of_one };
    pictures.check(&images)?;
    let map = args.view.map(&made);
    let view = CameraFile { camera: made.view().clone(), calibrated_with, failed };
    let mut files = args.view.files(&stem, &view, &map)?;
    let known = known.view_uncertainty(&made);
    files.insert(0, text_file(format!("{stem}.json"), undistortion::write(&made, &map, known)));
    let staged = Staged::new(&args.view.output, &files, args.view.overwrite)?;
    say!("{}", describe(made.view(), &map));
    if let Some(known) = &known {
        say!("{}", describe_uncertainty(known));
    }
    let made = pictures.write(&images, &map)?;
    made.end(staged)
}

/// Describes the uncertainty of positions in a view.
fn describe_uncertainty(known: &ViewUncertainty) -> String {
    let from = match known.source {
        Source::Noise => "from noise alone",
        Source::Observed => "observed",
    };
    format!(
        "positions are known to {:.4} px (1σ, RMS per axis, {from}) where the calibration saw corners, in {:.0} % of the view",
        known.position_sd_px,
        100.0 * known.calibrated_fraction
    )
}

/// Describes a view in one line.
fn describe(view: &Camera, map: &PixelMap) -> String {
    let field = |side: u32| 2.0 * (f64::from(side) / 2.0 / view.focal_px.x).atan().to_degrees();
    let [x, y, width, height] = map.valid_rectangle();
    let whole = match map.valid_fraction() {
        1.0 => "every pixel is covered".to_owned(),
        part => format!(
            "{:.1} % of pixels are covered; {width} × {height} px from ({x}, {y}) are fully covered",
            // Not rounded up to all.
            (1000.0 * part).floor() / 10.0
        ),
    };
    format!(
        "{} × {} px, focal length {:.2} px, {:.1}° × {:.1}°; {whole}",
        view.width,
        view.height,
        view.focal_px.x,
        field(view.width),
        field(view.height)
    )
}

/// Output images of a camera.
struct Pictures<'a> {
    args: &'a ViewArgs,
    options: FrameOptions,
    folder: &'a Path,
    camera: &'a Camera,
    /// Suffix of the image names.
    end: &'static str,
    /// Stem of the only image.
    stem_of_one: Option<String>,
}

impl Pictures<'_> {
    fn place(&self, stem: &str) -> PathBuf {
        match &self.stem_of_one {
            Some(stem) => self.folder.join(format!("{stem}.png")),
            None => self.folder.join(format!("{stem}-{}.png", self.end)),
        }
    }

    /// Rejects outputs that could not be written, before the work starts.
    fn check(&self, images: &Images) -> anyhow::Result<()> {
        let mut stems = Stems::default();
        // The frames of recordings are not known yet.
        images.named().iter().filter(|image| !is_recording(image)).try_for_each(|image| {
            let stem = stems.claim(image)?;
            self.args.overwrite.check(&self.place(&stem), &Kind::own_png())
        })
    }

    /// Writes all images. Reports images that cannot be read, and continues with the others.
    fn write(&self, images: &Images, map: &PixelMap) -> anyhow::Result<Made> {
        let is_new = !self.folder.exists();
        if images.count() != Some(0) {
            fs::create_dir_all(self.folder)
                .with_context(|| format!("-o: cannot write to {}", self.folder.display()))?;
        }
        let count = images.count().unwrap_or(0);
        let bar = progress::bar(count as u64, "images");
        let failed: Mutex<BTreeMap<usize, anyhow::Error>> = Mutex::default();
        let done: Mutex<usize> = Mutex::default();
        let pool = rayon::ThreadPoolBuilder::new().build()?;
        let mut stems = Stems::default();
        let frames = images.frames(&self.options, true).map(|frame| {
            let frame = frame?;
            stems.claim_stem(&frame.stem(), frame.path())?;
            Ok(frame)
        });
        let frames = frames.take_while(|_| !interrupt::is_raised());
        images_at_once::for_each(&pool, &self.args.limits.limits(), frames, |index, frame| {
            match frame.and_then(|frame| self.write_one(frame, map)) {
                Ok(()) => *done.lock().expect("no thread panics here") += 1,
                Err(error) => {
                    failed.lock().expect("no thread panics here").insert(index, error);
                }
            }
            bar.inc(1);
        });
        bar.finish_and_clear();
        let done = done.into_inner().expect("no thread panics here");
        let failed = failed.into_inner().expect("no thread panics here");
        failed.values().for_each(run::report);
        let failed = failed.len();
        if done > 0 {
            report!("wrote {} to {}", counted(done, "image"), self.folder.display());
        } else if is_new {
            // Removes the folder only if it is empty.
            let _ = fs::remove_dir(self.folder);
        }
        Ok(Made { done, failed })
    }

    fn write_one(&self, frame: Frame, map: &PixelMap) -> anyhow::Result<()> {
        let (image, stem) = (frame.path().to_owned(), frame.stem());
        let picture = frame.read_colours(&self.args.limits.limits())?;
        let size = [picture.width(), picture.height()];
        ensure!(
            size == [self.camera.width, self.camera.height],
            "{}: {} × {} px, but the camera has {} × {}: the image is from another camera or mode",
            image.display(),
            size[0],
            size[1],
            self.camera.width,
            self.camera.height
        );
        let place = self.place(&stem);
        ensure!(!same_file(&place, &image), "{} would be overwritten", image.display());
        let mut png = std::io::Cursor::new(Vec::new());
        remapped(&picture, map)
            .write_to(&mut png, image::ImageFormat::Png)
            .with_context(|| place.display().to_string())?;
        self.args.overwrite.check(&place, &Kind::own_png())?;
        let png = signed_png(png.into_inner());
        Ok(atomic::write(&place, |out| out.write_all(&png))?)
    }
}

/// Number of images written, and number that failed.
#[derive(Clone, Copy)]
struct Made {
    done: usize,
    failed: usize,
}

impl Made {
    /// Writes the other files, unless all images failed.
    fn end(self, staged: Staged) -> anyhow::Result<ExitCode> {
        let Self { done, failed } = self;
        let is_left = interrupt::is_raised();
        if done == 0 && (failed > 0 || is_left) {
            drop(staged);
            return match is_left {
                true => Err(Interrupted("nothing was written".to_owned()).into()),
                false => Ok(ExitCode::from(BAD_INPUT)),
            };
        }
        for path in staged.commit()? {
            report!("{}", output::wrote(&path));
        }
        if is_left {
            return Err(Interrupted(format!("{} written", counted(done, "image"))).into());
        }
        Ok(if failed > 0 { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
    }
}

/// Creates rectified views of two cameras of a rig, and rectifies their images.
pub fn run_pair(args: PairArgs) -> anyhow::Result<ExitCode> {
    output::place(&args.view.output, &[])?;
    let (found, failed) = read_rig(&args.rig)?;
    let Estimate { cameras, calibrated_with, .. } = found;
    let named = |name: &String| {
        cameras.iter().find(|camera| camera.name == *name).ok_or_else(|| {
            let names: Vec<&str> = cameras.iter().map(|camera| camera.name.as_str()).collect();
            anyhow!("--pair: unknown camera {name} (the rig has {})", names.join(", "))
        })
    };
    let [first, second] = [named(&args.pair[0])?, named(&args.pair[1])?];
    let names = [first.name.as_str(), second.name.as_str()];
    // A known camera was calibrated before the rig.
    let calibrated_with = [first, second].map(|camera| match camera.model {
        Some(_) => calibrated_with.clone(),
        None => Vec::new(),
    });
    let size = args.view.size_of(&first.camera)?;
    let cameras = [first, second].map(|camera| (&camera.camera, camera.camera_from_rig));
    let made = Rectification::new(cameras, size, args.view.field).context("--pair")?;
    let folders = names.map(|name| args.view.output.join(name));
    let images = [Images::of(&args.first)?, Images::of(&args.second)?];
    if let Some(recording) = images.iter().flat_map(Images::named).find(|path| is_recording(path)) {
        bail!(
            "{}: rectify reads photographs; write the frames of this recording as images first, for example with \
             `deltille.frames` in Python",
            recording.display()
        );
    }
    let of_camera = |index: usize| Pictures {
        args: &args.view,
        options: FrameOptions::default(),
        folder: &folders[index],
        camera: cameras[index].0,
        end: "rectified",
        stem_of_one: None,
    };
    of_camera(0).check(&images[0])?;
    of_camera(1).check(&images[1])?;
    let stem = format!("{}-{}", names[0], names[1]);
    let sample = [text_file(format!("{stem}.json"), sample_of(undistortion::PAIR_SCHEMA))];
    check_places(&args.view.output, &sample, args.view.overwrite)?;
    let maps = [&made.views[0], &made.views[1]].map(|view| args.view.map(view));
    let known = [first.view_uncertainty(&made.views[0]), second.view_uncertainty(&made.views[1])];
    let mut files = vec![
        text_file(format!("{stem}.json"), undistortion::write_pair(&made, names, &maps, known)),
        text_file(format!("{stem}-opencv.yaml"), undistortion::opencv_pair(&made)),
    ];
    let views = made.views.iter().zip(calibrated_with).zip(known);
    for ((name, ((view, calibrated_with), known)), map) in names.iter().zip(views).zip(&maps) {
        say!("{name}: {}", describe(view.view(), map));
        if let Some(known) = known {
            say!("{name}: {}", describe_uncertainty(&known));
        }
        let file =
            CameraFile { camera: view.view().clone(), calibrated_with, failed: failed.clone() };
        files.extend(args.view.files(&format!("{name}-rectified"), &file, map)?);
    }
    let baseline = made.baseline_mm;
    let (mm, what) = match baseline.y == 0.0 {
        true => (baseline.x, "row"),
        false => (baseline.y, "column"),
    };
    say!("baseline {mm:.3} mm; a point is in the same {what} of both images");
    let staged = Staged::new(&args.view.output, &files, args.view.overwrite)?;
    let mut made = Made { done: 0, failed: 0 };
    for (index, images) in images.iter().enumerate() {
        let Made { done, failed } = of_camera(index).write(images, &maps[index])?;
        made = Made { done: made.done + done, failed: made.failed + failed };
    }
    made.end(staged)
}

/// Reads the rig in a file, and the reason why its calibration failed, if any.
fn read_rig(path: &Path) -> anyhow::Result<(Estimate, Option<String>)> {
    let (found, failed) = camera_file::read_calibration("RIG", path)?;
    if found.cameras.len() < 2 {
        bail!(
            "RIG: {}: this file contains a single camera; use the rig.json of `deltille rig`",
            path.display()
        );
    }
    Ok((found, failed))
}
