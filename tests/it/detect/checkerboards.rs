//! Plain checkerboards on synthetic photographs, for which the truth is exact.

use std::collections::BTreeMap;

use crate::common::view::tilted;
use deltille::camera::{Camera, KannalaBrandt, Lens, Pose};
use deltille::detect::{Detection, Detector, DetectorConfig, Grid};
use deltille::lattice::GridKind;
use deltille::raster::Gray;
use deltille::synth::{Light, Scene, Surface, Truth};
use glam::{DQuat, DVec2, DVec3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const ROWS: i32 = 6;
const COLS: i32 = 9;
const EDGE_MM: f64 = 20.0;

/// A rectangle, counter-clockwise.
fn rectangle([left, lower, right, upper]: [f64; 4]) -> Vec<DVec2> {
    [(left, lower), (right, lower), (right, upper), (left, upper)].map(DVec2::from).to_vec()
}

/// A board of 6 × 9 corners whose corner (0, 0) is at the origin. The square up and right of it is dark. On an inverted
/// board it is bright, and the board lies on a dark field.
fn board(inverted: bool) -> Scene {
    let mut black_mm = Vec::new();
    for row in -1..ROWS {
        for col in -1..COLS {
            if ((row + col).rem_euclid(2) == 0) != inverted {
                let (x, y) = (f64::from(col) * EDGE_MM, f64::from(row) * EDGE_MM);
                black_mm.push(vec![rectangle([x, y, x + EDGE_MM, y + EDGE_MM])]);
            }
        }
    }
    let field = |margin: f64| {
        let (right, upper) = (f64::from(COLS) * EDGE_MM, f64::from(ROWS) * EDGE_MM);
        let low = -EDGE_MM - margin;
        rectangle([low, low, right + margin, upper + margin])
    };
    if inverted {
        black_mm.push(vec![field(10.0), field(0.0)]);
    }
    let corners = (0..ROWS).flat_map(|row| (0..COLS).map(move |col| (row, col)));
    let surface = Surface {
        panel: 0,
        target_from_surface: Pose { rotation: DQuat::IDENTITY, translation: DVec3::ZERO },
        paper_mm: field(15.0),
        black_mm,
        corners: corners
            .map(|(row, col)| {
                let place = DVec2::new(f64::from(col), f64::from(row)) * EDGE_MM;
                ((row * COLS + col) as u32, row, col, place)
            })
            .collect(),
    };
    Scene { surfaces: vec![surface] }
}

/// Height of a sheet of paper above the board.
const COVER_MM: f64 = 5.0;

/// Distance to a cover, px, within which corners need not be found. The smallest circles that show a corner's edges
/// show the cover too, and the edges of the squares end at it.
const NEAR_COVER_PX: f64 = 12.0;

/// The board with a sheet of grey paper above it, up to `right_mm`.
fn covered(right_mm: f64) -> Scene {
    let mut scene = board(false);
    scene.surfaces.push(Surface {
        panel: 1,
        target_from_surface: Pose {
            rotation: DQuat::IDENTITY,
            translation: DVec3::new(0.0, 0.0, COVER_MM),
        },
        paper_mm: rectangle([-60.0, -60.0, right_mm, 200.0]),
        black_mm: Vec::new(),
        corners: Vec::new(),
    });
    scene
}

fn seen_from(rng: &mut ChaCha8Rng, distance_mm: f64, tilt: f64) -> Pose {
    let centre =
        DVec3::new(f64::from(COLS - 1) / 2.0 * EDGE_MM, f64::from(ROWS - 1) / 2.0 * EDGE_MM, 0.0);
    tilted(rng, centre, distance_mm, tilt)
}

fn detect(image: &Gray<f32>, kind: GridKind, size: Option<(u32, u32)>) -> Detection {
    let image = image.map(|v| (v * 255.0 + 0.5) as u8);
    Detector::for_grid(kind, size, DetectorConfig::default()).detect(&image, "view")
}

const SIZE: Option<(u32, u32)> = Some((ROWS as u32, COLS as u32));

/// Returns the distance of each corner of a completely labelled board from the truth; panics on a wrong label.
fn errors(grid: &Grid, truth: &Truth, inverted: bool) -> Vec<f64> {
    let at: BTreeMap<(i32, i32), DVec2> =
        truth.corners.iter().map(|c| ((c.row, c.col), DVec2::new(c.x, c.y))).collect();
    let distance = |c: &deltille::detect::GridCorner| {
        // Row 0, column 0 has a dark square: on the inverted board it is rotated by 180°.
        let label = if inverted { (ROWS - 1 - c.row, COLS - 1 - c.col) } else { (c.row, c.col) };
        let error = c.position().distance(at[&label]);
        assert!(error < 2.0, "corner {label:?} is {error} px off: a wrong label");
        error
    };
    grid.corners.iter().map(distance).collect()
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn whole_boards_are_labelled_from_their_dark_corner_up_to_60_degrees() {
    let camera = Camera::pinhole(1280, 960, 0.9);
    for inverted in [false, true] {
        let scene = board(inverted);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut all = Vec::new();
        for view in 0..12u32 {
            let tilt = f64::from(view) / 12.0 * 60f64.to_radians();
            let pose = seen_from(&mut rng, 330.0, tilt);
            let light = Light::default().seed(view.into()).gradient(DVec2::new(0.5, -0.3));
            let image = scene.render(&camera, &pose, &light);
            let detection = detect(&image, GridKind::Checker, SIZE);
            assert_eq!(detection.grids.len(), 1, "view {view}");
            let grid = &detection.grids[0];
            assert_eq!((grid.kind, grid.corners.len()), (GridKind::Checker, 54), "view {view}");
            all.extend(errors(grid, &scene.truth(&camera, &pose, 0.0), inverted));
            assert!(detect(&image, GridKind::Deltille, None).grids.is_empty(), "view {view}");
        }
        println!("rms {} px", rms(&all));
        assert!(rms(&all) < 0.03, "rms {}", rms(&all));
    }
}

/// A board of 6 × 9 corners is not one of 6 × 8, however clearly its last column is seen.
#[test]
fn larger_boards_are_not_labelled() {
    let camera = Camera::pinhole(1024, 768, 0.9);
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for seed in 0..12 {
        let pose = seen_from(&mut rng, 480.0, 0.1);
        let light = Light::default().noise(0.01).seed(seed);
        let image = board(false).render(&camera, &pose, &light);
        for size in [(6, 8), (5, 9)] {
            let found = detect(&image, GridKind::Checker, Some(size));
            assert!(found.grids.is_empty(), "{seed}: {size:?}: {:?}", found.grids);
        }
        assert_eq!(detect(&image, GridKind::Checker, Some((6, 9))).grids.len(), 1, "{seed}");
    }
}

#[test]
fn a_fisheye_lens_bends_the_rows_but_not_the_labels() {
    let mut camera = Camera::pinhole(1600, 1200, 1.2);
    camera.focal_px = DVec2::splat(420.0);
    camera.lens = Lens::KannalaBrandt(KannalaBrandt { k: vec![-0.02, 0.002, 0.0, 0.0] });
    let scene = board(false);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut all = Vec::new();
    for view in 0..8u32 {
        let pose = seen_from(&mut rng, 120.0, 0.1 * f64::from(view));
        let light = Light::default().seed(view.into());
        let image = scene.render(&camera, &pose, &light);
        let truth = scene.truth(&camera, &pose, 14.0);
        let detection = detect(&image, GridKind::Checker, SIZE);
        assert_eq!(detection.grids.len(), 1, "view {view}");
        if truth.corners.len() == 54 {
            assert_eq!(detection.grids[0].corners.len(), 54, "view {view}");
            all.extend(errors(&detection.grids[0], &truth, false));
        }
    }
    assert!(all.len() >= 2 * 54);
    println!("rms {} px", rms(&all));
    assert!(rms(&all) < 0.04, "rms {}", rms(&all));
}

#[test]
fn visible_corners_of_a_covered_board_are_found_in_position() {
    let camera = Camera::pinhole(1280, 960, 0.9);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for view in 0..20u32 {
        let right_mm = (0.1 + 0.025 * f64::from(view)) * f64::from(COLS) * EDGE_MM;
        let scene = covered(right_mm);
        let pose = seen_from(&mut rng, 330.0, 0.5);
        let light = Light::default().seed(view.into());
        let truth = scene.truth(&camera, &pose, 0.0);
        let detection = detect(&scene.render(&camera, &pose, &light), GridKind::Checker, SIZE);
        assert_eq!(detection.grids.len(), 1, "view {view}");
        let corners = &detection.grids[0].corners;
        let cover = |row: i32| {
            let edge_mm = DVec3::new(right_mm, f64::from(row) * EDGE_MM, COVER_MM);
            camera.project(pose.apply(edge_mm)).unwrap()
        };
        for lost in &truth.corners {
            let found = corners.iter().any(|c| (c.x - lost.x).hypot(c.y - lost.y) < 0.25);
            let away = cover(lost.row).distance(DVec2::new(lost.x, lost.y));
            assert!(found || away < NEAR_COVER_PX, "view {view}: {lost:?}, {away} px away");
        }
        let nearest = |x: f64, y: f64| {
            let distance = |c: &&deltille::synth::TruthCorner| (c.x - x).hypot(c.y - y);
            let found = truth.corners.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let found = found.unwrap();
            let off = distance(&found);
            assert!(off < 0.25, "view {view}: {off} px from any corner at {x}, {y}");
            (found.row, found.col)
        };
        let labels: BTreeMap<(i32, i32), (i32, i32)> =
            corners.iter().map(|c| ((c.row, c.col), nearest(c.x, c.y))).collect();
        // Steps along rows and columns of the grid are rotated by the same multiple of 90° everywhere.
        let mut steps = std::collections::BTreeSet::new();
        for (&(row, col), &(r, c)) in &labels {
            if let Some(&(r1, c1)) = labels.get(&(row, col + 1)) {
                steps.insert((r1 - r, c1 - c));
            }
            if let Some(&(r1, c1)) = labels.get(&(row + 1, col)) {
                // The step along the row, rotated by 90° counter-clockwise.
                steps.insert((-(c1 - c), r1 - r));
            }
        }
        assert_eq!(steps.len(), 1, "view {view}: {steps:?}");
        let &(dr, dc) = steps.first().unwrap();
        assert_eq!(dr.abs() + dc.abs(), 1);
    }
}

/// Returns the labels and errors in an image of the board from above, after a change of each pixel by its position and
/// the corners in the image.
fn seen_after(change: impl Fn(DVec2, &[DVec2], f32) -> f32) -> (Detection, Vec<f64>) {
    let camera = Camera::pinhole(1280, 960, 0.9);
    let pose = seen_from(&mut ChaCha8Rng::seed_from_u64(5), 330.0, 0.3);
    let scene = board(false);
    let truth = scene.truth(&camera, &pose, 0.0);
    let corners: Vec<DVec2> = truth.corners.iter().map(|c| DVec2::new(c.x, c.y)).collect();
    let image = scene.render(&camera, &pose, &Light::default());
    let changed = Gray::from_fn(image.width(), image.height(), |x, y| {
        change(DVec2::new(x as f64, y as f64), &corners, image.at(x, y))
    });
    let detection = detect(&changed, GridKind::Checker, SIZE);
    assert_eq!(detection.grids.len(), 1);
    let is_labelled = detection.reasons.is_empty();
    let errors = if is_labelled { errors(&detection.grids[0], &truth, false) } else { Vec::new() };
    (detection, errors)
}

/// A speck hides a corner, and the edge of a shadow ends the similarity of its tiles. Its edges still meet.
#[test]
fn specks_and_edges_of_shadows_cost_no_corner() {
    for grey in [0.0, 0.5, 1.0] {
        let (_, errors) = seen_after(|place, corners, value| {
            let specks = corners.iter().step_by(7);
            let is_on = specks.into_iter().any(|corner| corner.distance(place) < 3.0);
            if is_on { grey } else { value }
        });
        assert_eq!(errors.len(), 54, "specks of {grey}");
        assert!(errors.iter().all(|error| *error < 0.4), "{errors:?}");
    }
    for corner in [0, 20, 33, 53] {
        let (_, errors) = seen_after(|place, corners, value| {
            let across = (place - corners[corner]).dot(DVec2::from_angle(0.6));
            value * (0.4 + 0.6 / (1.0 + (-across).exp())) as f32
        });
        assert_eq!(errors.len(), 54, "a shadow through corner {corner}");
        assert!(errors.iter().all(|error| *error < 1.5), "{errors:?}");
    }
}

/// Half the length of an edge in [`seen_after`], px.
const HALF_EDGE_PX: f64 = 35.0;

/// Only one placement of the board has all corners that are seen beside a finger on one of its own.
#[test]
fn a_covered_corner_of_the_board_costs_no_label_but_a_covered_side_costs_all() {
    let covered = |count: usize| {
        seen_after(move |place, corners, value| {
            let is_under = |corner: &DVec2| corner.distance(place) < HALF_EDGE_PX;
            if corners.iter().take(count).any(is_under) { 0.5 } else { value }
        })
    };
    for count in [1, 2, 3] {
        let (_, errors) = covered(count);
        assert!(errors.len() >= 54 - count, "{count}: {}", errors.len());
        assert!(errors.iter().all(|error| *error < 1.5), "{count}: {errors:?}");
    }
    let (detection, _) = covered(COLS as usize);
    assert_eq!(detection.reasons.len(), 1, "{:?}", detection.grids[0].corners.len());
}
