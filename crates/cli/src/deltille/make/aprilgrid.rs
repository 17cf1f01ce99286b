//! `deltille aprilgrid`.

use std::process::ExitCode;

use anyhow::Context;

use super::settings::board_settings::TAGS;
use super::settings::meshes::PlateMeshes;
use super::single_panel::{PrintingArgs, page};
use crate::deltille::files::written::text_file;
use crate::output::log;
use crate::values::{Grid, number, whole};
use deltille::family;
use deltille::layout::tag_range;
use deltille::targets::{AprilGridSpec, TargetSpec, parse_length_mm};

#[derive(clap::Args)]
pub struct Args {
    /// Tags per row and number of rows, such as 6x6
    #[arg(long, value_name = "COLUMNSxROWS")]
    tags: Grid,
    /// Side length of a tag including its black border (Kalibr's tagSize), such as 25mm, 8.8cm, 1in
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, default_value = "25mm", value_parser = parse_length_mm)]
    edge: f64,
    /// Gap between tags as a fraction of the tag's side, 0.1 to 0.9 (Kalibr's tagSpacing)
    #[arg(long, value_name = "FRACTION", default_value_t = 0.3, value_parser = number(0.1..=0.9))]
    gap: f64,
    /// Tag family; Kalibr supports only aprilTag36h11
    #[arg(long, help_heading = TAGS, default_value = "aprilTag36h11")]
    family: String,
    /// Id of the first tag, at the lower left; the others follow row by row
    #[arg(long, help_heading = TAGS, value_name = "ID", default_value_t = 0,
          value_parser = whole(0..=u32::MAX))]
    first_id: u32,
    /// Width of a tag's black border in cells, 1 to 10; Kalibr supports only 2, most other
    /// detectors only 1
    #[arg(long, help_heading = TAGS, value_name = "BITS", default_value_t = 2.0,
          value_parser = number(1.0..=10.0))]
    tag_border: f64,
    /// Id of the board
    #[arg(long, value_name = "ID", default_value_t = 0,
          value_parser = whole(0..=u32::MAX))]
    board_id: u32,
    #[command(flatten)]
    printing: PrintingArgs,
    #[command(flatten)]
    meshes: PlateMeshes,
}

/// Creates a grid, writes its files and Kalibr's target file, and verifies them.
pub fn run(mut args: Args) -> anyhow::Result<ExitCode> {
    args.printing.take_file(Some(&mut args.meshes.meshes))?;
    args.meshes.check_use(None)?;
    let is_made = args.meshes.is_any();
    let Grid(tags) = args.tags;
    let spec = AprilGridSpec {
        gap: args.gap,
        family: args.family,
        first_id: args.first_id,
        border_bits: args.tag_border,
        board_id: args.board_id,
        ..AprilGridSpec::new(tags, args.edge)
    };
    let family = Some(family::resolve(&spec.family).context("--family")?);
    let family = family.as_ref();
    let printing =
        args.printing.build("aprilgrid", &TargetSpec::AprilGrid(spec.clone()), family, is_made)?;
    let mut files = args.printing.files(&printing, is_made)?;
    let (meshes, texture) = args.meshes.files(&printing.target)?;
    files.extend(meshes);
    match spec.to_kalibr_yaml() {
        Some(yaml) => files.push(text_file(format!("{}.yaml", printing.target.name), yaml)),
        None => log!(
            "{}.yaml was not written: Kalibr supports only aprilTag36h11 tags with a border of 2 bits",
            printing.target.name
        ),
    }
    let [columns, rows] = spec.tags;
    let last = spec.first_id + spec.count() - 1;
    let summary = format!(
        "{}: {columns} × {rows} tags, edge {} mm, gaps {} mm, {}{}{texture}",
        printing.target.name,
        spec.tag_mm,
        (spec.gap * spec.tag_mm * 1e3).round() / 1e3,
        tag_range(family.map_or("", |family| family.name()), spec.first_id, last),
        page(&printing)
    );
    args.printing.deliver(&printing, &files, &summary)
}
