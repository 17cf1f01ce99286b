//! The pose of a target in one image, from its corners alone.

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{Matrix3, SMatrix};

use crate::equations::minimise::{Until, minimise};
use crate::input::loss::Loss;
use crate::input::observation::{Observation, Sighting};
use crate::input::weights::Weights;
use crate::problem::bundle::Problem;
use crate::problem::unknowns::{Block, CameraUnknowns, PanelUnknowns, TargetUnknowns};
use crate::problem::whitening::{Whitening, scale};
use deltille_core::camera::{Camera, Pose};
use deltille_core::statistics::median;

/// Number of corners that determine a homography.
const MIN_RAYS: usize = 4;

/// Number of panels that give initial poses, the largest first; two of them may be wrong.
const STARTS: usize = 3;

/// A panel does not fit a pose if its error exceeds that of the best panel by this factor.
const DISAGREE: f64 = 5.0;

/// Computes the pose `camera_from_target`; `panels` are the poses of the panels on the target. For
/// one panel it minimises the squared error of all corners; for several it is the pose on which
/// most corners agree. `None` if the corners lie on a line or the camera cannot image them.
pub(crate) fn estimate_pose(
    camera: &Camera,
    panels: &[Pose],
    sightings: &[Sighting],
) -> Option<Pose> {
    let mut by_size: Vec<&Sighting> = sightings.iter().collect();
    by_size.sort_by_key(|sighting| std::cmp::Reverse(sighting.observations.len()));
    let mut best: Option<(f64, Pose)> = None;
    for largest in by_size.into_iter().take(STARTS) {
        let Some(pose) = pose_from(camera, panels, sightings, largest) else { continue };
        let medians: Vec<f64> = sightings
            .iter()
            .map(|s| median_off_px(camera, panels, std::slice::from_ref(s), &pose))
            .collect();
        let (least, most) = medians
            .iter()
            .fold((f64::INFINITY, 0.0), |(least, most), &off| (off.min(least), off.max(most)));
        let error = median(medians).unwrap_or(0.0);
        if best.as_ref().is_none_or(|(least, _)| error < *least) {
            best = Some((error, pose));
        }
        if most <= DISAGREE * least {
            break;
        }
    }
    best.map(|(_, pose)| pose)
}

/// The median residual of the corners of panels, px; infinite if the camera cannot image most of them.
pub(crate) fn median_off_px(
    camera: &Camera,
    panels: &[Pose],
    sightings: &[Sighting],
    pose: &Pose,
) -> f64 {
    let off = sightings.iter().flat_map(|sighting| {
        let camera_from_panel = pose.after(&panels[sighting.panel.index()]);
        sighting.observations.iter().map(move |seen| {
            let at = camera.project(camera_from_panel.apply(seen.panel_mm));
            at.map(|at| seen.pixel - at).map_or(f64::INFINITY, |off| off.length())
        })
    });
    median(off.collect()).unwrap_or(0.0)
}

/// The pose of the target that starts from that of one panel.
fn pose_from(
    camera: &Camera,
    panels: &[Pose],
    sightings: &[Sighting],
    largest: &Sighting,
) -> Option<Pose> {
    let camera_from_panel = planar_pose(camera, &largest.observations)?;
    let start = camera_from_panel.after(&panels[largest.panel.index()].inverse());
    // From a distance, a panel looks nearly the same if its tilt is mirrored about the line of
    // sight.
    let centre = largest.observations.iter().map(|o| o.panel_mm).sum::<DVec3>()
        / largest.observations.len() as f64;
    let mirrored =
        mirrored(&camera_from_panel, centre).after(&panels[largest.panel.index()].inverse());
    let refined = [start, mirrored].map(|pose| refine(camera, panels, sightings, pose));
    let best = refined.into_iter().flatten().min_by(|a, b| a.1.total_cmp(&b.1));
    best.map(|(pose, _)| pose)
}

/// The pose of a plane from the rays to its points. With a homography H from the plane to the rays
/// b ∼ H (x, y, 1), each point gives b × H (x, y, 1) = 0; H = (r1, r2, t) up to scale. Rays may
/// point backwards, too. The sign is chosen so that H (x, y, 1) points along b.
pub(crate) fn planar_pose(camera: &Camera, observations: &[Observation]) -> Option<Pose> {
    let n = observations.len() as f64;
    let centre = observations.iter().map(|o| o.panel_mm).sum::<DVec3>() / n;
    let size = observations.iter().map(|o| (o.panel_mm - centre).length()).sum::<f64>() / n;
    if size <= 0.0 {
        return None;
    }
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    let mut rays = Vec::with_capacity(observations.len());
    for seen in observations {
        // The lens may have no ray for some pixels, at its rim or at a pole.
        let Some(b) = camera.unproject(seen.pixel).map(|ray| ray.direction) else { continue };
        let at = (seen.panel_mm - centre) / size;
        let h = [at.x, at.y, 1.0];
        // b × (H h) = [b]× H h: bᵀb I − b bᵀ is [b]×ᵀ [b]×.
        let projector = DMat3::IDENTITY - DMat3::from_cols(b * b.x, b * b.y, b * b.z);
        for i in 0..3 {
            for j in 0..3 {
                let weight = h[i] * h[j];
                for row in 0..3 {
                    for column in 0..3 {
                        normal[(3 * i + row, 3 * j + column)] +=
                            weight * projector.col(column)[row];
                    }
                }
            }
        }
        rays.push((b, at));
    }
    if rays.len() < MIN_RAYS {
        return None;
    }
    let eigen = normal.symmetric_eigen();
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let column = |i: usize| DVec3::new(least[3 * i], least[3 * i + 1], least[3 * i + 2]);
    let [a, b, c] = [column(0), column(1), column(2)];
    let along: f64 = rays.iter().map(|(ray, at)| ray.dot(a * at.x + b * at.y + c).signum()).sum();
    let scale = along.signum() * (a.length() * b.length()).sqrt().recip();
    let (r1, r2, t) = (a * scale, b * scale, c * scale * size);
    let r3 = r1.cross(r2);
    let matrix = Matrix3::from_columns(&[r1, r2, r3].map(|v| v.to_array().into()));
    let svd = matrix.svd(true, true);
    let rotation = svd.u? * svd.v_t?;
    if !(rotation.determinant() > 0.0 && t.is_finite()) {
        return None;
    }
    let rotation = DQuat::from_mat3(&DMat3::from_cols_slice(rotation.as_slice())).normalize();
    Some(Pose { rotation, translation: t - rotation * centre })
}

/// The pose with its plane mirrored about the line of sight to `centre`, which remains fixed.
fn mirrored(pose: &Pose, centre: DVec3) -> Pose {
    let seen = pose.apply(centre);
    let sight = seen.normalize_or(DVec3::Z);
    let mirror = |v: DVec3| v - 2.0 * v.dot(sight) * sight;
    let (x, y) = (mirror(pose.rotation * DVec3::X), mirror(pose.rotation * DVec3::Y));
    let rotation = DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y))).normalize();
    Pose { rotation, translation: seen - rotation * centre }
}

/// Refines a pose and returns it with its cost.
fn refine(
    camera: &Camera,
    panels: &[Pose],
    sightings: &[Sighting],
    pose: Pose,
) -> Option<(Pose, f64)> {
    let free = vec![false; camera.parameters().len()];
    let problem = Problem {
        cameras: vec![CameraUnknowns::alone(camera.clone(), free)],
        frames: vec![pose],
        targets: vec![TargetUnknowns::SCENE],
        panels: fixed(panels),
        blocks: blocks(sightings, 0).collect(),
        ..Problem::default()
    };
    let first: Option<Vec<_>> =
        problem.blocks.iter().map(|block| problem.residuals(block).collect()).collect();
    let whitening = Whitening::fit(&problem, Weights::Equal, &first?);
    // One of several panels may be wrong.
    let loss = if sightings.len() > 1 { Loss::Cauchy } else { Loss::Squared };
    let minimum = minimise(problem, &whitening, loss, Until::Rough)?;
    let cost = match loss {
        Loss::Squared => minimum.normal.cost,
        // Scales differ, so costs are not comparable.
        Loss::Huber | Loss::Cauchy => scale(&minimum.problem).sigma,
    };
    Some((minimum.problem.frames[0], cost))
}

/// The panels of one target, all fixed.
pub(crate) fn fixed(panels: &[Pose]) -> Vec<PanelUnknowns> {
    let fixed = |&target_from_panel| PanelUnknowns {
        target: 0,
        target_from_panel,
        pose_free: false,
        prior: None,
    };
    panels.iter().map(fixed).collect()
}

/// The blocks of a view of a single camera.
pub(crate) fn blocks(sightings: &[Sighting], frame: usize) -> impl Iterator<Item = Block> + '_ {
    sightings.iter().map(move |sighting| Block {
        camera: 0,
        frame,
        panel: sighting.panel,
        observations: sighting.observations.as_slice().into(),
    })
}

/// The medoid of the poses: the pose with the smallest median distance from the others. A rotation
/// counts by the displacement of a point at the distance of the translations.
pub(crate) fn middle(poses: &[Pose]) -> Pose {
    let arm = median(poses.iter().map(|pose| pose.translation.length()).collect())
        .unwrap_or(0.0)
        .max(1.0);
    let apart = |a: &Pose, b: &Pose| {
        let turn = a.rotation.angle_between(b.rotation);
        (a.translation - b.translation).length() + arm * turn
    };
    let spread =
        |pose: &Pose| median(poses.iter().map(|other| apart(pose, other)).collect()).unwrap_or(0.0);
    let of_all = poses.iter().map(|pose| (*pose, spread(pose)));
    of_all.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(Pose::IDENTITY, |(pose, _)| pose)
}
