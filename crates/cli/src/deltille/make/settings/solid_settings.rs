//! Settings of the commands that make solids, both as options and as a TOML template.

#![allow(rustdoc::invalid_html_tags)] // Option comments are help texts.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use serde::{Deserialize, Serialize};

use super::board_settings::{DPI, OUTPUT, PAPER, PRINT, TAGS, check_tags};
use super::finishing::Laser;
use super::meshes::Meshes;
use super::option_checks::{is_false, is_usual, length, refuse_idle};
use super::{logo, template};
use crate::output::{NamedFile, named_by, request};
use crate::values::{number, whole};
use deltille::export::dsc::Dialect;
use deltille::family::positions;
use deltille::lattice::GridKind;
use deltille::layout::{DEFAULT_MARGIN_MM, PaperSize, PaperSpec, SolidSheets, usual_solid_edge_mm};
use deltille::targets::{
    BORDER_BITS, FACE_TILES, MAX_ROWS, SkeletonSpec, SolidShape, SolidSpec, TagSpec, TagsIn,
};

/// Help heading of bodies and outlines.
const BODIES: &str = "3D printing and cutting";

/// Settings as given; those that are not given have defaults.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct SolidSettings {
    /// The command that a template was made for.
    #[arg(skip)]
    pub command: Option<String>,
    /// Sides of a cuboid.
    #[arg(skip)]
    pub size: Option<String>,
    /// File of a mesh, and the options of its command.
    #[arg(skip)]
    pub mesh: Option<PathBuf>,
    #[arg(skip)]
    pub square_family: Option<String>,
    #[arg(skip)]
    pub first_square_id: Option<u32>,
    #[arg(skip)]
    pub scale: Option<f64>,
    #[arg(skip)]
    #[serde(skip_serializing_if = "is_false")]
    pub allow_skew: bool,
    /// Edge length of the solid, such as 150mm, 15cm, 6in [default: 150mm, or the largest whole number of millimetres
    /// whose net fits --paper on --pages; with --allow-seams, only if --pages is given]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub edge: Option<String>,
    /// Number of black tiles along each side of a face, 6 to 200 [default: 10]
    #[arg(long, value_name = "N", value_parser = whole(FACE_TILES))]
    pub tiles: Option<u32>,
    /// Blank margin between the edges of a face and its tiles [default: 5mm; at least 3 mm on the panels of a
    /// skeleton]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub face_margin: Option<String>,
    /// Tag family: a name from `deltag list`, or a family file [default: delTag25h7]
    #[arg(long, help_heading = TAGS)]
    pub family: Option<String>,
    /// Put a small position code in every upright tile: any 3 × 4 adjacent tiles identify the board
    /// (one of 255, one per face) and their position on it
    #[arg(long, help_heading = TAGS, conflicts_with_all = ["family", "tag_spacing", "first_id"])]
    #[serde(skip_serializing_if = "is_false")]
    pub dense: bool,
    /// Make a solid without tags; its faces cannot be distinguished
    #[arg(long, help_heading = TAGS,
          conflicts_with_all = ["family", "dense", "tag_spacing", "tag_border", "hole", "first_id", "tag_ids"])]
    #[serde(skip_serializing_if = "is_false")]
    pub untagged: bool,
    /// Swap black and white: white tiles on a black field that extends into the margin [default
    /// margin: 8mm]
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    pub invert: bool,
    /// Put a tag in every N-th row and column of a face [default: 3]
    #[arg(long, help_heading = TAGS, value_name = "N", value_parser = whole(1..=MAX_ROWS))]
    pub tag_spacing: Option<u32>,
    /// Width of a tag's black border in cells [default: 1.5]
    #[arg(long, help_heading = TAGS, value_name = "BITS", value_parser = number(BORDER_BITS))]
    pub tag_border: Option<f64>,
    /// Diameter of a hole in the middle of each triangular tag, for a screw or a camera; needs a family made with
    /// `deltag gen-family --free centre`
    #[arg(long, help_heading = TAGS, value_name = "DIAMETER", allow_hyphen_values = true)]
    pub hole: Option<String>,
    /// Id of the first tag; the others follow, face by face [default: 0]
    #[arg(long, help_heading = TAGS, value_name = "ID", value_parser = whole(0..=u32::MAX))]
    pub first_id: Option<u32>,
    /// Print the id of each tag next to it in small type
    #[arg(long, help_heading = TAGS)]
    #[serde(skip_serializing_if = "is_false")]
    pub tag_ids: bool,
    /// Id of the first face's board; the others follow [default: 0]
    #[arg(long, value_name = "ID", value_parser = whole(0..=u32::MAX))]
    pub board_id: Option<u32>,
    /// Write <name>.stl, the bare solid (millimetres)
    #[arg(long, help_heading = BODIES)]
    #[serde(skip_serializing_if = "is_false")]
    pub stl: bool,
    /// Write <name>-skeleton.stl, a frame to 3D-print, with a seat for a panel on each face
    #[arg(long, help_heading = BODIES)]
    #[serde(skip_serializing_if = "is_false")]
    pub skeleton: bool,
    /// Thickness of a panel including anything glued on it [default: 3mm]
    #[arg(long, help_heading = BODIES, value_name = "LENGTH", allow_hyphen_values = true)]
    pub panel_thickness: Option<String>,
    /// Thickness of the skeleton below the panels [default: 4mm]
    #[arg(long, help_heading = BODIES, value_name = "LENGTH", allow_hyphen_values = true)]
    pub wall: Option<String>,
    /// Distance of the seats from the edges of the faces [default: the smallest that leaves a
    /// base for the ribs]
    #[arg(long, help_heading = BODIES, value_name = "LENGTH", allow_hyphen_values = true)]
    pub rib: Option<String>,
    /// Write <name>-panels.dxf, the cut outlines of all faces or, with --skeleton, of its panels;
    /// without --per-face, also write <name>-net.dxf, the net to cut, score and fold (millimetres)
    #[arg(long, help_heading = BODIES)]
    #[serde(skip_serializing_if = "is_false")]
    pub dxf: bool,
    /// Write <name>.pdf: the net to cut out, fold and glue, or one page per face with --per-face
    #[arg(long, help_heading = PRINT)]
    #[serde(skip_serializing_if = "is_false")]
    pub pdf: bool,
    /// Write <name>-<page>.svg
    #[arg(long, help_heading = PRINT)]
    #[serde(skip_serializing_if = "is_false")]
    pub svg: bool,
    /// Write <name>-<page>.png
    #[arg(long, help_heading = PRINT)]
    #[serde(skip_serializing_if = "is_false")]
    pub png: bool,
    /// Print each face on its own sheet instead of the net, to be glued on a rigid skeleton
    #[arg(long, help_heading = PAPER)]
    #[serde(skip_serializing_if = "is_false")]
    pub per_face: bool,
    /// Split a large net across pages with seams through tiles, instead of between faces
    #[arg(long, help_heading = PAPER, conflicts_with = "per_face")]
    #[serde(skip_serializing_if = "is_false")]
    pub allow_seams: bool,
    /// Add a page with a picture of the solid and its face numbers, assembly instructions, and a ruler
    #[arg(long, help_heading = PAPER)]
    #[serde(skip_serializing_if = "is_false")]
    pub guide_page: bool,
    /// Write <name>.dsc, for the reference detector of Ha et al. (ICCV 2017), or its fork
    #[arg(long, help_heading = PRINT)]
    #[serde(skip_serializing_if = "is_false")]
    pub dsc: bool,
    /// Dialect of the .dsc: fork or original [default: fork]
    #[arg(long, help_heading = PRINT, value_name = "DIALECT")]
    pub dsc_dialect: Option<String>,
    /// Resolution of the PNG pages, dots per inch [default: 300]
    #[arg(long, help_heading = PRINT, value_parser = whole(200..=2400u32))]
    pub dpi: Option<u32>,
    /// The paper; a larger net is split between faces into several pieces.
    #[arg(long, help_heading = PAPER, value_name = "SIZE", help = format!(
        "{}. Without --edge, the net has the size that fits it; with --edge, a larger net is split between faces into several \
         pieces [default: the smallest of A4 to A0 that fits the net, otherwise A0]",
        PaperSize::choice()
    ))]
    pub paper: Option<String>,
    /// Largest number of pages for the net. Without --paper, the smallest paper is selected for it [default: 1 if it fits A0]
    #[arg(long, help_heading = PAPER, value_name = "N", value_parser = whole(1..=MAX_ROWS),
          conflicts_with = "per_face")]
    pub pages: Option<u32>,
    /// Page orientation: auto, portrait or landscape [default: auto]
    #[arg(long, help_heading = PAPER)]
    pub orientation: Option<String>,
    /// Blank margin along the edges of the paper [default: 5mm]
    #[arg(long, help_heading = PAPER, value_name = "LENGTH", allow_hyphen_values = true)]
    pub margin: Option<String>,
    /// Text for the label of every sheet, next to the name, such as the owner
    #[arg(long, help_heading = PAPER, value_name = "TEXT")]
    pub note: Option<String>,
    /// SVG logo, printed in black opposite the label: filled paths and strokes; white areas stay unprinted
    #[arg(long, help_heading = PAPER, value_name = "FILE")]
    pub logo: Option<String>,
    /// Height of the logo [default: the height of the label strip]
    #[arg(long, help_heading = PAPER, value_name = "LENGTH", allow_hyphen_values = true)]
    pub logo_height: Option<String>,
    /// Stem of the file names, also printed on the sheets [default: the solid's name]
    #[arg(long, help_heading = OUTPUT)]
    pub name: Option<String>,
    /// Meshes.
    #[arg(skip)]
    #[serde(skip_serializing_if = "is_usual")]
    pub meshes: Meshes,
    /// Drawings for a laser.
    #[arg(skip)]
    #[serde(skip_serializing_if = "is_usual")]
    pub laser: Laser,
}

impl SolidSettings {
    /// Reads a template of a command.
    pub fn read(path: &Path, command: &str) -> anyhow::Result<Self> {
        template::read(path, command, |settings: &Self| settings.command.as_deref())
    }

    /// Returns the text of a template.
    pub fn to_toml(&self, command: &str) -> String {
        template::text(&Self { command: Some(command.to_owned()), ..self.clone() })
    }

    /// Returns these settings, completed by those of a template.
    pub fn or(self, template: Self) -> Self {
        let formats = self.printed();
        let png = self.png || (template.png && !formats);
        let (bare, dense) = (self.untagged, self.dense);
        let tagged = self.of_tags().into_iter().any(|(_, given)| given);
        // Tag settings are replaced as a whole: an option also overrides conflicting settings of the template.
        Self {
            command: None,
            untagged: bare || (template.untagged && !tagged),
            dense: dense || (template.dense && !bare && self.family.is_none()),
            family: self.family.or(template.family.filter(|_| !bare && !dense)),
            tag_spacing: self.tag_spacing.or(template.tag_spacing.filter(|_| !bare && !dense)),
            tag_border: self.tag_border.or(template.tag_border.filter(|_| !bare)),
            hole: self.hole.or(template.hole.filter(|_| !bare && !dense)),
            first_id: self.first_id.or(template.first_id.filter(|_| !bare && !dense)),
            square_family: self.square_family.or(template.square_family.filter(|_| !bare)),
            first_square_id: self.first_square_id.or(template.first_square_id.filter(|_| !bare)),
            tag_ids: self.tag_ids || (template.tag_ids && !bare && !dense),
            invert: self.invert || template.invert,
            // Edge and scale of a mesh exclude each other.
            scale: self.scale.or(template.scale.filter(|_| self.edge.is_none())),
            edge: self.edge.or(template.edge.filter(|_| self.scale.is_none())),
            per_face: self.per_face || (template.per_face && !self.allow_seams),
            allow_seams: self.allow_seams || (template.allow_seams && !self.per_face),
            pdf: self.pdf || (template.pdf && !formats),
            svg: self.svg || (template.svg && !formats),
            png,
            // Unused if the options select formats other than those of the template.
            dpi: self.dpi.or(template.dpi.filter(|_| png || !template.png)),
            size: self.size.or(template.size),
            mesh: self.mesh.or(template.mesh),
            allow_skew: self.allow_skew || template.allow_skew,
            tiles: self.tiles.or(template.tiles),
            face_margin: self.face_margin.or(template.face_margin),
            board_id: self.board_id.or(template.board_id),
            stl: self.stl || template.stl,
            skeleton: self.skeleton || template.skeleton,
            panel_thickness: self.panel_thickness.or(template.panel_thickness),
            wall: self.wall.or(template.wall),
            rib: self.rib.or(template.rib),
            dxf: self.dxf || template.dxf,
            guide_page: self.guide_page || template.guide_page,
            dsc: self.dsc || template.dsc,
            dsc_dialect: self.dsc_dialect.or(template.dsc_dialect),
            paper: self.paper.or(template.paper),
            pages: self.pages.or(template.pages.filter(|_| !self.per_face)),
            orientation: self.orientation.or(template.orientation),
            margin: self.margin.or(template.margin),
            note: self.note.or(template.note),
            logo: self.logo.or(template.logo),
            logo_height: self.logo_height.or(template.logo_height),
            name: self.name.or(template.name),
            meshes: self.meshes.or(template.meshes),
            laser: self.laser.or(template.laser),
        }
    }

    /// Extensions of the files that can be named by `-o`.
    pub const ENDINGS: [&str; 13] = [
        "json", "pdf", "svg", "png", "dsc", "stl", "glb", "obj", "sdf", "urdf", "xml", "usda",
        "3mf",
    ];

    /// Returns these settings with the name and the format of the file that `-o` names.
    pub fn for_file(mut self, file: Option<NamedFile>) -> anyhow::Result<Self> {
        let ending = named_by(&mut self.name, file)?;
        let Self { pdf, svg, png, dsc, stl, .. } = &mut self;
        request(&ending, [("pdf", pdf), ("svg", svg), ("png", png), ("dsc", dsc), ("stl", stl)]);
        self.meshes.request(&ending);
        Ok(self)
    }

    /// Rejects shape settings of another solid in a template.
    pub fn check_shape(&self, command: &str) -> anyhow::Result<()> {
        let keys = [
            ("size", self.size.is_some(), "cuboid"),
            ("mesh", self.mesh.is_some(), "solid"),
            ("scale", self.scale.is_some(), "solid"),
            ("allow-skew", self.allow_skew, "solid"),
            ("square-family", self.square_family.is_some(), "solid"),
            ("first-square-id", self.first_square_id.is_some(), "solid"),
        ];
        match keys.into_iter().find(|(_, is_given, of)| *is_given && *of != command) {
            Some((key, _, of)) => {
                bail!("--template: `{key}` is a setting of `{of}`, not of `{command}`; remove it")
            }
            None => Ok(()),
        }
    }

    /// Whether a print format is requested.
    pub fn printed(&self) -> bool {
        self.pdf || self.svg || self.png
    }

    /// Returns these settings with the net and the textured mesh if no file is requested.
    pub fn with_default_files(mut self) -> Self {
        let bodies = self.stl || self.skeleton || self.dxf || self.laser.is_any();
        if !(bodies || self.printed() || self.meshes.is_any()) {
            self.pdf = true;
            self.meshes.request("glb");
        }
        self
    }

    /// Rejects options without effect.
    pub fn check_use(&self) -> anyhow::Result<()> {
        let layout = self.printed() || self.dxf;
        let needed = "--pdf, --svg, --png or --dxf";
        refuse_idle(&[
            ("--dpi", self.dpi.is_some(), self.png, "--png"),
            ("--pages", self.pages.is_some(), layout || self.paper.is_some(), needed),
            ("--orientation", self.orientation.is_some(), layout, needed),
            ("--margin", self.margin.is_some(), layout, needed),
            ("--per-face", self.per_face, layout, needed),
            ("--allow-seams", self.allow_seams, layout, needed),
            ("--guide-page", self.guide_page, layout, needed),
            ("--tag-ids", self.tag_ids, layout, needed),
            ("--note", self.note.is_some(), layout, needed),
            ("--logo", self.logo.is_some(), layout, needed),
            ("--logo-height", self.logo_height.is_some(), self.logo.is_some(), "--logo"),
            ("--panel-thickness", self.panel_thickness.is_some(), self.skeleton, "--skeleton"),
            ("--wall", self.wall.is_some(), self.skeleton, "--skeleton"),
            ("--rib", self.rib.is_some(), self.skeleton, "--skeleton"),
        ])?;
        match self.dpi {
            Some(dpi) if !DPI.contains(&dpi) => {
                bail!("--dpi: {dpi} is not between {} and {}", DPI.start(), DPI.end())
            }
            _ => Ok(()),
        }
    }

    /// Returns the specification of a solid with this shape.
    pub fn spec(&self, shape: SolidShape, paper: &PaperSpec) -> anyhow::Result<SolidSpec> {
        let default = SolidSpec::new(shape);
        let edge_mm = length("edge", &self.edge)?;
        let mut spec = SolidSpec {
            edge_mm: default.edge_mm,
            tiles: self.tiles.unwrap_or(default.tiles),
            margin_mm: default.margin_mm,
            board_id: self.board_id.unwrap_or(default.board_id),
            tags: self.tags(default.shape.tag_tiling())?,
            inverted: self.invert,
            square_tags: self.square_tags(default.square_tags)?,
            skeleton: self.skeleton()?,
            shape: default.shape,
        };
        spec.edge_mm = edge_mm.unwrap_or_else(|| usual_solid_edge_mm(&spec, paper));
        spec.margin_mm = match length("face-margin", &self.face_margin)? {
            Some(given) => given,
            None => spec.comfortable_margin_mm()?,
        };
        Ok(spec)
    }

    /// Returns the tag options, and whether each is given.
    fn of_tags(&self) -> [(&'static str, bool); 8] {
        [
            ("--family", self.family.is_some()),
            ("--dense", self.dense),
            ("--tag-spacing", self.tag_spacing.is_some()),
            ("--tag-border", self.tag_border.is_some()),
            ("--hole", self.hole.is_some()),
            ("--first-id", self.first_id.is_some()),
            ("--square-family", self.square_family.is_some()),
            ("--first-square-id", self.first_square_id.is_some()),
        ]
    }

    /// Returns the tags of all faces, or those of one tiling if there are two.
    fn tags(&self, tiling: GridKind) -> anyhow::Result<Option<TagSpec>> {
        check_tags(self.untagged, self.dense, &self.of_tags())?;
        if self.untagged {
            return Ok(None);
        }
        let family = if self.dense { Some(positions::NAME) } else { self.family.as_deref() };
        let tags = TagSpec::usual(tiling, family, TagsIn::Black);
        Ok(Some(TagSpec {
            hole_mm: length("hole", &self.hole)?,
            first_id: self.first_id.unwrap_or(tags.first_id),
            spacing: self.tag_spacing.unwrap_or(tags.spacing),
            border_bits: self.tag_border.unwrap_or(tags.border_bits),
            ..tags
        }))
    }

    /// Returns the tags of rectangular faces; `usual` if the solid also has other faces.
    fn square_tags(&self, usual: Option<TagSpec>) -> anyhow::Result<Option<TagSpec>> {
        let is_asked = self.square_family.is_some() || self.first_square_id.is_some();
        match usual {
            None if is_asked => bail!(
                "--square-family and --first-square-id apply only to meshes with both rectangular and other faces; use \
                 --family or --first-id"
            ),
            None => Ok(None),
            Some(_) if self.untagged => Ok(None),
            Some(usual) => Ok(Some(TagSpec {
                family: self.square_family.clone().unwrap_or(usual.family),
                first_id: self.first_square_id.unwrap_or(usual.first_id),
                ..usual
            })),
        }
    }

    fn skeleton(&self) -> anyhow::Result<Option<SkeletonSpec>> {
        if !self.skeleton {
            return Ok(None);
        }
        let default = SkeletonSpec::default();
        let thickness = length("panel-thickness", &self.panel_thickness)?;
        Ok(Some(SkeletonSpec {
            panel_thickness_mm: thickness.unwrap_or(default.panel_thickness_mm),
            wall_mm: length("wall", &self.wall)?.unwrap_or(default.wall_mm),
            rib_mm: length("rib", &self.rib)?,
        }))
    }

    /// Returns the paper.
    pub fn paper(&self) -> anyhow::Result<PaperSpec> {
        let paper = PaperSpec {
            size: self.paper.as_deref().map(str::parse).transpose().context("--paper")?,
            orientation: match &self.orientation {
                Some(text) => text.parse().context("--orientation")?,
                None => Default::default(),
            },
            margin_mm: length("margin", &self.margin)?.unwrap_or(DEFAULT_MARGIN_MM),
            solids: match (self.per_face, self.allow_seams) {
                (true, _) => SolidSheets::PerFace,
                (false, true) => SolidSheets::SeamedNet,
                (false, false) => SolidSheets::Net,
            },
            pages: self.pages,
            note: self.note.clone(),
            tag_ids: self.tag_ids,
            guide_page: self.guide_page,
            ..PaperSpec::default()
        };
        logo::on(paper, self.logo.as_deref(), length("logo-height", &self.logo_height)?)
    }

    /// Returns the dialect of the list of corners and tags, if it is written.
    pub fn dsc(&self) -> anyhow::Result<Option<Dialect>> {
        match &self.dsc_dialect {
            Some(text) => {
                Ok(Some(text.parse().map_err(|e: String| anyhow!("--dsc-dialect: {e}"))?))
            }
            None => Ok(self.dsc.then(Dialect::default)),
        }
    }
}
