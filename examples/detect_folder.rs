//! Detects a target in all images of a folder, and writes the corners of each as CSV beside it.
//!
//! ```text
//! cargo run --release --example detect_folder -- desk.json photos
//! ```

use std::error::Error;
use std::path::{Path, PathBuf};

use deltille::detect::Detector;
use deltille::export::csv;
use deltille::photograph;
use deltille::targets::Target;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [target, folder] = args.as_slice() else {
        return Err("usage: detect_folder TARGET.json FOLDER".into());
    };
    let target = Target::from_json(&std::fs::read_to_string(target)?)?;
    let detector = Detector::new(&target)?;
    for path in images(Path::new(folder))? {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let found = detector.detect(&photograph::read(&path)?, &name);
        let corners: usize = found.grids.iter().map(|grid| grid.corners.len()).sum();
        println!("{name}: {corners} corners");
        // Reasons why no corners, or not all of them, were detected.
        for reason in &found.reasons {
            println!("    {reason}");
        }
        std::fs::write(path.with_extension("csv"), csv::write(&found, &[&target]))?;
    }
    Ok(())
}

fn images(folder: &Path) -> Result<Vec<PathBuf>, std::io::Error> {
    let files = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut files = files.collect::<Result<Vec<_>, std::io::Error>>()?;
    let is_image = |end: &std::ffi::OsStr| end == "png" || end == "jpg";
    files.retain(|path| path.extension().is_some_and(is_image));
    files.sort();
    Ok(files)
}
