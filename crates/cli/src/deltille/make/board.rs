//! `deltille board` and `deltille checkerboard`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, bail};

use super::delivery::Delivery;
use super::settings::board_settings::{BoardSettings, OUTPUT, Plan};
use super::settings::finishing::{Finishing, Laser};
use super::settings::meshes::PlateMeshes;
use super::settings::template::Template;
use super::single_panel::{idle_without_pages, page};
use crate::deltille::files::written::{File, Formats, drawn, text_file};
use crate::output::log;
use deltille::export::dsc;
use deltille::family::{self, FamilyError, FamilyFileError, square_names};
use deltille::lattice::GridKind;
use deltille::layout::{Printing, tag_range};
use deltille::targets::TargetSpec;

/// Arguments of both commands.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: BoardSettings,
    /// Read settings that are not given as options from a TOML file
    #[arg(long, help_heading = OUTPUT, value_name = "FILE")]
    template: Option<PathBuf>,
    /// Write the settings as a TOML file
    #[arg(long, help_heading = OUTPUT, value_name = "FILE")]
    save_template: Option<PathBuf>,
    #[command(flatten)]
    delivery: Delivery,
    #[command(flatten)]
    meshes: PlateMeshes,
    #[command(flatten)]
    finishing: Finishing,
    #[command(flatten)]
    laser: Laser,
}

/// Creates a board, writes its files, and verifies them.
pub fn run(grid: GridKind, mut args: Args) -> anyhow::Result<ExitCode> {
    let file = args.delivery.take_file(&BoardSettings::ENDINGS)?;
    let given = args.settings.with(args.meshes, args.laser, args.finishing).for_file(file)?;
    let settings = match &args.template {
        Some(path) => given.or(BoardSettings::read(path, grid)?),
        None => given,
    };
    let (meshes, laser) = (settings.meshes(), &settings.laser);
    let mut plan = settings.plan(grid)?;
    // Meshes and laser drawings alone need no paper.
    plan.pdf &= settings.prints() || !(meshes.is_any() || laser.is_any());
    meshes.check_use(plan.spec.two_sided_mm)?;
    let family = plan.spec.tags.as_ref().map(|tags| family::resolve(&tags.family)).transpose();
    let family = match (family, grid) {
        (Err(FamilyFileError::Name(FamilyError::Unknown { name, .. })), GridKind::Checker) => {
            bail!(
                "--tags: unknown family of square tags `{name}` (known: {}); use one of these, or the path of a .json \
                 family file",
                square_names()
                    .iter()
                    .map(|name| format!("{name} ({})", name.replacen("aprilTag", "t", 1)))
                    .collect::<Vec<_>>()
                    .join(", ")
            )
        }
        (family, GridKind::Checker) => family.context("--tags")?,
        (family, GridKind::Deltille) => family.context("--family")?,
    };
    if let (Some(tags), GridKind::Checker) = (&plan.spec.tags, grid)
        && tags.spacing > 1
        && !tags.spacing.is_multiple_of(2)
    {
        log!(
            "warning: --tag-spacing {}: with an odd number, only every second of these squares has the \
             colour of the tags; with an even number, all of them have",
            tags.spacing
        );
    }
    let spec = TargetSpec::Board(plan.spec.clone());
    let is_printed = plan.pdf || plan.svg || plan.png;
    if !is_printed {
        idle_without_pages(&plan.paper)?;
    }
    let paper = is_printed.then_some(&plan.paper);
    let printing = Printing::build(&plan.name, &spec, family.as_ref(), paper)?;
    let finishing = &settings.finishing;
    let printing = finishing.applied(printing, plan.paper.margin_mm, plan.pdf, laser)?;
    let target = &printing.target;
    args.delivery.check_beside(target)?;
    let template = args.save_template.as_deref().map(|path| {
        let text = settings.clone().with_edge(plan.spec.edge_mm).to_toml(grid);
        Template::new(path, text, args.delivery.overwrite)
    });
    let template = template.transpose()?;
    let mut files = files(&plan, &printing)?;
    let (meshes, texture) = meshes.files(target)?;
    files.extend(meshes);
    files.extend(laser.files(&printing)?);
    let description = summary(&printing) + &texture + &laser.order();
    let delivered = args.delivery.deliver(&printing, &files, &description)?;
    template.map_or(Ok(()), |template| template.write())?;
    Ok(delivered)
}

/// Returns the files of a plan. Rejects invalid ones before anything is written.
fn files(plan: &Plan, printing: &Printing) -> anyhow::Result<Vec<File>> {
    let name = &printing.target.name;
    let mut files = vec![text_file(format!("{name}.json"), printing.to_json())];
    if let Some(dialect) = plan.dsc {
        let text = dsc::write(&printing.target, dialect).context("--dsc")?;
        files.push(text_file(format!("{name}.dsc"), text));
    }
    let formats = Formats { pdf: plan.pdf, svg: plan.svg, png: plan.png };
    if !printing.sheets.is_empty() {
        files.extend(drawn(name, printing.draw()?, formats, plan.dpi));
    }
    Ok(files)
}

/// Describes the board in one line.
fn summary(printing: &Printing) -> String {
    let target = &printing.target;
    let panels = &target.panels;
    let TargetSpec::Board(spec) = &target.spec else { return target.name.to_string() };
    let edge = spec.edge_mm;
    let boards = if spec.boards == 1 { String::new() } else { format!("{} × ", panels.len()) };
    let mut text =
        format!("{}: {boards}{} × {} corners, edge {edge} mm", target.name, spec.rows, spec.cols);
    if let Some(thickness_mm) = spec.two_sided_mm {
        text += &format!(", two sides {} mm apart", (thickness_mm * 1e3).round() / 1e3);
    }
    let mut ids = panels.iter().flat_map(|panel| &panel.tags).map(|tag| tag.id);
    if let (Some(family), Some(first)) = (&target.family, ids.next()) {
        let last = ids.next_back().unwrap_or(first);
        text += &format!(", {}", tag_range(&family.name, first, last));
    }
    text + &page(printing)
}
