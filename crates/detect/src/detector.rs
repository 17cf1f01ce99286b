//! The detector: the targets it detects and its results for an image, for one tiling or both.

use super::config::DetectorConfig;
use super::levels::{MIN_LEVEL_SIDE, levels_of};
use super::one_tiling::following::Track;
use super::one_tiling::{Frame, OneTiling, Search};
use super::scene::{SceneError, check_detectable, check_distinct};
use super::timing::Timing;
use crate::labels::grid_labels::Labels;
use crate::refine::clearance::TagAreas;
use deltille_core::Clock;
use deltille_core::detection::{Detection, InkEstimate, ReasonKind};
use deltille_core::family::Family;
use deltille_core::lattice::GridKind;
use deltille_core::raster::{ImageView, Pyramid};
use deltille_core::targets::{Target, TargetIdentity, UnknownCodes};

/// Finds grids in images and labels their corners.
///
/// ```
/// use deltille_detect::{Detector, DetectorConfig};
/// use deltille_core::raster::Gray;
/// use deltille_core::lattice::GridKind;
///
/// let detector = Detector::for_grid(GridKind::Deltille, Some((10, 11)), DetectorConfig::default());
/// let detection = detector.detect(&Gray::<u8>::new(640, 480), "black.png");
/// assert!(detection.grids.is_empty());
/// ```
#[derive(Clone, Debug)]
pub struct Detector {
    main: OneTiling,
    /// Stages for the targets of the other tiling, if any.
    other: Option<Box<OneTiling>>,
    /// Identities of the targets to detect.
    targets: Vec<TargetIdentity>,
}

impl Detector {
    /// Creates a detector for a target with the default settings; see [`Self::for_target`].
    ///
    /// # Errors
    /// Returns an error if the family of the tags is unknown.
    ///
    /// ```
    /// use deltille_detect::Detector;
    /// use deltille_core::raster::Gray;
    /// use deltille_core::targets::{BoardSpec, Target};
    ///
    /// let board = Target::new("desk", BoardSpec::deltille(10, 11, 20.0))?;
    /// let detection = Detector::new(&board)?.detect(&Gray::<u8>::new(640, 480), "black.png");
    /// assert!(detection.grids.is_empty());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(target: &Target) -> Result<Self, UnknownCodes> {
        Self::for_target(target, DetectorConfig::default())
    }

    /// Creates a detector for grids of any target.
    ///
    /// `size` is the number of rows and columns of corners of an untagged board. If it is given, a grid that shows the
    /// whole board is labelled from its lower left corner. All other grids get relative labels.
    ///
    /// On a checkerboard, the board is oriented so that the square to the upper right of its lower
    /// left corner is dark. That corner is (0, 0). If rows + columns is even, the board looks the
    /// same after a rotation by 180°. Of the two candidates, the one that is lower in the image
    /// then becomes (0, 0).
    pub fn for_grid(kind: GridKind, size: Option<(u32, u32)>, config: DetectorConfig) -> Self {
        let labels = Labels::of_size(kind, size, &config);
        let main = OneTiling::new(kind, labels, TagAreas::default(), None, config);
        Self { main, other: None, targets: Vec::new() }
    }

    /// Creates a detector for a target.
    ///
    /// An untagged panel is labelled if all of it is visible and no other panel of the target has
    /// the same outline. [`Self::for_grid`] defines the first corner of an untagged checkerboard.
    ///
    /// # Errors
    /// Returns an error if the family of the tags is unknown; see [`Target::set_family`].
    pub fn for_target(target: &Target, config: DetectorConfig) -> Result<Self, UnknownCodes> {
        let family = target.family()?;
        let mut of_tilings = target.tilings().map(|kind| {
            let family = family.and_then(|family| family.of_tiling(kind));
            match target.tilings().count() {
                1 => of_one_tiling(target, family, config.clone()),
                _ => of_one_tiling(&target.of_tiling(kind), family, config.clone()),
            }
        });
        let first = of_tilings.next();
        let other = of_tilings.next().map(Box::new);
        let main = first.unwrap_or_else(|| of_one_tiling(target, family, config));
        Ok(Self { main, other, targets: vec![target.identity()] })
    }

    /// Creates a detector that detects several targets in one pass over an image.
    /// [`Grid::target`](crate::Grid::target) names the target of each grid.
    ///
    /// # Errors
    /// Returns an error if two targets cannot be distinguished, if a target has circles instead of tiles, or if the
    /// family of their tags is unknown.
    ///
    /// ```
    /// use deltille_detect::{Detector, DetectorConfig};
    /// use deltille_core::targets::{BoardSpec, Target};
    ///
    /// let [mut front, mut back] = [BoardSpec::deltille(10, 11, 20.0), BoardSpec::deltille(10, 11, 20.0)];
    /// if let Some(tags) = &mut back.tags {
    ///     tags.first_id = 100;
    /// }
    /// let [front, back] = [Target::new("front", front)?, Target::new("back", back)?];
    /// let detector = Detector::for_targets(&[&front, &back], DetectorConfig::default())?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn for_targets(targets: &[&Target], config: DetectorConfig) -> Result<Self, SceneError> {
        check_distinct(targets)?;
        check_detectable(targets)?;
        if let [only] = targets {
            return Ok(Self::for_target(only, config)?);
        }
        let families = targets.iter().map(|target| target.family());
        let families: Vec<Option<&Family>> = families.collect::<Result<_, _>>()?;
        let of_kind = |kind: GridKind| {
            // The part of each target with this tiling, and the family of its tags.
            let has_it = |(target, _): &(&&Target, _)| {
                kind_of(target) == kind || target.tilings().any(|own| own == kind)
            };
            let own: Vec<(Target, Option<&Family>)> = targets
                .iter()
                .zip(&families)
                .filter(has_it)
                .map(|(target, family)| {
                    let family = family.and_then(|family| family.of_tiling(kind));
                    (target.of_tiling(kind), family)
                })
                .collect();
            let labels = own.iter().map(|(target, family)| {
                (target.name.to_string(), Labels::of_target(target, *family, &config))
            });
            let tag_areas = own.iter().filter_map(|(target, family)| {
                Some((target.name.to_string(), TagAreas::of(target, (*family)?)))
            });
            let edge_mm = edge_of(&own.iter().map(|(target, _)| target).collect::<Vec<_>>());
            let (labels, tag_areas) =
                (Labels::of_scene(labels.collect()), TagAreas::of_scene(tag_areas));
            (!own.is_empty())
                .then(|| OneTiling::new(kind, labels, tag_areas, edge_mm, config.clone()))
        };
        let mut of_kinds = [GridKind::Deltille, GridKind::Checker].into_iter().filter_map(of_kind);
        let main = of_kinds.next().ok_or(SceneError::Empty)?;
        let targets = targets.iter().map(|target| target.identity()).collect();
        Ok(Self { main, other: of_kinds.next().map(Box::new), targets })
    }

    /// Returns this detector with a clock that times each stage; see [`Detection::timing_ms`].
    pub fn with_clock(self, clock: Clock) -> Self {
        let other = self.other.map(|other| Box::new(other.with_clock(clock)));
        Self { main: self.main.with_clock(clock), other, ..self }
    }

    /// Returns this detector with an ink spread that was already estimated for the print.
    pub fn with_ink(self, ink: InkEstimate) -> Self {
        let edge_mm = self.main.edge_mm;
        let of_other = |other: Box<OneTiling>| match (edge_mm, other.edge_mm) {
            // Converts the ink spread, which is the same in mm, to a fraction of the other edge
            // length.
            (Some(edge_mm), Some(other_mm)) => {
                let mut ink = ink;
                for edges in [&mut ink.edges, &mut ink.edges_sd] {
                    *edges = *edges * edge_mm / other_mm;
                }
                Box::new(other.with_ink(ink))
            }
            _ => other,
        };
        let other = self.other.map(of_other);
        Self { main: self.main.with_ink(ink), other, ..self }
    }

    /// Returns the ink spread estimated from other images; see [`Self::with_ink`].
    pub fn known_ink(&self) -> Option<InkEstimate> {
        self.main.ink
    }

    /// Combines the ink estimates of several images of one print. Returns `None` if the ink spread
    /// was given, or if a second pass with the combined estimate would change nothing.
    pub fn ink_of_all(&self, found: &[Option<InkEstimate>]) -> Option<InkEstimate> {
        let known: Vec<InkEstimate> = found.iter().copied().flatten().collect();
        // Corners of checkerboards do not move with their edges, and blooming differs between images.
        let is_worth = self.main.is_ink_asked() && found.len() > 1 && !self.main.is_of_squares();
        InkEstimate::of_all(&known).filter(|ink| ink.used && is_worth)
    }

    /// Returns this detector for a second pass over the same images, with the combined ink estimate of
    /// [`Self::ink_of_all`].
    pub fn with_ink_of(&self, found: &[Option<InkEstimate>]) -> Option<Self> {
        Some(self.clone().with_ink(self.ink_of_all(found)?))
    }

    /// Detects the grids in an image and labels their corners. `name` is copied to the result.
    ///
    /// An image without a grid is not an error: [`Detection::reasons`] contains the reason.
    pub fn detect<'a>(&self, image: impl Into<ImageView<'a>>, name: &str) -> Detection {
        self.detect_view(image.into(), name)
    }

    /// Implements [`Self::detect`] without generics, so that it is compiled only in this crate.
    fn detect_view(&self, image: ImageView, name: &str) -> Detection {
        let mut timing = self.timing();
        let pyramid = Pyramid::new(image, levels_of(image), MIN_LEVEL_SIDE);
        let frame = Frame { image, pyramid: &pyramid };
        timing.lap("pyramid");
        let mut found = self.of_all(self.tilings().map(|of| of.detect(frame, of.timing(), name)));
        timing.add_to(&mut found.timing_ms);
        found
    }

    /// Returns the detection of an image of a video, and the tracks from there. `before` are the tracks of each tiling up
    /// to the image before it, if any.
    pub(crate) fn search(
        &self,
        frame: Frame,
        how: Search,
        before: &[Option<Track>],
        name: &str,
    ) -> (Detection, Vec<Option<Track>>) {
        let mut tracks = Vec::new();
        let found = self.tilings().enumerate().map(|(i, of)| {
            let (found, shared) = of.search(frame, how, of.timing(), name);
            let before = before.get(i).and_then(Option::as_ref);
            tracks.push(of.track(frame.image, &found.grids, shared, before));
            found
        });
        (self.of_all(found), tracks)
    }

    /// Returns the detection of the next image of a video, and the tracks from there; `None` if the image has to be
    /// searched.
    pub(crate) fn follow(
        &self,
        frame: Frame,
        tracks: &[Option<Track>],
        name: &str,
    ) -> Option<(Detection, Vec<Option<Track>>)> {
        let is_due = tracks.iter().flatten().any(Track::is_due);
        if tracks.iter().all(Option::is_none) || is_due && tracks.iter().any(Option::is_none) {
            return None;
        }
        let follow = |(of, track): (&OneTiling, &Option<Track>)| match track {
            Some(track) => of.follow(frame, track, of.timing(), name),
            // Searched again when it is due.
            None => Some((of.nothing(frame.image, name), None)),
        };
        let followed: Option<Vec<_>> = self.tilings().zip(tracks).map(follow).collect();
        let (found, tracks): (Vec<Detection>, Vec<_>) = followed?.into_iter().unzip();
        Some((self.of_all(found.into_iter()), tracks))
    }

    /// Starts the stopwatch of the stages.
    pub(crate) fn timing(&self) -> Timing {
        self.main.timing()
    }

    /// Returns the stages of each tiling.
    fn tilings(&self) -> impl Iterator<Item = &OneTiling> {
        std::iter::once(&self.main).chain(self.other.as_deref())
    }

    /// Combines the detections of each tiling.
    fn of_all(&self, mut found: impl Iterator<Item = Detection>) -> Detection {
        let first = found.next().unwrap_or_else(|| Detection::new("", [0; 2], Vec::new()));
        let mut found = found.fold(first, both);
        found.targets = self.targets.clone();
        found
    }
}

/// Creates the stages for a target of one tiling.
fn of_one_tiling(target: &Target, family: Option<&Family>, config: DetectorConfig) -> OneTiling {
    let labels = Labels::of_target(target, family, &config);
    let tag_areas = family.map(|family| TagAreas::of(target, family)).unwrap_or_default();
    OneTiling::new(kind_of(target), labels, tag_areas, edge_of(&[target]), config)
}

/// Returns the tiling of a target.
fn kind_of(target: &Target) -> GridKind {
    target.panels.first().map_or(GridKind::Deltille, |panel| panel.kind)
}

/// Returns the edge length of the tiles, mm, if it is the same for all tiles.
fn edge_of(targets: &[&Target]) -> Option<f64> {
    let edges = || targets.iter().flat_map(|target| &target.panels).map(|panel| panel.edge_mm);
    edges().next().filter(|first| edges().all(|edge| edge == *first))
}

/// Combines the detections of both tilings in one image. If one tiling has a labelled grid, the
/// failure of the other tiling is not reported.
fn both(deltille: Detection, checker: Detection) -> Detection {
    let is_there = |found: &Detection| found.grids.iter().any(|grid| grid.panel.is_some());
    let [main, other] = match is_there(&checker) && !is_there(&deltille) {
        true => [checker, deltille],
        false => [deltille, checker],
    };
    let mut found = main;
    if is_there(&other) {
        found.reasons.extend(other.reasons);
        found.grids.extend(other.grids);
    } else if !is_there(&found) {
        found.reasons.extend(other.reasons);
        found.reasons.retain(|reason| reason.kind != ReasonKind::OtherTiling);
    }
    for (stage, ms) in other.timing_ms {
        *found.timing_ms.entry(stage).or_default() += ms;
    }
    found.tone = found.tone.or(other.tone);
    found.ink = found.ink.or(other.ink);
    found
}
