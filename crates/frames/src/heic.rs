//! HEIC photographs, decoded by an installed ffmpeg.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use deltille_core::raster::AnyGray;
use deltille_files::limits::Limits;

use crate::problem::Problem;
use crate::video::Video;

/// Number of first bytes that contain the size of the image: the metadata before the pixels.
const HEAD_BYTES: u64 = 1 << 20;

/// How to convert a photograph that is not read.
const CONVERT: &str = "convert it to PNG or JPEG, for example with `heif-convert` or `magick`";

/// Reads a HEIC photograph in sensor orientation.
pub(crate) fn read(path: &Path, limits: &Limits) -> Result<AnyGray, Problem> {
    let refused = |why: &str| Problem::Unsupported(format!("a HEIC photograph, {why}: {CONVERT}"));
    let mut head = Vec::new();
    let file = File::open(path).map_err(Problem::Io)?;
    file.take(HEAD_BYTES).read_to_end(&mut head).map_err(Problem::Io)?;
    let mut frames = match Video::open(path, false, limits) {
        Err(Problem::NoFfmpeg) => {
            return Err(refused("which is read only if ffmpeg 7 or newer is installed"));
        }
        frames => frames?,
    };
    let image = match frames.next() {
        Some(Ok(frame)) => frame.image,
        Some(Err(Problem::Exceeded(exceeded))) => return Err(exceeded.into()),
        _ => return Err(refused("which is damaged, or needs ffmpeg 7 or newer")),
    };
    // Versions that do not assemble the tiles of a photograph return one of them.
    let size = [image.width(), image.height()];
    // ffmpeg crops to even sizes.
    let is_whole = |stated: [usize; 2]| (0..2).all(|i| [size[i], size[i] + 1].contains(&stated[i]));
    if stated_sizes(&head).into_iter().any(is_whole) {
        return Ok(image);
    }
    Err(refused("and ffmpeg reads only a part of it; version 7 or newer is needed"))
}

/// Returns the largest size that a property `ispe` states: that of the photograph, not of its tiles or thumbnail; and the
/// sizes to which `clap` crops it, because encoders fill blocks at the right and at the bottom.
fn stated_sizes(head: &[u8]) -> Vec<[usize; 2]> {
    let side = |bytes: &[u8]| bytes.iter().fold(0, |side, byte| side << 8 | usize::from(*byte));
    let sizes = head.windows(16).filter(|bytes| bytes.starts_with(b"ispe"));
    let sizes = sizes.map(|bytes| [side(&bytes[8..12]), side(&bytes[12..16])]);
    let cropped = head.windows(20).filter(|bytes| bytes.starts_with(b"clap")).map(|bytes| {
        // Numerators and denominators of the width and of the height.
        [4, 12].map(|at| side(&bytes[at..at + 4]) / side(&bytes[at + 4..at + 8]).max(1))
    });
    sizes.max_by_key(|[width, height]| width * height).into_iter().chain(cropped).collect()
}
