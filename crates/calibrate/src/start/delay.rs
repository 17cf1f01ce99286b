//! Detection of cameras that lag by some frames: a missed trigger, or a recording that began later.
//!
//! The relative pose of two cameras that see one target is the same in all frames if the images were taken at the same
//! time. Rotations between frames are equally large for every camera, regardless of the target that
//! it sees. The lag is the shift at which the relative poses scatter least. Without a common
//! target, the scatter of the rotations is used.

use std::collections::BTreeMap;

use super::relative_poses::{ByFrame, Seen};
use super::symmetry::{Symmetries, agreed};
use crate::input::calibration::Calibration;
use crate::input::sample::evenly;
use deltille_core::statistics::median;

/// Largest lag that is detected, frames.
const MAX_DELAY: i32 = 10;

/// Minimum and maximum number of frames used for comparing lags; more frames do not help.
const MIN_MOMENTS: usize = 8;
const MAX_MOMENTS: usize = 60;

/// Factor by which the scatter at the lag must be smaller than without the lag. A target that
/// hardly moved, or moved uniformly from frame to frame, does not reveal a lag, and the lag then
/// needs no correction.
const DECISIVE: f64 = 3.0;

/// Maximum number of frames over which rotations are compared.
const LONGEST_SPAN: usize = 3;

/// The observations of a camera in each frame, in order.
type Track<'a> = Vec<&'a [Seen]>;

/// Returns the lag of each camera in frames, relative to most of the others.
pub(super) fn delays(
    calibration: &Calibration,
    seen: &ByFrame,
    symmetries: &Symmetries,
) -> Vec<i32> {
    let order = calibration.moments();
    let at = |of_camera: &'_ BTreeMap<String, Vec<Seen>>| -> Vec<Vec<Seen>> {
        order.iter().map(|name| of_camera.get(name).cloned().unwrap_or_default()).collect()
    };
    let held: Vec<Vec<Vec<Seen>>> = seen.iter().map(at).collect();
    let tracks: Vec<Track> =
        held.iter().map(|of_camera| of_camera.iter().map(Vec::as_slice).collect()).collect();
    let mut found: Vec<Option<i32>> = vec![None; tracks.len()];
    found[0] = Some(0);
    // From camera to camera, along the pairs with the most information.
    loop {
        let placed = (0..tracks.len()).filter_map(|from| Some((from, found[from]?)));
        let pairs = placed.flat_map(|(from, delay)| {
            let open = (0..tracks.len()).filter(|&to| found[to].is_none());
            open.map(move |to| (from, delay, to)).collect::<Vec<_>>()
        });
        let compared = pairs.filter_map(|(from, delay, to)| {
            let (by, moments) = delay_between(&tracks[from], &tracks[to], symmetries)?;
            Some((moments, std::cmp::Reverse(from), std::cmp::Reverse(to), delay + by))
        });
        let Some((_, _, to, delay)) = compared.max() else { break };
        found[to.0] = Some(delay);
    }
    let found: Vec<i32> = found.into_iter().map(Option::unwrap_or_default).collect();
    let usual = usual(&found);
    found.into_iter().map(|delay| delay - usual).collect()
}

/// The most frequent lag; of equally frequent lags, that of the first camera, if it is one of them.
fn usual(delays: &[i32]) -> i32 {
    let count = |delay: &i32| delays.iter().filter(|other| *other == delay).count();
    let most = delays.iter().map(count).max().unwrap_or_default();
    delays.iter().find(|&delay| count(delay) == most).copied().unwrap_or_default()
}

/// The lag of a camera relative to another, and the number of informative frames; `None` if these are too few.
fn delay_between(from: &Track, to: &Track, symmetries: &Symmetries) -> Option<(i32, usize)> {
    let scatters = |how: &dyn Fn(i32) -> Option<(f64, usize)>| {
        let all = (-MAX_DELAY..=MAX_DELAY).filter_map(|delay| Some((delay, how(delay)?)));
        all.collect::<Vec<(i32, (f64, usize))>>()
    };
    let mut all = scatters(&|delay| scatter_of_poses(from, to, delay, symmetries));
    if all.is_empty() {
        all = scatters(&|delay| scatter_of_rotations(from, to, delay, symmetries));
    }
    let &(delay, (least, moments)) = all.iter().min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    let in_time = all.iter().find(|(delay, _)| *delay == 0);
    let usual = || median(all.iter().map(|(_, (scatter, _))| *scatter).collect());
    let (compared, of_moments) = match in_time {
        Some((_, (scatter, moments))) => (*scatter, *moments),
        None => (usual()?, moments),
    };
    // Coincidental agreement in a few frames does not outweigh agreement in many.
    match DECISIVE * least < compared && 2 * moments >= of_moments {
        true => Some((delay, moments)),
        false => Some((0, of_moments)),
    }
}

/// The paired frames of both tracks for this lag.
fn moments<'a>(
    from: &'a Track,
    to: &'a Track,
    delay: i32,
) -> impl Iterator<Item = (usize, usize)> + 'a {
    let both = (0..from.len()).filter_map(move |first| {
        let second = first.checked_add_signed(delay as isize)?;
        Some((first, second)).filter(|_| second < to.len())
    });
    both.filter(|&(first, second)| !from[first].is_empty() && !to[second].is_empty())
}

/// Scatter of the pose of one camera in the other, mm, from the targets that both see.
fn scatter_of_poses(
    from: &Track,
    to: &Track,
    delay: i32,
    symmetries: &Symmetries,
) -> Option<(f64, usize)> {
    let relative = moments(from, to, delay).filter_map(|(first, second)| {
        let mut pairs = from[first].iter().flat_map(|a| to[second].iter().map(move |b| (a, b)));
        let (a, b) = pairs.find(|(a, b)| a.target == b.target)?;
        Some(symmetries.relative(a, b))
    });
    let relative: Vec<_> = relative.collect();
    let count = relative.len();
    let moments: Vec<_> = evenly(&relative, MAX_MOMENTS).cloned().collect();
    (count >= MIN_MOMENTS).then(|| Some((agreed(&moments)?.spread_mm, count))).flatten()
}

/// Difference of the rotations between frames as seen by the two cameras, rad.
fn scatter_of_rotations(
    from: &Track,
    to: &Track,
    delay: i32,
    symmetries: &Symmetries,
) -> Option<(f64, usize)> {
    let both: Vec<(usize, usize)> = moments(from, to, delay).collect();
    let mut off = Vec::new();
    for (index, &(first, second)) in both.iter().enumerate() {
        let later = both[index + 1..].iter().take_while(|(a, _)| *a <= first + LONGEST_SPAN);
        for &(first_later, second_later) in later {
            let a = rotations_rad(from[first], from[first_later], symmetries);
            let b = rotations_rad(to[second], to[second_later], symmetries);
            let all = a.iter().flat_map(|a| b.iter().map(move |b| (a - b).abs()));
            off.extend(all.min_by(f64::total_cmp));
        }
    }
    let count = off.len();
    (count >= MIN_MOMENTS).then(|| median(off)).flatten().map(|scatter| (scatter, count))
}

/// Rotation of a target between two frames: with the detected labels, then with those of the second frame rotated.
/// Empty if no target is seen in both.
fn rotations_rad(before: &[Seen], after: &[Seen], symmetries: &Symmetries) -> Vec<f64> {
    let mut pairs = before.iter().flat_map(|a| after.iter().map(move |b| (a, b)));
    let Some((a, b)) = pairs.find(|(a, b)| a.target == b.target) else { return Vec::new() };
    let rotation = a.camera_from_target.rotation;
    symmetries.poses(b).map(|pose| rotation.angle_between(pose.rotation)).collect()
}

/// Moves the observations of lagging cameras to the frames that they show.
pub(super) fn in_time(calibration: &Calibration, delays: &[i32], seen: &mut ByFrame) {
    let order = calibration.moments();
    let places: BTreeMap<&str, usize> =
        order.iter().enumerate().map(|(place, name)| (name.as_str(), place)).collect();
    for ((of_camera, camera), &delay) in seen.iter_mut().zip(&calibration.cameras).zip(delays) {
        let moment = |name: String| {
            let place = places
                .get(name.as_str())
                .and_then(|&place| place.checked_add_signed(-(delay as isize)));
            match place.and_then(|place| order.get(place)) {
                Some(moment) => moment.clone(),
                // The lag leads to a time before the first frame of the others, or after their
                // last.
                None => format!("{name} of {}", camera.name),
            }
        };
        if delay != 0 {
            *of_camera = std::mem::take(of_camera)
                .into_iter()
                .map(|(name, views)| (moment(name), views))
                .collect();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_frequent_lag_is_the_reference() {
        assert_eq!(usual(&[0, -1, -1, -1]), -1);
        assert_eq!(usual(&[0, 2]), 0);
        assert_eq!(usual(&[0, 0, 1, 1]), 0);
    }
}
