//! `deltille board`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use anyhow::{Context, bail};

use super::settings::{Plan, Settings};
use super::{target_file, verify};
use crate::artwork::{self, Artwork};
use crate::cli::interrupt;
use crate::export::{atomic, dsc, pdf, png, sheet_file_name, svg};
use crate::family::Family;
use crate::target::{Target, TargetSpec, id_range};

/// Arguments of `deltille board`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: Settings,
    /// Take what is not given here from a TOML file
    #[arg(long, value_name = "FILE")]
    template: Option<PathBuf>,
    /// Write the settings as a TOML file
    #[arg(long, value_name = "FILE")]
    save_template: Option<PathBuf>,
    /// Description of another target to be used together with this one: ids that both have are
    /// refused; may be repeated
    #[arg(long, value_name = "FILE")]
    with: Vec<PathBuf>,
    /// Folder to write to
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    /// Do not read the written files back to compare them with the description
    #[arg(long)]
    no_verify: bool,
}

/// Makes a board, writes its files, and verifies what it wrote.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let settings = match &args.template {
        Some(path) => args.settings.or(Settings::read(path)?),
        None => args.settings,
    };
    let plan = settings.plan()?;
    let family = plan.spec.tags.as_ref().map(|tags| Family::resolve(&tags.family)).transpose();
    let family = family.context("--family")?;
    let spec = TargetSpec::Board(plan.spec.clone());
    let target = Target::build(&plan.name, &spec, family.as_ref(), Some(&plan.paper))?;
    for path in &args.with {
        let other = target_file::read(path).context("--with")?;
        target.check_beside(&other)?;
    }
    let files = files(&plan, &target, artwork::draw(&target, family.as_ref())?)?;
    let written = write_all(&args.output, &files)?;
    if let Some(path) = &args.save_template {
        let template = settings.with_edge(plan.spec.edge_mm).to_toml();
        atomic::write(path, |out| out.write_all(template.as_bytes()))?;
    }
    println!("{}", summary(&target));
    for path in &written {
        println!("wrote {}", path.display());
    }
    if args.no_verify {
        return Ok(ExitCode::SUCCESS);
    }
    let drawn = |path: &PathBuf| path.extension().is_some_and(|e| e != "json" && e != "dsc");
    let artifacts: Vec<PathBuf> = written.into_iter().filter(drawn).collect();
    verify::verify(&target, family.as_ref(), &artifacts, None)
}

/// Writes one file to a path.
type Writer = dyn Fn(&Path) -> anyhow::Result<()>;

/// A file to be written: its name, and what writes it.
struct File {
    name: String,
    write: Box<Writer>,
}

/// The files of a plan. What can be refused is refused here, before anything is written.
fn files(plan: &Plan, target: &Target, artwork: Artwork) -> anyhow::Result<Vec<File>> {
    let name = &target.name;
    let artwork = std::rc::Rc::new(artwork);
    let mut files = vec![text_file(format!("{name}.json"), target.to_json())];
    if let Some(dialect) = plan.dsc {
        let text = dsc::write(target, dialect).context("--dsc")?;
        files.push(text_file(format!("{name}.dsc"), text));
    }
    if plan.pdf {
        let artwork = artwork.clone();
        let write = Box::new(move |path: &Path| Ok(pdf::write(&artwork, path)?));
        files.push(File { name: format!("{name}.pdf"), write });
    }
    let count = target.sheets.len();
    for index in 0..count {
        if plan.svg {
            let artwork = artwork.clone();
            let write = Box::new(move |path: &Path| Ok(svg::write(&artwork, index, path)?));
            files.push(File { name: sheet_file_name(name, index, count, "svg"), write });
        }
        if plan.png {
            let (artwork, dpi) = (artwork.clone(), f64::from(plan.dpi));
            let write = Box::new(move |path: &Path| {
                Ok(png::write(&artwork.sheets[index], &artwork.title, path, dpi)?)
            });
            files.push(File { name: sheet_file_name(name, index, count, "png"), write });
        }
    }
    Ok(files)
}

fn text_file(name: String, text: String) -> File {
    let write = move |path: &Path| Ok(atomic::write(path, |out| out.write_all(text.as_bytes()))?);
    File { name, write: Box::new(write) }
}

/// Writes all files into a folder beside their places, then moves them there: all or none.
fn write_all(folder: &Path, files: &[File]) -> anyhow::Result<Vec<PathBuf>> {
    let interrupted = interrupt::flag();
    let context = || format!("-o: cannot write to {}", folder.display());
    fs::create_dir_all(folder).with_context(context)?;
    let staging = tempfile::Builder::new().prefix(".deltille-").tempdir_in(folder);
    let staging = staging.with_context(context)?;
    for file in files {
        if interrupted.load(Ordering::Relaxed) {
            bail!("interrupted; nothing was written");
        }
        (file.write)(&staging.path().join(&file.name))?;
    }
    files
        .iter()
        .map(|file| {
            let path = folder.join(&file.name);
            fs::rename(staging.path().join(&file.name), &path)
                .with_context(|| format!("cannot write {}", path.display()))?;
            Ok(path)
        })
        .collect()
}

/// One line on what was made.
fn summary(target: &Target) -> String {
    let panels = &target.panels;
    let TargetSpec::Board(spec) = &target.spec else { return target.name.clone() };
    let (edge, sheet) = (spec.edge_mm, &target.sheets[0]);
    let boards = if panels.len() == 1 { String::new() } else { format!("{} × ", panels.len()) };
    let mut text =
        format!("{}: {boards}{} × {} corners, edge {edge} mm", target.name, spec.rows, spec.cols);
    let mut ids = panels.iter().flat_map(|panel| &panel.tags).map(|tag| tag.id);
    if let (Some(family), Some(first)) = (&target.family, ids.next()) {
        let last = ids.next_back().unwrap_or(first);
        text += &format!(", {} {}", family.name, id_range(first, last));
    }
    text + &format!(", page {} × {} mm", sheet.width_mm, sheet.height_mm)
}
