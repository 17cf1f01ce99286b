//! Table 2 of the paper on photographs: a camera is calibrated on the first half of a sequence; on the second half,
//! only the poses are estimated.

use std::path::Path;

use rayon::prelude::*;

use deltille::calibrate::{
    Calibration, CalibrationError, Estimate, Loss, Model, Reference, UntaggedGrid, View, Weights,
    views,
};
use deltille::detect::{Detector, DetectorConfig, Refinement};
use deltille::lattice::GridKind;
use deltille::photograph::{self, ImageError};

/// Rows and columns of the board in the paper's sequence, and its edge length.
const SIZE: [u32; 2] = [10, 11];
const EDGE_MM: f64 = 20.0;

/// Minimum number of images of the board: three for each half, enough for a calibration.
const MIN_VIEWS: usize = 6;

/// A row of the table: RMS reprojection errors per axis, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Refinement method.
    pub refinement: Refinement,
    /// Camera model.
    pub model: Model,
    /// Whether the first half also measured the board, instead of using the nominal one.
    pub measured: bool,
    /// Number of views of the first half, and their error.
    pub training: (usize, f64),
    /// Number of views of the second half, and their error with the camera of the first half.
    pub test: (usize, f64),
}

/// Reason why the table was not made.
#[derive(Debug, thiserror::Error)]
pub enum Table2Error {
    /// Too few images of the board.
    #[error(
        "{found} of {all} images show the whole untagged board of {} × {} corners, but {MIN_VIEWS} are needed: \
         give the folder of the paper's photographs", SIZE[0], SIZE[1]
    )]
    TooFew {
        /// Number of images that show the board.
        found: usize,
        /// Total number of images.
        all: usize,
    },
    /// An image cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The calibration failed.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// Detects the board in all images, in the order of the sequence, and computes the table. All corners have equal
/// weight, without a robust loss.
///
/// # Errors
/// Returns an error if an image cannot be read, too few images show the whole board, or the calibration fails.
pub fn run(images: &[impl AsRef<Path> + Sync]) -> Result<Vec<Row>, Table2Error> {
    let mut rows = Vec::new();
    for refinement in [Refinement::Polynomial, Refinement::Model] {
        let views = detect(images, refinement)?;
        if views.len() < MIN_VIEWS {
            return Err(Table2Error::TooFew { found: views.len(), all: images.len() });
        }
        let (first, second) = views.split_at(views.len() / 2);
        for measured in [false, true] {
            for model in [Model::Radtan, Model::Radtan5, Model::Rational] {
                rows.push(row([first, second], refinement, model, measured)?);
            }
        }
    }
    Ok(rows)
}

fn row(
    [first, second]: [&[View]; 2],
    refinement: Refinement,
    model: Model,
    measured: bool,
) -> Result<Row, CalibrationError> {
    let blank = Calibration::new(reference().panels());
    let blank = blank.loss(Loss::Squared).weights(Weights::Equal);
    let training = blank.clone().camera("", first.to_vec(), model).measure_target(measured);
    let training = training.solve()?;
    let mut second = second.to_vec();
    for sighting in second.iter_mut().flat_map(|view| &mut view.sightings) {
        training.map.iter().for_each(|map| sighting.correct(map));
    }
    let camera = training.cameras[0].camera.clone();
    let test = blank.camera("", second, camera).solve()?;
    let of = |estimate: &Estimate| (estimate.frames.len(), estimate.rms_px);
    Ok(Row { refinement, model, measured, training: of(&training), test: of(&test) })
}

fn reference() -> Reference<'static> {
    let kind = GridKind::Deltille;
    Reference::Grid(UntaggedGrid { kind, edge_mm: EDGE_MM, size: Some(SIZE) })
}

fn detect(
    images: &[impl AsRef<Path> + Sync],
    refinement: Refinement,
) -> Result<Vec<View>, Table2Error> {
    let config = DetectorConfig::default().refinement(refinement);
    let detector = Detector::for_grid(GridKind::Deltille, Some((SIZE[0], SIZE[1])), config);
    let found = images.par_iter().map(|path| {
        let name = path.as_ref().file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let image = photograph::read(path.as_ref())?;
        Ok((name.clone(), detector.detect(&image, &name)))
    });
    let found = found.collect::<Result<Vec<_>, ImageError>>()?;
    let mut views = views(&found, &reference())?.views;
    // If only a part of the board is visible, the identity of its corners is ambiguous.
    views.retain(|view| reference().has_certain_labels(view));
    Ok(views)
}

/// Formats the table as text, followed by the results for the paper's corners on the whole sequence.
pub fn text(rows: &[Row]) -> String {
    let mut text = "refinement  model     board     views       calibrated  pose only\n".to_owned();
    for row in rows {
        let refinement = match row.refinement {
            Refinement::Polynomial => "polynomial",
            Refinement::Model => "model",
        };
        let ((n, training), (m, test)) = (row.training, row.test);
        let (model, views) = (row.model.to_string(), format!("{n} + {m}"));
        let board = if row.measured { "measured" } else { "planned" };
        text += &format!(
            "{refinement:11} {model:9} {board:9} {views:11} {training:.4} px   {test:.4} px\n"
        );
    }
    for (model, training, test) in
        [("radtan", 0.1005, 0.1160), ("radtan5", 0.0958, 0.1075), ("rational", 0.0934, 0.1024)]
    {
        text += &format!(
            "published   {model:9} planned   {:11} {training:.4} px   {test:.4} px\n",
            "all 54 + 55"
        );
    }
    text
}
