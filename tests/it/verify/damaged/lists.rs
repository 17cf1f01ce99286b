//! Damaged lists for other detectors and drawings for a cutter.

use super::edit::{append, before, line, swap, text};
use super::{Case, Damage, cases};

/// Edits the fields of all lines of a corner list that describe a corner.
fn corners(edit: impl Fn(&mut [f64]) + 'static) -> Damage {
    text(move |text| {
        let mut damaged = String::new();
        for line in text.lines() {
            let mut words: Vec<f64> =
                line.split(',').filter_map(|word| word.parse().ok()).collect();
            if words.len() == 6 {
                edit(&mut words);
                let words: Vec<String> = words.iter().map(f64::to_string).collect();
                damaged += &format!("{}\n", words.join(","));
            } else {
                damaged += &format!("{line}\n");
            }
        }
        damaged
    })
}

/// Returns the cases for a corner list of a board of 4 × 5 corners.
pub fn dsc() -> Vec<Case> {
    cases(
        "b.dsc",
        vec![
            ("a displaced corner", swap("-1,1,0,20,", "-1,1,0,20.01,")),
            ("a missing corner", swap("-1,1,3,50,51.96152422706632,0\n", "")),
            (
                "the last corner missing",
                text(|text| text.lines().take(21).map(|line| format!("{line}\n")).collect()),
            ),
            ("a corner listed twice", append("-1,1,0,20,0,0\n")),
            ("a tag with a wrong id", line("1,", |line| line.replacen('1', "2", 1))),
            ("a missing tag", line("1,", |line| line.replacen('1', "-1", 1))),
            ("an additional tag", swap("\n-1,", "\n7,")),
            ("an id outside the family", line("1,", |line| line.replacen('1', "999999", 1))),
            ("centimetres", corners(|words| words[3..].iter_mut().for_each(|v| *v /= 10.0))),
            ("metres", corners(|words| words[3..].iter_mut().for_each(|v| *v /= 1e3))),
            ("a wrong edge length", swap(",20\n", ",25\n")),
            ("a slightly larger edge length", swap(",20\n", ",20.01\n")),
            ("a larger board", {
                let larger = corners(|words| words[3..].iter_mut().for_each(|v| *v *= 2.0));
                Box::new(move |bytes| swap(",20\n", ",40\n")(&larger(bytes)))
            }),
            ("a mirrored shape", corners(|words| words[4] = -words[4])),
            ("a bent board", corners(|words| words[5] = words[3] * 0.001)),
            ("a wrong family", swap("delTag25h7", "delTag36h9")),
            ("a family of squares", swap("delTag25h7", "aprilTag25h9")),
            ("an unknown family", swap("delTag25h7", "delTag99")),
            ("a wrong border", swap(",1.5\n", ",2\n")),
            ("a wrong board id", swap("0,6,4,20\n", "1,6,4,20\n")),
            (
                "an additional board",
                append(
                    "9,2,2,20\ndelTag25h7,1.5\n-1,0,0,0,0,0\n-1,1,0,20,0,0\n-1,0,1,10,17.320508,0\n",
                ),
            ),
            ("more columns", swap("0,6,4,", "0,7,4,")),
            ("fewer columns", swap("0,6,4,", "0,5,4,")),
            ("a number in a different notation", swap("-1,1,0,20,", "-1,1,0,20.0,")),
            ("an exponent", swap("-1,1,0,20,", "-1,1,0,2e1,")),
            ("lines in a different order", {
                text(|text| {
                    let mut lines: Vec<&str> = text.lines().collect();
                    lines.swap(4, 5);
                    lines.iter().map(|line| format!("{line}\n")).collect()
                })
            }),
            ("no newline at the end", text(|text| text.trim_end().to_owned())),
            ("a blank line", before("-1,1,0,", "\n")),
            ("spaces", swap("\n0,1,1,", "\n0, 1,1,")),
            ("CRLF line ends", swap("\n", "\r\n")),
            ("a comment", append("# words\n")),
            ("a NaN coordinate", swap("-1,1,0,20,", "-1,1,0,nan,")),
            ("not a list at all", text(|_| "hello\n".to_owned())),
        ],
    )
}

/// Returns the range of one entity, from `start` to the beginning of the next.
fn entity(text: &str, start: &str, next: &str) -> (usize, usize) {
    let at = text.find(start).unwrap();
    let end = at + start.len() + text[at + start.len()..].find(next).unwrap();
    (at, end)
}

/// Removes an entity.
fn without(start: &'static str, next: &'static str) -> Damage {
    text(move |text| {
        let (at, end) = entity(text, start, next);
        [&text[..at], &text[end..]].concat()
    })
}

/// Moves a point by 0.01 mm: edits the number on the line after `start`.
fn moved(start: &'static str) -> Damage {
    text(move |text| {
        let (at, end) = entity(text, start, "\n");
        let number = at + start.len();
        let x: f64 = text[number..end].parse().unwrap();
        format!("{}{:.6}{}", &text[..number], x + 0.01, &text[end..])
    })
}

/// Returns the cases for the net of a solid, to cut, fold and engrave.
pub fn net() -> Vec<Case> {
    let add = |entity: &str| before("  0\nENDSEC\n  0\nEOF", entity);
    cases(
        "t-net.dxf",
        vec![
            ("a missing outline", without("  0\nPOLYLINE\n  8\nCUT", "  0\nLINE")),
            ("a missing fold", without("  0\nLINE\n  8\nFOLD", "  0\n")),
            ("a missing letter", without("  0\nPOLYLINE\n  8\nENGRAVE", "  0\nPOLYLINE")),
            ("a displaced fold", moved("LINE\n  8\nFOLD\n 10\n")),
            ("a fold on the cut layer", swap("LINE\n  8\nFOLD", "LINE\n  8\nCUT")),
            (
                "a valley fold instead of a mountain fold",
                swap("LINE\n  8\nFOLD", "LINE\n  8\nVALLEY"),
            ),
            (
                "an additional line",
                add(
                    "  0\nLINE\n  8\nCUT\n 10\n0.000000\n 20\n0.000000\n 30\n0.000000\n 11\n9.000000\n 21\n\
                     9.000000\n 31\n0.000000\n",
                ),
            ),
            (
                "a line of zero length",
                add(
                    "  0\nLINE\n  8\nCUT\n 10\n1.000000\n 20\n1.000000\n 30\n0.000000\n 11\n1.000000\n 21\n\
                     1.000000\n 31\n0.000000\n",
                ),
            ),
            (
                "a duplicate outline",
                text(|text| {
                    let (at, end) =
                        entity(text, "  0\nPOLYLINE\n  8\nCUT", "  0\nSEQEND\n  8\nCUT\n");
                    let end = end + "  0\nSEQEND\n  8\nCUT\n".len();
                    [&text[..end], &text[at..end], &text[end..]].concat()
                }),
            ),
            ("a number in a different notation", swap(" 30\n0.000000", " 30\n0.0")),
            ("a different comment", swap("deltille 0", "desk 0")),
            ("an additional comment", before("  0\nEOF", "999\ndesk\n")),
            ("a code without blanks", swap("  0\nSECTION", "0\nSECTION")),
            ("CRLF line ends", swap("SECTION\n", "SECTION\r\n")),
            ("a layer name in lower case", swap("POLYLINE\n  8\nCUT", "POLYLINE\n  8\ncut")),
            (
                "a duplicate line",
                text(|text| {
                    let (at, end) = entity(text, "  0\nLINE\n  8\nFOLD", "  0\n");
                    [&text[..end], &text[at..end], &text[end..]].concat()
                }),
            ),
            ("a circle", add("  0\nCIRCLE\n  8\nCUT\n 10\n0\n 20\n0\n 40\n9\n")),
            ("a block", add("  0\nINSERT\n  2\nA\n")),
            ("text", add("  0\nTEXT\n  1\nA\n")),
            (
                "another section",
                before("  0\nSECTION\n  2\nENTITIES", "  0\nSECTION\n  2\nBLOCKS\n  0\nENDSEC\n"),
            ),
            ("an open outline", swap(" 70\n1\n  0\nVERTEX", " 70\n0\n  0\nVERTEX")),
            ("an arc in an outline", swap("  0\nSEQEND", " 42\n1\n  0\nSEQEND")),
            ("an extrusion", swap("  0\nLINE\n  8\nFOLD\n", "  0\nLINE\n  8\nFOLD\n210\n-1\n")),
            (
                "a different line style",
                swap("  0\nLINE\n  8\nFOLD\n", "  0\nLINE\n  8\nFOLD\n  6\nHIDDEN\n"),
            ),
        ],
    )
}

/// Returns the cases for the panels of a solid, to cut and engrave.
pub fn panels() -> Vec<Case> {
    cases(
        "t-panels.dxf",
        vec![
            ("inches", swap("$INSUNITS\n 70\n4", "$INSUNITS\n 70\n1")),
            ("no units", swap("  9\n$INSUNITS\n 70\n4\n", "")),
            ("a different release", swap("AC1009", "AC1027")),
            ("a variable", before("  0\nENDSEC", "  9\n$MEASUREMENT\n 70\n0\n")),
            ("a wrong extent", swap("$EXTMIN\n 10\n4.000000", "$EXTMIN\n 10\n5.000000")),
            ("a frozen layer", swap("CUT\n 70\n0", "CUT\n 70\n1")),
            ("a hidden layer", swap(" 62\n1\n", " 62\n-1\n")),
            ("a layer with a different colour", swap(" 62\n1\n", " 62\n3\n")),
            ("a dashed line style", swap("Solid line", "Dashed")),
            ("an outline to engrave", swap("POLYLINE\n  8\nCUT", "POLYLINE\n  8\nENGRAVE")),
            (
                "a raised point",
                swap(
                    " 30\n0.000000\n  0\nVERTEX\n  8\nCUT\n 10",
                    " 30\n1.000000\n  0\nVERTEX\n  8\nCUT\n 10",
                ),
            ),
            ("a missing letter", without("  0\nPOLYLINE\n  8\nENGRAVE", "  0\nPOLYLINE")),
            ("a displaced point", moved("VERTEX\n  8\nENGRAVE\n 10\n")),
            ("a missing point", without("  0\nVERTEX\n  8\nENGRAVE", "  0\nVERTEX")),
            ("a truncated file", swap("  0\nENDSEC\n  0\nEOF\n", "")),
            ("data after the end", append("  0\nEOF\n")),
            ("not a drawing at all", text(|_| "hello\n".to_owned())),
        ],
    )
}
