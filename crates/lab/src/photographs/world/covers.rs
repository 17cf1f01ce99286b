//! Objects on or in front of the board: hands, cables, cups, drawn as rounded strokes in the image.

use glam::DVec2;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// A stroke with round ends.
#[derive(Clone, Copy, Debug)]
struct Stroke {
    from: DVec2,
    to: DVec2,
    radius: f64,
    /// Fraction of the light that it reflects.
    tone: f64,
}

/// All objects that cover a board, in image pixels.
#[derive(Clone, Debug, Default)]
pub struct Covers(Vec<Stroke>);

/// Number of steps by which a hand is moved in.
const STEPS: u32 = 200;

/// Maximum number of hands over a board; two cover half of it.
const MAX_HANDS: u32 = 6;

/// Maximum number of objects placed on a board until enough of it is covered.
const MAX_THINGS: usize = 500;

impl Covers {
    /// Creates covers over a given fraction of the positions: hands that reach in from the sides, or, if `scattered`,
    /// objects distributed over the board.
    pub fn over(places: &[DVec2], part: f64, scattered: bool, rng: &mut ChaCha8Rng) -> Self {
        if part <= 0.0 || places.is_empty() {
            return Self::default();
        }

        let middle = places.iter().sum::<DVec2>() / places.len() as f64;
        let reach = places.iter().map(|place| place.distance(middle)).fold(0.0, f64::max);
        let mut covers = Self::default();
        let enough = |covers: &Self, part: f64| {
            let hidden = places.iter().filter(|&&place| covers.distance(place) < 0.0);
            hidden.count() as f64 >= part * places.len() as f64
        };
        if scattered {
            while !enough(&covers, part) && covers.0.len() < MAX_THINGS {
                let from = middle
                    + reach * DVec2::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
                let turn = rng.random_range(0.0..std::f64::consts::TAU);
                let to = from + DVec2::from_angle(turn) * reach * rng.random_range(0.0..0.5);
                let radius = reach * rng.random_range(0.02..0.14);
                covers.0.push(Stroke { from, to, radius, tone: rng.random_range(0.05..0.8) });
            }
            return covers;
        }
        // One hand for each third of the board, from all directions.
        let first = rng.random_range(0.0..std::f64::consts::TAU);
        for hand in 1..=MAX_HANDS {
            let turn = first + f64::from(hand) * rng.random_range(2.0..2.8);
            let share = part.min(f64::from(hand) / 3.0);
            let shape = hand_shape(reach, rng);
            let towards = DVec2::from_angle(turn);
            for step in 0..STEPS {
                let out = 2.6 - 2.6 * f64::from(step) / f64::from(STEPS);
                let tip = middle - towards * reach * (out - 1.0);
                let placed = shape.iter().map(|stroke| Stroke {
                    from: tip + towards.rotate(stroke.from),
                    to: tip + towards.rotate(stroke.to),
                    ..*stroke
                });
                let mut with = covers.clone();
                with.0.extend(placed);
                if enough(&with, share) || step + 1 == STEPS {
                    covers = with;
                    break;
                }
            }
            if enough(&covers, part) {
                break;
            }
        }
        covers
    }

    /// Returns the distance from the nearest cover outline, px, negative inside.
    pub fn distance(&self, place: DVec2) -> f64 {
        self.nearest(place).map_or(f64::INFINITY, |(distance, _)| distance)
    }

    fn nearest(&self, place: DVec2) -> Option<(f64, &Stroke)> {
        let distances = self.0.iter().map(|stroke| (stroke.distance(place), stroke));
        distances.min_by(|(a, _), (b, _)| a.total_cmp(b))
    }

    /// Returns the fraction of light that a cover reflects at a position, darker towards the outline as on round
    /// objects; `None` outside all covers.
    pub fn tone(&self, place: DVec2) -> Option<f64> {
        let (distance, stroke) = self.nearest(place).filter(|(distance, _)| *distance < 0.0)?;
        let rim = 1.0 + distance / stroke.radius;
        Some(stroke.tone * (1.0 - 0.45 * rim.powi(4)))
    }

    /// Returns the covers that reach into an image row.
    pub fn in_row(&self, y: f64) -> Self {
        let reaches = |stroke: &&Stroke| {
            (y >= stroke.from.y.min(stroke.to.y) - stroke.radius)
                && (y <= stroke.from.y.max(stroke.to.y) + stroke.radius)
        };
        Self(self.0.iter().filter(reaches).copied().collect())
    }

    /// Returns whether nothing covers the board.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl Stroke {
    fn distance(&self, place: DVec2) -> f64 {
        let along = self.to - self.from;
        let t = (place - self.from).dot(along) / along.length_squared().max(1e-12);
        place.distance(self.from + along * t.clamp(0.0, 1.0)) - self.radius
    }
}

/// Returns four fingers and a palm, pointing along x, with the fingertips near the origin.
fn hand_shape(size: f64, rng: &mut ChaCha8Rng) -> Vec<Stroke> {
    let tone = rng.random_range(0.25..0.55);
    let radius = size * rng.random_range(0.075..0.1);
    let mut strokes: Vec<Stroke> = (0..4)
        .map(|finger| {
            let across = (f64::from(finger) - 1.5) * 2.6 * radius;
            let tip = -size * rng.random_range(0.0..0.18);
            let knuckle = DVec2::new(-0.75 * size, 0.8 * across);
            Stroke { from: DVec2::new(tip, across), to: knuckle, radius, tone }
        })
        .collect();
    let (wrist, palm) = (DVec2::new(-2.5 * size, 0.0), DVec2::new(-size, 0.0));
    strokes.push(Stroke { from: palm, to: wrist, radius: 4.5 * radius, tone });
    strokes
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn the_requested_fraction_is_covered() {
        let places: Vec<DVec2> =
            (0..400).map(|i| 10.0 * DVec2::new(f64::from(i % 20), f64::from(i / 20))).collect();
        for seed in 0..10 {
            for (part, scattered) in [(0.2, false), (0.4, false), (0.6, false), (0.4, true)] {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                let covers = Covers::over(&places, part, scattered, &mut rng);
                let hidden = places.iter().filter(|&&place| covers.tone(place).is_some()).count();
                let hidden = hidden as f64 / 400.0;
                assert!(hidden >= part && hidden < part + 0.12, "{part} {scattered}: {hidden}");
            }
        }
    }
}
