//! `deltille tetrahedron`, `octahedron`, `icosahedron`, `cube`, `cuboid`, `solid --mesh`.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, bail};

use super::delivery::Delivery;
use super::settings::board_settings::{DEFAULT_DPI, OUTPUT, TAGS};
use super::settings::finishing::Laser;
use super::settings::meshes::Meshes;
use super::settings::solid_settings::SolidSettings;
use super::settings::template::Template;
use super::single_panel::page;
use crate::deltille::files::written::{self, File, bytes_file, text_file};
use crate::output::say;
use crate::progress::Spinner;
use crate::values::{number, whole};
use deltille::export::artifacts::{self, Making, What};
use deltille::export::{dsc, solid_mesh};
use deltille::family::{self, Family};
use deltille::layout::{Printing, tag_range};
use deltille::targets::{
    ClosedMesh, NEAR_EQUILATERAL, Name, Skeleton, SolidShape, SolidSpec, TargetSpec, parse_box_mm,
};
use deltille_core::quantity::unit_mm;

/// Arguments of the commands that make solids.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: SolidSettings,
    /// Read settings that are not given as options from a TOML file
    #[arg(long, help_heading = OUTPUT, value_name = "FILE")]
    template: Option<PathBuf>,
    /// Write the settings as a TOML file
    #[arg(long, help_heading = OUTPUT, value_name = "FILE")]
    save_template: Option<PathBuf>,
    #[command(flatten)]
    delivery: Delivery,
    #[command(flatten)]
    meshes: Meshes,
    #[command(flatten)]
    laser: Laser,
}

/// Help of options with a different meaning for meshes.
pub const MEAN_OF_MESH: &str =
    "Mean edge length to which the mesh is scaled, such as 150mm, 15cm, 6in [default: unscaled]";

/// Help of options with a different meaning for solids with square tags.
pub mod squares {
    pub const MEAN: &str = "Mean edge length to which the cuboid is scaled [default: unscaled]";
    pub const TILES: &str = "Number of squares along each side of a face, 6 to 200; on a cuboid, along the shortest side \
                             (squares have the same size on all faces) [default: 8]";
    pub const FAMILY: &str = "Tag family: aprilTag36h11, aprilTag25h9 or aprilTag16h5, or a family file \
                              [default: aprilTag36h11]";
    pub const SPACING: &str = "Put a tag in every N-th row and column of a face, only where that square is black \
                               (for odd N, every second position) [default: 2]";
    pub const BORDER: &str = "Width of a tag's black border in cells, at least 1 [default: 2]";
}

/// Arguments of `deltille cuboid`.
#[derive(clap::Args)]
pub struct CuboidArgs {
    /// Edge lengths along x, y and z, such as 200x150x100mm or 8x6x4in
    #[arg(long, value_name = "SIZE")]
    size: Option<String>,
    #[command(flatten)]
    args: Args,
}

/// Arguments of `deltille solid`.
#[derive(clap::Args)]
pub struct MeshArgs {
    /// Closed mesh (OBJ, STL or PLY, in millimetres) with flat, convex faces. Each face gets a board: deltille tiles
    /// on triangles, a checkerboard on rectangles, and as many deltille tiles as fit on others
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Family of the square tags, if the mesh has both rectangular and other faces [default: aprilTag36h11]
    #[arg(long, help_heading = TAGS, value_name = "FAMILY")]
    square_family: Option<String>,
    /// Id of the first square tag on such a mesh [default: 0]
    #[arg(long, help_heading = TAGS, value_name = "ID", value_parser = whole(0..=u32::MAX))]
    first_square_id: Option<u32>,
    /// Millimetres per unit of the mesh, such as 1000 for metres, 25.4 for inches [default: 1]
    #[arg(long, value_name = "FACTOR", conflicts_with = "edge",
          value_parser = number(SCALE))]
    scale: Option<f64>,
    /// Accept faces that are far from equilateral, as long as a board fits
    #[arg(long)]
    allow_skew: bool,
    #[command(flatten)]
    args: Args,
}

/// Range of the millimetres per unit of a mesh.
const SCALE: RangeInclusive<f64> = unit_mm::RANGE.least..=unit_mm::RANGE.most;

/// Makes a solid with the shape of its command.
pub fn run(shape: SolidShape, mut args: Args) -> anyhow::Result<ExitCode> {
    let command = shape.name();
    let settings = args.settings(command)?;
    run_with(shape, command, settings, &args)
}

/// Makes a cuboid.
pub fn run_cuboid(cuboid: CuboidArgs) -> anyhow::Result<ExitCode> {
    let mut args = cuboid.args;
    args.settings.size = cuboid.size;
    let settings = args.settings("cuboid")?;
    let Some(size) = &settings.size else {
        bail!("--size is needed, as an option or in a --template")
    };
    let sides = parse_box_mm(size).context("--size")?;
    run_with(SolidShape::Cuboid(sides), "cuboid", settings, &args)
}

/// Makes a solid from a mesh, named after the stem of its file by default.
pub fn run_mesh(mesh: MeshArgs) -> anyhow::Result<ExitCode> {
    let mut args = mesh.args;
    args.settings.mesh = mesh.mesh;
    args.settings.square_family = mesh.square_family;
    args.settings.first_square_id = mesh.first_square_id;
    args.settings.scale = mesh.scale;
    args.settings.allow_skew = mesh.allow_skew;
    let mut settings = args.settings("solid")?;
    let Some(path) = settings.mesh.clone() else {
        bail!("--mesh is needed, as an option or in a --template")
    };
    let scale = settings.scale.unwrap_or(1.0);
    if !SCALE.contains(&scale) {
        bail!("--scale: {scale} is not between {} and {}", SCALE.start(), SCALE.end());
    }
    let show = || format!("--mesh: {}", path.display());
    let text = args.delivery.limits().read(&path).context("--mesh")?;
    let (solid, inside_out) = solid_mesh::read(&text).with_context(show)?;
    let (face, deviation) = solid.most_skewed();
    if deviation > NEAR_EQUILATERAL && !settings.allow_skew {
        bail!(
            "{}: edges of triangle {} deviate by {:.1} % from their mean (limit {:.0} %); use \
             --allow-skew to put smaller boards on such faces",
            show(),
            face + 1,
            100.0 * deviation,
            100.0 * NEAR_EQUILATERAL
        );
    }
    if inside_out {
        say!("{}: the face normals pointed inwards and were flipped", path.display());
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = settings.name.clone().unwrap_or_else(|| Name::like(&stem).to_string());
    if settings.meshes.has_obj() && args.delivery.would_replace(&format!("{name}.obj"), &path) {
        bail!("--name: {name}.obj would overwrite the mesh; use another name or folder");
    }
    let faces = solid.faces();
    let vertices: Vec<_> = solid.vertices().iter().map(|&v| v * scale).collect();
    let (scaled, _) = ClosedMesh::new(&vertices, faces).with_context(show)?;
    settings.name = Some(name);
    run_with(SolidShape::Mesh(scaled), "solid", settings, &args)
}

/// Makes a solid, writes its files, and verifies them.
fn run_with(
    shape: SolidShape,
    command: &str,
    settings: SolidSettings,
    args: &Args,
) -> anyhow::Result<ExitCode> {
    let settings = settings.with_default_files();
    settings.check_use()?;
    let meshes = &settings.meshes;
    meshes.check_use(None)?;
    settings.laser.check_use()?;
    let paper = settings.paper()?;
    let spinner = Spinner::new("fitting the solid to the paper");
    let spec = settings.spec(shape, &paper)?;
    drop(spinner);
    let family = family_of(&spec)?;
    let name = settings.name.clone().unwrap_or_else(|| spec.shape.name().to_owned());
    // The net to cut is the printed one; the description contains it even if it is not printed.
    let net = settings.dxf && !settings.per_face;
    let layout = (settings.printed() || net).then_some(&paper);
    let solid = TargetSpec::Solid(spec.clone());
    let printing = Printing::build(&name, &solid, family.as_ref(), layout)?;
    let target = &printing.target;
    args.delivery.check_beside(target)?;
    let template = args
        .save_template
        .as_deref()
        .map(|path| Template::new(path, settings.to_toml(command), args.delivery.overwrite));
    let template = template.transpose()?;
    let mut files = files(&settings, &printing, net, &spec)?;
    let (textured, texture) = meshes.files(target, None)?;
    files.extend(textured);
    files.extend(settings.laser.files(&printing)?);
    files.extend(pages(&settings, &printing)?);
    let description = summary(&printing, &spec)? + &texture + &settings.laser.order();
    let delivered = args.delivery.deliver(&printing, &files, &description)?;
    template.map_or(Ok(()), |template| template.write())?;
    Ok(delivered)
}

/// Returns the family of the tags, with that of square ones if there are both.
fn family_of(spec: &SolidSpec) -> anyhow::Result<Option<Family>> {
    let Some(tags) = &spec.tags else { return Ok(None) };
    let family = family::resolve(&tags.family).context("--family")?;
    let Some(squares) = &spec.square_tags else { return Ok(Some(family)) };
    let squares = family::resolve(&squares.family).context("--square-family")?;
    Ok(Some(family.with_squares(squares)))
}

impl Args {
    /// Returns the given settings, completed by the template.
    fn settings(&mut self, command: &str) -> anyhow::Result<SolidSettings> {
        let (meshes, laser) = (self.meshes.clone(), self.laser.clone());
        let given = SolidSettings { meshes, laser, ..self.settings.clone() };
        let given = given.for_file(self.delivery.take_file(&SolidSettings::ENDINGS)?)?;
        let settings = match &self.template {
            Some(path) => given.or(SolidSettings::read(path, command)?),
            None => given,
        };
        settings.check_shape(command)?;
        Ok(settings)
    }
}

/// Returns the description, bodies, outlines and lists. Rejects invalid ones before anything is written.
fn files(
    settings: &SolidSettings,
    printing: &Printing,
    net: bool,
    spec: &SolidSpec,
) -> anyhow::Result<Vec<File>> {
    let name = &printing.target.name;
    let mut files = vec![text_file(format!("{name}.json"), printing.to_json())];
    if let Some(dialect) = settings.dsc()? {
        let text = dsc::write(&printing.target, dialect).context("--dsc")?;
        files.push(text_file(format!("{name}.dsc"), text));
    }
    let asked = [
        (settings.stl, What::Stl),
        (spec.skeleton.is_some(), What::Skeleton),
        (settings.dxf, What::Panels),
        (net, What::Net),
    ];
    for (_, what) in asked.into_iter().filter(|(is_asked, _)| *is_asked) {
        let made = artifacts::make(printing, what, Making::default())?;
        files.extend(made.into_iter().map(|(name, bytes)| bytes_file(name, bytes)));
    }
    Ok(files)
}

/// Returns the requested pages.
fn pages(settings: &SolidSettings, printing: &Printing) -> anyhow::Result<Vec<File>> {
    if !settings.printed() {
        return Ok(Vec::new());
    }
    let artwork = printing.draw()?;
    let SolidSettings { pdf, svg, png, .. } = *settings;
    let dpi = settings.dpi.unwrap_or(DEFAULT_DPI);
    Ok(written::drawn(&printing.target.name, artwork, written::Formats { pdf, svg, png }, dpi))
}

/// Describes the solid in one line, and the panels of a skeleton in another.
fn summary(printing: &Printing, spec: &SolidSpec) -> anyhow::Result<String> {
    let target = &printing.target;
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
    text += &page(printing);
    if let Some(skeleton) = &spec.skeleton {
        let solid = spec.polyhedron();
        let made = Skeleton::new(&solid, skeleton)?;
        let angles = solid.dihedral_angles_rad().into_iter().map(f64::to_degrees);
        let angles: Vec<f64> = angles.collect();
        text += &format!(
            "\nskeleton: panels of {} mm, cut straight {:.2} mm inside the edges; faces meet at \
             {}°, so panels without ribs would need edges mitred by {}°",
            skeleton.panel_thickness_mm,
            made.panel_inset_mm,
            range(angles.iter().copied(), 2),
            range(angles.iter().map(|angle| 90.0 - angle / 2.0), 2),
        );
    }
    Ok(text)
}

/// Formats the smallest and the largest number, or one number if all are equal.
fn range(numbers: impl Iterator<Item = f64> + Clone, digits: usize) -> String {
    let least = numbers.clone().fold(f64::INFINITY, f64::min);
    let most = numbers.fold(f64::NEG_INFINITY, f64::max);
    let [least, most] = [least, most].map(|number| format!("{number:.digits$}"));
    if least == most { least } else { format!("{least} to {most}") }
}
