//! The edges of the folded solid: their two sides must meet, and cut sides must carry the same number.

use std::collections::BTreeMap;

use crate::finding::fold::FoldFinding;
use crate::net::motion::{FOLD_TOLERANCE_MM, SpaceFromPage};
use crate::net::printed_net::{Net, Side};

/// An edge of the solid with the two sides that run along it.
pub(super) struct Edge {
    pub sides: [Side; 2],
}

impl Net {
    /// Returns all edges of the solid, each once.
    pub(super) fn edges(&self) -> Vec<Edge> {
        let forward = self.along.iter().filter(|([a, b], _)| a < b);
        let both = forward.filter_map(|([a, b], &one)| Some([one, *self.along.get(&[*b, *a])?]));
        both.map(|sides| Edge { sides }).collect()
    }

    /// Returns the distance between the two sides of an edge after folding, mm, if they belong together: either
    /// folded against each other on the page, or cut, with the same single number and one tab.
    ///
    /// # Errors
    ///
    /// Returns the finding if they do not belong together or are apart.
    pub(super) fn check_edge(
        &self,
        edge: &Edge,
        carried: &[Option<SpaceFromPage>],
    ) -> Result<f64, FoldFinding> {
        let [one, other] = edge.sides;
        let panels = [self.faces[one.face].panel, self.faces[other.face].panel];
        let ends = |side: Side| {
            let place = carried[side.face]?;
            Some(self.ends(side).map(|end| place.apply(end)))
        };
        let (Some([a, b]), Some([d, c])) = (ends(one), ends(other)) else {
            return Err(FoldFinding::EdgeOpen { panels, gap_mm: f64::INFINITY });
        };
        let gap_mm = a.distance(c).max(b.distance(d));
        if gap_mm > FOLD_TOLERANCE_MM {
            return Err(FoldFinding::EdgeOpen { panels, gap_mm });
        }
        let numbers = edge.sides.map(|at| self.faces[at.face].numbers[at.side].as_slice());
        let folded = self.folds.get(&one) == Some(&other);
        let tabs = edge.sides.iter().filter(|side| self.tabs.contains(side)).count();
        match numbers {
            [[], []] if folded => Ok(gap_mm),
            [[a], [b]] if !folded && a == b && tabs == 1 => Ok(gap_mm),
            [[a], [b]] if !folded && a == b => Err(FoldFinding::EdgeTabs { panels, tabs }),
            _ => Err(FoldFinding::EdgeNumbers { panels, numbers: numbers.map(<[usize]>::to_vec) }),
        }
    }

    /// Returns findings about the number printed on a face and the faces that its tabs name.
    pub(super) fn check_words(&self, index: usize) -> Vec<FoldFinding> {
        let face = &self.faces[index];
        let mut findings = Vec::new();
        if face.names != [index] {
            let names = face.names.clone();
            findings.push(FoldFinding::FaceNumber { panel: face.panel, names, stated: index });
        }
        for &(side, named) in &face.under {
            let [a, b] = [0, 1].map(|end| face.vertices[(side + end) % face.vertices.len()]);
            let beyond = self.along.get(&[b, a]).map(|other| other.face);
            if let Some(stated) = beyond.filter(|&other| other != named) {
                findings.push(FoldFinding::TabNames { panel: face.panel, named, stated });
            }
        }
        findings
    }

    /// Returns findings about edge numbers on more than two sides.
    pub(super) fn numbers_used_twice(&self) -> Vec<FoldFinding> {
        let mut count = BTreeMap::<usize, usize>::new();
        let numbers = self.faces.iter().flat_map(|face| face.numbers.iter().flatten());
        numbers.for_each(|&number| *count.entry(number).or_default() += 1);
        let twice = count.into_iter().filter(|&(_, count)| count > 2);
        twice.map(|(number, sides)| FoldFinding::EdgeNumberAgain { number, sides }).collect()
    }
}
