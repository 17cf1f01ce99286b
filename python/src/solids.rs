//! Solids from what is asked for.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use deltille::export::solid_mesh;
use deltille::family::Family;
use deltille::limits::Limits;
use deltille::targets::{
    self, ClosedMesh, NEAR_EQUILATERAL, Name, PaperSpec, SkeletonSpec, SolidShape, SolidSheets,
    SolidSpec, TagsIn, TargetSpec,
};
use pyo3::prelude::*;

use crate::arrays::whole;
use crate::boards::{Tags, paper as paper_of, spacing_of, with_logo};
use crate::errors::{self, Raise, RaiseFile, raised};
use crate::families::FamilyChoice;
use crate::targets::Target;

/// A solid as it is asked for.
struct Solids {
    shape: SolidShape,
    edge_mm: Option<f64>,
    tiles: Option<u32>,
    face_margin_mm: Option<f64>,
    tags: Tags,
    board_id: u32,
    skeleton: Option<SkeletonSpec>,
    name: Option<String>,
    paper: PaperSpec,
}

impl Solids {
    fn make(self) -> PyResult<Target> {
        let usual = SolidSpec::new(self.shape.clone());
        let (tags, family) = self.tags.spec(usual.shape.tag_tiling())?;
        let family = match &usual.square_tags {
            Some(tags) => {
                let squares = Family::shipped(&tags.family).raise(errors::family)?;
                Arc::new(Family::clone(&family).with_squares(squares))
            }
            None => family,
        };
        let mut spec = SolidSpec {
            edge_mm: self.edge_mm.unwrap_or(usual.edge_mm),
            tiles: self.tiles.unwrap_or(usual.tiles),
            board_id: self.board_id,
            tags,
            skeleton: self.skeleton,
            ..usual
        };
        spec.margin_mm = match self.face_margin_mm {
            Some(given) => given,
            None => spec.comfortable_margin_mm().raise(errors::target)?,
        };
        let name = self.name.unwrap_or_else(|| spec.shape.name().to_owned());
        let spec = TargetSpec::Solid(spec);
        let target = targets::Target::build(&name, &spec, Some(&family), Some(&self.paper));
        Ok(Target { target: Arc::new(target.raise(errors::target)?), family: Some(family) })
    }
}

/// What all solids are asked for, as a function of a Python class.
macro_rules! solid {
    ($class:ident, $shape:expr, $doc:literal) => {
        #[doc = $doc]
        ///
        /// Parameters
        /// ----------
        /// edge_mm : float, optional
        ///     Edge of the solid, mm; 150 if left out.
        /// tiles : int, optional
        ///     Black tiles along each side of a face; 10 if left out, squares of a cube 8.
        /// face_margin_mm : float, optional
        ///     Blank between a face's edges and its tiles, mm.
        /// family : Family, str or path-like, optional
        ///     Family of the tags; delTag25h7 if left out, of a cube aprilTag36h11.
        /// tag_spacing, tag_border, first_id, board_id
        ///     As of :class:`Board`.
        /// skeleton : bool, optional
        ///     Whether it has a frame that holds its faces as panels.
        /// panel_thickness_mm, wall_mm, rib_mm : float, optional
        ///     Sizes of that frame, mm.
        /// per_face : bool, optional
        ///     Whether each face is printed on a sheet of its own instead of a net.
        /// allow_seams : bool, optional
        ///     Whether a net that is larger than the paper stays in one piece, over pages that are joined along seams \
        ///     through its tiles, instead of in pieces of whole faces.
        /// paper, orientation, margin_mm, tag_ids, guide_page, logo, logo_height_mm, name
        ///     As of :class:`Board`.
        #[pyclass(frozen, extends = Target, module = "deltille")]
        pub struct $class;

        #[pymethods]
        impl $class {
            #[new]
            #[pyo3(signature = (*, edge_mm = None, tiles = None, face_margin_mm = None, family = None,
                tag_spacing = None, tag_border = None, first_id = 0, board_id = 0, skeleton = false,
                panel_thickness_mm = None, wall_mm = None, rib_mm = None, per_face = false, allow_seams = false,
                tag_ids = false, guide_page = false, logo = None, logo_height_mm = None, paper = None,
                orientation = "auto", margin_mm = None, name = None))]
            #[expect(clippy::too_many_arguments, reason = "keywords")]
            fn new(
                edge_mm: Option<f64>,
                tiles: Option<i64>,
                face_margin_mm: Option<f64>,
                family: Option<FamilyChoice>,
                tag_spacing: Option<i64>,
                tag_border: Option<f64>,
                first_id: i64,
                board_id: i64,
                skeleton: bool,
                panel_thickness_mm: Option<f64>,
                wall_mm: Option<f64>,
                rib_mm: Option<f64>,
                per_face: bool,
                allow_seams: bool,
                tag_ids: bool,
                guide_page: bool,
                logo: Option<PathBuf>,
                logo_height_mm: Option<f64>,
                paper: Option<&str>,
                orientation: &str,
                margin_mm: Option<f64>,
                name: Option<String>,
            ) -> PyResult<PyClassInitializer<Self>> {
                let sizes = [panel_thickness_mm, wall_mm, rib_mm];
                let solids = Solids {
                    shape: $shape,
                    edge_mm,
                    tiles: tiles.map(|tiles| whole("tiles", tiles, errors::target)).transpose()?,
                    face_margin_mm,
                    tags: tags_of(family, tag_spacing, tag_border, first_id)?,
                    board_id: whole("board_id", board_id, errors::target)?,
                    skeleton: frame(skeleton, sizes)?,
                    name,
                    paper: {
                        let solids = sheets(per_face, allow_seams)?;
                        let paper = paper_of(paper, orientation, margin_mm, solids)?;
                        let paper = PaperSpec { tag_ids, guide_page, ..paper };
                        with_logo(paper, logo, logo_height_mm)?
                    },
                };
                Ok(PyClassInitializer::from(solids.make()?).add_subclass(Self))
            }
        }
    };
}

fn tags_of(
    family: Option<FamilyChoice>,
    tag_spacing: Option<i64>,
    border_bits: Option<f64>,
    first_id: i64,
) -> PyResult<Tags> {
    let spacing = spacing_of(tag_spacing)?;
    let first_id = whole("first_id", first_id, errors::target)?;
    Ok(Tags { family, tags_in: TagsIn::Black, spacing, border_bits, first_id })
}

fn sheets(per_face: bool, allow_seams: bool) -> PyResult<SolidSheets> {
    match (per_face, allow_seams) {
        (false, false) => Ok(SolidSheets::Net),
        (false, true) => Ok(SolidSheets::SeamedNet),
        (true, false) => Ok(SolidSheets::PerFace),
        (true, true) => Err(errors::argument(
            "allow_seams: single faces have no seams: leave per_face out".to_owned(),
        )),
    }
}

/// The skeleton that is asked for; its sizes say nothing without it.
fn frame(
    is_wanted: bool,
    [panel_thickness_mm, wall_mm, rib_mm]: [Option<f64>; 3],
) -> PyResult<Option<SkeletonSpec>> {
    if !is_wanted {
        let is_said = [panel_thickness_mm, wall_mm, rib_mm].iter().any(Option::is_some);
        let unused = "panel_thickness_mm, wall_mm and rib_mm say nothing without skeleton=True";
        return if is_said { Err(raised::TargetError::new_err(unused)) } else { Ok(None) };
    }
    let usual = SkeletonSpec::default();
    Ok(Some(SkeletonSpec {
        panel_thickness_mm: panel_thickness_mm.unwrap_or(usual.panel_thickness_mm),
        wall_mm: wall_mm.unwrap_or(usual.wall_mm),
        rib_mm,
    }))
}

solid!(Tetrahedron, SolidShape::Tetrahedron, "A tetrahedron whose four faces carry tagged boards.");
solid!(Octahedron, SolidShape::Octahedron, "An octahedron whose eight faces carry tagged boards.");
solid!(
    Icosahedron,
    SolidShape::Icosahedron,
    "An icosahedron whose twenty faces carry tagged boards."
);

solid!(Cube, SolidShape::Cube, "A cube whose six faces carry tagged checkerboards.");

/// A solid of any closed mesh of flat, convex faces, with a board on each: deltille tiles on triangles, which must be
/// nearly equilateral, and on most others, checkerboards on rectangles.
///
/// Parameters
/// ----------
/// mesh : path-like
///     An OBJ, STL or PLY file, in mm.
/// scale : float, optional
///     Millimetres per unit of the mesh, such as 1000 for metres.
/// allow_skew : bool, optional
///     Whether faces that are far from equilateral are taken, as long as a board fits.
/// edge_mm : float, optional
///     Mean edge to which the mesh is scaled, mm; as it is if left out.
/// tiles, face_margin_mm, family, tag_spacing, tag_border, first_id, board_id, skeleton, panel_thickness_mm, wall_mm, \
/// rib_mm, per_face, allow_seams, tag_ids, guide_page, logo, logo_height_mm, paper, orientation, margin_mm, name
///     As of :class:`Icosahedron`.
#[pyclass(frozen, extends = Target, module = "deltille")]
pub struct Solid;

#[pymethods]
impl Solid {
    #[new]
    #[pyo3(signature = (mesh, *, scale = 1.0, allow_skew = false, edge_mm = None, tiles = None,
        face_margin_mm = None, family = None, tag_spacing = None, tag_border = None, first_id = 0, board_id = 0,
        skeleton = false, panel_thickness_mm = None, wall_mm = None, rib_mm = None, per_face = false, allow_seams = false,
        tag_ids = false, guide_page = false, logo = None, logo_height_mm = None, paper = None,
        orientation = "auto", margin_mm = None, name = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn new(
        mesh: PathBuf,
        scale: f64,
        allow_skew: bool,
        edge_mm: Option<f64>,
        tiles: Option<i64>,
        face_margin_mm: Option<f64>,
        family: Option<FamilyChoice>,
        tag_spacing: Option<i64>,
        tag_border: Option<f64>,
        first_id: i64,
        board_id: i64,
        skeleton: bool,
        panel_thickness_mm: Option<f64>,
        wall_mm: Option<f64>,
        rib_mm: Option<f64>,
        per_face: bool,
        allow_seams: bool,
        tag_ids: bool,
        guide_page: bool,
        logo: Option<PathBuf>,
        logo_height_mm: Option<f64>,
        paper: Option<&str>,
        orientation: &str,
        margin_mm: Option<f64>,
        name: Option<String>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let stem = Name::like(&mesh.file_stem().unwrap_or_default().to_string_lossy()).to_string();
        let sizes = [panel_thickness_mm, wall_mm, rib_mm];
        let solids = Solids {
            shape: SolidShape::Mesh(read_mesh(&mesh, scale, allow_skew)?),
            edge_mm,
            tiles: tiles.map(|tiles| whole("tiles", tiles, errors::target)).transpose()?,
            face_margin_mm,
            tags: tags_of(family, tag_spacing, tag_border, first_id)?,
            board_id: whole("board_id", board_id, errors::target)?,
            skeleton: frame(skeleton, sizes)?,
            name: Some(name.unwrap_or(stem)),
            paper: {
                let solids = sheets(per_face, allow_seams)?;
                let paper = paper_of(paper, orientation, margin_mm, solids)?;
                let paper = PaperSpec { tag_ids, guide_page, ..paper };
                with_logo(paper, logo, logo_height_mm)?
            },
        };
        Ok(PyClassInitializer::from(solids.make()?).add_subclass(Self))
    }
}

fn read_mesh(path: &Path, scale: f64, allow_skew: bool) -> PyResult<ClosedMesh> {
    let text = Limits::default().read(path).raise_of_file(path, errors::file)?;
    let wrong = |what: String| raised::TargetError::new_err(format!("{}: {what}", path.display()));
    let (mesh, _) = solid_mesh::read(&text).map_err(|error| wrong(errors::told(&error)))?;
    let (face, deviation) = mesh.most_skewed();
    if deviation > NEAR_EQUILATERAL && !allow_skew {
        return Err(wrong(format!(
            "edges of triangle {} deviate by {:.1} % from their mean, more than {:.0} %: give allow_skew=True to put \
             smaller boards on such faces",
            face + 1,
            100.0 * deviation,
            100.0 * NEAR_EQUILATERAL
        )));
    }
    let vertices: Vec<_> = mesh.vertices().iter().map(|&vertex| vertex * scale).collect();
    let scaled = ClosedMesh::new(&vertices, mesh.faces());
    scaled.map(|(mesh, _)| mesh).map_err(|error| wrong(errors::told(&error)))
}
