use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};

use glam::{DQuat, DVec2, DVec3};

use super::calibration::PanelPlace;
use super::grid::UntaggedGrid;
use super::panel::PanelRef;
use crate::calibrate::error::CalibrationError;
use crate::calibrate::estimate::target_map::TargetMap;
use crate::calibrate::excluded::{Excluded, Reason};
use crate::calibrate::problem::bundle::Observation;
use crate::calibrate::problem::shape::Shape;
use crate::camera::Pose;
use crate::detect::{Detection, Grid};
use crate::lattice::LatticeMap;
use crate::targets::{Panel, Target, TargetIdentity};

/// Corners that a panel needs in a view, so that a few wrong ones show.
pub(in crate::calibrate) const LEAST_CORNERS: usize = 6;

/// Corners of a mirrored picture turn the wrong way round, but for wrong ones: by so much, at least, of all of
/// them more do than do not.
const MIRRORED_MOST: f64 = 0.5;

/// And by so many deviations: places anywhere turn either way, of a few all may turn the wrong one. By chance
/// as many do once in a thousand pictures that show nothing else.
const MIRRORED_SURE: f64 = 3.09;

/// What is wrong with a board of the other tiling.
const OTHER_KIND: &str =
    "the board in it has the other tiling: give `UntaggedGrid::kind` that of the board";

/// What follows from labels that are not on the target.
const OTHER_TARGET: &str = "; the target does not belong to this detection";

/// What is wrong with detections of one target where there are several.
const OF_ONE_TARGET: &str =
    "it does not say which target its corners belong to: detect again with all targets at once";

/// What to do about detections of another target.
pub(in crate::calibrate) const ASSUME_TARGET: &str = "give the description that it was detected with, or set \
                                        `Detection::assume_targets` to assume this one";

/// Why labels of a grid without panel are not on the target.
const CUT_OFF: &str = "its rows and columns are not those of the target: it is another board, or a part of one without tags, \
                       whose rows and columns are known only where it is seen whole";

/// What was photographed.
#[derive(Clone, Copy, Debug)]
pub enum Reference<'a> {
    /// A target that its file describes.
    Target(&'a Target),
    /// Several targets that are fixed to each other; detections say which one a grid belongs to.
    Scene(&'a [Target]),
    /// An untagged board.
    Grid(UntaggedGrid),
}

/// What one picture shows of one rigid target.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Name of the view, such as that of the detection's file; views of several cameras with the same name belong to
    /// one frame.
    pub name: String,
    /// File name of the picture.
    pub image: String,
    /// Width and height of the picture, px.
    pub size_px: [u32; 2],
    /// The panels that were found.
    pub sightings: Vec<Sighting>,
}

/// A panel in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// The panel.
    pub panel: PanelRef,
    /// Its detected corners.
    pub observations: Vec<Observation>,
}

impl View {
    /// How many corners it shows.
    pub fn corner_count(&self) -> usize {
        self.sightings.iter().map(|sighting| sighting.observations.len()).sum()
    }

    /// The view as one that does not fit as a whole.
    pub(in crate::calibrate) fn excluded(&self, reason: Reason) -> Excluded {
        Excluded {
            camera: None,
            view: self.name.clone(),
            image: self.image.clone(),
            panel: None,
            corners: self.corner_count(),
            reason,
        }
    }
}

impl Sighting {
    /// Moves the corners to where a sheet of this shape has them.
    pub fn bend(&mut self, shape: &Shape) {
        for seen in &mut self.observations {
            seen.panel_mm += shape.offset(seen.panel_mm);
        }
    }

    /// Moves the corners to where a map has them; those that it does not have stay.
    pub fn correct(&mut self, map: &TargetMap) {
        for seen in &mut self.observations {
            seen.panel_mm += map.offset_mm(self.panel, seen.row, seen.col);
        }
    }

    /// Moves the corners to where a print has them that is stretched across and up its sheet;
    /// the panel is turned by `angle_rad` on it.
    pub fn stretch(&mut self, [across, up]: [f64; 2], angle_rad: f64) {
        let turn = DQuat::from_rotation_z(angle_rad);
        for seen in &mut self.observations {
            let on_sheet = turn * seen.panel_mm * DVec3::new(across, up, 1.0);
            seen.panel_mm = turn.conjugate() * on_sheet;
        }
    }
}

impl Reference<'_> {
    /// Where its panels are on it.
    pub fn panels(&self) -> Vec<PanelPlace> {
        match self {
            Self::Grid(_) => vec![Pose::IDENTITY.into()],
            Self::Target(_) | Self::Scene(_) => {
                let panels = self.targets().iter().flat_map(|target| &target.panels);
                panels.map(|panel| (&panel.pose).into()).collect()
            }
        }
    }

    /// The rotations of each panel's labels that no picture shows, see [`Panel::label_symmetries`].
    pub fn label_symmetries(&self) -> Vec<Vec<LatticeMap>> {
        match self {
            Self::Grid(grid) => vec![grid.label_symmetries()],
            Self::Target(_) | Self::Scene(_) => {
                let panels = self.targets().iter().flat_map(|target| &target.panels);
                panels.map(Panel::label_symmetries).collect()
            }
        }
    }

    /// What a half turn or another rotation that no picture shows leaves open, as a sentence without capital and full
    /// stop; `None` where labels are known.
    pub fn label_ambiguity(&self) -> Option<String> {
        let maps = self.label_symmetries();
        let of_most = maps.iter().max_by_key(|maps| maps.len()).filter(|maps| !maps.is_empty())?;
        let degrees = 360 / (of_most.len() + 1);
        Some(format!(
            "a board without tags that looks the same after a rotation by {degrees}° is labelled by how it lies in the \
             image: which of its {} sides is the lower one is not known",
            of_most.len() + 1
        ))
    }

    /// What its file describes, or their files; none of an untagged board.
    pub fn targets(&self) -> &[Target] {
        match *self {
            Self::Grid(_) => &[],
            Self::Target(target) => std::slice::from_ref(target),
            Self::Scene(targets) => targets,
        }
    }

    /// Identities of the targets; of an untagged board that of the target it makes, where its size is known.
    pub fn identities(&self) -> Vec<TargetIdentity> {
        match self {
            Self::Grid(grid) => {
                let made = grid.target("board").and_then(Result::ok);
                made.map(|target| target.identity()).into_iter().collect()
            }
            Self::Target(_) | Self::Scene(_) => {
                self.targets().iter().map(Target::identity).collect()
            }
        }
    }

    /// The panel with an id, which is 0 on an untagged board, of the target of a name where there are several.
    pub fn panel(&self, target: Option<&str>, id: u32) -> Option<PanelRef> {
        if let Self::Grid(_) = self {
            return (id == PanelRef::ONLY.id()).then_some(PanelRef::ONLY);
        }
        let mut first = 0;
        for of_scene in self.targets() {
            let is_it = target.is_none_or(|name| is_named(of_scene, name));
            let index = of_scene.panels.iter().position(|panel| is_it && panel.id == id);
            if let Some(index) = index {
                return Some(PanelRef::new(first + index, id));
            }
            first += of_scene.panels.len();
        }
        None
    }

    /// Whether the labels of a view are those of the target: tags tell them, or that the board is seen
    /// whole.
    pub fn is_sure_of(&self, view: &View) -> bool {
        if let Self::Grid(grid) = self {
            let whole = grid.size.map(|[rows, cols]| rows as usize * cols as usize);
            return whole.is_some_and(|count| view.corner_count() >= count);
        }
        let mut first = 0;
        self.targets().iter().all(|target| {
            let of_target = first..first + target.panels.len();
            first = of_target.end;
            let seen = view.sightings.iter().filter(|s| of_target.contains(&s.panel.index()));
            let seen: usize = seen.map(|sighting| sighting.observations.len()).sum();
            let is_tagged = target.panels.iter().all(|panel| !panel.tags.is_empty());
            let is_absent = seen == 0 && self.targets().len() > 1;
            let whole: usize = target.panels.iter().map(|panel| panel.corners.len()).sum();
            is_tagged || is_absent || seen >= whole
        })
    }

    /// Whether it is known but for a [symmetry](Self::label_symmetries) which corner of a board is which: always of
    /// targets; of an untagged board whose rows and columns are given, where the view reaches from its first to its last.
    pub fn labels_are_of_board(&self, view: &View) -> bool {
        let Self::Grid(grid) = self else { return true };
        view.sightings.iter().all(|sighting| {
            let labels = sighting.observations.iter().map(|seen| (seen.row, seen.col));
            grid.is_spanned_by(&labels.collect())
        })
    }

    /// Whether its panels are boards that lie about, each for itself.
    pub fn is_loose(&self) -> bool {
        self.targets().iter().any(|target| target.is_loose())
    }

    /// Id of a panel; `None` on an untagged board.
    fn panel_id(&self, panel: PanelRef) -> Option<u32> {
        match self {
            Self::Grid(_) => None,
            Self::Target(_) | Self::Scene(_) => Some(panel.id()),
        }
    }

    /// What a detection shows of the panels, or the panel that is wrong in it and why; `identities` are those of the targets.
    fn sightings(
        &self,
        detection: &Detection,
        identities: &[TargetIdentity],
    ) -> Result<Vec<Sighting>, (Option<u32>, String)> {
        match self {
            Self::Grid(board) => {
                let of_kind = detection.grids.iter().filter(|grid| grid.kind == board.kind);
                let Some(grid) = of_kind.max_by_key(|grid| grid.corners.len()) else {
                    return match detection.grids.first() {
                        Some(_) => Err((None, OTHER_KIND.to_owned())),
                        None => Ok(Vec::new()),
                    };
                };
                let check = board.check_target(detection.target_of(grid));
                check.and_then(|()| board.check(grid)).map_err(|problem| (None, problem))?;
                let at = |row, col| board.place(row, col);
                Ok(vec![Sighting { panel: PanelRef::ONLY, observations: observations(grid, at) }])
            }
            Self::Target(_) | Self::Scene(_) => {
                let grids = detection.grids.iter();
                let found = grids.filter_map(|grid| {
                    let seen = detection.target_of(grid);
                    let index = self.target_of(grid, seen, identities);
                    let on_it = |index: Option<usize>| match index {
                        Some(index) => self.on_target(index, grid),
                        None => Ok(None),
                    };
                    index.and_then(on_it).map_err(|problem| (grid.panel, problem)).transpose()
                });
                found.collect()
            }
        }
    }
}

impl Reference<'_> {
    /// Compares the labels of a grid of a detection with what is on the target: its identity, panel, corners and tags.
    ///
    /// # Errors
    /// A sentence that says what is not on it.
    pub fn check_labels(&self, detection: &Detection, grid: &Grid) -> Result<(), String> {
        let identities = self.identities();
        match self.target_of(grid, detection.target_of(grid), &identities)? {
            Some(index) => self.on_target(index, grid).map(drop),
            None => Ok(()),
        }
    }

    /// Index of the target that a grid belongs to: by the identity of the target that it was labelled with, where the
    /// detection has that, else by its name. `None` where it is none of these targets.
    fn target_of(
        &self,
        grid: &Grid,
        seen: Option<&TargetIdentity>,
        identities: &[TargetIdentity],
    ) -> Result<Option<usize>, String> {
        let targets = self.targets();
        let Some(seen) = seen else {
            return match &grid.target {
                Some(name) => Ok(targets.iter().position(|target| is_named(target, name))),
                None if targets.len() == 1 => Ok(Some(0)),
                None if grid.panel.is_none() => Ok(None),
                None => Err(OF_ONE_TARGET.to_owned()),
            };
        };
        if let Some(index) = identities.iter().position(|own| own.is_same_print(seen)) {
            return Ok(Some(index));
        }
        // Other targets in the same image are of no concern, unless they may be mistaken for these.
        let confusable = identities.iter().find(|own| own.is_confusable(seen));
        match confusable.or_else(|| identities.first().filter(|_| grid.target.is_none())) {
            Some(own) => Err(format!(
                "it was detected as {seen}, but the target given is {own}: {ASSUME_TARGET}"
            )),
            None => Ok(None),
        }
    }

    /// The corners of a grid on the panel of a target; `None` where the grid was not labelled.
    fn on_target(&self, index: usize, grid: &Grid) -> Result<Option<Sighting>, String> {
        let targets = self.targets();
        let first = targets[..index].iter().map(|target| target.panels.len()).sum();
        on_target(&targets[index], first, grid)
    }
}

/// Whether a target is that of a name: measured or with refined panels it is still the same.
fn is_named(target: &Target, name: &str) -> bool {
    let of_print = |name: &str| -> String {
        let mut name = name;
        while let Some(shorter) =
            name.strip_suffix("-measured").or_else(|| name.strip_suffix("-refined"))
        {
            name = shorter;
        }
        name.to_owned()
    };
    of_print(&target.name) == of_print(name)
}

/// The views of detections.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Shown {
    /// One for each picture, or for each board in it where several lie about.
    pub views: Vec<View>,
    /// Positions of the detections that show nothing.
    pub empty: Vec<usize>,
    /// Positions of the detections that do not belong to the target, or are of the same picture as another, and what is
    /// wrong with them.
    pub left_out: Vec<(usize, Excluded)>,
}

/// The views of all detections, each with its name; an error where most of those that show
/// something do not belong to the target.
///
/// ```
/// use deltille_core::calibrate::{Reference, views};
/// use deltille_core::camera::{Camera, Pose};
/// use deltille_core::detect::Detector;
/// use deltille_core::synth::{Light, scene_of_target};
/// use deltille_core::targets::{BoardSpec, Target};
/// use glam::DVec3;
///
/// let board = Target::new("desk", BoardSpec::deltille(4, 5, 20.0))?;
/// let eye = DVec3::new(50.0, -60.0, 200.0);
/// let pose = Pose::looking_at(eye, board.panels[0].middle_mm(), DVec3::Y);
/// let scene = scene_of_target(&board, board.family()?.as_ref())?;
/// let image = scene.render(&Camera::pinhole(640, 480, 1.0), &pose, &Light::default());
/// let found = Detector::new(&board)?.detect(&image.map(|grey| (255.0 * grey) as u8), "desk.png");
/// let shown = views(&[("desk".to_owned(), found)], &Reference::Target(&board))?;
/// assert_eq!(shown.views[0].corner_count(), 20);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Where pictures have different sizes, or most that show something are not of the target.
pub fn views(
    detections: &[(String, Detection)],
    reference: &Reference,
) -> Result<Shown, CalibrationError> {
    let mut views = Vec::new();
    let mut empty = Vec::new();
    let mut left_out = Vec::new();
    let mut first_wrong = None;
    let mut wrong = 0;
    let mut copies = 0;
    let mut seen = HashMap::new();
    let identities = reference.identities();
    for (index, (name, detection)) in detections.iter().enumerate() {
        let size_px = [detection.width, detection.height];
        if let Some((first, other)) = detections.first()
            && size_px != [other.width, other.height]
        {
            return Err(CalibrationError::MixedSizes {
                first: first.clone(),
                first_px: [other.width, other.height],
                other: name.clone(),
                other_px: size_px,
            });
        }
        let excluded = |panel, reason| Excluded {
            camera: None,
            view: name.clone(),
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
                let view = name.clone();
                first_wrong.get_or_insert(CalibrationError::WrongDetection { view, problem });
            }
            Ok(sightings) if sightings.is_empty() => empty.push(index),
            Ok(sightings) if reference.is_loose() => {
                views.extend(sightings.into_iter().map(|sighting| View {
                    name: format!("{name} board {}", sighting.panel),
                    image: detection.image.clone(),
                    size_px,
                    sightings: vec![sighting],
                }));
            }
            Ok(sightings) => {
                let (name, image) = (name.clone(), detection.image.clone());
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
        _ => Ok(Shown { views, empty, left_out }),
    }
}

/// The name of the detection before, if any, that has the same corners to the last bit: of the same picture.
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

/// What a detection shows of the panels, or the panel that is wrong in it and why.
fn sightings(
    detection: &Detection,
    reference: &Reference,
    identities: &[TargetIdentity],
) -> Result<Vec<Sighting>, (Option<u32>, String)> {
    let mut sightings = reference.sightings(detection, identities)?;
    sightings.retain(|sighting| sighting.observations.len() >= LEAST_CORNERS);
    match (is_mirrored(&sightings), sightings.as_slice()) {
        (true, [only]) => Err((reference.panel_id(only.panel), Reason::Mirrored.to_string())),
        (true, _) => Err((None, Reason::Mirrored.to_string())),
        (false, _) => Ok(sightings),
    }
}

/// The corners of a grid on its panel, which are counted from `first` on; `None` where it was not labelled and the
/// target has several.
fn on_target(target: &Target, first: usize, grid: &Grid) -> Result<Option<Sighting>, String> {
    let index = match grid.panel {
        Some(id) => target.panels.iter().position(|panel| panel.id == id),
        None if target.panels.len() == 1 && target.panels[0].tags.is_empty() => Some(0),
        None => return Ok(None),
    };
    let Some(index) = index else {
        let id = grid.panel.unwrap_or_default();
        return Err(format!("panel {id} is not on the target {}{OTHER_TARGET}", target.name));
    };
    let panel = &target.panels[index];
    check_panel(target, panel, grid).map_err(|problem| problem + OTHER_TARGET)?;
    let from_target = panel.pose.to_pose().inverse();
    let places: BTreeMap<(i32, i32), DVec3> = panel
        .corners
        .iter()
        .map(|corner| {
            let place = from_target.apply(corner.target_mm) + corner.offset_mm();
            ((corner.row, corner.col), place)
        })
        .collect();
    let mut found = Vec::new();
    for corner in &grid.corners {
        match places.get(&(corner.row, corner.col)) {
            Some(&place) => found.push((corner.row, corner.col, place)),
            None if grid.panel.is_none() && corner.id.is_none() => {
                return Err(CUT_OFF.to_owned());
            }
            None => {
                let swapped = places.contains_key(&(corner.col, corner.row));
                let hint = if swapped { " (rows and columns exchanged?)" } else { "" };
                return Err(format!(
                    "{} has no corner in row {}, column {}{hint}{OTHER_TARGET}",
                    target.name, corner.row, corner.col
                ));
            }
        }
    }
    let at = |row, col| places[&(row, col)];
    let panel = PanelRef::new(first + index, panel.id);
    Ok(Some(Sighting { panel, observations: observations(grid, at) }))
}

/// Compares what a detection says of a panel with the target.
fn check_panel(target: &Target, panel: &Panel, grid: &Grid) -> Result<(), String> {
    if panel.kind != grid.kind {
        return Err(format!("panel {} has another tiling on {}", panel.id, target.name));
    }
    for corner in &grid.corners {
        let Some(id) = corner.id else { continue };
        let of_target = panel.corners.iter().find(|of_target| of_target.id == id);
        if let Some(of_target) = of_target
            && (of_target.row, of_target.col) != (corner.row, corner.col)
        {
            let swapped = (of_target.col, of_target.row) == (corner.row, corner.col);
            return Err(format!(
                "corner {id} is in row {}, column {}, but on {} in row {}, column {}{}",
                corner.row,
                corner.col,
                target.name,
                of_target.row,
                of_target.col,
                if swapped { " (rows and columns exchanged?)" } else { "" }
            ));
        }
        if of_target.is_none() {
            return Err(format!("corner {id} is not on {}", target.name));
        }
    }
    for tag in &grid.tags {
        let same = panel.tags.iter().any(|t| (t.id, t.row, t.col) == (tag.id, tag.row, tag.col));
        let family = target.family.as_ref().map(|family| &*family.of_tiling(panel.kind).name);
        if !same || family != Some(tag.family.as_str()) {
            return Err(format!(
                "tag {} of {} in row {}, column {} is not on {}",
                tag.id, tag.family, tag.row, tag.col, target.name
            ));
        }
    }
    Ok(())
}

fn observations(grid: &Grid, at: impl Fn(i32, i32) -> DVec3) -> Vec<Observation> {
    let seen = grid.corners.iter().map(|corner| Observation {
        row: corner.row,
        col: corner.col,
        panel_mm: at(corner.row, corner.col),
        pixel: corner.position(),
        cov: corner.cov,
    });
    seen.collect()
}

/// Whether the corners with two neighbours are mirrored, nearly all of the picture: of one in which two fifths
/// of the corners are anywhere two fifths of these are mirrored too, and a panel of a few may be by chance.
fn is_mirrored(sightings: &[Sighting]) -> bool {
    let turns: Vec<f64> = sightings.iter().flat_map(turns).collect();
    let (count, more) = (turns.len() as f64, turns.iter().sum::<f64>());
    more > MIRRORED_MOST * count && more > MIRRORED_SURE * count.sqrt()
}

/// Which way corners turn to their neighbours in column and row: 1 where they are mirrored. In a picture, y
/// down, rows and columns that run as on the print turn clockwise.
fn turns(sighting: &Sighting) -> Vec<f64> {
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

    /// A board of `rows` × 8 corners from above, of which a part are anywhere in the picture.
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
    fn a_mirror_is_told_from_wrong_places() {
        for seed in 0..100 {
            assert!(!is_mirrored(&[board(6, 0.4, false, seed)]), "seed {seed}");
            assert!(is_mirrored(&[board(6, 0.05, true, seed)]), "seed {seed}");
        }
    }

    /// A panel of a few corners, of which most are wrong, beside one that is not mirrored, and by itself.
    #[test]
    fn a_few_wrong_corners_are_no_mirror() {
        for seed in 0..100 {
            let few = board(2, 0.8, false, seed);
            assert!(!is_mirrored(&[few.clone(), board(6, 0.2, false, seed)]), "seed {seed}");
            assert!(!is_mirrored(&[few]), "seed {seed}");
        }
    }
}
