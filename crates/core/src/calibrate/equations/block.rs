//! Normal equations of one block: of one panel in one picture.

use std::collections::BTreeSet;

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{Matrix3, Vector3};

use super::layout::Layout;
use crate::calibrate::input::loss::Loss;
use crate::calibrate::input::observation::Observation;
use crate::calibrate::problem::bundle::Problem;
use crate::calibrate::problem::shape;
use crate::calibrate::problem::unknowns::Block;
use crate::calibrate::problem::whitening::Whitening;
use crate::camera::{Lens, MAX_PARAMETERS, MOST_TOUCHED, PROJECTION_PARAMETERS, Projection};

/// Most columns that a corner depends on: parameters and poses of a camera, a panel, a target and a frame, and a shape.
const LONGEST_ROW: usize = MOST_OF_LENS + 24 + shape::COUNT;

/// Most parameters of a camera that a corner depends on.
const MOST_OF_LENS: usize =
    if MAX_PARAMETERS > MOST_TOUCHED { MAX_PARAMETERS } else { MOST_TOUCHED };

/// Of a block that a spline images, which columns it has, and which of them each of its corners has.
struct Support {
    /// The column of each parameter of the lens, if it is unknown.
    columns: Vec<Option<usize>>,
    /// The columns of the lens on which any corner depends, ascending.
    touched: Vec<usize>,
}

impl Support {
    /// `None` of another lens, or where nothing of it is unknown.
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

    /// Whether dx and dy of each knot of a point are unknown, and its part.
    fn knots(&self, at: &Projection) -> impl Iterator<Item = (usize, usize, f64)> {
        let knots = at.knots.into_iter().flat_map(|knots| knots.iter());
        knots.flat_map(move |(knot, part)| {
            [0, 1].into_iter().filter_map(move |axis| {
                self.columns[2 * knot + axis].map(|column| (column, axis, part))
            })
        })
    }

    /// The columns of a block of n that a point depends on.
    fn places(&self, at: &Projection, n: usize, places: &mut Vec<usize>) {
        places.clear();
        let of_knots =
            self.knots(at).map(|(column, ..)| self.touched.partition_point(|&c| c < column));
        places.extend(of_knots);
        places.extend(self.touched.len()..n);
    }

    /// The derivatives of a coordinate by the knots.
    fn derivatives(&self, at: &Projection, coordinate: usize, push: &mut impl FnMut(f64)) {
        for (_, axis, part) in self.knots(at) {
            push(if axis == coordinate { at.by_image(axis) * part } else { 0.0 });
        }
    }
}

/// The normal equations of one block, with only the columns that it has.
pub(in crate::calibrate) struct Local {
    pub cost: f64,
    /// Shared columns; those of the frame's pose follow.
    pub columns: Vec<usize>,
    /// Rows of the lower triangle, one after the other.
    matrix: Vec<f64>,
    pub right: Vec<f64>,
    /// The corners, where they are unknown.
    pub corners: Vec<OfCorner>,
}

/// What a corner in a block says of its own offset.
pub(in crate::calibrate) struct OfCorner {
    /// Its place in the map.
    pub index: usize,
    /// For each column of the block.
    pub cross: Vec<[f64; 3]>,
    pub own: Matrix3<f64>,
    pub right: Vector3<f64>,
}

impl Local {
    pub(in crate::calibrate) fn of(
        problem: &Problem,
        layout: &Layout,
        block: &Block,
        whitening: &[[f64; 3]],
        loss: Loss,
        sigma: f64,
    ) -> Option<Self> {
        let camera = &problem.cameras[block.camera];
        let (rig, panel) = (&problem.frames[block.frame], &problem.panels[block.panel.index()]);
        let target = &problem.targets[panel.target].scene_from_target;
        let rig_from_camera = DMat3::from_quat(camera.camera_from_rig.rotation.conjugate());
        let scene_from_rig = DMat3::from_quat(rig.rotation.conjugate());
        let target_from_scene = DMat3::from_quat(target.rotation.conjugate());
        let free = &layout.parameters[block.camera];
        let of_camera = layout.cameras[block.camera];
        let (of_panel, of_target) =
            (layout.panels[block.panel.index()], layout.targets[panel.target]);
        let poses = of_camera.into_iter().chain(of_panel).chain(of_target);
        let poses = poses.flat_map(|first| first..first + 6);
        let of_shape = layout.shape.into_iter().flat_map(|first| first..first + shape::COUNT);
        let poses = poses.chain(of_shape);
        let chain = |seen: &Observation| {
            let turned_panel = panel.target_from_panel.rotation * problem.panel_point(block, seen);
            let turned_target =
                target.rotation * (turned_panel + panel.target_from_panel.translation);
            let turned_scene = rig.rotation * (turned_target + target.translation);
            let in_rig = turned_scene + rig.translation;
            let turned_rig = camera.camera_from_rig.rotation * in_rig;
            let in_camera = turned_rig + camera.camera_from_rig.translation;
            let at = camera.camera.project_with_derivatives(in_camera)?;
            Some((turned_panel, turned_target, turned_scene, turned_rig, at))
        };
        let support = match camera.camera.lens {
            Lens::Spline(_) if !free.is_empty() => {
                let seen = block.observations.iter().map(|seen| Some(chain(seen)?.4));
                let seen = seen.collect::<Option<Vec<Projection>>>()?;
                Support::of(free, &seen, camera.free.len())
            }
            _ => None,
        };
        let columns: Vec<usize> = match &support {
            Some(support) => support.touched.iter().copied().chain(poses).collect(),
            None => free.iter().map(|&(_, column)| column).chain(poses).collect(),
        };
        let n = columns.len() + 6;
        let matrix = vec![0.0; n * (n + 1) / 2];
        let mut local =
            Self { cost: 0.0, columns, matrix, right: vec![0.0; n], corners: Vec::new() };
        let mut rows = [[0.0; LONGEST_ROW]; 2];
        // Of a spline the columns of the block that a corner has: of its knots, and all after those of the lens.
        let mut places: Vec<usize> = Vec::new();
        for (seen, &w) in block.observations.iter().zip(whitening) {
            let bends = problem.shape.map(|shape| shape.directions(seen.panel_mm));
            let mapped = problem.map.as_ref().map(|map| map.index(block.panel, seen));
            let (turned_panel, turned_target, turned_scene, turned_rig, at) = chain(seen)?;
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
                // For y = exp(ω) a + t + τ a derivative j by y is a × j by ω, and j by τ.
                let mut pose = |arm: DVec3, by: DVec3| {
                    arm.cross(by).to_array().into_iter().chain(by.to_array()).for_each(&mut push);
                };
                let by_camera = DVec3::from(at.by_point[i]);
                let by_rig = rig_from_camera * by_camera;
                if of_camera.is_some() {
                    pose(turned_rig, by_camera);
                }
                let by_scene = scene_from_rig * by_rig;
                let by_target = target_from_scene * by_scene;
                if of_panel.is_some() {
                    pose(turned_panel, by_target);
                }
                if of_target.is_some() {
                    pose(turned_target, by_scene);
                }
                by_place[i] = panel.target_from_panel.rotation.conjugate() * by_target;
                if let Some(bends) = bends {
                    bends.iter().for_each(|&bend| push(by_place[i].dot(bend)));
                }
                let mut pose = |arm: DVec3, by: DVec3| {
                    arm.cross(by).to_array().into_iter().chain(by.to_array()).for_each(&mut push);
                };
                pose(turned_scene, by_rig);
            }
            let residual = seen.pixel - at.pixel;
            let count = if support.is_some() { places.len() } else { n };
            let rows = [&rows[0][..count], &rows[1][..count]];
            let weight = match support {
                Some(_) => local.add_some(&places, rows, residual, w, loss, sigma),
                None => local.add(rows, residual, w, loss, sigma),
            };
            if let Some(index) = mapped {
                let mut corner = OfCorner::new(index, rows, by_place, residual, w, weight);
                if support.is_some() {
                    corner.spread(&places, n);
                }
                local.corners.push(corner);
            }
        }
        Some(local)
    }

    /// A row of the lower triangle, up to the diagonal.
    pub(in crate::calibrate) fn row(&self, i: usize) -> &[f64] {
        &self.matrix[i * (i + 1) / 2..][..=i]
    }

    /// Adds a corner's two rows in some columns, ascending; returns the weight that the loss gives it.
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

    /// Adds a corner's two rows; returns the weight that the loss gives it.
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
    /// For all columns of a block of which it has some.
    fn spread(&mut self, places: &[usize], n: usize) {
        let mut cross = vec![[0.0; 3]; n];
        places.iter().zip(&self.cross).for_each(|(&place, values)| cross[place] = *values);
        self.cross = cross;
    }

    fn new(
        index: usize,
        [along_x, along_y]: [&[f64]; 2],
        by_place: [DVec3; 2],
        residual: DVec2,
        w: [f64; 3],
        weight: f64,
    ) -> Self {
        let r = Whitening::apply(w, residual);
        let [a, b, c] = w;
        let (x, y) = (a * by_place[0], b * by_place[0] + c * by_place[1]);
        // By the residual before it was whitened.
        let (by_x, by_y) = (weight * (a * x + b * y), weight * (c * y));
        let cross = along_x.iter().zip(along_y);
        let cross = cross.map(|(&of_x, &of_y)| (by_x * of_x + by_y * of_y).to_array());
        let own = Matrix3::from_fn(|k, l| by_x[k] * by_place[0][l] + by_y[k] * by_place[1][l]);
        let right = weight * (x * r.x + y * r.y);
        Self { index, cross: cross.collect(), own, right: right.to_array().into() }
    }
}
