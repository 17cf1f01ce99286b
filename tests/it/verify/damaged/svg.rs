//! Damaged SVG.

use super::edit::{append, before, line, swap, text};
use super::{Case, Damage, cases};

/// Returns the cases for a board.
pub fn board() -> Vec<Case> {
    let over = |element: &str| before("</svg>", element);
    let on = |element: &str, attribute: &str| {
        swap(&format!("<{element} "), &format!("<{element} {attribute} "))
    };
    cases(
        "b.svg",
        vec![
            ("a web page over the board", over("<foreignObject width=\"297\" height=\"210\"/>")),
            ("hidden in print", over("<style>@media print { * { display: none } }</style>")),
            (
                "hidden on dark screens",
                over("<style>@media (prefers-color-scheme: dark) { path { fill: #fff } }</style>"),
            ),
            ("a script", over("<script>document.rootElement.remove()</script>")),
            (
                "an animation",
                before("</g>", "<animate attributeName=\"fill\" to=\"#fff\" dur=\"1s\"/>"),
            ),
            (
                "an animated value",
                before("</g>", "<set attributeName=\"fill\" to=\"#fff\" begin=\"1s\"/>"),
            ),
            ("a moving board", before("</g>", "<animateTransform attributeName=\"transform\"/>")),
            (
                "an external picture",
                over("<image href=\"http://example.org/a.png\" width=\"9\" height=\"9\"/>"),
            ),
            ("an external element", over("<use href=\"other.svg#a\"/>")),
            ("text", over("<text x=\"9\" y=\"9\">5</text>")),
            ("a choice by language", over("<switch/>")),
            ("a link", over("<a href=\"http://example.org\"/>")),
            ("a filter", over("<filter id=\"f\"/>")),
            (
                "a duplicate tile",
                line("<path", |path| format!("{path}\n{}", path.replace("id=\"", "id=\"x"))),
            ),
            ("a hairline", swap("<path ", "<path d=\"M9 9L20 9Z\" id=\"x\"/><path ")),
            (
                "a speck of dust",
                swap("<path ", "<path d=\"M3 3L3.03 3L3.03 3.03L3 3.03Z\" id=\"x\"/><path "),
            ),
            ("a mask", over("<mask id=\"m\"/>")),
            ("a pattern", over("<pattern id=\"p\"/>")),
            ("a view element", over("<view id=\"v\" viewBox=\"0 0 9 9\"/>")),
            ("a nested drawing", over("<svg/>")),
            (
                "a path in another namespace",
                over("<path xmlns=\"http://example.org\" d=\"M0 0Z\"/>"),
            ),
            ("no paper", swap("<rect fill=\"#fff\" height=\"100%\" width=\"100%\"/>", "")),
            ("a white page over all", over("<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>")),
            ("marks with a style", on("g", "style=\"display: none\"")),
            ("a class", on("g", "class=\"a\"")),
            ("marks with an opacity", on("g", "opacity=\"0\"")),
            ("a transform", on("g", "transform=\"rotate(1)\"")),
            ("a blend mode", on("g", "mix-blend-mode=\"screen\"")),
            ("a hidden tile", on("path", "display=\"none\"")),
            ("an invisible tile", on("path", "visibility=\"hidden\"")),
            ("a clipped tile", on("path", "clip-path=\"url(#c)\"")),
            ("a dashed tile", on("path", "stroke-dasharray=\"1 1\"")),
            ("a script attribute", on("svg", "onload=\"alert()\"")),
            ("a different aspect ratio", on("svg", "preserveAspectRatio=\"none\"")),
            ("white marks", swap("fill=\"#000\"", "fill=\"#fff\"")),
            ("marks in the current colour", swap("fill=\"#000\"", "fill=\"currentColor\"")),
            ("marks with a pattern", swap("fill=\"#000\"", "fill=\"url(#p)\"")),
            ("a different fill rule", swap("evenodd", "nonzero")),
            ("black paper", swap("fill=\"#fff\"", "fill=\"#000\"")),
            ("an incomplete tile", line("<path", |line| line.replacen("Z\"", "L1\"", 1))),
            (
                "a tile with an arc",
                line("<path", |line| line.replacen("Z\"", "A1 1 0 0 0 2 2Z\"", 1)),
            ),
            ("a style sheet", before("<svg", "<?xml-stylesheet href=\"a.css\"?>")),
            ("entities", before("<svg", "<!DOCTYPE svg [<!ENTITY a \"b\">]>")),
            ("a different encoding", swap("UTF-8", "UTF-16")),
            ("text on the page", over("words")),
            (
                "an edge that bulges by 0.1 mm",
                on_tile(|d| {
                    let [[ax, ay], [bx, by], [cx, cy]] = vertices(d);
                    let bulge = [(ax + bx) / 2.0, (ay + by) / 2.0 + 0.1];
                    format!("M{ax} {ay}L{} {}L{bx} {by}L{cx} {cy}Z", bulge[0], bulge[1])
                }),
            ),
            (
                "a tile grown by 0.06 mm on one side",
                on_tile(|d| {
                    let [[ax, ay], [bx, by], [cx, cy]] = vertices(d);
                    let (start, end) = (0.1 * (bx - ax), 0.9 * (bx - ax));
                    format!(
                        "M{ax} {ay}L{} {ay}L{} {}L{} {}L{} {by}L{bx} {by}L{cx} {cy}Z",
                        ax + start,
                        ax + start,
                        ay + 0.06,
                        ax + end,
                        ay + 0.06,
                        ax + end
                    )
                }),
            ),
            (
                "a missing tile",
                text(|text| {
                    let tile = text.lines().find(|line| line.contains("tile-0-r1-c1\"")).unwrap();
                    text.replacen(tile, "", 1)
                }),
            ),
            ("a different page size", {
                text(|text| text.replacen("297mm", "298mm", 1).replacen("0 0 297", "0 0 298", 1))
            }),
            ("a drawing with different proportions", swap("297mm", "298mm")),
            ("a page size in another unit", swap("297mm", "29.7cm")),
            ("a unit in upper case", swap("297mm", "297MM")),
            ("no width", swap(" width=\"297mm\"", "")),
            ("no viewBox", swap(" viewBox=\"0 0 297 210\"", "")),
            ("a byte order mark", before("<?xml", "\u{feff}")),
            ("a different version of XML", swap("1.0", "1.1")),
            ("no declaration", swap("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n", "")),
            ("a different character encoding", {
                Box::new(|bytes| bytes.iter().flat_map(|&byte| [byte, 0]).collect())
            }),
            ("a comment", over("<!-- desk -->")),
            ("a CDATA section", swap("<title>b<", "<title><![CDATA[b]]><")),
            ("a different title", swap("<title>b<", "<title>c<")),
            ("no title", swap("<title>b</title>", "")),
            ("two titles", before("<title>", "<title>b</title>")),
            ("a different description", swap("20 corners", "21 corners")),
            ("a value with character references", swap("\"#000\"", "\"&#35;000\"")),
            ("preserved white space", on("svg", "xml:space=\"preserve\"")),
            ("marks without a fill rule", swap(" fill-rule=\"evenodd\"", "")),
            ("marks without a colour", swap("<g fill=\"#000\"", "<g")),
            ("a mark without paint", swap("<path ", "<path fill=\"none\" ")),
            ("marks off the page", before("</g>", "<path d=\"M300 9L310 9L310 19Z\" id=\"a\"/>")),
            ("numbers without blanks", line("<path", |line| line.replacen("L", " L", 1))),
            ("a different scale", swap("viewBox=\"0 0 297 210\"", "viewBox=\"0 0 300 212.1212\"")),
            ("a second document", append("<svg/>")),
        ],
    )
}

/// Replaces the path of a plain tile.
fn on_tile(edit: impl Fn(&str) -> String + 'static) -> Damage {
    text(move |text| {
        let tiles = text.lines().filter(|line| line.contains("id=\"tile-"));
        let mut paths = tiles.map(|tile| tile.split('"').nth(1).unwrap());
        let path = paths.find(|path| path.matches('M').count() == 1).unwrap();
        text.replacen(path, &edit(path), 1)
    })
}

/// Returns the vertices of a triangle's path.
fn vertices(path: &str) -> [[f64; 2]; 3] {
    let numbers = path.split(['M', 'L', 'Z', ' ']).filter(|part| !part.is_empty());
    let numbers: Vec<f64> = numbers.map(|number| number.parse().unwrap()).collect();
    let [ax, ay, bx, by, cx, cy] = numbers[..] else { panic!("{path} is not a triangle") };
    [[ax, ay], [bx, by], [cx, cy]]
}

/// Moves the ends of a path by 0.2 mm to the right and down.
fn beside(path: &str) -> String {
    let (before, rest) = path.split_once("d=\"").unwrap();
    let (ends, after) = rest.split_once('"').unwrap();
    let numbers = ends.split(['M', 'L', ' ']).filter(|part| !part.is_empty());
    let moved: Vec<f64> = numbers.map(|number| number.parse::<f64>().unwrap() + 0.2).collect();
    let [x0, y0, x1, y1] = moved[..] else { panic!("{ends} is not a line") };
    format!("{before}d=\"M{x0:.4} {y0:.4}L{x1:.4} {y1:.4}\"{after}")
}

/// Returns the cases for a net, which has lines.
pub fn net() -> Vec<Case> {
    cases(
        "t.svg",
        vec![
            ("lines of zero width", swap("stroke-width=\"0.15\"", "stroke-width=\"0\"")),
            ("white lines", swap("stroke=\"#000\"", "stroke=\"#fff\"")),
            (
                "lines with a screen-dependent width",
                swap("stroke=\"#000\"", "vector-effect=\"non-scaling-stroke\" stroke=\"#000\""),
            ),
            ("wide lines", swap("stroke-width=\"0.15\"", "stroke-width=\"1\"")),
            ("narrow lines", swap("stroke-width=\"0.15\"", "stroke-width=\"0.04\"")),
            ("a displaced line", {
                text(|text| {
                    let cut = text.lines().find(|line| line.contains("id=\"cut-")).unwrap();
                    text.replacen(cut, &beside(cut), 1)
                })
            }),
            (
                "a missing line",
                text(|text| {
                    let cut = text.lines().find(|line| line.contains("id=\"cut-")).unwrap();
                    text.replacen(cut, "", 1)
                }),
            ),
        ],
    )
}
