//! `deltille render`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};
use glam::{DQuat, DVec3};
use image::{DynamicImage, ImageBuffer, Luma};

use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::written::{bytes_file, text_file, write_all};
use crate::deltille::files::{camera_file, target_file};
use crate::output::{self, Overwrite, log, report};
use crate::values::{number, whole};
use deltille::camera::{Camera, Pose};
use deltille::export::kind::signed_png;
use deltille::export::truth;
use deltille::synth::{Light, scene_of_target};
use deltille_core::quantity::{Range, blur_px, light_gradient, of_full_scale, position_mm};
use deltille_core::words::counted;

/// Arguments of `deltille render`.
#[derive(clap::Args)]
pub struct Args {
    /// Target description: the .json of `deltille board` or `deltille icosahedron`
    target: PathBuf,
    /// Camera file of `deltille calibrate`, OpenCV, ROS, Kalibr (FILE:cam0), COLMAP (FILE:1) or mrcal, or a YAML file with width,
    /// height, focal_px, centre_px, model (such as pinhole or fisheye) and distortion
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    /// Pose of the target in the camera frame (x right, y down, z forward): rotation vector in radians and
    /// translation in mm
    #[arg(long, value_name = "RX,RY,RZ,TX,TY,TZ", value_parser = numbers::<6>,
          allow_hyphen_values = true, conflicts_with = "eye")]
    pose: Option<[f64; 6]>,
    /// Position of the camera in the target frame in mm, instead of --pose. The origin of a deltille board (row 0, column 0 of
    /// the lattice) lies to the left of its corners
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true)]
    eye: Option<[f64; 3]>,
    /// Point that the camera at --eye looks at, mm [default: the middle of all corners]
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true,
          requires = "eye")]
    look_at: Option<[f64; 3]>,
    /// Up direction of the image with --eye [default: 0,0,1, or 0,1,0 from straight above or below]
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true,
          requires = "eye")]
    up: Option<[f64; 3]>,
    /// Standard deviation of the blur, px
    #[arg(long, default_value_t = 0.8, value_name = "PX",
          value_parser = number(blur_px::RANGE.least..=blur_px::RANGE.most))]
    blur: f64,
    /// Standard deviation of the noise, percent of full scale
    #[arg(long, default_value_t = 1.0, value_name = "PERCENT",
          value_parser = number(0.0..=100.0 * of_full_scale::RANGE.most))]
    noise: f64,
    /// Relative change of the brightness across and down the image
    #[arg(long, value_name = "ACROSS,DOWN", value_parser = gradient,
          allow_hyphen_values = true, default_value = "0,0")]
    gradient: [f64; 2],
    /// Seed of the noise
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole(0..=u64::MAX))]
    seed: u64,
    /// Bits per pixel: 8 or 16
    #[arg(long, default_value_t = 8, value_parser = depth)]
    bits: u8,
    /// Family file, if the target uses a family that does not ship with the program
    #[arg(long)]
    family: Option<String>,
    /// Output image, a .png file or a folder for <target>-view.png; the true positions of all visible corners are
    /// written beside it as .json
    #[arg(short, long, value_name = "FILE", default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    limits: ImageLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Renders an image of a target, and writes it with its ground truth.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let limits = args.limits.limits();
    let mut target = target_file::read(&args.target, &limits)?.target;
    target_file::set_family(&mut target, args.family.as_deref())?;
    if !target.is_one_scene() {
        bail!(
            "{} has several independent boards; only solids and single boards can be rendered",
            target.name
        );
    }
    let camera = camera_file::read("--camera", &args.camera)?;
    limits.check_pixels(camera.width, camera.height).with_context(|| {
        let file = args.camera.display();
        format!("--camera: {file}: an image of {} × {} px", camera.width, camera.height)
    })?;
    let light = Light::default()
        .blur_px(args.blur)
        .noise(args.noise / 100.0)
        .gradient(args.gradient.into())
        .seed(args.seed);
    let corners = || target.panels.iter().flat_map(|panel| &panel.corners);
    let middle = corners().map(|c| c.target_mm).sum::<DVec3>();
    let pose = args.camera_from_target(middle / corners().count() as f64)?;

    let scene = scene_of_target(&target)?;
    let image = scene.render(&camera, &pose, &light);
    let seen = scene.truth(&camera, &pose, 0.0).corners;
    let path = output::file(&args.output, &format!("{}-view", target.name), "png")?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let truth = truth::write(&name, &target.name, &pose, &light, &seen);
    let picture = match args.bits {
        8 => picture(&camera, image.pixels().iter().map(|v| (v * 255.0 + 0.5) as u8)),
        _ => picture(&camera, image.pixels().iter().map(|v| (v * 65535.0 + 0.5) as u16)),
    };
    let mut png = std::io::Cursor::new(Vec::new());
    picture.context("the image is empty")?.write_to(&mut png, image::ImageFormat::Png)?;
    let truth_name = Path::new(&*name).with_extension("json").to_string_lossy().into_owned();
    let files =
        [text_file(truth_name, truth), bytes_file(name.into_owned(), signed_png(png.into_inner()))];
    write_all(output::folder_of(&path), &files, args.overwrite)?;
    report!("{}: {} in view", path.display(), counted(seen.len(), "corner"));
    if seen.is_empty() {
        // In the frames of OpenCV's boards, z points into the board.
        let first = target.panels.first();
        let is_away = first.is_some_and(|panel| panel.pose.matrix().z_axis.z < 0.0);
        let side = if is_away { "z < 0" } else { "z > 0" };
        log!(
            "warning: the target is behind the camera, out of view, or seen from its back: --eye looks at the \
             middle of the target, and a board faces the side of {side}"
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// Creates the image of a camera; `None` if the number of pixels differs.
fn picture<T>(camera: &Camera, pixels: impl Iterator<Item = T>) -> Option<DynamicImage>
where
    T: image::Primitive,
    Luma<T>: image::Pixel<Subpixel = T>,
    DynamicImage: From<ImageBuffer<Luma<T>, Vec<T>>>,
{
    ImageBuffer::from_raw(camera.width, camera.height, pixels.collect()).map(DynamicImage::from)
}

/// Parses the bit depth of an image.
fn depth(text: &str) -> Result<u8, String> {
    let bits = text.parse().ok().filter(|bits| [8, 16].contains(bits));
    bits.ok_or_else(|| "expected 8 or 16".to_owned())
}

impl Args {
    fn camera_from_target(&self, middle: DVec3) -> anyhow::Result<Pose> {
        if let Some(pose) = &self.pose {
            let rotation = DQuat::from_scaled_axis(DVec3::from_slice(&pose[..3]));
            return Ok(Pose { rotation, translation: DVec3::from_slice(&pose[3..]) });
        }
        let Some(eye) = self.eye.map(DVec3::from) else {
            bail!("--pose or --eye (the camera position) is needed");
        };
        let centre = self.look_at.map(DVec3::from).unwrap_or(middle);
        let pose = Pose::viewing(eye, centre, self.up.map(DVec3::from));
        pose.context(
            "--up must not be parallel to the line of sight, and --eye must differ from --look-at",
        )
    }
}

/// Parses N comma-separated coordinates within the range of positions.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    numbers_of(position_mm::RANGE, text)
}

/// Parses a relative change of the brightness across and down an image.
fn gradient(text: &str) -> Result<[f64; 2], String> {
    numbers_of(light_gradient::RANGE, text)
}

/// Parses N comma-separated numbers within a range.
fn numbers_of<const N: usize>(range: Range, text: &str) -> Result<[f64; N], String> {
    let parsed = text.split(',').map(|word| range.parse(word));
    let numbers = parsed.collect::<Result<Vec<f64>, _>>()?;
    numbers
        .try_into()
        .map_err(|v: Vec<f64>| format!("expected {N} numbers, but there are {}", v.len()))
}
