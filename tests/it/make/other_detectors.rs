//! Targets defined by other programs: written, verified, detected and rejected. `tests/independent` checks whether
//! the other programs find them.

use crate::common::command::deltille;
use crate::common::page::Page;
use deltille::targets::Target;

#[test]
fn charuco_boards_are_written_verified_and_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for args in [
        "--squares 5x4 --edge 30mm --marker 22mm --dictionary 5x5_100 --name board --svg --png",
        "--squares 5x4 --dictionary apriltag_36h11 --legacy --first-id 570 -o legacy",
        "--squares 5x4 --gltf --3mf --plate 2mm -o plate",
    ] {
        assert!(page.run(at, &format!("deltille charuco {args}")).status.success(), "{args}");
    }
    deltille(at, "detect --target board.json board.png -o found").success();
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    let found = deltille::export::detection::read(&read("found/board.json")).unwrap();
    let [grid] = found.grids.as_slice() else { panic!("{:?}", found.grids.len()) };
    let target = Target::from_json(&read("board.json")).unwrap();
    for corner in &grid.corners {
        let panel = &target.panels[0];
        let stated = panel.corners.iter().find(|c| (c.row, c.col) == (corner.row, corner.col));
        assert_eq!(corner.id, stated.map(|corner| corner.id));
    }
    // Only markers with four corners around them.
    assert_eq!((grid.corners.len(), grid.tags.len()), (12, 3));

    page.title("Rejected");
    for args in [
        "--squares 8",
        "--squares 8x2",
        "--squares 5x4 --dictionary aruco_original",
        "--squares 5x4 --edge 30mm --marker 29mm",
        "--squares 5x4 --edge 2m",
        "--squares 5x4 --dictionary apriltag_16h5 --first-id 25",
        "--squares 20x14 --edge 30mm --paper A4 --dictionary 4x4_1000",
        "--squares 5x4 --dpi 600",
        "--squares 5x4 --with board.json",
    ] {
        page.refused(at, &format!("deltille charuco -o out {args}"));
    }
    page.is("charuco");
}

#[test]
fn april_grids_are_written_with_the_file_of_kalibr_and_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for args in [
        "--tags 4x3 --edge 30mm --name grid --svg --png",
        "--tags 2x2 --edge 60mm --gap 0.5 --tag-border 1 --first-id 583 -o small",
        "--tags 2x2 --usd --texture 1024 -o plate",
    ] {
        assert!(page.run(at, &format!("deltille aprilgrid {args}")).status.success(), "{args}");
    }
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    page.said("Kalibr's target file", &read("grid.yaml"));
    deltille(at, "detect --target grid.json grid.png -o found").success();
    let found = deltille::export::detection::read(&read("found/grid.json")).unwrap();
    let [grid] = found.grids.as_slice() else { panic!("{:?}", found.grids.len()) };
    // Kalibr counts corners row by row.
    assert!(grid.corners.iter().all(|c| c.id == Some((8 * c.row + c.col) as u32)));
    assert_eq!((grid.corners.len(), grid.tags.len()), (48, 12));

    page.title("Rejected");
    for args in [
        "--tags 6",
        "--tags 1x6",
        "--tags 6x6 --gap 1.5",
        "--tags 6x6 --edge 1mm",
        "--tags 25x24",
        "--tags 6x6 --family d25h7",
        "--tags 6x6 --edge 88mm --paper A3",
    ] {
        page.refused(at, &format!("deltille aprilgrid -o out {args}"));
    }
    page.is("aprilgrid");
}

#[test]
fn circles_are_written_and_verified() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for args in [
        "--circles 7x5 --spacing 25mm --name plain --pdf --svg --png",
        "--circles 4x11 --asymmetric --spacing 18mm --diameter 12mm --name shifted",
    ] {
        assert!(page.run(at, &format!("deltille circles {args}")).status.success(), "{args}");
    }
    page.title("A missing circle, and circles of the wrong size");
    let svg = std::fs::read_to_string(at.join("plain.svg")).unwrap();
    let json = std::fs::read_to_string(at.join("plain.json")).unwrap();
    let start = svg.find("<path").unwrap();
    let end = start + svg[start..].find("/>").unwrap() + 2;
    std::fs::write(at.join("plain.svg"), svg[..start].to_owned() + &svg[end..]).unwrap();
    assert_eq!(page.run(at, "deltille verify plain.json plain.svg").status.code(), Some(1));
    std::fs::write(at.join("plain.svg"), &svg).unwrap();
    let larger = json.replace("12.5", "12.7");
    assert_ne!(json, larger);
    std::fs::write(at.join("larger.json"), larger).unwrap();
    assert_eq!(page.run(at, "deltille verify larger.json plain.svg").status.code(), Some(1));

    page.title("Rejected");
    for args in ["--circles 1x5", "--circles 7x5 --diameter 19mm", "--circles 7x5 --spacing 0.5mm"]
    {
        page.refused(at, &format!("deltille circles -o out {args}"));
    }
    page.refused(at, "deltille detect --target plain.json plain.png -o out");
    page.is("circles");
}
