//! New photographs of a target, of a calibrated camera or rig.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};

use crate::deltille::calibrate::filming::FilmArgs;
use crate::deltille::calibrate::rig::check_own;
use crate::deltille::calibrate::rig_cameras::{CamerasArgs, Source, named, topic, topic_of_one};
use crate::deltille::calibrate::sightings::{self, GridArgs, SheetArgs};
use crate::deltille::calibrate::solving::accuracy;
use crate::deltille::files::images::RecordingArgs;
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::{camera_file, target_file};
use crate::output::log;
use crate::values::whole;
use deltille::calibrate::{
    Calibration, CameraEstimate, CameraViews, Estimate, Intrinsics, Model, Reference,
};
use deltille::export::sheet::Sheet;
use deltille::frames::is_bag;
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::targets::Target;

/// The calibration, the new photographs, and the target that they show.
#[derive(clap::Args)]
pub struct NewViewsArgs {
    /// The calibration of the camera or the rig: the .json of `deltille calibrate` or `deltille rig`
    #[arg(value_name = "CAMERA")]
    camera: PathBuf,
    /// New photographs of the target: files, folders, a video or a recording; or their detections (.json or .parquet) from
    /// `deltille detect`. For a rig, a recording of all cameras
    #[arg(required_unless_present = "cameras", value_name = "PHOTOGRAPHS")]
    photographs: Vec<PathBuf>,
    /// Camera of the rig and its video, recording, folder of photographs or folder of detections, such as left=today/left;
    /// repeat for each camera. Photographs and detections of the same time must have the same file name in each folder
    #[arg(
        long = "camera",
        id = "cameras",
        value_name = "NAME=PATH",
        value_parser = named,
        conflicts_with = "photographs"
    )]
    cameras: Vec<(String, PathBuf)>,
    /// Topic of the images in an MCAP file or a bag; for a rig, that of each camera, such as left=/left/image_raw
    #[arg(long, value_name = "[NAME=]TOPIC", value_parser = topic)]
    topic: Vec<(Option<String>, String)>,
    /// Read only every N-th frame of recordings; for a rig, every N-th set of simultaneous frames
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1..=1_000_000u64))]
    every: u64,
    /// Maximum number of views [default: 60 of recordings, all photographs]
    #[arg(long, value_name = "N", value_parser = whole(1..=100_000u32))]
    views: Option<u32>,
    /// Target description: the .json written with the target, or a .dsc
    #[arg(long, required_unless_present = "grid", value_name = "FILE")]
    target: Option<PathBuf>,
    #[command(flatten)]
    grid: GridArgs,
    /// Use --target even if the camera was calibrated with a board with the same tags but a different size
    #[arg(long)]
    assume_target: bool,
    #[command(flatten)]
    sheet: SheetArgs,
    /// Family file, if the target uses a family that does not ship with the program
    #[arg(long)]
    family: Option<String>,
    /// Standard deviation of the board's corners from their described positions, such as 0.05mm; 0 for an exact board
    /// [default: that of a measured target, otherwise 0.1 mm, at most 0.5 % of an edge]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = accuracy)]
    board_accuracy: Option<f64>,
    #[command(flatten)]
    limits: ImageLimits,
}

/// The earlier calibration, and the target of the new photographs.
pub struct Known {
    pub printing: Printing,
    pub before: Estimate,
    /// A calibration with this target, without views.
    pub calibration: Calibration,
    pub limits: Limits,
    sheet: Sheet,
}

/// The new views of a camera.
struct OfCamera {
    /// The option that names them, for messages.
    option: String,
    read: sightings::Read,
}

/// The unknown intrinsics of a camera: only the selection of frames of a recording depends on the model.
fn of_model(camera: &CameraEstimate) -> Intrinsics {
    Intrinsics::Unknown(camera.model.unwrap_or(Model::Radtan))
}

impl NewViewsArgs {
    /// The file of the calibration.
    pub fn camera(&self) -> &Path {
        &self.camera
    }

    /// Reads the calibration and the target.
    pub fn known(&self) -> anyhow::Result<Known> {
        let limits = self.limits.limits();
        let mut printing = match self.grid.read_target()? {
            Some((_, target)) => Printing::from(target),
            None => {
                let path = self.target.as_deref().context("--target FILE is needed")?;
                target_file::read_placed(path, &limits).context("--target")?
            }
        };
        target_file::set_family(&mut printing.target, self.family.as_deref())?;
        let before = self.before(&printing.target)?;
        let reference = Reference::Target(&printing.target);
        let printings = std::slice::from_ref(&printing);
        let sheet = self.sheet.read(&limits, &reference.identities(), printings)?;
        let mut calibration = Calibration::of(&reference, sightings::panels(&reference, &sheet)?);
        if self.board_accuracy.is_some() {
            calibration = calibration.board_accuracy_mm(self.board_accuracy);
        }
        Ok(Known { printing, before, calibration, sheet, limits })
    }

    /// Detects the target in the photographs, and returns the calibration with the views of each camera.
    pub fn views(&self, known: &Known) -> anyhow::Result<Calibration> {
        let Known { printing, before, sheet, limits, .. } = known;
        let reference = Reference::Target(&printing.target);
        let mut calibration = known.calibration.clone();
        let mut seen = self.seen(before, &reference, limits)?;
        let mut all = Vec::new();
        for camera in &before.cameras {
            let mut views = Vec::new();
            if let Some(OfCamera { option, read }) = seen.remove(&camera.name) {
                if read.views.is_empty() {
                    log!("{}", sightings::nothing_shown(&read.detections));
                }
                check_own(&option, &read.detections, &all)?;
                all.push((&camera.name, read.detections));
                views = read.views;
            }
            sightings::take_known(&mut views, &reference);
            sightings::put_on(sheet, Some(&printing.target), &mut views)?;
            calibration = calibration.with(CameraViews::new(&camera.name, views, of_model(camera)));
        }
        Ok(calibration)
    }

    /// Reads the new views of each camera that has some.
    fn seen(
        &self,
        before: &Estimate,
        reference: &Reference,
        limits: &Limits,
    ) -> anyhow::Result<BTreeMap<String, OfCamera>> {
        let Self { photographs, cameras, topic, every, views, .. } = self;
        let (every, views, assume) = (*every, *views, self.assume_target);
        if let [camera] = before.cameras.as_slice() {
            let topic = topic_of_one(topic)?;
            let film = FilmArgs { recording: RecordingArgs { topic, every }, views };
            let read =
                sightings::seen(photographs, &film, &of_model(camera), reference, limits, assume)?;
            let only = OfCamera { option: "PHOTOGRAPHS".to_owned(), read };
            return Ok([(camera.name.clone(), only)].into());
        }
        let (recording, camera) = (photographs.clone(), cameras.clone());
        let of_rig = CamerasArgs { recording, camera, topic: topic.clone(), every, views };
        let names: Vec<&str> = before.cameras.iter().map(|camera| camera.name.as_str()).collect();
        let sources = of_rig.of_calibrated(&names)?;
        let of = |source: &Source| {
            let camera = before.cameras.iter().find(|camera| camera.name == source.name);
            camera.map_or(Intrinsics::Unknown(Model::Radtan), of_model)
        };
        let intrinsics: Vec<Intrinsics> = sources.iter().map(of).collect();
        let given = of_rig.read(&sources, reference, &intrinsics, limits)?;
        let read = sources.into_iter().zip(given).map(|(Source { name, option, .. }, given)| {
            let read = sightings::views_of(given, reference, assume);
            let read = read.with_context(|| option.clone())?;
            Ok((name, OfCamera { option, read }))
        });
        read.collect()
    }

    /// Reads the calibration.
    fn before(&self, target: &Target) -> anyhow::Result<Estimate> {
        let path = &self.camera;
        let mut before = camera_file::read_estimate("CAMERA", path)?;
        let names: Vec<&str> = before.cameras.iter().map(|camera| camera.name.as_str()).collect();
        match (self.cameras.is_empty(), self.photographs.as_slice()) {
            (false, _) => ensure!(
                names.len() > 1,
                "--camera: {} has one camera; give its photographs without --camera",
                path.display()
            ),
            (true, [recording]) if is_bag(recording) => {}
            (true, _) => ensure!(
                names.len() == 1,
                "CAMERA: {} is a rig; give an MCAP file or a bag with --topic for each camera, or the images of each camera with \
                 --camera NAME=PATH (cameras: {})",
                path.display(),
                names.join(", ")
            ),
        }
        if let [camera] = before.cameras.as_mut_slice() {
            camera.name.clear();
        }
        let targets = std::slice::from_ref(target);
        let with = &before.calibrated_with;
        camera_file::check_or_note(path, with, targets, self.assume_target)?;
        Ok(before)
    }
}
