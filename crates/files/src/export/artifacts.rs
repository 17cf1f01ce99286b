//! All files of a target, in memory, and sets of files that are written completely or not at all.
//!
//! ```
//! use deltille_layout::Printing;
//! use deltille_core::targets::BoardSpec;
//! use deltille_files::export::artifacts::{Making, What, make};
//!
//! let board = Printing::new("desk", BoardSpec::deltille(4, 5, 20.0))?;
//! let files = make(&board, What::Svg, Making::default())?;
//! assert_eq!(files[0].0, "desk.svg");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::export::detections::dsc::{self, Dialect, DscError};
use crate::export::meshes::inlay::InlaidBodies;
use crate::export::meshes::mesh::{MeshError, Meshing, TexturedMesh};
use crate::export::meshes::{gltf, obj, scene, stl, threemf};
use crate::export::pages::{dxf, laser_svg, pdf, png, svg};
use crate::export::writing::atomic;
use crate::export::writing::kind::Kind;
use crate::export::writing::staging::Staging;
use crate::export::{laser_file_name, sheet_file_name};
use crate::limits::{Limits, ReadError};
use crate::target_file;
use deltille_core::setting::Setting::SolidSkeleton;
use deltille_core::targets::{
    Skeleton, SolidSpec, Target, TargetError, TargetIdentity, TargetSpec,
};
use deltille_layout::Printing;
use deltille_layout::artwork;
use deltille_layout::artwork::{ArtworkError, CuttingError};

/// Default resolution of PNG pages, dots per inch.
pub const DEFAULT_DPI: f64 = 300.0;

/// The kinds of files that can be made from a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum What {
    /// `<name>.json`, the description.
    Json,
    /// `<name>.pdf`.
    Pdf,
    /// `<name>.svg`, one for each page.
    Svg,
    /// `<name>.png`, one for each page.
    Png,
    /// `<name>.dsc`, the list of the reference detector or its fork.
    Dsc(Dialect),
    /// `<name>.glb` of a solid, or of a plate with a board.
    Gltf,
    /// `<name>.obj`, with its materials and textures.
    Obj,
    /// `<name>.sdf`, a model for Gazebo, with the files of [`What::Obj`].
    Sdf,
    /// `<name>.urdf`, likewise for ROS.
    Urdf,
    /// `<name>.xml`, likewise for MuJoCo; with several textures, one more OBJ file for each
    /// texture.
    Mjcf,
    /// `<name>.usda`, with its textures.
    Usd,
    /// `<name>.3mf`, two bodies, black inlaid into white, of a solid, or of a plate with a board.
    ThreeMf,
    /// `<name>.stl`, the bare solid.
    Stl,
    /// `<name>-skeleton.stl` of a solid that has one.
    Skeleton,
    /// `<name>-skeleton.3mf` likewise.
    Skeleton3mf,
    /// `<name>-panels.dxf`, outlines of a solid's panels to cut.
    Panels,
    /// `<name>-net.dxf`, the net of a solid to cut and fold.
    Net,
    /// `<name>-laser.dxf`, boards to engrave and plates to cut, all boards side by side.
    LaserDxf,
    /// `<name>-laser.svg` likewise.
    LaserSvg,
    /// `<name>.yaml`, Kalibr's target file of an AprilGrid.
    Kalibr,
}

/// An unknown name of a format.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown format `{0}` (known: {choice})", choice = What::choice())]
pub struct WhatError(String);

impl What {
    /// All kinds by name. Lists show only the first of several names.
    pub const NAMED: [(&str, Self); 24] = [
        ("json", Self::Json),
        ("pdf", Self::Pdf),
        ("svg", Self::Svg),
        ("png", Self::Png),
        ("dsc", Self::Dsc(Dialect::Fork)),
        ("dsc-fork", Self::Dsc(Dialect::Fork)),
        ("dsc-original", Self::Dsc(Dialect::Original)),
        ("gltf", Self::Gltf),
        ("glb", Self::Gltf),
        ("obj", Self::Obj),
        ("sdf", Self::Sdf),
        ("urdf", Self::Urdf),
        ("mjcf", Self::Mjcf),
        ("usd", Self::Usd),
        ("usda", Self::Usd),
        ("3mf", Self::ThreeMf),
        ("stl", Self::Stl),
        ("skeleton", Self::Skeleton),
        ("skeleton-3mf", Self::Skeleton3mf),
        ("panels", Self::Panels),
        ("net", Self::Net),
        ("laser-dxf", Self::LaserDxf),
        ("laser-svg", Self::LaserSvg),
        ("kalibr", Self::Kalibr),
    ];

    /// The kinds that have textures.
    pub const TEXTURED: [Self; 6] =
        [Self::Gltf, Self::Obj, Self::Sdf, Self::Urdf, Self::Mjcf, Self::Usd];

    fn choice() -> String {
        let mut named = Self::NAMED.to_vec();
        named.dedup_by_key(|(_, what)| *what);
        let names: Vec<&str> = named.iter().map(|(name, _)| *name).collect();
        let (last, before) = names.split_last().unwrap_or((&"", &[]));
        format!("{} or {last}", before.join(", "))
    }
}

impl FromStr for What {
    type Err = WhatError;

    fn from_str(text: &str) -> Result<Self, WhatError> {
        let found = Self::NAMED.iter().find(|(name, _)| *name == text);
        found.map(|(_, what)| *what).ok_or_else(|| WhatError(text.to_owned()))
    }
}

/// Settings for making files.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Making {
    /// Resolution of PNG pages, dots per inch.
    pub dpi: f64,
    /// Settings of meshes.
    pub mesh: Meshing,
    /// Width removed by the laser beam (kerf), mm.
    pub kerf_mm: f64,
}

impl Default for Making {
    fn default() -> Self {
        Self { dpi: DEFAULT_DPI, mesh: Meshing::default(), kerf_mm: 0.0 }
    }
}

/// Reason why a file of a target cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MakeError {
    /// It cannot be drawn.
    #[error(transparent)]
    Draw(#[from] ArtworkError),
    /// It has no layout on paper.
    #[error("{0} has no layout on paper, so there is no page to draw")]
    NoSheets(String),
    /// A page is too large for the format.
    #[error("a page cannot be drawn: {0}")]
    Page(io::Error),
    /// It cannot be written as a list of boards.
    #[error(transparent)]
    Dsc(#[from] DscError),
    /// It cannot be made as a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// It is not a solid.
    #[error("{0} is not a solid: only solids have a mesh")]
    NotSolid(String),
    /// It has no skeleton.
    #[error("{0} has no skeleton: set {SolidSkeleton}")]
    NoSkeleton(String),
    /// Its specification is not a valid target.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// Kalibr does not support it.
    #[error("Kalibr cannot read {0}: use an AprilGrid of aprilTag36h11 with a border of 2 bits")]
    NotKalibr(String),
    /// There is nothing to cut.
    #[error(transparent)]
    Cutting(#[from] CuttingError),
}

/// Names and contents of files in memory.
pub type Files = Vec<(String, Vec<u8>)>;

/// Makes the files of one kind for a target.
///
/// # Errors
/// Returns an error if the target has no files of this kind, or if the family of its tags is unknown.
// Inlined, so that a program that makes only some kinds does not contain the writers of the others.
#[inline(always)]
pub fn make(printing: &Printing, what: What, making: Making) -> Result<Files, MakeError> {
    let target = &printing.target;
    let name = &target.name;
    let named = |end: &str, bytes: Vec<u8>| vec![(format!("{name}{end}"), bytes)];
    Ok(match what {
        What::Json => named(".json", printing.to_json().into_bytes()),
        What::Pdf | What::Svg | What::Png => drawn(printing, what, making)?,
        What::Dsc(dialect) => named(".dsc", dsc::write(target, dialect)?.into_bytes()),
        What::Gltf | What::Obj | What::Sdf | What::Urdf | What::Mjcf | What::Usd => {
            of_mesh(&TexturedMesh::new(target, making.mesh)?, what)
        }
        What::ThreeMf => named(".3mf", threemf::to_bytes(&InlaidBodies::new(target, making.mesh)?)),
        What::Stl => {
            named(".stl", stl::to_bytes(name, &solid(target)?.polyhedron().triangles_mm()))
        }
        What::Skeleton => {
            vec![(stl::skeleton_name(name), stl::to_bytes(name, &skeleton(target)?.triangles_mm))]
        }
        What::Skeleton3mf => {
            let bytes = threemf::skeleton(target, &skeleton(target)?.triangles_mm);
            vec![(threemf::skeleton_name(name), bytes.map_err(MeshError::from)?)]
        }
        What::Panels => {
            named("-panels.dxf", dxf::text(&artwork::panels_to_cut(target)?).into_bytes())
        }
        What::Net => named("-net.dxf", dxf::text(&artwork::net_to_cut(printing)?).into_bytes()),
        What::LaserDxf => {
            let drawing = artwork::to_laser(printing, making.kerf_mm)?;
            vec![(laser_file_name(name, "dxf"), dxf::text(&drawing).into_bytes())]
        }
        What::LaserSvg => {
            let drawing = artwork::to_laser(printing, making.kerf_mm)?;
            let text = laser_svg::text(&drawing, name, &artwork::subject(target));
            vec![(laser_file_name(name, "svg"), text.into_bytes())]
        }
        What::Kalibr => {
            let yaml = match &target.spec {
                TargetSpec::AprilGrid(spec) => spec.to_kalibr_yaml(),
                _ => None,
            };
            let yaml = yaml.ok_or_else(|| MakeError::NotKalibr(name.to_string()))?;
            named(".yaml", yaml.into_bytes())
        }
    })
}

/// Returns the files of a mesh in one format: [`What::Gltf`], [`What::Obj`], or a model for a
/// simulator. Kinds that are not made from a mesh yield no files.
pub fn of_mesh(mesh: &TexturedMesh, what: What) -> Files {
    let (name, count) = (&mesh.name, mesh.textures.len());
    let named = |end: &str, text: String| (format!("{name}{end}"), text.into_bytes());
    let textures =
        (0..count).map(|i| (obj::texture_name(name, i, count), mesh.textures[i].png.clone()));
    let scene = match what {
        What::Gltf => return vec![(format!("{name}.glb"), gltf::to_bytes(mesh))],
        What::Usd => {
            return [named(".usda", scene::usda(mesh))].into_iter().chain(textures).collect();
        }
        What::Obj => None,
        What::Sdf => Some(named(".sdf", scene::sdf(name))),
        What::Urdf => Some(named(".urdf", scene::urdf(name))),
        What::Mjcf => Some(named(".xml", scene::mjcf(name, count))),
        _ => return Files::new(),
    };
    let parts = (0..count).filter(|_| what == What::Mjcf && count > 1);
    let parts = parts.map(|i| (obj::part_name(name, i), obj::part(mesh, i).into_bytes()));
    let of_obj = [named(".obj", obj::text(mesh)), named(".mtl", obj::material(mesh))];
    scene.into_iter().chain(parts).chain(of_obj).chain(textures).collect()
}

fn solid(target: &Target) -> Result<&SolidSpec, MakeError> {
    match &target.spec {
        TargetSpec::Solid(spec) => Ok(spec),
        _ => Err(MakeError::NotSolid(target.name.to_string())),
    }
}

/// The skeleton of a solid whose panels fit into it.
fn skeleton(target: &Target) -> Result<Skeleton, MakeError> {
    let spec = solid(target)?;
    let skeleton = spec.skeleton.as_ref();
    let skeleton = skeleton.ok_or_else(|| MakeError::NoSkeleton(target.name.to_string()))?;
    let skeleton = Skeleton::new(&spec.polyhedron(), skeleton)?;
    spec.panel_inset_mm()?;
    Ok(skeleton)
}

/// The pages of a target.
#[inline(always)]
fn drawn(printing: &Printing, what: What, making: Making) -> Result<Files, MakeError> {
    if printing.sheets.is_empty() {
        return Err(MakeError::NoSheets(printing.target.name.to_string()));
    }
    let artwork = printing.draw()?;
    let (name, count) = (&printing.target.name, artwork.sheets.len());
    let pages = 0..count;
    Ok(match what {
        What::Svg => pages
            .map(|page| {
                let text = svg::to_string(&artwork, page);
                (sheet_file_name(name, page, count, "svg"), text.into_bytes())
            })
            .collect(),
        What::Png => {
            let page = |page: usize| {
                let drawn = png::to_bytes(&artwork.sheets[page], &artwork.title, making.dpi);
                let drawn = drawn.map_err(MakeError::Page)?;
                Ok((sheet_file_name(name, page, count, "png"), drawn))
            };
            pages.map(page).collect::<Result<_, MakeError>>()?
        }
        _ => vec![(format!("{name}.pdf"), pdf::to_bytes(&artwork))],
    })
}

/// Error of writing a set of files.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SetError {
    /// The folder cannot be written to.
    #[error("cannot write to {}: {source}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] atomic::WriteError),
    /// The file that would be replaced cannot be read.
    #[error("cannot read {}, which would be replaced: {source}", path.display())]
    Unread {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: ReadError,
    },
    /// A file of another kind exists.
    #[error("{} contains {found}, which would be lost: choose another path, or set `overwrite`", path.display())]
    Taken {
        /// The file.
        path: PathBuf,
        /// The kind of the existing file.
        found: String,
    },
    /// The description of another board exists.
    #[error(
        "{} describes another board, {board}; without it, existing prints of that board cannot be used: choose another name \
         or folder to keep both, or set `overwrite`",
        path.display()
    )]
    Board {
        /// The description.
        path: PathBuf,
        /// The board.
        board: TargetIdentity,
    },
}

/// Writes a set of files into a folder, completely or not at all (see
/// [`crate::export::writing::staging`]), and returns their paths. An existing file of the same kind
/// is replaced. A file of another kind, and the description of another board, are replaced only
/// with `overwrite`.
///
/// # Errors
/// Returns an error if an existing file would be lost, or if the files cannot be written.
pub fn write_set(
    folder: &Path,
    files: &[(String, Vec<u8>)],
    overwrite: bool,
) -> Result<Vec<PathBuf>, SetError> {
    let at = |source: io::Error| SetError::Folder { folder: folder.to_owned(), source };
    for (name, bytes) in files {
        let path = folder.join(name);
        if overwrite || !path.is_file() {
            continue;
        }
        let there = Limits::default().read(&path);
        let there = there.map_err(|source| SetError::Unread { path: path.clone(), source })?;
        let found = Kind::of(&there);
        if !there.is_empty() && found != Kind::of(bytes) {
            return Err(SetError::Taken { path, found: found.to_string() });
        }
        if let Some(board) = target_file::lost_board(&path, bytes) {
            return Err(SetError::Board { path, board });
        }
    }
    let staging = Staging::new(folder).map_err(at)?;
    for (name, bytes) in files {
        atomic::write(&staging.files().join(name), |out| out.write_all(bytes))?;
    }
    staging.commit().map_err(at)?;
    Ok(files.iter().map(|(name, _)| folder.join(name)).collect())
}
