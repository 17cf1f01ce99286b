//! Undistorted images and rectified pairs. `tests/independent/undistort.py` compares them with OpenCV.

use std::fs;

use deltille::camera::{BrownConrady, Camera, CameraFile, Lens};
use deltille::targets::{BoardSpec, Target};
use tempfile::TempDir;

use crate::common::command::deltille;

/// A folder with a camera and a colour image with 16 bits per channel.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let lens = BrownConrady { radial: [-0.2, 0.04, 0.0], ..BrownConrady::default() };
    let camera = Camera::centred(320, 240, 220.0, Lens::BrownConrady(lens));
    fs::write(folder.path().join("camera.yaml"), camera.to_yaml()).unwrap();
    let colour = |x: u32, y: u32| image::Rgb([200 * x as u16, 250 * y as u16, 12345]);
    image::ImageBuffer::from_fn(320, 240, colour).save(folder.path().join("photo.png")).unwrap();
    folder
}

#[test]
fn colours_and_depth_stay_and_positions_follow_the_camera() {
    let folder = folder();
    deltille(folder.path(), "undistort --camera camera.yaml photo.png --maps -o new").success();
    let new = folder.path().join("new");
    let picture = image::open(new.join("photo-undistorted.png")).unwrap();
    let image::DynamicImage::ImageRgb16(picture) = picture else { panic!("{:?}", picture.color()) };
    let camera = |name: &str| {
        Camera::from_yaml(&fs::read_to_string(folder.path().join(name)).unwrap()).unwrap()
    };
    let (from, to) = (camera("camera.yaml"), camera("new/camera-undistorted.yaml"));
    // The values of the image encode the position of each pixel.
    for (x, y, colour) in picture.enumerate_pixels().filter(|(x, y, _)| x % 7 == 3 && y % 5 == 2) {
        let ray = to.unproject([f64::from(x), f64::from(y)].into()).unwrap().direction;
        let place = from.project(ray).unwrap();
        let [red, green, blue] = colour.0.map(f64::from);
        let off = (red / 200.0 - place.x).hypot(green / 250.0 - place.y);
        assert!(off < 0.01 && blue == 12345.0, "{x}, {y}: {place}, {off} px");
    }
    let map = fs::read(new.join("camera-undistorted-map-y.npy")).unwrap();
    assert!(map.starts_with(b"\x93NUMPY") && map.len() == 128 + 4 * 320 * 240);
    // Images of this program are replaced, others are kept.
    deltille(folder.path(), "undistort --camera camera.yaml photo.png -o new").success();
    fs::copy(folder.path().join("photo.png"), new.join("photo-undistorted.png")).unwrap();
    let refused = deltille(folder.path(), "undistort --camera camera.yaml photo.png -o new");
    let said = refused.code(2);
    assert!(String::from_utf8_lossy(&said.get_output().stderr).contains("would be lost"));
}

#[test]
fn a_view_keeps_the_diagnoses_of_its_camera() {
    let folder = folder();
    let path = folder.path().join("camera.yaml");
    let read = |path| CameraFile::from_yaml(&fs::read_to_string(path).unwrap()).unwrap();
    let calibrated_with =
        vec![Target::new("desk", BoardSpec::deltille(4, 5, 20.0)).unwrap().identity()];
    let failed = Some("it left 90 px".to_owned());
    let file = CameraFile { calibrated_with, failed, ..read(path.clone()) };
    fs::write(&path, file.to_yaml()).unwrap();
    let said = deltille(folder.path(), "undistort --camera camera.yaml -o new").success();
    let said = String::from_utf8_lossy(&said.get_output().stderr).into_owned();
    assert!(said.contains("camera.yaml: the calibration failed: it left 90 px"), "{said}");
    let refused = deltille(
        folder.path(),
        "calibrate none --grid checker --edge 20mm --fixed-intrinsics camera.yaml",
    )
    .code(2);
    let said = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(said.contains("the calibration failed: it left 90 px"), "{said}");
    let view = read(folder.path().join("new/camera-undistorted.yaml"));
    assert_eq!((view.calibrated_with, view.failed), (file.calibrated_with, file.failed));
}

#[test]
fn impossible_views_are_refused_in_one_line() {
    let folder = folder();
    let refused = |args: &str, words: &str| {
        let said = deltille(folder.path(), args).code(2);
        let said = String::from_utf8(said.get_output().stderr.clone()).unwrap();
        assert!(said.contains(words) && said.trim().lines().count() == 1, "{args}: {said}");
    };
    refused("undistort --camera camera.yaml --field 180deg", "less than 180°");
    refused("undistort --camera camera.yaml --field wide", "expected inside, whole");
    refused("undistort --camera camera.yaml --size 10", "not a valid width and height");
    refused("undistort --camera camera.yaml --size 60000x60000", "--max-pixels");
    refused("undistort --camera none.yaml", "none.yaml");
    refused("rectify camera.yaml --pair a,b", "camera.yaml");
    refused("rectify camera.yaml --pair a,a", "two different cameras");
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 2);
}

/// The files of the view are written with the images, or not at all if no image could be made.
#[test]
fn a_damaged_photograph_leaves_nothing() {
    let folder = folder();
    fs::write(folder.path().join("cut.png"), b"\x89PNG\r\n\x1a\n").unwrap();
    deltille(folder.path(), "undistort --camera camera.yaml cut.png -o new").code(2);
    assert!(!folder.path().join("new").exists());
    deltille(folder.path(), "undistort --camera camera.yaml cut.png").code(2);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    deltille(folder.path(), "undistort --camera camera.yaml cut.png photo.png -o new").code(1);
    let new = folder.path().join("new");
    assert!(
        new.join("camera-undistorted.yaml").exists() && !new.join("cut-undistorted.png").exists()
    );
}
