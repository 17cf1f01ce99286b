//! Runs each reader on a file, checks its guarantees, and returns whether it accepted the file.

use std::path::Path;

use deltille::camera::Camera;
use deltille::export::dsc::{self, Dialect};
use deltille::export::{csv, detection as detections, orpc, sheet, solid_mesh};
use deltille::family::Family;
use deltille::frames::{FrameOptions, Frames};
use deltille::lattice::GridKind;
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::photograph;
use deltille::verify::Verifier;
use deltille_cli::deltille::BoardSettings;
use glam::{DVec2, DVec3};

use super::good::{BOARD, SOLID};

/// A file and its content.
pub struct File<'a> {
    pub path: &'a Path,
    pub bytes: &'a [u8],
}

impl File<'_> {
    fn text(&self) -> Option<&str> {
        std::str::from_utf8(self.bytes).ok()
    }
}

/// Returns limits of about a hundredth of the default, so that excessive use shows soon: just enough for the texture of
/// a valid mesh.
fn limits() -> Limits {
    let mut limits = Limits::default();
    (limits.max_bytes, limits.max_pixels) = (2_000_000, 2_500_000);
    (limits.max_nodes, limits.max_seconds) = (40_000, 20.0);
    limits
}

fn assert_finite(numbers: impl IntoIterator<Item = f64>) {
    numbers.into_iter().for_each(|number| assert!(number.is_finite(), "{number} was accepted"));
}

pub fn target(file: File) -> bool {
    let Some(Ok(target)) = file.text().map(Printing::from_json) else { return false };
    for panel in &target.target.panels {
        let corners = panel.corners.iter();
        assert!(corners.into_iter().all(|c| c.panel_mm.is_finite() && c.target_mm.is_finite()));
    }
    let again = Printing::from_json(&target.to_json()).expect("written files are readable");
    assert_eq!(again, target);
    true
}

pub fn detection(file: File) -> bool {
    let Some(Ok(found)) = file.text().map(detections::read) else { return false };
    assert_finite(found.grids.iter().flat_map(|grid| &grid.corners).flat_map(|c| [c.x, c.y]));
    let again = detections::read(&detections::write(&found)).expect("written files are readable");
    assert_eq!(again, found);
    for list in [
        csv::write(&found, &[&BOARD.target]),
        orpc::write(&found, None),
        orpc::write(&found, Some(&BOARD.target)),
    ] {
        assert!(!list.contains("NaN") && !list.contains("inf"), "{list}");
    }
    true
}

pub fn sheet(file: File) -> bool {
    let Some(Ok(sheet)) = file.text().map(|text| sheet::read_sheet(text, &[])) else {
        return false;
    };
    assert_finite(sheet.print_scale.into_iter().flatten());
    true
}

pub fn family(file: File) -> bool {
    let Some(Ok(family)) = file.text().map(Family::from_json) else { return false };
    assert_eq!(Family::from_json(&family.to_json()).expect("written files are readable"), family);
    true
}

pub fn camera(file: File) -> bool {
    let Some(Ok(camera)) = file.text().map(Camera::from_yaml) else { return false };
    assert_eq!(Camera::from_yaml(&camera.to_yaml()).expect("written files are readable"), camera);
    for point in [DVec3::Z, DVec3::new(0.3, -0.2, 1.0), DVec3::new(1.0, 1.0, 1e-9), DVec3::NEG_Z] {
        assert!(camera.project(point).is_none_or(|pixel| pixel.is_finite()));
    }
    let _ = camera.unproject(DVec2::new(1.0, 2.0));
    true
}

pub fn template(file: File) -> bool {
    let read = |grid| {
        let settings = BoardSettings::read(file.path, grid).ok()?;
        Some(settings.plan(grid).is_ok())
    };
    [GridKind::Deltille, GridKind::Checker].map(read).contains(&Some(true))
}

pub fn points(file: File) -> bool {
    let Some(Ok(points)) = file.text().map(csv::read_points) else { return false };
    assert!(points.into_iter().all(|point| point.is_finite()));
    true
}

pub fn dsc(file: File) -> bool {
    let Some(Ok(list)) = file.text().map(|text| dsc::read(text, "b")) else { return false };
    let corners = list.panels.iter().flat_map(|panel| &panel.corners);
    assert!(corners.into_iter().all(|c| c.panel_mm.is_finite() && c.target_mm.is_finite()));
    for dialect in [Dialect::Fork, Dialect::Original] {
        let Ok(text) = dsc::write(&list, dialect) else { continue };
        dsc::read(&text, "b").expect("written files are readable");
    }
    true
}

pub fn mesh(file: File) -> bool {
    let Ok((mesh, _)) = solid_mesh::read(file.bytes) else { return false };
    assert_finite(mesh.vertices().iter().flat_map(|v| v.to_array()));
    true
}

pub fn photograph(file: File) -> bool {
    let read = |accept_damaged| {
        let photograph = photograph::read_with_notes(file.path, &limits(), accept_damaged).ok()?;
        let pixels = photograph.image.width() * photograph.image.height();
        assert!(pixels as u64 <= limits().max_pixels);
        assert!(accept_damaged || photograph.notes.damage.is_none());
        Some(photograph.notes.damage)
    };
    let [undamaged, _] = [false, true].map(read);
    undamaged.is_some()
}

pub fn recording(file: File) -> bool {
    let mut options = FrameOptions::default();
    options.limits = limits();
    // The sample has a second topic.
    options.topic =
        file.path.extension().filter(|end| *end == "mcap").map(|_| "/camera/image".to_owned());
    let Ok(frames) = Frames::open(file.path, &options) else { return false };
    // An error is the last item.
    let mut is_whole = true;
    for frame in frames {
        let Ok(frame) = frame else {
            is_whole = false;
            continue;
        };
        assert!(is_whole, "a frame after an error");
        let stated = frame.pixels(&limits());
        let Ok(photograph) = frame.read(&limits(), true) else { continue };
        let pixels = photograph.image.width() as u64 * photograph.image.height() as u64;
        assert!(pixels <= limits().max_pixels && stated == Some(pixels));
    }
    is_whole
}

pub fn page(file: File) -> bool {
    verify(&BOARD, file.path)
}

pub fn solid(file: File) -> bool {
    verify(&SOLID, file.path)
}

fn verify(target: &Printing, path: &Path) -> bool {
    let verifier = Verifier::new(target).expect("it was built with this family");
    let Ok(verdict) = verifier.within(limits()).verify_path(path) else { return false };
    let sheets = verdict.sheets.iter().flat_map(|sheet| &sheet.findings);
    let faces = verdict.faces.iter().flat_map(|face| &face.findings);
    let findings = verdict.findings.iter().chain(sheets).chain(faces).count();
    assert_eq!(verdict.passed, findings == 0, "{verdict}");
    verdict.passed
}
