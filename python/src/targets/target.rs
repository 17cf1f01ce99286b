//! Targets: geometry, files and verification.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use deltille::export::artifacts::{Files, Making, What, make, write_set};
use deltille::lattice::GridKind;
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::targets::{self, Corner, Panel};
use deltille::{export, target_file};
use export::dsc::Dialect;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::{Deserialize, Serialize};

use super::families::{Family, FamilyChoice};
use super::making::{Formats, Keywords};
use super::verdict::{Proof, Verdict};
use crate::boundary::arrays;
use crate::boundary::errors::{self, Raise, RaiseFile, raised, unlocked};
use crate::boundary::interrupt::interruptible;
use crate::pickles;

/// A calibration target: panels with corners and tags, in millimetres.
///
/// Make one with :class:`Board`, :class:`Checkerboard`, :class:`Icosahedron` and the other classes, or read one with
/// :meth:`load`. The frame of a board is right-handed: x right, y up on the print, z towards the viewer.
#[pyclass(frozen, subclass, module = "deltille", eq)]
#[derive(Clone, PartialEq)]
pub struct Target {
    pub printing: Arc<Printing>,
}

impl Target {
    /// Iterates over all corners with their panels.
    pub fn all(&self) -> impl Iterator<Item = (&Panel, &Corner)> {
        of(self.target())
    }

    /// Returns its geometry and tags, without the layout of its print.
    pub fn target(&self) -> &targets::Target {
        &self.printing.target
    }

    /// Sets the given family, or the one that the target names.
    pub fn with_family(mut printing: Printing, family: Option<FamilyChoice>) -> PyResult<Self> {
        let target = &mut printing.target;
        match family {
            Some(FamilyChoice::Family(family)) => {
                let name = target.name.to_string();
                let other = |why| errors::family(format!("{name} {why}"));
                target.set_family(&family).map_err(other)?;
            }
            Some(FamilyChoice::Name(name)) => {
                let name = name.to_string_lossy();
                target_file::set_family(target, Some(&name)).raise(errors::family)?;
            }
            None => target_file::set_family(target, None).raise(errors::family)?,
        }
        Ok(Self { printing: Arc::new(printing) })
    }

    /// Returns the family of its tags, which was set when it was made or read.
    pub fn codes(&self) -> Option<&deltille::family::Family> {
        self.target().family().ok().flatten()
    }

    /// Makes the files of some formats; Ctrl-C ends it.
    fn made(&self, py: Python<'_>, formats: &[What], making: Making) -> PyResult<Files> {
        let (own, formats) = (self.clone(), formats.to_vec());
        interruptible(py, move |stop| {
            let mut files: Files = Vec::new();
            for what in formats {
                if stop.load(Ordering::Relaxed) {
                    break;
                }
                for (name, bytes) in make(&own.printing, what, making).raise(errors::target)? {
                    // Models for simulators share the files of the OBJ.
                    if files.iter().all(|(other, _)| *other != name) {
                        files.push((name, bytes));
                    }
                }
            }
            Ok(files)
        })?
    }
}

/// Iterates over all corners of a target with their panels.
pub fn of(target: &targets::Target) -> impl Iterator<Item = (&Panel, &Corner)> {
    target.panels.iter().flat_map(|panel| panel.corners.iter().map(move |corner| (panel, corner)))
}

#[pymethods]
impl Target {
    /// Reads a target from its ``.json`` description, or from a ``.dsc``.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    /// family : Family, str or path-like, optional
    ///     The family of its tags, if it is not bundled.
    ///
    /// Returns
    /// -------
    /// Target
    #[staticmethod]
    #[pyo3(signature = (path, *, family = None))]
    fn load(path: PathBuf, family: Option<FamilyChoice>) -> PyResult<Self> {
        let target =
            target_file::read(&path, &Limits::default()).raise_of_file(&path, errors::file)?;
        Self::with_family(target, family)
    }

    /// Reads a target from the text of a file, like :meth:`load`.
    #[staticmethod]
    #[pyo3(signature = (text, *, family = None))]
    fn from_json(text: &str, family: Option<FamilyChoice>) -> PyResult<Self> {
        Self::with_family(Printing::from_json(text).raise(errors::target)?, family)
    }

    /// Returns the text of the target's description.
    fn to_json(&self) -> String {
        self.printing.to_json()
    }

    /// Name of the target, which is the stem of its file names.
    #[getter]
    fn name(&self) -> &str {
        &self.target().name
    }

    /// Identity of the target, which distinguishes it from others independently of its name and print: ``name``,
    /// ``fingerprint``, ``labels``, ``panels``, ``corners`` and ``edge_mm``; for a measured or refined target also ``plan``,
    /// the fingerprint of its print.
    #[getter]
    fn identity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::record(py, &self.target().identity())
    }

    /// Positions of all corners in the target's frame, N × 3, float64, mm: measured if known, otherwise nominal.
    #[getter]
    fn corners<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.all().map(|(panel, corner)| panel.position_mm(corner).to_array()))
    }

    /// Ids of the corners, N, int64.
    #[getter]
    fn corner_ids<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::column(py, self.all().map(|(_, corner)| i64::from(corner.id)))
    }

    /// Rows of the corners in the lattice of their panel, N, int64.
    #[getter]
    fn corner_rows<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::column(py, self.all().map(|(_, corner)| i64::from(corner.row)))
    }

    /// Columns of the corners in the lattice of their panel, N, int64.
    #[getter]
    fn corner_cols<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::column(py, self.all().map(|(_, corner)| i64::from(corner.col)))
    }

    /// Ids of the panels of the corners, N, int64.
    #[getter]
    fn corner_panels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::column(py, self.all().map(|(panel, _)| i64::from(panel.id)))
    }

    /// The tags: ids, panels and positions of their centres.
    #[getter]
    fn tags(&self) -> Vec<Tag> {
        let of_panel = |panel: &Panel| {
            let tag = |tag: &targets::TagPlacement| Tag {
                id: tag.id,
                panel: panel.id,
                row: tag.row,
                col: tag.col,
                centre: panel.tag_centre_mm(tag).to_array(),
            };
            panel.tags.iter().map(tag).collect::<Vec<_>>()
        };
        self.target().panels.iter().flat_map(of_panel).collect()
    }

    /// Ids of the tags, T, int64.
    #[getter]
    fn tag_ids<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::column(py, self.tags().into_iter().map(|tag| i64::from(tag.id)))
    }

    /// Centres of the tags in the target's frame, T × 3, float64, mm.
    #[getter]
    fn tag_centres<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.tags().into_iter().map(|tag| tag.centre))
    }

    /// Ids of the panels.
    #[getter]
    fn panels(&self) -> Vec<u32> {
        self.target().panels.iter().map(|panel| panel.id).collect()
    }

    /// The family of the tags; ``None`` for a target without tags.
    #[getter]
    fn family(&self) -> Option<Family> {
        self.codes().map(|family| Arc::new(family.clone()).into())
    }

    /// Whether the positions of its corners were measured.
    #[getter]
    fn is_measured(&self) -> bool {
        self.target().is_measured()
    }

    /// Number of printed pages.
    #[getter]
    fn page_count(&self) -> usize {
        self.printing.page_count()
    }

    /// Returns the print as PDF.
    ///
    /// Returns
    /// -------
    /// bytes
    fn pdf(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        Ok(self.made(py, &[What::Pdf], Making::default())?.remove(0).1)
    }

    /// Returns a page as SVG.
    ///
    /// Parameters
    /// ----------
    /// page : int, optional
    ///     Index of the page, from 0.
    ///
    /// Returns
    /// -------
    /// str
    #[pyo3(signature = (page = 0))]
    fn svg(&self, py: Python<'_>, page: i64) -> PyResult<String> {
        let pages = self.made(py, &[What::Svg], Making::default())?;
        let count = pages.len();
        let found = usize::try_from(page).ok().and_then(|page| pages.into_iter().nth(page));
        let none = || {
            raised::TargetError::new_err(format!(
                "page {page} does not exist: the target has {count}, numbered from 0"
            ))
        };
        Ok(String::from_utf8_lossy(&found.ok_or_else(none)?.1).into_owned())
    }

    /// Makes all files of one format in memory.
    ///
    /// Parameters
    /// ----------
    /// format : str
    ///     ``"json"``, ``"pdf"``, ``"svg"``, ``"png"``, ``"dsc"``, ``"dsc-original"``. Meshes: ``"gltf"``, ``"obj"``,
    ///     ``"sdf"``, ``"urdf"``, ``"mjcf"``, ``"usd"``, and ``"3mf"`` for two-colour printing. For solids also ``"stl"``,
    ///     ``"skeleton"``, ``"skeleton-3mf"``, ``"panels"`` (DXF) and ``"net"`` (DXF). For lasers ``"laser-dxf"`` and
    ///     ``"laser-svg"``. For an AprilGrid ``"kalibr"``.
    /// dpi : float, optional
    ///     Resolution of PNG pages, dots per inch.
    /// texture_dpi : float, optional
    ///     Resolution of the texture of a mesh, dots per inch; defaults to 20 px per cell of a tag.
    /// texture_px : int, optional
    ///     Longest side of the texture, px, instead of its resolution; at least 4 px per cell, or 12 for a checkerboard.
    /// textures : int, optional
    ///     Number of textures among which the faces are divided, up to 64, each of that resolution or size; defaults to one.
    /// plate_mm : float, optional
    ///     Thickness of the plate of a board in a mesh, mm; defaults to 3.
    /// inlay_mm : float, optional
    ///     Depth of the black parts in a 3MF, mm; defaults to 0.4.
    /// kerf_mm : float, optional
    ///     Kerf of the laser, mm: engraved outlines are drawn smaller by half of it on each side, plates larger.
    ///
    /// Returns
    /// -------
    /// dict of str to bytes
    ///     File contents by file name.
    #[pyo3(signature = (format, *, dpi = 300.0, texture_dpi = None, texture_px = None, textures = None,
        plate_mm = None, inlay_mm = None, kerf_mm = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn files<'py>(
        &self,
        py: Python<'py>,
        format: &str,
        dpi: f64,
        texture_dpi: Option<f64>,
        texture_px: Option<i64>,
        textures: Option<i64>,
        plate_mm: Option<f64>,
        inlay_mm: Option<f64>,
        kerf_mm: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let given =
            Keywords { dpi, texture_dpi, texture_px, textures, plate_mm, inlay_mm, kerf_mm };
        let what = Formats::One(format.to_owned()).parsed()?;
        let making = given.making(self.target(), &what)?;
        let files = PyDict::new(py);
        for (name, bytes) in self.made(py, &what, making)? {
            files.set_item(name, PyBytes::new(py, &bytes))?;
        }
        Ok(files)
    }

    /// Writes the description, and files to print, cut or render; if one file fails, none is
    /// written.
    ///
    /// Parameters
    /// ----------
    /// folder : path-like
    ///     Output folder, created if necessary.
    /// formats : sequence of str, optional
    ///     Formats of :meth:`files`; defaults to PDF. The ``.json`` is always written.
    /// dpi, texture_dpi, texture_px, textures, plate_mm, inlay_mm, kerf_mm
    ///     See :meth:`files`.
    /// overwrite : bool, optional
    ///     Replace existing files even if they are of another kind.
    ///
    /// Returns
    /// -------
    /// list of pathlib.Path
    ///     The files, the description first.
    #[pyo3(signature = (folder, formats = None, *, dpi = 300.0, texture_dpi = None, texture_px = None, textures = None,
        plate_mm = None, inlay_mm = None, kerf_mm = None, overwrite = false))]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn save(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        formats: Option<Formats>,
        dpi: f64,
        texture_dpi: Option<f64>,
        texture_px: Option<i64>,
        textures: Option<i64>,
        plate_mm: Option<f64>,
        inlay_mm: Option<f64>,
        kerf_mm: Option<f64>,
        overwrite: bool,
    ) -> PyResult<Vec<PathBuf>> {
        let given =
            Keywords { dpi, texture_dpi, texture_px, textures, plate_mm, inlay_mm, kerf_mm };
        let mut formats = formats.map_or_else(|| Ok(vec![What::Pdf]), Formats::parsed)?;
        let making = given.making(self.target(), &formats)?;
        formats.insert(0, What::Json);
        let files = self.made(py, &formats, making)?;
        unlocked(py, || write_set(&folder, &files, overwrite))?.raise_of_file(&folder, errors::file)
    }

    /// Checks that this target can be used together with another one: they share no board id, and no tag id of the same family.
    ///
    /// Parameters
    /// ----------
    /// other : Target
    ///
    /// Raises
    /// ------
    /// TargetError
    ///     If they share an id; the message names the first free one.
    fn check_beside(&self, other: &Self) -> PyResult<()> {
        self.target().check_beside(other.target()).raise(errors::target)
    }

    /// Reads a file back and compares it with this target: every corner, tile and cell.
    ///
    /// Parameters
    /// ----------
    /// artifact : path-like or bytes, optional
    ///     The file, or its content. By default, the file that :meth:`save` would write is made in memory and verified.
    /// name : str, optional
    ///     Name of the file if its content is given, such as ``"desk.pdf"``; the extension selects the format.
    ///
    /// Returns
    /// -------
    /// Verdict
    ///
    /// Raises
    /// ------
    /// VerifyError
    ///     If the comparison is not possible, for example because the file cannot be read.
    #[pyo3(signature = (artifact = None, *, name = None))]
    fn verify(
        &self,
        py: Python<'_>,
        artifact: Option<Proof>,
        name: Option<String>,
    ) -> PyResult<Verdict> {
        let proof = match artifact {
            Some(Proof::Bytes(bytes)) => {
                let name = name.unwrap_or_else(|| format!("{}.pdf", self.target().name));
                (name.clone(), Some(vec![(name, bytes)]))
            }
            Some(Proof::Path(path)) => (path.to_string_lossy().into_owned(), None),
            None => {
                let no_pages = self.printing.sheets.is_empty();
                let usual = if no_pages { What::Gltf } else { What::Pdf };
                let files = self.made(py, &[usual], Making::default())?;
                (files[0].0.clone(), Some(files))
            }
        };
        let own = self.clone();
        interruptible(py, move |stop| Verdict::of(&own.printing, proof, stop))?
    }

    /// Returns the list of corners and tags for the reference detector.
    ///
    /// Parameters
    /// ----------
    /// dialect : str, optional
    ///     ``"fork"`` or ``"original"``, depending on the version of that detector.
    ///
    /// Returns
    /// -------
    /// str
    #[pyo3(signature = (dialect = "fork"))]
    fn dsc(&self, dialect: &str) -> PyResult<String> {
        let dialect = dialect.parse::<Dialect>().raise(errors::target)?;
        export::dsc::write(self.target(), dialect).raise(errors::target)
    }

    /// Renders a preview of the first page for notebooks.
    fn _repr_html_(&self, py: Python<'_>) -> String {
        let Ok(pages) = self.made(py, &[What::Svg], Making::default()) else {
            return self.__repr__();
        };
        let page = String::from_utf8_lossy(&pages[0].1).into_owned();
        // Drop the paper size and keep only the view box.
        let start = page.find("<svg").unwrap_or(0);
        let (head, body) = page[start..].split_once('>').unwrap_or(("<svg", ""));
        let view_box = head.split("viewBox=\"").nth(1).and_then(|rest| rest.split('"').next());
        let view_box = view_box.unwrap_or("0 0 210 297");
        format!(
            "<div><code>{}</code><br><svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{view_box}\" \
             width=\"320\" style=\"background:white;border:1px solid #ccc\">{body}</div>",
            self.__repr__()
        )
    }

    fn __len__(&self) -> usize {
        self.all().count()
    }

    fn __repr__(&self) -> String {
        let tags: usize = self.target().panels.iter().map(|panel| panel.tags.len()).sum();
        let family = self.target().family.as_ref().map_or("", |family| &family.name);
        format!(
            "<Target {}: {} panels, {} corners, {tags} tags {family}>",
            self.target().name,
            self.target().panels.len(),
            self.all().count(),
        )
        .replace(" >", ">")
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> crate::Reduced<'py, (String, String, Option<String>, Option<String>)> {
        let restore = slf.py().import("deltille._core")?.getattr("_target")?;
        let own = slf.get();
        let family = own.codes().map(|family| family.to_json());
        // The family of the squares has its own file.
        let is_mixed = own.target().family.as_ref().is_some_and(|family| family.squares.is_some());
        let squares = own.codes().filter(|_| is_mixed);
        let squares = squares.and_then(|family| family.of_tiling(GridKind::Checker));
        let squares = squares.map(|family| family.to_json());
        let class = slf.get_type().name()?.to_string();
        Ok((restore, (class, own.printing.to_json(), family, squares)))
    }
}

/// A target, or several.
pub struct Targets(pub Vec<Target>);

impl<'a, 'py> FromPyObject<'a, 'py> for Targets {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(target) = given.cast::<Target>() {
            return Ok(Self(vec![target.get().clone()]));
        }
        let all = given.try_iter()?.map(|target| Ok(target?.cast::<Target>()?.get().clone()));
        all.collect::<PyResult<_>>().map(Self)
    }
}

/// A tag of a target.
#[pyclass(frozen, get_all, module = "deltille", eq)]
#[derive(Clone, PartialEq, Serialize, Deserialize)]
pub struct Tag {
    /// Id of the tag: the index of its code in the family.
    id: u32,
    /// Id of its panel.
    panel: u32,
    /// Row of the lower left vertex of its tile.
    row: i32,
    /// Column of that vertex.
    col: i32,
    /// Centre in the target's frame, mm.
    centre: [f64; 3],
}

pickles!(Tag);

#[pymethods]
impl Tag {
    fn __repr__(&self) -> String {
        format!("Tag(id={}, panel={}, row={}, col={})", self.id, self.panel, self.row, self.col)
    }
}
