//! Table 2 of the paper on photographs: a camera is calibrated on the first half of a sequence; on
//! the second half only the poses are found.

use std::path::Path;

use rayon::prelude::*;

use deltille::calibrate::{
    Calibration, CalibrationError, Estimate, Loss, Model, Reference, UntaggedGrid, View, Weights,
    views,
};
use deltille::detect::{Detector, DetectorConfig, Refinement};
use deltille::lattice::GridKind;
use deltille::photograph::{self, ImageError};

/// Rows and columns of the board of the paper's sequence, and its edges.
const SIZE: [u32; 2] = [10, 11];
const EDGE_MM: f64 = 20.0;

/// Images of the board that are needed: three for each half, of which a camera is made.
const LEAST_VIEWS: usize = 6;

/// A line of the table: root mean square errors of a coordinate, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// How corners were refined.
    pub refinement: Refinement,
    /// What was calibrated.
    pub model: Model,
    /// Whether the first half measured the board too, instead of taking it as planned.
    pub measured: bool,
    /// Views of the first half, and their error.
    pub training: (usize, f64),
    /// Views of the second half, and their error with the first half's camera.
    pub test: (usize, f64),
}

/// Why the table was not made.
#[derive(Debug, thiserror::Error)]
pub enum Table2Error {
    /// Too few images of the board.
    #[error(
        "{found} of {all} images show the board whole, untagged, of {} × {} corners, and {LEAST_VIEWS} \
         are needed: name the folder of the paper's photographs", SIZE[0], SIZE[1]
    )]
    TooFew {
        /// How many show it.
        found: usize,
        /// How many there are.
        all: usize,
    },
    /// An image that cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Views that do not make a camera.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// Detects in all images, which are in the order of the sequence, and makes the table. Errors are
/// plain: all corners count alike and in full.
///
/// # Errors
/// Where a picture cannot be read, too few show the board whole, or the views make no camera.
pub fn run(images: &[impl AsRef<Path> + Sync]) -> Result<Vec<Row>, Table2Error> {
    let mut rows = Vec::new();
    for refinement in [Refinement::Polynomial, Refinement::Model] {
        let views = detect(images, refinement)?;
        if views.len() < LEAST_VIEWS {
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
    // Of a part of the board it is not known which corner is which.
    views.retain(|view| reference().is_sure_of(view));
    Ok(views)
}

/// The table as text; beside it what the paper's corners give on the whole sequence.
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
