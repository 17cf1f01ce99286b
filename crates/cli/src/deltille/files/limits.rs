//! Options that limit how much of a file is read.

use crate::values::whole;
use deltille::limits::Limits;

/// Heading of these options in the help.
pub const HEADING: &str = "Input limits";

/// The limit of text files.
#[derive(clap::Args)]
pub struct FileLimits {
    /// Maximum file size in bytes, such as 500M [default: 200M]
    #[arg(long, help_heading = HEADING, value_name = "BYTES", value_parser = count)]
    max_bytes: Option<u64>,
}

/// The limits of commands that read images or have an image size.
#[derive(clap::Args)]
pub struct ImageLimits {
    #[command(flatten)]
    files: FileLimits,
    /// Maximum number of pixels per image, and of all images in memory together, such as 400M
    /// [default: 150M]
    #[arg(long, help_heading = HEADING, value_name = "PIXELS", value_parser = count)]
    max_pixels: Option<u64>,
    /// Maximum number of pixels per byte of the file, for photographs of more than 10 megapixels
    /// [default: 100]
    #[arg(long, help_heading = HEADING, value_name = "PIXELS", value_parser = count)]
    max_pixels_per_byte: Option<u64>,
}

/// All limits.
#[derive(clap::Args)]
pub struct AllLimits {
    #[command(flatten)]
    images: ImageLimits,
    /// Maximum number of parts of a file: elements, operators, nodes, triangles [default: 4M]
    #[arg(long, help_heading = HEADING, value_name = "PARTS", value_parser = count)]
    max_nodes: Option<u64>,
    /// Maximum nesting depth of parts [default: 64]
    #[arg(long, help_heading = HEADING, value_name = "LEVELS", value_parser = whole(1..=u16::MAX))]
    max_depth: Option<u16>,
    /// Time limit in seconds for reading a file, and for drawing a page [default: 60]
    #[arg(long, help_heading = HEADING, value_name = "SECONDS", value_parser = whole(1..=u32::MAX))]
    max_seconds: Option<u32>,
}

impl FileLimits {
    pub fn limits(&self) -> Limits {
        let mut limits = Limits::default();
        set(&mut limits.max_bytes, self.max_bytes);
        limits
    }
}

impl ImageLimits {
    pub fn limits(&self) -> Limits {
        let mut limits = self.files.limits();
        set(&mut limits.max_pixels, self.max_pixels);
        set(&mut limits.max_pixels_per_byte, self.max_pixels_per_byte);
        limits
    }
}

impl AllLimits {
    pub fn limits(&self) -> Limits {
        let mut limits = self.images.limits();
        set(&mut limits.max_nodes, self.max_nodes);
        set(&mut limits.max_depth, self.max_depth.map(usize::from));
        set(&mut limits.max_seconds, self.max_seconds.map(f64::from));
        limits
    }
}

/// Sets a limit, if given.
fn set<T>(limit: &mut T, given: Option<T>) {
    if let Some(given) = given {
        *limit = given;
    }
}

/// Parses a positive integer with an optional suffix k, M or G (10³, 10⁶, 10⁹).
fn count(text: &str) -> Result<u64, String> {
    let unit = |suffix: char, factor: u64| Some((text.strip_suffix(suffix)?, factor));
    let units = [unit('k', 1_000), unit('M', 1_000_000), unit('G', 1_000_000_000)];
    let (digits, factor) = units.into_iter().flatten().next().unwrap_or((text, 1));
    let number = digits.parse::<u64>().ok().and_then(|number| number.checked_mul(factor));
    let number = number.filter(|&number| number > 0);
    number.ok_or_else(|| {
        "expected a whole number above 0, such as 200000, 500k, 150M or 2G".to_owned()
    })
}
