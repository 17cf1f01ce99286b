//! Detection on rendered photographs of a printed page with complete ground truth.
//!
//! ```text
//! page ─▶ view ─▶ optics ─▶ sensor ─▶ file ─▶ detector
//!   └───────┴── truth ───────────────────────▶ score
//! ```
//!
//! The input is a target and the quantities to vary. The output is the detection quality at each level.
//!
//! 1. `axes` are the varied quantities, changed one at a time from a fixed [`scene`], with the same poses at every
//!    level.
//! 2. `world` is the scene: the target's PDF, written and then rendered by hayro, its surroundings and its covers. The
//!    positions of corners come from the paths of the PDF, without use of [`deltille::synth`].
//! 3. `camera` is a pinhole with lens distortion, blur and illumination, and a sensor, without use of
//!    [`deltille::camera`].
//! 4. `photograph` renders a photograph with its ground truth.
//! 5. `result` compares detections with the ground truth, and produces tables and the plot.
//!
//! Not simulated: print that is not black and white, depth of field, lateral colour, rolling shutter.

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

/// Reason why a page cannot be photographed.
#[derive(Debug, thiserror::Error)]
pub enum PhotographError {
    /// The target has no sheets.
    #[error(
        "the target has no sheet to print: give the .json file that was written with its print files"
    )]
    NoSheet,
    /// The first sheet is larger than the paper.
    #[error("the target's sheet is printed on several pages: choose paper that fits it")]
    SeveralPages,
    /// No paths meet at the nominal position of a corner.
    #[error("the paths of the PDF do not meet at {at_mm} mm, where corner {id} should be")]
    NoCorner {
        /// Corner id.
        id: u32,
        /// Nominal position, mm.
        at_mm: DVec2,
    },
    /// The content of the PDF cannot be interpreted.
    #[error("the PDF's paths cannot be read: {0}")]
    Paths(String),
    /// The target cannot be drawn.
    #[error(transparent)]
    Artwork(#[from] ArtworkError),
    /// The PDF cannot be written.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// The PDF cannot be read back.
    #[error(transparent)]
    Document(#[from] DocumentError),
    /// A temporary file or an image cannot be created.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// An image cannot be written.
    #[error(transparent)]
    Write(#[from] atomic::WriteError),
}

/// Default boards of the experiment: 10 × 11 corners, or 9 × 12 on checkerboards, 20 mm apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// Deltille or checkerboard.
    pub grid: GridKind,
    /// Whether the board has the default tags.
    pub tagged: bool,
}

impl Kind {
    /// All four kinds.
    pub const ALL: [Self; 4] = [
        Self { grid: GridKind::Deltille, tagged: true },
        Self { grid: GridKind::Deltille, tagged: false },
        Self { grid: GridKind::Checker, tagged: true },
        Self { grid: GridKind::Checker, tagged: false },
    ];

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match (self.grid, self.tagged) {
            (GridKind::Deltille, true) => "deltille",
            (GridKind::Deltille, false) => "deltille-untagged",
            (GridKind::Checker, true) => "checker",
            (GridKind::Checker, false) => "checker-untagged",
        }
    }

    /// Returns the specification of the board.
    pub fn spec(self) -> BoardSpec {
        let [rows, cols] = match self.grid {
            GridKind::Deltille => [10, 11],
            GridKind::Checker => [9, 12],
        };
        let spec = BoardSpec::new(self.grid, rows, cols, 20.0);
        if self.tagged { spec } else { BoardSpec { tags: None, ..spec } }
    }
}

/// A photographed target, and its detector.
pub struct Subject {
    /// Its name in tables and file names.
    pub name: String,
    pub(crate) page: PrintedPage,
    detector: Detector,
}

impl Subject {
    /// Creates a subject from an existing target.
    ///
    /// # Errors
    /// Returns an error if the target has no sheet, or the family of its tags is unknown.
    pub fn new(name: &str, printing: &Printing) -> Result<Self, PhotographError> {
        let page = PrintedPage::new(printing)?;
        let detector = Detector::for_target(&printing.target, DetectorConfig::default())
            .map_err(ArtworkError::from)?
            .with_clock(clock::now);
        Ok(Self { name: name.to_owned(), page, detector })
    }

    /// Creates one of the default boards; `family` is that of its specification.
    ///
    /// # Errors
    /// Returns an error if the board cannot be made.
    pub fn of_kind(kind: Kind, family: Option<&Family>) -> Result<Self, PhotographError> {
        let (spec, paper) = (TargetSpec::Board(kind.spec()), PaperSpec::default());
        let printing = Printing::build(kind.name(), &spec, family, Some(&paper))
            .expect("the default boards can be built");
        Self::new(kind.name(), &printing)
    }
}

/// Number of photographs, and output folder.
pub struct Setup<'a> {
    /// Number of photographs at each level.
    pub views: u64,
    /// Seed of all random choices.
    pub seed: u64,
    /// The varied quantities.
    pub axes: &'a [Axis],
    /// Folder for the images with their ground truth.
    pub images: Option<&'a Path>,
}

impl Setup<'_> {
    /// Returns the number of photographs of one subject, which is also the number of progress reports.
    pub fn photographs(&self) -> usize {
        self.axes.iter().map(|axis| axis.levels().len()).sum::<usize>() * self.views as usize
    }
}

/// Photographs a subject at every level of the axes; returns `None` if cancelled.
///
/// Except for times, the result depends only on the subject and the setup.
///
/// # Errors
/// Returns an error if an image cannot be created or written.
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
            let shift = level.scene.edge_shift;
            let moved = (shift != 0.0).then(|| subject.page.with_moved_edges(shift));
            let page = moved.as_ref().unwrap_or(&subject.page);
            let scores: Result<Vec<Option<Score>>, PhotographError> = (0..setup.views)
                .into_par_iter()
                .map(|view| {
                    if cancel.load(Ordering::Relaxed) {
                        return Ok(None);
                    }
                    let photograph = take(page, &studio, &level.scene, view);
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

/// Writes a photograph if requested, and scores its detection.
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

/// Writes an image, and its ground truth beside it.
fn save(
    photograph: &Photograph,
    subject: &Subject,
    level: &Level,
    path: &Path,
) -> Result<(), PhotographError> {
    let Photograph { image, corners, .. } = photograph;
    let name = |extension: &str| {
        // The name of a level may contain a point.
        let mut name = path.as_os_str().to_owned();
        name.push(extension);
        std::path::PathBuf::from(name)
    };
    let png = table::png(image);
    let file_name = name(".png").file_name().unwrap_or_default().to_string_lossy().into_owned();
    let truth = table::truth(&file_name, &subject.name, &level.scene, corners);
    atomic::write(&name(".png"), |out| out.write_all(&png))?;
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

    /// Without noise and tone curve, the detected corner lies at the position given by the paths of
    /// the page, up to the residual of the corner model. So neither the renderer nor the ground
    /// truth is shifted.
    #[test]
    fn corners_of_a_clean_image_match_the_ground_truth() {
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

    /// Motion blur is a box, not a Gaussian. Modelled as a Gaussian, it would make the covariances four times too
    /// large, and hide the tags if it is half as long as an edge.
    #[test]
    fn boards_are_labelled_under_motion_blur_and_covariances_are_correct() {
        for (motion_px, most_px) in [(7.0, 0.008), (15.0, 0.025)] {
            for kind in [Kind::ALL[0], Kind::ALL[2]] {
                let subject = subject(kind);
                let scene = scene::Scene { motion_px, ..scene::Scene::default() };
                let scores = scores(&subject, &scene, &[(2, 0), (2, 1)]);
                let [labelled, visible] = [|s: &Score| s.labelled, |s: &Score| s.visible]
                    .map(|count| scores.iter().map(count).sum::<usize>());
                assert!(10 * labelled > 9 * visible, "{}: {labelled} of {visible}", subject.name);
                let errors = || scores.iter().flat_map(|score| &score.errors_px);
                let squares = errors().map(|error| error.length_squared()).sum::<f64>();
                let rms = (squares / (2 * errors().count()) as f64).sqrt();
                let normalised: Vec<f64> =
                    scores.iter().flat_map(|s| s.normalised.clone()).collect();
                // Each corner contributes two coordinates.
                let mean = normalised.iter().sum::<f64>() / (2 * normalised.len()) as f64;
                assert!(
                    rms < most_px && (0.6..1.6).contains(&mean),
                    "{}, {motion_px} px: {rms} {mean}",
                    subject.name
                );
            }
        }
    }

    /// Returns the scores of photographs of a scene, by seed and view.
    fn scores(subject: &Subject, scene: &scene::Scene, views: &[(u64, u64)]) -> Vec<Score> {
        let taken = views.iter().map(|&(seed, view)| {
            let photograph = take(&subject.page, &Studio::new(seed), scene, view);
            score(&subject.detector.detect(&photograph.image, ""), &photograph, 1.0, false)
        });
        taken.collect()
    }

    #[test]
    fn boards_are_found_at_75_degrees() {
        for kind in [Kind::ALL[0], Kind::ALL[2]] {
            let subject = subject(kind);
            let scene = scene::Scene { tilt_deg: Some(75.0), ..scene::Scene::default() };
            let scores = scores(&subject, &scene, &[(3, 0), (3, 1), (1, 2)]);
            for Score { visible, labelled, wrong, normalised, .. } in scores {
                assert_eq!(wrong, 0, "{}", subject.name);
                assert!(labelled * 10 >= visible * 9, "{}: {labelled} of {visible}", subject.name);
                let mean = normalised.iter().sum::<f64>() / (2 * normalised.len()) as f64;
                assert!(mean < 2.0, "{}: {mean}", subject.name);
            }
        }
    }

    /// Hands divide a board into parts, and touch all of its visible tags.
    #[test]
    fn all_parts_of_covered_boards_are_labelled() {
        let subject = subject(Kind::ALL[0]);
        let scene = scene::Scene { covered: 0.6, ..scene::Scene::default() };
        for Score { visible, labelled, wrong, .. } in
            scores(&subject, &scene, &[(1, 2), (1, 3), (21, 5)])
        {
            assert_eq!(wrong, 0);
            assert!(labelled * 10 >= visible * 8, "{labelled} of {visible}");
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
