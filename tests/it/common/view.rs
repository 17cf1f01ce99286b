use deltille::camera::Pose;
use glam::DVec3;
use rand::Rng;

/// Returns a pose that looks at a point of a board from `tilt` off its normal, from a random side and with a random
/// rotation about the line of sight.
pub fn tilted(rng: &mut impl Rng, centre_mm: DVec3, distance_mm: f64, tilt: f64) -> Pose {
    let [azimuth, roll] = [0; 2].map(|_| rng.random_range(0.0..std::f64::consts::TAU));
    let aside = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
    let direction = tilt.sin() * aside + tilt.cos() * DVec3::Z;
    let up = DVec3::new(roll.cos(), roll.sin(), 0.3);
    Pose::looking_at(centre_mm + distance_mm * direction, centre_mm, up)
}
