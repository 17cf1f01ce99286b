//! The files of a calibration: those of the cameras, the report with the photographs that it shows, and the covariance.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::covariance_file::CovarianceArgs;
use super::solving::{Calibrated, SolveArgs};
use crate::deltille::files::written::{File, write_all};
use crate::output::{self, Overwrite, log};
use deltille::calibrate::{PoseUncertainty, View, ViewEstimate};
use deltille::photograph;
use deltille::raster::{AnyGray, Gray};
use deltille::report::{Report, Sample, shown_views, thumbnail};
use deltille_core::name::is_within;
use deltille_core::words::counted;

/// Largest number of thumbnails of held-out views.
const MAX_HELD_OUT: usize = 100;

/// Where a calibration is written.
pub struct Outputs<'a> {
    folder: &'a Path,
    stem: &'a str,
    covariance: &'a CovarianceArgs,
    /// The report, if requested.
    page: Option<PathBuf>,
    overwrite: Overwrite,
}

impl<'a> Outputs<'a> {
    /// Rejects unusable paths of the covariance and the report (`<stem>-report.html` in a folder), before the work starts;
    /// `targets` are the files of the targets.
    pub fn of(
        SolveArgs { covariance, report, .. }: &'a SolveArgs,
        folder: &'a Path,
        stem: &'a str,
        targets: &[PathBuf],
        overwrite: Overwrite,
    ) -> anyhow::Result<Self> {
        let own = folder.join(format!("{stem}.json"));
        let own: Vec<&Path> = targets.iter().chain([&own]).map(PathBuf::as_path).collect();
        covariance.check(overwrite, &own)?;
        let name = format!("{stem}-report");
        let page = report.as_deref().map(|page| output::page(page, &name, overwrite));
        Ok(Self { folder, stem, covariance, page: page.transpose()?, overwrite })
    }

    /// Writes files, the report with photographs from the folder of each camera, and the covariance; returns their paths.
    pub fn write(
        &self,
        solved: &Calibrated,
        files: &[File],
        folders: &[Option<&Path>],
        poses: &[PoseUncertainty],
    ) -> anyhow::Result<Vec<PathBuf>> {
        let &Self { folder, stem, covariance, overwrite, .. } = self;
        let mut written = write_all(folder, files, overwrite)?;
        if let Some(page) = &self.page {
            solved.write_page(page, stem, folders, poses, overwrite)?;
            written.push(page.clone());
        }
        written.extend(covariance.write(&solved.estimate, solved.has_failed(), overwrite)?);
        Ok(written)
    }
}

impl Calibrated {
    /// Writes the report; `folders` contains the photograph folder of each camera.
    fn write_page(
        &self,
        page: &Path,
        title: &str,
        folders: &[Option<&Path>],
        poses: &[PoseUncertainty],
        overwrite: Overwrite,
    ) -> anyhow::Result<()> {
        let (mut thumbnails, mut samples) = (BTreeMap::new(), BTreeMap::new());
        for (index, (camera, folder)) in self.estimate.cameras.iter().zip(folders).enumerate() {
            let Some(folder) = folder else { continue };
            let is_there = |view: &&ViewEstimate| picture_of(&view.image, folder).is_some();
            let shown = Sample::best(camera, is_there).map(|view| view.name.as_str());
            let held_out = self.estimate.held_out.iter().flat_map(|test| test.cameras.get(index));
            let held_out = held_out.flat_map(|camera| &camera.views).take(MAX_HELD_OUT);
            // Reads only the views shown in the report, and the one that is undistorted.
            let more = camera.views.iter().filter(|view| shown == Some(view.name.as_str()));
            let views = shown_views(camera).into_iter().chain(more).chain(held_out);
            let mut done = BTreeSet::new();
            let views = views.filter(|view| done.insert(&view.image));
            for view in views {
                let size_px = [camera.camera.width, camera.camera.height];
                let picture = picture(&view.image, folder, size_px);
                let small = picture.as_ref().and_then(thumbnail);
                thumbnails.extend(small.map(|small| ((index, view.name.clone()), small)));
                if let (Some(picture), true) = (picture, shown == Some(view.name.as_str())) {
                    samples.extend(Sample::of(camera, view, picture).map(|made| (index, made)));
                }
            }
        }
        let Self { estimate, diagnoses, stated, print, models, notes } = self;
        let mut report = Report::new(title, estimate);
        (report.diagnoses, report.stated) = (diagnoses, stated);
        (report.print, report.thumbnails, report.notes) = (*print, thumbnails, notes.clone());
        (report.samples, report.models, report.poses) = (samples, models, poses);
        output::write(page, report.html().as_bytes(), overwrite).context("--report")
    }
}

/// Returns the image of a view in 8 bits. Without an image, the report shows the corners only. Warns if the image
/// cannot be read or its size differs from that of the camera.
fn picture(image: &str, folder: &Path, size_px: [u32; 2]) -> Option<Gray<u8>> {
    let path = picture_of(image, folder)?;
    let picture = match photograph::read(&path) {
        Ok(picture) => picture,
        Err(error) => {
            log!("warning: --images: {error}");
            return None;
        }
    };
    if [picture.width(), picture.height()] != size_px.map(|side| side as usize) {
        log!(
            "warning: --images: {} has {} × {} px, but the camera has {} × {}",
            path.display(),
            picture.width(),
            picture.height(),
            size_px[0],
            size_px[1]
        );
        return None;
    }
    Some(match picture {
        AnyGray::U8(image) => image,
        AnyGray::U16(image) => image.map(|v| (v >> 8) as u8),
    })
}

/// Returns the path of a view's image in a folder or one of its subfolders. Names in the file cannot lead elsewhere.
fn picture_of(image: &str, folder: &Path) -> Option<PathBuf> {
    is_within(image).then(|| folder.join(image)).filter(|path| path.is_file())
}

/// Rejects paths of `--images` that are not folders.
pub fn check_images<'a>(mut folders: impl Iterator<Item = &'a PathBuf>) -> anyhow::Result<()> {
    match folders.find(|path| !path.is_dir()) {
        Some(path) => bail!("--images: {} is not a folder", path.display()),
        None => Ok(()),
    }
}

/// Warns about missing images of views.
pub fn note_missing(folder: &Path, views: &[View]) {
    let missing = views.iter().filter(|view| picture_of(&view.image, folder).is_none());
    let missing: Vec<&str> = missing.map(|view| view.image.as_str()).collect();
    if let Some(first) = missing.first() {
        log!(
            "warning: --images: {} of {} are missing in {}, such as {first}",
            missing.len(),
            counted(views.len(), "image"),
            folder.display()
        );
    }
}
