//! Mesh options of all commands that make targets, and the mesh files.

#![allow(rustdoc::invalid_html_tags)] // Option comments are help texts.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use anyhow::{Context, anyhow, bail, ensure};
use serde::{Deserialize, Serialize};

use super::option_checks::{is_false, length, refuse_idle};
use crate::deltille::files::written::{File, bytes_file};
use crate::output::{log, request};
use crate::values::{number, whole};
use deltille::export::artifacts::{Making, What, make, of_mesh};
use deltille::export::inlay::InlaidBodies;
use deltille::export::mesh::{MAX_TEXTURE_PX, MeshError, Meshing, Resolution, TexturedMesh};
use deltille::export::texture::MAX_TEXTURES;
use deltille::export::threemf;
use deltille::targets::{Target, TargetSpec, parse_length_mm};

/// Heading of these options.
const MESHES: &str = "Meshes and simulator models";

/// Range of the longest side of a texture, px.
const SIDE_PX: RangeInclusive<u32> = 64..=MAX_TEXTURE_PX;

/// Range of the resolution of a texture, dots per inch.
const TEXTURE_DPI: RangeInclusive<f64> = 1.0..=1e5;

/// Requested meshes.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
#[command(next_help_heading = MESHES)]
pub struct Meshes {
    /// Write <name>.glb, the textured mesh as glTF 2.0 (metres); with --pdf the default of solids
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    gltf: bool,
    /// Write <name>.obj, <name>.mtl and <name>-texture.png (millimetres); with several textures, <name>-texture-1.png
    /// and so on
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    obj: bool,
    /// Write <name>.sdf, a static model for Gazebo, and the files of --obj
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    sdf: bool,
    /// Write <name>.urdf, a link for ROS, and the files of --obj
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    urdf: bool,
    /// Write <name>.xml, a body for MuJoCo, and the files of --obj; with several textures, <name>-1.obj and so on
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    mjcf: bool,
    /// Write <name>.usda with its texture (metres), for Isaac Sim, Omniverse or Blender
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    usd: bool,
    /// Write <name>.3mf for printing in two colours: the white plate or solid, and a second body for the black areas,
    /// inlaid into it (millimetres); for a solid with a skeleton, also the frame
    #[arg(long = "3mf")]
    #[serde(rename = "3mf", skip_serializing_if = "is_false")]
    threemf: bool,
    /// Depth of the black inlay in a 3MF; must be less than the plate thickness or, in a solid,
    /// less than the depth at which inlays of adjacent faces would meet [default: 0.4mm]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    inlay: Option<String>,
    /// Width and depth of the printer's bed in mm, for a warning if the 3MF does not fit with a face on it [default:
    /// 256x256]
    #[arg(long, value_name = "WxD", allow_hyphen_values = true)]
    bed: Option<String>,
    /// Diameter of the printer's nozzle, for a warning if cells of tags in the 3MF are smaller [default: 0.4mm]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    nozzle: Option<String>,
    /// Longest side of the texture in px; at least 4 px per tag cell, 12 px on checkerboards [default: 20 px per
    /// cell, limited to 16384 px]
    #[arg(long, value_name = "PX", value_parser = whole(SIDE_PX))]
    texture: Option<u32>,
    /// Distribute the faces over N textures. With --texture, each has that size, so the resolution
    /// is higher; without it, the resolution is the same, but the files are smaller [default: 1]
    #[arg(long, value_name = "N",
          value_parser = whole(1..=MAX_TEXTURES))]
    textures: Option<u32>,
    /// Resolution of the texture in dots per inch, instead of --texture
    #[arg(long, value_name = "DPI", conflicts_with = "texture",
          value_parser = number(TEXTURE_DPI))]
    texture_dpi: Option<f64>,
}

impl Meshes {
    /// Returns these meshes and those of a template, with the template's options where these have none.
    pub fn or(self, template: Self) -> Self {
        let is_sized = self.texture.is_some() || self.texture_dpi.is_some();
        Self {
            gltf: self.gltf || template.gltf,
            obj: self.obj || template.obj,
            sdf: self.sdf || template.sdf,
            urdf: self.urdf || template.urdf,
            mjcf: self.mjcf || template.mjcf,
            usd: self.usd || template.usd,
            threemf: self.threemf || template.threemf,
            inlay: self.inlay.or(template.inlay),
            bed: self.bed.or(template.bed),
            nozzle: self.nozzle.or(template.nozzle),
            // Size and resolution exclude each other.
            texture: self.texture.or(template.texture.filter(|_| !is_sized)),
            texture_dpi: self.texture_dpi.or(template.texture_dpi.filter(|_| !is_sized)),
            textures: self.textures.or(template.textures),
        }
    }

    /// Extensions of the meshes.
    pub const ENDINGS: [&str; 7] = ["glb", "obj", "sdf", "urdf", "xml", "usda", "3mf"];

    /// Requests the mesh with this extension, if it is one of [`ENDINGS`](Self::ENDINGS).
    pub fn request(&mut self, ending: &str) {
        let Self { gltf, obj, sdf, urdf, mjcf, usd, threemf, .. } = self;
        let formats = [
            ("glb", gltf),
            ("obj", obj),
            ("sdf", sdf),
            ("urdf", urdf),
            ("xml", mjcf),
            ("usda", usd),
            ("3mf", threemf),
        ];
        request(ending, formats);
    }

    /// Whether any mesh is requested.
    pub fn is_any(&self) -> bool {
        self.is_textured() || self.threemf
    }

    /// Whether any textured mesh is requested.
    fn is_textured(&self) -> bool {
        self.textured_formats().next().is_some()
    }

    /// Iterates over the requested textured formats.
    fn textured_formats(&self) -> impl Iterator<Item = What> {
        let formats = [
            (self.gltf, What::Gltf),
            (self.obj, What::Obj),
            (self.sdf, What::Sdf),
            (self.urdf, What::Urdf),
            (self.mjcf, What::Mjcf),
            (self.usd, What::Usd),
        ];
        formats.into_iter().filter(|(is_asked, _)| *is_asked).map(|(_, what)| what)
    }

    /// Whether an OBJ is among the files.
    pub fn has_obj(&self) -> bool {
        self.obj || self.sdf || self.urdf || self.mjcf
    }

    /// Rejects options of meshes that are not requested.
    pub fn check_use(&self, plate: Option<&str>) -> anyhow::Result<()> {
        let (textured, any) = (self.is_textured(), self.is_any());
        refuse_idle(&[
            ("--texture", self.texture.is_some(), textured, "a mesh, such as --gltf"),
            ("--textures", self.textures.is_some(), textured, "a mesh, such as --gltf"),
            ("--texture-dpi", self.texture_dpi.is_some(), textured, "a mesh, such as --gltf"),
            ("--plate", plate.is_some(), any, "a mesh, such as --gltf"),
            ("--inlay", self.inlay.is_some(), self.threemf, "--3mf"),
            ("--bed", self.bed.is_some(), self.threemf, "--3mf"),
            ("--nozzle", self.nozzle.is_some(), self.threemf, "--3mf"),
        ])?;
        // A template may contain combinations that the option parser would reject.
        if self.texture.is_some() && self.texture_dpi.is_some() {
            bail!("--texture conflicts with --texture-dpi; remove one of them");
        }
        if let Some(count) = self.textures.filter(|count| !(1..=MAX_TEXTURES).contains(count)) {
            bail!("--textures: {count} is not between 1 and {MAX_TEXTURES}");
        }
        match (self.texture, self.texture_dpi) {
            (Some(px), _) if !SIDE_PX.contains(&px) => {
                bail!("--texture: {px} is not between {} and {}", SIDE_PX.start(), SIDE_PX.end())
            }
            (_, Some(dpi)) if !TEXTURE_DPI.contains(&dpi) => {
                let (least, most) = (TEXTURE_DPI.start(), TEXTURE_DPI.end());
                bail!("--texture-dpi: {dpi} is not between {least} and {most}")
            }
            _ => Ok(()),
        }
    }

    /// Returns the requested files, and a line about their texture to be printed after others; empty without a
    /// texture.
    pub fn files(
        &self,
        target: &Target,
        plate_mm: Option<f64>,
    ) -> anyhow::Result<(Vec<File>, String)> {
        let mut meshing = Meshing::default();
        meshing.plate_mm = plate_mm.unwrap_or(meshing.plate_mm);
        meshing.inlay_mm = length("inlay", &self.inlay)?.unwrap_or(meshing.inlay_mm);
        let (mut files, mut description) = match self.is_textured() {
            true => self.textured(target, meshing)?,
            false => (Vec::new(), String::new()),
        };
        if self.threemf {
            let bodies = InlaidBodies::new(target, meshing);
            let bodies = bodies.map_err(|error| refusal(&error, Some("--3mf")))?;
            description += &self.described(target, &bodies)?;
            files.push(bytes_file(format!("{}.3mf", target.name), threemf::to_bytes(&bodies)));
            if matches!(&target.spec, TargetSpec::Solid(spec) if spec.skeleton.is_some()) {
                let skeleton = make(&target.clone().into(), What::Skeleton3mf, Making::default());
                let skeleton = skeleton.context("--3mf")?.into_iter();
                files.extend(skeleton.map(|(name, bytes)| bytes_file(name, bytes)));
            }
        }
        Ok((files, description))
    }

    /// Describes a 3MF in one line, and warns if it may be too large or too fine for the printer.
    fn described(&self, target: &Target, bodies: &InlaidBodies) -> anyhow::Result<String> {
        let bed = bed_mm(self.bed.as_deref().unwrap_or("256x256"))?;
        let nozzle_mm = length("nozzle", &self.nozzle)?.unwrap_or(0.4);
        ensure!(nozzle_mm > 0.0, "--nozzle: the diameter must be greater than 0, such as 0.4mm");
        let (size, scale) = bodies.on_bed(bed);
        if scale < 1.0 {
            let edge = edge_of(target)
                .map_or(String::new(), |mm| format!("; --edge {}mm fits", (mm * scale).floor()));
            log!(
                "warning: --3mf: {:.1} × {:.1} mm do not fit on a bed of {} × {} mm (--bed){edge}",
                size.x,
                size.y,
                bed[0],
                bed[1]
            );
        }
        let cells = bodies.cell_mm.map_or(String::new(), |mm| format!(", cells of {mm:.2} mm"));
        if let Some(mm) = bodies.cell_mm.filter(|mm| *mm < nozzle_mm) {
            log!(
                "warning: --3mf: cells of tags are {mm:.2} mm wide, less than the nozzle (--nozzle {nozzle_mm}mm): use a longer \
                 --edge, or a family with fewer bits"
            );
        }
        Ok(format!("\n3mf: {:.1} × {:.1} × {:.1} mm{cells}", size.x, size.y, size.z))
    }

    /// Returns the requested textured files, and a line about the texture.
    fn textured(
        &self,
        target: &Target,
        mut meshing: Meshing,
    ) -> anyhow::Result<(Vec<File>, String)> {
        let option = match (self.texture, self.texture_dpi) {
            (Some(side), _) => {
                meshing.resolution = Resolution::Side(side);
                Some("--texture")
            }
            (None, Some(dpi)) => {
                meshing.resolution = Resolution::Dpi(dpi);
                Some("--texture-dpi")
            }
            (None, None) => None,
        };
        meshing.textures = self.textures.unwrap_or(meshing.textures);
        let mesh = TexturedMesh::new(target, meshing);
        let mesh = mesh.map_err(|error| refusal(&error, option))?;
        // Scenes share the files of the OBJ.
        let files: BTreeMap<String, Vec<u8>> =
            self.textured_formats().flat_map(|what| of_mesh(&mesh, what)).collect();
        let files = files.into_iter().map(|(name, bytes)| bytes_file(name, bytes)).collect();
        Ok((files, describe(&mesh)))
    }
}

/// Parses the width and depth of a bed, or the side of a square one, mm.
fn bed_mm(text: &str) -> anyhow::Result<[f64; 2]> {
    let (width, depth) = text.split_once(['x', '×']).unwrap_or((text, text));
    // A unit after the second length applies to both.
    let unit = depth.trim_start_matches(|c: char| !c.is_ascii_alphabetic());
    let has_unit = width.ends_with(|c: char| c.is_ascii_alphabetic());
    let width = if has_unit { width.to_owned() } else { format!("{width}{unit}") };
    let sides = [parse_length_mm(&width), parse_length_mm(depth)];
    match sides {
        [Ok(width), Ok(depth)] if width >= 1.0 && depth >= 1.0 => Ok([width, depth]),
        _ => {
            bail!("--bed: expected the width and depth of the bed, such as 256x256 (mm) or 10x10in")
        }
    }
}

/// Returns the length that the option `--edge` sets, mm.
fn edge_of(target: &Target) -> Option<f64> {
    match &target.spec {
        TargetSpec::Board(spec) => Some(spec.edge_mm),
        TargetSpec::Solid(spec) => Some(spec.edge_mm),
        TargetSpec::Charuco(spec) => Some(spec.square_mm),
        TargetSpec::AprilGrid(spec) => Some(spec.tag_mm),
        _ => None,
    }
}

/// Describes the textures of a mesh in one line.
fn describe(mesh: &TexturedMesh) -> String {
    let sizes = || mesh.textures.iter().map(|texture| texture.size_px);
    let [width, height] = [0, 1].map(|axis| sizes().map(|size| size[axis]).max().unwrap_or(0));
    let texels = mesh.texels_per_bit;
    let texels = texels.map_or(String::new(), |px| format!(", {px:.1} px per tag cell"));
    let textures = match mesh.textures.len() {
        1 => "texture:".to_owned(),
        count if sizes().all(|size| size == [width, height]) => format!("textures: {count} with"),
        count => format!("textures: {count} with up to"),
    };
    format!("\n{textures} {width} × {height} px{texels}")
}

/// Meshes of a plate with a board.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct PlateMeshes {
    #[command(flatten)]
    pub meshes: Meshes,
    /// Thickness of the plate under the board in a mesh [default: 3mm]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, help_heading = MESHES)]
    pub plate: Option<String>,
}

impl PlateMeshes {
    /// Whether any mesh is requested.
    pub fn is_any(&self) -> bool {
        self.meshes.is_any()
    }

    /// Rejects options of meshes that are not requested, and a thickness that differs from the distance between two
    /// sides.
    pub fn check_use(&self, two_sided_mm: Option<f64>) -> anyhow::Result<()> {
        if self.plate.is_some() && two_sided_mm.is_some() {
            bail!("--plate conflicts with --two-sided, which sets the thickness; remove it");
        }
        self.meshes.check_use(self.plate.as_deref())
    }

    /// Like [`Meshes::files`].
    pub fn files(&self, target: &Target) -> anyhow::Result<(Vec<File>, String)> {
        self.meshes.files(target, length("plate", &self.plate)?)
    }
}

/// Describes why there is no mesh, with the responsible option, or `option` if there is no other.
fn refusal(error: &MeshError, option: Option<&str>) -> anyhow::Error {
    let option = match error {
        MeshError::Thickness(_) => Some("--plate"),
        MeshError::TwoSides(_) => Some("--3mf"),
        MeshError::ThinInlay(_) | MeshError::DeepInlay { .. } => Some("--inlay"),
        MeshError::SeveralBoards(..) => Some("--boards"),
        MeshError::Textures { .. } => Some("--textures"),
        _ => option,
    };
    option.map_or_else(|| anyhow!("{error}"), |option| anyhow!("{option}: {error}"))
}
