//! Conversion of named detections to views, with checks for image sizes, duplicates, wrong labels and mirrored images.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};

use glam::DVec2;

use super::observation::{MIN_CORNERS, Sighting, View};
use super::photographs::MixedPhotographs;
use super::reference::Reference;
use crate::error::CalibrationError;
use crate::excluded::{Excluded, Reason};
use deltille_core::detection::Detection;
use deltille_core::targets::TargetIdentity;

/// Minimum excess of reversed over correctly oriented corners in a mirrored image, as a fraction of
/// all corners. In a mirrored image, only misplaced corners are not reversed.
const MIRRORED_MOST: f64 = 0.5;

/// Minimum excess in standard deviations. Misplaced corners have random orientations, and if there
/// are only a few, all may be reversed by coincidence. Of images that contain only misplaced
/// corners, one in a thousand reaches this value by coincidence.
const MIRRORED_SURE: f64 = 3.09;

/// The views of detections.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ViewSet {
    /// One view for each image, or for each board in it if the boards are not fixed to each other.
    pub views: Vec<View>,
    /// Indices of the empty detections.
    pub empty: Vec<usize>,
    /// Indices of the detections that are not of the target or duplicate another image, with the reason.
    pub excluded: Vec<(usize, Excluded)>,
    /// Cameras, lenses or focal lengths, if the photographs of the views were taken with several.
    pub mixed: Option<MixedPhotographs>,
}

/// A detection and the name of its view: the name of its image, or another name. Views of several
/// cameras taken at the same time have the same name.
#[derive(Clone, Copy, Debug)]
pub struct Named<'a> {
    pub(crate) name: &'a str,
    pub(crate) detection: &'a Detection,
}

impl<'a> From<&'a Detection> for Named<'a> {
    fn from(detection: &'a Detection) -> Self {
        Self { name: &detection.image, detection }
    }
}

impl<'a> From<&'a (String, Detection)> for Named<'a> {
    fn from((name, detection): &'a (String, Detection)) -> Self {
        Self { name, detection }
    }
}

/// Converts all detections to views. Fails if most of those that are not empty are not of the target.
///
/// ```
/// use deltille_calibrate::{Reference, views};
/// use deltille_core::camera::{Camera, Pose};
/// use deltille_detect::Detector;
/// use deltille_layout::synth::{Light, scene_of_target};
/// use deltille_core::targets::{BoardSpec, Target};
/// use glam::DVec3;
///
/// let board = Target::new("desk", BoardSpec::deltille(4, 5, 20.0))?;
/// let eye = DVec3::new(50.0, -60.0, 200.0);
/// let pose = Pose::looking_at(eye, board.panels[0].middle_mm(), DVec3::Y);
/// let scene = scene_of_target(&board)?;
/// let image = scene.render(&Camera::pinhole(640, 480, 1.0), &pose, &Light::default());
/// let found = Detector::new(&board)?.detect(&image.map(|grey| (255.0 * grey) as u8), "desk.png");
/// let shown = views([&found], &Reference::Target(&board))?;
/// assert_eq!(shown.views[0].corner_count(), 20);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Returns an error if image sizes differ, or if most detections that are not empty are not of the target.
pub fn views<'a, N: Into<Named<'a>>>(
    detections: impl IntoIterator<Item = N>,
    reference: &Reference,
) -> Result<ViewSet, CalibrationError> {
    let named: Vec<Named> = detections.into_iter().map(Into::into).collect();
    views_of(&named, reference)
}

/// The body of [`views`], compiled in this crate only.
fn views_of(detections: &[Named], reference: &Reference) -> Result<ViewSet, CalibrationError> {
    let mut views = Vec::new();
    let mut empty = Vec::new();
    let mut left_out = Vec::new();
    let mut notes = Vec::new();
    let mut first_wrong = None;
    let mut wrong = 0;
    let mut copies = 0;
    let mut seen = HashMap::new();
    let identities = reference.identities();
    for (index, &Named { name, detection }) in detections.iter().enumerate() {
        let size_px = [detection.width, detection.height];
        if let Some(&Named { name: first, detection: other }) = detections.first()
            && size_px != [other.width, other.height]
        {
            return Err(CalibrationError::MixedSizes {
                first: first.to_owned(),
                first_px: [other.width, other.height],
                other: name.to_owned(),
                other_px: size_px,
            });
        }
        let excluded = |panel, reason| Excluded {
            camera: None,
            view: name.to_owned(),
            image: detection.image.clone(),
            panel,
            corners: detection.grids.iter().map(|grid| grid.corners.len()).sum(),
            reason,
        };
        if let Some(of) = copied(detection, name, &mut seen) {
            left_out.push((index, excluded(None, Reason::Copy { of })));
            copies += 1;
            continue;
        }
        match sightings(detection, reference, &identities) {
            Err((panel, problem)) => {
                left_out.push((index, excluded(panel, Reason::Foreign(problem.clone()))));
                wrong += 1;
                let view = name.to_owned();
                first_wrong.get_or_insert(CalibrationError::WrongDetection { view, problem });
            }
            Ok(sightings) if sightings.is_empty() => empty.push(index),
            Ok(sightings) if reference.is_loose() => {
                notes.extend(&detection.file.camera);
                views.extend(sightings.into_iter().map(|sighting| View {
                    name: format!("{name} board {}", sighting.panel),
                    image: detection.image.clone(),
                    size_px,
                    sightings: vec![sighting],
                }));
            }
            Ok(sightings) => {
                notes.extend(&detection.file.camera);
                let (name, image) = (name.to_owned(), detection.image.clone());
                views.push(View { name, image, size_px, sightings });
            }
        }
    }
    let all = detections.len() - empty.len() - copies;
    match first_wrong {
        Some(first) if 2 * wrong > all => Err(match all {
            1 => first,
            _ => CalibrationError::MostWrong { first: Box::new(first), wrong, all },
        }),
        _ => {
            let mixed = MixedPhotographs::of(&notes);
            Ok(ViewSet { views, empty, excluded: left_out, mixed })
        }
    }
}

/// The name of an earlier detection with bitwise equal corners, that is, of the same image.
fn copied<'a>(
    detection: &'a Detection,
    name: &'a str,
    seen: &mut HashMap<[u64; 2], (&'a str, &'a Detection)>,
) -> Option<String> {
    let first = detection.grids.iter().find_map(|grid| grid.corners.first())?;
    match seen.entry([first.x, first.y].map(f64::to_bits)) {
        Entry::Vacant(place) => {
            place.insert((name, detection));
            None
        }
        Entry::Occupied(before) => {
            let (of, before) = *before.get();
            (before.grids == detection.grids).then(|| of.to_owned())
        }
    }
}

/// Returns the panels in a detection; or the wrong panel, and the reason.
fn sightings(
    detection: &Detection,
    reference: &Reference,
    identities: &[TargetIdentity],
) -> Result<Vec<Sighting>, (Option<u32>, String)> {
    let mut sightings = reference.sightings(detection, identities)?;
    sightings.retain(|sighting| sighting.observations.len() >= MIN_CORNERS);
    match (is_mirrored(&sightings), sightings.as_slice()) {
        (true, [only]) => Err((reference.panel_id(only.panel), Reason::Mirrored.to_string())),
        (true, _) => Err((None, Reason::Mirrored.to_string())),
        (false, _) => Ok(sightings),
    }
}

/// Whether nearly all corners with two neighbours are mirrored. If two fifths of the corners in an
/// image are misplaced, two fifths of these appear mirrored too, and a panel of a few corners may
/// appear mirrored by coincidence.
fn is_mirrored(sightings: &[Sighting]) -> bool {
    let rotations: Vec<f64> = sightings.iter().flat_map(rotations).collect();
    let (count, more) = (rotations.len() as f64, rotations.iter().sum::<f64>());
    more > MIRRORED_MOST * count && more > MIRRORED_SURE * count.sqrt()
}

/// Orientation of each corner and its neighbours in column and row: 1 if they are mirrored. In an
/// image (y down), rows and columns that are not mirrored are oriented clockwise.
fn rotations(sighting: &Sighting) -> Vec<f64> {
    let places: BTreeMap<(i32, i32), DVec2> =
        sighting.observations.iter().map(|o| ((o.row, o.col), o.pixel)).collect();
    let turn = |(&(row, col), &here): (&(i32, i32), &DVec2)| {
        let (right, up) = (places.get(&(row, col + 1))?, places.get(&(row + 1, col))?);
        Some((right - here).perp_dot(up - here).signum())
    };
    places.iter().filter_map(turn).collect()
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};

    use super::*;
    use crate::input::observation::Observation;
    use crate::input::panel::PanelRef;
    use glam::DVec3;

    /// A board of `rows` × 8 corners seen from above, with a fraction of the corners at random positions.
    fn board(rows: i32, part_anywhere: f64, is_flipped: bool, seed: u64) -> Sighting {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let places = (0..rows).flat_map(|row| (0..8).map(move |col| (row, col)));
        let observations = places.map(|(row, col)| {
            let (x, y) = (100.0 * f64::from(col), 800.0 - 100.0 * f64::from(row));

            let pixel = match random.random_bool(part_anywhere) {
                true => {
                    DVec2::new(random.random_range(0.0..800.0), random.random_range(0.0..800.0))
                }
                false if is_flipped => DVec2::new(800.0 - x, y),
                false => DVec2::new(x, y),
            };
            Observation { row, col, panel_mm: DVec3::new(x, -y, 0.0), pixel, cov: None }
        });
        Sighting { panel: PanelRef::new(0, 0), observations: observations.collect() }
    }

    #[test]
    fn mirrored_labels_differ_from_misplaced_corners() {
        for seed in 0..100 {
            assert!(!is_mirrored(&[board(6, 0.4, false, seed)]), "seed {seed}");
            assert!(is_mirrored(&[board(6, 0.05, true, seed)]), "seed {seed}");
        }
    }

    /// A panel of a few corners, most of them wrong, next to a panel that is not mirrored, and
    /// alone.
    #[test]
    fn a_few_wrong_corners_do_not_count_as_mirrored() {
        for seed in 0..100 {
            let few = board(2, 0.8, false, seed);
            assert!(!is_mirrored(&[few.clone(), board(6, 0.2, false, seed)]), "seed {seed}");
            assert!(!is_mirrored(&[few]), "seed {seed}");
        }
    }
}
