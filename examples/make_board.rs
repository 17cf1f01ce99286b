//! Makes a board, writes it as PDF, and verifies the file by reading it back.
//!
//! ```text
//! cargo run --release --example make_board -- folder
//! ```

use std::error::Error;
use std::path::PathBuf;

use deltille::export::pdf;
use deltille::layout::Printing;
use deltille::targets::BoardSpec;
use deltille::verify::Verifier;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".to_owned()));
    std::fs::create_dir_all(&folder)?;
    // 10 rows of 11 corners, tiles of 20 mm, tags of the default family.
    let board = Printing::new("desk", BoardSpec::deltille(10, 11, 20.0))?;
    let path = folder.join("desk.pdf");
    pdf::write(&board.draw()?, &path)?;
    // The description, which detection and calibration need.
    std::fs::write(folder.join("desk.json"), board.to_json())?;

    let verdict = Verifier::new(&board)?.verify_path(&path)?;
    println!("{verdict}");
    if !verdict.passed {
        return Err("the PDF does not match the board".into());
    }
    Ok(())
}
