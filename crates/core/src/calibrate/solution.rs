use nalgebra::DMatrix;

use super::excluded::Excluded;
use super::finding::Finding;
use super::lens_end::LensEnd;
use super::misfit::Misfit;
use super::panel::PanelRef;
use super::shape::BoardShape;
use crate::camera::{Camera, Pose};

/// A camera as the views have it, with what that is worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The camera.
    pub camera: Camera,
    /// Its parameters, those that were found and those that were kept.
    pub parameters: Vec<Parameter>,
    /// Covariance of the parameters that were found, in their order.
    pub covariance: DMatrix<f64>,
    /// The views, in the order given.
    pub views: Vec<ViewSolution>,
    /// Views that do not belong with the others and took no part, and why.
    pub excluded: Vec<Excluded>,
    /// Root mean square error of a coordinate over all views, px: √(Σ(dx² + dy²)/2N).
    pub rms_px: f64,
    /// The deviation that was added to every corner's covariance, px; `None` where corners were
    /// taken as equally precise.
    pub common_px: Option<f64>,
    /// A-posteriori standard deviation of a coordinate: in px where corners were taken as equally
    /// precise, else in units of what its covariance says. All covariances are scaled by its square.
    pub sigma: f64,
    /// Names of parameters that the views cannot tell apart: some change of them together moves no
    /// corner, and their deviations are the least that they can be; or hardly any, so that neither the
    /// value nor the deviation of one alone means anything.
    pub loose: Vec<String>,
    /// The shape of the board's sheet, where it was to be found.
    pub shape: Option<BoardShape>,
    /// Patterns in the residuals that noise does not make, the strongest first.
    pub misfits: Vec<Misfit>,
    /// What outliers share, and corners that were left out together.
    pub findings: Vec<Finding>,
    /// Steps of the last bundle adjustment.
    pub steps: usize,
}

/// A parameter of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name, such as `k1`.
    pub name: String,
    /// Its value; lengths in px or mm.
    pub value: f64,
    /// Its standard deviation; `None` where it was not to be found.
    pub sd: Option<f64>,
}

/// A view as the camera explains it.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewSolution {
    /// Name of the view.
    pub name: String,
    /// File name of its picture.
    pub image: String,
    /// camera_from_target.
    pub pose: Pose,
    /// Standard deviations of the pose: of a turn (rad) and a move (mm) along the axes of the camera.
    pub pose_sd: [f64; 6],
    /// Root mean square error of a coordinate, px.
    pub rms_px: f64,
    /// The corners.
    pub corners: Vec<Corner>,
}

/// A corner as the camera explains it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// The panel.
    pub panel: PanelRef,
    /// Lattice row.
    pub row: i32,
    /// Lattice column.
    pub col: i32,
    /// Where it was seen, px.
    pub pixel: [f64; 2],
    /// Seen less predicted position, px.
    pub residual: [f64; 2],
    /// Whether it is farther off than corners are by chance.
    pub outlier: bool,
}

impl Solution {
    /// Correlation of two of the parameters that were found.
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        let c = &self.covariance;
        c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt()
    }

    /// The names of the parameters that were found.
    pub fn found(&self) -> impl Iterator<Item = &str> {
        self.parameters.iter().filter(|p| p.sd.is_some()).map(|p| p.name.as_str())
    }

    /// How many corners took part.
    pub fn corner_count(&self) -> usize {
        self.corners().count()
    }

    /// How many corners are outliers.
    pub fn outlier_count(&self) -> usize {
        self.corners().filter(|corner| corner.outlier).count()
    }

    /// [`Self::rms_px`] of the corners that are no outliers.
    pub fn inlier_rms_px(&self) -> f64 {
        let inliers = self.corners().filter(|corner| !corner.outlier);
        rms_px(inliers.map(|corner| &corner.residual))
    }

    /// Where the lens ends to be good, if that is within the image.
    pub fn lens_end(&self) -> Option<LensEnd> {
        let seen: Vec<[f64; 2]> = self.corners().map(|corner| corner.pixel).collect();
        LensEnd::of(&self.camera, &seen)
    }

    fn corners(&self) -> impl Iterator<Item = &Corner> {
        self.views.iter().flat_map(|view| &view.corners)
    }
}

impl ViewSolution {
    /// How many of its corners are outliers.
    pub fn outlier_count(&self) -> usize {
        self.corners.iter().filter(|corner| corner.outlier).count()
    }
}

/// √(Σ(dx² + dy²)/2N); zero of none.
pub(super) fn rms_px<'a>(residuals: impl Iterator<Item = &'a [f64; 2]>) -> f64 {
    let (sum, count) =
        residuals.fold((0.0, 0), |(sum, count), [x, y]| (sum + x * x + y * y, count + 2));
    if count == 0 { 0.0 } else { (sum / f64::from(count)).sqrt() }
}
