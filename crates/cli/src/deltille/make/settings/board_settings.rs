//! Settings of `deltille board` and `deltille checkerboard`, both as options and as a TOML template.

#![allow(rustdoc::invalid_html_tags)] // Option comments are help texts.

use std::ops::RangeInclusive;
use std::path::Path;

use anyhow::{Context, anyhow, bail};
use serde::{Deserialize, Serialize};

use super::finishing::{Finishing, Laser};
use super::meshes::{Meshes, PlateMeshes};
use super::option_checks::{is_false, is_usual, length};
use super::{logo, template};
use crate::output::{NamedFile, named_by, request};
use crate::values::{number, whole};
use deltille::export::dsc::Dialect;
use deltille::family::positions;
use deltille::lattice::GridKind;
use deltille::layout::{DEFAULT_MARGIN_MM, PaperSize, PaperSpec, usual_edge_mm};
use deltille::targets::{BORDER_BITS, BoardSpec, MAX_ROWS, SIDES, TagSpec, TagsIn};

/// Resolution of PNG files, dots per inch.
pub const DEFAULT_DPI: u32 = 300;

/// Range of the resolution; in a coarser image, a check bar cannot be measured to 0.02 mm.
pub const DPI: RangeInclusive<u32> = 200..=2400;

/// Help heading of boards and solids: tags.
pub const TAGS: &str = "Tags";
/// Help heading: paper.
pub const PAPER: &str = "Paper";
/// Help heading: names and treatment of the output files.
pub const OUTPUT: &str = "Output";
/// Help heading: files to print and lists.
pub const PRINT: &str = "Print files and corner lists";

/// Settings as given; those that are not given have defaults.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct BoardSettings {
    /// The command that a template was made for.
    #[arg(skip)]
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<String>,
    /// Number of corner rows, 2 to 500
    #[arg(long, value_parser = whole(SIDES))]
    rows: Option<u32>,
    /// Number of corners per row, 2 to 500
    #[arg(long, value_parser = whole(SIDES))]
    cols: Option<u32>,
    /// Edge length of a tile, such as 20mm, 2cm, 0.8in [default: 20mm, or the largest whole number of millimetres
    /// that fits --paper]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    edge: Option<String>,
    /// Tag family: on a board, a name from `deltag list` or a family file [default: delTag25h7]; on a checkerboard,
    /// aprilTag36h11, aprilTag25h9 or aprilTag16h5 [default: no tags]
    #[arg(long, help_heading = TAGS)]
    #[serde(alias = "tags")]
    family: Option<String>,
    /// Squares of a checkerboard that contain the tags: black (the square itself is the border) or white (each tag
    /// has its own border, for detectors that need complete tags, such as AprilTag's) [default: black]
    #[arg(long, help_heading = TAGS, value_name = "COLOUR", value_parser = colour)]
    tags_in: Option<TagsIn>,
    /// Put a small position code in every upright tile of a deltille board: any 3 × 4 adjacent
    /// tiles identify the board (one of 255) and their position on it
    #[arg(long, help_heading = TAGS, conflicts_with_all = ["family", "tag_spacing", "first_id", "untagged"])]
    #[serde(skip_serializing_if = "is_false")]
    dense: bool,
    /// Make a board without tags
    #[arg(long, help_heading = TAGS, conflicts_with_all = ["family", "tags_in", "tag_spacing", "tag_border", "hole", "first_id"])]
    #[serde(skip_serializing_if = "is_false")]
    untagged: bool,
    /// Put a tag in every N-th row and column; on a checkerboard, only where that square has the
    /// colour given by --tags-in (for odd N, at every second position) [default: 3; 2 on a
    /// checkerboard]
    #[arg(long, help_heading = TAGS, value_name = "N", value_parser = whole(1..=MAX_ROWS))]
    tag_spacing: Option<u32>,
    /// Width of a tag's black border in cells, 0.6 to 10, at least 1 on a checkerboard [default: 1.5; 2 in black
    /// squares, 1 in white ones]
    #[arg(long, help_heading = TAGS, value_name = "BITS", value_parser = number(BORDER_BITS))]
    tag_border: Option<f64>,
    /// Diameter of a hole in the middle of each triangular tag, for a screw or a camera; needs a family made with
    /// `deltag gen-family --free centre`
    #[arg(long, help_heading = TAGS, value_name = "DIAMETER", allow_hyphen_values = true)]
    hole: Option<String>,
    /// Id of the first tag; the others follow [default: 0]
    #[arg(long, help_heading = TAGS, value_name = "ID", value_parser = whole(0..=u32::MAX))]
    first_id: Option<u32>,
    /// Print the id of each tag next to it in small type
    #[arg(long, help_heading = TAGS)]
    #[serde(skip_serializing_if = "is_false")]
    tag_ids: bool,
    /// Id of the first board [default: 0]; --first-id sets the ids of its tags
    #[arg(long, value_name = "ID", value_parser = whole(0..=u32::MAX))]
    board_id: Option<u32>,
    /// Number of boards, identical except for their ids; each on its own sheet, or several per sheet with --pack
    /// [default: 1]
    #[arg(long, value_name = "N", value_parser = whole(1..=MAX_ROWS))]
    boards: Option<u32>,
    /// Swap black and white: white tiles on black
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    invert: bool,
    /// Also print a board for the back of the plate, on a second sheet; the value is the distance between the two
    /// sides, such as 3mm
    #[arg(long, value_name = "THICKNESS", allow_hyphen_values = true)]
    two_sided: Option<String>,
    /// The paper.
    #[arg(long, help_heading = PAPER, value_name = "SIZE", help = format!(
        "{} [default: the smallest of A4 to A0 that fits the board]", PaperSize::choice()
    ))]
    paper: Option<String>,
    /// Print a board larger than the paper on several pages, to be joined
    #[arg(long, help_heading = PAPER)]
    #[serde(skip_serializing_if = "is_false")]
    poster: bool,
    /// Put as many boards on each sheet as fit, each with its own label, to be cut apart
    #[arg(long, help_heading = PAPER, conflicts_with = "poster")]
    #[serde(skip_serializing_if = "is_false")]
    pack: bool,
    /// Add a page with a picture of the board, instructions for the sheets, and a ruler
    #[arg(long, help_heading = PAPER)]
    #[serde(skip_serializing_if = "is_false")]
    guide_page: bool,
    /// Page orientation: auto, portrait or landscape [default: auto]
    #[arg(long, help_heading = PAPER)]
    orientation: Option<String>,
    /// Blank margin along the edges of the paper; at least 0.5 mm are kept blank [default: 5mm]
    #[arg(long, help_heading = PAPER, value_name = "LENGTH", allow_hyphen_values = true)]
    margin: Option<String>,
    /// Write <name>.pdf (default unless --svg or --png is given)
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
    /// Write <name>.dsc, for the reference detector of Ha et al. (ICCV 2017), or its fork
    #[arg(long, help_heading = PRINT)]
    #[serde(skip_serializing_if = "is_false")]
    dsc: bool,
    /// Dialect of the .dsc: fork or original [default: fork]
    #[arg(long, help_heading = PRINT, value_name = "DIALECT")]
    dsc_dialect: Option<String>,
    /// Resolution of the PNG, 200 to 2400 dots per inch [default: 300]
    #[arg(long, help_heading = PRINT, value_parser = whole(DPI))]
    dpi: Option<u32>,
    /// Text for the label of every sheet, next to the name, such as the owner
    #[arg(long, help_heading = PAPER, value_name = "TEXT")]
    note: Option<String>,
    /// SVG logo, printed in black opposite the label: filled paths and strokes; white areas stay unprinted
    #[arg(long, help_heading = PAPER, value_name = "FILE")]
    logo: Option<String>,
    /// Height of the logo [default: the height of the label strip]
    #[arg(long, help_heading = PAPER, value_name = "LENGTH", allow_hyphen_values = true)]
    logo_height: Option<String>,
    /// Stem of the file names, also printed on the sheet [default: board or checkerboard]
    #[arg(long, help_heading = OUTPUT)]
    name: Option<String>,
    /// Thickness of the plate in a mesh, parsed by [`PlateMeshes`].
    #[arg(skip)]
    plate: Option<String>,
    /// The requested meshes, also parsed by [`PlateMeshes`].
    #[arg(skip)]
    #[serde(skip_serializing_if = "is_usual")]
    meshes: Meshes,
    /// Drawings for a laser.
    #[arg(skip)]
    #[serde(skip_serializing_if = "is_usual")]
    pub laser: Laser,
    /// Finishing.
    #[arg(skip)]
    #[serde(skip_serializing_if = "is_usual")]
    pub finishing: Finishing,
}

/// Parses the colour of the squares that contain tags.
fn colour(text: &str) -> Result<TagsIn, String> {
    match text {
        "black" => Ok(TagsIn::Black),
        "white" => Ok(TagsIn::White),
        _ => Err("expected black or white".to_owned()),
    }
}

/// Options that apply to tags, but not to position codes.
const NOT_DENSE: [&str; 4] = ["--family", "--hole", "--tag-spacing", "--first-id"];

/// Rejects tag options without tags. Templates may contain combinations that the option parser would reject, and
/// options do not replace everything in a template.
pub fn check_tags(untagged: bool, dense: bool, of_tags: &[(&str, bool)]) -> anyhow::Result<()> {
    let mut given = of_tags.iter().filter(|(_, given)| *given).map(|(option, _)| option);
    if untagged && let Some(option) = given.next() {
        bail!("--untagged conflicts with {option}; remove one of them");
    }
    if dense && let Some(option) = given.find(|option| NOT_DENSE.contains(option)) {
        bail!("--dense conflicts with {option} (position codes replace tags); remove one of them");
    }
    Ok(())
}

/// Parsed settings.
pub struct Plan {
    /// Stem of the file names.
    pub name: String,
    /// The board.
    pub spec: BoardSpec,
    /// The paper.
    pub paper: PaperSpec,
    /// Whether a PDF of all pages is written.
    pub pdf: bool,
    /// Whether an SVG of each page is written.
    pub svg: bool,
    /// Whether a PNG of each page is written.
    pub png: bool,
    /// Dialect of the list of corners and tags, if it is written.
    pub dsc: Option<Dialect>,
    /// Resolution of the PNG, dots per inch.
    pub dpi: u32,
}

impl BoardSettings {
    /// Reads a template for boards of this kind.
    pub fn read(path: &Path, grid: GridKind) -> anyhow::Result<Self> {
        template::read(path, command(grid), |settings: &Self| settings.command.as_deref())
    }

    /// Returns the text of a template.
    pub fn to_toml(&self, grid: GridKind) -> String {
        template::text(&Self { command: Some(command(grid).to_owned()), ..self.clone() })
    }

    /// Returns these settings, completed by those of a template.
    pub fn or(self, template: Self) -> Self {
        let (bare, dense) = (self.untagged, self.dense);
        let tagged = self.of_tags().into_iter().any(|(_, given)| given);
        let formats = self.pdf || self.svg || self.png;
        let two_sided = self.two_sided.is_some();
        let png = self.png || (template.png && !formats);
        let dsc = self.dsc || template.dsc;
        // Tag settings are replaced as a whole: an option also overrides conflicting settings of the template.
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
            // Unused if the options select formats other than those of the template.
            dpi: self.dpi.or(template.dpi.filter(|_| png || !template.png)),
            note: self.note.or(template.note),
            logo: self.logo.or(template.logo),
            logo_height: self.logo_height.or(template.logo_height),
            name: self.name.or(template.name),
            // The distance between two sides is the thickness of the plate.
            plate: self.plate.or(template.plate.filter(|_| !two_sided)),
            meshes: self.meshes.or(template.meshes),
            laser: self.laser.or(template.laser),
            finishing: self.finishing.or(template.finishing, self.pdf || !formats),
        }
    }

    /// Extensions of the files that can be named by `-o`.
    pub const ENDINGS: [&str; 12] =
        ["json", "pdf", "svg", "png", "dsc", "glb", "obj", "sdf", "urdf", "xml", "usda", "3mf"];

    /// Returns these settings with the name and the format of the file that `-o` names.
    pub fn for_file(mut self, file: Option<NamedFile>) -> anyhow::Result<Self> {
        let ending = named_by(&mut self.name, file)?;
        let Self { pdf, svg, png, dsc, .. } = &mut self;
        request(&ending, [("pdf", pdf), ("svg", svg), ("png", png), ("dsc", dsc)]);
        self.meshes.request(&ending);
        Ok(self)
    }

    /// Returns the requested meshes of the plate.
    pub fn meshes(&self) -> PlateMeshes {
        PlateMeshes { meshes: self.meshes.clone(), plate: self.plate.clone() }
    }

    /// Returns these settings with those of meshes, laser drawings and finishing.
    pub fn with(self, meshes: PlateMeshes, laser: Laser, finishing: Finishing) -> Self {
        let PlateMeshes { meshes, plate } = meshes;
        Self { plate, meshes, laser, finishing, ..self }
    }

    /// Whether a print format is requested.
    pub fn prints(&self) -> bool {
        self.pdf || self.svg || self.png
    }

    /// Parses the settings; numeric ranges are checked when the board is made.
    pub fn plan(&self, grid: GridKind) -> anyhow::Result<Plan> {
        let (Some(rows), Some(cols)) = (self.rows, self.cols) else {
            bail!(
                "--rows and --cols are needed, as options (such as --rows 10 --cols 11; `deltille plan` proposes them) or in a \
                 --template"
            );
        };
        let paper = self.paper()?;
        let tags = self.tags(grid)?;
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
            bail!("--dsc-dialect needs --dsc");
        }
        if self.dpi.is_some() && !self.png {
            bail!("--dpi needs --png");
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

    /// Parses the settings of the paper, and reads the logo.
    fn paper(&self) -> anyhow::Result<PaperSpec> {
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
        logo::on(paper, self.logo.as_deref(), height)
    }

    /// Returns the tags of a board, if it has any.
    fn tags(&self, grid: GridKind) -> anyhow::Result<Option<TagSpec>> {
        if grid == GridKind::Deltille && self.tags_in.is_some() {
            bail!(
                "--tags-in has no effect, because tags of a deltille board are always in its black tiles; remove it"
            );
        }
        if grid == GridKind::Checker && self.dense {
            bail!("--dense: position codes need triangular tiles; use `deltille board`");
        }
        let of_tags = self.of_tags();
        check_tags(self.untagged, self.dense, &of_tags)?;
        let family = if self.dense { Some(positions::NAME) } else { self.family.as_deref() };
        let usual = TagSpec::usual(grid, family, self.tags_in.unwrap_or_default());
        let tagged = !self.untagged && (grid == GridKind::Deltille || self.family.is_some());
        if grid == GridKind::Checker
            && self.family.is_none()
            && let Some((option, _)) = of_tags.iter().find(|(_, given)| *given)
        {
            bail!("{option} needs tags: set their family with --tags");
        }
        let hole_mm = length("hole", &self.hole)?;
        Ok(tagged.then(|| TagSpec {
            hole_mm,
            first_id: self.first_id.unwrap_or(usual.first_id),
            spacing: self.tag_spacing.unwrap_or(usual.spacing),
            border_bits: self.tag_border.unwrap_or(usual.border_bits),
            ..usual
        }))
    }

    /// Returns the tag options, and whether each is given.
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

    /// Returns the settings with the chosen edge length, so that the template reproduces the board.
    pub fn with_edge(self, edge_mm: f64) -> Self {
        Self { edge: Some(format!("{edge_mm}mm")), ..self }
    }
}

/// Returns the command that makes boards of this kind, which is also their default name.
fn command(grid: GridKind) -> &'static str {
    match grid {
        GridKind::Deltille => "board",
        GridKind::Checker => "checkerboard",
    }
}
