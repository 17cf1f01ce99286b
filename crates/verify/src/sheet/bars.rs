//! Measurement of check bars in an image, independent of how they were drawn.

use glam::DVec2;

use crate::document::page::Page;

/// Distances from the line at which the end strokes are sampled, mm: beyond the line's own thickness and within
/// strokes that extend 1 mm to either side.
const OFFSETS_MM: std::ops::RangeInclusive<f64> = 0.4..=0.8;

/// Minimum distance beyond the expected end at which a stroke is searched for, mm.
const REACH_MM: f64 = 3.0;
/// The same as a fraction of the bar's length; the larger one counts. Inwards the search extends to the middle, so
/// that a bar much shorter than stated is measured, too.
const REACH: f64 = 0.05;

/// Minimum ink of a stroke at its darkest point, 0 to 1; less is dirt.
const MIN_INK: f64 = 0.2;

/// Ink below which a sample is paper: half a grey level. Interpolation between white pixels leaves a trace of
/// rounding, which must not extend a stroke.
const PAPER_INK: f64 = 0.5 / 255.0;

/// Distances from the middle of a stroke at which the bar's line is present inwards and absent outwards, mm.
const LINE_MM: f64 = 0.6;
/// Largest offset of the line from its expected position, mm.
const LINE_BESIDE_MM: f64 = 0.25;

/// Returns the distance between the outer edges of the end strokes of a bar near `ends_mm` on the page, mm; `None` if
/// a stroke is missing.
pub(super) fn measure(page: &Page, ends_mm: [DVec2; 2]) -> Option<f64> {
    let [from, to] = ends_mm.map(|end| page.px_from_page(end));
    let way = to - from;
    let length = way.x.hypot(way.y);
    if length < 1.0 {
        return None;
    }
    let along = way / length;
    let reach = [length / 2.0, (REACH_MM * page.px_per_mm).max(REACH * length)];
    let start = outer_edge(page, from, -along, reach)?;
    let end = outer_edge(page, to, along, reach)?;
    Some((length + start + end) / page.px_per_mm)
}

/// Returns the distance of the outer edge of the stroke beyond `end` in direction `outwards`, px; negative inwards.
///
/// Ink is sampled at whole pixels along lines parallel to the bar. A stroke is dark on all of these lines and has the
/// bar's line on its inner side only; the stroke nearest to the expected end counts. From a pixel
/// that the stroke fills completely, the ink of the pixels beyond gives the position of its edge,
/// independent of resolution and pixel positions: edge = position + ½ + Σ ink. (The centre of
/// gravity would be biased: it places the ink of a partly covered pixel at the middle of the pixel,
/// so the moment is up to ⅛ px² too large.)
fn outer_edge(
    page: &Page,
    end: DVec2,
    outwards: DVec2,
    [inner_reach, outer_reach]: [f64; 2],
) -> Option<f64> {
    let across = outwards.perp();
    let ink = |t: f64, offset: f64| page.ink(end + outwards * t + across * offset);
    let (near, far) = (OFFSETS_MM.start() * page.px_per_mm, OFFSETS_MM.end() * page.px_per_mm);
    let lines = ((far - near).floor() as usize + 1).max(2);
    let offsets: Vec<f64> = (0..lines)
        .map(|i| near + (far - near) * i as f64 / (lines - 1) as f64)
        .flat_map(|offset| [offset, -offset])
        .collect();
    let first = -inner_reach.ceil();
    let count = (inner_reach.ceil() + outer_reach.ceil()) as usize + 1;
    // The middles of the pixels along a bar that is aligned with them.
    let axis = usize::from(outwards.y.abs() > outwards.x.abs());
    let to_middle = (end[axis].round() - end[axis]) / outwards[axis];
    let position = |i: usize| first + to_middle + i as f64;
    let least: Vec<f64> = (0..count)
        .map(|i| offsets.iter().map(|&offset| ink(position(i), offset)).fold(1.0, f64::min))
        .collect();
    let mean =
        |t: f64| offsets.iter().map(|&offset| ink(t, offset)).sum::<f64>() / offsets.len() as f64;
    let line = |t: f64| {
        let beside = LINE_BESIDE_MM * page.px_per_mm;
        [-beside, 0.0, beside].into_iter().map(|offset| ink(t, offset)).fold(0.0, f64::max)
    };

    let runs = least.chunk_by(|a, b| (*a > PAPER_INK) == (*b > PAPER_INK)).scan(0, |start, run| {
        let from = *start;
        *start += run.len();
        Some((from, run))
    });
    let strokes = runs.filter(|(_, run)| run.iter().any(|&ink| ink >= MIN_INK));
    let edges = strokes.filter_map(|(from, run)| {
        let inks: Vec<(f64, f64)> =
            (from..from + run.len()).map(position).map(|t| (t, mean(t))).collect();
        let &(filled, full) = inks.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let beyond = inks.iter().filter(|(t, _)| *t > filled).map(|(_, ink)| ink / full);
        let edge = filled + 0.5 + beyond.sum::<f64>();
        let (middle, step) = ((position(from) + edge) / 2.0, LINE_MM * page.px_per_mm);
        let ends_line = line(middle - step) >= MIN_INK && line(middle + step) < MIN_INK;
        ends_line.then_some(edge)
    });
    edges.min_by(|a, b| a.abs().total_cmp(&b.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::raster::{Coverage, Gray};

    /// A bar of 60 mm from (`x`, 10) on a page of 80 × 20 mm, drawn by exact coverage, or the same bar upright; white
    /// is as bright as on a rendered page.
    fn page(px_per_mm: f64, x: f64, upright: bool) -> Page {
        let rectangles = [
            [0.0, -1.0, 0.3, 1.0],
            [0.3, -0.1, 59.7, 0.1],
            [59.7, -1.0, 60.0, 1.0],
            [5.0, -3.0, 55.0, -0.8],
        ];
        let (width_mm, height_mm) = if upright { (20.0, 80.0) } else { (80.0, 20.0) };
        let size = [width_mm, height_mm].map(|mm: f64| (mm * px_per_mm).round() as usize);
        let mut page = Page {
            width_mm,
            height_mm,
            px_per_mm,
            image: Gray::new(size[0], size[1]),
            smear_px: 0.0,
            texel_px: 0.0,
            left_px: 0.0,
        };
        let mut coverage = Coverage::new(size[0], size[1]);
        for [x0, y0, x1, y1] in rectangles {
            let corners = [(x0, y0), (x0, y1), (x1, y1), (x1, y0)].map(|(u, v)| {
                let (u, v) = (u + x, v + 10.0);
                let (x, y) = if upright { (20.0 - v, u) } else { (u, v) };
                page.px_from_page(DVec2::new(x, y))
            });
            coverage.add(&corners, 1.0);
        }
        page.image = coverage.finish().map(|ink| (255.0 * (1.0 - ink)).round() as u8);
        page
    }

    #[test]
    fn a_bar_is_measured_at_every_phase_and_resolution() {
        for dpi in [200.0, 240.0, 299.0, 300.0, 301.0, 400.0, 600.0] {
            for phase in 0..10 {
                let px_per_mm = dpi / 25.4;
                let x = 9.0 + f64::from(phase) / 10.0 / px_per_mm;
                for upright in [false, true] {
                    let page = page(px_per_mm, x, upright);
                    // The expected ends lie between pixels as well.
                    for (length, shift) in [(60.0, 0.0), (60.0, 0.013), (50.0, 0.0), (66.0, 0.0)] {
                        let ends = [x + shift, x + shift + length].map(|along| {
                            DVec2::from(if upright { (10.0, along) } else { (along, 10.0) })
                        });
                        let found = measure(&page, ends);
                        let off = found.map(|mm| (mm - 60.0).abs());
                        // Ends far beyond the stated ones are out of the search range.
                        if length == 50.0 {
                            assert_eq!(found, None);
                        } else {
                            assert!(
                                off.is_some_and(|mm| mm < 0.001),
                                "{dpi} dpi, phase {phase}, upright {upright}, {length} mm: {found:?}"
                            );
                        }
                    }
                }
            }
        }
    }
}
