//! The format of an artifact, from the extension of its file name.

use std::path::Path;

/// The format of an artifact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Format {
    /// Portable Document Format.
    Pdf,
    /// Scalable Vector Graphics.
    Svg,
    /// Portable Network Graphics.
    Png,
    /// glTF 2.0 binary.
    Glb,
    /// Wavefront OBJ.
    Obj,
    /// Binary STL.
    Stl,
    /// List of boards, corners and tags for other detectors.
    Dsc,
    /// Drawing for a cutter.
    Dxf,
    /// Model for Gazebo.
    Sdf,
    /// Model for ROS.
    Urdf,
    /// Model for MuJoCo.
    Mjcf,
    /// Universal Scene Description, as text.
    Usda,
    /// Two bodies to print in two colours.
    #[serde(rename = "3mf")]
    ThreeMf,
}

impl Format {
    /// All formats with their file extensions.
    pub const ALL: [(Self, &str); 13] = [
        (Self::Pdf, "pdf"),
        (Self::Svg, "svg"),
        (Self::Png, "png"),
        (Self::Glb, "glb"),
        (Self::Obj, "obj"),
        (Self::Stl, "stl"),
        (Self::Dsc, "dsc"),
        (Self::Dxf, "dxf"),
        (Self::Sdf, "sdf"),
        (Self::Urdf, "urdf"),
        (Self::Mjcf, "xml"),
        (Self::Usda, "usda"),
        (Self::ThreeMf, "3mf"),
    ];

    /// Returns the format for the extension of a file name, `None` for an unknown extension.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_string_lossy().to_lowercase();
        Self::ALL.iter().find(|(_, known)| *known == extension).map(|(format, _)| *format)
    }

    /// Whether files of this format are printed pages.
    pub fn is_document(self) -> bool {
        matches!(self, Self::Pdf | Self::Svg | Self::Png)
    }
}
