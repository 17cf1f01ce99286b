//! Verification of artifacts: a file is read back, rendered, detected and compared with its target.
//!
//! [`verify`] takes files as bytes: it opens none, starts no program and needs no clock (threads
//! are those of the current pool, if there is one), so that it works without a file system.
//! [`Verifier::verify_path`] does the same for files on disk, which are read within [`Limits`];
//! third-party code then runs on a thread with a time limit.
//!
//! The verification is independent of how a file was drawn: a PDF is rasterised by hayro, an SVG by
//! resvg, and the picture goes through the detector like a photograph. Then it is checked for each
//! page that
//!
//! - the page size that the file states is that of the target;
//! - each check bar, measured in the picture, has its stated length;
//! - every corner is found, once, with its label, within [`TOLERANCE_MM`] of its stated position,
//!   and there is no other corner;
//! - every tile, and every cell of every tag, has its colour over its whole area, also where
//!   decoding would correct a wrong cell, and its edges lie within a quarter of a pixel of their
//!   places: 0.02 mm at 300 dpi;
//! - the sheet has the texts of the description, and no ink beside the tiles, texts and bars.
//!
//! A deviation is named by its cause where one cause explains it: a scale, a mirror image, a
//! rotation or a shift of the whole board instead of a list of all corners.
//!
//! The pages of a sheet that is larger than the paper are assembled by their stated places; where
//! they overlap they must agree. The net of a solid is folded: the faces, each with the pose that
//! its detected corners have on the paper, are rotated about the fold lines, and must come to lie
//! within [`FOLD_TOLERANCE_MM`] of their stated positions in space; the two sides of each edge must
//! meet, and carry the same number where they are cut.
//!
//! A mesh (`.glb`, `.obj`, `.usda`) is loaded with its textures, and rendered by a virtual camera before each
//! face; every detected corner is projected along its ray onto the loaded triangles and must lie
//! within [`MESH_TOLERANCE_MM`] of its stated position in space. The texture on each face is then
//! laid out flat and compared like a sheet: every tile, every cell of every tag, and no other mark.
//! Models for simulators (`.sdf`, `.urdf`, `.xml` of MuJoCo) must put that mesh in its place; a `.usda` holds it.
//! Of two bodies to print in two colours (`.3mf`), each must be closed, the black one fill what the white one leaves of the
//! plate, and the surface of both is compared like a printed page.
//! A body to print (`.stl`) must be a closed surface with its normals outwards and of the stated
//! shape.
//!
//! What is rendered here must be what other programs show. So a file is inspected before it is
//! rendered, and anything in it that not every viewer shows alike is a finding: files are accepted
//! by a list of permitted constructs, not refused by a list of forbidden ones. Titles and
//! descriptions must be those of the target, and unused content is refused.
//!
//! Pages that are printed as mirror images are turned over first. Drawings of boards for a laser are put back to what is
//! left when the beam has taken its part, and that is compared like a printed page.
//!
//! Lists for other detectors (`.dsc`) and drawings for a cutter (`.dxf`) are read and compared with
//! the target number by number.
//!
//! Limits: texts and stray ink are compared only where the boards lie as stated and are recognised;
//! dirt within a few pixels of a text or a bar is attributed to it.

mod assemble;
mod bars;
mod board;
mod body;
mod construct;
mod cutting;
mod document;
mod edges;
mod face_page;
mod finding;
mod fit;
mod fold;
mod inlay;
mod laser;
mod listing;
mod marks;
mod model;
mod on_disk;
mod reader;
mod scene;
mod solid;
mod stated;
mod texels;
mod tile_table;
mod tiles;
mod verdict;

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec2;

use deltille_core::detection::{Ink, Tone};
use deltille_core::family::Family;
use deltille_core::targets::{OtherFamily, Target};
use deltille_detect::{Detector, DetectorConfig};
use deltille_files::export::sheet_file_name;
use deltille_files::limits::{Guard, Limits};
use deltille_layout::artwork::CuttingError;
use deltille_layout::{Printing, SheetLayout, SheetPage};
use fit::AffineMap;
use fold::Seen;
use reader::Reader;
use tiles::PlacedPanel;

pub use document::{Document, DocumentError, Format, Page};
pub use finding::{
    BoardFinding, ConstructFinding, CutFinding, Finding, FoldFinding, ListFinding, MarkFinding,
    MeshFinding, PageFinding, TileFinding,
};
pub use fold::FOLD_TOLERANCE_MM;
pub use reader::Artifact;
pub use solid::MESH_TOLERANCE_MM;
pub use verdict::{
    BodyVerdict, CutVerdict, FaceVerdict, FoldVerdict, InlayVerdict, ListVerdict, SheetVerdict,
    Verdict,
};

/// Largest deviation of a position or a length on paper, mm: a fifth of the error of a good
/// printer.
pub const TOLERANCE_MM: f64 = 0.02;

/// Print resolution of 300 dpi, px/mm: 0.02 mm is a quarter of a pixel.
const PRINT_PX_PER_MM: f64 = 300.0 / 25.4;

/// Least edge of a cell of a tag in the picture, px, so that more than a few pixels lie inside it.
const CELL_PX: f64 = 8.0;

/// A page with a side this many times as long as stated is not rendered: at the resolution that is
/// possible for it nothing of its boards could be seen.
const MOST_ENLARGED: f64 = 10.0;

/// Why an artifact cannot be compared with its target.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// The artifact cannot be read.
    #[error(transparent)]
    Document(#[from] DocumentError),
    /// The comparison was cancelled by the caller.
    #[error("interrupted before all was compared")]
    Cancelled,
    /// The target has no sheets of paper.
    #[error("{}: target {target} has no sheets: it was not laid out on paper", path.display())]
    NoSheets {
        /// The file.
        path: PathBuf,
        /// Name of the target.
        target: String,
    },
    /// The file name has no extension of a known [`Format`].
    #[error(
        "{}: only .pdf, .svg, .png, .glb, .obj, .sdf, .urdf, .xml (MuJoCo), .usda, .3mf, .stl, .dsc and .dxf files are \
         compared with their target",
        path.display()
    )]
    OtherKind {
        /// The file.
        path: PathBuf,
    },
    /// The file is a part of another artifact.
    #[error("{}: it is compared with {whole}: name that", path.display())]
    PartOf {
        /// The file.
        path: PathBuf,
        /// The file that it is a part of.
        whole: String,
    },
    /// The file name does not tell which sheet the file shows.
    #[error(
        "{}: the target has {sheets} sheets; name the file {example} for the first",
        path.display()
    )]
    WhichSheet {
        /// The file.
        path: PathBuf,
        /// Number of sheets.
        sheets: usize,
        /// An example of a name that does.
        example: String,
    },
    /// The file name does not tell what is cut: panels or net.
    #[error(
        "{}: name the file {target}-panels.dxf, {target}-net.dxf or {target}-laser.dxf, for what it shows",
        path.display()
    )]
    WhichDrawing {
        /// The file.
        path: PathBuf,
        /// Name of the target.
        target: String,
    },
    /// The target has no such drawing for a cutter.
    #[error("{}: {source}", path.display())]
    NothingToCut {
        /// The file.
        path: PathBuf,
        /// Why.
        source: CuttingError,
    },
    /// The target needs another family than the one given.
    #[error("the target needs family {needed}: {given}")]
    Family {
        /// Name and fingerprint of the family of the target.
        needed: String,
        /// The family that was given instead.
        given: String,
    },
}

/// Compares the artifact named `name` among `files` in memory with its target. `family` must be
/// given if the target has tags. The extension of the name tells the [`Format`].
///
/// An artifact may consist of several files. All of them must be among `files`, in any order: the
/// other pages of a net (`net-1.svg`, `net-2.svg`), the material library and the textures that an
/// OBJ names. Other files are ignored.
///
/// Deviations of the artifact are in the [`Verdict`]. An error means that nothing can be compared:
/// a file is missing or cannot be read, or the target has no such artifact.
///
/// # Errors
/// When the family is not that of the target, the name tells no format or sheet, or a file is
/// missing or cannot be read at all.
///
/// ```
/// use deltille_layout::artwork;
/// use deltille_core::lattice::GridKind;
/// use deltille_layout::{PaperSpec, Printing};
/// use deltille_core::targets::{BoardSpec, TargetSpec};
/// use deltille_files::export::svg;
/// use deltille_verify::{Artifact, verify};
///
/// let spec = BoardSpec { tags: None, ..BoardSpec::new(GridKind::Deltille, 4, 5, 20.0) };
/// let spec = TargetSpec::Board(spec);
/// let board = Printing::build("board", &spec, None, Some(&PaperSpec::default()))?;
/// let mut artwork = artwork::draw(&board, None)?;
/// let good = [Artifact::new("board.svg", svg::to_string(&artwork, 0))];
/// assert!(verify(&board, None, "board.svg", &good)?.passed);
///
/// artwork.sheets[0].shapes.remove(0);
/// let bad = [Artifact::new("board.svg", svg::to_string(&artwork, 0))];
/// let verdict = verify(&board, None, "board.svg", &bad)?;
/// assert!(verdict.to_string().contains("tile missing"), "{verdict}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn verify(
    printing: &Printing,
    family: Option<&Family>,
    name: &str,
    files: &[Artifact],
) -> Result<Verdict, VerifyError> {
    Verifier::new(printing, family)?.verify(name, files)
}

/// Compares artifacts with one target.
pub struct Verifier<'a> {
    printing: Cow<'a, Printing>,
    family: Option<&'a Family>,
    detector: Detector,
    limits: Limits,
    guard: Guard,
    cancel: Option<&'a AtomicBool>,
    progress: Option<&'a (dyn Fn(Progress) + Sync)>,
}

/// How far the comparison of an artifact has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Pages, or faces of a mesh, that were compared.
    pub done: usize,
    /// How many there are.
    pub total: usize,
}

impl<'a> Verifier<'a> {
    /// A verifier for the artifacts of a target as it is printed; `family` must be given if the target has tags.
    ///
    /// # Errors
    /// When the target needs another family.
    pub fn new(printing: &'a Printing, family: Option<&'a Family>) -> Result<Self, VerifyError> {
        let target = &printing.target;
        for kind in target.tilings() {
            let Some(needed) = target.family.as_ref().map(|family| family.of_tiling(kind)) else {
                continue;
            };
            let family = family.map(|family| family.of_tiling(kind).unwrap_or(family));
            let given = match family {
                Some(family) => target.check_family(needed, family).err().map(|why| match why {
                    OtherFamily::Codes { found, .. } => {
                        format!("{} has fingerprint {found}", family.name())
                    }
                    why => format!("the target {why}"),
                }),
                None => Some("none is given".to_owned()),
            };
            if let Some(given) = given {
                let needed = format!("{} with fingerprint {}", needed.name, needed.fingerprint);
                return Err(VerifyError::Family { needed, given });
            }
        }
        let detector = Detector::for_target(target, family, detector_config());
        Ok(Self {
            printing: printing.under_printed_name(),
            family,
            detector,
            limits: Limits::default(),
            guard: Guard::default(),
            cancel: None,
            progress: None,
        })
    }

    /// The target, under the name that is on its prints.
    fn target(&self) -> &Target {
        &self.printing.target
    }

    /// The same verifier with other limits for reading artifacts than the default.
    pub fn within(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// The same verifier, running third-party code on artifacts in memory under this guard; the
    /// default is [`Guard::Here`]. Take [`Guard::Timed`] where threads are available and files are
    /// not trusted.
    pub fn guarded_by(self, guard: Guard) -> Self {
        Self { guard, ..self }
    }

    /// The same verifier, which checks `flag` before each page: once it is set,
    /// [`verify`](Self::verify) returns [`VerifyError::Cancelled`].
    pub fn stopped_by(self, flag: &'a AtomicBool) -> Self {
        Self { cancel: Some(flag), ..self }
    }

    /// The same verifier, which tells after each page of a document and each face of a mesh how far it has come; faces are
    /// compared on several threads.
    pub fn telling(self, progress: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self { progress: Some(progress), ..self }
    }

    /// Tells that so many of all were compared.
    fn tell(&self, done: usize, total: usize) {
        if let Some(progress) = self.progress {
            progress(Progress { done, total });
        }
    }

    /// The files that are verified together with `path`: all pages of a net, or of a board over several pages, where
    /// each is a file of its own. Any other file is verified by itself.
    pub fn set_of(&self, path: &Path) -> Vec<PathBuf> {
        let in_parts = self.printing.sheets.iter().any(|sheet| !sheet.pages.is_empty());
        match in_parts || fold::is_net(&self.printing) {
            true => self.pages_with(path),
            false => vec![path.to_owned()],
        }
    }

    /// The files of all pages when `path` holds one of them; `path` alone when it holds all.
    pub fn pages_with(&self, path: &Path) -> Vec<PathBuf> {
        let single = matches!(Format::of(path), Some(Format::Svg | Format::Png));
        let count = self.printing.page_count();
        if !single || count == 1 || self.sheet_of(path).is_err() {
            return vec![path.to_owned()];
        }
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let name = stem.rsplit_once('-').map_or(&*stem, |(name, _)| name);
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        let file = |index| path.with_file_name(sheet_file_name(name, index, count, &extension));
        (0..count).map(file).collect()
    }

    /// The verdict on a set of pages of which some are missing.
    fn without(pages: &[PathBuf], format: Format, missing: &[&PathBuf]) -> Verdict {
        let findings =
            missing.iter().map(|page| PageFinding::PageMissing { page: file_name(page) }.into());
        let verdict = Verdict::new(&pages[0], format, findings.collect());
        Verdict { artifact: of_all(pages), ..verdict }
    }

    /// Compares the artifact named `name` among files in memory with the target. A PDF shows all
    /// sheets, an SVG or PNG the one that its name tells. All files of the artifact must be among
    /// `files`: all pages of [`set_of`](Self::set_of) for a net, material library and textures for
    /// an OBJ.
    ///
    /// # Errors
    /// When the name tells no format or sheet, or a file is missing or cannot be read at all.
    pub fn verify(&self, name: &str, files: &[Artifact]) -> Result<Verdict, VerifyError> {
        let reader = Reader { files: &files, limits: self.limits, guard: self.guard };
        self.verify_by(&reader, Path::new(name))
    }

    /// Compares an artifact whose files come from `reader`.
    fn verify_by(&self, reader: &Reader, path: &Path) -> Result<Verdict, VerifyError> {
        let name = file_name(path);
        if let Some(whole) = whole_of(&self.target().name, &name) {
            return Err(VerifyError::PartOf { path: path.to_owned(), whole });
        }
        let Some(format) = Format::of(path) else {
            return Err(VerifyError::OtherKind { path: path.to_owned() });
        };
        match format {
            Format::Dsc => return Ok(listing::verify(self, reader, path)?),
            Format::Dxf | Format::Svg if laser::is_named(self.target(), path) => {
                return laser::verify(self, reader, path, format);
            }
            Format::Dxf => return cutting::verify(self, reader, path),
            Format::Pdf | Format::Svg | Format::Png => {
                return self.verify_sheets(reader, path, format);
            }
            Format::Sdf | Format::Urdf | Format::Mjcf => {
                return scene::verify(self, reader, path, format);
            }
            Format::ThreeMf => return Ok(inlay::verify(self, reader, path)?),
            Format::Glb | Format::Obj | Format::Usda | Format::Stl => {}
        }
        let (refused, parts) = construct::check(reader, path, format, &self.printing)?;
        if construct::refuse(&refused) {
            return Ok(Verdict::new(path, format, refused));
        }
        let mut verdict = match format {
            Format::Stl => body::verify(self, path, &model::load_stl(reader, path)?, format)?,
            _ => solid::verify(self, path, model::load(reader, path, parts)?, format),
        };
        verdict.passed &= refused.is_empty();
        verdict.findings.extend(refused);
        Ok(verdict)
    }

    /// Compares printed pages.
    fn verify_sheets(
        &self,
        reader: &Reader,
        path: &Path,
        format: Format,
    ) -> Result<Verdict, VerifyError> {
        if self.printing.sheets.is_empty() {
            let (path, target) = (path.to_owned(), self.target().name.to_string());
            return Err(VerifyError::NoSheets { path, target });
        }
        let mut findings = Vec::new();
        let files = self.set_of(path);
        let missing: Vec<&PathBuf> = files.iter().filter(|file| !reader.has(file)).collect();
        if reader.has(path) && !missing.is_empty() {
            return Ok(Self::without(&files, format, &missing));
        }
        let refused = self.refused(reader, &files, format)?;
        if construct::refuse(&refused) {
            return Ok(Verdict::new(path, format, refused));
        }
        findings.extend(refused);
        let documents: Vec<Document> =
            files.iter().map(|file| Document::read_by(reader, file)).collect::<Result<_, _>>()?;
        let stated = self.printing.page_count();
        // For each page of the target the page of a file that shows it.
        let sources: Vec<Option<Source>> = match format {
            Format::Pdf => {
                let found = documents[0].pages();
                if found != stated {
                    findings.push(PageFinding::Pages { found, stated }.into());
                }
                let source =
                    |page| (page < found).then_some(Source { document: &documents[0], page });
                (0..stated).map(source).collect()
            }
            _ if documents.len() > 1 => {
                documents.iter().map(|document| Some(Source { document, page: 0 })).collect()
            }
            _ => {
                let shown = self.sheet_of(path)?;
                let source = Source { document: &documents[0], page: 0 };
                (0..stated).map(|page| (page == shown).then_some(source)).collect()
            }
        };
        let (mut verdicts, mut seen) = (Vec::new(), Vec::new());
        let mut first = 0;
        for (index, layout) in self.printing.sheets.iter().enumerate() {
            if self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                return Err(VerifyError::Cancelled);
            }
            let pages = &sources[first..first + layout.page_count()];
            let before = first;
            first += layout.page_count();
            let Some(pages) = pages.iter().copied().collect::<Option<Vec<Source>>>() else {
                continue;
            };
            let (verdict, found) = match layout.pages.is_empty() {
                true => self.verify_page(pages[0], index)?,
                false => self.verify_pages(&pages, index, before)?,
            };
            self.tell(first, stated);
            verdicts.push(verdict);
            seen.push(found);
        }
        if fold::is_net(&self.printing) && verdicts.len() == self.printing.sheets.len() {
            fold::check(&self.printing, &seen, &mut verdicts);
        }
        let mut verdict =
            Verdict { artifact: of_all(&files), ..Verdict::new(path, format, findings) };
        verdict.passed &= verdicts.iter().all(|sheet| sheet.findings.is_empty());
        Ok(Verdict { sheets: verdicts, ..verdict })
    }

    /// Constructs that are not permitted, in files that belong together.
    fn refused(
        &self,
        reader: &Reader,
        files: &[PathBuf],
        format: Format,
    ) -> Result<Vec<Finding>, DocumentError> {
        let mut refused = Vec::new();
        for file in files {
            let (found, _) = construct::check(reader, file, format, &self.printing)?;
            refused.extend(found.into_iter().map(|finding| match files.len() {
                1 => finding,
                _ => finding.on_page(file_name(file)),
            }));
        }
        Ok(refused)
    }

    /// The page that a file of a single page shows, by its name.
    fn sheet_of(&self, path: &Path) -> Result<usize, VerifyError> {
        let count = self.printing.page_count();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let number = stem.rsplit_once('-').and_then(|(_, number)| number.parse::<usize>().ok());
        match number {
            _ if count == 1 => Ok(0),
            Some(number) if (1..=count).contains(&number) => Ok(number - 1),
            _ => {
                let extension = path.extension().unwrap_or_default().to_string_lossy();
                let example = sheet_file_name(&self.target().name, 0, count, &extension);
                Err(VerifyError::WhichSheet { path: path.to_owned(), sheets: count, example })
            }
        }
    }

    /// The panels of a page where they are stated.
    fn placed<'p>(&'p self, page: &'p Page, layout: &'p SheetLayout) -> Vec<PlacedPanel<'p>> {
        let found_from_stated = AffineMap::IDENTITY;
        let placed = layout.placements.iter().filter_map(|placement| {
            let panel = self.target().panels.iter().find(|panel| panel.id == placement.panel)?;
            Some(PlacedPanel::new(page, panel, placement, found_from_stated).among(layout))
        });
        placed.collect()
    }

    /// Print resolution, or finer where the cells of tags are small.
    fn wish_px_per_mm(&self, layout: &SheetLayout) -> f64 {
        let panels = self.target().panels.iter();
        let here = panels.filter(|panel| layout.placements.iter().any(|p| p.panel == panel.id));
        let cells_mm = here.filter_map(|panel| {
            panel.border_bits?;
            let family = self.family?.of_tiling(panel.kind)?;
            Some(panel.edge_mm / family.cells().width(panel.tag_inset_bits()))
        });
        cells_mm.map(|cell_mm| CELL_PX / cell_mm).fold(PRINT_PX_PER_MM, f64::max)
    }

    fn verify_page(
        &self,
        source: Source,
        index: usize,
    ) -> Result<(SheetVerdict, Seen), DocumentError> {
        let layout = &self.printing.sheets[index];
        let (page, findings) =
            source.render(layout, self.wish_px_per_mm(layout), self.printing.finish.mirrored)?;
        let mut verdict = SheetVerdict::new(index, &page, findings);
        let seen = self.verify_sheet(&page, layout, &mut verdict);
        Ok((verdict, seen))
    }

    /// Compares a sheet that is printed on several pages, with so many pages of other sheets `before` it: first the area around the window of each
    /// page, then the sheet assembled from all windows.
    fn verify_pages(
        &self,
        sources: &[Source],
        index: usize,
        before: usize,
    ) -> Result<(SheetVerdict, Seen), DocumentError> {
        let layout = &self.printing.sheets[index];
        let wish = self.wish_px_per_mm(layout);
        let most = (document::MAX_PIXELS / (layout.width_mm * layout.height_mm)).sqrt();
        let mut pages = Vec::with_capacity(sources.len());
        let mut findings = Vec::new();
        let mut check_bars_mm = Vec::new();
        for (source, SheetPage { label, window_mm, marks, .. }) in sources.iter().zip(&layout.pages)
        {
            let (page, wrong) = source.render(marks, wish, self.printing.finish.mirrored)?;
            let mut verdict = SheetVerdict::new(index, &page, wrong);
            check_bars(&page, marks, &AffineMap::IDENTITY, &mut verdict);
            let logo = self.printing.logo.as_ref();
            marks::check(&page, (marks, logo), &[], Some(*window_mm), &mut verdict);
            let of_page = verdict.findings.into_iter();
            findings.extend(of_page.map(|finding| finding.on_page(label.clone())));
            check_bars_mm.extend(verdict.check_bars_mm);
            // Kept no finer than the sheet is looked at.
            pages.push(if wish > most {
                source.render(marks, most, self.printing.finish.mirrored)?.0
            } else {
                page
            });
            // The whole sheet is compared after them.
            self.tell(before + pages.len() - 1, self.printing.page_count());
        }
        let (sheet, different) = assemble::assemble(&pages, layout, wish.min(most));
        let mut verdict = SheetVerdict::new(index, &sheet, different);
        verdict.pages = pages.len();
        let seen = self.verify_sheet(&sheet, layout, &mut verdict);
        verdict.findings.extend(findings);
        verdict.check_bars_mm = check_bars_mm;
        Ok((verdict, seen))
    }

    /// Compares the panels and marks of a whole sheet.
    fn verify_sheet(&self, page: &Page, layout: &SheetLayout, verdict: &mut SheetVerdict) -> Seen {
        let placed = self.placed(page, layout);
        let all_stated = placed.len() == layout.placements.len() && stated::is_for(&placed);
        let (found_from_stated, seen) = if all_stated {
            stated::check(self, page, layout, verdict);
            (AffineMap::IDENTITY, Seen::new())
        } else {
            board::check(self, page, layout, verdict)
        };
        let toneless = |finding: &Finding| {
            use BoardFinding::{Contrast, Inverted};
            matches!(finding, Finding::Board(Inverted { .. } | Contrast { .. }))
        };
        if verdict.findings.iter().any(toneless) {
            return seen;
        }
        let in_place = verdict.findings.iter().all(Finding::is_local);
        check_bars(page, layout, &found_from_stated, verdict);
        if in_place {
            let logo = self.printing.logo.as_ref();
            marks::check(page, (layout, logo), &placed, None, verdict);
        }
        seen
    }
}

/// What is looked at is drawn: as bright as it is stated, and without ink that spreads.
fn detector_config() -> DetectorConfig {
    DetectorConfig::default().tone(Tone::Linear).ink(Ink::Um(0.0))
}

/// The name of a file, or of the first and the last of several.
fn of_all(files: &[PathBuf]) -> String {
    match files {
        [first, .., last] => format!("{} to {}", file_name(first), file_name(last)),
        _ => files.iter().map(|file| file_name(file)).collect(),
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A page of a document.
#[derive(Clone, Copy)]
struct Source<'a> {
    document: &'a Document,
    page: usize,
}

impl Source<'_> {
    /// The page as a picture, turned over where it is printed as its mirror image, and whether it has the stated size.
    fn render(
        &self,
        layout: &SheetLayout,
        px_per_mm: f64,
        is_mirrored: bool,
    ) -> Result<(Page, Vec<Finding>), DocumentError> {
        let tolerance_mm = self.document.size_tolerance_mm();
        let stated_mm = DVec2::new(layout.width_mm, layout.height_mm);
        let found_mm = self.document.size_mm(self.page);
        if found_mm.cmpgt(MOST_ENLARGED * stated_mm).any() {
            return Err(self.document.too_large(found_mm, stated_mm));
        }
        let mut page = self.document.render(self.page, px_per_mm)?;
        let turned = |page: Page| if is_mirrored { page.mirrored() } else { page };
        if (found_mm - stated_mm).abs().max_element() > tolerance_mm {
            let page = turned(page);
            return Ok((page, vec![PageFinding::PageSize { found_mm, stated_mm }.into()]));
        }
        // Pictures begin at the upper edge and end with a whole pixel: heights are counted from
        // the true lower edge, not from the end of the last pixel; so are those that are turned over, from the other side.
        (page.width_mm, page.height_mm) = (layout.width_mm, layout.height_mm);
        Ok((turned(page), Vec::new()))
    }
}

impl SheetVerdict {
    /// The verdict on a page of which only its size was looked at.
    fn new(index: usize, page: &Page, findings: Vec<Finding>) -> Self {
        Self {
            sheet: index + 1,
            has_discs: false,
            px_per_mm: page.px_per_mm,
            size_mm: DVec2::new(page.width_mm, page.height_mm),
            check_bars_mm: Vec::new(),
            corners: 0,
            corners_found: 0,
            tags: 0,
            tags_exact: 0,
            max_deviation_mm: 0.0,
            pages: 1,
            fold: None,
            findings,
        }
    }
}

/// The mesh, or the model for MuJoCo, with which a file is compared that is a part of it: a material library, a texture, or
/// the part of a mesh that has one. `target` is the name of the target.
pub fn whole_of(target: &str, name: &str) -> Option<String> {
    let number = |part: &str| {
        let (part, number) = part.rsplit_once('-')?;
        number.parse::<u32>().ok().map(|_| part.to_owned())
    };
    if let Some(part) = name.strip_suffix(".obj") {
        return number(part).filter(|mesh| mesh == target).map(|mesh| format!("{mesh}.xml"));
    }
    let picture = || {
        // A page of a target whose name ends so is none.
        let stem = name.strip_suffix(".png").filter(|stem| *stem != target)?;
        let of = |stem: &str| stem.strip_suffix("-texture").map(str::to_owned);
        of(stem).or_else(|| of(&number(stem)?).filter(|mesh| mesh == target))
    };
    let mesh = name.strip_suffix(".mtl").map(str::to_owned).or_else(picture)?;
    Some(format!("{mesh}.obj"))
}

/// Measures the check bars. Where the boards lie only tells where to look for them.
fn check_bars(
    page: &Page,
    layout: &SheetLayout,
    found_from_stated: &AffineMap,
    verdict: &mut SheetVerdict,
) {
    for (index, bar) in layout.check_bars.iter().enumerate() {
        let stated_mm = bar.length_mm();
        let found_mm =
            bars::measure(page, [bar.from_mm, bar.to_mm].map(|end| found_from_stated.apply(end)));
        verdict.check_bars_mm.push((stated_mm, found_mm));
        if found_mm.is_none_or(|found| (found - stated_mm).abs() > TOLERANCE_MM) {
            let finding = MarkFinding::CheckBar { bar: index + 1, found_mm, stated_mm };
            verdict.findings.push(finding.into());
        }
    }
}
