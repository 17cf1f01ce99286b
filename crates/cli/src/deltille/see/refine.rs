//! `deltille refine`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, anyhow, bail, ensure};
use clap::ValueEnum;
use glam::DVec2;

use crate::deltille::files::images;
use crate::deltille::files::limits::ImageLimits;
use crate::output::{self, Overwrite};
use deltille::detect::{MAX_WINDOW_PX, RefineStatus, Refined, Refinement, Refiner, Tone};
use deltille::export::csv;
use deltille::frames::{Frame, is_recording};
use deltille::lattice::GridKind;
use deltille::limits::Limits;
use deltille::raster::AnyGray;

/// Largest number of corners to refine, about as many as in one image.
const MAX_SEEDS: usize = 20_000;

/// Arguments of `deltille refine`.
#[derive(clap::Args)]
pub struct Args {
    /// Photograph: PNG, JPEG, TIFF, BMP, PGM, WebP or HEIC
    #[arg(value_name = "IMAGE")]
    image: PathBuf,
    /// Tiling around the corners
    #[arg(long)]
    kind: Kind,
    /// Initial corner positions, `x,y` per line in px, with pixel centres at integers; a header line is skipped
    #[arg(long, value_name = "FILE")]
    seeds: PathBuf,
    /// Refinement method
    #[arg(long, default_value = "model")]
    method: Method,
    /// Side length of the square pixel window (odd); the polynomial method uses the largest radius
    /// r with 4r + 1 ≤ window
    #[arg(long, value_name = "PIXELS", default_value_t = 21, value_parser = window)]
    window: usize,
    /// Tone curve of the camera: linear, srgb, a gamma such as 2.2, or auto (estimated from all these corners)
    #[arg(long, value_name = "CURVE", default_value = "auto")]
    tone: Tone,
    /// Output file (.csv), or a folder [default: standard output]
    #[arg(short, long, value_name = "FILE.csv")]
    output: Option<PathBuf>,
    #[command(flatten)]
    limits: ImageLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Corner refinement method.
#[derive(Clone, Copy, ValueEnum)]
pub enum Method {
    /// Fit of a cubic (deltille) or quadric (checker), as in Ha et al., ICCV 2017; no covariances
    Polynomial,
    /// Fit of a blurred corner model to the pixels, with covariances
    Model,
}

impl From<Method> for Refinement {
    fn from(method: Method) -> Self {
        match method {
            Method::Polynomial => Self::Polynomial,
            Method::Model => Self::Model,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Kind {
    /// Six triangles meet at a corner
    Deltille,
    /// Four squares meet at a corner
    Checker,
}

fn window(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|side| side % 2 == 1 && (9..=MAX_WINDOW_PX).contains(side))
        .ok_or_else(|| format!("expected an odd number from 9 to {MAX_WINDOW_PX}"))
}

/// Refines all seeds; a seed without a corner nearby is reported in its line, not as an error.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let limits = args.limits.limits();
    let seeds = read_seeds(&args.seeds, &limits).context("--seeds")?;
    let kind = match args.kind {
        Kind::Deltille => GridKind::Deltille,
        Kind::Checker => GridKind::Checker,
    };
    let refiner = Refiner::new(kind, args.method.into(), args.window).with_tone(args.tone);
    ensure!(
        !is_recording(&args.image),
        "{}: refine reads one photograph; write the frame of this recording as an image first",
        args.image.display()
    );
    let photograph = Frame::photograph(args.image.clone()).read(&limits, false)?;
    let refined: Vec<Refined> = match photograph.image {
        AnyGray::U8(image) => refiner.refine_all(&image, &seeds),
        AnyGray::U16(image) => refiner.refine_all(&image, &seeds),
    };
    let table = table(&refined);
    match &args.output {
        Some(path) => {
            let stem = format!("{}-refined", images::stem(&args.image)?);
            output::write(&output::file(path, &stem, "csv")?, table.as_bytes(), args.overwrite)?;
        }
        None => output::print(&table)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Formats the results as CSV; covariances in px², empty if the method provides none.
fn table(refined: &[Refined]) -> String {
    let mut text = "x,y,cov_xx,cov_xy,cov_yy,status\n".to_owned();
    for Refined { position: DVec2 { x, y }, cov, status, .. } in refined {
        let cov = cov.map_or_else(|| ",,".to_owned(), |[xx, xy, yy]| format!("{xx},{xy},{yy}"));
        let status = match status {
            RefineStatus::Ok => "ok",
            RefineStatus::Polynomial => "polynomial",
            RefineStatus::Failed => "failed",
        };
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{x},{y},{cov},{status}");
    }
    text
}

fn read_seeds(path: &Path, limits: &Limits) -> anyhow::Result<Vec<DVec2>> {
    let text = limits.read_text(path)?;
    let seeds = csv::read_points(&text);
    let seeds = seeds.map_err(|problem| anyhow!("{}: {problem}", path.display()))?;
    if seeds.len() > MAX_SEEDS {
        bail!(
            "{}: {} points, but at most {MAX_SEEDS} can be refined at a time",
            path.display(),
            seeds.len()
        );
    }
    Ok(seeds)
}
