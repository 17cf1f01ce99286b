//! Common keywords of targets for paper and print.

use std::path::PathBuf;
use std::sync::Arc;

use deltille::family::Family;
use deltille::layout::{DEFAULT_MARGIN_MM, Finish, PaperSpec, Printing, SolidSheets};
use deltille::limits;
use deltille::logo::{self, LogoError, MAX_LOGO_BYTES};
use deltille::targets::TargetSpec;
use pyo3::prelude::*;

use super::target::Target;
use crate::boundary::errors::{self, Raise, RaiseFile};

/// Checks the settings of the paper.
pub fn paper(
    size: Option<&str>,
    orientation: &str,
    margin_mm: Option<f64>,
    solids: SolidSheets,
) -> PyResult<PaperSpec> {
    Ok(PaperSpec {
        size: size.map(str::parse).transpose().raise(errors::target)?,
        orientation: orientation.parse().raise(errors::target)?,
        margin_mm: margin_mm.unwrap_or(DEFAULT_MARGIN_MM),
        solids,
        ..PaperSpec::default()
    })
}

/// Adds a logo, given as a file or as the text of an SVG.
pub fn with_logo(
    paper: PaperSpec,
    logo: Option<PathBuf>,
    logo_height_mm: Option<f64>,
) -> PyResult<PaperSpec> {
    let Some(given) = logo else { return Ok(PaperSpec { logo_height_mm, ..paper }) };
    let is_text = given.to_str().is_some_and(|text| text.trim_start().starts_with('<'));
    let text = match given.to_str().filter(|_| is_text) {
        Some(text) => text.to_owned(),
        None => {
            limits::read_short_text(&given, MAX_LOGO_BYTES).raise_of_file(&given, errors::target)?
        }
    };
    let refused = |error| match error {
        LogoError::Outline(error) => error.to_string(),
        error if is_text => format!("logo: {error}"),
        error => format!("logo: {}: {error}", given.display()),
    };
    let logo = logo::from_svg(&text).map_err(refused).raise(errors::target)?;
    Ok(PaperSpec { logo: Some(logo), logo_height_mm, ..paper })
}

/// Makes a target and lays it out on its paper.
pub fn build(
    name: &str,
    spec: &TargetSpec,
    family: Option<Arc<Family>>,
    paper: &PaperSpec,
    finish: Finish,
) -> PyResult<Target> {
    let printing = Printing::build(name, spec, family.as_deref(), Some(paper));
    let printing = printing.and_then(|printing| printing.finished(finish, paper.margin_mm));
    Ok(Target { printing: Arc::new(printing.raise(errors::target)?) })
}

/// Defines a class of flat targets from its name, the default name of its files, its required arguments, its keywords with
/// their defaults, and a block that makes the specification and the family. The keywords of paper and print are added, also to
/// the documentation; the block may change the paper.
macro_rules! flat {
    (
        $(#[$doc:meta])*
        $class:ident, $name:tt,
        ($($given:ident: $given_type:ty),*),
        ($($keyword:ident: $type:ty = $default:tt),* $(,)?),
        |$paper:ident| $make:block
    ) => {
        $(#[$doc])*
        /// paper : str, optional
        ///     ``"A4"``, ``"letter"``, ``"297x420mm"``, …; defaults to the smallest of A4 to A0 that fits the target.
        /// orientation : str, optional
        ///     ``"auto"``, ``"portrait"`` or ``"landscape"``.
        /// margin_mm : float, optional
        ///     Blank margin of the paper, mm.
        /// note : str, optional
        ///     Text printed next to the name on the label of every sheet, such as the owner.
        /// logo : str or path-like, optional
        ///     An SVG file, or the text of one, printed in black at the other end of the label strip: filled paths and
        ///     strokes; white parts stay blank.
        /// logo_height_mm : float, optional
        ///     Height of the logo, mm; defaults to that of the strip.
        /// guide_page : bool, optional
        ///     Add a page with a figure, instructions and a ruler.
        /// mirrored : bool, optional
        ///     Print the mirror image, for the back of glass; positions are those seen through the glass.
        /// white : str, optional
        ///     Name of a spot colour of the PDF, such as ``"White"``, printed beneath the whole page.
        /// contour : str, optional
        ///     Name of a spot colour of the PDF, such as ``"CutContour"``, for the cut line.
        /// name : str, optional
        ///     Name of the target, printed on the sheet; the stem of its file names.
        ///
        /// Raises
        /// ------
        /// TargetError
        ///     If the settings are invalid or contradict each other.
        #[pyclass(frozen, extends = Target, module = "deltille")]
        pub struct $class;

        #[pymethods]
        impl $class {
            #[new]
            #[pyo3(signature = ($($given,)* *, $($keyword = $default,)* paper = None, orientation = "auto",
                margin_mm = None, note = None, logo = None, logo_height_mm = None, guide_page = false, mirrored = false, white = None, contour = None,
                name = $name))]
            #[expect(clippy::too_many_arguments, reason = "keywords")]
            fn new(
                $($given: $given_type,)*
                $($keyword: $type,)*
                paper: Option<&str>,
                orientation: &str,
                margin_mm: Option<f64>,
                note: Option<String>,
                logo: Option<std::path::PathBuf>,
                logo_height_mm: Option<f64>,
                guide_page: bool,
                mirrored: bool,
                white: Option<String>,
                contour: Option<String>,
                name: &str,
            ) -> PyResult<PyClassInitializer<Self>> {
                let solids = deltille::layout::SolidSheets::default();
                let of_all = crate::targets::paper::paper(paper, orientation, margin_mm, solids)?;
                #[allow(unused_mut, reason = "few targets change it")]
                let mut $paper = crate::targets::paper::with_logo(
                    PaperSpec { note, guide_page, ..of_all },
                    logo,
                    logo_height_mm,
                )?;
                let (spec, family) = $make;
                let finish = deltille::layout::Finish { mirrored, white, contour };
                let target = crate::targets::paper::build(name, &spec, family, &$paper, finish)?;
                Ok(PyClassInitializer::from(target).add_subclass(Self))
            }
        }
    };
}
pub(crate) use flat;
