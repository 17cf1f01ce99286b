//! What can be wrong with an artifact, each named with its place and its figures.

use std::fmt;

use serde::Serialize;

use deltille_core::targets::{Label, LineKind};

/// One way in which an artifact is not what the target says. Lengths in mm in the page frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Finding {
    /// The file has something that not every viewer shows alike, so that what is seen here need
    /// not be what is seen elsewhere.
    Construct {
        /// Where it is, in the words of the format.
        place: String,
        /// What it is.
        construct: String,
    },
    /// A list for other detectors is not that of the target.
    Listed {
        /// What differs.
        problem: String,
    },
    /// A path to cut, fold or engrave lies elsewhere.
    PathOff {
        /// Its layer.
        layer: &'static str,
        /// Where it should begin.
        at_mm: [f64; 2],
        /// Largest distance of a point.
        by_mm: f64,
    },
    /// A path to cut, fold or engrave is not there.
    PathMissing {
        /// Its layer.
        layer: &'static str,
        /// Where it should begin.
        at_mm: [f64; 2],
    },
    /// A path that the target does not have.
    PathExtra {
        /// Its layer.
        layer: &'static str,
        /// Where it begins.
        at_mm: [f64; 2],
    },
    /// The file has too many or too few pages.
    Pages {
        /// Pages of the file.
        found: usize,
        /// Sheets of the target.
        stated: usize,
    },
    /// What no picture of the page shows: words that are not those of the target, or marks beside the page.
    Unseen {
        /// Where it is, in the words of the format.
        place: String,
        /// What it is.
        problem: String,
    },
    /// A page in a file of its own is not there, or was not named with the others.
    PageMissing {
        /// File name of the page.
        page: String,
    },
    /// The page has another size.
    PageSize {
        /// Width and height in the file.
        found_mm: [f64; 2],
        /// Width and height in the target.
        stated_mm: [f64; 2],
    },
    /// A check bar has another length, or is not there.
    CheckBar {
        /// Which bar, from 1.
        bar: usize,
        /// Measured; `None` when an end was not found.
        found_mm: Option<f64>,
        /// Stated.
        stated_mm: f64,
    },
    /// A tag that stands alone is not where it should be.
    TagMissing {
        /// Stated id.
        id: u32,
    },
    /// The panel was not recognised.
    PanelMissing {
        /// Its id.
        panel: u32,
    },
    /// The picture shows another board: its corners are not those of the target.
    AnotherBoard {
        /// Corners that were found.
        found: usize,
        /// Corners that the target has on the sheet.
        stated: usize,
    },
    /// Black and white are exchanged.
    Inverted {
        /// Panel id.
        panel: u32,
    },
    /// Black and white tiles differ too little.
    Contrast {
        /// Panel id.
        panel: u32,
        /// Ink of white and black tiles, 0 to 1.
        ink: [f64; 2],
    },
    /// A check bar of the stated length is drawn otherwise.
    CheckBarDiffers {
        /// Which bar, from 1.
        bar: usize,
    },
    /// A text is not there, or reads otherwise.
    TextDiffers {
        /// Which text of the sheet, from 1.
        text: usize,
        /// What it should say.
        stated: Label,
    },
    /// Ink, or on a black field a lack of it, outside the tiles, texts and check bars.
    Spot {
        /// The middle of the spot.
        at_mm: [f64; 2],
        /// Its area, mm².
        area_mm2: f64,
    },
    /// A panel was recognised that belongs on another sheet.
    PanelForeign {
        /// Its id.
        panel: u32,
    },
    /// The panel is seen as in a mirror.
    Mirrored {
        /// Its id.
        panel: u32,
    },
    /// The panel is larger or smaller than stated.
    Scale {
        /// Its id.
        panel: u32,
        /// Found over stated length.
        scale: f64,
    },
    /// The panel is stretched: its scales along the page's axes differ.
    Stretched {
        /// Its id.
        panel: u32,
        /// Found over stated length along x and y.
        scale: [f64; 2],
    },
    /// The panel is turned on the page.
    Turned {
        /// Its id.
        panel: u32,
        /// Counter-clockwise.
        angle_deg: f64,
    },
    /// The panel lies elsewhere on the page.
    Shifted {
        /// Its id.
        panel: u32,
        /// Found minus stated position of its middle.
        by_mm: [f64; 2],
    },
    /// A corner was not found.
    CornerMissing {
        /// Corner id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
    },
    /// Something is wrong on one of the pages that a sheet is printed on.
    OnPage {
        /// The page's label.
        page: String,
        /// What is wrong.
        finding: Box<Finding>,
    },
    /// Two pages show different things where they overlap.
    PagesDiffer {
        /// Labels of the pages.
        pages: [String; 2],
        /// Where on the sheet.
        at_mm: [f64; 2],
    },
    /// A line is not there, or drawn otherwise.
    LineDiffers {
        /// Which line of the sheet, from 1.
        line: usize,
        /// What it is for.
        purpose: LineKind,
    },
    /// A face of a net is printed where another one belongs.
    FaceElsewhere {
        /// Panel id.
        panel: u32,
        /// Panel that belongs there.
        instead: u32,
    },
    /// A face of a net is turned in its place.
    FaceTurned {
        /// Panel id.
        panel: u32,
        /// Counter-clockwise.
        angle_deg: f64,
    },
    /// A face of a net hangs on no other.
    FaceLoose {
        /// Panel id.
        panel: u32,
    },
    /// Corners of a face, folded, are not where they are stated to be.
    FoldOff {
        /// Panel id.
        panel: u32,
        /// Largest deviation.
        by_mm: f64,
    },
    /// Two sides that should meet do not.
    EdgeOpen {
        /// Panels of the faces.
        panels: [u32; 2],
        /// How far they are apart.
        gap_mm: f64,
    },
    /// Two sides that meet do not carry one number, the same.
    EdgeNumbers {
        /// Panels of the faces.
        panels: [u32; 2],
        /// The numbers found along each.
        numbers: [Vec<usize>; 2],
    },
    /// A face of a net does not carry its number, once.
    FaceNumber {
        /// Panel id.
        panel: u32,
        /// The numbers found in it.
        names: Vec<usize>,
        /// Its number.
        stated: usize,
    },
    /// A tab says that it goes under another face than the one that its edge leads to.
    TabNames {
        /// Panel id of the face that it hangs on.
        panel: u32,
        /// The face that it names.
        named: usize,
        /// The face that it goes under.
        stated: usize,
    },
    /// A cut edge has no tab, or two.
    EdgeTabs {
        /// Panels of the faces.
        panels: [u32; 2],
        /// How many tabs.
        tabs: usize,
    },
    /// More than two sides carry a number.
    EdgeNumberAgain {
        /// The number.
        number: usize,
        /// How many sides.
        sides: usize,
    },
    /// A corner lies elsewhere, all else being right.
    CornerOff {
        /// Corner id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Found minus stated position.
        by_mm: [f64; 2],
    },
    /// A corner of a mesh lies elsewhere.
    CornerOff3d {
        /// Corner id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Found minus stated position in the target frame.
        by_mm: [f64; 3],
    },
    /// The surface of a body is not the stated one.
    Body {
        /// In which way.
        problem: String,
    },
    /// Triangles of a mesh whose normals are not theirs.
    Normals {
        /// How many.
        triangles: usize,
    },
    /// A tag of a mesh is not read, or with wrong bits.
    TagInexact {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Wrong bits; `None` when it was not read.
        errors: Option<u32>,
    },
    /// A corner was found where the target has none.
    CornerExtra {
        /// Where.
        at_mm: [f64; 2],
    },
    /// A tag reads as another one of its family.
    TagReads {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// The id that it reads.
        reads: u32,
        /// By how many thirds of a turn it is turned counter-clockwise.
        turns: u8,
    },
    /// A tag has too many wrong cells to be corrected.
    TagUnreadable {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Wrong cells, by bit.
        bits: Vec<u32>,
    },
    /// A tag has wrong cells that decoding would correct.
    TagDamaged {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Wrong cells, by bit.
        bits: Vec<u32>,
    },
    /// The detector reads a tag that the target does not have there.
    TagExtra {
        /// The id that it reads.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
    },
    /// A tile has the wrong colour.
    TileColour {
        /// Row of its lower-left vertex.
        row: i32,
        /// Column of its lower-left vertex.
        col: i32,
        /// Whether it should be black.
        should_be_black: bool,
    },
    /// Part of a tile has the wrong colour.
    Blemish {
        /// Row of the tile's lower-left vertex.
        row: i32,
        /// Column of the tile's lower-left vertex.
        col: i32,
        /// The middle of the spot.
        at_mm: [f64; 2],
        /// Its area, mm².
        area_mm2: f64,
    },
    /// An edge of a tile, or of a cell in it, lies elsewhere than stated.
    EdgeMoved {
        /// Row of the tile's lower-left vertex.
        row: i32,
        /// Column of the tile's lower-left vertex.
        col: i32,
        /// Where.
        at_mm: [f64; 2],
        /// How far, mm, positive where more is black.
        by_mm: f64,
    },
}

impl Finding {
    /// Whether the rest of the sheet is as stated: a tag, a tile or a corner is wrong, not a board.
    pub(super) fn is_local(&self) -> bool {
        use Finding::*;
        matches!(
            self,
            TagReads { .. }
                | TagUnreadable { .. }
                | TagDamaged { .. }
                | TagExtra { .. }
                | TileColour { .. }
                | Blemish { .. }
                | EdgeMoved { .. }
                | CornerMissing { .. }
                | CornerOff { .. }
                | CornerExtra { .. }
        )
    }
}

/// Rounded to what is shown, so that a tiny negative number is not shown as −0.
fn micrometres(mm: f64) -> f64 {
    (mm * 1e3).round() / 1e3 + 0.0
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Construct { place, construct } => {
                write!(f, "{place}: {construct}: not every viewer shows that alike")
            }
            Self::Unseen { place, problem } => write!(f, "{place}: {problem}"),
            Self::Listed { problem } => write!(f, "{problem}"),
            Self::PathOff { layer, at_mm: [x, y], by_mm } => {
                write!(f, "the path on {layer} from ({x:.2}, {y:.2}) mm is off by {by_mm:.3} mm")
            }
            Self::PathMissing { layer, at_mm: [x, y] } => {
                write!(f, "the path on {layer} from ({x:.2}, {y:.2}) mm is missing")
            }
            Self::PathExtra { layer, at_mm: [x, y] } => {
                write!(f, "a path on {layer} from ({x:.2}, {y:.2}) mm that should not be there")
            }
            Self::PageMissing { page } => {
                write!(f, "{page} is missing, or not named with the others")
            }
            Self::Pages { found, stated } => write!(f, "{found} pages instead of {stated}"),
            Self::PageSize { found_mm: [fw, fh], stated_mm: [sw, sh] } => {
                write!(f, "page of {fw:.3} x {fh:.3} mm instead of {sw:.3} x {sh:.3} mm")
            }
            Self::CheckBar { bar, found_mm: Some(found), stated_mm } => {
                write!(f, "check bar {bar} measures {found:.3} mm instead of {stated_mm:.3} mm")
            }
            Self::CheckBar { bar, found_mm: None, .. } => write!(f, "check bar {bar} not found"),
            Self::CheckBarDiffers { bar } => {
                write!(f, "check bar {bar} differs from the description")
            }
            Self::TagMissing { id } => write!(f, "tag {id} is not where it should be"),
            Self::PanelMissing { panel } => write!(f, "board {panel} not recognised"),
            Self::AnotherBoard { found, stated } => {
                write!(f, "shows another board: {found} corners instead of {stated}")
            }
            Self::Inverted { panel } => {
                write!(f, "board {panel} is inverted (black and white exchanged)")
            }
            Self::Contrast { panel, ink: [white, black] } => {
                let [white, black] = [white, black].map(|ink| 100.0 * ink);
                write!(
                    f,
                    "contrast of board {panel} too low: black tiles have {black:.0} % ink, \
                     white ones {white:.0} %"
                )
            }
            Self::TextDiffers { text, .. } => {
                write!(f, "label {text} differs from the description")
            }
            Self::Spot { at_mm: [x, y], area_mm2 } => {
                write!(f, "spot of {area_mm2:.3} mm² at ({x:.2}, {y:.2}) mm")
            }
            Self::PanelForeign { panel } => write!(f, "shows board {panel} of another sheet"),
            Self::Mirrored { panel } => write!(f, "board {panel} is mirrored"),
            Self::Scale { scale, .. } => write!(f, "scale {scale:.4}"),
            Self::Stretched { scale: [x, y], .. } => {
                write!(f, "stretched: scale {x:.4} along x, {y:.4} along y")
            }
            Self::Turned { angle_deg, .. } => {
                let angle = micrometres(*angle_deg);
                write!(f, "turned by {:.3}°", if angle == -180.0 { 180.0 } else { angle })
            }
            Self::Shifted { by_mm, .. } => {
                let [x, y] = by_mm.map(micrometres);
                write!(f, "shifted by ({x:.3}, {y:.3}) mm")
            }
            Self::CornerMissing { id, row, col } => {
                write!(f, "corner {id} at row {row} col {col} not found")
            }
            Self::OnPage { page, finding } => write!(f, "page {page}: {finding}"),
            Self::PagesDiffer { pages: [a, b], at_mm: [x, y] } => {
                write!(f, "pages {a} and {b} differ where they overlap, at ({x:.2}, {y:.2}) mm")
            }
            Self::LineDiffers { line, purpose } => {
                write!(f, "line {line}, to {}, differs from the description", purpose.name())
            }
            Self::FaceElsewhere { panel, instead } => {
                write!(f, "board {panel} is printed where board {instead} belongs")
            }
            Self::FaceTurned { panel, angle_deg } => {
                write!(f, "board {panel} is turned by {angle_deg:.0}° in its place")
            }
            Self::FaceLoose { panel } => write!(f, "board {panel} hangs on no other by a fold"),
            Self::FoldOff { panel, by_mm } => {
                write!(f, "board {panel}, folded, is off by {by_mm:.3} mm")
            }
            Self::EdgeOpen { panels: [a, b], gap_mm } => {
                write!(f, "the edges of boards {a} and {b} are {gap_mm:.3} mm apart when folded")
            }
            Self::EdgeNumbers { panels: [a, b], numbers } => {
                let [one, other] = numbers.each_ref().map(|numbers| enumerate(numbers));
                write!(
                    f,
                    "the edge between boards {a} and {b} has {one} on the first, {other} on the \
                     second"
                )
            }
            Self::FaceNumber { panel, names, stated } => {
                write!(f, "board {panel} carries {} instead of face {stated}", enumerate(names))
            }
            Self::TabNames { panel, named, stated } => {
                write!(f, "a tab of board {panel} names face {named} instead of {stated}")
            }
            Self::EdgeTabs { panels: [a, b], tabs } => {
                write!(f, "the edge between boards {a} and {b} has {tabs} tabs instead of one")
            }
            Self::EdgeNumberAgain { number, sides } => {
                write!(f, "edge number {number} is on {sides} sides")
            }
            Self::CornerOff { id, row, col, by_mm } => {
                let [x, y] = by_mm.map(micrometres);
                write!(f, "corner {id} at row {row} col {col} off by ({x:.3}, {y:.3}) mm")
            }
            Self::CornerOff3d { id, row, col, by_mm } => {
                let [x, y, z] = by_mm.map(micrometres);
                write!(f, "corner {id} at row {row} col {col} off by ({x:.3}, {y:.3}, {z:.3}) mm")
            }
            Self::Body { problem } => write!(f, "{problem}"),
            Self::Normals { triangles } => write!(f, "{triangles} triangles with wrong normals"),
            Self::TagInexact { id, row, col, errors: None } => {
                write!(f, "tag {id} at row {row} col {col} not read")
            }
            Self::TagInexact { id, row, col, errors: Some(n) } => {
                write!(f, "tag {id} at row {row} col {col} read with {n} wrong bits")
            }
            Self::CornerExtra { at_mm: [x, y] } => {
                write!(f, "a corner at ({x:.2}, {y:.2}) mm where none should be")
            }
            Self::TagReads { id, row, col, reads, .. } if id == reads => {
                write!(f, "tag {id} at row {row} col {col} is turned")
            }
            Self::TagReads { id, row, col, reads, .. } => {
                write!(f, "tag {id} at row {row} col {col} reads {reads}")
            }
            Self::TagUnreadable { id, row, col, bits } => {
                let n = bits.len();
                write!(f, "tag {id} at row {row} col {col} unreadable: {n} bits differ")
            }
            Self::TagDamaged { id, row, col, bits } => {
                let n = bits.len();
                let differ = if n == 1 { "bit differs" } else { "bits differ" };
                write!(f, "tag {id} at row {row} col {col} damaged: {n} {differ}")
            }
            Self::TagExtra { id, row, col } => {
                write!(f, "tag {id} is read at row {row} col {col}, where it should not be")
            }
            Self::TileColour { row, col, should_be_black: true } => {
                write!(f, "tile missing at row {row} col {col}")
            }
            Self::TileColour { row, col, should_be_black: false } => {
                write!(f, "tile at row {row} col {col} is black instead of white")
            }
            Self::Blemish { row, col, at_mm: [x, y], area_mm2 } => write!(
                f,
                "spot of {area_mm2:.3} mm² at ({x:.2}, {y:.2}) mm in the tile at row {row} col {col}"
            ),
            Self::EdgeMoved { row, col, at_mm: [x, y], by_mm } => write!(
                f,
                "an edge at ({x:.2}, {y:.2}) mm in the tile at row {row} col {col} is {:.3} mm beside its \
                 place, towards {}",
                by_mm.abs(),
                if *by_mm > 0.0 { "white" } else { "black" }
            ),
        }
    }
}

/// Numbers in words.
fn enumerate(numbers: &[usize]) -> String {
    let numbers: Vec<String> = numbers.iter().map(usize::to_string).collect();
    if numbers.is_empty() { "no number".to_owned() } else { numbers.join(" and ") }
}
