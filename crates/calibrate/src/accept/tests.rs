//! Simulated calibrations and acceptance tests with known truth.

use glam::{DQuat, DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::acceptance::{Acceptance, Conformity};
use super::request::{AcceptanceRequest, CornerLabel, KnownLength, Limit, Temperature};
use super::run::AcceptanceError;
use crate::input::observation::{Observation, Sighting, View};
use crate::uncertainty::board_errors::SHEET;
use crate::{Calibration, Estimate, Model, PanelRef};
use deltille_core::camera::{BrownConrady, Camera, Lens, Pose};

const NOISE_PX: f64 = 0.05;

/// Standard deviation of the corners of the boards, mm.
const BOARD_MM: f64 = 0.03;

const ROWS: i32 = 8;
const COLS: i32 = 10;
const EDGE_MM: f64 = 20.0;

fn normal(random: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| random.random_range(-0.5..0.5)).sum()
}

fn any(random: &mut ChaCha8Rng, reach: f64) -> DVec3 {
    DVec3::from([0; 3].map(|_| random.random_range(-reach..reach)))
}

/// A board with errors: offsets of its corners, mm, and an expansion.
struct Board {
    offsets: Vec<DVec3>,
    scale: f64,
}

/// The position of a corner relative to the centre of its board, mm.
fn planned(index: i32) -> DVec3 {
    let at = DVec2::new(f64::from(index % COLS), f64::from(index / COLS));
    let centre = DVec2::new(f64::from(COLS - 1), f64::from(ROWS - 1)) / 2.0;
    ((at - centre) * EDGE_MM).extend(0.0)
}

impl Board {
    /// Single corners are off, and the sheet as a whole is stretched, sheared and bent by as much.
    fn printed(random: &mut ChaCha8Rng) -> Self {
        let amounts = SHEET.map(|field| (field, normal(random)));
        let size = |field: fn(DVec3) -> DVec3| {
            let squares = (0..ROWS * COLS).map(|index| field(planned(index)).length_squared());
            let per_axis = squares.sum::<f64>() / f64::from(ROWS * COLS);
            let is_flat = field(DVec3::ONE).z == 0.0;
            (if is_flat { 1.5 * per_axis } else { 3.0 * per_axis }).sqrt()
        };
        let offset = |index| {
            let own = DVec3::from([0; 3].map(|_| normal(random)));
            let of_sheet = amounts.map(|(field, by)| field(planned(index)) * by / size(field));
            (own + of_sheet.into_iter().sum::<DVec3>()) * BOARD_MM
        };
        Self { offsets: (0..ROWS * COLS).map(offset).collect(), scale: 1.0 }
    }
}

struct Rig {
    cameras: Vec<(Camera, Pose)>,
}

impl Rig {
    fn new(count: usize) -> Self {
        let radial = [-0.1, 0.02, 0.0];
        let lens = Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() });
        let cameras = (0..count).map(|index| {
            let camera = Camera::centred(1280, 960, 1100.0, lens.clone());
            let rotation = DQuat::from_rotation_y(0.2 * index as f64);
            (camera, Pose { rotation, translation: DVec3::new(-120.0, 1.0, 8.0) * index as f64 })
        });
        Self { cameras: cameras.collect() }
    }

    /// Views of a board by all cameras, at random poses.
    fn views(&self, board: &Board, count: usize, random: &mut ChaCha8Rng) -> Vec<Vec<View>> {
        let mut views = vec![Vec::new(); self.cameras.len()];
        for frame in 0..count {
            let tilt = DQuat::from_scaled_axis(any(random, 0.5));
            let facing = DQuat::from_rotation_x(std::f64::consts::PI);
            let centre = DVec3::new(0.5 * f64::from(COLS - 1), 0.5 * f64::from(ROWS - 1), 0.0);
            let away = DVec3::new(20.0, 0.0, 480.0) + any(random, 60.0);
            let rotation = tilt * facing;
            let translation = away - rotation * (centre * EDGE_MM);
            let pose = Pose { rotation, translation };
            for (views, (camera, camera_from_rig)) in views.iter_mut().zip(&self.cameras) {
                let at = camera_from_rig.after(&pose);
                let observations = (0..ROWS * COLS).filter_map(|index| {
                    let (row, col) = (index / COLS, index % COLS);
                    let panel_mm = DVec3::new(f64::from(col), f64::from(row), 0.0) * EDGE_MM;
                    let offset = board.offsets[index as usize];
                    let pixel = camera.project(at.apply(panel_mm * board.scale + offset))?;
                    let pixel = pixel + DVec2::new(normal(random), normal(random)) * NOISE_PX;
                    let cov = Some([NOISE_PX * NOISE_PX, 0.0, NOISE_PX * NOISE_PX]);
                    let seen = Observation { row, col, panel_mm, pixel, cov };
                    camera.sees(pixel, 5.0).then_some(seen)
                });
                let sighting =
                    Sighting { panel: PanelRef::ONLY, observations: observations.collect() };
                let name = format!("{frame:03}");
                let image = format!("{name}.png");
                views.push(View { name, image, size_px: [1280, 960], sightings: vec![sighting] });
            }
        }
        views
    }
}

fn calibration(views: Vec<Vec<View>>) -> Calibration {
    let empty = Calibration::new([Pose::IDENTITY]).board_accuracy_mm(Some(BOARD_MM));
    views.into_iter().enumerate().fold(empty, |calibration, (index, views)| {
        calibration.camera(&format!("c{index}"), views, Model::Radtan)
    })
}

/// A calibration of a rig with this number of cameras.
fn calibrated(rig: &Rig, random: &mut ChaCha8Rng) -> (Estimate, Vec<Vec<View>>) {
    let views = rig.views(&Board::printed(random), 20, random);
    (calibration(views.clone()).solve().unwrap(), views)
}

fn accepted(
    rig: &Rig,
    board: &Board,
    estimate: &Estimate,
    request: &AcceptanceRequest,
    random: &mut ChaCha8Rng,
) -> Acceptance {
    calibration(rig.views(board, 6, random)).accept(estimate, request).unwrap()
}

#[test]
fn stated_intervals_contain_95_percent_of_the_errors() {
    for cameras in [1, 2] {
        let rig = Rig::new(cameras);
        let (mut within, mut all, mut squares) = (0, 0, 0.0);
        for seed in 0..12 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let (estimate, _) = calibrated(&rig, &mut random);
            let board = Board::printed(&mut random);
            let found =
                accepted(&rig, &board, &estimate, &AcceptanceRequest::default(), &mut random);
            assert_eq!((found.measured.len(), found.verdict()), (6, None));
            within += found.within();
            all += found.lengths.len();
            squares += found
                .lengths
                .iter()
                .map(|of| (of.error_mm() / of.budget.combined_mm()).powi(2))
                .sum::<f64>();
        }
        let (part, ratio) = (within as f64 / f64::from(all as u32), squares / all as f64);
        println!("{cameras}: {part:.3} of {all}, e²/u² {ratio:.2}");
        assert!((0.95..0.998).contains(&part), "{cameras}: {part} of {all}");
        assert!((0.4..1.1).contains(&ratio), "{cameras}: {ratio}");
    }
}

#[test]
fn a_rig_sees_a_board_that_is_too_large_and_a_single_camera_does_not() {
    let limit = Some(Limit { constant_mm: 1.0, per_length: 0.0 });
    for cameras in [1, 2] {
        let rig = Rig::new(cameras);
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let (estimate, _) = calibrated(&rig, &mut random);
        let request = AcceptanceRequest { limit, ..Default::default() };
        let mut board = Board::printed(&mut random);
        let right = accepted(&rig, &board, &estimate, &request, &mut random);
        assert_eq!(right.verdict(), Some(Conformity::Conforms));
        board.scale = 1.01;
        let wrong = accepted(&rig, &board, &estimate, &request, &mut random);
        let expected = if cameras == 1 { Conformity::Conforms } else { Conformity::Fails };
        assert_eq!(wrong.verdict(), Some(expected));
        // With the expansion of the board, its lengths are right.
        let temperature = Some(Temperature {
            above_reference_k: 100.0,
            sd_k: 0.1,
            expansion_per_k: 1e-4,
            expansion_sd_per_k: 0.0,
        });
        let request = AcceptanceRequest { limit, temperature, ..Default::default() };
        let warm = calibration(rig.views(&board, 6, &mut random)).accept(&estimate, &request);
        match cameras {
            1 => assert_eq!(warm, Err(AcceptanceError::Temperature)),
            _ => assert_eq!(warm.unwrap().verdict(), Some(Conformity::Conforms)),
        }
    }
}

#[test]
fn measured_lengths_replace_those_of_the_target() {
    let rig = Rig::new(2);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let (estimate, views) = calibrated(&rig, &mut random);
    let board = Board::printed(&mut random);
    let corner = |row, col| CornerLabel { panel: PanelRef::ONLY, row, col };
    let at = |row: i32, col: i32| {
        let index = row * COLS + col;
        planned(index) + board.offsets[index as usize]
    };
    let known = KnownLength {
        ends: [corner(0, 0), corner(7, 9)],
        length_mm: at(0, 0).distance(at(7, 9)),
        sd_mm: 0.002,
    };
    let request = AcceptanceRequest { lengths: vec![known], ..Default::default() };
    let found = accepted(&rig, &board, &estimate, &request, &mut random);
    assert_eq!((found.lengths.len(), found.within()), (6, 6));
    assert!(found.lengths.iter().all(|of| of.budget.target_mm == 0.002));
    let error = calibration(views).accept(&estimate, &request).unwrap_err();
    assert_eq!(error, AcceptanceError::Reused { views: 40 });
}
