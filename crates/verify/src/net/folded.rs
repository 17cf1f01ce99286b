//! Folds a net, and adds the deviations to the verdicts of its sheets.

use crate::finding::any::Finding;
use crate::finding::fold::FoldFinding;
use crate::net::printed_net::Net;
use crate::sheet::boards::Seen;
use crate::verdict::{FoldVerdict, SheetVerdict};
use deltille_layout::Printing;

/// Folds the detected net, and adds the deviations to the verdicts of the sheets, which are in the order of `seen`.
/// If a face was not detected, checks nothing: the sheet has a finding about that face anyway.
pub(crate) fn check(printing: &Printing, seen: &[Seen], verdicts: &mut [SheetVerdict]) {
    let Some(net) = Net::new(printing, seen) else { return };
    let mut carried = vec![None; net.faces.len()];
    let mut misplaced = false;
    let mut deviations = vec![0.0f64; verdicts.len()];
    for sheet in 0..seen.len() {
        for (index, members) in net.pieces(sheet).into_iter().enumerate() {
            if index > 0 && net.is_broken_off(&members) {
                misplaced = true;
                let loose = |face: usize| FoldFinding::FaceLoose { panel: net.faces[face].panel };
                verdicts[sheet].findings.extend(members.into_iter().map(loose).map(Finding::from));
                continue;
            }
            let folded = net.best_fold(&members);
            misplaced |= folded.misplaced;
            deviations[sheet] = deviations[sheet].max(folded.deviation_mm);
            verdicts[sheet].findings.extend(folded.findings.into_iter().map(Finding::from));
            for (face, at) in folded.places {
                carried[face] = Some(at.space_from_page);
            }
        }
    }
    // Edges of swapped faces would only repeat that finding.
    let mut edges = vec![0; verdicts.len()];
    if !misplaced {
        for edge in net.edges() {
            let sheet = net.faces[edge.sides[1].face].sheet;
            match net.check_edge(&edge, &carried) {
                Ok(gap_mm) => {
                    edges[sheet] += 1;
                    deviations[sheet] = deviations[sheet].max(gap_mm);
                }
                Err(finding) => verdicts[sheet].findings.push(finding.into()),
            }
        }
        let last = verdicts.len() - 1;
        verdicts[last].findings.extend(net.numbers_used_twice().into_iter().map(Finding::from));
        for (index, face) in net.faces.iter().enumerate() {
            let wrong = net.check_words(index).into_iter().map(Finding::from);
            verdicts[face.sheet].findings.extend(wrong);
        }
    }
    for (sheet, verdict) in verdicts.iter_mut().enumerate() {
        let (max_deviation_mm, edges) = (deviations[sheet], edges[sheet]);
        verdict.fold = Some(FoldVerdict { max_deviation_mm, edges });
    }
}
