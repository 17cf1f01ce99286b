//! Boards on the faces of solids: the kind of board for each face, and the largest one that leaves a margin.
//!
//! A triangle has a triangle of deltille tiles. A rectangle has a checkerboard; its squares have one size on all
//! rectangles of a solid:
//!
//! ```text
//!      d──────────────────c
//!      │   ▪ ▫ ▪ ▫ ▪ ▫    │    x runs along the lower edge a–b, y upwards, z out of the face;
//!      │   ▫ ▪ ▫ ▪ ▫ ▪    │    the board lies in the middle, its sides along those of the face
//!      a──────────────────b
//! ```
//!
//! Any other face is filled with deltille tiles; their number along its shortest side is that of a
//! triangle. The corners are all those whose six tiles lie within the margin. A hexagon of tiles
//! fills a hexagon; two triangles of tiles fill a rhombus
//! of 60°.

use glam::{DMat3, DVec2, DVec3};

use crate::angles::direction;
use crate::lattice::{GridKind, ROW_HEIGHT, Vertex};
use crate::targets::boards::board::board_vertices;
use crate::targets::boards::tag_spec::MAX_ROWS;
use crate::targets::{Incircle, Outline, PanelPose, Polyhedron};

/// Cosine of the smallest angle of a rectangular face: angles may be 1° off. Along a side of 150
/// mm, 1° amounts to 2.6 mm, which the margin absorbs. On a face with other angles the board would
/// be much smaller than the face.
const RIGHT_COSINE: f64 = 0.017_452_4;

/// Fraction of a tile that may be missing before a row loses it: the effect of rounding.
const ROUNDING: f64 = 1e-6;

/// A face with its board.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Outline in the panel frame, mm, counterclockwise from the left end of the lower edge.
    pub outline_mm: Vec<DVec2>,
    /// Pose of the panel frame in the target frame.
    pub pose: PanelPose,
    /// Edge of a tile, mm.
    pub tile_edge_mm: f64,
    /// The board of the face.
    pub board: FaceBoard,
}

/// The board of a face: its tiles.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaceBoard {
    /// A triangle of deltille tiles.
    Triangle {
        /// Number of black tiles along each side.
        tiles: u32,
    },
    /// A checkerboard.
    Squares {
        /// Number of squares along the lower side of the face, and upwards.
        across: [u32; 2],
    },
    /// Deltille tiles that fill another shape.
    Filled {
        /// The corners, by row, then column; the smallest row and column are 0.
        corners: Vec<Vertex>,
    },
}

impl FaceBoard {
    /// Returns the tiling.
    pub fn kind(&self) -> GridKind {
        match self {
            Self::Triangle { .. } | Self::Filled { .. } => GridKind::Deltille,
            Self::Squares { .. } => GridKind::Checker,
        }
    }

    /// Returns the corners, by row, then column: the vertices that are surrounded by tiles.
    ///
    /// ```text
    ///            ▲               4 tiles a side: the vertices of the outline are not corners,
    ///           ▲ ▲              two remain in the lowest row, one above
    ///          ▲ · ▲
    ///         ▲ · · ▲
    /// ```
    pub fn corners(&self) -> Vec<Vertex> {
        match *self {
            Self::Triangle { tiles } => {
                let side = tiles as i32 - 2;
                let row = |row: i32| (0..side - row).map(move |col| Vertex::new(row, col));
                (0..side).flat_map(row).collect()
            }
            Self::Squares { across: [cols, rows] } => {
                board_vertices(GridKind::Checker, rows - 1, cols - 1)
            }
            Self::Filled { ref corners } => corners.clone(),
        }
    }

    /// Returns the tiles that are drawn around the corners.
    pub fn outline(&self) -> Outline {
        match self {
            Self::Triangle { .. } => Outline::Triangle,
            Self::Squares { .. } | Self::Filled { .. } => Outline::Touching,
        }
    }

    /// Returns the numbers of columns and rows that contain every corner.
    pub fn matrix(&self) -> [u32; 2] {
        match self {
            Self::Triangle { tiles } => [tiles - 2; 2],
            Self::Squares { across } => across.map(|tiles| tiles - 1),
            Self::Filled { corners } => {
                let most = |of: fn(&Vertex) -> i32| corners.iter().map(of).max().unwrap_or(-1);
                [most(|v| v.col), most(|v| v.row)].map(|most| (most + 1) as u32)
            }
        }
    }
}

impl Polyhedron {
    /// Returns a face with the largest board that leaves a margin. It has `tiles` tiles along each side of a
    /// triangle, or along the shortest side of all rectangles and of every other face. Returns `None` if the margin
    /// leaves no room.
    pub fn face(&self, face: usize, tiles: u32, margin_mm: f64) -> Option<Face> {
        self.face_with_squares(face, tiles, margin_mm, self.square_edge_mm(tiles, margin_mm))
    }

    /// Returns the tiling of a face: squares on rectangles.
    pub fn tiling(&self, face: usize) -> GridKind {
        match self.faces[face].len() == 4 && self.is_rectangle(face) {
            true => GridKind::Checker,
            false => GridKind::Deltille,
        }
    }

    fn is_rectangle(&self, face: usize) -> bool {
        let corners = self.corners_mm(face);
        (0..4).all(|i| {
            let [on, back] = [1, 3].map(|step| corners[(i + step) % 4] - corners[i]);
            on.normalize_or_zero().dot(back.normalize_or_zero()).abs() <= RIGHT_COSINE
        })
    }

    /// Returns the edge of the squares on all rectangular faces, mm, with `tiles` along the shortest side.
    pub(in crate::targets) fn square_edge_mm(&self, tiles: u32, margin_mm: f64) -> f64 {
        let rectangles =
            (0..self.faces.len()).filter(|&face| self.tiling(face) == GridKind::Checker);
        let sides = rectangles.map(|face| self.flat(face).room(margin_mm).1.min_element());
        sides.fold(f64::INFINITY, f64::min) / f64::from(tiles)
    }

    /// Like [`Self::face`], with squares of a known edge.
    pub(in crate::targets) fn face_with_squares(
        &self,
        face: usize,
        tiles: u32,
        margin_mm: f64,
        square_edge_mm: f64,
    ) -> Option<Face> {
        match self.tiling(face) {
            GridKind::Deltille if self.faces[face].len() == 3 => {
                self.triangular_face(face, tiles, margin_mm)
            }
            GridKind::Deltille => self.flat(face).filled(tiles, margin_mm),
            GridKind::Checker => self.flat(face).with_squares(margin_mm, square_edge_mm),
        }
    }

    /// The board is equilateral regardless of the face, and its lower side is parallel to that of the face. Its
    /// centre is the incentre of the face (inradius r). A vertex of the board of side S is then S/√3 away in
    /// direction d. It keeps the margin m from the edge with inward normal n if r + S/√3 d·n ≥ m.
    fn triangular_face(&self, face: usize, tiles: u32, margin_mm: f64) -> Option<Face> {
        let corners: [DVec3; 3] = self.corners_mm(face).try_into().ok()?;
        let [a, b, c] = corners;
        let lengths = [(c - b).length(), (a - c).length(), (b - a).length()];
        let around: f64 = lengths.iter().sum();
        let centre = (a * lengths[0] + b * lengths[1] + c * lengths[2]) / around;
        let normal = (b - a).cross(c - a);
        let inradius = normal.length() / around;
        let x = (b - a).normalize_or_zero();
        let z = normal.normalize_or_zero();
        let rotation = DMat3::from_cols(x, z.cross(x), z);
        let flat = |p: DVec3| (rotation.transpose() * (p - centre)).truncate();
        let outline = corners.map(flat);

        let normals =
            [0, 1, 2].map(|i| (outline[(i + 1) % 3] - outline[i]).perp().normalize_or_zero());
        let towards = [-150f64, -30.0, 90.0].map(|degrees| direction(degrees.to_radians()));
        let steepest = normals
            .iter()
            .flat_map(|n| towards.iter().map(move |d| -d.dot(*n)))
            .fold(0.0, f64::max);
        let side = 3f64.sqrt() * (inradius - margin_mm) / steepest;
        if !(side > 0.0 && side.is_finite()) {
            return None;
        }
        // The lower left end of the board is lattice vertex (−1,−1); the panel's origin is (0,0).
        let tile_edge_mm = side / f64::from(tiles);
        let origin = towards[0] * side / 3f64.sqrt() + DVec2::new(1.5, ROW_HEIGHT) * tile_edge_mm;
        let translation = centre + rotation * origin.extend(0.0);
        Some(Face {
            outline_mm: outline.map(|p| p - origin).to_vec(),
            pose: PanelPose::new(rotation, translation),
            tile_edge_mm,
            board: FaceBoard::Triangle { tiles },
        })
    }

    /// Returns a face in its plane.
    fn flat(&self, face: usize) -> Flat {
        let corners = self.corners_mm(face);
        let z = self.normal(face);
        let along = corners[1] - corners[0];
        let x = (along - z * along.dot(z)).normalize_or_zero();
        let rotation = DMat3::from_cols(x, z.cross(x), z);
        let origin = corners[0];
        let flat = |p: &DVec3| (rotation.transpose() * (p - origin)).truncate();
        Flat { outline: corners.iter().map(flat).collect(), rotation, origin }
    }
}

/// A face in its plane: x runs along its lower edge, from its first vertex.
struct Flat {
    outline: Vec<DVec2>,
    rotation: DMat3,
    /// First vertex in the target frame, mm.
    origin: DVec3,
}

impl Flat {
    /// Returns the centre and size of the largest rectangle within the margins of a nearly rectangular face. Its
    /// sides are parallel or perpendicular to the lower edge.
    fn room(&self, margin_mm: f64) -> (DVec2, DVec2) {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| self.outline[i]);
        let low = DVec2::new(a.x.max(d.x), a.y.max(b.y));
        let high = DVec2::new(b.x.min(c.x), c.y.min(d.y));
        ((low + high) / 2.0, high - low - 2.0 * margin_mm)
    }

    fn with_squares(self, margin_mm: f64, edge_mm: f64) -> Option<Face> {
        let (middle, room) = self.room(margin_mm);
        if !(edge_mm > 0.0 && edge_mm.is_finite()) {
            return None;
        }
        let across = (room / edge_mm + ROUNDING).floor();
        // The panel's origin is one square right of and above the board's lower left end.
        let origin = middle - across * edge_mm / 2.0 + edge_mm;
        let translation = self.origin + self.rotation * origin.extend(0.0);
        Some(Face {
            outline_mm: self.outline.iter().map(|p| p - origin).collect(),
            pose: PanelPose::new(self.rotation, translation),
            tile_edge_mm: edge_mm,
            board: FaceBoard::Squares { across: across.as_uvec2().to_array() },
        })
    }

    /// Positions the deltille lattice so that the number of corners is largest. Candidates for its
    /// origin are the first corner of the area inside the margin, which suits angles of 60° and
    /// 120°, and three positions that centre a vertex, an edge or a tile on the face.
    fn filled(self, tiles: u32, margin_mm: f64) -> Option<Face> {
        let corners: Vec<DVec3> = self.outline.iter().map(|p| p.extend(0.0)).collect();
        let circle = Incircle::of(&corners);
        if circle.radius <= margin_mm {
            return None;
        }
        let inner = circle.inset(&corners, margin_mm, 0.0);
        let inner: Vec<DVec2> = inner.into_iter().map(DVec3::truncate).collect();
        let lengths = inner.iter().zip(inner.iter().cycle().skip(1)).map(|(p, q)| p.distance(*q));
        let edge_mm = lengths.fold(f64::INFINITY, f64::min) / f64::from(tiles);
        let middle = circle.centre.truncate();
        let in_tile = DVec2::new(0.5, ROW_HEIGHT / 3.0) * edge_mm;
        let origins = [inner[0], middle, middle - DVec2::X * edge_mm / 2.0, middle - in_tile];
        let boards = origins.map(|origin| (origin, corners_within(&inner, origin, edge_mm)));
        let most = boards.iter().map(|(_, corners)| corners.len()).max()?;
        let (origin, corners) = boards.into_iter().find(|(_, corners)| corners.len() == most)?;
        let least =
            Vertex::new(corners.iter().map(|v| v.row).min()?, corners.iter().map(|v| v.col).min()?);
        let origin =
            origin + GridKind::Deltille.position(least.row.into(), least.col.into()) * edge_mm;
        let corners = corners.into_iter().map(|v| v - least).collect();
        let translation = self.origin + self.rotation * origin.extend(0.0);
        Some(Face {
            outline_mm: self.outline.iter().map(|p| p - origin).collect(),
            pose: PanelPose::new(self.rotation, translation),
            tile_edge_mm: edge_mm,
            board: FaceBoard::Filled { corners },
        })
    }
}

/// Returns the vertices of a deltille lattice whose six tiles lie in a convex polygon, by row, then column.
fn corners_within(polygon: &[DVec2], origin: DVec2, edge_mm: f64) -> Vec<Vertex> {
    let place =
        |v: Vertex| origin + GridKind::Deltille.position(v.row.into(), v.col.into()) * edge_mm;
    let is_inside = |p: DVec2| {
        let sides = polygon.iter().zip(polygon.iter().cycle().skip(1));
        sides
            .into_iter()
            .all(|(a, b)| (b - a).normalize_or_zero().perp_dot(p - a) >= -ROUNDING * edge_mm)
    };
    let from_origin = || polygon.iter().map(|p| (p - origin) / edge_mm);
    let span = |of: fn(DVec2) -> f64| {
        let [least, most] = from_origin()
            .map(of)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
        // A board may not have more; a larger request makes the whole board too large.
        let most = most.min(least + 2.0 * f64::from(MAX_ROWS));
        least.floor() as i32..=most.ceil() as i32
    };
    let rows = span(|p| p.y / ROW_HEIGHT);
    let cols = span(|p| p.x - p.y / ROW_HEIGHT / 2.0);
    let vertices = rows.flat_map(|row| cols.clone().map(move |col| Vertex::new(row, col)));
    let has_room =
        |&vertex: &Vertex| GridKind::Deltille.neighbours(vertex).all(|next| is_inside(place(next)));
    vertices.filter(has_room).collect()
}
