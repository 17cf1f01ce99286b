//! Targets: what they are, and what is made of them.

use std::path::PathBuf;
use std::sync::Arc;

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

/// What is printed, photographed and found: panels with corners and tags, in millimetres.
///
/// Made by :class:`Board`, :class:`Checkerboard`, :class:`Icosahedron` and the others, or read by :meth:`load`. The
/// frame of a board is right-handed: x right, y up on the print, z towards the viewer.
#[pyclass(frozen, subclass, module = "deltille")]
#[derive(Clone)]
pub struct Target {
    pub printing: Arc<Printing>,
}

impl Target {
    /// All corners with their panels.
    pub fn all(&self) -> impl Iterator<Item = (&Panel, &Corner)> {
        of(self.target())
    }

    /// Its geometry and tags, whatever it is printed on.
    pub fn target(&self) -> &targets::Target {
        &self.printing.target
    }

    /// A target with the family that was given, else the one that it names.
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

    /// The family of its tags, which was looked up when it was made or read.
    pub fn codes(&self) -> Option<&deltille::family::Family> {
        self.target().family().ok().flatten()
    }

    fn made(&self, what: What, making: Making) -> PyResult<Files> {
        make(&self.printing, what, making).raise(errors::target)
    }
}

/// All corners of a target with their panels.
pub fn of(target: &targets::Target) -> impl Iterator<Item = (&Panel, &Corner)> {
    target.panels.iter().flat_map(|panel| panel.corners.iter().map(move |corner| (panel, corner)))
}

#[pymethods]
impl Target {
    /// Reads a target: the ``.json`` that was written with it, or a ``.dsc``.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    /// family : Family, str or path-like, optional
    ///     The family of its tags, where that is not shipped.
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

    /// The target of a text, as :meth:`load` reads it from files.
    #[staticmethod]
    #[pyo3(signature = (text, *, family = None))]
    fn from_json(text: &str, family: Option<FamilyChoice>) -> PyResult<Self> {
        Self::with_family(Printing::from_json(text).raise(errors::target)?, family)
    }

    /// The text of the target's description.
    fn to_json(&self) -> String {
        self.printing.to_json()
    }

    /// Name of the target, which is the stem of the names of its files.
    #[getter]
    fn name(&self) -> &str {
        &self.target().name
    }

    /// What tells this target from others, whatever it is called and printed on: ``name``, ``fingerprint``, ``labels``,
    /// ``panels``, ``corners`` and ``edge_mm``; of a measured or refined target also ``plan``, the fingerprint of its print.
    #[getter]
    fn identity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::record(py, &self.target().identity())
    }

    /// Places of all corners in the target's frame, N × 3, float64, mm: where they were measured, else as planned.
    #[getter]
    fn corners<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.all().map(|(panel, corner)| panel.place_mm(corner).to_array()))
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

    /// Ids of the panels on which the corners lie, N, int64.
    #[getter]
    fn corner_panels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::column(py, self.all().map(|(panel, _)| i64::from(panel.id)))
    }

    /// The tags: ids, panels and places of their centres.
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

    /// The family of the tags; ``None`` of a target without.
    #[getter]
    fn family(&self) -> Option<Family> {
        self.codes().map(|family| Arc::new(family.clone()).into())
    }

    /// Whether places of its corners were measured.
    #[getter]
    fn is_measured(&self) -> bool {
        self.target().is_measured()
    }

    /// Number of pages that it is printed on.
    #[getter]
    fn page_count(&self) -> usize {
        self.printing.page_count()
    }

    /// What is printed, as PDF.
    ///
    /// Returns
    /// -------
    /// bytes
    fn pdf(&self) -> PyResult<Vec<u8>> {
        Ok(self.made(What::Pdf, Making::default())?.remove(0).1)
    }

    /// A page as SVG.
    ///
    /// Parameters
    /// ----------
    /// page : int, optional
    ///     Which one, from 0.
    ///
    /// Returns
    /// -------
    /// str
    #[pyo3(signature = (page = 0))]
    fn svg(&self, page: i64) -> PyResult<String> {
        let pages = self.made(What::Svg, Making::default())?;
        let count = pages.len();
        let found = usize::try_from(page).ok().and_then(|page| pages.into_iter().nth(page));
        let none =
            || raised::TargetError::new_err(format!("page {page}: there are {count}, from 0"));
        Ok(String::from_utf8_lossy(&found.ok_or_else(none)?.1).into_owned())
    }

    /// Everything of one format in memory.
    ///
    /// Parameters
    /// ----------
    /// format : str
    ///     ``"json"``, ``"pdf"``, ``"svg"``, ``"png"``, ``"dsc"``, ``"dsc-original"``; as meshes ``"gltf"``,
    ///     ``"obj"``, ``"sdf"``, ``"urdf"``, ``"mjcf"``, ``"usd"``, and to print in two colours ``"3mf"``; of a solid also ``"stl"``, ``"skeleton"``, ``"skeleton-3mf"``, ``"panels"`` (DXF)
    ///     and ``"net"`` (DXF). For a laser ``"laser-dxf"`` and ``"laser-svg"``; of an AprilGrid ``"kalibr"``.
    /// dpi : float, optional
    ///     Resolution of PNG pages, dots per inch.
    /// texture_dpi : float, optional
    ///     Resolution of the texture of a mesh; 20 px for a bit of a tag if left out.
    /// texture_px : int, optional
    ///     Or its longest side; at least 4 px for a bit, of a checkerboard 12.
    /// textures : int, optional
    ///     Among how many textures the faces are shared, up to 64, each of that resolution or size; one if left out.
    /// plate_mm : float, optional
    ///     Thickness of the plate of a board in a mesh, mm; 3 if left out.
    /// inlay_mm : float, optional
    ///     Depth of what is black in a 3MF, mm; 0.4 if left out.
    /// kerf_mm : float, optional
    ///     Width that the beam of a laser takes away, mm: engraved outlines are drawn smaller by half of it on each side,
    ///     plates larger.
    ///
    /// Returns
    /// -------
    /// dict of str to bytes
    ///     Contents by names of files.
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
        for (name, bytes) in unlocked(py, || self.made(what[0], making))?? {
            files.set_item(name, PyBytes::new(py, &bytes))?;
        }
        Ok(files)
    }

    /// Writes the description and files to print, cut or render, all or none.
    ///
    /// Parameters
    /// ----------
    /// folder : path-like
    ///     Where they go; it is made where there is none.
    /// formats : sequence of str, optional
    ///     Of those of :meth:`files`; PDF if left out. The ``.json`` is always written.
    /// dpi, texture_dpi, texture_px, textures, plate_mm, inlay_mm, kerf_mm
    ///     As of :meth:`files`.
    /// overwrite : bool, optional
    ///     Whether files of another kind are replaced.
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
        let formats = formats.map_or_else(|| Ok(vec![What::Pdf]), Formats::parsed)?;
        let making = given.making(self.target(), &formats)?;
        unlocked(py, || {
            let mut files = self.made(What::Json, making)?;
            for &what in formats.iter().filter(|what| **what != What::Json) {
                for (name, bytes) in self.made(what, making)? {
                    // Models for simulators have the files of the OBJ in common.
                    if files.iter().all(|(other, _)| *other != name) {
                        files.push((name, bytes));
                    }
                }
            }
            write_set(&folder, &files, overwrite).raise_of_file(&folder, errors::file)
        })?
    }

    /// Checks that this target can be used together with another one: no tag of the same family and no board has the same
    /// id.
    ///
    /// Parameters
    /// ----------
    /// other : Target
    ///
    /// Raises
    /// ------
    /// TargetError
    ///     Where both have an id; it names the first that is free.
    fn check_beside(&self, other: &Self) -> PyResult<()> {
        self.target().check_beside(other.target()).raise(errors::target)
    }

    /// Reads a file back and compares it with this target: every corner, tile and cell.
    ///
    /// Parameters
    /// ----------
    /// artifact : path-like or bytes, optional
    ///     The file, or its content. Without, what :meth:`save` would write is made in memory and proved.
    /// name : str, optional
    ///     Name of the file where its content is given, such as ``"desk.pdf"``; its ending tells the format.
    ///
    /// Returns
    /// -------
    /// Verdict
    ///
    /// Raises
    /// ------
    /// VerifyError
    ///     Where nothing can be compared, such as where the file cannot be read.
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
                let files = self.made(usual, Making::default())?;
                (files[0].0.clone(), Some(files))
            }
        };
        let own = self.clone();
        interruptible(py, move |stop| Verdict::of(&own.printing, proof, stop))?
    }

    /// Makes the list of corners and tags that the reference detector reads.
    ///
    /// Parameters
    /// ----------
    /// dialect : str, optional
    ///     ``"fork"`` or ``"original"``, as that detector's version reads.
    ///
    /// Returns
    /// -------
    /// str
    #[pyo3(signature = (dialect = "fork"))]
    fn dsc(&self, dialect: &str) -> PyResult<String> {
        let dialect = dialect.parse::<Dialect>().raise(errors::target)?;
        export::dsc::write(self.target(), dialect).raise(errors::target)
    }

    /// A small picture of the first page for notebooks.
    fn _repr_html_(&self) -> String {
        let Ok(pages) = self.made(What::Svg, Making::default()) else { return self.__repr__() };
        let page = String::from_utf8_lossy(&pages[0].1).into_owned();
        // Its size is that of the paper: only the view box is kept.
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

    fn __eq__(&self, other: &Self) -> bool {
        self.printing == other.printing
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> crate::Reduced<'py, (String, String, Option<String>, Option<String>)> {
        let restore = slf.py().import("deltille._core")?.getattr("_target")?;
        let own = slf.get();
        let family = own.codes().map(|family| family.to_json());
        // A family has no file in common with that of its squares.
        let is_mixed = own.target().family.as_ref().is_some_and(|family| family.squares.is_some());
        let squares = own.codes().filter(|_| is_mixed);
        let squares = squares.and_then(|family| family.of_tiling(GridKind::Checker));
        let squares = squares.map(|family| family.to_json());
        let class = slf.get_type().name()?.to_string();
        Ok((restore, (class, own.printing.to_json(), family, squares)))
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
    /// Its centre in the target's frame, mm.
    centre: [f64; 3],
}

pickles!(Tag);

#[pymethods]
impl Tag {
    fn __repr__(&self) -> String {
        format!("Tag(id={}, panel={}, row={}, col={})", self.id, self.panel, self.row, self.col)
    }
}
