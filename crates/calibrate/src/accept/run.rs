//! From new views to an acceptance.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector, Matrix2, Matrix3};

use super::acceptance::{Acceptance, Budget, LengthError, Probing};
use super::in_plane::{InPlane, Seen};
use super::lines;
use super::request::{AcceptanceRequest, CornerLabel};
use super::sensitivity::{Measured, Point, Variances, variance};
use super::triangulated::{Image, Triangulated};
use crate::estimate::coverage::Coverage;
use crate::estimate::on_rig::CameraOnRig;
use crate::estimate::values::Estimate;
use crate::input::calibration::Calibration;
use crate::input::observation::{MIN_CORNERS, Observation, View};
use crate::problem::corner_map::CornerMap;
use crate::start::pose::{estimate_pose, median_off_px};
use crate::uncertainty::board_errors::{SHEET, accuracy, sheets};
use deltille_core::camera::Pose;

/// A view repeats one of the calibration if the pose of that view fits it with a median residual below this number of its RMS
/// residuals.
const SAME: f64 = 2.0;

/// Largest RMS residual of measured corners in a frame, relative to the longer side of the image; as in a check.
const FITS: f64 = 0.005;

/// Why an acceptance test is not possible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AcceptanceError {
    /// The calibration has no observed covariance.
    #[error(
        "no observed covariance, so that the uncertainty of lengths is not known: give the .json of a calibration from several \
         views, with estimated cameras"
    )]
    Uncertainty,
    /// A view has another size than the camera.
    #[error(
        "{image} has {} × {} px, but the camera was calibrated at {} × {} px: lengths can be measured only at the same size",
        size_px[0],
        size_px[1],
        camera_px[0],
        camera_px[1]
    )]
    Size {
        /// The image.
        image: String,
        /// Its width and height, px.
        size_px: [u32; 2],
        /// Those of the camera, px.
        camera_px: [u32; 2],
    },
    /// Measured corners do not project to where they were seen.
    #[error(
        "{frame}: measured corners are {rms_px:.1} px off (RMS): check that the photographs are those of {}, and that the target \
         is right",
        match is_rig {
            true => "their cameras, that those of the same name were taken at the same time",
            false => "the camera",
        }
    )]
    Fit {
        /// The frame.
        frame: String,
        /// RMS residual per axis, px.
        rms_px: f64,
        /// Whether corners are triangulated.
        is_rig: bool,
    },
    /// One camera takes the scale from the target.
    #[error(
        "one camera takes the scale from the target, so that its expansion has no effect: omit the temperature and the expansion"
    )]
    Temperature,
    /// The poses of all views are those of views of the calibration.
    #[error(
        "all {views} views were used for the calibration, or repeat their poses: take other photographs"
    )]
    Reused {
        /// Number of views.
        views: usize,
    },
    /// No frame measures a length.
    #[error(
        "no lengths were measured: {}",
        match (is_rig, are_known) {
            (true, false) => "two cameras must see six or more of the same corners at the same time",
            (false, false) => "each photograph must show six or more corners",
            (true, true) => "two cameras must see both ends of a given length at the same time",
            (false, true) => "a photograph must show both ends of a given length",
        }
    )]
    NoLengths {
        /// Whether corners are triangulated.
        is_rig: bool,
        /// Whether lengths were given.
        are_known: bool,
    },
}

/// The views of each frame, with the indices of their cameras.
type Frames = BTreeMap<String, Vec<(usize, View)>>;

/// What all frames have in common.
struct Test<'a> {
    request: &'a AcceptanceRequest,
    cameras: Vec<CameraOnRig<'a>>,
    panels: Vec<Pose>,
    /// The observed covariance of the unknowns, and its degrees of freedom.
    covariance: &'a DMatrix<f64>,
    freedom: f64,
    /// Factor of the variances of corners, and the variance that is added to them, px².
    scale: f64,
    other_px2: f64,
    target: TargetErrors,
}

/// Errors of the target: independent ones of its corners, and distortions of the sheet of each panel.
struct TargetErrors {
    /// The columns of a corner in `sheets`.
    columns: BTreeMap<CornerLabel, usize>,
    sheets: DMatrix<f64>,
    accuracy_mm: f64,
}

impl Calibration {
    /// Measures lengths of the target with the cameras of an earlier estimate, in the same order. Of this calibration, the
    /// views, the panels and [`board_accuracy_mm`](Self::board_accuracy_mm) are used; intrinsics are ignored. Views of several
    /// cameras that were taken at the same time have the same name.
    ///
    /// Rigs triangulate the corners that two or more cameras see. One camera measures corners in the plane of their panel.
    ///
    /// # Errors
    /// Returns an error if the calibration has no observed covariance, or if no length was measured.
    pub fn accept(
        &self,
        before: &Estimate,
        request: &AcceptanceRequest,
    ) -> Result<Acceptance, AcceptanceError> {
        let is_triangulated = before.cameras.len() > 1;
        if request.temperature.is_some() && !is_triangulated {
            return Err(AcceptanceError::Temperature);
        }
        self.check_sizes(before)?;
        let (views, reused) = self.new_views(before);
        let count = views.values().map(Vec::len).sum::<usize>();
        if count == 0 && !reused.is_empty() {
            return Err(AcceptanceError::Reused { views: reused.len() });
        }
        let test = self.test(before, request).ok_or(AcceptanceError::Uncertainty)?;
        let mut found = Acceptance {
            is_triangulated,
            lengths: Vec::new(),
            probing: Probing::default(),
            measured: Vec::new(),
            unmeasured: Vec::new(),
            reused,
            observations: 0,
            extrapolated: 0,
            board_accuracy_mm: test.target.accuracy_mm,
            request: request.clone(),
        };
        let sides = before.cameras.iter().map(|of| of.camera.width.max(of.camera.height));
        let side = f64::from(sides.max().unwrap_or(0));
        let coverages: Vec<Coverage> = before.cameras.iter().map(Coverage::of).collect();
        let mut squares = 0.0;
        for (name, views) in &views {
            let measured: Option<Box<dyn Measured>> = match is_triangulated {
                true => Some(Box::new(test.triangulated(views))),
                false => test.in_plane(&views[0].1).map(|of| Box::new(of) as _),
            };
            let Some(measured) = measured.filter(|of| of.points().len() >= MIN_CORNERS) else {
                found.unmeasured.push(name.clone());
                continue;
            };
            let rms_px = measured.rms_px();
            if rms_px.is_nan() || rms_px > FITS * side {
                let frame = name.clone();
                return Err(AcceptanceError::Fit { frame, rms_px, is_rig: is_triangulated });
            }
            found.measured.push(name.clone());
            let views = views.iter().filter(|(camera, _)| !coverages[*camera].is_empty());
            for (camera, view) in views {
                for (_, seen) in observations(view) {
                    let is_known = coverages[*camera]
                        .has_corners(seen.pixel, before.cameras[*camera].size_px());
                    found.observations += 1;
                    found.extrapolated += usize::from(!is_known);
                }
            }
            found.lengths.extend(test.lengths(name, measured.as_ref()));
            squares += found.probing.add(name, measured.points(), is_triangulated);
        }
        if found.lengths.is_empty() {
            let are_known = !request.lengths.is_empty();
            return Err(AcceptanceError::NoLengths { is_rig: is_triangulated, are_known });
        }
        found.probing.rms_mm = (squares / found.probing.corners as f64).sqrt();
        Ok(found)
    }

    fn check_sizes(&self, before: &Estimate) -> Result<(), AcceptanceError> {
        for (of, known) in self.cameras.iter().zip(&before.cameras) {
            let camera_px = [known.camera.width, known.camera.height];
            if let Some(view) = of.views.iter().find(|view| view.size_px != camera_px) {
                let (image, size_px) = (view.image.clone(), view.size_px);
                return Err(AcceptanceError::Size { image, size_px, camera_px });
            }
        }
        Ok(())
    }

    /// The new views, and the names of those that were used for the calibration.
    fn new_views(&self, before: &Estimate) -> (Frames, Vec<String>) {
        let (mut frames, mut reused) = (Frames::new(), Vec::new());
        let panels = self.panel_poses();
        for (index, (of, known)) in self.cameras.iter().zip(&before.cameras).enumerate() {
            for view in &of.views {
                let is_used = known.views.iter().any(|of| {
                    let off_px = median_off_px(&known.camera, &panels, &view.sightings, &of.pose);
                    off_px < SAME * of.rms_px
                });
                match is_used {
                    true => reused.push(view.image.clone()),
                    false => {
                        frames.entry(view.name.clone()).or_default().push((index, view.clone()))
                    }
                }
            }
        }
        (frames, reused)
    }

    /// `None` without an observed covariance of the estimate.
    fn test<'a>(&self, before: &'a Estimate, request: &'a AcceptanceRequest) -> Option<Test<'a>> {
        let (cameras, observed) = before.cameras_on_rig()?;
        let (covariance, variance) = (observed.covariance.inner(), before.sigma.powi(2));
        // Without a common standard deviation, all corners had equal weights, and sigma is that of a corner.
        let (scale, other_px2) = match before.common_px {
            Some(common_px) => (variance, common_px * common_px * variance),
            None => (0.0, variance),
        };
        Some(Test {
            request,
            cameras,
            panels: self.panel_poses(),
            covariance,
            freedom: observed.freedom,
            scale,
            other_px2,
            target: self.target_errors(),
        })
    }

    fn target_errors(&self) -> TargetErrors {
        let views = self.cameras.iter().flat_map(|of| &of.views);
        let seen = views.flat_map(|view| &view.sightings);
        let map = CornerMap::of(seen.map(|seen| (seen.panel, seen.observations.as_slice())));
        let labels = map.corners.iter().map(|of| label(of.panel, of.row, of.col));
        TargetErrors {
            columns: labels.enumerate().map(|(index, label)| (label, 3 * index)).collect(),
            sheets: sheets(&map, &SHEET),
            accuracy_mm: accuracy(&map, self.board_accuracy_mm).unwrap_or(0.0),
        }
    }
}

impl TargetErrors {
    /// The variance of a length from its derivatives with respect to offsets of the corners.
    fn variance(&self, by: &[(CornerLabel, DVec3)]) -> f64 {
        let mut row = DVector::zeros(self.sheets.nrows());
        for (label, by) in by {
            let Some(&first) = self.columns.get(label) else { continue };
            (0..3).for_each(|i| row[first + i] += by[i]);
        }
        let by_sheets = self.sheets.tr_mul(&row);
        self.accuracy_mm.powi(2) * (row.norm_squared() + by_sheets.norm_squared())
    }
}

impl Test<'_> {
    fn variances(&self, seen: &Observation) -> Variances {
        let [xx, xy, yy] = seen.cov.unwrap_or_default();
        Variances { noise: Matrix2::new(xx, xy, xy, yy) * self.scale, other: self.other_px2 }
    }

    /// The corners of a frame that two or more cameras see.
    fn triangulated(&self, views: &[(usize, View)]) -> Triangulated {
        let mut corners: BTreeMap<CornerLabel, (DVec3, Option<DVec3>, Vec<Image>)> =
            BTreeMap::new();
        for (index, view) in views {
            let camera = &self.cameras[*index];
            let pose = estimate_pose(&camera.estimate.camera, &self.panels, &view.sightings);
            let rig_from_camera = camera.estimate.camera_from_rig.inverse();
            for (label, seen) in observations(view) {
                let known = self.panels[label.panel.index()].apply(seen.panel_mm);
                let of = corners.entry(label).or_insert((known, None, Vec::new()));
                of.1 = of.1.or(pose.map(|pose| rig_from_camera.after(&pose).apply(known)));
                let variances = self.variances(seen);
                of.2.push(Image { camera, pixel: seen.pixel, variances });
            }
        }
        let mut found = Triangulated::new(&self.panels);
        for (label, (known, start, images)) in corners {
            if let Some(start) = start.filter(|_| images.len() > 1) {
                // A corner whose position is undetermined is not measured.
                let _ = found.add(label, known, start, &images, self.covariance.nrows());
            }
        }
        found
    }

    /// The corners of an image.
    fn in_plane(&self, view: &View) -> Option<InPlane> {
        let camera = &self.cameras[0];
        let start = estimate_pose(&camera.estimate.camera, &self.panels, &view.sightings)?;
        let seen: Vec<Seen> = observations(view)
            .map(|(label, seen)| {
                (label, seen, &self.panels[label.panel.index()], self.variances(seen))
            })
            .collect();
        InPlane::of(camera, &seen, start)
    }

    /// The lengths that a frame measures.
    fn lengths(&self, frame: &str, measured: &dyn Measured) -> Vec<LengthError> {
        let points = measured.points();
        let index: BTreeMap<CornerLabel, usize> =
            points.iter().enumerate().map(|(index, point)| (point.label, index)).collect();
        let known = self.request.lengths.iter().filter_map(|of| {
            let ends = [*index.get(&of.ends[0])?, *index.get(&of.ends[1])?];
            Some((ends, of.length_mm, Some(of.sd_mm)))
        });
        let described = || {
            let at: Vec<DVec3> = points.iter().map(|point| point.known).collect();
            let pairs = lines::lengths(&at).into_iter();
            pairs.map(move |ends| (ends, at[ends[0]].distance(at[ends[1]]), None)).collect()
        };
        let lengths: Vec<([usize; 2], f64, Option<f64>)> = match self.request.lengths.is_empty() {
            true => described(),
            false => known.collect(),
        };
        let (strain, strain_sd) = self.request.temperature.map_or((0.0, 0.0), |of| of.strain());
        let of = lengths.into_iter().map(|(ends, length_mm, sd_mm)| {
            let by = measured.sensitivity(ends, sd_mm.is_some());
            let of_target = self.target.variance(&by.by_target);
            let [a, b] = ends.map(|i| points[i].measured);
            LengthError {
                frame: frame.to_owned(),
                ends: ends.map(|i| points[i].label),
                known_mm: length_mm * (1.0 + strain),
                measured_mm: a.distance(b),
                budget: Budget {
                    noise_mm: by.noise_mm2.sqrt(),
                    lens_mm: by.lens_mm2.sqrt(),
                    calibration_mm: variance(&by.by_cameras, self.covariance).sqrt(),
                    target_mm: (of_target + sd_mm.unwrap_or(0.0).powi(2)).sqrt(),
                    temperature_mm: length_mm * strain_sd,
                    calibration_freedom: self.freedom,
                },
            }
        });
        of.collect()
    }
}

impl Probing {
    /// Adds the corners of a frame, and returns the sum of the squares of their deviations.
    fn add(&mut self, frame: &str, points: &[Point], is_triangulated: bool) -> f64 {
        let fitted = if is_triangulated { rigid(points) } else { Pose::IDENTITY };
        let mut squares = 0.0;
        for point in points {
            let off = point.measured.distance(fitted.apply(point.known));
            squares += off * off;
            if self.at.is_none() || off > self.largest_mm {
                self.largest_mm = off;
                self.at = Some((point.label, frame.to_owned()));
            }
        }
        self.corners += points.len();
        squares
    }
}

/// The rigid motion from the known to the measured points with the least squares (Arun, Huang and Blostein 1987).
fn rigid(points: &[Point]) -> Pose {
    let count = points.len() as f64;
    let known = points.iter().map(|point| point.known).sum::<DVec3>() / count;
    let measured = points.iter().map(|point| point.measured).sum::<DVec3>() / count;
    let mut product = Matrix3::zeros();
    for point in points {
        let [a, b] = [point.known - known, point.measured - measured];
        product += Matrix3::from_fn(|i, j| b[i] * a[j]);
    }
    let svd = product.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Pose::IDENTITY };
    let mut signs = Matrix3::identity();
    signs[(2, 2)] = (u * v_t).determinant().signum();
    let rotation = u * signs * v_t;
    let columns: Vec<f64> = rotation.iter().copied().collect();
    let rotation = glam::DQuat::from_mat3(&DMat3::from_cols_slice(&columns));
    Pose { rotation, translation: measured - rotation * known }
}

/// The corners of a view.
fn observations(view: &View) -> impl Iterator<Item = (CornerLabel, &Observation)> {
    view.sightings.iter().flat_map(|sighting| {
        let of = sighting.observations.iter();
        of.map(|seen| (label(sighting.panel, seen.row, seen.col), seen))
    })
}

fn label(panel: crate::PanelRef, row: i32, col: i32) -> CornerLabel {
    CornerLabel { panel, row, col }
}
