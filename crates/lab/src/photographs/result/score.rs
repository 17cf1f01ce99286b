//! Detections of a photograph, compared with its ground truth.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;

use crate::photographs::photograph::{Photograph, Sight, TrueCorner};
use deltille::detect::Detection;

/// Maximum distance of a report from its true corner, px of the sensor.
const NEAR_PX: f64 = 4.0;

/// The same limit as a fraction of a tile edge.
const NEAR_EDGE: f64 = 0.25;

/// Counts and errors of one photograph.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Score {
    /// Number of visible corners.
    pub visible: usize,
    /// Number of visible corners reported at their position.
    pub found: usize,
    /// Number of visible corners also reported with the correct label.
    pub labelled: usize,
    /// Number of wrong labels.
    pub wrong: usize,
    /// Number of reports where there is no corner.
    pub nowhere: usize,
    /// Number of reports of corners hidden by a cover.
    pub hidden: usize,
    /// Number of repeated reports of a corner.
    pub doubled: usize,
    /// Errors of both coordinates of the reported visible corners, px.
    pub errors_px: Vec<DVec2>,
    /// Squared errors normalized by the reported covariances: eᵀC⁻¹e.
    pub normalised: Vec<f64>,
    /// Detection time, ms.
    pub time_ms: f64,
}

/// Compares a detection with the ground truth.
///
/// `scale` is the size of the sensor's pixels in the image. With `half_turn`, the labels may also be those of the board
/// rotated by 180°, because nothing on it shows which end is up.
pub fn score(found: &Detection, photograph: &Photograph, scale: f64, half_turn: bool) -> Score {
    let truth = &photograph.corners;
    let near_px = (NEAR_PX * scale).min(NEAR_EDGE * photograph.edge_px);
    let mut score = Score {
        visible: truth.iter().filter(|corner| corner.sight == Sight::Visible).count(),
        time_ms: found.timing_ms.values().sum(),
        ..Score::default()
    };
    // Each report with the true corner at its position.
    let mut reports: Vec<_> = found
        .grids
        .iter()
        .flat_map(|grid| &grid.corners)
        .map(|corner| {
            let distance = |t: &TrueCorner| (corner.x - t.x).hypot(corner.y - t.y);
            let nearest = truth.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let nearest = nearest.map(|t| (t, distance(t))).filter(|(_, d)| *d <= near_px);
            (corner, nearest)
        })
        .collect();
    reports.sort_by(|(_, a), (_, b)| {
        let distance = |n: &Option<(&TrueCorner, f64)>| n.map_or(f64::INFINITY, |(_, d)| d);
        distance(a).total_cmp(&distance(b))
    });

    let turned = half_turn.then(|| half_turned(truth));
    let mut taken = BTreeSet::new();
    // Number of correct and wrong labels, as printed and rotated.
    let mut labels = [[0usize; 2]; 2];
    for (corner, nearest) in reports {
        let first = nearest.is_some_and(|(t, _)| taken.insert(t.id));
        let seen = nearest.filter(|(t, _)| t.sight == Sight::Visible);
        if let Some(id) = corner.id {
            let truly = nearest.map(|(t, _)| t.id);
            let by_turn = [truly, truly.and_then(|t| turned.as_ref()?.get(&t).copied())];
            for (count, truly) in labels.iter_mut().zip(by_turn) {
                if truly != Some(id) {
                    count[1] += 1;
                } else if first && seen.is_some() {
                    count[0] += 1;
                }
            }
        }
        match nearest {
            None => score.nowhere += 1,
            Some((t, _)) if t.sight == Sight::Covered => score.hidden += 1,
            Some(_) if !first => score.doubled += 1,
            Some(_) => {}
        }
        let Some((t, _)) = seen.filter(|_| first) else { continue };
        score.found += 1;
        let error @ DVec2 { x: dx, y: dy } = corner.position() - DVec2::new(t.x, t.y);
        score.errors_px.push(error);
        if let Some([xx, xy, yy]) = corner.cov {
            let determinant = xx * yy - xy * xy;
            let square = yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy;
            score.normalised.push(square / determinant);
        }
    }
    let best = if half_turn { usize::from(labels[1][1] < labels[0][1]) } else { 0 };
    [score.labelled, score.wrong] = labels[best];
    score
}

/// Returns the id of each corner on the board rotated by 180°, by row and column.
fn half_turned(truth: &[TrueCorner]) -> BTreeMap<u32, u32> {
    let places: BTreeMap<(i32, i32), u32> = truth.iter().map(|t| ((t.row, t.col), t.id)).collect();
    let last = truth.iter().fold((0, 0), |(r, c), t| (r.max(t.row), c.max(t.col)));
    let turned = |t: &TrueCorner| places.get(&(last.0 - t.row, last.1 - t.col)).copied();
    truth.iter().filter_map(|t| Some((t.id, turned(t)?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille::detect::{Detector, DetectorConfig, Grid, GridCorner};
    use deltille::lattice::GridKind;
    use deltille::raster::Gray;

    fn truth() -> Photograph {
        let corner = |id: u32, sight| TrueCorner {
            id,
            panel: 0,
            row: 0,
            col: id as i32,
            x: 40.0 * f64::from(id),
            y: 10.0,
            sight,
        };
        let sights = [Sight::Visible, Sight::Visible, Sight::Covered, Sight::Visible];
        let corners = (0..4).map(|id| corner(id, sights[id as usize])).collect();
        Photograph { image: Gray::new(200, 20), corners, edge_px: 40.0 }
    }

    fn scored(reports: &[(f64, Option<u32>)], half_turn: bool) -> Score {
        let corner = |(col, &(x, id)): (usize, &(f64, Option<u32>))| GridCorner {
            row: 0,
            col: col as i32,
            id,
            x,
            y: 10.0,
            cov: Some([0.01, 0.0, 0.01]),
        };
        let plain = Detector::for_grid(GridKind::Checker, None, DetectorConfig::default());
        let mut detection = plain.detect(&truth().image, "");
        let head = r#"{"kind": "checker", "panel": 0, "corners": [], "tags": []}"#;
        let mut grid: Grid = serde_json::from_str(head).unwrap();
        grid.corners = reports.iter().enumerate().map(corner).collect();
        detection.grids = vec![grid];
        score(&detection, &truth(), 1.0, half_turn)
    }

    #[test]
    fn every_kind_of_error_is_counted_separately() {
        // A correct report, a wrong label, a corner under a cover, a report without a corner, and a repeated report.
        let score = scored(
            &[(0.1, Some(0)), (40.0, Some(3)), (80.0, Some(2)), (100.0, None), (1.0, Some(0))],
            false,
        );
        assert_eq!((score.visible, score.found, score.labelled, score.wrong), (3, 2, 1, 1));
        assert_eq!((score.hidden, score.nowhere, score.doubled), (1, 1, 1));
        assert!((score.errors_px[1].x - 0.1).abs() < 1e-9 || score.errors_px[0].x == 0.0);
        assert!(score.normalised.iter().any(|n| (n - 1.0).abs() < 1e-9));
    }

    #[test]
    fn rotation_by_180_degrees_is_accepted_for_symmetric_boards() {
        let turned = [(0.0, Some(3)), (40.0, Some(2)), (120.0, Some(0))];
        assert_eq!(scored(&turned, false).wrong, 3);
        let score = scored(&turned, true);
        assert_eq!((score.labelled, score.wrong), (3, 0));
    }
}
