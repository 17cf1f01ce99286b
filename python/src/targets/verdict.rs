//! The result of comparing a file with its target.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use deltille::export::artifacts::Files;
use deltille::layout::Printing;
use deltille::verify::{self, Artifact, Verifier};
use pyo3::prelude::*;
use serde_json::Value;

use crate::boundary::errors::{self, Raise, RaiseFile};

/// The content or path of a file.
#[derive(FromPyObject)]
pub enum Proof {
    Bytes(Vec<u8>),
    Path(PathBuf),
}

/// Whether a file shows its target, and how it differs.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct Verdict {
    verdict: verify::Verdict,
    record: Value,
}

impl Verdict {
    /// Compares a file with its target, on disk or, if `files` is given, in memory.
    pub fn of(
        printing: &Printing,
        (name, files): (String, Option<Files>),
        stop: &AtomicBool,
    ) -> PyResult<Self> {
        let verifier = Verifier::new(printing);
        let verifier = verifier.raise(errors::verify)?.cancelled_by(stop);
        let path = Path::new(&name);
        let verdict = match files {
            None => verifier.verify_path(path),
            Some(files) => {
                let artifact = |(name, bytes): (String, Vec<u8>)| Artifact::new(name, bytes);
                verifier.verify(&name, &files.into_iter().map(artifact).collect::<Vec<_>>())
            }
        };
        let verdict = verdict.raise_of_file(path, errors::verify)?;
        let record = serde_json::to_value(&verdict).unwrap_or_default();
        Ok(Self { verdict, record })
    }
}

#[pymethods]
impl Verdict {
    /// Whether the file shows exactly the target.
    #[getter]
    fn passed(&self) -> bool {
        self.verdict.passed
    }

    /// Name of the file.
    #[getter]
    fn artifact(&self) -> &str {
        &self.verdict.artifact
    }

    /// Differences from the target, in sentences.
    #[getter]
    fn findings(&self) -> Vec<String> {
        let of_sheets = self.verdict.sheets.iter().flat_map(|sheet| &sheet.findings);
        let of_faces = self.verdict.faces.iter().flat_map(|face| &face.findings);
        let all = self.verdict.findings.iter().chain(of_sheets).chain(of_faces);
        all.map(|finding| errors::one_line(&finding)).collect()
    }

    /// Returns all measurements and findings as JSON.
    fn to_json(&self) -> String {
        self.record.to_string()
    }

    fn __bool__(&self) -> bool {
        self.verdict.passed
    }

    fn __str__(&self) -> String {
        self.verdict.to_string()
    }

    fn __repr__(&self) -> String {
        format!("<Verdict {}>", self.verdict)
    }
}
