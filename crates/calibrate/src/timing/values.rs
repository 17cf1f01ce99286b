//! Views with time stamps, and the timing of cameras as values.

use std::collections::BTreeMap;

use crate::estimate::values::CameraEstimate;
use crate::input::observation::View;
use crate::input::order::in_order;
use deltille_core::camera::{Camera, Pose};

/// A calibrated camera and its views.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedCamera {
    /// Name of the camera.
    pub name: String,
    /// The camera.
    pub camera: Camera,
    /// Its pose on the rig; the identity for a single camera.
    pub camera_from_rig: Pose,
    /// Time stamps, ns, and views, in any order.
    pub views: Vec<(i64, View)>,
}

impl TimedCamera {
    /// Number of views with an earlier time stamp than the one before it, in the order of their names.
    pub(super) fn earlier_frames(&self) -> usize {
        let times: BTreeMap<&str, i64> =
            self.views.iter().map(|(ns, view)| (view.name.as_str(), *ns)).collect();
        let order = in_order(times.keys().copied().collect());
        order.windows(2).filter(|two| times[two[1].as_str()] < times[two[0].as_str()]).count()
    }

    /// A calibrated camera with those of its views that have a time stamp, ns, by name.
    ///
    /// # Errors
    /// Returns an error if an image has another size than those of the calibration.
    pub fn of(
        camera: &CameraEstimate,
        views: Vec<View>,
        times_ns: &BTreeMap<String, i64>,
    ) -> Result<Self, TimingError> {
        let camera_px = [camera.camera.width, camera.camera.height];
        if let Some(other) = views.iter().find(|view| view.size_px != camera_px) {
            return Err(TimingError::OtherSize { size_px: other.size_px, camera_px });
        }
        let stamped = views.into_iter().filter_map(|view| Some((*times_ns.get(&view.name)?, view)));
        Ok(Self {
            name: camera.name.clone(),
            camera: camera.camera.clone(),
            camera_from_rig: camera.camera_from_rig,
            views: stamped.collect(),
        })
    }
}

/// The timing of the cameras of a rig, or of one camera.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Timing {
    /// The cameras, in the given order.
    pub cameras: Vec<CameraTiming>,
    /// Number of frames of the first camera with a smooth motion of the target.
    pub frames: usize,
    /// Median interval between the frames of the first camera, s.
    pub interval_s: f64,
    /// Median speed of the corners in the images of the first camera, px/s.
    pub speed_px_s: f64,
    /// RMS residual per axis, px.
    pub rms_px: f64,
    /// Median standard deviation of a detected corner per axis, px; zero if it is not known.
    pub corner_sd_px: f64,
}

/// Residuals are suspicious beyond this number of standard deviations of corners: blur and paths that are not smooth explain a
/// few.
const MISFIT: f64 = 10.0;

/// Shorter intervals of frames are beyond cameras that take whole images; with longer ones, no motion is smooth.
const INTERVALS_S: std::ops::Range<f64> = 1e-4..10.0;

impl Timing {
    /// Whether the motion determines all readouts and offsets.
    pub(crate) fn is_determined(&self) -> bool {
        let mut cameras = self.cameras.iter().enumerate();
        cameras.all(|(index, of)| of.readout_s.is_some() && (index == 0 || of.offset_s.is_some()))
    }

    /// Sentences about time stamps of another unit or in another order than the frames, and about residuals that the timing does
    /// not explain, without initial capital and full stop.
    pub fn warnings(&self) -> Vec<String> {
        let Self { rms_px, corner_sd_px, interval_s, .. } = *self;
        let unit = (!INTERVALS_S.contains(&interval_s)).then(|| {
            let ms = 1e3 * interval_s;
            format!("frames every {ms:.4} ms: check that the time stamps are in nanoseconds")
        });
        let disordered = self.cameras.iter().filter(|of| of.earlier_frames > 0);
        let order = disordered.map(|CameraTiming { name, earlier_frames, .. }| {
            let name = if name.is_empty() { String::new() } else { format!("{name}: ") };
            format!(
                "{name}time stamps are not in the order of the frames' names; {} before the previous frame: check the time \
                 stamps",
                if *earlier_frames == 1 { "1 is".to_owned() } else { format!("{earlier_frames} are") }
            )
        });
        let is_large = rms_px > MISFIT * corner_sd_px && corner_sd_px > 0.0 && unit.is_none();
        let misfit = is_large.then(|| {
            format!(
                "residuals of the timing ({rms_px:.3} px) are many times the standard deviation of the corners ({corner_sd_px:.3} px): \
                 check the camera, the target, and whether the time stamps are those of the exposures"
            )
        });
        unit.into_iter().chain(order).chain(misfit).collect()
    }
}

/// The timing of one camera.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CameraTiming {
    /// Name of the camera.
    pub name: String,
    /// The time in which all rows are exposed one after the other, s: the number of rows times the line delay. Positive if the
    /// upper rows are exposed first; `None` if the motion does not determine it.
    pub readout_s: Option<Measured>,
    /// Height of the image, px.
    pub height: u32,
    /// Largest displacement of a corner by the readout, between the first and the last row, px.
    pub shear_px: f64,
    /// Time of its middle row minus that of the first camera, for equal time stamps, s, in the middle of the recording.
    /// `None` for the first camera, or if it is undetermined.
    pub offset_s: Option<Measured>,
    /// Change of the offset with time, s/s. `None` for the first camera, or if it is undetermined.
    pub drift: Option<Measured>,
    /// Number of its frames that were used.
    pub frames: usize,
    /// Number of its frames with an earlier time stamp than the frame before it, in the order of their names.
    pub earlier_frames: usize,
}

/// An estimated value and its standard deviation, observed in the scatter between frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
}

/// The normal quantile of a probability of 0.1 % on both sides.
const SIGNIFICANT: f64 = 3.29;

impl Measured {
    /// Whether it differs from zero with a probability of error of 0.1 %.
    pub fn is_significant(&self) -> bool {
        self.value.abs() > SIGNIFICANT * self.sd
    }
}

/// Why the timing cannot be estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TimingError {
    /// Too few successive frames show the target.
    #[error(
        "only {frames} frames{} have neighbours that show the target, of five successive frames each; at least {needed} are \
         needed: record for ten seconds or more with the target in view, and give all frames",
        match camera.as_str() {
            "" => String::new(),
            camera => format!(" of {camera}"),
        }
    )]
    TooFew {
        /// Name of the camera.
        camera: String,
        /// Number of these frames.
        frames: usize,
        /// The minimum.
        needed: usize,
    },
    /// Images have another size than those of the calibration.
    #[error(
        "the images have {} × {} px, the camera {} × {} px",
        size_px[0], size_px[1], camera_px[0], camera_px[1]
    )]
    OtherSize {
        /// Width and height of an image, px.
        size_px: [u32; 2],
        /// Width and height of the images of the calibration, px.
        camera_px: [u32; 2],
    },
    /// The images do not fit any timing.
    #[error(
        "predicted corners are {rms_px:.1} px off (RMS): check that each recording is that of its camera, that the target and the \
         calibration are right, and that the clocks differ by less than {searched} frames"
    )]
    Fit {
        /// RMS residual per axis, px.
        rms_px: f64,
        /// Largest offset that is searched, in frames.
        searched: i32,
    },
}
