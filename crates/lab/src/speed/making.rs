//! Run time of making files and verifying them.

use super::{RUNS, Row, SpeedError, fastest};
use deltille::export::artifacts::{Files, Making, What, make};
use deltille::layout::Printing;
use deltille::targets::{BoardSpec, SolidShape, SolidSpec};
use deltille::verify::{Artifact, Verifier};

/// A board, and the net and mesh of an icosahedron.
pub(super) fn files(_seed: u64) -> Result<Vec<Row>, SpeedError> {
    let board = Printing::new("desk", BoardSpec::deltille(10, 11, 20.0))?;
    let solid = Printing::new("icosahedron", SolidSpec::new(SolidShape::Icosahedron))?;
    let mut rows = made(&board, "board as PDF", What::Pdf)?;
    rows.extend(made(&solid, "net of an icosahedron as PDF", What::Pdf)?);
    rows.extend(made(&solid, "icosahedron as GLB", What::Gltf)?);
    Ok(rows)
}

/// Makes and verifies the files of one kind.
fn made(printing: &Printing, what: &str, kind: What) -> Result<Vec<Row>, SpeedError> {
    let (ms, files) = fastest(RUNS, || make(printing, kind, Making::default()));
    let files: Files = files?;
    let bytes: usize = files.iter().map(|(_, bytes)| bytes.len()).sum();
    let made = Row::new(format!("make {what}"), &[ms], format!("{} KB", bytes / 1000));
    let name = files.first().map_or("", |(name, _)| name).to_owned();
    let files: Vec<Artifact> =
        files.into_iter().map(|(name, bytes)| Artifact::new(name, bytes)).collect();
    let (ms, verdict) = fastest(RUNS, || {
        Verifier::new(printing).and_then(|verifier| verifier.verify(&name, &files))
    });
    let verdict = verdict?;
    if !verdict.passed {
        return Err(SpeedError::Wrong(verdict.to_string()));
    }
    Ok(vec![made, Row::new(format!("verify {what}"), &[ms], "passed")])
}
