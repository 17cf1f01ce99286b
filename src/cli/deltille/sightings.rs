//! What was photographed, and the detections of it: the options of commands that calibrate.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use clap::ValueEnum;

use super::target_file;
use crate::calibrate::{Reference, Shown, UntaggedGrid, View, views};
use crate::camera::Pose;
use crate::detect::Detection;
use crate::export::detection;
use crate::target::{GridKind, Target, TargetSpec, parse_length_mm};

/// Detections and what they show.
#[derive(clap::Args)]
pub struct SightingsArgs {
    /// Detections, the .json files of `deltille detect`, or folders of them
    #[arg(required = true, value_name = "DETECTIONS")]
    detections: Vec<PathBuf>,
    /// Description of the target: the .json of `deltille board`, or a .dsc
    #[arg(long, value_name = "FILE", conflicts_with = "grid")]
    target: Option<PathBuf>,
    /// An untagged board of this tiling instead; --edge says how large
    #[arg(long, value_name = "KIND", requires = "edge")]
    grid: Option<Kind>,
    /// Rows of corners of the untagged board
    #[arg(long, requires_all = ["grid", "cols"], value_parser = clap::value_parser!(u32).range(2..=500))]
    rows: Option<u32>,
    /// Corners in each row of the untagged board
    #[arg(long, requires_all = ["grid", "rows"], value_parser = clap::value_parser!(u32).range(2..=500))]
    cols: Option<u32>,
    /// Length of a tile's edge of the untagged board, such as 20mm
    #[arg(long, requires = "grid", value_name = "LENGTH", value_parser = length)]
    edge: Option<f64>,
    /// How the print came out, measured length over stated length of the check bars: across and up
    /// the sheet, such as 0.9973,0.9981
    #[arg(long, value_name = "ACROSS,UP", value_parser = scale)]
    print_scale: Option<[f64; 2]>,
}

/// A print farther from its size was not printed by mistake alone: the bars were misread.
const PRINT_SCALE: std::ops::RangeInclusive<f64> = 0.5..=2.0;

fn scale(text: &str) -> Result<[f64; 2], String> {
    let parts: Vec<&str> = text.split(',').collect();
    let number = |part: &str| {
        let value = part.trim().parse::<f64>().ok().filter(|value| PRINT_SCALE.contains(value));
        value.ok_or_else(|| format!("`{part}` is no measured length over stated length, near 1"))
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
    /// target_from_panel of each panel.
    pub panels: Vec<Pose>,
    /// Names of the pictures in which no view was found.
    pub empty: Vec<String>,
}

fn length(text: &str) -> Result<f64, String> {
    let mm = parse_length_mm(text).map_err(|error| error.to_string())?;
    if mm > 0.0 { Ok(mm) } else { Err("it must be positive".to_owned()) }
}

impl SightingsArgs {
    /// Whether the scale of the print is given.
    pub fn scale_measured(&self) -> bool {
        self.print_scale.is_some()
    }

    /// Reads everything.
    pub fn read(&self) -> anyhow::Result<Sightings> {
        let target: Option<Target> =
            self.target.as_deref().map(target_file::read).transpose().context("--target")?;
        let reference = match (&target, self.grid, self.edge) {
            (Some(target), ..) => Reference::Target(target),
            (None, Some(kind), Some(edge_mm)) => {
                let kind = match kind {
                    Kind::Deltille => GridKind::Deltille,
                    Kind::Checker => GridKind::Checker,
                };
                let size = self.rows.zip(self.cols).map(|(rows, cols)| [rows, cols]);
                Reference::Grid(UntaggedGrid { kind, edge_mm, size })
            }
            _ => bail!(
                "give --target FILE, or --grid deltille or checker with --edge for untagged boards"
            ),
        };
        let (mut views, empty) = read(&self.detections, &reference)?;
        if let Some(scale) = self.print_scale {
            let target = target.as_ref();
            if target.is_some_and(|target| matches!(target.spec, TargetSpec::Solid(_))) {
                bail!("--print-scale: the faces of a solid are measured by `rig --refine-target`");
            }
            for sighting in views.iter_mut().flat_map(|view| &mut view.sightings) {
                let angle_rad = target.map_or(0.0, |target| angle_on_sheet(target, sighting.panel));
                sighting.stretch(scale, angle_rad);
            }
        }
        Ok(Sightings { panels: reference.panels(), views, empty })
    }
}

/// How a panel is turned on its sheet, rad; 0 where no sheet is described.
fn angle_on_sheet(target: &Target, panel: usize) -> f64 {
    let id = target.panels[panel].id;
    let mut placements = target.sheets.iter().flat_map(|sheet| &sheet.placements);
    placements.find(|placement| placement.panel == id).map_or(0.0, |placement| placement.angle_rad)
}

/// The views that detections show, files or folders of them, and the names of those that show none.
/// Detections that do not belong to the target are told on standard error.
pub fn read(paths: &[PathBuf], reference: &Reference) -> anyhow::Result<(Vec<View>, Vec<String>)> {
    let mut detections = Vec::new();
    for path in files(paths)? {
        let show = || path.display().to_string();
        let text =
            std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", show()))?;
        let found: Detection = detection::read(&text).with_context(show)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        detections.push((name, found));
    }
    let Shown { views, empty, left_out } = views(&detections, reference)?;
    for error in left_out {
        eprintln!("warning: left out: {error}");
    }
    Ok((views, empty))
}

fn files(paths: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            files.extend(in_folder(path)?);
        } else {
            files.push(path.clone());
        }
    }
    Ok(files)
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
    ensure!(!files.is_empty(), "{}: no .json file in this folder", folder.display());
    files.sort();
    Ok(files)
}
