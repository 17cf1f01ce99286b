//! Strict reader of DXF, for checking drawings before they are cut.

use glam::DVec2;

use super::LAYERS;
use deltille_layout::artwork::{CutDrawing, CutLayer, CutPath};

/// The only line style.
const CONTINUOUS: [(u32, &str); 6] =
    [(2, "CONTINUOUS"), (70, "0"), (3, "Solid line"), (72, "65"), (73, "0"), (40, "0.0")];

/// Header variables that state the release and the unit, millimetres.
const HEAD: [(u32, &str); 5] =
    [(2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (9, "$INSUNITS"), (70, "4")];

/// Maximum difference between the stated extent and that of the paths, mm, from the number of digits.
const EXTENT_SLACK_MM: f64 = 2e-6;

/// Error of reading a `.dxf` file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DxfError {
    /// The file is not a text DXF.
    #[error("not a text DXF of release 12")]
    NotDxf,
    /// The file has an element that the writer does not write.
    #[error("line {line}: {construct}")]
    Construct {
        /// Counted from 1.
        line: usize,
        /// The element, for example "entity CIRCLE".
        construct: String,
    },
}

/// Reads the text of a `.dxf` file, mm; each `LINE` becomes an open path of two points.
///
/// # Errors
/// Returns an error if the file is not a DXF, or not in the form of [`text`](super::text).
pub fn read(text: &str) -> Result<CutDrawing, DxfError> {
    let records = records(text)?;
    let mut reader = Reader { records: &records, at: 0 };
    let extent = reader.head()?;
    reader.tables()?;
    let drawing = reader.entities()?;
    reader.expect("EOF", &[])?;
    if let Some(after) = reader.records.get(reader.at) {
        return Err(after.fault("data after the end"));
    }
    let bounds = drawing.bounds_mm().unwrap_or_default();
    if extent.iter().zip(bounds).any(|(stated, found)| (stated - found).abs() > EXTENT_SLACK_MM) {
        return Err(records[0].fault("an extent that differs from the paths"));
    }
    written_otherwise(text, &drawing)?;
    Ok(drawing)
}

/// Returns an error if the writer would write the content differently; the version of the writer in the first comment may
/// differ.
fn written_otherwise(found: &str, drawing: &CutDrawing) -> Result<(), DxfError> {
    let rewritten = super::text(drawing);
    let of_writer = |line: &str| line.starts_with("deltille ") && line.ends_with(", millimetres");
    let mut pairs = found.split('\n').zip(rewritten.split('\n')).enumerate();
    let other = pairs.find(|(index, (a, b))| a != b && !(*index == 1 && of_writer(a)));
    let same_length = found.split('\n').count() == rewritten.split('\n').count();
    match other {
        None if same_length => Ok(()),
        other => Err(DxfError::Construct {
            line: other.map_or(1, |(index, _)| index + 1),
            construct: "a comment, whitespace or a number format that deltille does not write"
                .to_owned(),
        }),
    }
}

/// A record: a group of code 0 and the groups that follow it.
struct Record<'a> {
    line: usize,
    name: &'a str,
    fields: Vec<(u32, &'a str)>,
}

/// The groups of a file, two lines each: a code and a value.
fn records(text: &str) -> Result<Vec<Record<'_>>, DxfError> {
    let lines: Vec<&str> = text.lines().collect();
    let mut records: Vec<Record> = Vec::new();
    for (index, pair) in lines.chunks(2).enumerate() {
        let &[code, value] = pair else { return Err(DxfError::NotDxf) };
        let code: u32 = code.trim().parse().map_err(|_| DxfError::NotDxf)?;
        match (code, records.last_mut()) {
            (0, _) => records.push(Record { line: 2 * index + 1, name: value, fields: Vec::new() }),
            (999, _) => {}
            (_, Some(record)) => record.fields.push((code, value)),
            (_, None) => return Err(DxfError::NotDxf),
        }
    }
    if records.first().is_some_and(|record| record.name == "SECTION") {
        Ok(records)
    } else {
        Err(DxfError::NotDxf)
    }
}

impl Record<'_> {
    fn fault(&self, construct: impl Into<String>) -> DxfError {
        DxfError::Construct { line: self.line, construct: construct.into() }
    }

    /// Refuses groups other than the `stated` ones.
    fn check(&self, stated: &[(u32, &str)]) -> Result<(), DxfError> {
        let wrong = self.fields.iter().zip(stated).find(|(found, stated)| found != stated);
        if let Some(((code, value), _)) = wrong {
            return Err(self.fault(format!("group {code} of {} is `{value}`", self.name)));
        }
        self.count(stated.len())
    }

    fn count(&self, stated: usize) -> Result<(), DxfError> {
        let found = self.fields.len();
        if let Some((code, _)) = self.fields.get(stated) {
            return Err(self.fault(format!("group {code} of {}", self.name)));
        }
        match found < stated {
            true => Err(self.fault(format!("{} of {found} groups instead of {stated}", self.name))),
            false => Ok(()),
        }
    }

    /// The points at z = 0 whose x coordinates have the group codes given; the first `before`
    /// fields are skipped.
    fn points<const N: usize>(
        &self,
        before: usize,
        codes: [u32; N],
    ) -> Result<[DVec2; N], DxfError> {
        let mut points = [DVec2::ZERO; N];
        for (i, (point, code)) in points.iter_mut().zip(codes).enumerate() {
            let mut values = [0.0; 3];
            for (axis, value) in values.iter_mut().enumerate() {
                let stated = code + 10 * axis as u32;
                let Some(&(found, text)) = self.fields.get(before + 3 * i + axis) else {
                    return Err(self.fault(format!("{} without group {stated}", self.name)));
                };
                if found != stated {
                    return Err(self.fault(format!("group {found} of {}", self.name)));
                }
                let number: Option<f64> = text.parse().ok();
                let number = number.filter(|number| number.is_finite());
                *value = number.ok_or_else(|| {
                    self.fault(format!("`{text}` of {} is not a number", self.name))
                })?;
            }
            if values[2] != 0.0 {
                return Err(self.fault(format!("{} out of the plane", self.name)));
            }
            *point = DVec2::new(values[0], values[1]);
        }
        Ok(points)
    }

    /// The layer of an entity.
    fn layer(&self) -> Result<CutLayer, DxfError> {
        let (code, name) = self.fields.first().copied().unwrap_or_default();
        let layer = LAYERS.iter().find(|(_, listed, _)| code == 8 && *listed == name);
        let fault = || self.fault(format!("{} on layer `{name}`", self.name));
        Ok(layer.ok_or_else(fault)?.0)
    }
}

struct Reader<'a, 't> {
    records: &'a [Record<'t>],
    at: usize,
}

impl<'a, 't> Reader<'a, 't> {
    fn next(&mut self) -> Result<&'a Record<'t>, DxfError> {
        let Some(record) = self.records.get(self.at) else {
            let line = self.records.last().map_or(1, |record| record.line);
            return Err(DxfError::Construct { line, construct: "the end of the file".to_owned() });
        };
        self.at += 1;
        Ok(record)
    }

    /// The next record, which must have this name.
    fn named(&mut self, name: &str) -> Result<&'a Record<'t>, DxfError> {
        let record = self.next()?;
        match record.name == name {
            true => Ok(record),
            false => Err(record.fault(format!("{} instead of {name}", record.name))),
        }
    }

    /// The next record, which must have this name and exactly these fields.
    fn expect(&mut self, name: &str, fields: &[(u32, &str)]) -> Result<(), DxfError> {
        self.named(name)?.check(fields)
    }

    /// The stated extent: left, lower, right and upper end, mm.
    fn head(&mut self) -> Result<[f64; 4], DxfError> {
        let head = self.named("SECTION")?;
        let known = head.fields.len().min(HEAD.len());
        let begin =
            Record { line: head.line, name: "HEADER", fields: head.fields[..known].to_vec() };
        begin.check(&HEAD)?;
        let mut ends = [DVec2::ZERO; 2];
        for (i, (end, name)) in ends.iter_mut().zip(["$EXTMIN", "$EXTMAX"]).enumerate() {
            let at = HEAD.len() + 4 * i;
            if head.fields.get(at) != Some(&(9, name)) {
                return Err(head.fault(format!("HEADER without {name}")));
            }
            [*end] = head.points(at + 1, [10])?;
        }
        if let Some((_, name)) = head.fields.get(HEAD.len() + 8) {
            return Err(head.fault(format!("variable {name} of HEADER")));
        }
        self.expect("ENDSEC", &[])?;
        let [least, most] = ends;
        Ok([least.x, least.y, most.x, most.y])
    }

    fn tables(&mut self) -> Result<(), DxfError> {
        self.expect("SECTION", &[(2, "TABLES")])?;
        self.expect("TABLE", &[(2, "LTYPE"), (70, "1")])?;
        self.expect("LTYPE", &CONTINUOUS)?;
        self.expect("ENDTAB", &[])?;
        self.expect("TABLE", &[(2, "LAYER"), (70, &LAYERS.len().to_string())])?;
        for (_, name, colour) in LAYERS {
            let colour = colour.to_string();
            self.expect("LAYER", &[(2, name), (70, "0"), (62, &colour), (6, "CONTINUOUS")])?;
        }
        self.expect("ENDTAB", &[])?;
        self.expect("ENDSEC", &[])
    }

    fn entities(&mut self) -> Result<CutDrawing, DxfError> {
        self.expect("SECTION", &[(2, "ENTITIES")])?;
        let mut drawing = CutDrawing::default();
        loop {
            let record = self.next()?;
            match record.name {
                "LINE" => drawing.paths.push(line(record)?),
                "POLYLINE" => drawing.paths.push(self.polyline(record)?),
                "ENDSEC" => {
                    record.count(0)?;
                    return Ok(drawing);
                }
                name => return Err(record.fault(format!("entity {name}"))),
            }
        }
    }

    fn polyline(&mut self, head: &Record) -> Result<CutPath, DxfError> {
        let layer = head.layer()?;
        let flags = [head.fields.get(1), head.fields.get(5)].map(Option::<&_>::copied);
        if flags != [Some((66, "1")), Some((70, "1"))] {
            return Err(head.fault("POLYLINE that is not closed"));
        }
        if head.points(2, [10])? != [DVec2::ZERO] {
            return Err(head.fault("POLYLINE that is raised"));
        }
        head.count(6)?;
        let mut path = CutPath { layer, closed: true, points_mm: Vec::new() };
        loop {
            let record = self.next()?;
            match record.name {
                "VERTEX" if record.layer()? == layer => {
                    path.points_mm.extend(record.points(1, [10])?);
                    record.count(4)?;
                }
                "SEQEND" if record.layer()? == layer => {
                    record.count(1)?;
                    return Ok(path);
                }
                name => return Err(record.fault(format!("{name} in a POLYLINE"))),
            }
        }
    }
}

fn line(record: &Record) -> Result<CutPath, DxfError> {
    let layer = record.layer()?;
    let points_mm = record.points(1, [10, 11])?.to_vec();
    record.count(7)?;
    Ok(CutPath { layer, closed: false, points_mm })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::pages::dxf::text;

    fn drawing() -> CutDrawing {
        let path =
            |layer, closed, points: &[DVec2]| CutPath { layer, closed, points_mm: points.to_vec() };
        let triangle = [(0.0, 0.0), (10.5, 0.0), (5.0, 8.25)].map(DVec2::from);
        CutDrawing {
            paths: vec![
                path(CutLayer::Cut, true, &triangle),
                path(CutLayer::Fold, false, &triangle[..2]),
                path(CutLayer::Engrave, true, &triangle),
            ],
        }
    }

    #[test]
    fn written_drawings_are_read_back() {
        assert_eq!(read(&text(&drawing())), Ok(drawing()));
    }

    #[test]
    fn unknown_elements_are_named() {
        let good = text(&drawing());
        for (from, to, named) in [
            ("  0\nLINE", "  0\nARC", "entity ARC"),
            (" 70\n4\n", " 70\n1\n", "group 70 of HEADER is `1`"),
            ("  0\nENDSEC", "  9\n$LTSCALE\n 40\n1.0\n  0\nENDSEC", "variable $LTSCALE"),
            ("$EXTMAX\n 10\n10.5", "$EXTMAX\n 10\n11.5", "an extent"),
            ("CUT\n 70\n0\n", "CUT\n 70\n1\n", "group 70 of LAYER is `1`"),
            (" 30\n0.000000\n  0\nSEQEND", " 30\n1.0\n  0\nSEQEND", "out of the plane"),
            ("  0\nSEQEND", " 42\n1.0\n  0\nSEQEND", "group 42 of VERTEX"),
            ("LINE\n  8\nFOLD", "LINE\n  8\n0", "on layer `0`"),
        ] {
            let bad = good.replacen(from, to, 1);
            assert_ne!(bad, good, "{from}");
            let said = read(&bad).unwrap_err().to_string();
            assert!(said.contains(named), "{said}");
        }
        assert_eq!(read("hello\n"), Err(DxfError::NotDxf));
        assert_eq!(read(""), Err(DxfError::NotDxf));
    }
}
