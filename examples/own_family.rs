//! Searches for a new code family, proves the distance between its codes, and makes a board with it.
//!
//! ```text
//! cargo run --release --example own_family -- folder
//! ```

use std::error::Error;
use std::path::PathBuf;

use deltille::export::svg;
use deltille::family::search::best::{Best, Budget};
use deltille::family::{Control, certify};
use deltille::lattice::Dimension;
use deltille::layout::{PaperSpec, Printing};
use deltille::targets::{BoardSpec, TagSpec, TargetSpec};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".to_owned()));
    std::fs::create_dir_all(&folder)?;
    // 16 bits, any two codes in any rotation at least 7 cells apart: up to three misread cells are corrected.
    let (dimension, distance) = (Dimension::from_bits(16)?, 7);
    // A fixed number of steps gives the same codes on every machine.
    let search = Best::new(dimension, distance, Budget::Work(1)).seed(7);
    let family = search.family("own16h7", None, Control::default())?;
    let certificate = certify(&family);
    println!(
        "{}: {} codes, proved: {}",
        family.name(),
        family.codes().len(),
        certificate.is_valid()
    );
    std::fs::write(folder.join("own16h7.json"), family.to_json())?;

    let tags = TagSpec { family: "own16h7.json".to_owned(), ..TagSpec::default() };
    let spec = TargetSpec::Board(BoardSpec { tags: Some(tags), ..BoardSpec::deltille(5, 6, 20.0) });
    let board = Printing::build("own", &spec, Some(&family), Some(&PaperSpec::default()))?;
    let drawn = board.draw()?;
    svg::write(&drawn, 0, &folder.join("own.svg"))?;
    std::fs::write(folder.join("own.json"), board.to_json())?;
    println!("{} tags on the board", board.target.panels[0].tags.len());
    Ok(())
}
