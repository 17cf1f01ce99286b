//! One photograph with its ground truth: a scene plus its random parameters.
//!
//! Poses, illumination, covers and noise use separate random streams. So all levels of an axis show the same poses, and
//! only the varied quantity changes.

use std::f64::consts::TAU;

use glam::{DMat3, DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::camera::optics::{Light, Setting, Spot, expose};
use super::camera::sensor::record;
use super::camera::view::{Curl, Place, View};
use super::scene::{MAX_TILT_DEG, Scene};
use super::world::background::Studio;
use super::world::covers::Covers;
use super::world::page::{PageCorner, PrintedPage};
use deltille::raster::Gray;

/// Minimum distance from the outline of an occluding object and from the image border at which a
/// corner counts as visible or hidden, sensor pixels.
const CLEAR_PX: f64 = 3.0;

/// Fraction of its contrast below which glare makes a corner invisible.
const MIN_CONTRAST: f64 = 0.5;

/// Focal length in image widths: a field of view of 53°.
const FOCAL_WIDTHS: f64 = 1.0;

/// Range of the distortion coefficient.
const LENS: std::ops::Range<f64> = -0.02..0.12;

/// Maximum offset of the board centre from the image centre, as a fraction of the image height.
const OFF_CENTRE: f64 = 0.06;

/// Visibility of a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sight {
    /// The corner is visible.
    Visible,
    /// The corner is close to the outline of a cover or to the image border.
    Beside,
    /// Glare leaves too little contrast.
    Glared,
    /// The corner is under a cover.
    Covered,
}

/// A corner at its true position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TrueCorner {
    /// Corner id in the target.
    pub id: u32,
    /// Panel id.
    pub panel: u32,
    /// Lattice row.
    pub row: i32,
    /// Lattice column.
    pub col: i32,
    /// Horizontal position, px; pixel centres at integers.
    pub x: f64,
    /// Vertical position, px, downwards.
    pub y: f64,
    /// Visibility.
    pub sight: Sight,
}

/// A photograph and its ground truth.
pub struct Photograph {
    /// The image in the file.
    pub image: Gray<u8>,
    /// All corners inside the image.
    pub corners: Vec<TrueCorner>,
    /// Length of a tile edge in the middle of the board before tilting, px.
    pub edge_px: f64,
}

/// Independent random streams.
#[derive(Clone, Copy)]
enum Stream {
    Pose,
    Light,
    Covers,
    Background,
    Noise,
}

fn random(seed: u64, view: u64, of: Stream) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(view << 8 | of as u64);
    rng
}

/// Takes a photograph. The same page, scene, seed and view produce the same bytes.
pub fn take(page: &PrintedPage, studio: &Studio, scene: &Scene, view: u64) -> Photograph {
    let seed = studio.seed;
    let rng = |of| random(seed, view, of);
    let camera = pose(page, scene, &mut rng(Stream::Pose));
    let seen: Vec<(&PageCorner, DVec2)> = page
        .corners
        .iter()
        .filter_map(|corner| Some((corner, camera.px_from_page(corner.page_mm)?)))
        .collect();
    let places: Vec<DVec2> = seen.iter().map(|(_, place)| *place).collect();
    let covers = Covers::over(&places, scene.covered, view % 2 == 1, &mut rng(Stream::Covers));
    let light = light(scene, &places, &mut rng(Stream::Light));
    let mut around = rng(Stream::Background);
    let shift = DVec2::new(around.random_range(0.0..1e3), around.random_range(0.0..1e3));
    let setting = Setting {
        page,
        view: &camera,
        covers: &covers,
        background: studio.background(scene.background),
        shift,
        skin: studio.skin(),
        light: &light,
    };
    let image = record(&expose(&setting, scene), scene, &mut rng(Stream::Noise));

    let size_px = camera.size_px;
    let scale = scene.scale();
    let corners = seen
        .into_iter()
        .filter(|(_, place)| {
            let within = |v: f64, size: usize| (-0.5..size as f64 - 0.5).contains(&v);
            within(place.x, size_px[0]) && within(place.y, size_px[1])
        })
        .map(|(&PageCorner { id, panel, row, col, .. }, place)| {
            let sight = sight(place, scene, size_px, &covers, &light);
            let DVec2 { x, y } = (place + 0.5) * scale - 0.5;
            TrueCorner { id, panel, row, col, x, y, sight }
        })
        .collect();
    Photograph { image, corners, edge_px: scale * scene.bit_px * page.edge_mm / page.bit_mm }
}

fn pose(page: &PrintedPage, scene: &Scene, rng: &mut ChaCha8Rng) -> View {
    let [width, height] = scene.size_px.map(|size| size as f64);
    let focal_px = FOCAL_WIDTHS * width;
    let (middle_mm, board_mm) = page.board_mm();
    // Every scene draws the same random numbers.
    let (roll, towards) = (rng.random_range(0.0..TAU), rng.random_range(0.0..TAU));
    let any_tilt = rng.random_range(0.0..MAX_TILT_DEG);
    let offset = DVec2::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
    let lens = rng.random_range(LENS);
    let (bent_along, bent_up) = (rng.random_range(0.0..TAU), rng.random_bool(0.5));

    let tilt = scene.tilt_deg.unwrap_or(any_tilt).to_radians();
    let axis = DVec3::new(towards.cos(), towards.sin(), 0.0);
    let rotation = DMat3::from_axis_angle(axis, tilt)
        * DMat3::from_rotation_z(roll)
        * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let distance_mm = focal_px * page.bit_mm / scene.bit_px;
    let off_mm = offset * OFF_CENTRE * height * distance_mm / focal_px;
    let curl = (scene.curl > 0.0).then(|| {
        // Sag h over the width w: ρ = w² / 8h.
        let radius_mm = board_mm.max_element() / (8.0 * scene.curl);
        let radius_mm = if bent_up { radius_mm } else { -radius_mm };
        Curl { radius_mm, along: DVec2::from_angle(bent_along) }
    });
    View {
        size_px: scene.size_px,
        focal_px,
        lens,
        middle_mm,
        curl,
        place: Place::new(rotation, off_mm.extend(distance_mm)),
    }
}

fn light(scene: &Scene, places: &[DVec2], rng: &mut ChaCha8Rng) -> Light {
    let [width, height] = scene.size_px.map(|size| size as f64);
    let from = DVec2::from_angle(rng.random_range(0.0..TAU));
    let motion = DVec2::from_angle(rng.random_range(0.0..TAU));
    let n = places.len().max(1) as f64;
    let middle = places.iter().sum::<DVec2>() / n;
    let reach = places.iter().map(|place| place.distance(middle)).fold(1.0, f64::max);
    let spots = (0..scene.glare)
        .map(|_| {
            let turn = DVec2::from_angle(rng.random_range(0.0..TAU));
            let at = middle + turn * reach * rng.random_range(0.0..0.8);
            let sigma_px = [0.12, 0.06].map(|part| reach * part * rng.random_range(0.8..1.4));
            let along = DVec2::from_angle(rng.random_range(0.0..TAU));
            Spot { at, sigma_px, along, peak: rng.random_range(1.5..3.0) }
        })
        .collect();
    Light {
        slope: from * scene.gradient / width.hypot(height),
        vignetting: scene.vignetting,
        spots,
        motion,
    }
}

/// Returns the visibility of a corner.
fn sight(
    place: DVec2,
    scene: &Scene,
    size_px: [usize; 2],
    covers: &Covers,
    light: &Light,
) -> Sight {
    let inside = |axis: usize| {
        let v = place[axis];
        v >= CLEAR_PX && v <= size_px[axis] as f64 - 1.0 - CLEAR_PX
    };
    let cover_px = covers.distance(place);
    if cover_px < -CLEAR_PX {
        return Sight::Covered;
    }
    if cover_px < CLEAR_PX || !inside(0) || !inside(1) {
        return Sight::Beside;
    }
    let even = light.even_part(place, size_px);
    let recorded =
        |reflected: f64, glare: f64| (scene.exposure * (reflected * even + glare)).clamp(0.0, 1.0);
    let contrast =
        |glare| recorded(scene.white, glare) - recorded(scene.white / scene.contrast, glare);
    match contrast(light.glare(place)) < MIN_CONTRAST * contrast(0.0) {
        true => Sight::Glared,
        false => Sight::Visible,
    }
}
