//! Options of all commands that make meshes, and the files of these.

#![allow(rustdoc::invalid_html_tags)] // The comments on options are the help of the program, too.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use anyhow::{Context, anyhow, bail};
use serde::{Deserialize, Serialize};

use super::option_checks::{is_false, length, refuse_idle};
use crate::deltille::files::written::{File, bytes_file};
use crate::values::{number, whole};
use deltille::export::artifacts::{Making, What, make, of_mesh};
use deltille::export::inlay::InlaidBodies;
use deltille::export::mesh::{MAX_TEXTURE_PX, MeshError, Meshing, Resolution, TexturedMesh};
use deltille::export::texture::MAX_TEXTURES;
use deltille::export::threemf;
use deltille::targets::{Target, TargetSpec};

/// Heading of these options.
const MESHES: &str = "Meshes and models for simulators";

/// Sides of a texture, px.
const SIDE_PX: RangeInclusive<u32> = 64..=MAX_TEXTURE_PX;

/// Resolution of a texture, dots per inch.
const TEXTURE_DPI: RangeInclusive<f64> = 1.0..=1e5;

/// Which meshes are written.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
#[command(next_help_heading = MESHES)]
pub struct Meshes {
    /// Write <name>.glb, the textured mesh as glTF 2.0 (metres); of a solid also where nothing else
    /// is asked for
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    gltf: bool,
    /// Write <name>.obj, <name>.mtl and <name>-texture.png (millimetres), of several textures
    /// <name>-texture-1.png and so on
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    obj: bool,
    /// Write <name>.sdf, a static model for Gazebo, with the files of --obj
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    sdf: bool,
    /// Write <name>.urdf, a link for ROS, with the files of --obj
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    urdf: bool,
    /// Write <name>.xml, a body for MuJoCo, with the files of --obj, and of several textures
    /// <name>-1.obj and so on
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    mjcf: bool,
    /// Write <name>.usda, for Isaac Sim, Omniverse or Blender, with its texture (metres)
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    usd: bool,
    /// Write <name>.3mf to print in two colours: two bodies, what is black inlaid into the white
    /// plate or solid (millimetres); of a solid with --skeleton that frame, too
    #[arg(long = "3mf")]
    #[serde(rename = "3mf", skip_serializing_if = "is_false")]
    threemf: bool,
    /// Depth of what is black in a 3MF, less than the plate is thick, or than where faces meet [default: 0.4mm]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    inlay: Option<String>,
    /// Longest side of the texture, px; at least 4 px are needed for a bit of a tag, of a
    /// checkerboard 12 [default: 20 px for a bit, or as many as 16384 px take]
    #[arg(long, value_name = "PX", allow_negative_numbers = true, value_parser = whole(SIDE_PX))]
    texture: Option<u32>,
    /// Share the faces among so many textures, each of the size that --texture says, so that they are
    /// sharper, or smaller where nothing is said of it [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
          value_parser = whole(1..=MAX_TEXTURES))]
    textures: Option<u32>,
    /// Resolution of the texture, dots per inch, instead of its size
    #[arg(long, value_name = "DPI", allow_negative_numbers = true, conflicts_with = "texture",
          value_parser = number(TEXTURE_DPI))]
    texture_dpi: Option<f64>,
}

impl Meshes {
    /// These, and those of a template, with what it says of them where these say nothing.
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
            // A texture has one size.
            texture: self.texture.or(template.texture.filter(|_| !is_sized)),
            texture_dpi: self.texture_dpi.or(template.texture_dpi.filter(|_| !is_sized)),
            textures: self.textures.or(template.textures),
        }
    }

    /// Whether any is asked for.
    pub fn is_any(&self) -> bool {
        self.is_textured() || self.threemf
    }

    /// Whether any with a texture is asked for.
    fn is_textured(&self) -> bool {
        self.textured_formats().next().is_some()
    }

    /// What is asked for that has textures.
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

    /// These, and the glTF.
    pub fn with_gltf(self) -> Self {
        Self { gltf: true, ..self }
    }

    /// Whether an OBJ is among the files.
    pub fn has_obj(&self) -> bool {
        self.obj || self.sdf || self.urdf || self.mjcf
    }

    /// Refuses options of a mesh that is not made.
    pub fn check_use(&self, plate: Option<&str>) -> anyhow::Result<()> {
        let (textured, any) = (self.is_textured(), self.is_any());
        refuse_idle(&[
            ("--texture", self.texture.is_some(), textured, "a mesh: add --gltf"),
            ("--textures", self.textures.is_some(), textured, "a mesh: add --gltf"),
            ("--texture-dpi", self.texture_dpi.is_some(), textured, "a mesh: add --gltf"),
            ("--plate", plate.is_some(), any, "a mesh: add --gltf"),
            ("--inlay", self.inlay.is_some(), self.threemf, "two bodies: add --3mf"),
        ])?;
        // A template says what the parser of options would refuse.
        if self.texture.is_some() && self.texture_dpi.is_some() {
            bail!("--texture, --texture-dpi: give one of them");
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

    /// The files that are asked for, and a line on their texture to be told after others; empty where there is none.
    pub fn files(
        &self,
        target: &Target,
        plate_mm: Option<f64>,
    ) -> anyhow::Result<(Vec<File>, String)> {
        let mut meshing = Meshing::default();
        meshing.plate_mm = plate_mm.unwrap_or(meshing.plate_mm);
        meshing.inlay_mm = length("inlay", &self.inlay)?.unwrap_or(meshing.inlay_mm);
        let (mut files, told) = match self.is_textured() {
            true => self.textured(target, meshing)?,
            false => (Vec::new(), String::new()),
        };
        if self.threemf {
            let bodies = InlaidBodies::new(target, meshing);
            let bodies = bodies.map_err(|error| refusal(&error, Some("--3mf")))?;
            files.push(bytes_file(format!("{}.3mf", target.name), threemf::to_bytes(&bodies)));
            if matches!(&target.spec, TargetSpec::Solid(spec) if spec.skeleton.is_some()) {
                let skeleton = make(&target.clone().into(), What::Skeleton3mf, Making::default());
                let skeleton = skeleton.context("--3mf")?.into_iter();
                files.extend(skeleton.map(|(name, bytes)| bytes_file(name, bytes)));
            }
        }
        Ok((files, told))
    }

    /// The files with a texture that are asked for, and a line on it.
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
        // Scenes have the files of the OBJ in common.
        let files: BTreeMap<String, Vec<u8>> =
            self.textured_formats().flat_map(|what| of_mesh(&mesh, what)).collect();
        let files = files.into_iter().map(|(name, bytes)| bytes_file(name, bytes)).collect();
        Ok((files, told(&mesh)))
    }
}

/// A line on the textures of a mesh.
fn told(mesh: &TexturedMesh) -> String {
    let sizes = || mesh.textures.iter().map(|texture| texture.size_px);
    let [width, height] = [0, 1].map(|axis| sizes().map(|size| size[axis]).max().unwrap_or(0));
    let texels = mesh.texels_per_bit;
    let texels = texels.map_or(String::new(), |px| format!(", {px:.1} px for a bit of a tag"));
    let textures = match mesh.textures.len() {
        1 => "texture:".to_owned(),
        count if sizes().all(|size| size == [width, height]) => format!("textures: {count} of"),
        count => format!("textures: {count} of up to"),
    };
    format!("\n{textures} {width} × {height} px{texels}")
}

/// Meshes of a plate with a board.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct PlateMeshes {
    #[command(flatten)]
    pub meshes: Meshes,
    /// Thickness of the plate that carries the board in a mesh [default: 3mm]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, help_heading = MESHES)]
    pub plate: Option<String>,
}

impl PlateMeshes {
    /// Whether any is asked for.
    pub fn is_any(&self) -> bool {
        self.meshes.is_any()
    }

    /// Refuses options of a mesh that is not made, and another thickness than that between two sides.
    pub fn check_use(&self, two_sided_mm: Option<f64>) -> anyhow::Result<()> {
        if self.plate.is_some() && two_sided_mm.is_some() {
            bail!("--plate: the plate is as thick as --two-sided says: leave it out");
        }
        self.meshes.check_use(self.plate.as_deref())
    }

    /// As [`Meshes::files`].
    pub fn files(&self, target: &Target) -> anyhow::Result<(Vec<File>, String)> {
        self.meshes.files(target, length("plate", &self.plate)?)
    }
}

/// Why there is no mesh, with the option that is at fault; where no other is, that is `option`.
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
