//! The logo option.

use std::path::Path;

use anyhow::{anyhow, ensure};

use deltille::layout::PaperSpec;
use deltille::limits;
use deltille::logo::{self, LogoError, MAX_LOGO_BYTES};

/// Adds the logo in a file, with this height, to a paper.
pub fn on(
    paper: PaperSpec,
    file: Option<impl AsRef<Path>>,
    logo_height_mm: Option<f64>,
) -> anyhow::Result<PaperSpec> {
    let Some(file) = file else { return Ok(PaperSpec { logo_height_mm, ..paper }) };
    let file = file.as_ref();
    let is_svg = file.extension().is_none_or(|end| end.eq_ignore_ascii_case("svg"));
    ensure!(is_svg, "--logo: {}: use an SVG file (.svg)", file.display());
    let text = limits::read_short_text(file, MAX_LOGO_BYTES).map_err(|e| anyhow!("--logo: {e}"))?;
    let logo = logo::from_svg(&text).map_err(|error| match error {
        LogoError::Outline(error) => anyhow!(error),
        error => anyhow!("--logo: {}: {error}", file.display()),
    })?;
    Ok(PaperSpec { logo: Some(logo), logo_height_mm, ..paper })
}
