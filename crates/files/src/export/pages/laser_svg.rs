//! SVG for a laser or a plotter, at true size: engraved areas are filled in black, and cut lines
//! are red hairlines. There is no paper background, because a laser would engrave it.
//!
//! The reader accepts only files in the form of the writer, so nothing can move, hide or scale the cut lines.

use glam::DVec2;
use kurbo::{BezPath, Point};
use svg::Document;
use svg::node::element::{Description, Path, Title};

use super::svg::{HEAD, data, number};
use deltille_layout::artwork::{CutDrawing, CutLayer, CutPath};

/// Blank margin around the drawing, mm.
pub const AROUND_MM: f64 = 1.0;

/// Width of the cut lines, mm: laser programs treat it as a hairline.
const HAIRLINE_MM: f64 = 0.01;

/// Layers with the names of their paths, in drawing order.
const LAYERS: [(CutLayer, &str); 2] = [(CutLayer::Engrave, "engrave"), (CutLayer::Cut, "cut")];

/// Returns the text of the SVG of a drawing with closed paths; paths on layers other than these two
/// are omitted.
pub fn text(drawing: &CutDrawing, title: &str, subject: &str) -> String {
    let [left, lower, right, upper] = drawing.bounds_mm().unwrap_or_default();
    let [width, height] = [right - left, upper - lower].map(|mm| number(mm + 2.0 * AROUND_MM));
    let at = |p: &DVec2| Point::new(p.x - left + AROUND_MM, upper - p.y + AROUND_MM);
    let document = Document::new()
        .set("width", format!("{width}mm"))
        .set("height", format!("{height}mm"))
        .set("viewBox", format!("0 0 {width} {height}"))
        .add(Title::new(title))
        .add(Description::new().add(svg::node::Text::new(subject)));
    let document = LAYERS.into_iter().fold(document, |document, (layer, name)| {
        let mut all = BezPath::new();
        for path in drawing.paths.iter().filter(|path| path.layer == layer) {
            for (i, point) in path.points_mm.iter().map(at).enumerate() {
                if i == 0 { all.move_to(point) } else { all.line_to(point) }
            }
            all.close_path();
        }
        let path = Path::new().set("id", name).set("d", data(&all));
        document.add(match layer {
            CutLayer::Engrave => path.set("fill", "#000").set("fill-rule", "evenodd"),
            _ => path.set("fill", "none").set("stroke", "#f00").set("stroke-width", HAIRLINE_MM),
        })
    });
    format!("{HEAD}{document}\n")
}

/// Reads the text of an SVG with this title and subject, mm, y up.
///
/// # Errors
/// Returns the first differing line, counted from 1, if [`text`] would not write the same text.
pub fn read(found: &str, title: &str, subject: &str) -> Result<CutDrawing, usize> {
    let mut drawing = CutDrawing::default();
    for (index, line) in found.lines().enumerate() {
        let Some((data, rest)) =
            line.strip_prefix("<path d=\"").and_then(|line| line.split_once('"'))
        else {
            continue;
        };
        let named = |name: &str| rest.contains(&format!(" id=\"{name}\""));
        let layer = LAYERS.iter().find(|(_, name)| named(name)).ok_or(index + 1)?.0;
        for outline in data.split_terminator('Z') {
            let points_mm = points(outline).ok_or(index + 1)?;
            drawing.paths.push(CutPath { layer, closed: true, points_mm });
        }
    }
    // The version of the program may differ.
    let rewritten = text(&drawing, title, subject);
    let is_writer = |line: &str| line.starts_with("<!-- deltille ") && line.ends_with(" -->");
    let mut lines = found.split('\n').zip(rewritten.split('\n')).enumerate();
    let other = lines.find(|(index, (a, b))| a != b && !(*index == 1 && is_writer(a)));
    match other {
        Some((index, _)) => Err(index + 1),
        None if found.split('\n').count() != rewritten.split('\n').count() => Err(1),
        None => Ok(drawing),
    }
}

/// The points of an outline that consists of a move and lines.
fn points(outline: &str) -> Option<Vec<DVec2>> {
    let point = |words: &str| {
        let (x, y) = words.split_once(' ')?;
        let [x, y] = [x, y].map(|word| word.parse::<f64>().ok().filter(|value| value.is_finite()));
        Some(DVec2::new(x?, -y?))
    };
    outline.strip_prefix('M')?.split('L').map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::targets::BoardSpec;
    use deltille_layout::Printing;
    use deltille_layout::artwork::to_laser;

    #[test]
    fn only_written_files_are_read_back() {
        let board = Printing::new("board", BoardSpec::deltille(3, 4, 20.0)).unwrap();
        let drawing = to_laser(&board, 0.15).unwrap();
        let good = text(&drawing, "board", "a board");
        let read_back = read(&good, "board", "a board").unwrap();
        assert_eq!(text(&read_back, "board", "a board"), good);
        assert_eq!(read_back.paths.len(), drawing.paths.len());
        let older = good.replace(concat!("deltille ", env!("CARGO_PKG_VERSION")), "deltille 0.0.1");
        assert!(read(&older, "board", "a board").is_ok());
        for (from, to) in [
            ("</svg>", "<rect width=\"9\" height=\"9\"/>\n</svg>"),
            ("<path ", "<path transform=\"scale(2)\" "),
            ("#f00", "#00f"),
            ("mm\"", "in\""),
            ("M", "m"),
            ("Z\"", "L inf 0Z\""),
        ] {
            let bad = good.replacen(from, to, 1);
            assert_ne!(bad, good, "{from}");
            assert!(read(&bad, "board", "a board").is_err(), "{from}");
        }
        assert!(read(&good, "other", "a board").is_err());
    }
}
