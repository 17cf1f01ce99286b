//! The pose of the robot for each photograph.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use super::error::{HandEyeError, named};
use crate::input::robot::{RobotPose, RobotPoses};
use crate::input::views::Named;
use deltille_core::statistics::median;
use deltille_core::words::counted;

/// How poses and photographs were paired.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PairedBy {
    /// By the names of the photographs.
    Name,
    /// By the nearest time stamp, at most half an interval between photographs away.
    Time,
    /// By the order of both.
    Order,
}

impl PairedBy {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Name => "name",
            Self::Time => "time",
            Self::Order => "order",
        }
    }
}

impl fmt::Display for PairedBy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Name => "name of the photograph",
            Self::Time => "time stamp",
            Self::Order => "order",
        })
    }
}

/// The poses of the photographs.
pub(super) struct Pairing {
    pub by: PairedBy,
    /// Index of the pose of each paired view, by the name of the view.
    pub poses: BTreeMap<String, usize>,
    /// Names of the photographs without a pose.
    pub unpaired: Vec<String>,
}

impl Pairing {
    /// Pairs by name if all poses name a photograph, else by time if all poses and photographs have a time, else by order
    /// if there are as many poses as photographs.
    pub(super) fn of(robot: &RobotPoses, photographs: &[Named<'_>]) -> Result<Self, HandEyeError> {
        let poses = &robot.poses;
        let (by, found) = if poses.iter().all(|pose| pose.image.is_some()) {
            (PairedBy::Name, by_name(poses, photographs)?)
        } else if let (Some(stamps), Some(times)) = (
            poses.iter().map(|pose| pose.time_ns).collect::<Option<Vec<i64>>>(),
            photographs.iter().map(|of| of.detection.time_ns).collect::<Option<Vec<i64>>>(),
        ) {
            (PairedBy::Time, by_time(&stamps, &times)?)
        } else if poses.len() == photographs.len() {
            (PairedBy::Order, (0..poses.len()).map(Some).collect())
        } else {
            return Err(HandEyeError::Pairing(format!(
                "{} but {}, without names or common time stamps; name the photograph of each pose (image)",
                counted(poses.len(), "pose"),
                counted(photographs.len(), "photograph")
            )));
        };
        let pairs = || photographs.iter().zip(&found);
        let unpaired = pairs().filter(|(_, pose)| pose.is_none());
        let unpaired = unpaired.map(|(of, _)| of.name.to_owned()).collect();
        let poses = pairs().filter_map(|(of, pose)| Some((of.name.to_owned(), (*pose)?)));
        Ok(Self { by, poses: poses.collect(), unpaired })
    }
}

/// The last part of a path without its extension.
fn stem(name: &str) -> &str {
    let stem = Path::new(name).file_stem().and_then(|stem| stem.to_str());
    stem.unwrap_or(name)
}

fn by_name(
    poses: &[RobotPose],
    photographs: &[Named<'_>],
) -> Result<Vec<Option<usize>>, HandEyeError> {
    let mut of_name = BTreeMap::new();
    for (index, image) in poses.iter().enumerate() {
        let image = image.image.as_deref().unwrap_or_default();
        if of_name.insert(stem(image), index).is_some() {
            let problem = format!("several poses are for {image}; give one for each photograph");
            return Err(HandEyeError::Pairing(problem));
        }
    }
    let find = |of: &Named<'_>| {
        let found = of_name.get(stem(&of.detection.image)).or_else(|| of_name.get(stem(of.name)));
        found.copied()
    };
    let found: Vec<Option<usize>> = photographs.iter().map(find).collect();
    if found.iter().all(Option::is_none) {
        let images = named(poses.iter().filter_map(|pose| pose.image.as_deref()));
        let own = named(photographs.iter().map(|of| of.name));
        let problem = format!("the poses are for {images}, but the photographs are {own}");
        return Err(HandEyeError::Pairing(problem));
    }
    Ok(found)
}

/// The nearest stamp of each photograph.
fn by_time(stamps: &[i64], times: &[i64]) -> Result<Vec<Option<usize>>, HandEyeError> {
    let mut sorted: Vec<(i64, usize)> = stamps.iter().copied().zip(0..).collect();
    sorted.sort_unstable();
    let mut ordered = times.to_vec();
    ordered.sort_unstable();
    let intervals = ordered.windows(2).map(|two| two[1].abs_diff(two[0]) as f64);
    let limit = 0.5 * median(intervals.collect()).unwrap_or(f64::INFINITY);
    let nearest = |time: &i64| {
        let next = sorted.partition_point(|(stamp, _)| stamp < time);
        let near = sorted[next.saturating_sub(1)..(next + 1).min(sorted.len())].iter();
        let nearest = near.min_by_key(|(stamp, _)| stamp.abs_diff(*time))?;
        (nearest.0.abs_diff(*time) as f64 <= limit).then_some(nearest.1)
    };
    let found: Vec<Option<usize>> = times.iter().map(nearest).collect();
    if let (true, Some(first), Some(stamp)) =
        (found.iter().all(Option::is_none), ordered.first(), sorted.first())
    {
        let seconds = |ns: i64| format!("{:.3} s", ns as f64 * 1e-9);
        let problem = format!(
            "the poses begin at {}, the photographs at {}, and none is at the same time; check the clocks",
            seconds(stamp.0),
            seconds(*first)
        );
        return Err(HandEyeError::Pairing(problem));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_pose_in_time_is_used_if_it_is_near() {
        let found = by_time(&[900, 2_010, 2_900, 3_100], &[1_000, 2_000, 3_000, 9_000]).unwrap();
        assert_eq!(found, [Some(0), Some(1), Some(2), None]);
        assert!(by_time(&[50_000], &[1_000, 2_000]).is_err());
    }
}
