//! Collects the constructs that are not allowed while a file is inspected.

use crate::finding::any::{Finding, PageFinding};
use crate::finding::construct::ConstructFinding;

/// Maximum number of findings listed for a file.
const MAX_LISTED: usize = 64;

/// Constructs that are not allowed, collected while a file is inspected.
#[derive(Default)]
pub(super) struct Findings(pub(super) Vec<Finding>);

impl Findings {
    /// Adds a construct, such as "element <image>", with its location, such as "line 12".
    pub(super) fn add(&mut self, place: impl Into<String>, construct: impl Into<String>) {
        if !self.is_full() {
            let (place, construct) = (place.into(), construct.into());
            self.0.push(ConstructFinding::Construct { place, construct }.into());
        }
    }

    /// Adds a line that differs from the one that the program writes.
    pub(super) fn add_other_line(&mut self, place: String, found: String) {
        if !self.is_full() {
            self.0.push(ConstructFinding::OtherLine { place, found }.into());
        }
    }

    /// Adds a construct unless `holds`.
    pub(super) fn unless(
        &mut self,
        holds: bool,
        place: impl Into<String>,
        construct: impl Into<String>,
    ) {
        if !holds {
            self.add(place, construct);
        }
    }

    /// Adds hidden content unless `holds`; the file is still rendered and compared.
    pub(super) fn unseen_unless(
        &mut self,
        holds: bool,
        place: impl Into<String>,
        problem: impl Into<String>,
    ) {
        if !holds && !self.is_full() {
            let (place, problem) = (place.into(), problem.into());
            self.0.push(ConstructFinding::Unseen { place, problem }.into());
        }
    }

    /// Whether the file has a construct that is not allowed, and is therefore not rendered.
    pub(super) fn refuse(&self) -> bool {
        refuse(&self.0)
    }

    /// Whether the list of findings is full; further findings are dropped.
    pub(super) fn is_full(&self) -> bool {
        self.0.len() >= MAX_LISTED
    }

    /// Adds the findings of a file that belongs to this one, such as a texture, with its name before the locations.
    pub(super) fn add_of(&mut self, file: &str, other: Findings) {
        for finding in other.0 {
            match finding {
                Finding::Construct(ConstructFinding::Construct { place, construct }) => {
                    self.add(format!("{file}, {place}"), construct);
                }
                Finding::Construct(ConstructFinding::Unseen { place, problem }) => {
                    self.unseen_unless(false, format!("{file}, {place}"), problem);
                }
                Finding::Construct(ConstructFinding::OtherLine { place, found }) => {
                    self.add_other_line(format!("{file}, {place}"), found);
                }
                other => self.0.push(other),
            }
        }
    }
}

/// Whether a file has a construct that viewers may render differently, or a line that the program
/// would not write. The file is then not rendered. Hidden content alone does not prevent rendering.
pub(crate) fn refuse(findings: &[Finding]) -> bool {
    let refuses = |finding: &Finding| {
        use ConstructFinding::{Construct, OtherLine};
        matches!(finding, Finding::Construct(Construct { .. } | OtherLine { .. }))
    };
    findings.iter().any(|finding| match finding {
        Finding::Page(PageFinding::OnPage { finding, .. }) => refuses(finding),
        finding => refuses(finding),
    })
}
