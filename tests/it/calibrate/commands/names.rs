//! Names in files.

use super::{board, camera, detections, folder};
use crate::common::page::Page;
use deltille::export::detection;

/// Names of targets, cameras and images in files lead to no other folder, and do not affect a terminal.
#[test]
fn names_in_files_do_not_escape_the_folder() {
    let target = board(8, 9);
    let found = detections(&target, 6, 0.7);
    let folder = folder(&target, &found);
    let path = |name: &str| folder.path().join(name);
    for (i, image) in ["../secret.png", "a\u{1b}[31m.png"].into_iter().enumerate() {
        let mut detection = found[i].clone();
        detection.image = image.to_owned();
        std::fs::write(path(&format!("corners/{i:02}.json")), detection::write(&detection))
            .unwrap();
    }
    std::fs::write(path("camera.yaml"), camera().to_yaml()).unwrap();
    let text = std::fs::read_to_string(path("board.json")).unwrap();
    let mut page = Page::default();
    for name in ["../../x", "/tmp/x", "..", "a\u{1b}[31mb", ""] {
        let name = serde_json::to_string(name).unwrap();
        page.title(&name);
        let named = format!("\"name\": {name}");
        std::fs::write(path("bad.json"), text.replacen("\"name\": \"board\"", &named, 1)).unwrap();
        let commands = [
            "verify bad.json",
            "render bad.json --camera camera.yaml -o out",
            "detect --target bad.json bad.json -o out",
            "calibrate corners --target bad.json --model radtan -o out/camera.yaml",
        ];
        for args in &commands[..if name.contains("31m") { 4 } else { 1 }] {
            page.refused(folder.path(), &format!("deltille {args}"));
        }
    }

    // An image outside the image folder is not shown.
    std::fs::create_dir(path("photos")).unwrap();
    image::GrayImage::from_pixel(64, 48, image::Luma([99])).save(path("secret.png")).unwrap();
    let args = "calibrate corners --target board.json --model radtan --images photos --report page.html -o camera2.yaml";
    page.title("Missing images");
    assert!(page.warned(folder.path(), &format!("deltille {args}")).status.success());
    page.is("names");
    assert!(!std::fs::read_to_string(path("page.html")).unwrap().contains("data:image"));
}
