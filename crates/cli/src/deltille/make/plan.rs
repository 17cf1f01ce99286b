//! `deltille plan`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, bail, ensure};

use crate::deltille::files::camera_file;
use crate::output::{self, ResultFormat, log, say};
use crate::values::{distance, number};
use deltille::family::{self, positions};
use deltille::lattice::GridKind;
use deltille::layout::PaperSpec;
use deltille::layout::{Proposal, Situation};
use deltille::targets::{BoardSpec, TagSpec, TagsIn};
use deltille_core::words::counted;

/// Tilts for which the reading distance is reported, °.
const TOLD_DEG: [f64; 3] = [0.0, 45.0, 60.0];

/// Arguments of `deltille plan`.
#[derive(clap::Args)]
pub struct Args {
    /// Width and height of the camera's images in px, such as 1920x1080
    #[arg(long, value_name = "WxH", value_parser = size, required_unless_present = "camera")]
    size: Option<[u32; 2]>,
    /// Horizontal field of view of the camera in ° [default: 60]
    #[arg(long, value_name = "DEGREES", value_parser = number(0.1..=150.0), conflicts_with = "camera")]
    fov: Option<f64>,
    /// Camera file, instead of --size and --fov
    #[arg(long, value_name = "FILE", conflicts_with = "size")]
    camera: Option<PathBuf>,
    /// Range of distances from the camera to the board, such as 50cm..3m
    #[arg(long, value_name = "NEAR..FAR", value_parser = range)]
    distance: Distances,
    /// Maximum tilt at which all tags must be readable at the farthest distance, °
    #[arg(long, value_name = "DEGREES", default_value = "45", value_parser = number(0.0..=75.0))]
    tilt: f64,
    /// Propose a checkerboard
    #[arg(long)]
    checker: bool,
    /// Tag family; checkerboards have no tags unless it is given [default: delTag25h7]
    #[arg(long)]
    family: Option<String>,
    /// Propose a board of position codes, on which any 3 × 4 adjacent tiles identify the board (one
    /// of 255) and their position on it
    #[arg(long, conflicts_with_all = ["family", "checker"])]
    dense: bool,
    /// Propose a board without tags
    #[arg(long, conflicts_with_all = ["family", "dense"])]
    untagged: bool,
    /// Paper that the board must fit, such as A3 [default: up to A0]
    #[arg(long, value_name = "SIZE")]
    paper: Option<String>,
    #[command(flatten)]
    result_format: ResultFormat,
}

/// Parses width and height, px.
fn size(text: &str) -> Result<[u32; 2], String> {
    let sides =
        text.split_once(['x', '×']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let sides =
        sides.filter(|sides: &[u32; 2]| sides.iter().all(|side| (16..=50_000).contains(side)));
    sides.ok_or_else(|| "expected width and height in px, such as 1920x1080".to_owned())
}

/// Range of distances.
#[derive(Clone, Copy)]
struct Distances {
    mm: [f64; 2],
    has_unit: bool,
}

/// Parses two distances, mm; the unit may be given only once, at the end.
fn range(text: &str) -> Result<Distances, String> {
    let (near, far) = text
        .split_once("..")
        .ok_or_else(|| "expected two distances, such as 50cm..3m".to_owned())?;
    let unit = far.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
    let with_unit = match near.parse::<f64>() {
        Ok(_) => format!("{near}{unit}"),
        Err(_) => near.to_owned(),
    };
    let has_unit = !unit.is_empty();
    if !has_unit && near.parse::<f64>().is_err() {
        return Err(format!("the second distance has no unit; add one, such as {text}m"));
    }
    let parsed = distance(&with_unit).and_then(|near| Ok([near, distance(far)?]));
    let mm = parsed.map_err(|why| match has_unit {
        true => why,
        false => format!("{why}; a number without a unit is in mm, so add one, such as {text}m"),
    })?;
    if mm[0] < mm[1] {
        Ok(Distances { mm, has_unit })
    } else {
        Err("the first distance must be the shorter one".to_owned())
    }
}

impl Args {
    /// Returns the focal length and the image size, px.
    fn focal_and_size_px(&self) -> anyhow::Result<(f64, [u32; 2])> {
        match (&self.camera, self.size) {
            (Some(path), _) => {
                let camera = camera_file::read("--camera", path)?;
                ensure!(
                    camera.lens.is_perspective(),
                    "--camera: a fisheye has no single focal length; use --size and --fov for the part of the image in \
                     which the board will appear"
                );
                Ok((camera.focal_px.min_element(), [camera.width, camera.height]))
            }
            (None, Some(size)) => {
                let half = self.fov.unwrap_or(60.0).to_radians() / 2.0;
                Ok((f64::from(size[0]) / 2.0 / half.tan(), size))
            }
            (None, None) => bail!("--size (the image size) or --camera is needed"),
        }
    }
}

/// Proposes a board and prints the distances at which it can be used.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let (focal_px, size_px) = args.focal_and_size_px()?;
    if !args.distance.has_unit {
        log!("note: --distance has no unit and was read as mm");
    }
    let situation = Situation {
        focal_px,
        size_px,
        distances_mm: args.distance.mm,
        tilt_rad: args.tilt.to_radians(),
    };
    let (kind, command) = match args.checker {
        true => (GridKind::Checker, "checkerboard"),
        false => (GridKind::Deltille, "board"),
    };
    let named = match (&args.family, args.checker || args.untagged) {
        (Some(name), _) => Some(name.clone()),
        (None, true) => None,
        (None, false) if args.dense => Some(positions::NAME.to_owned()),
        (None, false) => Some(TagSpec::default().family),
    };
    let option = if args.checker { "--tags" } else { "--family" };
    let family = named.as_deref().map(family::resolve).transpose().context("--family")?;
    if let Some(family) = &family {
        ensure!(
            family.kind() == kind,
            "--family: {} is for the other tiling; use another family, or --checker",
            family.name()
        );
    }
    let tags = named.as_deref().map(|name| TagSpec::usual(kind, Some(name), TagsIn::Black));
    let paper = PaperSpec {
        size: args.paper.as_deref().map(str::parse).transpose().context("--paper")?,
        ..PaperSpec::default()
    };
    let proposal = situation.board(kind, tags.zip(family.as_ref()), &paper)?;
    let tags = match &named {
        Some(_) if args.dense => " --dense".to_owned(),
        Some(name) => format!(" {option} {name}"),
        None if args.checker => String::new(),
        None => " --untagged".to_owned(),
    };
    let paper = args.paper.as_ref().map_or(String::new(), |paper| format!(" --paper {paper}"));
    let BoardSpec { rows, cols, edge_mm, .. } = proposal.spec;
    let command =
        format!("deltille {command} --rows {rows} --cols {cols} --edge {edge_mm}mm{tags}{paper}");
    let to_mm = |tilt: f64| proposal.reach.labelled_to_mm(focal_px, tilt.to_radians());
    let patches_to_mm = |tilt: f64| proposal.patches_to_mm(focal_px, tilt.to_radians());
    if args.result_format.is_json() {
        output::print_json(&serde_json::json!({
            "schema": "deltille/plan/1",
            "command": command,
            "rows": rows, "cols": cols, "edge_mm": edge_mm, "family": named,
            "corners": proposal.reach.corners, "tags": proposal.reach.tags,
            "whole_from_mm": proposal.whole_from_mm,
            "labelled_to_mm": TOLD_DEG.map(|tilt| {
                serde_json::json!({ "tilt_deg": tilt, "distance_mm": to_mm(tilt) })
            }),
            "patches_labelled_to_mm": args.dense.then(|| TOLD_DEG.map(|tilt| {
                serde_json::json!({ "tilt_deg": tilt, "distance_mm": patches_to_mm(tilt) })
            })),
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    print(&situation, &proposal, &command)?;
    Ok(ExitCode::SUCCESS)
}

fn print(situation: &Situation, proposal: &Proposal, command: &str) -> anyhow::Result<()> {
    let Situation { focal_px, size_px: [width, height], distances_mm: [near, far], .. } =
        *situation;
    let across = 2.0 * (f64::from(width) / 2.0 / focal_px).atan().to_degrees();
    let px_mm = |distance: f64| distance / focal_px;
    say!(
        "camera: {width} × {height} px, {across:.0}° across; a pixel covers {:.2} mm at {}, {:.2} mm at {}",
        px_mm(near),
        shown(near),
        px_mm(far),
        shown(far)
    );
    say!("{command}");
    let whole = match proposal.reach.tags {
        0 => "; closer, the board is not labelled",
        _ if is_dense(proposal) => "; closer, any 3 × 4 visible tiles are labelled",
        _ => "; closer, visible parts with a tag are labelled",
    };
    say!(
        "{}, {}; fully in the image at {} or more{whole}",
        counted(proposal.reach.corners, "corner"),
        counted(proposal.reach.tags, "tag"),
        shown(proposal.whole_from_mm)
    );
    let reach = |what: &str, to_mm: &dyn Fn(f64) -> Option<f64>| {
        let to = TOLD_DEG.iter().filter_map(|&tilt| {
            let far = shown(to_mm(tilt.to_radians())?);
            Some(match tilt {
                0.0 => format!("up to {far} facing the camera"),
                _ => format!("up to {far} tilted by {tilt:.0}°"),
            })
        });
        let to: Vec<String> = to.collect();
        format!("{what} {}, in sharp images", to.join(", "))
    };
    say!("{}", reach("labelled", &|tilt| Some(proposal.reach.labelled_to_mm(focal_px, tilt))));
    if is_dense(proposal) {
        let patches = |tilt| proposal.patches_to_mm(focal_px, tilt);
        say!("{}", reach("patches of 3 × 4 tiles", &patches));
    }
    Ok(())
}

/// Whether the board has position codes.
fn is_dense(proposal: &Proposal) -> bool {
    proposal.spec.tags.as_ref().is_some_and(TagSpec::is_dense)
}

/// Formats a distance in a convenient unit.
fn shown(mm: f64) -> String {
    match mm {
        ..995.0 => format!("{:.0} cm", mm / 10.0),
        _ => format!("{:.1} m", mm / 1000.0),
    }
}
