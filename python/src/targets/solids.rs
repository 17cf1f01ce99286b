//! Solids.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use deltille::export::solid_mesh;
use deltille::family::Family;
use deltille::layout::{Finish, PaperSpec, SolidSheets, usual_solid_edge_mm};
use deltille::limits::Limits;
use deltille::targets::{
    ClosedMesh, NEAR_EQUILATERAL, Name, SkeletonSpec, SolidShape, SolidSpec, TagSpec, TagsIn,
    TargetSpec,
};
use pyo3::prelude::*;

use super::boards::{Tags, spacing_of};
use super::families::FamilyChoice;
use super::paper::{build, paper as paper_of, with_logo};
use super::target::Target;
use crate::boundary::arrays::whole;
use crate::boundary::errors::{self, Raise, RaiseFile, raised};

/// A shape, with the settings that apply to this shape only.
struct Shape {
    shape: SolidShape,
    name: String,
    square_family: Option<FamilyChoice>,
    first_square_id: Option<i64>,
}

impl From<SolidShape> for Shape {
    fn from(shape: SolidShape) -> Self {
        let name = shape.name().to_owned();
        Self { shape, name, square_family: None, first_square_id: None }
    }
}

impl Shape {
    /// Adds the tags of rectangular faces to those of the others, if there are both.
    fn with_squares(
        self,
        usual: Option<TagSpec>,
        family: Arc<Family>,
    ) -> PyResult<(Option<TagSpec>, Arc<Family>)> {
        let Some(usual) = usual else {
            let is_asked = self.square_family.is_some() || self.first_square_id.is_some();
            let unused = "square_family and first_square_id need a mesh with rectangular and other faces; use family and \
                          first_id instead";
            return if is_asked {
                Err(raised::TargetError::new_err(unused))
            } else {
                Ok((None, family))
            };
        };
        let choice = self.square_family;
        let choice = choice.unwrap_or_else(|| FamilyChoice::Name(PathBuf::from(&usual.family)));
        let (name, squares) = choice.resolve()?;
        let first_id = self.first_square_id;
        let first_id = first_id.map(|id| whole("first_square_id", id, errors::target));
        let first_id = first_id.transpose()?.unwrap_or(usual.first_id);
        let both = Family::clone(&family).with_squares(Family::clone(&squares));
        Ok((Some(TagSpec { family: name, first_id, ..usual }), Arc::new(both)))
    }
}

/// The settings of a solid.
struct Solids {
    shape: Shape,
    edge_mm: Option<f64>,
    tiles: Option<i64>,
    face_margin_mm: Option<f64>,
    tags: Option<Tags>,
    board_id: i64,
    inverted: bool,
    skeleton: Option<SkeletonSpec>,
}

impl Solids {
    fn make(self, name: Option<String>, paper: &PaperSpec) -> PyResult<Target> {
        let usual = SolidSpec::new(self.shape.shape.clone());
        let name = name.unwrap_or_else(|| self.shape.name.clone());
        let (tags, square_tags, family) = match self.tags {
            Some(tags) => {
                let (tags, family) = tags.spec(usual.shape.tag_tiling())?;
                let usual = usual.square_tags.clone();
                let (squares, family) = self.shape.with_squares(usual, family)?;
                (Some(tags), squares, Some(family))
            }
            None => (None, None, None),
        };
        let tiles = self.tiles.map(|tiles| whole("tiles", tiles, errors::target)).transpose()?;
        let mut spec = SolidSpec {
            tiles: tiles.unwrap_or(usual.tiles),
            board_id: whole("board_id", self.board_id, errors::target)?,
            tags,
            square_tags,
            inverted: self.inverted,
            skeleton: self.skeleton,
            ..usual
        };
        spec.edge_mm = self.edge_mm.unwrap_or_else(|| usual_solid_edge_mm(&spec, paper));
        spec.margin_mm = match self.face_margin_mm {
            Some(given) => given,
            None => spec.comfortable_margin_mm().raise(errors::target)?,
        };
        build(&name, &TargetSpec::Solid(spec), family, paper, Finish::default())
    }
}

/// Defines a class of solids from its name, its required arguments, its keywords with their defaults, and a block that makes
/// its shape. The common keywords of solids are added, also to the documentation.
macro_rules! solid {
    (
        $(#[$doc:meta])*
        $class:ident,
        ($($given:ident: $given_type:ty),*),
        ($($keyword:ident: $type:ty = $default:tt),* $(,)?),
        $shape:expr
    ) => {
        $(#[$doc])*
        /// edge_mm : float, optional
        ///     Edge of the solid, mm; defaults to 150 or, with ``paper``, to the largest whole number with which its net fits on
        ///     ``pages``. A cuboid or mesh is scaled so that its mean edge has this length; by default it is not scaled.
        /// tiles : int, optional
        ///     Black tiles along each side of a face; defaults to 10, or to 8 for squares.
        /// face_margin_mm : float, optional
        ///     Blank margin between the edges of a face and its tiles, mm.
        /// family : Family, str or path-like, optional
        ///     Family of the tags; defaults to delTag25h7, or to aprilTag36h11 for squares.
        /// tags : bool, optional
        ///     ``False`` makes untagged faces, which cannot be distinguished.
        /// tag_spacing, tag_border, hole_mm, first_id, board_id, inverted
        ///     See :class:`Board`. White tiles on black have a default margin of 8 mm.
        /// skeleton : bool, optional
        ///     Add a frame that holds the faces as panels.
        /// panel_thickness_mm, wall_mm, rib_mm : float, optional
        ///     Sizes of that frame, mm.
        /// per_face : bool, optional
        ///     Print each face on its own sheet instead of a net.
        /// allow_seams : bool, optional
        ///     Split a net larger than the paper across pages that are joined along seams through its tiles, instead of into
        ///     pieces of whole faces.
        /// pages : int, optional
        ///     Largest number of pages for the net. Without ``paper``, the smallest paper is selected for it; defaults to 1 if
        ///     that fits A0.
        /// tag_ids, guide_page, paper, orientation, margin_mm, note, logo, logo_height_mm, name
        ///     See :class:`Board`.
        ///
        /// Raises
        /// ------
        /// TargetError
        ///     If the settings are invalid or contradict each other.
        #[pyclass(frozen, extends = Target, module = "deltille")]
        pub struct $class;

        #[pymethods]
        impl $class {
            #[new]
            #[pyo3(signature = ($($given,)* *, $($keyword = $default,)* edge_mm = None, tiles = None,
                face_margin_mm = None, family = None, tags = true, tag_spacing = None, tag_border = None, hole_mm = None, first_id = 0,
                board_id = 0, inverted = false, skeleton = false, panel_thickness_mm = None, wall_mm = None, rib_mm = None, per_face = false,
                allow_seams = false, tag_ids = false, guide_page = false, paper = None, pages = None, orientation = "auto",
                margin_mm = None, note = None, logo = None, logo_height_mm = None, name = None))]
            #[expect(clippy::too_many_arguments, reason = "keywords")]
            fn new(
                $($given: $given_type,)*
                $($keyword: $type,)*
                edge_mm: Option<f64>,
                tiles: Option<i64>,
                face_margin_mm: Option<f64>,
                family: Option<FamilyChoice>,
                tags: bool,
                tag_spacing: Option<i64>,
                tag_border: Option<f64>,
                hole_mm: Option<f64>,
                first_id: i64,
                board_id: i64,
                inverted: bool,
                skeleton: bool,
                panel_thickness_mm: Option<f64>,
                wall_mm: Option<f64>,
                rib_mm: Option<f64>,
                per_face: bool,
                allow_seams: bool,
                tag_ids: bool,
                guide_page: bool,
                paper: Option<&str>,
                pages: Option<i64>,
                orientation: &str,
                margin_mm: Option<f64>,
                note: Option<String>,
                logo: Option<PathBuf>,
                logo_height_mm: Option<f64>,
                name: Option<String>,
            ) -> PyResult<PyClassInitializer<Self>> {
                let of_tags = Tags {
                    family,
                    tags_in: TagsIn::Black,
                    spacing: spacing_of(tag_spacing)?,
                    border_bits: tag_border,
                    hole_mm,
                    first_id: whole("first_id", first_id, errors::target)?,
                };
                let solids = Solids {
                    shape: Shape::from($shape),
                    edge_mm,
                    tiles,
                    face_margin_mm,
                    tags: tags.then_some(of_tags),
                    board_id,
                    inverted,
                    skeleton: frame(skeleton, [panel_thickness_mm, wall_mm, rib_mm])?,
                };
                let of_all =
                    paper_of(paper, orientation, margin_mm, sheets(per_face, allow_seams)?)?;
                let pages = pages.map(|pages| whole("pages", pages, errors::target)).transpose()?;
                let paper = PaperSpec { pages, note, tag_ids, guide_page, ..of_all };
                let paper = with_logo(paper, logo, logo_height_mm)?;
                Ok(PyClassInitializer::from(solids.make(name, &paper)?).add_subclass(Self))
            }
        }
    };
}

fn sheets(per_face: bool, allow_seams: bool) -> PyResult<SolidSheets> {
    match (per_face, allow_seams) {
        (false, false) => Ok(SolidSheets::Net),
        (false, true) => Ok(SolidSheets::SeamedNet),
        (true, false) => Ok(SolidSheets::PerFace),
        (true, true) => {
            Err(errors::argument("allow_seams and per_face are mutually exclusive".to_owned()))
        }
    }
}

/// Checks the settings of the skeleton; its sizes need `skeleton=True`.
fn frame(
    is_wanted: bool,
    [panel_thickness_mm, wall_mm, rib_mm]: [Option<f64>; 3],
) -> PyResult<Option<SkeletonSpec>> {
    if !is_wanted {
        let is_given = [panel_thickness_mm, wall_mm, rib_mm].iter().any(Option::is_some);
        let unused = "panel_thickness_mm, wall_mm and rib_mm need skeleton=True";
        return if is_given { Err(raised::TargetError::new_err(unused)) } else { Ok(None) };
    }
    let usual = SkeletonSpec::default();
    Ok(Some(SkeletonSpec {
        panel_thickness_mm: panel_thickness_mm.unwrap_or(usual.panel_thickness_mm),
        wall_mm: wall_mm.unwrap_or(usual.wall_mm),
        rib_mm,
    }))
}

solid! {
    /// A tetrahedron with tagged boards on its four faces.
    ///
    /// Parameters
    /// ----------
    Tetrahedron, (), (), SolidShape::Tetrahedron
}
solid! {
    /// An octahedron with tagged boards on its eight faces.
    ///
    /// Parameters
    /// ----------
    Octahedron, (), (), SolidShape::Octahedron
}
solid! {
    /// An icosahedron with tagged boards on its twenty faces.
    ///
    /// Parameters
    /// ----------
    Icosahedron, (), (), SolidShape::Icosahedron
}
solid! {
    /// A cube with tagged checkerboards on its six faces.
    ///
    /// Parameters
    /// ----------
    Cube, (), (), SolidShape::Cube
}
solid! {
    /// A cuboid with tagged checkerboards on its six faces.
    ///
    /// Parameters
    /// ----------
    /// size_mm : sequence of 3 float
    ///     Sides along x, y and z, mm.
    Cuboid, (size_mm: [f64; 3]), (), SolidShape::Cuboid(size_mm.into())
}
solid! {
    /// A solid from any closed mesh of flat, convex faces, with a board on each face: checkerboards on rectangles, and deltille
    /// tiles on most other faces. Triangles must be nearly equilateral.
    ///
    /// Parameters
    /// ----------
    /// mesh : path-like
    ///     An OBJ, STL or PLY file, in mm.
    /// scale : float, optional
    ///     Millimetres per unit of the mesh, such as 1000 for metres.
    /// allow_skew : bool, optional
    ///     Accept triangles that are far from equilateral, as long as a board fits.
    /// square_family : Family, str or path-like, optional
    ///     Family of the square tags, if the mesh has rectangular and other faces; defaults to aprilTag36h11.
    /// first_square_id : int, optional
    ///     Id of the first square tag.
    Solid,
    (mesh: PathBuf),
    (
        scale: f64 = 1.0,
        allow_skew: bool = false,
        square_family: Option<FamilyChoice> = None,
        first_square_id: Option<i64> = None,
    ),
    {
        let name = Name::like(&mesh.file_stem().unwrap_or_default().to_string_lossy()).to_string();
        let shape = SolidShape::Mesh(read_mesh(&mesh, scale, allow_skew)?);
        Shape { shape, name, square_family, first_square_id }
    }
}

fn read_mesh(path: &Path, scale: f64, allow_skew: bool) -> PyResult<ClosedMesh> {
    let text = Limits::default().read(path).raise_of_file(path, errors::file)?;
    let wrong = |what: String| raised::TargetError::new_err(format!("{}: {what}", path.display()));
    let (mesh, _) = solid_mesh::read(&text).map_err(|error| wrong(errors::one_line(&error)))?;
    let (face, deviation) = mesh.most_skewed();
    if deviation > NEAR_EQUILATERAL && !allow_skew {
        return Err(wrong(format!(
            "the edges of triangle {} deviate by {:.1} % from their mean (limit {:.0} %); use allow_skew=True to put \
             smaller boards on such faces",
            face + 1,
            100.0 * deviation,
            100.0 * NEAR_EQUILATERAL
        )));
    }
    let vertices: Vec<_> = mesh.vertices().iter().map(|&vertex| vertex * scale).collect();
    let scaled = ClosedMesh::new(&vertices, mesh.faces());
    scaled.map(|(mesh, _)| mesh).map_err(|error| wrong(errors::one_line(&error)))
}
