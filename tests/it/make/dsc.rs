//! `.dsc` descriptions: round trips in both dialects, files of other programs, invalid files.

use deltille::export::dsc::{self, Dialect, DscError};
use deltille::family::Family;
use deltille::lattice::{GridKind, Vertex};
use deltille::targets::{
    BoardSpec, Corner, ListFormat, Outline, Panel, PanelPose, TagPlacement, TagsIn, Target,
    TargetSpec,
};
use glam::DVec3;
use proptest::prelude::*;

use crate::common::data;
use crate::common::page::Page;

fn board(rows: u32, cols: u32, edge_mm: f64, boards: u32) -> Target {
    let plain = BoardSpec::new(GridKind::Deltille, rows, cols, edge_mm);
    let spec = BoardSpec { boards, board_id: 5, ..plain };
    let family = Family::shipped("delTag25h7").unwrap();
    Target::build("board", &TargetSpec::Board(spec), Some(&family)).unwrap()
}

/// A triangular face with `side` corners along its base, in the plane given by `pose`.
fn face(side: i32, pose: PanelPose) -> Target {
    let mut target = board(2, 2, 10.0, 1);
    let panel = Panel {
        id: 0,
        kind: GridKind::Deltille,
        edge_mm: 10.0,
        border_bits: Some(1.5),
        tag_margin_bits: None,
        gap_edges: None,
        discs_mm: None,
        hole_mm: None,
        rim_mm: None,
        tags_in: TagsIn::Black,
        inverted: false,
        outline: Outline::Touching,
        matrix: [side as u32; 2],
        pose,
        corners: (0..side)
            .flat_map(|row| (0..side - row).map(move |col| (row, col)))
            .enumerate()
            .map(|(id, (row, col))| {
                let panel_mm = Vertex::new(row, col).position() * 10.0;
                let target_mm = pose.target_from_panel(panel_mm);
                Corner { id: id as u32, row, col, panel_mm, target_mm, measured: None }
            })
            .collect(),
        tags: vec![TagPlacement { id: 7, row: 0, col: 1 }],
    };
    target.panels = vec![panel];
    target
}

/// Returns the parts of a panel that a `.dsc` contains.
fn carried(panel: &Panel) -> (u32, [u32; 2], &[Corner], &[TagPlacement], Option<f64>) {
    (panel.id, panel.matrix, &panel.corners, &panel.tags, panel.border_bits)
}

fn assert_same(a: &Target, b: &Target) {
    assert_eq!(a.family, b.family);
    assert_eq!(a.panels.len(), b.panels.len());
    for (a, b) in a.panels.iter().zip(&b.panels) {
        assert_eq!(carried(a), carried(b));
        let off = |c: &Corner| {
            let back = b.pose.target_from_panel(c.panel_mm);
            (0..3).map(|i| (back[i] - c.target_mm[i]).abs()).fold(0.0, f64::max)
        };
        assert!(b.corners.iter().all(|c| off(c) < 1e-9));
    }
}

proptest! {
    #[test]
    fn boards_come_back_from_the_fork_dialect(
        rows in 2u32..12, cols in 2u32..12, edge in 1.0f64..50.0, boards in 1u32..4,
    ) {
        let target = board(rows, cols, edge, boards);
        let text = dsc::write(&target, Dialect::Fork).unwrap();
        assert_same(&target, &dsc::read(&text, "board").unwrap());
    }

    #[test]
    fn irregular_formatting_is_accepted(crlf: bool, spaces: bool, newline: bool, unit in 0usize..3) {
        let target = board(3, 4, 20.0, 2);
        let mut text = dsc::write(&target, Dialect::Fork).unwrap();
        // (coordinates, size) in mm and cm, or in m and cm.
        let [scale, size] = [[1.0, 1.0], [0.1, 1.0], [1e-3, 0.1]][unit];
        text = text.lines().map(|line| {
            let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
            let scaled = match fields.len() { 6 => 3..6, 4 => 3..4, _ => 0..0 };
            let factor = if fields.len() == 6 { scale } else { size };
            for field in &mut fields[scaled] {
                *field = (field.parse::<f64>().unwrap() * factor).to_string();
            }
            fields.join(if spaces { " , " } else { "," }) + if crlf { "\r\n" } else { "\n" }
        }).collect();
        let text = if newline { text.as_str() } else { text.trim_end() };
        let read = dsc::read(text, "board").unwrap();
        for (a, b) in target.panels.iter().zip(&read.panels) {
            prop_assert!((a.edge_mm - b.edge_mm).abs() < 1e-9);
            prop_assert_eq!(&a.tags, &b.tags);
            for (a, b) in a.corners.iter().zip(&b.corners) {
                let off = (0..3).map(|i| (a.target_mm[i] - b.target_mm[i]).abs());
                prop_assert!(off.fold(0.0, f64::max) < 1e-9);
            }
        }
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "([0-9tdelTagh.,\\- ]{0,20}\n){0,8}") {
        let _ = dsc::read(&text, "text");
    }

    #[test]
    fn no_truncated_file_makes_the_reader_panic(cut in 0usize..2000) {
        let text = dsc::write(&board(4, 4, 20.0, 1), Dialect::Fork).unwrap();
        let _ = dsc::read(&text[..cut.min(text.len())], "text");
    }
}

#[test]
fn faces_come_back_in_both_dialects_from_any_pose() {
    let turned = PanelPose {
        rotation: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        translation_mm: DVec3::new(3.0, -4.0, 5.5),
        covariance: None,
    };
    for pose in [PanelPose::IDENTITY, turned] {
        let target = face(6, pose);
        for dialect in [Dialect::Original, Dialect::Fork] {
            let text = dsc::write(&target, dialect).unwrap();
            let header =
                if dialect == Dialect::Original { "0,8,0,10\nt25h7,1.5" } else { "0,6,6,10\ndel" };
            assert!(text.starts_with(header), "{text}");
            let read = dsc::read(&text, "face").unwrap();
            assert_same(&target, &read);
            assert_eq!(Dialect::of(&read), dialect);
            assert_eq!(dsc::write(&read, dialect).unwrap(), text);
        }
    }
}

#[test]
fn squares_are_counted_from_the_top_in_the_original_dialect() {
    let corners = |y: [i32; 3]| {
        let line = |(row, y): (usize, i32)| {
            (0..2).map(move |col| format!("-1,{col},{row},{},{y},0\n", 20 * col)).collect()
        };
        y.into_iter().enumerate().map(line).collect::<Vec<String>>().concat()
    };
    let body = corners([0, 20, 40]);
    let original = dsc::read(&format!("1, 3, 4, 20\r\nt36h11, 2\r\n{body}"), "squares").unwrap();
    let fork = dsc::read(&format!("1,2,3,20\naprilTag36h11,2\n{body}"), "squares").unwrap();
    assert_eq!(original.panels, fork.panels);
    let panel = &fork.panels[0];
    assert_eq!((panel.kind, panel.matrix), (GridKind::Checker, [2, 3]));
    assert_eq!(dsc::point_id(panel, Dialect::Original, Vertex::new(0, 1)), 5);
    assert_eq!(dsc::point_id(panel, Dialect::Fork, Vertex::new(0, 1)), 1);
    assert_eq!(original.family.unwrap().name, "aprilTag36h11");
}

#[test]
fn targets_that_a_dialect_cannot_express_are_rejected() {
    let whole = board(4, 4, 20.0, 1);
    let but = |change: fn(&mut Target)| {
        let mut target = whole.clone();
        change(&mut target);
        target
    };
    let cases = [
        (Dialect::Original, but(|_| {})),
        (Dialect::Fork, but(|target| target.family = None)),
        (Dialect::Fork, but(|target| target.family.as_mut().unwrap().name = "d25h7".to_owned())),
        (Dialect::Fork, but(|target| target.panels[0].inverted = true)),
    ];
    for (dialect, target) in cases {
        let error = dsc::write(&target, dialect).unwrap_err();
        assert!(matches!(error, DscError::Refused { .. }), "{error}");
    }
}

#[test]
fn invalid_files_are_rejected_with_the_line() {
    let good = "0,3,3,20\ndelTag25h7,1.5\n0,0,0,0,0,0\n-1,1,0,20,0,0\n-1,0,1,10,17.3,0\n";
    assert!(dsc::read(good, "x").is_ok());
    let cases = [
        ("", 0),
        ("\n\n", 0),
        ("0,3,3\n", 1),
        ("0,3,3,NaN\nx,1\n", 1),
        ("0,3,3,0\nx,1\n", 1),
        ("0,3,3,20\n", 1),
        ("0,3,3,20\ndelTag49h12,1\n", 2),
        ("0,3,3,20\ndelTag25h7,-1\n", 2),
        ("0,3,3,20\ndelTag25h7,1.5\n", 1),
        ("0,8,0,20\nt25h7,1.5\n-1,0,0,0,0,0\n", 1),
        ("0,4294967295,9,20\nt25h7,1.5\n-1,0,0,0,0,0\n", 1),
    ];
    let edits = [
        ("-1,1,0,20,0,0", "-1,3,0,20,0,0", 4),
        ("-1,1,0,20,0,0", "-1,0,0,20,0,0", 4),
        ("-1,1,0,20,0,0", "-1,1,0,inf,0,0", 4),
        ("-1,1,0,20,0,0", "-1,1,0,27,0,0", 1),
        ("0,0,0,0,0,0", "343,0,0,0,0,0", 3),
        ("0,0,0,0,0,0", "-2,0,0,0,0,0", 3),
        ("-1,0,1,10,17.3,0", "-1,0,1,10,27.3,0", 0),
    ];
    let cases = cases.map(|(text, line)| (text.to_owned(), line)).into_iter();
    let edits = edits.map(|(from, to, line)| (good.replace(from, to), line));
    let mut page = Page::default();
    for (text, line) in cases.chain(edits) {
        let error = dsc::read(&text, "x").unwrap_err();
        page.said(&format!("{text:?}"), &error.to_string());
        match error {
            DscError::Line { line: at, .. } => assert_eq!(at, line, "{text}: {error}"),
            _ => assert_eq!(line, 0, "{text}: {error}"),
        }
    }
    page.is("dsc");
}

#[test]
#[cfg_attr(not(has_data), ignore = "no photographs: set DELTILLE_DATA to their folder")]
fn the_targets_of_the_fork_are_read() {
    for (name, boards, corners, tags) in [("ico_deltille", 20, 66, 10), ("a4_deltille", 3, 76, 8)] {
        let text =
            std::fs::read_to_string(data("reference-boards").join(format!("{name}.dsc"))).unwrap();
        let target = dsc::read(&text, name).unwrap();
        assert_eq!(
            target.spec,
            TargetSpec::Listed(deltille::targets::ListedSpec { format: ListFormat::DscFork })
        );
        assert_eq!(target.panels.len(), boards);
        for panel in &target.panels {
            assert_eq!((panel.corners.len(), panel.tags.len()), (corners, tags));
        }
        assert_same(&target, &Target::from_json(&target.to_json()).unwrap());
        assert_same(
            &target,
            &dsc::read(&dsc::write(&target, Dialect::Fork).unwrap(), name).unwrap(),
        );
    }
}
