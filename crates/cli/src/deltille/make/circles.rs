//! `deltille circles`.

use std::process::ExitCode;

use super::single_panel::{PrintingArgs, page};
use crate::values::{Grid, whole};
use deltille::targets::{CirclesSpec, TargetSpec, parse_length_mm};

#[derive(clap::Args)]
pub struct Args {
    /// Circles per row and number of rows, such as 9x7, or 4x11 for an asymmetric grid (OpenCV's patternSize)
    #[arg(long, value_name = "COLUMNSxROWS")]
    circles: Grid,
    /// Shift every second row (OpenCV's CALIB_CB_ASYMMETRIC_GRID)
    #[arg(long)]
    asymmetric: bool,
    /// Distance between rows. The spacing of circles in a row is the same, or twice this in an
    /// asymmetric grid
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, default_value = "20mm", value_parser = parse_length_mm)]
    spacing: f64,
    /// Diameter of a circle [default: half the spacing]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = parse_length_mm)]
    diameter: Option<f64>,
    /// Id of the board
    #[arg(long, value_name = "ID", default_value_t = 0,
          value_parser = whole(0..=u32::MAX))]
    board_id: u32,
    #[command(flatten)]
    printing: PrintingArgs,
}

/// Creates a grid, writes its files, and verifies them.
pub fn run(mut args: Args) -> anyhow::Result<ExitCode> {
    args.printing.take_file(None)?;
    let Grid(circles) = args.circles;
    let usual = CirclesSpec::new(circles, args.spacing);
    let spec = CirclesSpec {
        diameter_mm: args.diameter.unwrap_or(usual.diameter_mm),
        asymmetric: args.asymmetric,
        board_id: args.board_id,
        ..usual
    };
    let printing =
        args.printing.build("circles", &TargetSpec::Circles(spec.clone()), None, false)?;
    let files = args.printing.files(&printing, false)?;
    let summary = format!(
        "{}: {} × {} circles, spacing {} mm, diameter {} mm{}",
        printing.target.name,
        spec.circles[0],
        spec.circles[1],
        spec.spacing_mm,
        spec.diameter_mm,
        page(&printing)
    );
    args.printing.deliver(&printing, &files, &summary)
}
