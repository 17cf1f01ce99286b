//! Real photographs: one of each set in `tests/photographs`, the sets and published artifacts in `../shared/data` or
//! where `DELTILLE_DATA` points.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::common::data;
use deltille::detect::{Detector, DetectorConfig, Grid, InkEstimate};
use deltille::export::dsc;
use deltille::lattice::GridKind;
use deltille::photograph;
use deltille::raster::Gray;
use deltille::verify::Document;
use image::imageops::FilterType;

/// Returns the photographs of a set: the one in the repository, and all others if they are available.
fn images(set: &str) -> Vec<PathBuf> {
    let here = Path::new(crate::common::REPOSITORY).join("tests/photographs");
    let in_folder = |folder: &Path| {
        let entries = std::fs::read_dir(folder).into_iter().flatten();
        entries.map(|entry| entry.unwrap().path()).collect::<Vec<_>>()
    };
    let is_of_set = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().starts_with(set);
    let mut images = in_folder(&data(set));
    images.sort();
    images.splice(..0, in_folder(&here).into_iter().filter(is_of_set));
    assert!(!images.is_empty() && (cfg!(not(has_data)) || images.len() > 30), "{images:?}");
    images
}

/// Returns whether the next corners of a row and of a column, if present, lie as on the print.
fn is_unmirrored(p: &[f64; 2], along: Option<&[f64; 2]>, up: Option<&[f64; 2]>) -> bool {
    along
        .zip(up)
        .is_none_or(|(q, r)| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]) < 0.0)
}

/// Returns whether a grid is a lattice seen through a lens. Every corner lies near the midpoint of its opposite
/// neighbours, and all small triangles have the same, unmirrored handedness.
fn topology_is_consistent(grid: &Grid) -> bool {
    let at: BTreeMap<(i32, i32), [f64; 2]> =
        grid.corners.iter().map(|c| ((c.row, c.col), [c.x, c.y])).collect();
    at.iter().all(|(&(row, col), p)| {
        let near = |dr: i32, dc: i32| at.get(&(row + dr, col + dc));
        let straight = [(0, 1), (1, 0), (1, -1)].into_iter().all(|(dr, dc)| {
            let (Some(q), Some(r)) = (near(dr, dc), near(-dr, -dc)) else { return true };
            let edge = (q[0] - r[0]).hypot(q[1] - r[1]) / 2.0;
            ((q[0] + r[0]) / 2.0 - p[0]).hypot((q[1] + r[1]) / 2.0 - p[1]) < 0.1 * edge
        });
        straight && is_unmirrored(p, near(0, 1), near(1, 0))
    })
}

#[test]
fn all_110_corners_of_the_robot_hand_photographs() {
    let images = images("robot-hand");
    let detector =
        Detector::for_grid(GridKind::Deltille, Some((10, 11)), DetectorConfig::default());
    let mut complete = 0;
    for path in &images {
        let detection = detector.detect(&photograph::read(path).unwrap(), "photograph");
        assert!(detection.grids.len() <= 1, "a false grid in {}", path.display());
        let Some(grid) = detection.grids.first() else { continue };
        assert!(topology_is_consistent(grid), "wrong topology in {}", path.display());
        let labelled = (grid.corners.first().map(|c| (c.row, c.col)) == Some((0, 4)))
            && grid.corners.last().map(|c| (c.row, c.col)) == Some((9, 10));
        complete += usize::from(grid.corners.len() == 110 && labelled);
    }
    println!("{complete} of {} photographs complete", images.len());
    assert_eq!(complete, images.len());
}

/// The apparent tone curve in these images is the ink spread of the print: every image gives the same, from any side
/// and distance.
#[test]
#[cfg_attr(not(has_data), ignore = "no photographs: set DELTILLE_DATA to their folder")]
fn all_images_of_one_print_have_the_same_ink() {
    let images = images("robot-hand");
    let detector = Detector::for_grid(GridKind::Deltille, None, DetectorConfig::default());
    let ink = |path: &PathBuf| detector.detect(&photograph::read(path).unwrap(), "photograph").ink;
    let inks: Vec<InkEstimate> = images.iter().step_by(3).filter_map(ink).collect();
    let all = InkEstimate::of_all(&inks).unwrap();
    println!("{all}, from {} of {} pictures", all.images, images.len().div_ceil(3));
    assert!(all.used && inks.len() == images.len().div_ceil(3));
    // Where the blur is skewed, the ink is less certain.
    let is_near = |ink: &InkEstimate| {
        (ink.edges - all.edges).abs()
            < (0.1 * all.edges).max(4.0 * ink.edges_sd).min(0.2 * all.edges)
    };
    assert!(inks.iter().all(|ink| ink.used && is_near(ink)), "{inks:?}");
}

#[test]
fn checkerboards_and_lamps_are_not_deltille_grids() {
    let images = images("fisheye");
    let detector = Detector::for_grid(GridKind::Deltille, None, DetectorConfig::default());
    for path in images.iter().step_by(4) {
        let detection = detector.detect(&photograph::read(path).unwrap(), "photograph");
        assert!(detection.grids.is_empty(), "a false grid in {}", path.display());
    }
}

/// Largest ratio of successive edges. An equidistant lens sees it at x edges from the foot of the camera on the plane,
/// at a height of one edge. It is ((x + 1)² + 1)/(x² + 1), at most the golden ratio squared. A camera this wide cannot
/// be nearer and see the board.
const MAX_RATIO: f64 = 2.618;

/// Returns whether rows and columns of a checkerboard are straight for a few squares, and unmirrored.
fn squares_are_consistent(grid: &Grid) -> bool {
    let at: BTreeMap<(i32, i32), [f64; 2]> =
        grid.corners.iter().map(|c| ((c.row, c.col), [c.x, c.y])).collect();
    at.iter().all(|(&(row, col), p)| {
        let near = |dr: i32, dc: i32| at.get(&(row + dr, col + dc));
        let straight = [(0, 1), (1, 0)].into_iter().all(|(dr, dc)| {
            let (Some(q), Some(r)) = (near(dr, dc), near(-dr, -dc)) else { return true };
            let (a, b) = ([q[0] - p[0], q[1] - p[1]], [p[0] - r[0], p[1] - r[1]]);
            let cos = (a[0] * b[0] + a[1] * b[1]) / (a[0].hypot(a[1]) * b[0].hypot(b[1]));
            let ratio = a[0].hypot(a[1]) / b[0].hypot(b[1]);
            // A row bends by less than 45° at a corner.
            cos > 0.7 && (1.0 / MAX_RATIO..MAX_RATIO).contains(&ratio)
        });
        straight && is_unmirrored(p, near(0, 1), near(1, 0))
    })
}

#[test]
fn corners_of_the_fisheye_photographs() {
    let images = images("fisheye");
    let detector = Detector::for_grid(GridKind::Checker, Some((8, 11)), DetectorConfig::default());
    let mut found = 0;
    for path in &images {
        let detection = detector.detect(&photograph::read(path).unwrap(), "photograph");
        assert_eq!(detection.grids.len(), 1, "a false grid in {}", path.display());
        let grid = &detection.grids[0];
        assert!(squares_are_consistent(grid), "wrong topology in {}", path.display());
        let span = |of: fn(&deltille::detect::GridCorner) -> i32| {
            let values = grid.corners.iter().map(of);
            values.clone().max().unwrap() - values.min().unwrap() + 1
        };
        let mut size = [span(|c| c.row), span(|c| c.col)];
        size.sort();
        assert!(size[0] <= 8 && size[1] <= 11, "{size:?} in {}", path.display());
        if grid.corners.len() == 88 {
            let last = grid.corners.last().map(|c| (c.row, c.col));
            assert_eq!(last, Some((7, 10)), "labels of {}", path.display());
        }
        found += grid.corners.len();
    }
    let all = 88 * images.len();
    println!("{found} of {all} corners");
    assert!(found * 1000 >= all * 999, "{found} of {all} corners");
}

/// A photograph enlarged to 48 megapixels has its corners at the same positions. Grain of the same
/// size is far more frequent than corners, and ink spread covers several pixels.
#[test]
fn enlarged_photographs_show_the_same_corners() {
    for (folder, kind, size) in
        [("robot-hand", GridKind::Deltille, (10, 11)), ("fisheye", GridKind::Checker, (8, 11))]
    {
        let path = &images(folder)[0];
        let detector = Detector::for_grid(kind, Some(size), DetectorConfig::default());
        for filter in [FilterType::Triangle, FilterType::CatmullRom] {
            let small = image::open(path).unwrap();
            let (width, height) = (5 * small.width(), 5 * small.height());
            // Compiled with optimization, unlike the generic function of the same crate.
            let large = small.resize_exact(width, height, filter).into_luma8().into_raw();
            let large = Gray::from_vec(width as usize, height as usize, large).unwrap();
            let before = detector.detect(&photograph::read(path).unwrap(), "photograph");
            let after = detector.detect(&large, "photograph");
            let (before, after) = (&before.grids[0].corners, &after.grids[0].corners);
            let mut errors: Vec<f64> = Vec::new();
            for corner in after {
                let [x, y] = [corner.x, corner.y].map(|c| (c + 0.5) / 5.0 - 0.5);
                let distance = before.iter().map(|b| (b.x - x).hypot(b.y - y));
                errors.push(distance.fold(f64::INFINITY, f64::min));
            }
            errors.sort_by(f64::total_cmp);
            let (count, all) = (errors.len(), before.len());
            assert!(count + 1 >= all && count <= all, "{count} of {all}: {}", path.display());
            let median = errors[count / 2];
            assert!(median < 0.05, "median {median} px: {}", path.display());
        }
    }
}

#[test]
fn deltille_boards_are_not_checkerboards() {
    let images = images("robot-hand");
    let detector = Detector::for_grid(GridKind::Checker, None, DetectorConfig::default());
    for path in images.iter().step_by(4) {
        let detection = detector.detect(&photograph::read(path).unwrap(), "photograph");
        assert!(detection.grids.is_empty(), "a false grid in {}", path.display());
    }
}

#[test]
#[cfg_attr(not(has_data), ignore = "no photographs: set DELTILLE_DATA to their folder")]
fn published_targets_decode_completely() {
    for (name, corners, tags) in [("a4_deltille", 76, 8), ("ico_deltille", 66, 10)] {
        let folder = data("reference-boards");
        let text = std::fs::read_to_string(folder.join(format!("{name}.dsc"))).unwrap();
        let target = dsc::read(&text, name).unwrap();
        let detector = Detector::for_target(&target, DetectorConfig::default()).unwrap();
        let document = Document::open(&folder.join(format!("{name}.pdf"))).unwrap();
        assert_eq!(document.pages(), target.panels.len());
        for page in 0..document.pages() {
            let image = document.render(page, 300.0 / 25.4).unwrap().image;
            let detection = detector.detect(&image, name);
            assert_eq!(detection.grids.len(), 1, "{name}, page {page}");
            let grid = &detection.grids[0];
            assert_eq!(grid.panel, Some(page as u32));
            assert_eq!(
                (grid.corners.len(), grid.tags.len()),
                (corners, tags),
                "{name}, page {page}"
            );
            assert!(grid.tags.iter().all(|tag| tag.errors == 0));
            assert!(grid.corners.iter().all(|corner| corner.id.is_some()));
        }
    }
}
