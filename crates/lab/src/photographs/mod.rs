//! Detection on photographs of a printed page, of which everything is known.
//!
//! ```text
//! page ─▶ view ─▶ optics ─▶ sensor ─▶ file ─▶ detector
//!   └───────┴── truth ───────────────────────▶ score
//! ```
//!
//! Comes in: a target, and what is to be varied. Goes out: how well the detector found it, level by level.
//!
//! 1. `axes` are what is varied, one thing at a time, from a [`scene`] that is always the same, with the same poses at
//!    every level.
//! 2. `world` has what there is to see: the target's PDF, written and drawn by hayro, what lies around it and on it. Where
//!    its corners are, its own paths say; nothing of [`deltille::synth`] takes part.
//! 3. `camera` has a pinhole with a bending lens, blur and light, and a sensor; nothing of [`deltille::camera`] takes part.
//! 4. `photograph` takes a photograph with its truth.
//! 5. `result` compares what the detector found with that, and makes tables and the plot.
//!
//! What it does not show: print that is not black and white, depth of field, lateral colour, rolling
//! shutters, noise reduction.

pub mod axes;
pub mod camera;
pub mod photograph;
pub mod result;
pub mod scene;
pub mod world;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec2;
use rayon::prelude::*;

use self::axes::{Axis, Level};
use self::photograph::{Photograph, take};
use self::result::score::{Score, score};
use self::result::table::{self, Row};
use self::world::background::Studio;
use self::world::page::PrintedPage;
use deltille::artwork::ArtworkError;
use deltille::clock;
use deltille::detect::{Detector, DetectorConfig};
use deltille::export::{ExportError, atomic};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::targets::{BoardSpec, TargetSpec};
use deltille::verify::DocumentError;

/// Why a page cannot be photographed.
#[derive(Debug, thiserror::Error)]
pub enum PhotographError {
    /// The target says nothing about paper.
    #[error("the target has no sheet to print: give the .json that was written with its files")]
    NoSheet,
    /// Its first sheet is larger than the paper.
    #[error("the target's sheet is printed on several pages: choose paper that holds it")]
    SeveralPages,
    /// No paths meet where a corner should be.
    #[error("the paths of the PDF do not meet at {at_mm} mm, where corner {id} should be")]
    NoCorner {
        /// Which corner.
        id: u32,
        /// Where it is stated, mm.
        at_mm: DVec2,
    },
    /// The PDF's content cannot be followed.
    #[error("the PDF's paths cannot be read: {0}")]
    Paths(String),
    /// It cannot be drawn.
    #[error(transparent)]
    Artwork(#[from] ArtworkError),
    /// It cannot be written.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// It cannot be read back.
    #[error(transparent)]
    Document(#[from] DocumentError),
    /// There is no place for a temporary file, or for a picture.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// A picture cannot be written.
    #[error(transparent)]
    Write(#[from] atomic::WriteError),
}

/// Boards that are made for the experiment where no target is given: 10 × 11 corners, or 9 × 12 on
/// checkerboards, 20 mm apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// Deltille or checkerboard.
    pub grid: GridKind,
    /// With the default tags.
    pub tagged: bool,
}

impl Kind {
    /// All four.
    pub const ALL: [Self; 4] = [
        Self { grid: GridKind::Deltille, tagged: true },
        Self { grid: GridKind::Deltille, tagged: false },
        Self { grid: GridKind::Checker, tagged: true },
        Self { grid: GridKind::Checker, tagged: false },
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match (self.grid, self.tagged) {
            (GridKind::Deltille, true) => "deltille",
            (GridKind::Deltille, false) => "deltille-untagged",
            (GridKind::Checker, true) => "checker",
            (GridKind::Checker, false) => "checker-untagged",
        }
    }

    /// The board.
    pub fn spec(self) -> BoardSpec {
        let [rows, cols] = match self.grid {
            GridKind::Deltille => [10, 11],
            GridKind::Checker => [9, 12],
        };
        let spec = BoardSpec::new(self.grid, rows, cols, 20.0);
        if self.tagged { spec } else { BoardSpec { tags: None, ..spec } }
    }
}

/// What is photographed, and by what it is looked for.
pub struct Subject {
    /// Its name in tables and file names.
    pub name: String,
    page: PrintedPage,
    detector: Detector,
}

impl Subject {
    /// A target that is there already.
    ///
    /// # Errors
    /// Where the target has no sheet, or the family of its tags is unknown.
    pub fn new(name: &str, printing: &Printing) -> Result<Self, PhotographError> {
        let page = PrintedPage::new(printing)?;
        let detector = Detector::for_target(&printing.target, DetectorConfig::default())
            .map_err(ArtworkError::from)?
            .with_clock(clock::now);
        Ok(Self { name: name.to_owned(), page, detector })
    }

    /// One of the boards of the experiment; `family` is that of its spec.
    ///
    /// # Errors
    /// Where the board cannot be made.
    pub fn of_kind(kind: Kind, family: Option<&Family>) -> Result<Self, PhotographError> {
        let (spec, paper) = (TargetSpec::Board(kind.spec()), PaperSpec::default());
        let printing = Printing::build(kind.name(), &spec, family, Some(&paper))
            .expect("the boards of the experiment can be made");
        Self::new(kind.name(), &printing)
    }
}

/// How often, and where pictures go.
pub struct Setup<'a> {
    /// Photographs at each level.
    pub views: u64,
    /// Seed of all random choices.
    pub seed: u64,
    /// What is varied.
    pub axes: &'a [Axis],
    /// Folder for the pictures with their truth.
    pub images: Option<&'a Path>,
}

impl Setup<'_> {
    /// How many photographs will be taken of one subject, which is how often progress is reported.
    pub fn photographs(&self) -> usize {
        self.axes.iter().map(|axis| axis.levels().len()).sum::<usize>() * self.views as usize
    }
}

/// Photographs a subject at every level of the axes; `None` when cancelled.
///
/// But for times, the result depends on the subject and the setup alone.
///
/// # Errors
/// Where a picture cannot be made.
pub fn run(
    subject: &Subject,
    setup: &Setup,
    cancel: &AtomicBool,
    progress: &(dyn Fn() + Sync),
) -> Result<Option<Vec<Row>>, PhotographError> {
    let studio = Studio::new(setup.seed);
    let mut rows = Vec::new();
    for &axis in setup.axes {
        for level in axis.levels() {
            let scores: Result<Vec<Option<Score>>, PhotographError> = (0..setup.views)
                .into_par_iter()
                .map(|view| {
                    if cancel.load(Ordering::Relaxed) {
                        return Ok(None);
                    }
                    let photograph = take(&subject.page, &studio, &level.scene, view);
                    let score = judge(subject, setup, axis, &level, view, &photograph)?;
                    progress();
                    Ok(Some(score))
                })
                .collect();
            let Some(scores) = scores?.into_iter().collect::<Option<Vec<Score>>>() else {
                return Ok(None);
            };
            rows.push(Row::new(&subject.name, axis, &level, &scores));
        }
    }
    Ok(Some(rows))
}

/// Writes a photograph where that is wished, and scores what is detected in it.
fn judge(
    subject: &Subject,
    setup: &Setup,
    axis: Axis,
    level: &Level,
    view: u64,
    photograph: &Photograph,
) -> Result<Score, PhotographError> {
    if let Some(folder) = setup.images {
        let level_name = level.name.replace(' ', "-");
        let stem = format!("{}-{}-{level_name}-{view}", subject.name, axis.name());
        save(photograph, subject, level, &folder.join(stem))?;
    }
    let found = subject.detector.detect(&photograph.image, "");
    Ok(score(&found, photograph, level.scene.scale(), subject.page.half_turn))
}

/// Writes a picture, and its truth beside it.
fn save(
    photograph: &Photograph,
    subject: &Subject,
    level: &Level,
    path: &Path,
) -> Result<(), PhotographError> {
    let Photograph { image, corners, .. } = photograph;
    let name = |extension: &str| {
        // A level's name may hold a point.
        let mut name = path.as_os_str().to_owned();
        name.push(extension);
        std::path::PathBuf::from(name)
    };
    let picture = table::png(image);
    let file_name = name(".png").file_name().unwrap_or_default().to_string_lossy().into_owned();
    let truth = table::truth(&file_name, &subject.name, &level.scene, corners);
    atomic::write(&name(".png"), |out| out.write_all(&picture))?;
    atomic::write(&name(".json"), |out| out.write_all(truth.as_bytes()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::scene::{Background, Tone};
    use super::*;

    fn subject(kind: Kind) -> Subject {
        let family = kind.spec().tags.map(|tags| Family::shipped(&tags.family).unwrap());
        Subject::of_kind(kind, family.as_ref()).unwrap()
    }

    /// Without noise and curve a corner is where the page's paths say, within what the model of a
    /// blurred corner leaves: neither the renderer nor the truth is shifted.
    #[test]
    fn truth_is_where_an_unspoiled_picture_shows_it() {
        let scene = scene::Scene {
            noise: 0.0,
            tone: Tone::Linear,
            gradient: 0.0,
            vignetting: 0.0,
            background: Background::Plain,
            bit_px: 5.0,
            ..scene::Scene::default()
        };
        let subject = subject(Kind::ALL[0]);
        let studio = Studio::new(1);
        let mut errors = Vec::new();
        for view in 0..3 {
            let photograph = take(&subject.page, &studio, &scene, view);
            let found = subject.detector.detect(&photograph.image, "");
            let score = score(&found, &photograph, 1.0, false);
            assert!(score.labelled == score.visible && score.wrong == 0, "{score:?}");
            errors.extend(score.errors_px);
        }
        let n = errors.len() as f64;
        let mean = errors.iter().sum::<DVec2>() / n;
        let squares = errors.iter().map(|error| error.length_squared());
        let rms = (squares.sum::<f64>() / (2.0 * n)).sqrt();
        assert!(mean.abs().max_element() < 0.001 && rms < 0.01, "{mean} {rms}");
    }

    /// A box along the way is no Gaussian; taken for one, it leaves covariances four times too large.
    #[test]
    fn corners_of_a_picture_that_moved_are_as_true_as_their_covariances_say() {
        for kind in [Kind::ALL[0], Kind::ALL[2]] {
            let subject = subject(kind);
            let scene = scene::Scene { motion_px: 7.0, ..scene::Scene::default() };
            let studio = Studio::new(2);
            let scores: Vec<Score> = (0..2)
                .map(|view| {
                    let photograph = take(&subject.page, &studio, &scene, view);
                    let found = subject.detector.detect(&photograph.image, "");
                    score(&found, &photograph, 1.0, false)
                })
                .collect();
            let errors = || scores.iter().flat_map(|score| &score.errors_px);
            let squares = errors().map(|error| error.length_squared()).sum::<f64>();
            let rms = (squares / (2 * errors().count()) as f64).sqrt();
            let normalised: Vec<f64> = scores.iter().flat_map(|s| s.normalised.clone()).collect();
            // A corner has two coordinates.
            let mean = normalised.iter().sum::<f64>() / (2 * normalised.len()) as f64;
            assert!(rms < 0.01 && (0.6..1.6).contains(&mean), "{}: {rms} {mean}", subject.name);
        }
    }

    #[test]
    fn boards_are_found_from_75_degrees() {
        for kind in [Kind::ALL[0], Kind::ALL[2]] {
            let subject = subject(kind);
            let scene = scene::Scene { tilt_deg: Some(75.0), ..scene::Scene::default() };
            let (mut visible, mut labelled) = (0, 0);
            for view in 0..2 {
                let photograph = take(&subject.page, &Studio::new(3), &scene, view);
                let score =
                    score(&subject.detector.detect(&photograph.image, ""), &photograph, 1.0, false);
                assert_eq!(score.wrong, 0, "{} {view}", subject.name);
                (visible, labelled) = (visible + score.visible, labelled + score.labelled);
            }
            assert!(labelled * 10 >= visible * 9, "{}: {labelled} of {visible}", subject.name);
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_bytes() {
        let subject = subject(Kind::ALL[3]);
        let scene = scene::Scene { covered: 0.2, glare: 2, ..scene::Scene::default() };
        let bytes = |seed| take(&subject.page, &Studio::new(seed), &scene, 0).image;
        let first = bytes(1);
        assert_eq!(first, bytes(1));
        assert_ne!(first, bytes(2));
    }
}
