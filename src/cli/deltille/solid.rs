//! `deltille tetrahedron`, `octahedron`, `icosahedron`, `cube`, `cuboid`, `solid --mesh`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, anyhow, bail};
use glam::DVec3;

use super::delivery::Delivery;
use super::files::{self, File, bytes_file, text_file};
use super::finishing::Laser;
use super::meshes::Meshes;
use super::settings::{DEFAULT_DPI, PAPER, PRINT, TAGS};
use crate::artwork;
use crate::cli::output::say;
use crate::cli::values::{number, whole};
use crate::export::artifacts::{self, Making, What};
use crate::export::dsc::{self, Dialect};
use crate::export::solid_mesh;
use crate::family::{self, Family, places};
use crate::quantity::unit_mm;
use crate::targets::{
    BORDER_BITS, ClosedMesh, DEFAULT_MARGIN_MM, FACE_TILES, MOST_ROWS, NEAR_EQUILATERAL, Name,
    PaperSpec, Skeleton, SkeletonSpec, SolidShape, SolidSheets, SolidSpec, TagSpec, TagsIn, Target,
    TargetSpec, parse_box_mm, parse_length_mm, tag_range,
};

/// Heading of the help.
const BODIES: &str = "Bodies to print, outlines to cut";

/// Arguments of the commands that make solids.
#[derive(clap::Args)]
pub struct Args {
    /// Edge of the solid, such as 150mm, 15cm, 6in; of a mesh the mean, to which it is scaled
    /// [default: 150mm, or as the mesh is]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    edge: Option<String>,
    /// Black tiles along each side of a face [default: 10]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(FACE_TILES))]
    tiles: Option<u32>,
    /// Blank between a face's edges and its tiles [default: 5mm, with a skeleton at least 3 mm on
    /// its panels]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    face_margin: Option<String>,
    /// Tag family: a name from `deltag list`, or a family file [default: delTag25h7]
    #[arg(long, help_heading = TAGS)]
    family: Option<String>,
    /// A small place code in every upright tile: any few tiles beside each other tell where they are
    #[arg(long, help_heading = TAGS, conflicts_with_all = ["family", "tag_spacing", "first_id"])]
    dense: bool,
    /// A tag in every n-th row and column of a face [default: 3]
    #[arg(long, help_heading = TAGS, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=MOST_ROWS))]
    tag_spacing: Option<u32>,
    /// Black border of a tag, in widths of a bit [default: 1.5]
    #[arg(long, help_heading = TAGS, value_name = "BITS", allow_negative_numbers = true, value_parser = number(BORDER_BITS))]
    tag_border: Option<f64>,
    /// Id of the first tag; the others follow, face by face [default: 0]
    #[arg(long, help_heading = TAGS, value_name = "ID", allow_negative_numbers = true, value_parser = whole(0..=u32::MAX))]
    first_id: Option<u32>,
    /// Id of the first face's board; the others follow [default: 0]
    #[arg(long, value_name = "ID", allow_negative_numbers = true, value_parser = whole(0..=u32::MAX))]
    board_id: Option<u32>,
    /// Write <name>.stl, the bare solid (millimetres)
    #[arg(long, help_heading = BODIES)]
    stl: bool,
    /// Write <name>-skeleton.stl, a frame to print with a seat for a panel on each face
    #[arg(long, help_heading = BODIES)]
    skeleton: bool,
    /// Thickness of the panels and what is glued on them [default: 3mm]
    #[arg(long, help_heading = BODIES, value_name = "LENGTH", allow_hyphen_values = true, requires = "skeleton")]
    panel_thickness: Option<String>,
    /// Thickness of the skeleton below the panels [default: 4mm]
    #[arg(long, help_heading = BODIES, value_name = "LENGTH", allow_hyphen_values = true, requires = "skeleton")]
    wall: Option<String>,
    /// Distance of the seats from the edges of the faces [default: the least that stays solid]
    #[arg(long, help_heading = BODIES, value_name = "LENGTH", allow_hyphen_values = true, requires = "skeleton")]
    rib: Option<String>,
    /// Write <name>-panels.dxf, the outlines of all faces to cut, or of what the seats of the
    /// skeleton take, and without --per-face <name>-net.dxf, the net to cut, score and fold
    /// (millimetres)
    #[arg(long, help_heading = BODIES)]
    dxf: bool,
    /// Write <name>.pdf: the net to cut out, fold and glue, or with --per-face a page per face
    #[arg(long, help_heading = PRINT)]
    pdf: bool,
    /// Write <name>-<page>.svg
    #[arg(long, help_heading = PRINT)]
    svg: bool,
    /// Write <name>-<page>.png
    #[arg(long, help_heading = PRINT)]
    png: bool,
    /// Print each face on a sheet of its own, to be glued on a rigid skeleton, instead of the net
    #[arg(long, help_heading = PAPER)]
    per_face: bool,
    /// Print a net that is larger than the paper in one piece, over pages that are joined along seams
    /// through its tiles, instead of in pieces of whole faces
    #[arg(long, help_heading = PAPER, conflicts_with = "per_face")]
    allow_seams: bool,
    /// Write <name>.dsc, for the reference detector or its fork
    #[arg(long, help_heading = PRINT)]
    dsc: bool,
    /// fork or original [default: fork]
    #[arg(long, help_heading = PRINT, value_name = "DIALECT")]
    dsc_dialect: Option<String>,
    /// Resolution of the PNG pages, dots per inch [default: 300]
    #[arg(long, help_heading = PRINT, value_parser = whole(200..=2400u32))]
    dpi: Option<u32>,
    /// A0 to A5, letter, legal, tabloid, or a size such as 297x420mm; a net that is larger is
    /// printed in several pieces of whole faces [default: the smallest of A4 to A0 that takes it, else A0]
    #[arg(long, help_heading = PAPER, value_name = "SIZE")]
    paper: Option<String>,
    /// auto, portrait or landscape [default: auto]
    #[arg(long, help_heading = PAPER)]
    orientation: Option<String>,
    /// Blank along the edges of the paper [default: 5mm]
    #[arg(long, help_heading = PAPER, value_name = "LENGTH", allow_hyphen_values = true)]
    margin: Option<String>,
    /// Stem of the files' names, printed on the sheets [default: the solid's name]
    #[arg(long)]
    name: Option<String>,
    #[command(flatten)]
    delivery: Delivery,
    #[command(flatten)]
    meshes: Meshes,
    #[command(flatten)]
    laser: Laser,
}

/// Help of options that say something else of solids with square tags.
pub mod squares {
    pub const EDGE: &str = "Edge of the cube, such as 150mm, 15cm, 6in [default: 150mm]";
    pub const MEAN: &str =
        "Mean of the three sides, to which the cuboid is scaled [default: as --size says]";
    pub const TILES: &str = "Squares along each side of a face, on a cuboid along the shortest; \
                             all faces have squares of the same size [default: 8]";
    pub const FAMILY: &str = "Tag family: aprilTag36h11, aprilTag25h9 or aprilTag16h5, or a family file \
                              [default: aprilTag36h11]";
    pub const SPACING: &str = "A tag in every n-th row and column of a face, where the square is black, which with \
                               an odd n every second is [default: 2]";
    pub const BORDER: &str = "Black border of a tag, in widths of a bit, at least 1 [default: 2]";
}

/// Arguments of `deltille cuboid`.
#[derive(clap::Args)]
pub struct CuboidArgs {
    /// Sides along x, y and z, such as 200x150x100mm or 8x6x4in
    #[arg(long, value_name = "SIZE", value_parser = parse_box_mm)]
    size: DVec3,
    #[command(flatten)]
    args: Args,
}

/// Makes a cuboid.
pub fn run_cuboid(cuboid: CuboidArgs) -> anyhow::Result<ExitCode> {
    run(SolidShape::Cuboid(cuboid.size), cuboid.args)
}

/// Arguments of `deltille solid`.
#[derive(clap::Args)]
pub struct MeshArgs {
    /// A closed mesh as OBJ, STL or PLY, in millimetres, whose faces are flat and convex; a board is put on each: deltille
    /// tiles on triangles, a checkerboard on rectangles, as many deltille tiles as find room on others
    #[arg(long, value_name = "FILE")]
    mesh: PathBuf,
    /// Family of the square tags, where the mesh has rectangular faces and others [default:
    /// aprilTag36h11]
    #[arg(long, help_heading = TAGS, value_name = "FAMILY")]
    square_family: Option<String>,
    /// Id of the first square tag there [default: 0]
    #[arg(long, help_heading = TAGS, value_name = "ID", allow_negative_numbers = true, value_parser = whole(0..=u32::MAX))]
    first_square_id: Option<u32>,
    /// Millimetres per unit of the mesh, such as 1000 for metres, 25.4 for inches [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, conflicts_with = "edge",
          value_parser = number(unit_mm::RANGE.least..=unit_mm::RANGE.most))]
    scale: Option<f64>,
    /// Take faces that are far from equilateral, as long as a board fits
    #[arg(long)]
    allow_skew: bool,
    #[command(flatten)]
    args: Args,
}

/// Makes a solid from a mesh, with the stem of its file for a name.
pub fn run_mesh(mut mesh: MeshArgs) -> anyhow::Result<ExitCode> {
    let (path, scale) = (&mesh.mesh, mesh.scale.unwrap_or(1.0));
    let show = || format!("--mesh: {}", path.display());
    let text = mesh.args.delivery.limits().read(path).context("--mesh")?;
    let (solid, inside_out) = solid_mesh::read(&text).with_context(show)?;
    let (face, deviation) = solid.most_skewed();
    if deviation > NEAR_EQUILATERAL && !mesh.allow_skew {
        bail!(
            "{}: edges of triangle {} deviate by {:.1} % from their mean, more than {:.0} %: give \
             --allow-skew to put smaller boards on such faces",
            show(),
            face + 1,
            100.0 * deviation,
            100.0 * NEAR_EQUILATERAL
        );
    }
    if inside_out {
        say!("{}: its faces look inwards; they were turned", path.display());
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = mesh.args.name.clone().unwrap_or_else(|| Name::like(&stem).to_string());
    if mesh.args.meshes.has_obj() && mesh.args.delivery.would_replace(&format!("{name}.obj"), path)
    {
        bail!("--name: {name}.obj would be written over the mesh: give another name or folder");
    }
    let faces = solid.faces();
    let vertices: Vec<_> = solid.vertices().iter().map(|&v| v * scale).collect();
    let (scaled, _) = ClosedMesh::new(&vertices, faces).with_context(show)?;
    mesh.args.name = Some(name);
    let squares = Squares { family: mesh.square_family, first_id: mesh.first_square_id };
    run_with(SolidShape::Mesh(scaled), mesh.args, squares)
}

/// What is asked of square tags beside triangular ones.
#[derive(Default)]
struct Squares {
    family: Option<String>,
    first_id: Option<u32>,
}

impl Squares {
    /// The tags of rectangular faces, `usual` where there are such beside others.
    fn tags(self, usual: Option<TagSpec>) -> anyhow::Result<Option<TagSpec>> {
        let is_asked = self.family.is_some() || self.first_id.is_some();
        match usual {
            None if is_asked => bail!(
                "--square-family, --first-square-id: the mesh has no rectangles beside other faces: give --family \
                 or --first-id"
            ),
            None => Ok(None),
            Some(usual) => Ok(Some(TagSpec {
                family: self.family.unwrap_or(usual.family),
                first_id: self.first_id.unwrap_or(usual.first_id),
                ..usual
            })),
        }
    }
}

/// Makes a solid, writes its files, and verifies what it wrote.
pub fn run(shape: SolidShape, args: Args) -> anyhow::Result<ExitCode> {
    run_with(shape, args, Squares::default())
}

fn run_with(shape: SolidShape, args: Args, squares: Squares) -> anyhow::Result<ExitCode> {
    args.check_use()?;
    let spec = args.spec(shape, squares)?;
    let paper = args.paper()?;
    let mut family = family::resolve(&spec.tags.family).context("--family")?;
    if let Some(tags) = &spec.square_tags {
        family = family.with_squares(family::resolve(&tags.family).context("--square-family")?);
    }
    let name = args.name.clone().unwrap_or_else(|| spec.shape.name().to_owned());
    // What is cut is the net that is printed, or would be: the description has it in either case.
    let net = args.dxf && !args.per_face;
    let layout = (args.printed() || net).then_some(&paper);
    let solid = TargetSpec::Solid(spec.clone());
    let target = Target::build(&name, &solid, Some(&family), layout)?;
    args.delivery.check_beside(&target)?;
    let (files, texture) = args.files(&target, net, &spec, &family)?;
    let told = summary(&target, &spec)? + &texture;
    args.delivery.deliver(&target, Some(&family), &files, &told)
}

impl Args {
    fn printed(&self) -> bool {
        self.pdf || self.svg || self.png
    }

    /// The meshes that are asked for; the glTF where nothing is.
    fn meshes(&self) -> Meshes {
        let bodies = self.stl || self.skeleton || self.dxf || self.laser.is_any();
        let nothing = !(bodies || self.printed() || self.meshes.is_any());
        if nothing { self.meshes.with_gltf() } else { self.meshes }
    }

    /// Refuses options that nothing asked for makes use of.
    fn check_use(&self) -> anyhow::Result<()> {
        let unused = |option: &str, needed: &str| {
            Err(anyhow!("{option}: it says nothing without {needed}: add one, or leave it out"))
        };
        self.meshes().check_use(None)?;
        self.laser.check_use()?;
        if self.dpi.is_some() && !self.png {
            return unused("--dpi", "--png");
        }
        let layout = [
            ("--paper", self.paper.is_some()),
            ("--orientation", self.orientation.is_some()),
            ("--margin", self.margin.is_some()),
            ("--per-face", self.per_face),
            ("--allow-seams", self.allow_seams),
        ];
        match layout.into_iter().find(|(_, given)| *given) {
            Some((option, _)) if !(self.printed() || self.dxf) => {
                unused(option, "--pdf, --svg, --png or --dxf")
            }
            _ => Ok(()),
        }
    }

    fn spec(&self, shape: SolidShape, squares: Squares) -> anyhow::Result<SolidSpec> {
        let default = SolidSpec::new(shape);
        let family = if self.dense { Some(places::NAME) } else { self.family.as_deref() };
        let tags = TagSpec::usual(default.shape.tag_tiling(), family, TagsIn::Black);
        let mut spec = SolidSpec {
            edge_mm: length("--edge", &self.edge)?.unwrap_or(default.edge_mm),
            tiles: self.tiles.unwrap_or(default.tiles),
            margin_mm: default.margin_mm,
            board_id: self.board_id.unwrap_or(default.board_id),
            tags: TagSpec {
                first_id: self.first_id.unwrap_or(tags.first_id),
                spacing: self.tag_spacing.unwrap_or(tags.spacing),
                border_bits: self.tag_border.unwrap_or(tags.border_bits),
                ..tags
            },
            square_tags: squares.tags(default.square_tags)?,
            skeleton: self.skeleton()?,
            shape: default.shape,
        };
        spec.margin_mm = match length("--face-margin", &self.face_margin)? {
            Some(given) => given,
            None => spec.comfortable_margin_mm()?,
        };
        Ok(spec)
    }

    fn skeleton(&self) -> anyhow::Result<Option<SkeletonSpec>> {
        if !self.skeleton {
            return Ok(None);
        }
        let default = SkeletonSpec::default();
        let thickness = length("--panel-thickness", &self.panel_thickness)?;
        Ok(Some(SkeletonSpec {
            panel_thickness_mm: thickness.unwrap_or(default.panel_thickness_mm),
            wall_mm: length("--wall", &self.wall)?.unwrap_or(default.wall_mm),
            rib_mm: length("--rib", &self.rib)?,
        }))
    }

    fn paper(&self) -> anyhow::Result<PaperSpec> {
        Ok(PaperSpec {
            size: self.paper.as_deref().map(str::parse).transpose().context("--paper")?,
            orientation: match &self.orientation {
                Some(text) => text.parse().context("--orientation")?,
                None => Default::default(),
            },
            margin_mm: length("--margin", &self.margin)?.unwrap_or(DEFAULT_MARGIN_MM),
            solids: match (self.per_face, self.allow_seams) {
                (true, _) => SolidSheets::PerFace,
                (false, true) => SolidSheets::SeamedNet,
                (false, false) => SolidSheets::Net,
            },
            ..PaperSpec::default()
        })
    }

    /// The files asked for. What can be refused is refused here, before anything is written.
    fn files(
        &self,
        target: &Target,
        net: bool,
        spec: &SolidSpec,
        family: &Family,
    ) -> anyhow::Result<(Vec<File>, String)> {
        let name = &target.name;
        let mut files = vec![text_file(format!("{name}.json"), target.to_json())];
        if self.dsc || self.dsc_dialect.is_some() {
            let dialect = match &self.dsc_dialect {
                Some(text) => text.parse().map_err(|e: String| anyhow!("--dsc-dialect: {e}"))?,
                None => Dialect::default(),
            };
            let text = dsc::write(target, dialect).context("--dsc")?;
            files.push(text_file(format!("{name}.dsc"), text));
        }
        let asked = [
            (self.stl, What::Stl),
            (spec.skeleton.is_some(), What::Skeleton),
            (self.dxf, What::Panels),
            (net, What::Net),
        ];
        for (_, what) in asked.into_iter().filter(|(is_asked, _)| *is_asked) {
            let made = artifacts::make(target, Some(family), what, Making::default())?;
            files.extend(made.into_iter().map(|(name, bytes)| bytes_file(name, bytes)));
        }
        let (meshes, texture) = self.meshes().files(target, Some(family), None)?;
        files.extend(meshes);
        files.extend(self.laser.files(target, Some(family))?);
        if self.printed() {
            let artwork = artwork::draw(target, Some(family))?;
            let formats = files::Formats { pdf: self.pdf, svg: self.svg, png: self.png };
            let dpi = self.dpi.unwrap_or(DEFAULT_DPI);
            files.extend(files::drawn(name, artwork, formats, dpi));
        }
        Ok((files, texture))
    }
}

fn length(option: &str, text: &Option<String>) -> anyhow::Result<Option<f64>> {
    text.as_deref().map(parse_length_mm).transpose().with_context(|| option.to_owned())
}

/// One line on what was made, and one on the panels of a skeleton.
fn summary(target: &Target, spec: &SolidSpec) -> anyhow::Result<String> {
    let corners: usize = target.panels.iter().map(|panel| panel.corners.len()).sum();
    let size = match &spec.shape {
        SolidShape::Cuboid(_) => spec.size(),
        shape => {
            format!("{} of {} mm edges", shape.name(), (spec.edge_mm * 1e3).round() / 1e3)
        }
    };
    let mut text = format!(
        "{}: {size}, {} faces, {corners} corners, tiles of {} mm",
        target.name,
        target.panels.len(),
        range(target.panels.iter().map(|panel| panel.edge_mm), 3),
    );
    for kind in target.tilings() {
        let tags = target.panels.iter().filter(|panel| panel.kind == kind).flat_map(|p| &p.tags);
        let mut ids = tags.map(|tag| tag.id);
        if let (Some(family), Some(first)) = (&target.family, ids.next()) {
            let last = ids.next_back().unwrap_or(first);
            text += &format!(", {}", tag_range(&family.of_tiling(kind).name, first, last));
        }
    }
    if let Some(skeleton) = &spec.skeleton {
        let solid = spec.polyhedron();
        let made = Skeleton::new(&solid, skeleton)?;
        let angles = solid.dihedral_angles_rad().into_iter().map(f64::to_degrees);
        let angles: Vec<f64> = angles.collect();
        text += &format!(
            "\nskeleton: panels of {} mm, cut straight {:.2} mm inside the edges; faces meet at \
             {}°, so that panels without ribs would need edges mitred by {}°",
            skeleton.panel_thickness_mm,
            made.panel_inset_mm,
            range(angles.iter().copied(), 2),
            range(angles.iter().map(|angle| 90.0 - angle / 2.0), 2),
        );
    }
    Ok(text)
}

/// The least and the greatest of some numbers, or the one that all are.
fn range(numbers: impl Iterator<Item = f64> + Clone, digits: usize) -> String {
    let least = numbers.clone().fold(f64::INFINITY, f64::min);
    let most = numbers.fold(f64::NEG_INFINITY, f64::max);
    let [least, most] = [least, most].map(|number| format!("{number:.digits$}"));
    if least == most { least } else { format!("{least} to {most}") }
}
