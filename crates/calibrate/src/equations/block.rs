//! Normal equations of one block: one panel in one image.

use std::collections::BTreeSet;

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{DMatrix, DMatrixView, DVector, Matrix3, Vector3};

use super::layout::Layout;
use crate::input::loss::Loss;
use crate::problem::bundle::Problem;
use crate::problem::shape;
use crate::problem::unknowns::{Block, CameraUnknowns};
use crate::problem::whitening::Whitening;
use deltille_core::camera::{
    Lens, MAX_PARAMETERS, MAX_TOUCHED, PROJECTION_PARAMETERS, Pose, Projection,
};

/// Largest number of columns that a corner depends on: parameters and pose of a camera, poses of a panel, a target and
/// a frame, and a shape.
const LONGEST_ROW: usize = MAX_OF_LENS + 24 + shape::COUNT;

/// Largest number of camera parameters that a corner depends on.
const MAX_OF_LENS: usize = if MAX_PARAMETERS > MAX_TOUCHED { MAX_PARAMETERS } else { MAX_TOUCHED };

/// The columns of a block seen by a camera with a spline lens, and the columns that each of its
/// corners depends on.
struct Support {
    /// The column of each parameter of the lens; `None` if it is known.
    columns: Vec<Option<usize>>,
    /// The columns of the lens on which any corner depends, ascending.
    touched: Vec<usize>,
}

impl Support {
    /// `None` for lenses other than splines, or if all parameters are known.
    fn of(free: &[(usize, usize)], seen: &[Projection], parameters: usize) -> Option<Self> {
        seen.first()?.knots?;
        let mut columns = vec![None; parameters - PROJECTION_PARAMETERS.len()];
        for &(parameter, column) in free {
            columns[parameter - PROJECTION_PARAMETERS.len()] = Some(column);
        }
        let knots = seen.iter().filter_map(|at| at.knots);
        let knots: BTreeSet<usize> =
            knots.flat_map(|knots| knots.iter().map(|(knot, _)| knot)).collect();
        let of_knots = knots.iter().flat_map(|&knot| [columns[2 * knot], columns[2 * knot + 1]]);
        let touched = of_knots.flatten().collect();
        Some(Self { columns, touched })
    }

    /// The knots of a point: whether dx and dy are unknown, and the weight.
    fn knots(&self, at: &Projection) -> impl Iterator<Item = (usize, usize, f64)> {
        let knots = at.knots.into_iter().flat_map(|knots| knots.iter());
        knots.flat_map(move |(knot, part)| {
            [0, 1].into_iter().filter_map(move |axis| {
                self.columns[2 * knot + axis].map(|column| (column, axis, part))
            })
        })
    }

    /// The columns of a block of n columns that a point depends on.
    fn places(&self, at: &Projection, n: usize, places: &mut Vec<usize>) {
        places.clear();
        let of_knots =
            self.knots(at).map(|(column, ..)| self.touched.partition_point(|&c| c < column));
        places.extend(of_knots);
        places.extend(self.touched.len()..n);
    }

    /// The derivatives of a coordinate with respect to the knots.
    fn derivatives(&self, at: &Projection, coordinate: usize, push: &mut impl FnMut(f64)) {
        for (_, axis, part) in self.knots(at) {
            push(if axis == coordinate { at.by_image(axis) * part } else { 0.0 });
        }
    }
}

/// The normal equations of one block, in the columns that it touches.
pub(crate) struct Local {
    pub cost: f64,
    /// Shared columns; the columns of the frame's pose follow.
    pub columns: Vec<usize>,
    /// Rows of the lower triangle, one after the other.
    matrix: Vec<f64>,
    pub right: Vec<f64>,
    /// The corners, if they are unknown.
    corners: Vec<OfCorner>,
    /// For each of them, the product with each column of the block.
    cross: Vec<[f64; 3]>,
}

/// The contribution of a corner in a block to the equations of its own offset.
pub(crate) struct OfCorner {
    /// Its index in the map.
    pub index: usize,
    pub own: Matrix3<f64>,
    pub right: Vector3<f64>,
}

/// The motion of the corners of a panel to a coordinate frame along the chain to the camera.
struct Motion {
    rotation: DMat3,
    translation: DVec3,
    /// The translation of the last link.
    last: DVec3,
}

impl Motion {
    fn of(whole: &Pose, last: &Pose) -> Self {
        let (rotation, translation) = (DMat3::from_quat(whole.rotation), whole.translation);
        Self { rotation, translation, last: last.translation }
    }

    fn apply(&self, at: DVec3) -> DVec3 {
        self.rotation * at + self.translation
    }

    /// Passes the derivatives with respect to the pose of the last link to `push`, from that with respect to the
    /// position on the panel: for y = exp(ω) a + t + τ, a derivative j with respect to y becomes a × j for ω, and j for
    /// τ.
    fn derivatives(&self, at: DVec3, by_place: DVec3, push: &mut impl FnMut(f64)) {
        let arm = self.rotation * at + (self.translation - self.last);
        let by = self.rotation * by_place;
        arm.cross(by).to_array().into_iter().chain(by.to_array()).for_each(push);
    }
}

/// The coordinate frames between the panel of a block and its camera, and the unknown links between them.
struct Chain<'a> {
    camera: &'a CameraUnknowns,
    to_target: Motion,
    to_scene: Motion,
    to_rig: Motion,
    to_camera: Motion,
    /// First columns of the unknown pose of the camera, of the panel, of the target, and of the shape.
    of_camera: Option<usize>,
    of_panel: Option<usize>,
    of_target: Option<usize>,
    of_shape: Option<usize>,
}

impl<'a> Chain<'a> {
    fn of(problem: &'a Problem, layout: &Layout, block: &Block) -> Self {
        let camera = &problem.cameras[block.camera];
        let (rig, panel) = (&problem.frames[block.frame], &problem.panels[block.panel.index()]);
        let target = &problem.targets[panel.target].scene_from_target;
        let scene_from_panel = target.after(&panel.target_from_panel);
        let rig_from_panel = rig.after(&scene_from_panel);
        let camera_from_panel = camera.camera_from_rig.after(&rig_from_panel);
        Self {
            camera,
            to_target: Motion::of(&panel.target_from_panel, &panel.target_from_panel),
            to_scene: Motion::of(&scene_from_panel, target),
            to_rig: Motion::of(&rig_from_panel, rig),
            to_camera: Motion::of(&camera_from_panel, &camera.camera_from_rig),
            of_camera: layout.cameras[block.camera],
            of_panel: layout.panels[block.panel.index()],
            of_target: layout.targets[panel.target],
            of_shape: layout.shape,
        }
    }

    /// The columns of the unknown links and of the shape.
    fn columns(&self) -> impl Iterator<Item = usize> + use<> {
        let poses = self.of_camera.into_iter().chain(self.of_panel).chain(self.of_target);
        let poses = poses.flat_map(|first| first..first + 6);
        poses.chain(self.of_shape.into_iter().flat_map(|first| first..first + shape::COUNT))
    }

    /// The pixel of a corner at a position on its panel; `None` if the camera cannot image it.
    fn project(&self, at: DVec3, found: &mut Projection) -> Option<()> {
        self.camera.camera.project_into(self.to_camera.apply(at), found)
    }

    /// Passes the derivatives of a coordinate with respect to the unknown links, the shape (which `bends` the corner
    /// along these directions) and the frame's pose to `push`, for a position on the panel. `by_place` is the
    /// derivative with respect to this position.
    fn derivatives(
        &self,
        at: DVec3,
        by_place: DVec3,
        bends: Option<&[DVec3; shape::COUNT]>,
        push: &mut impl FnMut(f64),
    ) {
        self.of_camera.iter().for_each(|_| self.to_camera.derivatives(at, by_place, push));
        self.of_panel.iter().for_each(|_| self.to_target.derivatives(at, by_place, push));
        self.of_target.iter().for_each(|_| self.to_scene.derivatives(at, by_place, push));
        bends.into_iter().flatten().for_each(|&bend| push(by_place.dot(bend)));
        self.to_rig.derivatives(at, by_place, push);
    }
}

/// The unknowns that a block depends on.
struct Unknowns<'a> {
    chain: Chain<'a>,
    /// The unknown parameters of the camera, with their columns.
    free: &'a [(usize, usize)],
    /// The first of these columns, and their number.
    first: usize,
    own: usize,
    /// Of a spline, the columns of each corner, instead of the former.
    support: Option<Support>,
}

impl<'a> Unknowns<'a> {
    /// `None` if a camera with a spline lens cannot image all corners.
    fn of(problem: &'a Problem, layout: &'a Layout, block: &Block) -> Option<Self> {
        let chain = Chain::of(problem, layout, block);
        let free = &layout.parameters[block.camera];
        let camera = &chain.camera.camera;
        let support = match camera.lens {
            Lens::Spline(_) if !free.is_empty() => {
                let points = problem.camera_points(block);
                let seen = points.map(|at| camera.project_with_derivatives(at));
                let seen = seen.collect::<Option<Vec<Projection>>>()?;
                Support::of(free, &seen, chain.camera.free.len())
            }
            _ => None,
        };
        let columns = || free.iter().map(|&(_, column)| column);
        let first = columns().min().unwrap_or(0);
        let own = columns().max().map_or(0, |last| last + 1 - first);
        Some(Self { chain, free, first, own, support })
    }

    /// The shared columns of the block.
    fn columns(&self) -> Vec<usize> {
        let poses = self.chain.columns();
        match &self.support {
            Some(support) => support.touched.iter().copied().chain(poses).collect(),
            None => (self.first..self.first + self.own).chain(poses).collect(),
        }
    }

    /// Sets a row to the derivatives of a coordinate of a corner with respect to its columns and to the frame's pose.
    /// `place` is the position on the panel, `by_place` the derivative with respect to it, and `bends` are the directions
    /// in which the shape bends the corner.
    #[inline]
    fn derivatives(
        &self,
        at: &Projection,
        coordinate: usize,
        place: DVec3,
        by_place: DVec3,
        bends: Option<&[DVec3; shape::COUNT]>,
        row: &mut [f64; LONGEST_ROW],
    ) {
        let mut next = 0;
        if self.support.is_none() {
            row[..self.own].fill(0.0);
            for &(parameter, column) in self.free {
                row[column - self.first] += at.by_parameters[parameter][coordinate];
            }
            next = self.own;
        }
        let mut push = |value: f64| {
            row[next] = value;
            next += 1;
        };
        let support = self.support.iter();
        support.for_each(|support| support.derivatives(at, coordinate, &mut push));
        self.chain.derivatives(place, by_place, bends, &mut push);
    }
}

impl Local {
    pub(crate) fn of(
        problem: &Problem,
        layout: &Layout,
        block: &Block,
        whitening: &[[f64; 3]],
        loss: Loss,
        sigma: f64,
    ) -> Option<Self> {
        let unknowns = Unknowns::of(problem, layout, block)?;
        let Unknowns { chain, support, .. } = &unknowns;
        let columns = unknowns.columns();
        let n = columns.len() + 6;
        let mut sums = Sums::of(n);
        let mut cost = 0.0;
        let unknown = problem.map.as_ref().map_or(0, |_| block.observations.len());
        let (mut corners, mut cross) =
            (Vec::with_capacity(unknown), Vec::with_capacity(n * unknown));
        let mut rows = [[0.0; LONGEST_ROW]; 2];
        // For a spline: the columns of the corner, that is, of its knots and all columns after those of the lens.
        let mut places: Vec<usize> = Vec::new();
        let mut indices = problem.map.as_ref().map(|map| map.indices(block));
        let points = problem.panel_points(block);
        let mut at = Projection::EMPTY;
        for ((seen, &w), place) in block.observations.iter().zip(whitening).zip(points) {
            let bends = problem.shape.map(|shape| shape.directions(seen.panel_mm));
            chain.project(place, &mut at)?;
            let panel_from_camera = chain.to_camera.rotation.transpose();
            let by_place = at.by_point.map(|by| panel_from_camera * DVec3::from(by));
            if let Some(support) = support {
                support.places(&at, n, &mut places);
            }
            for (i, row) in rows.iter_mut().enumerate() {
                unknowns.derivatives(&at, i, place, by_place[i], bends.as_ref(), row);
            }
            let residual = seen.pixel - at.pixel;
            let squared = Whitening::apply(w, residual).length_squared();
            let (of_corner, weight) = loss.of(squared, sigma);
            cost += of_corner;
            // Everything below is whitened, and counts according to the loss.
            let [a, b, c] = w.map(|w| w * weight.sqrt());
            let residual = Whitening::apply([a, b, c], residual);
            let by_place = [a * by_place[0], b * by_place[0] + c * by_place[1]];
            let [along_x, along_y] = &mut rows;
            let count = if support.is_some() { places.len() } else { n };
            for (x, y) in along_x[..count].iter_mut().zip(along_y) {
                (*x, *y) = (a * *x, b * *x + c * *y);
            }
            let rows = [&rows[0][..count], &rows[1][..count]];
            match support {
                Some(_) => sums.add_some(&places, rows, residual),
                None => sums.add(rows, residual),
            }
            if let Some(index) = indices.as_mut().and_then(|of| of.next()?) {
                corners.push(OfCorner::new(index, by_place, residual));
                let products = rows[0].iter().zip(rows[1]);
                let products =
                    products.map(|(&x, &y)| (x * by_place[0] + y * by_place[1]).to_array());
                match support {
                    Some(_) => {
                        let first = cross.len();
                        cross.resize(first + n, [0.0; 3]);
                        let own = &mut cross[first..];
                        places.iter().zip(products).for_each(|(&place, of)| own[place] = of);
                    }
                    None => cross.extend(products),
                }
            }
        }
        let (matrix, right) = sums.finish();
        Some(Self { cost, columns, matrix, right, corners, cross })
    }

    /// The equations of whitened rows of derivatives with respect to shared unknowns (`columns`, ascending) and the pose of
    /// the frame, and of their residuals.
    pub(super) fn of_rows(
        columns: Vec<usize>,
        rows: &DMatrix<f64>,
        residual: &DVector<f64>,
    ) -> Self {
        let whole = rows.tr_mul(rows);
        let matrix = (0..whole.nrows()).flat_map(|i| (0..=i).map(move |j| (i, j)));
        Self {
            cost: residual.norm_squared(),
            columns,
            matrix: matrix.map(|at| whole[at]).collect(),
            right: rows.tr_mul(residual).as_slice().to_vec(),
            corners: Vec::new(),
            cross: Vec::new(),
        }
    }

    /// The corners, if they are unknown, each with the product with each column of the block.
    pub(crate) fn corners(&self) -> impl Iterator<Item = (&OfCorner, &[[f64; 3]])> {
        self.corners.iter().zip(self.cross.chunks_exact(self.right.len()))
    }

    /// A row of the lower triangle, up to the diagonal.
    pub(crate) fn row(&self, i: usize) -> &[f64] {
        &self.matrix[i * (i + 1) / 2..][..=i]
    }
}

/// Number of rows whose products are summed at once.
const ROWS_AT_A_TIME: usize = 128;

/// The sums of the products of whitened rows with each other, and with their residuals.
struct Sums {
    /// Rows of the lower triangle, one after the other.
    matrix: Vec<f64>,
    right: Vec<f64>,
    /// Rows that are not added yet, each followed by its residual.
    rows: Vec<f64>,
    /// The sums of the products of added rows.
    whole: DMatrix<f64>,
}

impl Sums {
    fn of(n: usize) -> Self {
        let (matrix, right) = (vec![0.0; n * (n + 1) / 2], vec![0.0; n]);
        let rows = Vec::with_capacity((n + 1) * ROWS_AT_A_TIME);
        Self { matrix, right, rows, whole: DMatrix::zeros(0, 0) }
    }

    /// Adds the two rows of a corner.
    fn add(&mut self, [along_x, along_y]: [&[f64]; 2], residual: DVec2) {
        for (row, residual) in [(along_x, residual.x), (along_y, residual.y)] {
            self.rows.extend_from_slice(row);
            self.rows.push(residual);
        }
        if self.rows.len() == self.rows.capacity() {
            self.add_rows();
        }
    }

    fn add_rows(&mut self) {
        let n = self.right.len() + 1;
        let rows = DMatrixView::from_slice(&self.rows, n, self.rows.len() / n);
        if self.whole.is_empty() {
            self.whole = DMatrix::zeros(n, n);
        }
        self.whole.gemm(1.0, &rows, &rows.transpose(), 1.0);
        self.rows.clear();
    }

    /// Adds the two rows of a corner in some columns, given in ascending order.
    fn add_some(&mut self, places: &[usize], [along_x, along_y]: [&[f64]; 2], residual: DVec2) {
        for (i, &place) in places.iter().enumerate() {
            let (x, y) = (along_x[i], along_y[i]);
            self.right[place] += x * residual.x + y * residual.y;
            let row = &mut self.matrix[place * (place + 1) / 2..];
            for (j, &column) in places[..=i].iter().enumerate() {
                row[column] += x * along_x[j] + y * along_y[j];
            }
        }
    }

    /// The rows of the lower triangle, and the products with the residuals.
    fn finish(mut self) -> (Vec<f64>, Vec<f64>) {
        let n = self.right.len();
        if !self.rows.is_empty() {
            self.add_rows();
        }
        if !self.whole.is_empty() {
            let column = |i: usize| self.whole.column(i).into_iter().copied();
            self.matrix = (0..n).flat_map(|i| column(i).take(i + 1)).collect();
            self.right = column(n).take(n).collect();
        }
        (self.matrix, self.right)
    }
}

impl OfCorner {
    /// The contribution of a corner, from its whitened residual and its derivatives.
    fn new(index: usize, [x, y]: [DVec3; 2], residual: DVec2) -> Self {
        let own = Matrix3::from_fn(|k, l| x[k] * x[l] + y[k] * y[l]);
        let right = x * residual.x + y * residual.y;
        Self { index, own, right: right.to_array().into() }
    }
}
