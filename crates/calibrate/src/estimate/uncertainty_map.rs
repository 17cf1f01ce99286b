//! The projection uncertainty of an estimated camera over its image.

use glam::{DMat2, DVec2};

use super::coverage::Coverage;
use super::values::CameraEstimate;
use crate::matrix::Matrix;
use crate::uncertainty::projection::{Source, by_motion, by_parameters, seen_at};
use deltille_core::camera::Undistortion;

/// A map of the projection uncertainty of a camera over its image.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct UncertaintyMap {
    /// Distance of the points, mm; `None` for points at infinity.
    pub distance_mm: Option<f64>,
    /// The source of the standard deviations.
    pub source: Source,
    /// Number of positions along a row.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
    /// Standard deviation of a projection along the worst direction, px, row by row; `None` beyond
    /// the field of view of the lens.
    pub sd_px: Vec<Option<f64>>,
}

/// The uncertainty of positions in an undistorted view that is due to the estimated camera.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ViewUncertainty {
    /// Standard deviation of a position, px: RMS per axis where corners were detected.
    pub position_sd_px: f64,
    /// Fraction of the view in which corners were detected. Elsewhere the lens is extrapolated.
    pub calibrated_fraction: f64,
    /// The source of the standard deviation.
    pub source: Source,
}

/// Number of positions along the longer side of an image.
const POSITIONS: usize = 24;

/// Number of corners that suffices for the mean uncertainty over the part of the image with
/// corners.
const ENOUGH_CORNERS: usize = 1000;

impl CameraEstimate {
    /// The covariance of its estimated parameters, in their order; `None` if this source does not provide one.
    pub fn covariance_from(&self, source: Source) -> Option<&Matrix> {
        match source {
            Source::Noise => (self.covariance.rows() > 0).then_some(&self.covariance),
            Source::Observed => Some(&self.projection.as_ref()?.observed.as_ref()?.covariance),
        }
    }

    /// Covariance of the projection of the point seen at a pixel, px²; `None` beyond the field of
    /// view of the lens, or if it is not known. The point is at a distance in mm, or at infinity.
    pub fn projection_covariance(
        &self,
        pixel: DVec2,
        distance_mm: Option<f64>,
        source: Source,
    ) -> Option<[[f64; 2]; 2]> {
        let covariance = self.covariance_from(source)?.inner();
        let point = seen_at(&self.camera, pixel, distance_mm)?;
        let at = self.camera.project_with_derivatives(point)?;
        let alignment = self.projection.as_ref()?.alignment.inner();
        let mut by_motion = by_motion(&at, point);
        if distance_mm.is_none() {
            by_motion.fixed_columns_mut::<3>(3).fill(0.0);
        }
        let by_all = by_parameters(&at, &self.free()) + by_motion * alignment;
        let found = &by_all * covariance * by_all.transpose();
        Some([[found[(0, 0)], found[(0, 1)]], [found[(1, 0)], found[(1, 1)]]])
    }

    /// The uncertainty map for points at a distance in mm, or at infinity; `None` if it is not known.
    pub fn uncertainty_map(
        &self,
        distance_mm: Option<f64>,
        source: Source,
    ) -> Option<UncertaintyMap> {
        self.covariance_from(source)?;
        self.projection.as_ref()?;
        let size = DVec2::new(f64::from(self.camera.width), f64::from(self.camera.height));
        let parts = (size * POSITIONS as f64 / size.max_element()).round().max(DVec2::ONE);
        let (columns, rows) = (parts.x as usize, parts.y as usize);
        let sd = |place: usize| {
            let at = DVec2::new((place % columns) as f64, (place / columns) as f64) + 0.5;
            let pixel = at * size / parts - 0.5;
            Some(worst(self.projection_covariance(pixel, distance_mm, source)?).sqrt())
        };
        let sd_px = (0..columns * rows).map(sd).collect();
        Some(UncertaintyMap { distance_mm, source, columns, rows, sd_px })
    }

    /// The uncertainty maps at infinity and at the distances of
    /// [`ProjectionUncertainty::distances_mm`](crate::ProjectionUncertainty::distances_mm), from
    /// noise and observed, if these are known.
    pub fn uncertainty_maps(&self) -> Vec<UncertaintyMap> {
        let distances = self.projection.iter().flat_map(|known| &known.distances_mm);
        let distances = std::iter::once(None).chain(distances.map(|&mm| Some(mm)));
        let both = distances.flat_map(|mm| [(mm, Source::Noise), (mm, Source::Observed)]);
        both.filter_map(|(mm, source)| self.uncertainty_map(mm, source)).collect()
    }

    /// Covariance of a position in an undistorted view, px², that is due to the estimated camera, for points at infinity; `None` where
    /// the camera sees nothing, or if it is not known.
    ///
    /// The view shows at v the pixel p(v) of the image. A projection that is off by δp is off by −(∂p/∂v)⁻¹ δp in the view.
    pub fn undistorted_covariance(
        &self,
        view: &Undistortion,
        pixel: DVec2,
        source: Source,
    ) -> Option<[[f64; 2]; 2]> {
        let at = view.source(pixel)?;
        let [[xx, xy], [_, yy]] = self.projection_covariance(at, None, source)?;
        let along = |axis: DVec2| {
            let [more, less] = [1.0, -1.0].map(|side| view.source(pixel + side * axis));
            Some(match (more, less) {
                (Some(more), Some(less)) => (more - less) / 2.0,
                (Some(more), None) => more - at,
                (None, less) => at - less?,
            })
        };
        let by_view = DMat2::from_cols(along(DVec2::X)?, along(DVec2::Y)?);
        let by_source = by_view.inverse();
        let covariance = DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy));
        let found = by_source * covariance * by_source.transpose();
        found.is_finite().then(|| found.to_cols_array_2d())
    }

    /// The uncertainty of positions in an undistorted view, observed if that is known, otherwise from noise; `None` if neither is.
    pub fn view_uncertainty(&self, view: &Undistortion) -> Option<ViewUncertainty> {
        let from = |source| self.view_uncertainty_from(view, source);
        from(Source::Observed).or_else(|| from(Source::Noise))
    }

    fn view_uncertainty_from(
        &self,
        view: &Undistortion,
        source: Source,
    ) -> Option<ViewUncertainty> {
        let size = DVec2::new(f64::from(view.view().width), f64::from(view.view().height));
        let steps = (size * POSITIONS as f64 / size.max_element()).round().max(DVec2::ONE);
        let coverage = Coverage::of(self);
        let (mut sum, mut seen, mut all) = (0.0, 0.0, 0.0);
        for row in 0..=steps.y as usize {
            for column in 0..=steps.x as usize {
                let pixel = DVec2::new(column as f64, row as f64) * (size - 1.0) / steps;
                let Some(at) = view.source(pixel) else { continue };
                all += 1.0;
                if coverage.has_corners(at, self.size_px()) {
                    let found = self.undistorted_covariance(view, pixel, source)?;
                    sum += f64::midpoint(found[0][0], found[1][1]);
                    seen += 1.0;
                }
            }
        }
        (seen > 0.0).then(|| ViewUncertainty {
            position_sd_px: (sum / seen).sqrt(),
            calibrated_fraction: seen / all,
            source,
        })
    }

    /// Standard deviation of a projection per axis, px: the RMS over the detected corners. `None` if it is not known.
    pub fn projection_sd_px(&self, distance_mm: Option<f64>, source: Source) -> Option<f64> {
        let every = self.corner_count().div_ceil(ENOUGH_CORNERS).max(1);
        let corners = self.corners().step_by(every).map(|corner| (corner.pixel, 1));
        let mut places: Vec<(DVec2, u32)> = corners.collect();
        if let (true, Some(coverage)) = (places.is_empty(), &self.coverage) {
            places = coverage.places(self.size_px()).collect();
        }
        let (mut sum, mut total) = (0.0, 0.0);
        for (pixel, count) in places {
            let found = self.projection_covariance(pixel, distance_mm, source);
            let Some([[xx, _], [_, yy]]) = found else { continue };
            sum += f64::from(count) * f64::midpoint(xx, yy);
            total += f64::from(count);
        }
        (total > 0.0).then(|| (sum / total).sqrt())
    }

    /// Observed standard deviation of each of its parameters; `None` for parameters that were not estimated, or if it
    /// is not known.
    pub fn observed_sd(&self) -> Vec<Option<f64>> {
        let observed = self.covariance_from(Source::Observed);
        let mut of_found = (0..).filter_map(|i| observed.map(|c| c[(i, i)].sqrt()));
        let known = observed.is_some();
        let parameters = self.parameters.iter();
        parameters.map(|p| if known && p.sd.is_some() { of_found.next() } else { None }).collect()
    }

    /// Indices of the estimated parameters.
    pub(crate) fn free(&self) -> Vec<usize> {
        let parameters = self.parameters.iter().enumerate();
        parameters.filter(|(_, p)| p.sd.is_some()).map(|(index, _)| index).collect()
    }
}

/// The variance along the worst direction.
fn worst([[xx, xy], [_, yy]]: [[f64; 2]; 2]) -> f64 {
    (xx + yy) / 2.0 + ((xx - yy) / 2.0).hypot(xy)
}
