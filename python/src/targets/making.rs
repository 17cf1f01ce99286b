//! Checks the formats and keywords of `files` and `save`.

use deltille::export::artifacts::{Making, What};
use deltille::export::mesh::{MAX_TEXTURE_PX, Resolution};
use deltille::export::texture::MAX_TEXTURES;
use deltille::targets::{Target, TargetSpec};
use pyo3::prelude::*;

use crate::boundary::errors::{self, Raise, raised};

/// One format, or several.
#[derive(FromPyObject)]
pub enum Formats {
    One(String),
    Many(Vec<String>),
}

impl Formats {
    /// Parses the names of the formats.
    pub fn parsed(self) -> PyResult<Vec<What>> {
        let names = match self {
            Self::One(format) => vec![format],
            Self::Many(formats) => formats,
        };
        names.iter().map(|name| name.parse().raise(errors::target)).collect()
    }
}

/// The keywords of `files` and `save`.
#[derive(Clone, Copy)]
pub struct Keywords {
    pub dpi: f64,
    pub texture_dpi: Option<f64>,
    pub texture_px: Option<i64>,
    pub textures: Option<i64>,
    pub plate_mm: Option<f64>,
    pub inlay_mm: Option<f64>,
    pub kerf_mm: Option<f64>,
}

impl Keywords {
    /// Checks the keywords for files of these formats.
    pub fn making(self, target: &Target, formats: &[What]) -> PyResult<Making> {
        self.check_use(target, formats)?;
        let is_invalid = |dpi: f64| !(1.0..=1e5).contains(&dpi);
        if is_invalid(self.dpi) || self.texture_dpi.is_some_and(is_invalid) {
            return Err(raised::TargetError::new_err("dpi must be from 1 to 100000"));
        }
        let mut making = Making::default();
        making.dpi = self.dpi;
        making.mesh.resolution = match (self.texture_dpi, self.texture_px) {
            (None, None) => Resolution::Usual,
            (Some(dpi), None) => Resolution::Dpi(dpi),
            (None, Some(px)) => {
                let side = u32::try_from(px).ok().filter(|px| (1..=MAX_TEXTURE_PX).contains(px));
                let refused = || format!("texture_px must be from 1 to {MAX_TEXTURE_PX}");
                Resolution::Side(side.ok_or_else(|| raised::TargetError::new_err(refused()))?)
            }
            (Some(_), Some(_)) => {
                return Err(raised::TargetError::new_err(
                    "texture_dpi and texture_px are mutually exclusive",
                ));
            }
        };
        if let Some(textures) = self.textures {
            let count = u32::try_from(textures).ok().filter(|n| (1..=MAX_TEXTURES).contains(n));
            let refused = || format!("textures must be from 1 to {MAX_TEXTURES}");
            making.mesh.textures = count.ok_or_else(|| raised::TargetError::new_err(refused()))?;
        }
        making.mesh.plate_mm = self.plate_mm.unwrap_or(making.mesh.plate_mm);
        making.mesh.inlay_mm = self.inlay_mm.unwrap_or(making.mesh.inlay_mm);
        making.kerf_mm = self.kerf_mm.unwrap_or(making.kerf_mm);
        Ok(making)
    }

    /// Rejects keywords that none of the formats uses.
    fn check_use(&self, target: &Target, formats: &[What]) -> PyResult<()> {
        use What::{LaserDxf, LaserSvg, ThreeMf};
        let asked = |of: &[What]| formats.iter().any(|format| of.contains(format));
        let textured = asked(&What::TEXTURED);
        let is_solid = matches!(target.spec, TargetSpec::Solid(_));
        if self.plate_mm.is_some() && is_solid {
            return Err(raised::TargetError::new_err(
                "plate_mm applies to boards only, not to solids",
            ));
        }
        if self.plate_mm.is_some() && target.spec.two_sided_mm().is_some() {
            let problem =
                "plate_mm conflicts with two_sided_mm, which sets the thickness of the plate";
            return Err(raised::TargetError::new_err(problem));
        }
        let any = textured || asked(&[ThreeMf]);
        let mesh = "a mesh among the formats, such as gltf";
        let idle = [
            ("texture_dpi", self.texture_dpi.is_some(), textured, mesh),
            ("texture_px", self.texture_px.is_some(), textured, mesh),
            ("textures", self.textures.is_some(), textured, mesh),
            ("plate_mm", self.plate_mm.is_some(), any, mesh),
            ("inlay_mm", self.inlay_mm.is_some(), asked(&[ThreeMf]), "3mf among the formats"),
            (
                "kerf_mm",
                self.kerf_mm.is_some(),
                asked(&[LaserDxf, LaserSvg]),
                "laser-dxf or laser-svg among the formats",
            ),
        ];
        match idle.into_iter().find(|(_, is_given, is_used, _)| *is_given && !is_used) {
            Some((keyword, .., needed)) => {
                Err(raised::TargetError::new_err(format!("{keyword} needs {needed}")))
            }
            None => Ok(()),
        }
    }
}
