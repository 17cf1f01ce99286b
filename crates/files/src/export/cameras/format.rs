//! The formats of cameras and of rigs: each has a row in a table and a writer in [`super::camera`].

use super::camera::{
    COLMAP, FormatError, KALIBR, MRCAL, Models, NERFSTUDIO, OPENCV, ROS, colmap, colmap_rig,
    kalibr, mrcal, nerfstudio, opencv, ros,
};
use crate::export::named::Format;
use deltille_core::camera::{Camera, CameraFile, Pose};

/// A format of cameras.
#[derive(Clone, Copy)]
pub struct CameraFormat {
    /// The models that it supports; `None` for the project's own format, which supports every model.
    models: Option<&'static Models>,
    /// The end of the file name, after the name of the camera.
    pub end: &'static str,
    text: fn(&Written) -> Result<String, FormatError>,
}

/// The data to write for a camera.
pub struct Written<'a> {
    /// The camera.
    pub file: &'a CameraFile,
    /// Its name.
    pub name: &'a str,
    /// Its images, with the camera_from_target of each.
    pub views: &'a [(&'a str, Pose)],
}

/// The formats.
pub const CAMERA_FORMATS: &[CameraFormat] = &[
    CameraFormat { models: None, end: ".yaml", text: |of| Ok(of.file.to_yaml()) },
    CameraFormat { models: Some(&OPENCV), end: "-opencv.yaml", text: |of| opencv(&of.file.camera) },
    CameraFormat { models: Some(&ROS), end: "-ros.yaml", text: |of| ros(&of.file.camera, of.name) },
    CameraFormat {
        models: Some(&KALIBR),
        end: "-camchain.yaml",
        text: |of| kalibr(&[(&of.file.camera, Pose::IDENTITY)], &[]),
    },
    CameraFormat {
        models: Some(&COLMAP),
        end: "-cameras.txt",
        text: |of| colmap(&[&of.file.camera]),
    },
    CameraFormat {
        models: Some(&NERFSTUDIO),
        end: "-transforms.json",
        text: |of| nerfstudio(&of.file.camera, of.views),
    },
    CameraFormat { models: Some(&MRCAL), end: ".cameramodel", text: |of| mrcal(&of.file.camera) },
];

impl CameraFormat {
    /// Whether it is the project's own format, which every command reads.
    pub fn is_own(&self) -> bool {
        self.models.is_none()
    }

    /// The names of the models that it supports; empty if it supports all.
    pub fn models(&self) -> Vec<String> {
        self.models.map(Models::names).unwrap_or_default()
    }

    /// Returns the text of a file.
    ///
    /// # Errors
    /// Returns an error if the format does not support the lens model.
    pub fn text(&self, written: &Written) -> Result<String, FormatError> {
        (self.text)(written)
    }
}

impl Format for CameraFormat {
    fn name(&self) -> &'static str {
        self.models.map_or("own", |models| models.format)
    }

    fn help(&self) -> String {
        let and_json = ": the camera file for all deltille commands; <name>.json: uncertainties, poses and, with \
                        --residuals, every corner";
        format!("<name>{}{}", self.end, if self.is_own() { and_json } else { "" })
    }
}

/// A format of rigs.
#[derive(Clone, Copy)]
pub struct RigFormat {
    name: &'static str,
    /// The files of the format.
    pub files: &'static [RigFile],
}

/// A file of a rig.
#[derive(Clone, Copy)]
pub struct RigFile {
    /// The name that selects only this file.
    name: &'static str,
    /// The file name.
    pub file: &'static str,
    text: fn(&[Placed], Overlaps) -> Result<String, FormatError>,
}

/// A camera with its name and its camera_from_rig.
pub type Placed<'a> = (&'a str, &'a Camera, Pose);

/// For each camera, the indices of the cameras whose field of view overlaps its own.
pub type Overlaps<'a> = &'a [Vec<usize>];

/// The formats of rigs.
pub const RIG_FORMATS: &[RigFormat] = &[
    RigFormat {
        name: "kalibr",
        files: &[RigFile {
            name: "kalibr",
            file: "camchain.yaml",
            text: |cameras, overlaps| {
                let placed = cameras.iter().map(|(_, camera, pose)| (*camera, *pose));
                kalibr(&placed.collect::<Vec<_>>(), overlaps)
            },
        }],
    },
    RigFormat {
        name: "colmap",
        files: &[
            RigFile {
                name: "colmap",
                file: "cameras.txt",
                text: |cameras, _| {
                    colmap(&cameras.iter().map(|(_, camera, _)| *camera).collect::<Vec<_>>())
                },
            },
            RigFile {
                name: "colmap-rig",
                file: "rig_config.json",
                text: |cameras, _| colmap_rig(cameras),
            },
        ],
    },
];

impl RigFile {
    /// Returns the text of the file.
    ///
    /// # Errors
    /// Returns an error if the format does not support the lens model.
    pub fn text(&self, cameras: &[Placed], overlaps: &[Vec<usize>]) -> Result<String, FormatError> {
        (self.text)(cameras, overlaps)
    }
}

impl Format for RigFormat {
    fn name(&self) -> &'static str {
        self.name
    }

    fn help(&self) -> String {
        self.files.iter().map(|file| file.file).collect::<Vec<_>>().join(" and ")
    }
}

impl Format for RigFile {
    fn name(&self) -> &'static str {
        self.name
    }

    fn help(&self) -> String {
        self.file.to_owned()
    }
}
