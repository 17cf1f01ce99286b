use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;

use crate::deltag::named::resolve;
use crate::output::{self, Overwrite, Place, named_by, report, request};
use crate::values::{Ids, name, whole};
use deltille::artwork::{Artwork, GalleryTile, tag_gallery};
use deltille::export::kind::Kind;
use deltille::export::{png, svg};
use deltille::layout::Finish;

/// Largest number of tags in one image: about an A0 sheet at the default edge length.
const MAX_TAGS: usize = 600;

#[derive(clap::Args)]
pub struct Args {
    /// A name from `deltag list`, or a family file
    family: String,
    /// Tags to draw: ids and ranges such as 0-9 or 3,7,20-25 [default: the first ten]
    #[arg(long, allow_hyphen_values = true)]
    ids: Option<Ids>,
    /// Write an SVG (default unless --png is given)
    #[arg(long)]
    svg: bool,
    /// Write a PNG
    #[arg(long)]
    png: bool,
    /// Resolution of the PNG, dots per inch [default: 200]
    #[arg(long, value_parser = whole(20..=2400u32))]
    dpi: Option<u32>,
    /// Number of tags per row
    #[arg(long, default_value_t = 5,
          value_parser = whole(1..=100u16))]
    columns: u16,
    /// Output folder, or a file: its ending selects the format
    #[arg(short, long, default_value = ".")]
    output: PathBuf,
    /// Stem of the file names [default: the family's name]
    #[arg(long, value_parser = name, allow_hyphen_values = true)]
    name: Option<String>,
    #[command(flatten)]
    overwrite: Overwrite,
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let family = resolve(&args.family)?;
    let ids = args.ids.unwrap_or_else(|| Ids((0..10).take(family.len()).collect()));
    ids.check(&family)?;
    let Ids(ids) = ids;
    anyhow::ensure!(
        ids.len() <= MAX_TAGS,
        "--ids: at most {MAX_TAGS} tags fit in one image; use `deltag sheet` for more"
    );
    let Place { folder, file } = output::place(&args.output, &["svg", "png"])?;
    let (mut named, mut svg, mut png) = (args.name, args.svg, args.png);
    let ending = named_by(&mut named, file)?;
    request(&ending, [("svg", &mut svg), ("png", &mut png)]);
    anyhow::ensure!(args.dpi.is_none() || png, "--dpi needs --png");
    let stem = named.as_deref().unwrap_or(family.name());
    let place = |extension| folder.join(format!("{stem}.{extension}"));
    let png_path = png.then(|| place("png"));
    let svg_path = (svg || !png).then(|| place("svg"));
    let kinds = [(&png_path, Kind::own_printed_png()), (&svg_path, Kind::of(svg::HEAD.as_bytes()))];
    for (path, kind) in kinds {
        let Some(path) = path else { continue };
        args.overwrite.check(path, &kind)?;
        output::settle(output::folder_of(path))?;
        output::make_folder_of(path).context("-o")?;
    }
    let style = GalleryTile { columns: usize::from(args.columns), ..GalleryTile::default() };
    let sheet = tag_gallery(&family, &ids, style)?;
    let title = format!("DelTags of family {}", family.name());
    let mut written = Vec::new();
    if let Some(path) = png_path {
        png::write(&sheet, &title, &path, f64::from(args.dpi.unwrap_or(200))).context("-o")?;
        written.push(path);
    }
    if let Some(path) = svg_path {
        let subject = format!("fingerprint {}", family.fingerprint());
        let finish = Finish::default();
        let artwork = Artwork { title, subject, sheets: vec![sheet], finish };
        svg::write(&artwork, 0, &path).context("-o")?;
        written.push(path);
    }
    for path in written {
        report!("{}", output::wrote(&path));
    }
    Ok(ExitCode::SUCCESS)
}
