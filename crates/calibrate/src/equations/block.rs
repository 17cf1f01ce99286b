//! Normal equations of one block: one panel in one image.

use std::collections::BTreeSet;

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{Matrix3, Vector3};

use super::layout::Layout;
use crate::input::loss::Loss;
use crate::input::observation::Observation;
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

/// Passes the derivatives with respect to a pose to `push`: for y = exp(ω) a + t + τ, a derivative j with respect to y
/// becomes a × j for ω, and j for τ.
fn pose(arm: DVec3, by: DVec3, push: &mut impl FnMut(f64)) {
    arm.cross(by).to_array().into_iter().chain(by.to_array()).for_each(push);
}

/// The coordinate frames between the panel of a block and its camera, and the unknown links between them.
struct Chain<'a> {
    problem: &'a Problem,
    block: &'a Block,
    camera: &'a CameraUnknowns,
    rig_from_scene: &'a Pose,
    scene_from_target: &'a Pose,
    target_from_panel: &'a Pose,
    rig_from_camera: DMat3,
    scene_from_rig: DMat3,
    target_from_scene: DMat3,
    /// First columns of the unknown pose of the camera, of the panel, of the target, and of the shape.
    of_camera: Option<usize>,
    of_panel: Option<usize>,
    of_target: Option<usize>,
    of_shape: Option<usize>,
}

/// The position of a corner along the chain from the panel to the camera: before each translation, and at the end.
struct Along {
    turned_panel: DVec3,
    turned_target: DVec3,
    turned_scene: DVec3,
    turned_rig: DVec3,
    in_camera: DVec3,
}

impl<'a> Chain<'a> {
    fn of(problem: &'a Problem, layout: &Layout, block: &'a Block) -> Self {
        let camera = &problem.cameras[block.camera];
        let (rig, panel) = (&problem.frames[block.frame], &problem.panels[block.panel.index()]);
        let target = &problem.targets[panel.target].scene_from_target;
        Self {
            problem,
            block,
            camera,
            rig_from_scene: rig,
            scene_from_target: target,
            target_from_panel: &panel.target_from_panel,
            rig_from_camera: DMat3::from_quat(camera.camera_from_rig.rotation.conjugate()),
            scene_from_rig: DMat3::from_quat(rig.rotation.conjugate()),
            target_from_scene: DMat3::from_quat(target.rotation.conjugate()),
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

    #[inline]
    fn along(&self, seen: &Observation) -> Along {
        let Self { problem, block, camera, .. } = *self;
        let turned_panel = self.target_from_panel.rotation * problem.panel_point(block, seen);
        let in_target = turned_panel + self.target_from_panel.translation;
        let turned_target = self.scene_from_target.rotation * in_target;
        let in_scene = turned_target + self.scene_from_target.translation;
        let turned_scene = self.rig_from_scene.rotation * in_scene;
        let in_rig = turned_scene + self.rig_from_scene.translation;
        let turned_rig = camera.camera_from_rig.rotation * in_rig;
        let in_camera = turned_rig + camera.camera_from_rig.translation;
        Along { turned_panel, turned_target, turned_scene, turned_rig, in_camera }
    }

    /// The pixel of a corner; `None` if the camera cannot image it.
    fn project(&self, along: &Along) -> Option<Projection> {
        self.camera.camera.project_with_derivatives(along.in_camera)
    }

    /// Passes the derivatives of a coordinate with respect to the unknown links, the shape (which `bends` the corner
    /// along these directions) and the frame's pose to `push`, from the derivative with respect to the point in the
    /// camera frame. Returns the derivative with respect to the position of the corner on its panel.
    fn derivatives(
        &self,
        along: &Along,
        by_camera: DVec3,
        bends: Option<&[DVec3; shape::COUNT]>,
        push: &mut impl FnMut(f64),
    ) -> DVec3 {
        // For y = exp(ω) a + t + τ, a derivative j with respect to y becomes a × j for ω, and j for τ.
        let by_rig = self.rig_from_camera * by_camera;
        if self.of_camera.is_some() {
            pose(along.turned_rig, by_camera, push);
        }
        let by_scene = self.scene_from_rig * by_rig;
        let by_target = self.target_from_scene * by_scene;
        if self.of_panel.is_some() {
            pose(along.turned_panel, by_target, push);
        }
        if self.of_target.is_some() {
            pose(along.turned_target, by_scene, push);
        }
        let by_place = self.target_from_panel.rotation.conjugate() * by_target;
        if let Some(bends) = bends {
            bends.iter().for_each(|&bend| push(by_place.dot(bend)));
        }
        pose(along.turned_scene, by_rig, push);
        by_place
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
        let chain = Chain::of(problem, layout, block);
        let free = &layout.parameters[block.camera];
        let support = match chain.camera.camera.lens {
            Lens::Spline(_) if !free.is_empty() => {
                let seen = block.observations.iter().map(|seen| chain.project(&chain.along(seen)));
                let seen = seen.collect::<Option<Vec<Projection>>>()?;
                Support::of(free, &seen, chain.camera.free.len())
            }
            _ => None,
        };
        let poses = chain.columns();
        let columns: Vec<usize> = match &support {
            Some(support) => support.touched.iter().copied().chain(poses).collect(),
            None => free.iter().map(|&(_, column)| column).chain(poses).collect(),
        };
        let n = columns.len() + 6;
        let matrix = vec![0.0; n * (n + 1) / 2];
        let mut local = Self {
            cost: 0.0,
            columns,
            matrix,
            right: vec![0.0; n],
            corners: Vec::new(),
            cross: Vec::new(),
        };
        if problem.map.is_some() {
            let count = block.observations.len();
            (local.corners, local.cross) =
                (Vec::with_capacity(count), Vec::with_capacity(n * count));
        }
        let mut rows = [[0.0; LONGEST_ROW]; 2];
        // For a spline: the columns of the corner, that is, of its knots and all columns after those of the lens.
        let mut places: Vec<usize> = Vec::new();
        for (seen, &w) in block.observations.iter().zip(whitening) {
            let bends = problem.shape.map(|shape| shape.directions(seen.panel_mm));
            let mapped = problem.map.as_ref().map(|map| map.index(block.panel, seen));
            let along = chain.along(seen);
            let at = chain.project(&along)?;
            let mut by_place = [DVec3::ZERO; 2];
            if let Some(support) = &support {
                support.places(&at, n, &mut places);
            }
            for (i, row) in rows.iter_mut().enumerate() {
                let mut next = 0;
                let mut push = |value: f64| {
                    row[next] = value;
                    next += 1;
                };
                match &support {
                    Some(support) => support.derivatives(&at, i, &mut push),
                    None => {
                        for &(parameter, _) in free {
                            push(at.by_parameters[parameter][i]);
                        }
                    }
                }
                let by_camera = DVec3::from(at.by_point[i]);
                by_place[i] = chain.derivatives(&along, by_camera, bends.as_ref(), &mut push);
            }
            let residual = seen.pixel - at.pixel;
            let count = if support.is_some() { places.len() } else { n };
            let rows = [&rows[0][..count], &rows[1][..count]];
            let weight = match support {
                Some(_) => local.add_some(&places, rows, residual, w, loss, sigma),
                None => local.add(rows, residual, w, loss, sigma),
            };
            if let Some(index) = mapped {
                let (corner, cross) = OfCorner::new(index, rows, by_place, residual, w, weight);
                local.corners.push(corner);
                if support.is_some() {
                    let first = local.cross.len();
                    local.cross.resize(first + n, [0.0; 3]);
                    places
                        .iter()
                        .zip(cross)
                        .for_each(|(place, of)| local.cross[first + place] = of);
                } else {
                    local.cross.extend(cross);
                }
            }
        }
        Some(local)
    }

    /// The corners, if they are unknown, each with the product with each column of the block.
    pub(crate) fn corners(&self) -> impl Iterator<Item = (&OfCorner, &[[f64; 3]])> {
        self.corners.iter().zip(self.cross.chunks_exact(self.right.len()))
    }

    /// A row of the lower triangle, up to the diagonal.
    pub(crate) fn row(&self, i: usize) -> &[f64] {
        &self.matrix[i * (i + 1) / 2..][..=i]
    }

    /// Adds the two rows of a corner in some columns, given in ascending order; returns the weight
    /// from the loss.
    fn add_some(
        &mut self,
        places: &[usize],
        [along_x, along_y]: [&[f64]; 2],
        residual: DVec2,
        w: [f64; 3],
        loss: Loss,
        sigma: f64,
    ) -> f64 {
        let r = Whitening::apply(w, residual);
        let (cost, weight) = loss.of(r.length_squared(), sigma);
        self.cost += cost;
        let [a, b, c] = w;
        for (i, &place) in places.iter().enumerate() {
            let (x, y) = (weight * a * along_x[i], weight * (b * along_x[i] + c * along_y[i]));
            self.right[place] += x * r.x + y * r.y;
            let (by_x, by_y) = (a * x + b * y, c * y);
            let row = &mut self.matrix[place * (place + 1) / 2..];
            for (j, &column) in places[..=i].iter().enumerate() {
                row[column] += by_x * along_x[j] + by_y * along_y[j];
            }
        }
        weight
    }

    /// Adds the two rows of a corner; returns the weight from the loss.
    fn add(
        &mut self,
        [along_x, along_y]: [&[f64]; 2],
        residual: DVec2,
        w: [f64; 3],
        loss: Loss,
        sigma: f64,
    ) -> f64 {
        let r = Whitening::apply(w, residual);
        let (cost, weight) = loss.of(r.length_squared(), sigma);
        self.cost += cost;
        let [a, b, c] = w;
        let mut rest = self.matrix.as_mut_slice();
        for (i, right) in self.right.iter_mut().enumerate() {
            let (x, y) = (weight * a * along_x[i], weight * (b * along_x[i] + c * along_y[i]));
            *right += x * r.x + y * r.y;
            let (by_x, by_y) = (a * x + b * y, c * y);
            let (row, below) = rest.split_at_mut(i + 1);
            for ((value, of_x), of_y) in row.iter_mut().zip(along_x).zip(along_y) {
                *value += by_x * of_x + by_y * of_y;
            }
            rest = below;
        }
        weight
    }
}

impl OfCorner {
    /// The contribution of a corner, and the product with each of its columns.
    fn new<'a>(
        index: usize,
        [along_x, along_y]: [&'a [f64]; 2],
        by_place: [DVec3; 2],
        residual: DVec2,
        w: [f64; 3],
        weight: f64,
    ) -> (Self, impl Iterator<Item = [f64; 3]> + 'a) {
        let r = Whitening::apply(w, residual);
        let [a, b, c] = w;
        let (x, y) = (a * by_place[0], b * by_place[0] + c * by_place[1]);
        // With respect to the residual before whitening.
        let (by_x, by_y) = (weight * (a * x + b * y), weight * (c * y));
        let cross = along_x.iter().zip(along_y);
        let cross = cross.map(move |(&of_x, &of_y)| (by_x * of_x + by_y * of_y).to_array());
        let own = Matrix3::from_fn(|k, l| by_x[k] * by_place[0][l] + by_y[k] * by_place[1][l]);
        let right = weight * (x * r.x + y * r.y);
        (Self { index, own, right: right.to_array().into() }, cross)
    }
}
