//! Targets that other programs define: what is written, verified, found again and refused. Whether the other programs
//! find them is asked by `tests/independent`.

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
        "--squares 5x4 --dictionary apriltag_36h11 --legacy --first-id 580 -o legacy",
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
    // Of the markers those that have four corners around them.
    assert_eq!((grid.corners.len(), grid.tags.len()), (12, 3));

    page.title("What cannot be made");
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
