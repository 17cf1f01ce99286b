//! `deltille charuco`.

use std::process::ExitCode;

use super::settings::board_settings::TAGS;
use super::settings::meshes::PlateMeshes;
use super::single_panel::{PrintingArgs, page};
use crate::values::{Grid, whole};
use deltille::family::{Family, dictionary};
use deltille::layout::tag_range;
use deltille::targets::{CharucoSpec, TargetSpec, parse_length_mm};

#[derive(clap::Args)]
pub struct Args {
    /// Squares per row and number of rows, such as 8x6
    #[arg(long, value_name = "COLUMNSxROWS")]
    squares: Grid,
    /// Edge length of a square, such as 30mm, 3cm, 1.2in
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, default_value = "30mm", value_parser = parse_length_mm)]
    edge: f64,
    /// Side length of a marker including its black border [default: three quarters of the square]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = parse_length_mm)]
    marker: Option<f64>,
    /// OpenCV dictionary: 4x4, 5x5, 6x6 or 7x7 with _50, _100, _250 or _1000; apriltag_16h5, apriltag_25h9 or
    /// apriltag_36h11
    #[arg(long, help_heading = TAGS, value_name = "NAME", default_value = "5x5_100")]
    dictionary: String,
    /// Id of the first marker; the others follow
    #[arg(long, help_heading = TAGS, value_name = "ID", default_value_t = 0,
          value_parser = whole(0..=u32::MAX))]
    first_id: u32,
    /// Use the pattern of OpenCV before 4.6, which starts with a white square if the number of rows is even (in
    /// OpenCV: setLegacyPattern(true))
    #[arg(long)]
    legacy: bool,
    /// Id of the board
    #[arg(long, value_name = "ID", default_value_t = 0,
          value_parser = whole(0..=u32::MAX))]
    board_id: u32,
    #[command(flatten)]
    printing: PrintingArgs,
    #[command(flatten)]
    meshes: PlateMeshes,
}

/// Creates a board, writes its files, and verifies them.
pub fn run(mut args: Args) -> anyhow::Result<ExitCode> {
    args.printing.take_file(Some(&mut args.meshes.meshes))?;
    args.meshes.check_use(None)?;
    let is_made = args.meshes.is_any();
    let Grid(squares) = args.squares;
    // An unknown name is rejected later, together with the other settings.
    let name = dictionary(&args.dictionary).map_or(args.dictionary, |(name, _)| name.to_owned());
    let usual = CharucoSpec::new(squares, args.edge, &name);
    let spec = CharucoSpec {
        marker_mm: args.marker.unwrap_or(usual.marker_mm),
        first_id: args.first_id,
        board_id: args.board_id,
        legacy: args.legacy,
        ..usual
    };
    let family = Family::shipped(&spec.dictionary).ok();
    let family = family.as_ref();
    let printing =
        args.printing.build("charuco", &TargetSpec::Charuco(spec.clone()), family, is_made)?;
    let mut files = args.printing.files(&printing, is_made)?;
    let (meshes, texture) = args.meshes.files(&printing.target)?;
    files.extend(meshes);
    let last = spec.first_id + spec.markers() - 1;
    let [columns, rows] = spec.squares;
    let summary = format!(
        "{}: {columns} × {rows} squares, edge {} mm, markers {} mm, {}{}{texture}",
        printing.target.name,
        spec.square_mm,
        spec.marker_mm,
        tag_range(&spec.dictionary, spec.first_id, last),
        page(&printing)
    );
    args.printing.deliver(&printing, &files, &summary)
}
