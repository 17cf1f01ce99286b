//! Finds a target in all photographs of a folder, and writes the corners of each as CSV beside it.
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
    let [target, folder] = args.as_slice() else { return Err("give a target and a folder".into()) };
    let target = Target::from_json(&std::fs::read_to_string(target)?)?;
    let detector = Detector::new(&target)?;
    for path in pictures(Path::new(folder))? {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let found = detector.detect(&photograph::read(&path)?, &name);
        let corners: usize = found.grids.iter().map(|grid| grid.corners.len()).sum();
        println!("{name}: {corners} corners");
        // Why there are none, or fewer than there could be.
        for reason in &found.reasons {
            println!("    {reason}");
        }
        std::fs::write(path.with_extension("csv"), csv::write(&found))?;
    }
    Ok(())
}

fn pictures(folder: &Path) -> Result<Vec<PathBuf>, std::io::Error> {
    let files = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut files = files.collect::<Result<Vec<_>, std::io::Error>>()?;
    let is_picture = |end: &std::ffi::OsStr| end == "png" || end == "jpg";
    files.retain(|path| path.extension().is_some_and(is_picture));
    files.sort();
    Ok(files)
}
