//! Damaged lists for other detectors and drawings for a cutter.

use super::edit::{append, before, line, swap, text};
use super::{Case, Damage, cases};

/// Changes the words of all lines of a corner list that describe a corner.
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

/// A corner list of a board of 4 × 5 corners.
pub fn dsc() -> Vec<Case> {
    cases(
        "b.dsc",
        vec![
            ("a corner that is moved", swap("-1,1,0,20,", "-1,1,0,20.01,")),
            ("a corner that is missing", swap("-1,1,3,50,51.96152422706632,0\n", "")),
            (
                "the last corner cut off",
                text(|text| text.lines().take(21).map(|line| format!("{line}\n")).collect()),
            ),
            ("a corner that is listed twice", append("-1,1,0,20,0,0\n")),
            ("a tag of another id", line("1,", |line| line.replacen('1', "2", 1))),
            ("a tag that is missing", line("1,", |line| line.replacen('1', "-1", 1))),
            ("a tag too many", swap("\n-1,", "\n7,")),
            (
                "an id that the family does not have",
                line("1,", |line| line.replacen('1', "999999", 1)),
            ),
            ("centimetres", corners(|words| words[3..].iter_mut().for_each(|v| *v /= 10.0))),
            ("metres", corners(|words| words[3..].iter_mut().for_each(|v| *v /= 1e3))),
            ("another edge", swap(",20\n", ",25\n")),
            ("an edge that is a bit larger", swap(",20\n", ",20.01\n")),
            ("all larger", {
                let larger = corners(|words| words[3..].iter_mut().for_each(|v| *v *= 2.0));
                Box::new(move |bytes| swap(",20\n", ",40\n")(&larger(bytes)))
            }),
            ("a mirror", corners(|words| words[4] = -words[4])),
            ("a bent board", corners(|words| words[5] = words[3] * 0.001)),
            ("another family", swap("delTag25h7", "delTag36h9")),
            ("a family of squares", swap("delTag25h7", "aprilTag25h9")),
            ("a family that nobody knows", swap("delTag25h7", "delTag99")),
            ("another border", swap(",1.5\n", ",2\n")),
            ("another board", swap("0,6,4,20\n", "1,6,4,20\n")),
            (
                "a board too many",
                append(
                    "9,2,2,20\ndelTag25h7,1.5\n-1,0,0,0,0,0\n-1,1,0,20,0,0\n-1,0,1,10,17.320508,0\n",
                ),
            ),
            ("more columns", swap("0,6,4,", "0,7,4,")),
            ("fewer columns", swap("0,6,4,", "0,5,4,")),
            ("a number that is spelled otherwise", swap("-1,1,0,20,", "-1,1,0,20.0,")),
            ("an exponent", swap("-1,1,0,20,", "-1,1,0,2e1,")),
            ("lines in another order", {
                text(|text| {
                    let mut lines: Vec<&str> = text.lines().collect();
                    lines.swap(4, 5);
                    lines.iter().map(|line| format!("{line}\n")).collect()
                })
            }),
            ("no end of the last line", text(|text| text.trim_end().to_owned())),
            ("a blank line", before("-1,1,0,", "\n")),
            ("spaces", swap("\n0,1,1,", "\n0, 1,1,")),
            ("ends of lines of another system", swap("\n", "\r\n")),
            ("a comment", append("# words\n")),
            ("a coordinate that is none", swap("-1,1,0,20,", "-1,1,0,nan,")),
            ("nothing of a list", text(|_| "hello\n".to_owned())),
        ],
    )
}

/// The lines of one entity, from where `start` stands to the next.
fn entity(text: &str, start: &str, next: &str) -> (usize, usize) {
    let at = text.find(start).unwrap();
    let end = at + start.len() + text[at + start.len()..].find(next).unwrap();
    (at, end)
}

/// Takes an entity out.
fn without(start: &'static str, next: &'static str) -> Damage {
    text(move |text| {
        let (at, end) = entity(text, start, next);
        [&text[..at], &text[end..]].concat()
    })
}

/// Moves a point by 0.01 mm: the number on the line after `start`.
fn moved(start: &'static str) -> Damage {
    text(move |text| {
        let (at, end) = entity(text, start, "\n");
        let number = at + start.len();
        let x: f64 = text[number..end].parse().unwrap();
        format!("{}{:.6}{}", &text[..number], x + 0.01, &text[end..])
    })
}

/// The net of a solid, to cut, fold and engrave.
pub fn net() -> Vec<Case> {
    let add = |entity: &str| before("  0\nENDSEC\n  0\nEOF", entity);
    cases(
        "t-net.dxf",
        vec![
            ("an outline that is missing", without("  0\nPOLYLINE\n  8\nCUT", "  0\nLINE")),
            ("a fold that is missing", without("  0\nLINE\n  8\nFOLD", "  0\n")),
            ("a letter that is missing", without("  0\nPOLYLINE\n  8\nENGRAVE", "  0\nPOLYLINE")),
            ("a fold that is moved", moved("LINE\n  8\nFOLD\n 10\n")),
            ("a fold to be cut", swap("LINE\n  8\nFOLD", "LINE\n  8\nCUT")),
            ("a fold the other way", swap("LINE\n  8\nFOLD", "LINE\n  8\nVALLEY")),
            (
                "a line too many",
                add(
                    "  0\nLINE\n  8\nCUT\n 10\n0.000000\n 20\n0.000000\n 30\n0.000000\n 11\n9.000000\n 21\n\
                     9.000000\n 31\n0.000000\n",
                ),
            ),
            (
                "a line of no length",
                add(
                    "  0\nLINE\n  8\nCUT\n 10\n1.000000\n 20\n1.000000\n 30\n0.000000\n 11\n1.000000\n 21\n\
                     1.000000\n 31\n0.000000\n",
                ),
            ),
            (
                "an outline twice",
                text(|text| {
                    let (at, end) =
                        entity(text, "  0\nPOLYLINE\n  8\nCUT", "  0\nSEQEND\n  8\nCUT\n");
                    let end = end + "  0\nSEQEND\n  8\nCUT\n".len();
                    [&text[..end], &text[at..end], &text[end..]].concat()
                }),
            ),
            ("a number that is spelled otherwise", swap(" 30\n0.000000", " 30\n0.0")),
            ("another comment", swap("deltille 0", "desk 0")),
            ("a comment too many", before("  0\nEOF", "999\ndesk\n")),
            ("a code without blanks", swap("  0\nSECTION", "0\nSECTION")),
            ("ends of lines of another system", swap("SECTION\n", "SECTION\r\n")),
            (
                "a name of a layer in small letters",
                swap("POLYLINE\n  8\nCUT", "POLYLINE\n  8\ncut"),
            ),
            (
                "a line twice",
                text(|text| {
                    let (at, end) = entity(text, "  0\nLINE\n  8\nFOLD", "  0\n");
                    [&text[..end], &text[at..end], &text[end..]].concat()
                }),
            ),
            ("a circle", add("  0\nCIRCLE\n  8\nCUT\n 10\n0\n 20\n0\n 40\n9\n")),
            ("a block", add("  0\nINSERT\n  2\nA\n")),
            ("words", add("  0\nTEXT\n  1\nA\n")),
            (
                "a point of view",
                before("  0\nSECTION\n  2\nENTITIES", "  0\nSECTION\n  2\nBLOCKS\n  0\nENDSEC\n"),
            ),
            ("an outline that is open", swap(" 70\n1\n  0\nVERTEX", " 70\n0\n  0\nVERTEX")),
            ("an arc in an outline", swap("  0\nSEQEND", " 42\n1\n  0\nSEQEND")),
            ("an extrusion", swap("  0\nLINE\n  8\nFOLD\n", "  0\nLINE\n  8\nFOLD\n210\n-1\n")),
            (
                "another style of line",
                swap("  0\nLINE\n  8\nFOLD\n", "  0\nLINE\n  8\nFOLD\n  6\nHIDDEN\n"),
            ),
        ],
    )
}

/// The panels of a solid, to cut and engrave.
pub fn panels() -> Vec<Case> {
    cases(
        "t-panels.dxf",
        vec![
            ("inches", swap("$INSUNITS\n 70\n4", "$INSUNITS\n 70\n1")),
            ("no units", swap("  9\n$INSUNITS\n 70\n4\n", "")),
            ("another release", swap("AC1009", "AC1027")),
            ("a variable", before("  0\nENDSEC", "  9\n$MEASUREMENT\n 70\n0\n")),
            ("another extent", swap("$EXTMIN\n 10\n4.000000", "$EXTMIN\n 10\n5.000000")),
            ("a layer that is frozen", swap("CUT\n 70\n0", "CUT\n 70\n1")),
            ("a layer that is off", swap(" 62\n1\n", " 62\n-1\n")),
            ("a layer of another colour", swap(" 62\n1\n", " 62\n3\n")),
            ("a dashed style", swap("Solid line", "Dashed")),
            ("an outline to engrave", swap("POLYLINE\n  8\nCUT", "POLYLINE\n  8\nENGRAVE")),
            (
                "a raised point",
                swap(
                    " 30\n0.000000\n  0\nVERTEX\n  8\nCUT\n 10",
                    " 30\n1.000000\n  0\nVERTEX\n  8\nCUT\n 10",
                ),
            ),
            ("a letter that is missing", without("  0\nPOLYLINE\n  8\nENGRAVE", "  0\nPOLYLINE")),
            ("a point that is moved", moved("VERTEX\n  8\nENGRAVE\n 10\n")),
            ("a point that is missing", without("  0\nVERTEX\n  8\nENGRAVE", "  0\nVERTEX")),
            ("a file that is cut off", swap("  0\nENDSEC\n  0\nEOF\n", "")),
            ("data after the end", append("  0\nEOF\n")),
            ("nothing of a drawing", text(|_| "hello\n".to_owned())),
        ],
    )
}
