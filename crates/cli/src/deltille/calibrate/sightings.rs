//! Input options of the calibration commands: the target and its detections.

use std::path::PathBuf;

use anyhow::{Context, anyhow, ensure};
use clap::ValueEnum;

use super::compensation::{AllFrames, times_ns};
use super::detection_files::given;
use super::filming::{self, FilmArgs, Given};
use super::reasons::Reasons;
use crate::deltille::files::images::RecordingArgs;
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::{camera_file, target_file};
use crate::output::log;
use crate::values::whole;
use deltille::SheetUseError;
use deltille::calibrate::{
    Calibration, Excluded, Intrinsics, PanelPrior, Reason, Reference, UntaggedGrid, View, ViewSet,
    views,
};
use deltille::detect::{self, Detection, InkEstimate};
use deltille::export::calibration::Print;
use deltille::export::sheet::{self, Sheet};
use deltille::lattice::GridKind;
use deltille::layout::{CheckBar, Printing, SheetLayout};
use deltille::limits::Limits;
use deltille::targets::{SIDES, Target, TargetIdentity, format_mm, parse_length_mm};
use deltille_core::quantity::{Range, edge_mm, print_scale};
use deltille_core::words::counted;

/// Detections and their target.
#[derive(clap::Args)]
pub struct SightingsArgs {
    /// A video, an MCAP file, a bag of ROS 1 or 2, photographs or a folder of them; or detections (.json or .parquet) from
    /// `deltille detect`, or folders of them
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    film: FilmArgs,
    /// Target description: the .json of `deltille board`, or a .dsc; repeatable for several targets that do not move
    /// relative to each other, whose relative poses are estimated
    #[arg(long, value_name = "FILE")]
    target: Vec<PathBuf>,
    /// Family file, if the target uses a family that does not ship with the program
    #[arg(long, requires = "target")]
    family: Option<String>,
    #[command(flatten)]
    grid: GridArgs,
    /// Use --target even if the detections name another target
    #[arg(long)]
    assume_target: bool,
    #[command(flatten)]
    sheet: SheetArgs,
    #[command(flatten)]
    limits: ImageLimits,
}

/// An untagged board without a description file.
#[derive(clap::Args)]
pub struct GridArgs {
    /// Tiling of an untagged board, instead of --target; --edge gives its scale
    #[arg(long, value_name = "KIND", requires = "edge", conflicts_with = "target")]
    grid: Option<Kind>,
    /// Number of corner rows of the untagged board
    #[arg(long, requires_all = ["grid", "cols"], conflicts_with = "target", value_parser = whole(SIDES))]
    rows: Option<u32>,
    /// Number of corners per row of the untagged board
    #[arg(long, requires_all = ["grid", "rows"], conflicts_with = "target", value_parser = whole(SIDES))]
    cols: Option<u32>,
    /// Edge length of a tile of the untagged board, such as 20mm
    #[arg(
        long,
        requires = "grid",
        conflicts_with = "target",
        value_name = "LENGTH",
        allow_hyphen_values = true
    )]
    edge: Option<String>,
}

/// Known properties of the printed sheet.
#[derive(clap::Args)]
pub struct SheetArgs {
    /// Measured lengths of the check bars, horizontal and vertical, such as 269.3,199.6 (mm), or 10.6in,7.86in; one length is that
    /// of the horizontal bar, and the ratio applies to both directions
    #[arg(long, value_name = "ACROSS,UP", value_parser = lengths, allow_hyphen_values = true,
          conflicts_with = "print_scale")]
    measured: Option<Lengths>,
    /// Ratio of measured to nominal length of the check bars, instead of --measured, such as 0.9973,0.9981 or
    /// 269.3/270,199.6/200, or one for both
    #[arg(long, value_name = "ACROSS,UP", value_parser = scale, allow_hyphen_values = true)]
    print_scale: Option<[f64; 2]>,
    /// Known bend and print scale of the sheet: the .json of `calibrate --board-shape`
    #[arg(long, value_name = "FILE", conflicts_with_all = ["print_scale", "measured"])]
    shape: Option<PathBuf>,
}

/// Measured lengths of the check bars, mm: of the horizontal one, and of the vertical one if it was measured.
#[derive(Clone, Copy)]
struct Lengths {
    across_mm: f64,
    up_mm: Option<f64>,
}

fn lengths(text: &str) -> Result<Lengths, String> {
    let mm = |part: &str| {
        let expected =
            || "expected one length or two, across and up, such as 269.3,199.6".to_owned();
        parse_length_mm(part.trim()).map_err(|_| expected())
    };
    Ok(match text.split_once(',') {
        Some((across, up)) => Lengths { across_mm: mm(across)?, up_mm: Some(mm(up)?) },
        None => Lengths { across_mm: mm(text)?, up_mm: None },
    })
}

fn scale(text: &str) -> Result<[f64; 2], String> {
    let parts: Vec<&str> = text.split(',').collect();
    let number = |part: &str| {
        let value = |text: &str| text.trim().parse::<f64>().ok();
        let ratio = match part.split_once('/') {
            Some((measured, nominal)) => value(measured).zip(value(nominal)).map(|(m, n)| m / n),
            None => value(part),
        };
        // Beyond this range, the bars were misread.
        ratio.and_then(|ratio| print_scale::RANGE.check(ratio).ok()).ok_or_else(|| {
            format!(
                "`{part}` is not a valid ratio of measured to nominal length (near 1); for lengths use --measured"
            )
        })
    };
    match parts.as_slice() {
        [both] => Ok([number(both)?; 2]),
        [across, up] => Ok([number(across)?, number(up)?]),
        _ => Err("expected one number, or two (horizontal and vertical)".to_owned()),
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
    /// The calibration problem, without cameras yet.
    pub calibration: Calibration,
    /// The targets, with nominal corner positions.
    pub printed: Vec<Printing>,
    /// Images or detection files that show no target.
    pub empty: Vec<Empty>,
    /// Detections that do not belong to the target.
    pub left_out: Vec<Excluded>,
    /// Known properties of the print.
    pub print: Print,
    /// The detections of all images.
    pub detections: Vec<(String, Detection)>,
    /// Note about detections that do not name their target.
    pub unnamed: Option<String>,
}

impl GridArgs {
    /// Returns the board, if given.
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

    /// Returns the board and the target made from it, if given; requires a size that identifies each corner.
    pub fn read_target(&self) -> anyhow::Result<Option<(UntaggedGrid, Target)>> {
        let Some(grid) = self.read()? else { return Ok(None) };
        let made = grid
            .target("board")
            .context("--grid needs --rows and --cols to identify the corners")?;
        Ok(Some((grid, made.context("--grid")?)))
    }

    /// Returns the board and the target made from it, if given, otherwise the targets in `files`.
    pub fn or_targets(
        &self,
        files: &[PathBuf],
        limits: &Limits,
    ) -> anyhow::Result<(Vec<Printing>, Option<UntaggedGrid>)> {
        Ok(match self.read_target()? {
            Some((grid, target)) => (vec![target.into()], Some(grid)),
            None => (target_file::read_all_placed(files, limits).context("--target")?, None),
        })
    }
}

impl SightingsArgs {
    /// The files of the targets.
    pub fn target_files(&self) -> &[PathBuf] {
        &self.target
    }

    /// Whether the given target overrides the one named in detections and cameras.
    pub fn assumes_target(&self) -> bool {
        self.assume_target
    }

    /// Reads all input; of recordings, it selects the views to calibrate a camera with these intrinsics, unless all frames are
    /// needed. To measure the target, only views with unambiguous labels are used.
    pub fn read(
        &self,
        intrinsics: &Intrinsics,
        measure_target: bool,
        all_frames: bool,
    ) -> anyhow::Result<Sightings> {
        let limits = self.limits.limits();
        let mut printed = match self.target.is_empty() {
            true => Vec::new(),
            false => target_file::read_all_placed(&self.target, &limits).context("--target")?,
        };
        target_file::set_given_family(&mut printed, self.family.as_deref())?;
        let targets: Vec<Target> = printed.iter().map(|one| one.target.clone()).collect();
        ensure!(
            !measure_target || targets.len() < 2,
            "--measure-target: there are {} targets; measure each of them in a calibration of its own",
            targets.len()
        );
        let grid = self.grid.read()?;
        ensure!(
            grid.is_some() || !targets.is_empty(),
            "--target FILE is needed, or --grid deltille or checker with --edge for untagged boards"
        );
        let reference = reference(grid, &targets);
        let sheet = self.sheet.read(&limits, &reference.identities(), &printed)?;
        ensure!(
            !all_frames || targets.len() < 2,
            "--estimate-timing: the path of one target is needed; give one --target, not {}",
            targets.len()
        );
        let (film, assume) = (&self.film, self.assume_target);
        let read = match all_frames {
            true => self.followed(intrinsics, &reference, &limits).context("--estimate-timing")?,
            false => seen(&self.inputs, film, intrinsics, &reference, &limits, assume)?,
        };
        let Read { mut views, empty, mut left_out, ink, detections } = shown(read)?;
        if all_frames {
            left_out.extend(take_known(&mut views, &reference));
        }
        let board = match reference {
            Reference::Grid(grid) if measure_target => {
                let made = grid
                    .target("board")
                    .context("--measure-target needs --rows and --cols to identify the corners")?;
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
        printed.extend(board.map(Printing::from));
        Ok(Sightings { calibration, printed, views, empty, left_out, print, detections, unnamed })
    }
}

/// The photographed board without tags, target, or scene of several targets.
pub fn reference(grid: Option<UntaggedGrid>, targets: &[Target]) -> Reference<'_> {
    match (grid, targets) {
        (Some(grid), _) => Reference::Grid(grid),
        (None, [only]) => Reference::Target(only),
        (None, several) => Reference::Scene(several),
    }
}

impl SightingsArgs {
    /// Follows the target through all frames of a recording, or reads their detections.
    fn followed(
        &self,
        intrinsics: &Intrinsics,
        reference: &Reference,
        limits: &Limits,
    ) -> anyhow::Result<Read> {
        let RecordingArgs { topic, every } = &self.film.recording;
        check_every(*every)?;
        let given = match filming::are_images(&self.inputs)? {
            true => self.film.follow(&self.inputs, reference, intrinsics, limits)?,
            false => {
                filming::check_none([("--topic", topic.is_some())])?;
                given(&self.inputs, limits)?
            }
        };
        views_of(given, reference, self.assume_target)
    }

    /// The time stamps of the detections, and the number of views to select.
    pub fn all_frames(&self, detections: &[(String, Detection)]) -> anyhow::Result<AllFrames> {
        let times_ns = vec![times_ns(detections).context("--estimate-timing")?];
        Ok(AllFrames { times_ns, most: self.film.views.unwrap_or(filming::VIEWS) as usize })
    }
}

/// Rejects `--every` if all frames are needed.
pub fn check_every(every: u64) -> anyhow::Result<()> {
    ensure!(every == 1, "all frames are needed; omit --every {every}");
    Ok(())
}

impl SheetArgs {
    /// Reads the sheet properties, or returns the nominal sheet; `printed` contains the targets with their sheets.
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
            let measured = self.measured.map(|lengths| lengths.scale(&sheets)).transpose();
            let print_scale = measured.context("--measured")?.or(self.print_scale);
            return Ok(Sheet { print_scale, shape: None, sheets });
        };
        let show = || format!("--shape: {}", path.display());
        let text = limits.read_text(path).context("--shape")?;
        camera_file::warn_if_failed(path, &text);
        let sheet = sheet::read_sheet(&text, targets).with_context(show)?;
        Ok(Sheet { sheets, ..sheet })
    }
}

/// Largest relative error of a print that was not scaled to fit the page; paper and printers stretch by less.
const USUAL_PRINT: f64 = 0.02;

/// Plausible ratios of a check bar to its nominal length: prints that were scaled to another page are within it, swapped
/// lengths of bars are not.
const MEASURED: Range = Range { least: 0.8, most: 1.25, unit: "" };

impl Lengths {
    /// Returns the ratios of these lengths to those of the check bars on the first page, across and up.
    fn scale(self, sheets: &[SheetLayout]) -> anyhow::Result<[f64; 2]> {
        let page = sheets.first().map(SheetLayout::first_page);
        let bars = page.map_or(&[][..], |page| &page.check_bars);
        let ratio = |direction: &str, is_across: bool, measured_mm: f64| {
            let is_it = |bar: &&CheckBar| {
                let along = (bar.to_mm - bar.from_mm).abs();
                (along.x > along.y) == is_across
            };
            let bar = bars.iter().find(is_it).with_context(|| {
                format!(
                    "the description has no sheet with a {direction} check bar; use --print-scale"
                )
            })?;
            let nominal_mm = bar.length_mm();
            let ratio = measured_mm / nominal_mm;
            let ratio = MEASURED.check(ratio).map_err(|_| {
                anyhow!(
                    "{} is not the length of the {direction} check bar, which is {} long",
                    format_mm(measured_mm),
                    format_mm(nominal_mm)
                )
            })?;
            if (ratio - 1.0).abs() > USUAL_PRINT {
                log!(
                    "warning: --measured: the {direction} check bar is {} instead of {} long; if it was not misread, the print \
                     was scaled to fit the page",
                    format_mm(measured_mm),
                    format_mm(nominal_mm)
                );
            }
            Ok::<_, anyhow::Error>(ratio)
        };
        let across = ratio("horizontal", true, self.across_mm)?;
        let up = self.up_mm.map(|mm| ratio("vertical", false, mm)).transpose()?;
        Ok([across, up.unwrap_or(across)])
    }
}

/// Removes and reports the views in which corners cannot be identified.
pub fn take_sure(views: &mut Vec<View>, reference: &Reference) -> anyhow::Result<Vec<Excluded>> {
    let is_any_sure = views.iter().any(|view| reference.has_certain_labels(view));
    ensure!(
        is_any_sure || views.is_empty(),
        "--measure-target: none of {} shows all corners of the board; an untagged board must be fully visible to be \
         measured",
        counted(views.len(), "image")
    );
    let unsure = views.extract_if(.., |view| !reference.has_certain_labels(view));
    Ok(unsure.map(|view| left_out(view, NOT_WHOLE)).collect())
}

/// Removes and reports the views of an untagged board in which corners cannot be identified.
pub fn take_known(views: &mut Vec<View>, reference: &Reference) -> Vec<Excluded> {
    let unknown = views.extract_if(.., |view| !reference.labels_are_of_board(view));
    unknown.map(|view| left_out(view, IN_PART)).collect()
}

/// Reports an excluded view.
fn left_out(view: View, why: &str) -> Excluded {
    log!("excluded: {}: {why}", view.name);
    Excluded {
        camera: None,
        corners: view.corner_count(),
        view: view.name,
        image: view.image,
        panel: None,
        reason: Reason::Foreign(why.to_owned()),
    }
}

/// Why a view cannot identify the corners.
const IN_PART: &str = "the board is not fully visible in both directions, so its corners cannot be identified without \
                       tags";

/// Why a view cannot measure an untagged board.
const NOT_WHOLE: &str =
    "an untagged board must be fully visible to be measured, because its corners have no ids";

/// Returns the panel positions of the target, see [`Sheet::panels`].
pub fn panels(reference: &Reference, sheet: &Sheet) -> anyhow::Result<Vec<PanelPrior>> {
    sheet.panels(reference).map_err(as_option_error)
}

/// Moves the corners of all views to their positions on the sheet, see [`Sheet::put_on`].
pub fn put_on(sheet: &Sheet, target: Option<&Target>, views: &mut [View]) -> anyhow::Result<()> {
    sheet.put_on(target, views).map_err(as_option_error)
}

/// Describes an error of a sheet in terms of command-line options.
fn as_option_error(error: SheetUseError) -> anyhow::Error {
    match error {
        SheetUseError::Loose => anyhow!(
            "--target: independent boards in one file have no known relative pose; make a file for each board"
        ),
        _ => error.into(),
    }
}

/// An image that shows no target.
pub struct Empty {
    /// The image, or the file of its detection.
    pub path: PathBuf,
    /// The reason, if it is known.
    pub reason: Option<detect::Reason>,
}

/// Content of detections.
pub struct Read {
    pub views: Vec<View>,
    /// Images or detection files that show no target.
    pub empty: Vec<Empty>,
    /// Detections that do not belong to the target.
    pub left_out: Vec<Excluded>,
    /// Joint estimate of the ink spread from all images.
    pub ink: Option<InkEstimate>,
    /// The detections.
    pub detections: Vec<(String, Detection)>,
}

/// Returns an error if no image shows the target.
pub fn shown(read: Read) -> anyhow::Result<Read> {
    ensure!(!read.views.is_empty(), nothing_shown(&read.detections));
    Ok(read)
}

/// Reads detections, photographs or recordings. Accepts that no image shows the target.
pub fn seen(
    paths: &[PathBuf],
    film: &FilmArgs,
    intrinsics: &Intrinsics,
    reference: &Reference,
    limits: &Limits,
    is_assumed: bool,
) -> anyhow::Result<Read> {
    let given = match filming::are_images(paths)? {
        true => film.see(paths, reference, intrinsics, limits)?,
        false => {
            film.check_none()?;
            given(paths, limits)?
        }
    };
    views_of(given, reference, is_assumed)
}

/// Converts detections to views. Reports detections that do not belong to the target on standard error. If the target is
/// assumed, the names in the detections are ignored.
pub fn views_of(given: Given, reference: &Reference, is_assumed: bool) -> anyhow::Result<Read> {
    let Given { mut detections, files, first } = given;
    if is_assumed {
        assume(&mut detections, reference);
    }
    let ViewSet { views, empty, excluded: left_out, mixed, .. } = views(&detections, reference)?;
    if let Some(mixed) = mixed {
        log!("warning: {}: {mixed}", first.display());
    }
    for (index, out) in &left_out {
        log!("warning: excluded: {}: {}", files[*index].display(), out.reason);
    }
    let empty = empty.into_iter().map(|index| {
        let reason = detections[index].1.reasons.first().cloned();
        Empty { path: files[index].clone(), reason }
    });
    let empty = empty.collect();
    let left_out = left_out.into_iter().map(|(_, out)| out).collect();
    let ink = ink_of(&detections, reference);
    Ok(Read { views, empty, left_out, ink, detections })
}

/// Assigns all detections to the given targets; notes once if they name another target.
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
        log!("note: --assume-target: {detections} of {seen} are assigned to {own}");
    }
}

/// Reports that no image shows the target, with the most frequent reason.
pub fn nothing_shown(detections: &[(String, Detection)]) -> String {
    let mut reasons = Reasons::default();
    detections.iter().for_each(|(_, found)| reasons.add(found));
    reasons.nothing_shown(&counted(detections.len(), "image"))
}

/// Returns a note if some non-empty detections do not name their target.
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
            "note: {unnamed} of {all} {detections} not name a target; assumed to be {}",
            target.identity()
        )
    })
}

/// Estimates the ink spread jointly from all detections; warns about images detected without it.
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
        log!(
            "warning: {ink}, but {} of {} were detected without it; detect all images in one run",
            counted(without, "image"),
            found.len()
        );
    }
    Some(ink)
}
