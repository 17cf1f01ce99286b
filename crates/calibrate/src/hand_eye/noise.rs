//! The noise of the robot as variance components, and wrong poses.
//!
//! With residuals r of the links and covariances C of their predictions, the variance of a group of residuals (rotations or
//! translations) is
//!
//! ```text
//!     σ² = Σ|r|² / (3 m − Σ tr C / σ²)
//! ```
//!
//! for m links, where the denominator is the redundancy of the group (Helmert; Förstner & Wrobel 2016, 4.2.4). It is iterated
//! because r and C depend on σ.

use nalgebra::{Matrix6, Vector6};

use crate::equations::minimise::Minimum;
use crate::input::robot::RobotNoise;
use deltille_core::statistics::{f_p_value, median};

/// Smallest standard deviations of a robot, rad and mm: better than any encoder.
const MIN_NOISE: [f64; 2] = [1e-6, 1e-3];

/// Probability of a residual beyond which a pose is wrong: that of a corner beyond 5σ.
pub(super) const WRONG: f64 = 4e-6;

/// The median of a squared length in space, for coordinates with variance 1.
const MEDIAN_OF_CHI_SQUARED_3: f64 = 2.366;

/// Largest change of a standard deviation in one iteration, as a factor.
const MAX_CHANGE: f64 = 10.0;

/// Change of a standard deviation that is small compared with its own uncertainty.
const SETTLED: f64 = 0.01;

/// The residual of a frame, and the covariance of its prediction.
type Residual = (Vector6<f64>, Matrix6<f64>);

/// The residuals of all frames.
pub(super) struct Links {
    /// Of each frame with a pose of the robot.
    all: Vec<Option<Residual>>,
    used: Vec<bool>,
}

/// The noise and its degrees of freedom.
#[derive(Clone, Copy, Debug)]
pub(super) struct Components {
    pub noise: RobotNoise,
    pub freedom: [f64; 2],
}

impl Links {
    /// `measured` are the poses of all frames, also of those whose links are not used.
    pub(super) fn of(
        minimum: &Minimum,
        measured: &[Option<deltille_core::camera::Pose>],
    ) -> Option<Self> {
        let Minimum { problem, normal, layout, .. } = minimum;
        let robot = problem.robot.as_ref()?;
        let found = normal.covariances(layout)?;
        let covariances = normal.of_links(problem, layout, &found)?;
        let of = |((frame, measured), covariance): ((_, &Option<_>), Option<Matrix6<f64>>)| {
            let link = robot.link(frame, measured.as_ref()?);
            Some((link.off, covariance? * robot.variance))
        };
        let all = problem.frames.iter().zip(measured).zip(covariances).map(of);
        Some(Self { all: all.collect(), used: robot.poses.iter().map(Option::is_some).collect() })
    }

    fn used(&self) -> impl Iterator<Item = &Residual> {
        let used = self.all.iter().zip(&self.used).filter(|(_, used)| **used);
        used.filter_map(|(link, _)| link.as_ref())
    }

    /// The next values of the noise.
    pub(super) fn components(&self, now: RobotNoise) -> Components {
        let mut freedom = [0.0; 2];
        let next = [(0, now.rotation_rad), (3, now.translation_mm)].map(|(first, sd)| {
            let (mut squares, mut trace, mut count) = (0.0, 0.0, 0.0);
            for (off, covariance) in self.used() {
                squares += off.fixed_rows::<3>(first).norm_squared();
                trace += covariance.fixed_view::<3, 3>(first, first).trace();
                count += 3.0;
            }
            let group = first / 3;
            let redundancy: f64 = count - trace / (sd * sd);
            freedom[group] = redundancy.max(0.0);
            // Without redundancy, the iteration by expectation and maximisation is stable.
            let variance =
                if redundancy > 1.0 { squares / redundancy } else { (squares + trace) / count };
            variance.sqrt().clamp(sd / MAX_CHANGE, sd * MAX_CHANGE).max(MIN_NOISE[group])
        });
        let [rotation_rad, translation_mm] = next;
        Components { noise: RobotNoise { rotation_rad, translation_mm }, freedom }
    }

    /// Which frames have a right pose: their residual is as likely as others.
    pub(super) fn right(&self, now: &Components) -> Vec<bool> {
        let RobotNoise { rotation_rad, translation_mm } = now.noise;
        let [turn, step] = [rotation_rad, translation_mm].map(|sd| sd * sd);
        let own = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, step, step, step));
        // Of one component: its uncertainty determines the tail of the squared length.
        let freedom = 3.0 * self.used().count() as f64 - 6.0;
        let is_right = |(link, used): (&Option<Residual>, &bool)| {
            let Some((off, covariance)) = link else { return false };
            // The prediction of a used link includes the link. Robust weights of corners may make its covariance too large.
            let whole = if *used { own - covariance } else { own + covariance };
            let solved = whole
                .cholesky()
                .map_or_else(|| off.component_div(&own.diagonal()), |factor| factor.solve(off));
            is_plausible(off.dot(&solved), freedom)
        };
        self.all.iter().zip(&self.used).map(is_right).collect()
    }
}

/// Whether noise explains the squared length of a whitened residual.
fn is_plausible(squared: f64, freedom: f64) -> bool {
    f_p_value(squared / 6.0, 6.0, freedom.max(1.0)) > WRONG
}

impl Components {
    /// Whether noise explains a residual of these lengths (rad, mm).
    pub(super) fn explain(&self, [turn, step]: [f64; 2]) -> bool {
        let RobotNoise { rotation_rad, translation_mm } = self.noise;
        let squared = (turn / rotation_rad).powi(2) + (step / translation_mm).powi(2);
        is_plausible(squared, self.freedom[0])
    }
}

/// A robust first value of the noise from residuals (rad, mm) of m links, to which 12 unknowns were fitted.
pub(super) fn first(off: &[[f64; 2]]) -> Components {
    let count = off.len() as f64;
    let lost = 6.0_f64.min(3.0 * count - 1.0);
    let inflated = 3.0 * count / (3.0 * count - lost);
    let sd = |group: usize| {
        let squares = off.iter().map(|off| off[group].powi(2)).collect();
        let variance = median(squares).unwrap_or(0.0) / MEDIAN_OF_CHI_SQUARED_3 * inflated;
        variance.sqrt().max(MIN_NOISE[group])
    };
    let noise = RobotNoise { rotation_rad: sd(0), translation_mm: sd(1) };
    Components { noise, freedom: [3.0 * count - lost; 2] }
}

/// Whether the noise hardly changes.
pub(super) fn are_equal(one: RobotNoise, other: RobotNoise) -> bool {
    let near = |one: f64, other: f64| (one / other - 1.0).abs() < SETTLED;
    near(one.rotation_rad, other.rotation_rad) && near(one.translation_mm, other.translation_mm)
}
