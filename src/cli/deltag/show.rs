use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

use crate::artwork::{Artwork, GalleryTile, tag_gallery};
use crate::cli::output;
use crate::export::{png, svg};
use crate::family::Family;

/// Most tags on one picture: a sheet of A0 size at the default edge.
const MOST_TAGS: usize = 600;

#[derive(clap::Args)]
pub(super) struct Args {
    /// A name from `deltag list`, or a family file
    family: String,
    /// Which tags: ids and ranges such as 0-9 or 3,7,20-25
    #[arg(long, default_value = "0-9")]
    ids: Ids,
    /// Write an SVG; so it is where --png is not asked for
    #[arg(long)]
    svg: bool,
    /// Write a PNG
    #[arg(long)]
    png: bool,
    /// Resolution of the PNG, dots per inch
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(20..=2400))]
    dpi: u32,
    /// Tags in a row
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=100))]
    columns: u16,
    /// Folder for the files
    #[arg(short, long, default_value = ".")]
    output: PathBuf,
    /// Stem of the files' names [default: the family's name]
    #[arg(long)]
    name: Option<String>,
}

/// Ids and ranges of ids.
#[derive(Clone)]
struct Ids(Vec<u32>);

impl FromStr for Ids {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut ids = Vec::new();
        for part in text.split(',') {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let number = |s: &str| s.trim().parse::<u32>().ok();
            let (Some(first), Some(last)) = (number(first), number(last)) else {
                return Err("write ids and ranges such as 0-9 or 3,7,20-25".to_owned());
            };
            if first > last {
                return Err(format!("the range {first}-{last} runs backwards"));
            }
            if ids.len() + (last - first) as usize >= MOST_TAGS {
                return Err(format!("more than {MOST_TAGS} tags do not fit on one picture"));
            }
            ids.extend(first..=last);
        }
        Ok(Self(ids))
    }
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let family = Family::resolve(&args.family)?;
    let Ids(ids) = args.ids;
    if let Some(id) = ids.iter().find(|&&id| family.code(id).is_none()) {
        anyhow::bail!(
            "--ids: {} has no tag {id}, its ids run from 0 to {}",
            family.name(),
            family.len() - 1
        );
    }
    let style = GalleryTile { columns: usize::from(args.columns), ..GalleryTile::default() };
    let sheet = tag_gallery(&family, &ids, style)?;
    let title = format!("DelTags of family {}", family.name());
    let name = args.name.unwrap_or_else(|| family.name().to_owned());
    std::fs::create_dir_all(&args.output)
        .map_err(|error| anyhow::anyhow!("cannot make {}: {error}", args.output.display()))?;

    let mut written = Vec::new();
    if args.png {
        let path = output::file(&args.output, &name, "png");
        png::write(&sheet, &title, &path, f64::from(args.dpi))?;
        written.push(path);
    }
    if args.svg || !args.png {
        let path = output::file(&args.output, &name, "svg");
        let subject = format!("fingerprint {}", family.fingerprint());
        svg::write(&Artwork { title, subject, sheets: vec![sheet] }, 0, &path)?;
        written.push(path);
    }
    for path in written {
        println!("wrote {}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_single_or_in_ranges() {
        assert_eq!("3,7,20-22".parse::<Ids>().unwrap().0, [3, 7, 20, 21, 22]);
        for bad in ["", "-", "5-3", "a", "1-99999999", "0-9,,1"] {
            assert!(bad.parse::<Ids>().is_err(), "{bad}");
        }
    }
}
