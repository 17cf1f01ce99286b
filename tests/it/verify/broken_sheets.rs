//! Sheets with deliberate faults: each must fail verification, and for the right reason.

use std::path::PathBuf;

use crate::common::verdict::assert_found;
use deltille::artwork::{Artwork, Paint, Part, Shape, Sheet};
use deltille::export::{pdf, png, svg};
use deltille::family::Family;
use deltille::glam::DVec2;
use deltille::lattice::{GridKind, Vertex};
use deltille::layout::{Logo, PaperSpec, Printing};
use deltille::targets::{BoardSpec, TagSpec, TagsIn, TargetSpec};
use deltille::verify::{Finding, TileFinding, Verdict, Verifier};
use kurbo::{Affine, BezPath, Point};
use serde_json::json;
use tempfile::TempDir;

/// Resolution of the PNG files, dpi.
const DPI: f64 = 300.0;

struct Board {
    target: Printing,
    family: Family,
}

#[derive(Clone, Copy, Debug)]
enum Format {
    Pdf,
    Svg,
    Png,
}

const ALL: [Format; 3] = [Format::Pdf, Format::Svg, Format::Png];

fn spec() -> BoardSpec {
    let tags = Some(TagSpec { first_id: 17, ..TagSpec::default() });
    BoardSpec { board_id: 3, tags, ..BoardSpec::new(GridKind::Deltille, 5, 7, 20.0) }
}

/// A checkerboard with tags from id 17.
fn squares(tags_in: TagsIn) -> BoardSpec {
    let tags = TagSpec { first_id: 17, ..TagSpec::for_squares(tags_in) };
    BoardSpec { grid: GridKind::Checker, tags: Some(tags), ..spec() }
}

/// A board of every kind.
fn all_specs() -> [BoardSpec; 3] {
    [spec(), squares(TagsIn::Black), squares(TagsIn::White)]
}

fn board(spec: BoardSpec) -> Board {
    board_on(spec, &PaperSpec::default())
}

fn board_on(spec: BoardSpec, paper: &PaperSpec) -> Board {
    let family = spec.tags.as_ref().map_or("delTag25h7", |tags| &tags.family);
    let family = Family::shipped(family).unwrap();
    let spec = TargetSpec::Board(spec);
    let target = Printing::build("b", &spec, Some(&family), Some(paper)).unwrap();
    Board { target, family }
}

impl Board {
    fn artwork(&self) -> Artwork {
        self.target.draw().unwrap()
    }

    fn verify(&self, artwork: &Artwork, format: Format) -> Verdict {
        let folder = TempDir::new().unwrap();
        let path = |extension: &str| -> PathBuf { folder.path().join(format!("b.{extension}")) };
        let path = match format {
            Format::Pdf => {
                pdf::write(artwork, &path("pdf")).unwrap();
                path("pdf")
            }
            Format::Svg => {
                svg::write(artwork, 0, &path("svg")).unwrap();
                path("svg")
            }
            Format::Png => {
                png::write(&artwork.sheets[0], "b", &path("png"), DPI).unwrap();
                path("png")
            }
        };
        Verifier::new(&self.target).unwrap().verify_path(&path).unwrap()
    }

    /// Returns the position of the tile of a tag.
    fn tag(&self, index: usize) -> (i32, i32) {
        let tag = self.target.target.panels[0].tags[index];
        (tag.row, tag.col)
    }
}

/// Returns the shape of a tile.
fn tile(artwork: &mut Artwork, (row, col): (i32, i32)) -> &mut Shape {
    let is_it = |shape: &&mut Shape| matches!(shape.part, Part::Tile { row: r, col: c, .. } if (r, c) == (row, col));
    artwork.sheets[0].shapes.iter_mut().find(is_it).expect("the tile is drawn")
}

/// Swaps black and white in one cell: under the even-odd rule, an additional loop toggles its inside.
fn flip(board: &Board, artwork: &mut Artwork, at: (i32, i32), bit: u32) {
    let (panel, placement) = (&board.target.target.panels[0], board.target.sheets[0].placements[0]);
    assert_eq!(placement.angle_rad, 0.0);
    let [a, b, c] = panel.kind.tag_tile(Vertex::new(at.0, at.1)).frame().map(|v| {
        let place = placement.page_from_panel(panel.lattice_mm(v));
        Point::new(place.x, place.y)
    });
    let corners = board.family.cells().corners(bit, panel.tag_inset_bits());
    let mut path = BezPath::new();
    for (i, corner) in corners.into_iter().enumerate() {
        let point = a + (b - a) * corner.x + (c - a) * corner.y;
        if i == 0 { path.move_to(point) } else { path.line_to(point) }
    }
    path.close_path();
    tile(artwork, at).path.extend(path);
}

fn transform(artwork: &mut Artwork, affine: impl Fn(&Sheet) -> Affine) {
    for sheet in &mut artwork.sheets {
        let affine = affine(sheet);
        sheet.shapes.iter_mut().for_each(|shape| shape.path = affine * &shape.path);
    }
}

fn about_centre(sheet: &Sheet, affine: Affine) -> Affine {
    let centre = (sheet.width_mm / 2.0, sheet.height_mm / 2.0);
    Affine::translate(centre) * affine * Affine::translate((-centre.0, -centre.1))
}

#[test]
fn whole_sheets_pass_in_every_format() {
    for spec in all_specs() {
        for (tagged, inverted) in [(true, false), (false, false), (true, true), (false, true)] {
            let tags = spec.tags.clone().filter(|_| tagged);
            let spec = BoardSpec { tags, inverted, ..spec.clone() };
            let board = board(spec.clone());
            for format in ALL {
                let verdict = board.verify(&board.artwork(), format);
                assert!(verdict.passed, "{spec:?}: {verdict}");
                let sheet = &verdict.sheets[0];
                assert_eq!((sheet.corners_found, sheet.corners), (35, 35));
                assert_eq!(sheet.tags_exact, board.target.target.panels[0].tags.len());
                assert!(sheet.max_deviation_mm < 0.006, "{spec:?}: {verdict}");
            }
        }
    }
}

#[test]
fn swapped_tags_are_named() {
    for (board, format) in all_specs().map(board).into_iter().zip(ALL) {
        let mut swapped = board.target.clone();
        let tags = &mut swapped.target.panels[0].tags;
        (tags[0].id, tags[1].id) = (tags[1].id, tags[0].id);
        let artwork = swapped.draw().unwrap();
        let (row, col) = board.tag(0);
        let exchanged =
            json!({ "kind": "tag_reads", "id": 17, "row": row, "col": col, "reads": 18 });
        let verdict = board.verify(&artwork, format);
        assert_found(&verdict, [exchanged, json!({ "kind": "tag_reads", "id": 18, "reads": 17 })]);
    }
}

#[test]
fn a_flipped_cell_is_found_although_decoding_would_correct_it() {
    for board in all_specs().map(board) {
        let at = board.tag(1);
        for (bit, format) in [0, 12, 24].into_iter().zip(ALL) {
            let mut artwork = board.artwork();
            flip(&board, &mut artwork, at, bit);
            let damaged =
                json!({ "kind": "tag_damaged", "id": 18, "row": at.0, "col": at.1, "bits": [bit] });
            assert_found(&board.verify(&artwork, format), [damaged]);
        }
    }
}

#[test]
fn cells_flipped_beyond_correction_make_a_tag_unreadable() {
    let board = board(spec());
    let at = board.tag(0);
    let mut artwork = board.artwork();
    (4..8).for_each(|bit| flip(&board, &mut artwork, at, bit));
    let unreadable = json!({ "kind": "tag_unreadable", "id": 17, "bits": [4, 5, 6, 7] });
    assert_found(&board.verify(&artwork, Format::Pdf), [unreadable]);
}

#[test]
fn a_scale_is_named_with_its_value() {
    let board = board(spec());
    for scale in [0.99, 1.0005] {
        let mut artwork = board.artwork();
        transform(&mut artwork, |sheet| about_centre(sheet, Affine::scale(scale)));
        for format in ALL {
            let verdict = board.verify(&artwork, format);
            let bar = |bar| json!({ "kind": "check_bar", "bar": bar });
            assert_found(&verdict, [json!({ "kind": "scale", "scale": scale }), bar(1), bar(2)]);
            let findings = &verdict.sheets[0].findings;
            assert_eq!(findings.len(), 3, "one cause, not its consequences: {findings:?}");
        }
    }
}

#[test]
fn stretching_rotation_and_shift_are_distinguished() {
    let board = board(spec());
    let changes = [
        (
            Affine::scale_non_uniform(1.0, 0.998),
            json!({ "kind": "stretched", "scale": [1.0, 0.998] }),
        ),
        (Affine::rotate(0.002), json!({ "kind": "turned", "angle_deg": 0.002f64.to_degrees() })),
        (Affine::translate((0.0, 0.3)), json!({ "kind": "shifted", "by_mm": [0.0, 0.3] })),
    ];
    for (change, finding) in changes {
        let mut artwork = board.artwork();
        transform(&mut artwork, |sheet| about_centre(sheet, change));
        assert_found(&board.verify(&artwork, Format::Pdf), [finding]);
    }
}

#[test]
fn a_mirrored_page_is_named() {
    for tags in [spec().tags, None] {
        let board = board(BoardSpec { tags, rows: 4, ..spec() });
        let mut artwork = board.artwork();
        let mirror = Affine::scale_non_uniform(-1.0, 1.0);
        transform(&mut artwork, |sheet| about_centre(sheet, mirror));
        for format in ALL {
            let mirrored = json!({ "kind": "mirrored", "panel": 3 });
            assert_found(&board.verify(&artwork, format), [mirrored]);
        }
    }
}

#[test]
fn a_deleted_tile_is_named() {
    let plain = all_specs().map(|spec| BoardSpec { tags: None, ..spec });
    let boards = all_specs().into_iter().chain(plain).map(board);
    for (board, format) in boards.zip(ALL.into_iter().cycle()) {
        let mut artwork = board.artwork();
        let path = &mut tile(&mut artwork, (1, 3)).path;
        *path = BezPath::new();
        artwork.sheets[0].shapes.retain(|shape| !shape.path.is_empty());
        let verdict = board.verify(&artwork, format);
        let at = |kind| json!({ "kind": kind, "row": 1, "col": 3 });
        assert_found(&verdict, [at("tile_colour"), at("corner_missing")]);
    }
}

#[test]
fn a_short_check_bar_is_measured() {
    let board = board(spec());
    let mut short = board.target.clone();
    short.sheets[0].check_bars[0].to_mm.x -= 0.1;
    let artwork = short.draw().unwrap();
    let bar = &board.target.sheets[0].check_bars[0];
    let length = bar.to_mm.x - bar.from_mm.x;
    for format in ALL {
        let verdict = board.verify(&artwork, format);
        assert_found(&verdict, [json!({ "kind": "check_bar", "bar": 1 })]);
        assert_eq!(verdict.sheets[0].findings.len(), 1);
        let (stated, found) = verdict.sheets[0].check_bars_mm[0];
        assert!((stated - length).abs() < 1e-9);
        let off = found.unwrap() - (length - 0.1);
        // The renderers draw each end to within a 32nd of a pixel.
        assert!(off.abs() < 2.0 / 32.0 * 25.4 / DPI, "{off}: {verdict}");
    }
    let mut none = board.artwork();
    none.sheets[0].shapes.retain(|shape| shape.part != (Part::CheckBar { index: 1 }));
    let missing = json!({ "kind": "check_bar", "bar": 2, "found_mm": null });
    assert_found(&board.verify(&none, Format::Pdf), [missing]);
}

#[test]
fn a_wrong_page_size_or_page_count_is_named() {
    let board = board(spec());
    let mut artwork = board.artwork();
    artwork.sheets[0].width_mm += 0.2;
    for format in ALL {
        assert_found(&board.verify(&artwork, format), [json!({ "kind": "page_size" })]);
    }
    let mut artwork = board.artwork();
    artwork.sheets.push(artwork.sheets[0].clone());
    let pages = json!({ "kind": "pages", "found": 2, "stated": 1 });
    assert_found(&board.verify(&artwork, Format::Pdf), [pages]);
}

#[test]
fn dirt_and_holes_in_tiles_are_found() {
    let board = board(spec());
    let mut artwork = board.artwork();
    // A hairline of 0.1 mm across a black tile, like a seam between two halves.
    let shape = tile(&mut artwork, (1, 3));
    let bounds = kurbo::Shape::bounding_box(&shape.path);
    let (x, y) = bounds.center().into();
    let seam = kurbo::Rect::new(x - 4.0, y - 0.05, x + 4.0, y + 0.05);
    shape.path.extend(kurbo::Shape::path_elements(&seam, 0.1));
    // A spot of half a millimetre in the adjacent white tile.
    let spot = kurbo::Rect::new(bounds.x1 - 0.25, y - 0.25, bounds.x1 + 0.25, y + 0.25);
    let path = kurbo::Shape::to_path(&spot, 0.1);
    artwork.sheets[0].shapes.push(Shape {
        part: Part::Label { index: 9 },
        paint: Paint::Fill,
        path,
    });
    for format in ALL {
        let verdict = board.verify(&artwork, format);
        let spots = &verdict.sheets[0].findings;
        let spots = spots
            .iter()
            .filter(|finding| matches!(finding, Finding::Tile(TileFinding::Blemish { .. })));
        assert_eq!(spots.count(), 2, "{verdict}");
    }
}

#[test]
fn erased_or_altered_texts_and_spots_outside_the_board_are_found() {
    let board = board(spec());
    let mut altered = board.target.clone();
    let label = &mut altered.sheets[0].texts[0].text;
    *label = label.to_string().replace("edge 20 mm", "edge 21 mm").into();
    let altered = altered.draw().unwrap();
    let mut erased = board.artwork();
    erased.sheets[0].shapes.retain(|shape| shape.part != (Part::Label { index: 1 }));
    let mut blot = board.artwork();
    let origin_mm = board.target.sheets[0].placements[0].origin_mm;
    let at = kurbo::Circle::new((origin_mm.x, origin_mm.y - 2.5), 0.5);
    let path = kurbo::Shape::to_path(&at, 0.001);
    blot.sheets[0].shapes.push(Shape { part: Part::Label { index: 9 }, paint: Paint::Fill, path });
    let cases = [
        (altered, json!({ "kind": "text_differs", "text": 1 })),
        (erased, json!({ "kind": "text_differs", "text": 2 })),
        (blot, json!({ "kind": "spot" })),
    ];
    for ((artwork, finding), format) in cases.into_iter().zip(ALL) {
        let verdict = board.verify(&artwork, format);
        assert_found(&verdict, [finding]);
        assert_eq!(verdict.sheets[0].findings.len(), 1, "{verdict}");
    }
}

/// Verifies an image of the sheet with changed grey values.
fn verify_toned(board: &Board, tone: impl Fn(u8) -> u8) -> Verdict {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("b.png");
    png::write(&board.artwork().sheets[0], "b", &path, DPI).unwrap();
    let decoder = ::png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    let info = reader.info().clone();
    pixels.iter_mut().for_each(|pixel| *pixel = tone(*pixel));
    let mut encoder =
        ::png::Encoder::new(std::fs::File::create(&path).unwrap(), info.width, info.height);
    encoder.set_color(info.color_type);
    encoder.set_depth(info.bit_depth);
    encoder.set_pixel_dims(info.pixel_dims);
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    Verifier::new(&board.target).unwrap().verify_path(&path).unwrap()
}

#[test]
fn wrong_tones_and_other_boards_are_named() {
    let whole = board(spec());
    let is = |kind| json!({ "kind": kind, "panel": 3 });
    assert_found(&verify_toned(&whole, |v| 255 - v), [is("inverted")]);
    assert_found(&verify_toned(&whole, |v| 170 + v / 3), [is("contrast")]);
    let other = board(BoardSpec { rows: 4, cols: 5, ..spec() });
    let verdict = whole.verify(&other.artwork(), Format::Png);
    assert_found(&verdict, [json!({ "kind": "another_board", "found": 20, "stated": 35 })]);
}

#[test]
fn a_bar_much_shorter_than_stated_is_measured() {
    let mut board = board(spec());
    let artwork = board.artwork();
    let bar = &mut board.target.sheets[0].check_bars[0];
    let printed = bar.length_mm();
    bar.to_mm.x += 10.0;
    let verdict = board.verify(&artwork, Format::Png);
    assert_found(&verdict, [json!({ "kind": "check_bar", "bar": 1 })]);
    let (_, found) = verdict.sheets[0].check_bars_mm[0];
    assert!((found.unwrap() - printed).abs() < 0.02, "{verdict}");
}

/// A triangle with a round hole.
fn logo(apex: f64) -> Logo {
    let triangle = [(0.0, 80.0), (100.0, 80.0), (apex, 0.0)].map(DVec2::from).to_vec();
    let rotations = (0..60).map(|n| f64::from(n) / 60.0 * std::f64::consts::TAU);
    let hole =
        rotations.map(|turn| DVec2::new(50.0, 55.0) + 12.0 * DVec2::from_angle(turn)).collect();
    Logo::from_outlines(&[triangle, hole]).unwrap()
}

#[test]
fn a_logo_that_is_missing_moved_or_altered_is_found() {
    let paper = PaperSpec { logo: Some(logo(50.0)), ..PaperSpec::default() };
    let board = board_on(spec(), &paper);
    let part = Part::Logo { index: 0 };
    let [place] = board.target.sheets[0].logos[..] else { panic!("a logo") };
    let mut erased = board.artwork();
    erased.sheets[0].shapes.retain(|shape| shape.part != part);
    let mut moved = board.artwork();
    let shape = moved.sheets[0].shapes.iter_mut().find(|shape| shape.part == part).unwrap();
    shape.path.apply_affine(Affine::translate((0.15, 0.0)));
    let mut altered = board.target.clone();
    altered.logo = Some(logo(45.0));
    let altered = altered.draw().unwrap();
    let blot = |x: f64, y: f64| {
        let mut blot = board.artwork();
        let at = place.at_mm + place.height_mm * DVec2::new(x, y);
        let path = kurbo::Shape::to_path(&kurbo::Circle::new((at.x, at.y), 0.4), 0.001);
        blot.sheets[0].shapes.push(Shape {
            part: Part::Label { index: 9 },
            paint: Paint::Fill,
            path,
        });
        blot
    };
    let differs = || json!({ "kind": "logo_differs", "logo": 1 });
    let cases = [
        (erased, differs()),
        (moved, differs()),
        (altered, differs()),
        // In its hole, beside its apex, and outside.
        (blot(0.625, 0.3125), differs()),
        (blot(0.1, 0.9), differs()),
        (blot(0.5, 1.3), json!({ "kind": "spot" })),
    ];
    for format in ALL {
        let good = board.verify(&board.artwork(), format);
        assert!(good.passed, "{good}");
    }
    for ((artwork, finding), format) in cases.into_iter().zip(ALL.into_iter().cycle()) {
        assert_found(&board.verify(&artwork, format), [finding]);
    }
}
