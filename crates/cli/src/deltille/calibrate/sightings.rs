//! What was photographed, and the detections of it: the options of commands that calibrate.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail, ensure};
use clap::ValueEnum;

use crate::deltille::files::limits::FileLimits;
use crate::deltille::files::{camera_file, detection_tables, target_file};
use crate::output::tell;
use crate::values::whole;
use deltille::SheetUseError;
use deltille::calibrate::{
    Calibration, Excluded, PanelPlace, Reason, Reference, Shown, UntaggedGrid, View, views,
};
use deltille::detect::{Detection, InkEstimate};
use deltille::export::calibration::Print;
use deltille::export::detection;
use deltille::export::sheet::{self, Sheet};
use deltille::export::tables::folder;
use deltille::lattice::GridKind;
use deltille::layout::Printing;
use deltille::limits::{Limits, ReadError};
use deltille::targets::{SIDES, Target, TargetIdentity, parse_length_mm};
use deltille_core::quantity::{edge_mm, print_scale};
use deltille_core::words::counted;

/// Detections and what they show.
#[derive(clap::Args)]
pub struct SightingsArgs {
    /// Detections, what `deltille detect` wrote as .json or .parquet, or folders of it
    #[arg(required = true, value_name = "DETECTIONS")]
    detections: Vec<PathBuf>,
    /// Description of the target: the .json of `deltille board`, or a .dsc
    #[arg(long, value_name = "FILE")]
    target: Option<PathBuf>,
    #[command(flatten)]
    grid: GridArgs,
    /// Use the target that is given even where the detections name another one
    #[arg(long)]
    assume_target: bool,
    #[command(flatten)]
    sheet: SheetArgs,
    #[command(flatten)]
    limits: FileLimits,
}

/// An untagged board that no file describes.
#[derive(clap::Args)]
pub struct GridArgs {
    /// An untagged board of this tiling instead; --edge says how large
    #[arg(long, value_name = "KIND", requires = "edge", conflicts_with = "target")]
    grid: Option<Kind>,
    /// Rows of corners of the untagged board
    #[arg(long, requires_all = ["grid", "cols"], value_parser = whole(SIDES))]
    rows: Option<u32>,
    /// Corners in each row of the untagged board
    #[arg(long, requires_all = ["grid", "rows"], value_parser = whole(SIDES))]
    cols: Option<u32>,
    /// Length of a tile's edge of the untagged board, such as 20mm
    #[arg(long, requires = "grid", value_name = "LENGTH", allow_hyphen_values = true)]
    edge: Option<String>,
}

/// What is known of the sheet beforehand.
#[derive(clap::Args)]
pub struct SheetArgs {
    /// How the print came out, measured length over stated length of the check bars: across and up
    /// the sheet, such as 0.9973,0.9981, or one number for both
    #[arg(long, value_name = "ACROSS,UP", value_parser = scale, allow_hyphen_values = true)]
    print_scale: Option<[f64; 2]>,
    /// How the sheet is bent and printed, found before: the .json of `calibrate --board-shape`
    #[arg(long, value_name = "FILE", conflicts_with = "print_scale")]
    shape: Option<PathBuf>,
}

fn scale(text: &str) -> Result<[f64; 2], String> {
    let parts: Vec<&str> = text.split(',').collect();
    let number = |part: &str| {
        // Farther from its size no print is: the bars were misread.
        print_scale::RANGE
            .parse(part)
            .map_err(|_| format!("`{part}` is no measured length over stated length, near 1"))
    };
    match parts.as_slice() {
        [both] => Ok([number(both)?; 2]),
        [across, up] => Ok([number(across)?, number(up)?]),
        _ => Err("give one number, or two: across and up the sheet".to_owned()),
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Kind {
    /// Triangles
    Deltille,
    /// Squares
    Checker,
}

/// Views, and the panels that they show.
pub struct Sightings {
    pub views: Vec<View>,
    /// A calibration of what was photographed, as yet without cameras.
    pub calibration: Calibration,
    /// What was photographed, with its corners where the plan has them.
    pub target: Option<Printing>,
    /// Files of the detections in which no view was found.
    pub empty: Vec<PathBuf>,
    /// What does not belong to the target.
    pub left_out: Vec<Excluded>,
    /// What is known of the print.
    pub print: Print,
    /// What is to be noted of detections that do not name their target.
    pub unnamed: Option<String>,
}

impl GridArgs {
    /// The board, if there is one.
    pub fn read(&self) -> anyhow::Result<Option<UntaggedGrid>> {
        let (Some(kind), Some(edge)) = (self.grid, &self.edge) else { return Ok(None) };
        let kind = match kind {
            Kind::Deltille => GridKind::Deltille,
            Kind::Checker => GridKind::Checker,
        };
        let mm = parse_length_mm(edge).context("--edge")?;
        let edge_mm = edge_mm::RANGE.check(mm).context("--edge")?;
        let size = self.rows.zip(self.cols).map(|(rows, cols)| [rows, cols]);
        Ok(Some(UntaggedGrid { kind, edge_mm, size }))
    }

    /// The board as a target, if there is one, where it must be known which corner is which; and the board.
    pub fn read_target(&self) -> anyhow::Result<Option<(UntaggedGrid, Target)>> {
        let Some(grid) = self.read()? else { return Ok(None) };
        let made = grid
            .target("board")
            .context("--grid: give --rows and --cols, so that it is known which corner is which")?;
        Ok(Some((grid, made.context("--grid")?)))
    }
}

impl SightingsArgs {
    /// Whether the target is taken as it is given, whatever detections and cameras name.
    pub fn assumes_target(&self) -> bool {
        self.assume_target
    }

    /// Reads everything. Where the target is to be measured, it takes views whose labels are sure.
    pub fn read(&self, measure_target: bool) -> anyhow::Result<Sightings> {
        let limits = self.limits.limits();
        let target = self.target.as_deref().map(|path| target_file::read_placed(path, &limits));
        let target: Option<Printing> = target.transpose().context("--target")?;
        let reference = match (&target, self.grid.read()?) {
            (Some(printing), _) => Reference::Target(&printing.target),
            (None, Some(grid)) => Reference::Grid(grid),
            _ => bail!(
                "give --target FILE, or --grid deltille or checker with --edge for untagged boards"
            ),
        };
        let sheet = self.sheet.read(&limits, &reference.identities(), target.as_slice())?;
        let Read { mut views, empty, mut left_out, ink, detections } =
            read(&self.detections, &reference, &limits, self.assume_target)?;
        let board = match reference {
            Reference::Grid(grid) if measure_target => {
                let made = grid.target("board").context(
                    "--measure-target: give --rows and --cols, so that it is known which corner is which",
                )?;
                Some(made.context("--measure-target")?)
            }
            _ => None,
        };
        if measure_target {
            left_out.extend(take_sure(&mut views, &reference)?);
        }
        put_on(&sheet, reference.targets().first(), &mut views)?;
        let panels = panels(&reference, &sheet)?;
        let print = Print { scale: sheet.print_scale, ink };
        let unnamed = unnamed(&detections, &reference).filter(|_| !self.assume_target);
        let named = detections.iter().flat_map(|(_, found)| found.targets.clone());
        let calibration = Calibration::of(&reference, panels).named_by(named);
        let target = target.or(board.map(Printing::from));
        Ok(Sightings { calibration, target, views, empty, left_out, print, unnamed })
    }
}

impl SheetArgs {
    /// The sheet, where nothing is known as it was planned; `printed` are the targets with their sheets.
    pub fn read(
        &self,
        limits: &Limits,
        targets: &[TargetIdentity],
        printed: &[Printing],
    ) -> anyhow::Result<Sheet> {
        let sheets = match printed {
            [only] => only.sheets.clone(),
            _ => Vec::new(),
        };
        let Some(path) = &self.shape else {
            return Ok(Sheet { print_scale: self.print_scale, shape: None, sheets });
        };
        let show = || format!("--shape: {}", path.display());
        let text = limits.read_text(path).context("--shape")?;
        camera_file::warn_if_failed(path, &text);
        let sheet = sheet::read_sheet(&text, targets).with_context(show)?;
        Ok(Sheet { sheets, ..sheet })
    }
}

/// Takes out the views of which it is not known which corner is which, and tells them.
pub fn take_sure(views: &mut Vec<View>, reference: &Reference) -> anyhow::Result<Vec<Excluded>> {
    let is_any_sure = views.iter().any(|view| reference.is_sure_of(view));
    ensure!(
        is_any_sure || views.is_empty(),
        "--measure-target: none of {} shows all corners of the board, without tags it is measured where it is seen \
         whole",
        counted(views.len(), "picture")
    );
    let unsure = views.extract_if(.., |view| !reference.is_sure_of(view));
    Ok(unsure.map(|view| left_out(view, NOT_WHOLE)).collect())
}

/// Takes out the views of an untagged board in which it is not known which corner is which, and tells them.
pub fn take_known(views: &mut Vec<View>, reference: &Reference) -> Vec<Excluded> {
    let unknown = views.extract_if(.., |view| !reference.labels_are_of_board(view));
    unknown.map(|view| left_out(view, IN_PART)).collect()
}

/// A view that takes no part, which is told.
fn left_out(view: View, why: &str) -> Excluded {
    tell!("left out: {}: {why}", view.name);
    Excluded {
        camera: None,
        corners: view.corner_count(),
        view: view.name,
        image: view.image,
        panel: None,
        reason: Reason::Foreign(why.to_owned()),
    }
}

/// Why a view cannot tell which corner is which.
const IN_PART: &str = "the board is not seen from its first row and column to its last: without tags its corners are \
                       not known then";

/// Why a view cannot measure an untagged board.
const NOT_WHOLE: &str =
    "a board without tags is measured where it is seen whole: its corners have no ids";

/// Where the panels of what was photographed are, see [`Sheet::panels`].
pub fn panels(reference: &Reference, sheet: &Sheet) -> anyhow::Result<Vec<PanelPlace>> {
    sheet.panels(reference).map_err(told)
}

/// Moves the corners of all views to where their sheet has them, see [`Sheet::put_on`].
pub fn put_on(sheet: &Sheet, target: Option<&Target>, views: &mut [View]) -> anyhow::Result<()> {
    sheet.put_on(target, views).map_err(told)
}

/// What is wrong with a sheet, in words of the command line.
fn told(error: SheetUseError) -> anyhow::Error {
    match error {
        SheetUseError::Loose => anyhow!(
            "--target: boards of one file that lie about have no place in a scene: make a file for each"
        ),
        _ => error.into(),
    }
}

/// What detections show.
pub struct Read {
    pub views: Vec<View>,
    /// Files of detections that show none.
    pub empty: Vec<PathBuf>,
    /// What does not belong to the target.
    pub left_out: Vec<Excluded>,
    /// What the pictures say together of the ink on the print.
    pub ink: Option<InkEstimate>,
    /// The detections.
    pub detections: Vec<(String, Detection)>,
}

/// The views that detections show, files or folders of them. What does not belong to the target is
/// told on standard error, too. Where the target is assumed, it does not matter which one the detections name.
pub fn read(
    paths: &[PathBuf],
    reference: &Reference,
    limits: &Limits,
    is_assumed: bool,
) -> anyhow::Result<Read> {
    let (mut files, mut detections, mut foreign) = (Vec::new(), Vec::new(), Vec::new());
    let mut copies = Vec::new();
    let Places { texts, tables } = places(paths)?;
    for Place { path, is_named } in texts {
        let show = || path.display().to_string();
        let text = match limits.read_text(&path) {
            Err(ReadError::NotText { .. }) => bail!(
                "{}: no text: pictures go to `deltille detect`, what it writes goes here",
                show()
            ),
            text => text?,
        };
        if !is_named && detection::is_foreign(&text) {
            foreign.push(path);
            continue;
        }
        let found: Detection = detection::read(&text).with_context(show)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        copies.extend(add(&mut detections, &mut files, (name, found), path));
    }
    for Tables { files: of_table, folder } in tables {
        // Beside the detections one by one they would count twice.
        if let Some(one) =
            folder.and_then(|folder| files.iter().find(|file| file.parent() == Some(&folder)))
        {
            tell!("left out: {}: {} says the same", of_table[0].display(), one.display());
            continue;
        }
        for (name, found) in of_tables(&of_table, limits)? {
            let path = of_table[0].with_file_name(&found.image);
            copies.extend(add(&mut detections, &mut files, (name, found), path));
        }
    }
    if let Some((copy, first)) = copies.first() {
        let others = match copies.len() - 1 {
            0 => String::new(),
            others => format!("; {others} more likewise"),
        };
        let (copy, first) = (copy.display(), first.display());
        tell!("warning: {copy}: the same corners as in {first}, counted once{others}");
    }
    if let Some(first) = foreign.first() {
        let count = counted(foreign.len(), "file");
        ensure!(
            !files.is_empty(),
            "{}: no detection among the .json files: make some with `deltille detect`",
            first.parent().unwrap_or(first).display()
        );
        tell!(
            "left out: {count} in the folder that hold no detection, such as {}",
            first.display()
        );
    }
    if is_assumed {
        assume(&mut detections, reference);
    }
    let Shown { views, empty, left_out, .. } = views(&detections, reference)?;
    for (index, out) in &left_out {
        tell!("warning: left out: {}: {}", files[*index].display(), out.reason);
    }
    ensure!(!views.is_empty(), nothing_shown(&detections));
    let empty = empty.into_iter().map(|index| files[index].clone()).collect();
    let left_out = left_out.into_iter().map(|(_, out)| out).collect();
    let ink = ink_of(&detections, reference);
    Ok(Read { views, empty, left_out, ink, detections })
}

/// Takes all detections for those of the targets that are given, and notes once where they name another one.
fn assume(detections: &mut [(String, Detection)], reference: &Reference) {
    let given = reference.identities();
    let mut replaced: Vec<([TargetIdentity; 2], usize)> = Vec::new();
    for pair in detections.iter_mut().flat_map(|(_, found)| found.assume_targets(&given)) {
        match replaced.iter_mut().find(|(other, _)| *other == pair) {
            Some((_, count)) => *count += 1,
            None => replaced.push((pair, 1)),
        }
    }
    for ([seen, own], count) in replaced {
        let detections = counted(count, "detection");
        tell!("note: --assume-target: {detections} of {seen} are taken for {own}");
    }
}

/// That no picture shows the target, with the reason that most of them give.
fn nothing_shown(detections: &[(String, Detection)]) -> String {
    let mut given = BTreeMap::new();
    for (_, found) in detections {
        let reasons: BTreeMap<_, _> = found.reasons.iter().map(|why| (why.kind, why)).collect();
        for (kind, why) in reasons {
            given.entry(kind).or_insert((0, why)).0 += 1;
        }
    }
    let pictures = counted(detections.len(), "picture");
    let most = given.into_values().max_by_key(|(count, _)| *count);
    let why = most.map(|(count, why)| format!("; {count} of them: {why}")).unwrap_or_default();
    format!("no board of this kind in {pictures}{why}")
}

/// What is to be noted where some of the detections that show something do not say which target they are of.
pub fn unnamed<'a>(
    detections: impl IntoIterator<Item = &'a (String, Detection)>,
    reference: &Reference,
) -> Option<String> {
    let target = reference.targets().first()?;
    let shown = detections.into_iter().filter(|(_, found)| !found.grids.is_empty());
    let (unnamed, all) = shown.fold((0, 0), |(unnamed, all), (_, found)| {
        (unnamed + usize::from(found.targets.is_empty()), all + 1)
    });
    let detections = if all == 1 { "detection does" } else { "detections do" };
    (unnamed > 0).then(|| {
        format!(
            "note: {unnamed} of {all} {detections} not name the target that they were made with; assumed to be {}",
            target.identity()
        )
    })
}

/// What detections say together of the ink; pictures that do not allow for it are told on standard error.
fn ink_of(detections: &[(String, Detection)], reference: &Reference) -> Option<InkEstimate> {
    let on_print = |ink: InkEstimate| match reference {
        Reference::Grid(grid) => ink.on_print(grid.edge_mm),
        Reference::Target(_) | Reference::Scene(_) => ink,
    };
    let found: Vec<InkEstimate> =
        detections.iter().filter_map(|(_, found)| Some(on_print(found.ink?))).collect();
    let ink = InkEstimate::of_all(&found)?;
    let without = found.iter().filter(|ink| !ink.used).count();
    if ink.used && without > 0 {
        tell!(
            "warning: {ink}, but {} of {} do not allow for it: detect all in one run",
            counted(without, "picture"),
            found.len()
        );
    }
    Some(ink)
}

/// Whether two detections are of one picture, whatever it is called: noise makes no corners twice.
pub fn is_same(one: &Detection, other: &Detection) -> bool {
    // Tables have no tags.
    let corners = one.grids.iter().map(|grid| &grid.corners);
    !one.grids.is_empty() && corners.eq(other.grids.iter().map(|grid| &grid.corners))
}

/// Adds a detection, unless it is of a picture that is there: then returns its file, and the file of the other.
fn add(
    detections: &mut Vec<(String, Detection)>,
    files: &mut Vec<PathBuf>,
    found: (String, Detection),
    path: PathBuf,
) -> Option<(PathBuf, PathBuf)> {
    if let Some(first) = detections.iter().position(|(_, other)| is_same(&found.1, other)) {
        return Some((path, files[first].clone()));
    }
    detections.push(found);
    files.push(path);
    None
}

/// The detections of tables, in the order in which their files would be as JSON.
fn of_tables(files: &[PathBuf], limits: &Limits) -> anyhow::Result<Vec<(String, Detection)>> {
    let pictures = detection_tables::read(files, limits)?;
    let all = pictures.len();
    let found: Vec<Detection> =
        pictures.into_iter().filter_map(|picture| picture.found.ok()).collect();
    if found.len() < all {
        let unread = counted(all - found.len(), "picture");
        let folder = files[0].parent().unwrap_or(&files[0]);
        tell!("left out: {unread} of the tables in {} that could not be read", folder.display());
    }
    let stem = |image: &str| {
        let stem = Path::new(image).file_stem();
        stem.map_or_else(|| image.to_owned(), |stem| stem.to_string_lossy().into_owned())
    };
    let stems: BTreeSet<String> = found.iter().map(|found| stem(&found.image)).collect();
    let are_told_apart = stems.len() == found.len();
    // Pictures of several folders may have one name; then the folders are part of theirs.
    let name = |found: &Detection| {
        let image = &found.image;
        let stem = stem(image);
        if are_told_apart {
            stem
        } else {
            Path::new(image).with_file_name(stem).display().to_string()
        }
    };
    let mut named: Vec<(String, Detection)> =
        found.into_iter().map(|found| (name(&found), found)).collect();
    named.sort_by_cached_key(|(name, found)| {
        (PathBuf::from(format!("{name}.json")), found.image.clone())
    });
    Ok(named)
}

/// Where detections may be.
struct Places {
    texts: Vec<Place>,
    tables: Vec<Tables>,
}

/// A file of a detection.
struct Place {
    path: PathBuf,
    /// Given by name, not only in a folder that was.
    is_named: bool,
}

/// Files of tables that belong together.
struct Tables {
    files: Vec<PathBuf>,
    /// The folder that was named, if they were not.
    folder: Option<PathBuf>,
}

fn places(paths: &[PathBuf]) -> anyhow::Result<Places> {
    let (mut texts, mut tables) = (Vec::new(), Vec::new());
    let mut named: Vec<PathBuf> = Vec::new();
    for path in paths {
        if path.is_dir() {
            let files = folder::files(path)?;
            let inside = in_folder(path)?;
            let show = path.display();
            ensure!(
                !(files.is_empty() && inside.is_empty()),
                "{show}: no .json or .parquet file in this folder"
            );
            texts.extend(inside.into_iter().map(|path| Place { path, is_named: false }));
            if !files.is_empty() {
                tables.push(Tables { files, folder: Some(path.clone()) });
            }
        } else if folder::is_named(path) {
            let both = [Some(path.clone()), folder::beside(path)];
            for file in both.into_iter().flatten() {
                if !named.contains(&file) {
                    named.push(file);
                }
            }
        } else {
            texts.push(Place { path: path.clone(), is_named: true });
        }
    }
    if !named.is_empty() {
        tables.push(Tables { files: named, folder: None });
    }
    Ok(Places { texts, tables })
}

/// The JSON files of a folder, in the order of their names.
fn in_folder(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let show = || format!("cannot read {}", folder.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(show)? {
        let path = entry.with_context(show)?.path();
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
