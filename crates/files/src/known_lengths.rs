//! Lengths on a target that were measured by other means, from CSV.
//!
//! The columns are `row_a`, `col_a`, `row_b`, `col_b`, `length_mm`, `sd_mm`, and `panel_a`, `panel_b` for targets with several
//! panels.
//!
//! ```
//! let text = "row_a,col_a,row_b,col_b,length_mm,sd_mm\n0,0,7,9,228.013,0.002\n";
//! let lengths = deltille_files::known_lengths::parse(text)?;
//! assert_eq!(lengths[0].ends[1], (None, 7, 9));
//! let error = deltille_files::known_lengths::parse("row_a,col_a\n0,0\n").unwrap_err();
//! assert_eq!(error.to_string(), "line 1: column row_b is missing");
//! # Ok::<(), deltille_files::known_lengths::Problem>(())
//! ```

/// What is wrong with a table of lengths.
#[derive(Debug, PartialEq, thiserror::Error)]
#[error("line {line}: {text}")]
pub struct Problem {
    /// Number of the line, from 1.
    pub line: usize,
    /// The problem, with the name of the column.
    pub text: String,
}

/// A length between two corners.
#[derive(Clone, Debug, PartialEq)]
pub struct Length {
    /// Line in the file, from 1.
    pub line: usize,
    /// Panel id, row and column of both ends; the panel is `None` if the table has no such column.
    pub ends: [(Option<u32>, i32, i32); 2],
    /// The length, mm; positive.
    pub length_mm: f64,
    /// Its standard uncertainty, mm.
    pub sd_mm: f64,
}

/// Reads lengths from the text of a table. Columns are separated by commas, semicolons or tabs; lines that start with `#` are
/// comments.
///
/// # Errors
/// Returns an error if a column is missing or appears twice, or if a value is not a number in its range.
pub fn parse(text: &str) -> Result<Vec<Length>, Problem> {
    let lines = (1..).zip(text.trim_start_matches('\u{feff}').lines());
    let mut lines = lines.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let (line, header) = lines.next().unwrap_or((1, ""));
    let separator = [',', ';', '\t'].into_iter().find(|&of| header.contains(of)).unwrap_or(',');
    let names: Vec<&str> = header.split(separator).map(cell).collect();
    let at = |name: &str| names.iter().position(|of| *of == name);
    let needed = |name: &str| {
        at(name).ok_or_else(|| Problem { line, text: format!("column {name} is missing") })
    };
    let corner = |end: &str| {
        let [row, col] = ["row", "col"].map(|of| needed(&format!("{of}_{end}")));
        Ok((at(&format!("panel_{end}")), row?, col?))
    };
    if let Some(twice) = (1..names.len()).find(|&i| names[..i].contains(&names[i])) {
        return Err(Problem { line, text: format!("column {} appears twice", names[twice]) });
    }
    let ends = [corner("a")?, corner("b")?];
    if ends[0].0.is_some() != ends[1].0.is_some() {
        return Err(Problem { line, text: "panel_a and panel_b are needed together".to_owned() });
    }
    let (length, sd) = (needed("length_mm")?, needed("sd_mm")?);
    let read = |(line, text): (usize, &str)| {
        let values: Vec<&str> = text.split(separator).map(cell).collect();
        let wrong = |text: String| Problem { line, text };
        if values.len() != names.len() {
            let (found, needed) = (values.len(), names.len());
            return Err(wrong(format!("{found} values, but the header has {needed} columns")));
        }
        fn parsed<T: std::str::FromStr>(name: &str, value: &str, what: &str) -> Result<T, String> {
            value.parse().map_err(|_| format!("{name}: {value:?} is not {what}"))
        }
        let whole = |at: usize| parsed(names[at], values[at], "a whole number").map_err(wrong);
        let id = |at: usize| parsed(names[at], values[at], "the number of a panel").map_err(wrong);
        let mm = |at: usize, least: f64| {
            let mm: f64 =
                parsed(names[at], values[at], "a number with a decimal point").map_err(wrong)?;
            match mm.is_finite() && mm >= least {
                true => Ok(mm),
                false => {
                    let (name, value) = (names[at], values[at]);
                    Err(wrong(format!("{name}: {value} is not a length of at least {least} mm")))
                }
            }
        };
        let end = |(panel, row, col): (Option<usize>, usize, usize)| {
            Ok((panel.map(id).transpose()?, whole(row)?, whole(col)?))
        };
        let ends = [end(ends[0])?, end(ends[1])?];
        if ends[0] == ends[1] {
            return Err(wrong("both ends are the same corner".to_owned()));
        }
        Ok(Length { line, ends, length_mm: mm(length, SHORTEST_MM)?, sd_mm: mm(sd, 0.0)? })
    };
    let found = lines.map(read).collect::<Result<Vec<Length>, Problem>>()?;
    match found.is_empty() {
        true => Err(Problem { line, text: "the table contains no lengths".to_owned() }),
        false => Ok(found),
    }
}

/// Shorter lengths are not between different corners.
const SHORTEST_MM: f64 = 0.001;

fn cell(text: &str) -> &str {
    text.trim().trim_matches('"')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_with_panels_and_other_separators_are_read() {
        let text = "# from a CMM\npanel_a;row_a;col_a;panel_b;row_b;col_b;length_mm;sd_mm\n3;0;-1;4;2;5;80.5;0.001\n";
        let found = parse(text).unwrap();
        assert_eq!(found[0].ends, [(Some(3), 0, -1), (Some(4), 2, 5)]);
        assert_eq!((found[0].line, found[0].length_mm, found[0].sd_mm), (3, 80.5, 0.001));
    }

    #[test]
    fn wrong_values_are_named() {
        let header = "row_a,col_a,row_b,col_b,length_mm,sd_mm";
        for (row, expected) in [
            ("0,0,1,x,10,0", "line 2: col_b: \"x\" is not a whole number"),
            ("0,0,1,1,-10,0", "line 2: length_mm: -10 is not a length of at least 0.001 mm"),
            ("0,0,1,1,10,NaN", "line 2: sd_mm: NaN is not a length of at least 0 mm"),
            ("0,0,0,0,10,0", "line 2: both ends are the same corner"),
            ("0,0,1,1,10", "line 2: 5 values, but the header has 6 columns"),
            ("", "line 1: the table contains no lengths"),
        ] {
            assert_eq!(parse(&format!("{header}\n{row}\n")).unwrap_err().to_string(), expected);
        }
    }
}
