//! What `deltille board` and `deltille checkerboard` are told: the same settings as options and as a
//! TOML template.

#![allow(rustdoc::invalid_html_tags)] // The comments on options are the help of the program, too.

use std::ops::RangeInclusive;
use std::path::Path;

use anyhow::{Context, anyhow, bail};
use serde::{Deserialize, Serialize};

use super::finishing::{Finishing, Laser};
use super::meshes::{Meshes, PlateMeshes};
use super::option_checks::{is_false, is_usual, length};
use super::{logo, template};
use crate::values::{number, whole};
use deltille::export::dsc::Dialect;
use deltille::family::places;
use deltille::lattice::GridKind;
use deltille::layout::{DEFAULT_MARGIN_MM, PaperSize, PaperSpec, usual_edge_mm};
use deltille::targets::{BORDER_BITS, BoardSpec, MOST_ROWS, SIDES, TagSpec, TagsIn};

/// Resolution of PNG files, dots per inch.
pub const DEFAULT_DPI: u32 = 300;

/// Range of the resolution: in a coarser picture a check bar cannot be measured to 0.02 mm.
pub const DPI: RangeInclusive<u32> = 200..=2400;

/// Heading of the help of boards and solids: tags.
pub const TAGS: &str = "Tags";
/// Likewise: paper.
pub const PAPER: &str = "Paper";
/// Likewise: what is printed or listed.
pub const PRINT: &str = "Files to print, and lists";

/// Settings as they are given; what is not given has a default.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct BoardSettings {
    /// The command that a template was made for.
    #[arg(skip)]
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<String>,
    /// Rows of corners, 2 to 500
    #[arg(long, allow_negative_numbers = true, value_parser = whole(SIDES))]
    rows: Option<u32>,
    /// Corners in each row, 2 to 500
    #[arg(long, allow_negative_numbers = true, value_parser = whole(SIDES))]
    cols: Option<u32>,
    /// Edge of a tile, such as 20mm, 2cm, 0.8in [default: 20mm, or the largest in whole
    /// millimetres that fits --paper]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    edge: Option<String>,
    /// Tag family: on a board a name from `deltag list`, or a family file [default: delTag25h7]; on a
    /// checkerboard aprilTag36h11, aprilTag25h9 or aprilTag16h5 [default: no tags]
    #[arg(long, help_heading = TAGS)]
    #[serde(alias = "tags")]
    family: Option<String>,
    /// Squares of a checkerboard that carry the tags: black, the square itself being the border, or
    /// white, each tag with a border of its own, for detectors that know single tags only
    /// [default: black]
    #[arg(long, help_heading = TAGS, value_name = "COLOUR", value_parser = colour)]
    tags_in: Option<TagsIn>,
    /// A small place code in every upright tile: any few tiles beside each other tell where they are on a deltille board,
    /// and on which of 255
    #[arg(long, help_heading = TAGS, conflicts_with_all = ["family", "tag_spacing", "first_id", "untagged"])]
    #[serde(skip_serializing_if = "is_false")]
    dense: bool,
    /// No tags
    #[arg(long, help_heading = TAGS, conflicts_with_all = ["family", "tags_in", "tag_spacing", "tag_border", "hole", "first_id"])]
    #[serde(skip_serializing_if = "is_false")]
    untagged: bool,
    /// A tag in every n-th row and column, on a checkerboard where the square has the right colour,
    /// which with an odd n every second has [default: 3, on a checkerboard 2]
    #[arg(long, help_heading = TAGS, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=MOST_ROWS))]
    tag_spacing: Option<u32>,
    /// Black border of a tag, in widths of a bit, 0.6 to 10, on a checkerboard at least 1
    /// [default: 1.5, in black squares 2, in white ones 1]
    #[arg(long, help_heading = TAGS, value_name = "BITS", allow_negative_numbers = true, value_parser = number(BORDER_BITS))]
    tag_border: Option<f64>,
    /// A hole in the middle of each triangular tag, for a screw or a camera, of a family made with `deltag gen-family --free centre`
    #[arg(long, help_heading = TAGS, value_name = "DIAMETER", allow_hyphen_values = true)]
    hole: Option<String>,
    /// Id of the first tag; the others follow [default: 0]
    #[arg(long, help_heading = TAGS, value_name = "ID", allow_negative_numbers = true, value_parser = whole(0..=u32::MAX))]
    first_id: Option<u32>,
    /// The id of each tag beside it, in small type
    #[arg(long, help_heading = TAGS)]
    #[serde(skip_serializing_if = "is_false")]
    tag_ids: bool,
    /// Id of the first board [default: 0]
    #[arg(long, value_name = "ID", allow_negative_numbers = true, value_parser = whole(0..=u32::MAX))]
    board_id: Option<u32>,
    /// Number of boards, alike but for their ids, each on its own sheet, or with --pack several on one [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=MOST_ROWS))]
    boards: Option<u32>,
    /// White tiles on black: black and white exchanged
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    invert: bool,
    /// A board on the back of its plate, too, on a second sheet: so far apart are the two sides, such as
    /// 3mm
    #[arg(long, value_name = "THICKNESS", allow_hyphen_values = true)]
    two_sided: Option<String>,
    /// The paper.
    #[arg(long, help_heading = PAPER, value_name = "SIZE", help = format!(
        "{} [default: the smallest of A4 to A0 that takes the board]", PaperSize::choice()
    ))]
    paper: Option<String>,
    /// Print a board that is larger than the paper over several pages, to be joined
    #[arg(long, help_heading = PAPER)]
    #[serde(skip_serializing_if = "is_false")]
    poster: bool,
    /// As many boards on each sheet as fit, to be cut apart, each with a label of its own
    #[arg(long, help_heading = PAPER, conflicts_with = "poster")]
    #[serde(skip_serializing_if = "is_false")]
    pack: bool,
    /// One page more: a picture of the board, what to do with the sheets, and a ruler
    #[arg(long, help_heading = PAPER)]
    #[serde(skip_serializing_if = "is_false")]
    guide_page: bool,
    /// auto, portrait or landscape [default: auto]
    #[arg(long, help_heading = PAPER)]
    orientation: Option<String>,
    /// Blank along the edges of the paper; 0.5 mm are left in any case [default: 5mm]
    #[arg(long, help_heading = PAPER, value_name = "LENGTH", allow_hyphen_values = true)]
    margin: Option<String>,
    /// Write <name>.pdf; so it is where no other of pdf, svg, png is asked for
    #[arg(long, help_heading = PRINT)]
    #[serde(skip_serializing_if = "is_false")]
    pdf: bool,
    /// Write <name>.svg
    #[arg(long, help_heading = PRINT)]
    #[serde(skip_serializing_if = "is_false")]
    svg: bool,
    /// Write <name>.png
    #[arg(long, help_heading = PRINT)]
    #[serde(skip_serializing_if = "is_false")]
    png: bool,
    /// Write <name>.dsc, for the reference detector or its fork
    #[arg(long, help_heading = PRINT)]
    #[serde(skip_serializing_if = "is_false")]
    dsc: bool,
    /// fork or original [default: fork]
    #[arg(long, help_heading = PRINT, value_name = "DIALECT")]
    dsc_dialect: Option<String>,
    /// Resolution of the PNG, 200 to 2400 dots per inch [default: 300]
    #[arg(long, help_heading = PRINT, allow_negative_numbers = true, value_parser = whole(DPI))]
    dpi: Option<u32>,
    /// Printed on the label of every sheet beside the name, such as whose it is
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,
    /// An SVG that is printed black at the other end of the label's strip: filled paths and strokes; white is paper
    #[arg(long, value_name = "FILE")]
    logo: Option<String>,
    /// Height of the logo [default: that of the strip]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    logo_height: Option<String>,
    /// Stem of the files' names, printed on the sheet [default: board, or checkerboard]
    #[arg(long)]
    name: Option<String>,
    /// Thickness of the plate in a mesh, which [`PlateMeshes`] asks for.
    #[arg(skip)]
    plate: Option<String>,
    /// Meshes, which it asks for, too.
    #[arg(skip)]
    #[serde(skip_serializing_if = "is_usual")]
    meshes: Meshes,
    /// Drawings for a laser.
    #[arg(skip)]
    #[serde(skip_serializing_if = "is_usual")]
    pub laser: Laser,
    /// How it is finished.
    #[arg(skip)]
    #[serde(skip_serializing_if = "is_usual")]
    pub finishing: Finishing,
}

/// Reads the colour of the squares that carry tags.
fn colour(text: &str) -> Result<TagsIn, String> {
    match text {
        "black" => Ok(TagsIn::Black),
        "white" => Ok(TagsIn::White),
        _ => Err("write black or white".to_owned()),
    }
}

/// What is said of tags and not of place codes.
const NOT_DENSE: [&str; 4] = ["--family", "--hole", "--tag-spacing", "--first-id"];

/// Refuses what is said of tags that there are not: a template may say what the parser of options would refuse, and options
/// what does not replace all that it says.
pub fn check_tags(untagged: bool, dense: bool, of_tags: &[(&str, bool)]) -> anyhow::Result<()> {
    let mut given = of_tags.iter().filter(|(_, given)| *given).map(|(option, _)| option);
    if untagged && let Some(option) = given.next() {
        bail!("--untagged: there are no tags: leave it or {option} out");
    }
    if dense && let Some(option) = given.find(|option| NOT_DENSE.contains(option)) {
        bail!("--dense: there are place codes and no other tags: leave it or {option} out");
    }
    Ok(())
}

/// Settings understood.
pub struct Plan {
    /// Stem of the files' names.
    pub name: String,
    /// The board.
    pub spec: BoardSpec,
    /// What it is printed on.
    pub paper: PaperSpec,
    /// Whether a PDF of all pages is written.
    pub pdf: bool,
    /// Whether an SVG of each page is written.
    pub svg: bool,
    /// Whether a PNG of each page is written.
    pub png: bool,
    /// Whose list of corners and tags is written, if any.
    pub dsc: Option<Dialect>,
    /// Resolution of the PNG, dots per inch.
    pub dpi: u32,
}

impl BoardSettings {
    /// Reads a template of boards of a kind.
    pub fn read(path: &Path, grid: GridKind) -> anyhow::Result<Self> {
        template::read(path, command(grid), |settings: &Self| settings.command.as_deref())
    }

    /// The text of a template.
    pub fn to_toml(&self, grid: GridKind) -> String {
        template::text(&Self { command: Some(command(grid).to_owned()), ..self.clone() })
    }

    /// These settings, and those of a template where these say nothing.
    pub fn or(self, template: Self) -> Self {
        let (bare, dense) = (self.untagged, self.dense);
        let tagged = self.of_tags().into_iter().any(|(_, given)| given);
        let formats = self.pdf || self.svg || self.png;
        let two_sided = self.two_sided.is_some();
        let png = self.png || (template.png && !formats);
        let dsc = self.dsc || template.dsc;
        // Which tags there are, is said as a whole: what an option says of it replaces what else a template says.
        Self {
            command: None,
            rows: self.rows.or(template.rows),
            cols: self.cols.or(template.cols),
            edge: self.edge.or(template.edge),
            untagged: bare || (template.untagged && !tagged),
            dense: dense || (template.dense && !bare && self.family.is_none()),
            family: self.family.or(template.family.filter(|_| !bare && !dense)),
            tags_in: self.tags_in.or(template.tags_in.filter(|_| !bare)),
            tag_spacing: self.tag_spacing.or(template.tag_spacing.filter(|_| !bare && !dense)),
            tag_border: self.tag_border.or(template.tag_border.filter(|_| !bare)),
            hole: self.hole.or(template.hole.filter(|_| !bare && !dense)),
            first_id: self.first_id.or(template.first_id.filter(|_| !bare && !dense)),
            tag_ids: self.tag_ids || (template.tag_ids && !bare && !dense),
            board_id: self.board_id.or(template.board_id),
            boards: self.boards.or(template.boards),
            invert: self.invert || template.invert,
            two_sided: self.two_sided.or(template.two_sided),
            paper: self.paper.or(template.paper),
            poster: self.poster || (template.poster && !self.pack),
            pack: self.pack || (template.pack && !self.poster),
            guide_page: self.guide_page || template.guide_page,
            orientation: self.orientation.or(template.orientation),
            margin: self.margin.or(template.margin),
            pdf: self.pdf || (template.pdf && !formats),
            svg: self.svg || (template.svg && !formats),
            png,
            dsc,
            dsc_dialect: self.dsc_dialect.or(template.dsc_dialect),
            // Of no use where other formats are asked for than in the template.
            dpi: self.dpi.or(template.dpi.filter(|_| png || !template.png)),
            note: self.note.or(template.note),
            logo: self.logo.or(template.logo),
            logo_height: self.logo_height.or(template.logo_height),
            name: self.name.or(template.name),
            // Of two sides the distance is the thickness.
            plate: self.plate.or(template.plate.filter(|_| !two_sided)),
            meshes: self.meshes.or(template.meshes),
            laser: self.laser.or(template.laser),
            finishing: self.finishing.or(template.finishing, self.pdf || !formats),
        }
    }

    /// The meshes of its plate that are asked for.
    pub fn meshes(&self) -> PlateMeshes {
        PlateMeshes { meshes: self.meshes.clone(), plate: self.plate.clone() }
    }

    /// These settings, with what is not printed.
    pub fn with(self, meshes: PlateMeshes, laser: Laser, finishing: Finishing) -> Self {
        let PlateMeshes { meshes, plate } = meshes;
        Self { plate, meshes, laser, finishing, ..self }
    }

    /// Whether a format to print is asked for.
    pub fn prints(&self) -> bool {
        self.pdf || self.svg || self.png
    }

    /// Understands the settings; numbers that no board has are left to its making.
    pub fn plan(&self, grid: GridKind) -> anyhow::Result<Plan> {
        let (Some(rows), Some(cols)) = (self.rows, self.cols) else {
            bail!("--rows and --cols are needed, here or in a --template");
        };
        let paper = PaperSpec {
            size: self.paper.as_deref().map(str::parse).transpose().context("--paper")?,
            orientation: match &self.orientation {
                Some(text) => text.parse().context("--orientation")?,
                None => Default::default(),
            },
            margin_mm: length("margin", &self.margin)?.unwrap_or(DEFAULT_MARGIN_MM),
            poster: self.poster,
            packed: self.pack,
            note: self.note.clone(),
            tag_ids: self.tag_ids,
            guide_page: self.guide_page,
            ..PaperSpec::default()
        };
        let height = length("logo-height", &self.logo_height)?;
        let paper = logo::on(paper, self.logo.as_deref(), height)?;
        if grid == GridKind::Deltille && self.tags_in.is_some() {
            bail!("--tags-in: the tags of a deltille board are in its black tiles: leave it out");
        }
        if grid == GridKind::Checker && self.dense {
            bail!("--dense: place codes are for triangles: take `deltille board`");
        }
        let of_tags = self.of_tags();
        check_tags(self.untagged, self.dense, &of_tags)?;
        let family = if self.dense { Some(places::NAME) } else { self.family.as_deref() };
        let usual = TagSpec::usual(grid, family, self.tags_in.unwrap_or_default());
        let tagged = !self.untagged && (grid == GridKind::Deltille || self.family.is_some());
        if grid == GridKind::Checker
            && self.family.is_none()
            && let Some((option, _)) = of_tags.iter().find(|(_, given)| *given)
        {
            bail!("{option}: there are no tags: name their family with --tags");
        }
        let hole_mm = length("hole", &self.hole)?;
        let tags = tagged.then(|| TagSpec {
            hole_mm,
            first_id: self.first_id.unwrap_or(usual.first_id),
            spacing: self.tag_spacing.unwrap_or(usual.spacing),
            border_bits: self.tag_border.unwrap_or(usual.border_bits),
            ..usual
        });
        let mut spec = BoardSpec {
            grid,
            rows,
            cols,
            edge_mm: 0.0,
            boards: self.boards.unwrap_or(1),
            board_id: self.board_id.unwrap_or(0),
            tags,
            inverted: self.invert,
            two_sided_mm: length("two-sided", &self.two_sided)?,
        };
        spec.edge_mm = match length("edge", &self.edge)? {
            Some(mm) => mm,
            None => usual_edge_mm(&spec, &paper),
        };
        if self.dsc_dialect.is_some() && !self.dsc {
            bail!("--dsc-dialect: there is no .dsc to write: add --dsc");
        }
        if self.dpi.is_some() && !self.png {
            bail!("--dpi: there is no PNG to write: add --png");
        }
        let dialect = match &self.dsc_dialect {
            Some(text) => {
                text.parse().map_err(|error: String| anyhow!("--dsc-dialect: {error}"))?
            }
            None => Dialect::default(),
        };
        let dpi = self.dpi.unwrap_or(DEFAULT_DPI);
        if !DPI.contains(&dpi) {
            bail!("--dpi: {dpi} is not between {} and {}", DPI.start(), DPI.end());
        }
        Ok(Plan {
            name: self.name.clone().unwrap_or_else(|| command(grid).to_owned()),
            spec,
            paper,
            pdf: self.pdf || !(self.svg || self.png),
            svg: self.svg,
            png: self.png,
            dsc: self.dsc.then_some(dialect),
            dpi,
        })
    }

    /// The options that say something of tags, and whether they are given.
    fn of_tags(&self) -> [(&'static str, bool); 7] {
        [
            ("--family", self.family.is_some()),
            ("--dense", self.dense),
            ("--tags-in", self.tags_in.is_some()),
            ("--tag-spacing", self.tag_spacing.is_some()),
            ("--tag-border", self.tag_border.is_some()),
            ("--hole", self.hole.is_some()),
            ("--first-id", self.first_id.is_some()),
        ]
    }

    /// The same with the edge that was chosen, so that a template gives the same board again.
    pub fn with_edge(self, edge_mm: f64) -> Self {
        Self { edge: Some(format!("{edge_mm}mm")), ..self }
    }
}

/// The command that makes boards of this kind, and the name of those that have none.
fn command(grid: GridKind) -> &'static str {
    match grid {
        GridKind::Deltille => "board",
        GridKind::Checker => "checkerboard",
    }
}
