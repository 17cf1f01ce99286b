//! Untagged boards of small tiles, on a page with a narrow margin and text, and under rectangular covers: every corner
//! found is a corner of the board.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::lattice::{GridKind, Vertex};
use deltille::raster::{Gray, gaussian};
use deltille::targets::board_vertices;
use glam::DVec2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const WIDTH: usize = 280;
const HEIGHT: usize = 240;

/// Samples per pixel in each direction.
const PARTS: usize = 3;

/// Sharpening by the camera: the multiple of the difference from a smooth image that is added.
const SHARPENING: f32 = 0.6;

/// Exponent of the tone curve of the camera.
const TONE: f32 = 0.45;

/// Rows and columns of corners.
const SIZE: (u32, u32) = (6, 9);

/// A view of a board: an affine map from edges of the print to pixels.
struct View {
    kind: GridKind,
    middle: DVec2,
    axes: [DVec2; 2],
}

impl View {
    /// A random view with tiles of `edge_px`, foreshortened by up to a quarter.
    fn new(kind: GridKind, edge_px: f64, rng: &mut ChaCha8Rng) -> Self {
        let (roll, tilted) = (rng.random_range(0.0..TAU), rng.random_range(0.0..PI));
        let [along, short] = [DVec2::from_angle(tilted), DVec2::from_angle(tilted).perp()];
        let part = rng.random_range(0.75..1.0);
        let seen = |v: DVec2| {
            let v = v.dot(along) * along + part * v.dot(short) * short;
            edge_px * DVec2::from_angle(roll).rotate(v)
        };
        let middle = DVec2::new(WIDTH as f64, HEIGHT as f64) / 2.0;
        let middle = middle + DVec2::new(rng.random(), rng.random());
        // Rows of the print run upwards, those of the image downwards.
        Self { kind, middle, axes: [seen(DVec2::X), seen(-DVec2::Y)] }
    }

    fn vertices(&self) -> Vec<Vertex> {
        board_vertices(self.kind, SIZE.0, SIZE.1)
    }

    fn on_print(&self, v: Vertex) -> DVec2 {
        self.kind.position(v.row.into(), v.col.into())
    }

    fn centre(&self) -> DVec2 {
        let places: Vec<DVec2> = self.vertices().iter().map(|&v| self.on_print(v)).collect();
        places.iter().sum::<DVec2>() / places.len() as f64
    }

    /// Pixels of the corners.
    fn corners(&self) -> Vec<DVec2> {
        let centre = self.centre();
        let seen = |&v: &Vertex| {
            let DVec2 { x, y } = self.on_print(v) - centre;
            self.middle + x * self.axes[0] + y * self.axes[1]
        };
        self.vertices().iter().map(seen).collect()
    }

    /// Edges of the print at a pixel.
    fn print_at(&self, px: DVec2) -> DVec2 {
        let [a, b] = self.axes;
        let off = px - self.middle;
        DVec2::new(off.perp_dot(b), a.perp_dot(off)) / a.perp_dot(b) + self.centre()
    }

    /// Returns the image, with 0.8 px of blur, a tone curve, sharpening and 0.7 % of noise. The page ends `margin` edges beyond the tiles; strokes
    /// of letters are within this margin. `cover` is the brightness of a covering object at a pixel.
    fn photograph(
        &self,
        margin: f64,
        cover: impl Fn(DVec2) -> Option<f32>,
        rng: &mut ChaCha8Rng,
    ) -> Gray<u8> {
        let corners: BTreeSet<Vertex> = self.vertices().into_iter().collect();
        let places: Vec<DVec2> = corners.iter().map(|&v| self.on_print(v)).collect();
        let low = places.iter().copied().fold(DVec2::INFINITY, DVec2::min) - DVec2::ONE;
        let high = places.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max) + DVec2::ONE;
        // Upright and slanted strokes between the tiles and the end of the page.
        let stroke = |rng: &mut ChaCha8Rng| {
            let at = low.lerp(high, rng.random_range(0.0..0.8));
            let (low, high) = (low - 0.9 * margin, high + 0.3 * margin);
            let start = match rng.random_range(0..4) {
                0 => DVec2::new(at.x, low.y),
                1 => DVec2::new(at.x, high.y),
                2 => DVec2::new(low.x, at.y),
                _ => DVec2::new(high.x, at.y),
            };
            let way = DVec2::new(rng.random_range(0.0..1.0), rng.random_range(0.0..1.0));
            (start, start + 0.6 * margin * way)
        };
        let strokes: Vec<(DVec2, DVec2)> = (0..30).map(|_| stroke(rng)).collect();
        let thick = 0.1 * margin;
        let tile = |p: DVec2| {
            let DVec2 { x, y } = match self.kind {
                GridKind::Checker => p,
                GridKind::Deltille => {
                    let row = p.y / self.kind.position(1.0, 0.0).y;
                    DVec2::new(p.x - 0.5 * row, row)
                }
            };
            let (col, row) = (x.floor(), y.floor());
            let first = Vertex::new(row as i32, col as i32);
            let (is_dark, around) = match self.kind {
                GridKind::Checker => ((row + col).rem_euclid(2.0) < 1.0, 4),
                GridKind::Deltille => (x - col + y - row < 1.0, 3),
            };
            let all = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(r, c)| first + Vertex::new(r, c));
            is_dark && all[..around].iter().any(|v| corners.contains(v))
        };
        let print = |p: DVec2| {
            let is_off =
                (p - low + margin).min_element().min((high + margin - p).min_element()) < 0.0;
            let is_letter = || {
                strokes.iter().any(|&(from, to)| {
                    let way = to - from;
                    let part = ((p - from).dot(way) / way.length_squared()).clamp(0.0, 1.0);
                    p.distance(from + part * way) < thick
                })
            };
            match is_off {
                true => 0.25,
                false if tile(p) || is_letter() => 0.08,
                false => 0.8,
            }
        };
        let sharp = Gray::from_fn(PARTS * WIDTH, PARTS * HEIGHT, |x, y| {
            let to = |v: usize| (v as f64 - 1.0) / PARTS as f64;
            let px = DVec2::new(to(x), to(y));
            cover(px).unwrap_or_else(|| print(self.print_at(px)))
        });
        let blurred = gaussian(&sharp, 0.8 * PARTS as f64);
        let smooth = gaussian(&blurred, 1.2 * PARTS as f64);
        Gray::from_fn(WIDTH, HEIGHT, |x, y| {
            let noise: f32 = StandardNormal.sample(rng);
            let [value, around] =
                [&blurred, &smooth].map(|image| image.at(PARTS * x + 1, PARTS * y + 1));
            let [value, around] = [value, around].map(|light| light.powf(TONE));
            let value = value + SHARPENING * (value - around) + 0.007 * noise;
            (255.0 * value).clamp(0.0, 255.0) as u8
        })
    }
}

/// Returns the distances, px, of all corners found from the nearest corner of the board.
fn distances(found: &Detection, corners: &[DVec2]) -> Vec<f64> {
    let seen = found.grids.iter().flat_map(|grid| &grid.corners);
    seen.map(|corner| {
        let away = corners.iter().map(|place| place.distance(corner.position()));
        away.fold(f64::INFINITY, f64::min)
    })
    .collect()
}

fn detect(kind: GridKind, image: &Gray<u8>) -> Detection {
    Detector::for_grid(kind, None, DetectorConfig::default()).detect(image, "board")
}

#[test]
fn the_page_and_its_text_add_no_corners() {
    let mut rng = ChaCha8Rng::seed_from_u64(61);
    for kind in [GridKind::Deltille, GridKind::Checker] {
        for edge_px in [10.0, 13.0, 17.0, 19.0] {
            for margin in [0.35, 0.5, 0.8, 1.5] {
                let view = View::new(kind, edge_px, &mut rng);
                let image = view.photograph(margin, |_| None, &mut rng);
                let (found, corners) = (detect(kind, &image), view.corners());
                let name = format!("{kind:?}, {edge_px} px, margin {margin}");
                let off = distances(&found, &corners);
                assert_eq!(off.len(), corners.len(), "{name}");
                assert!(off.iter().all(|&px| px < 0.5), "{name}: {off:?}");
            }
        }
    }
}

#[test]
fn a_cover_adds_no_corners() {
    let mut rng = ChaCha8Rng::seed_from_u64(62);
    let mut seen = 0;
    for kind in [GridKind::Deltille, GridKind::Checker] {
        for (edge_px, area) in [(12.0, 0.2), (12.0, 0.4), (18.0, 0.2), (18.0, 0.4)] {
            for shade in [0.05, 0.4, 0.9] {
                let view = View::new(kind, edge_px, &mut rng);
                let corners = view.corners();
                let [a, b] = view.axes;
                let board_px2 = f64::from((SIZE.0 + 1) * (SIZE.1 + 1)) * a.perp_dot(b).abs();
                let half = (area * board_px2).sqrt() / 2.0;
                let middle = corners[rng.random_range(0..corners.len())].lerp(view.middle, 0.4);
                let turned = DVec2::from_angle(rng.random_range(0.0..1.57));
                let is_under = |px: DVec2| turned.rotate(px - middle).abs().max_element() < half;
                let cover = |px| is_under(px).then_some(shade);
                let image = view.photograph(1.0, cover, &mut rng);
                let off = distances(&detect(kind, &image), &corners);
                let name = format!("{kind:?}, {edge_px} px, {area} covered by {shade}");
                assert!(off.iter().all(|&px| px < 0.25 * edge_px), "{name}: {off:?}");
                seen += off.len();
            }
        }
    }
    // Twenty-four boards, covered by less than half.
    assert!(seen > 500, "{seen}");
}
