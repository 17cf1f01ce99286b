//! Dash patterns of cutting and folding lines.

use glam::DVec2;

use crate::{LineKind, SheetLine};

/// Dash and gap of a mountain fold, mm. Both ends of the line are dashes, so that a ruler can be aligned with them.
const DASH_MM: [f64; 2] = [3.0, 2.0];

/// Dash, gap, dot and gap of a valley fold, mm.
const DASH_DOT_MM: [f64; 4] = [3.0, 1.2, 0.6, 1.2];

/// Dot and gap of a line between coplanar faces, mm.
const DOT_MM: [f64; 2] = [0.6, 3.0];

/// Returns the strokes of a line: start and end of each, in the frame of its page, mm.
///
/// ```text
///   cut, align  ────────────────    fold  ──── ──── ────    valley  ──── · ──── · ────
///   flat  ·   ·   ·   ·
/// ```
///
/// The pattern is stretched so that a whole number of periods and a final dash fill the line.
pub fn strokes_mm(line: &SheetLine) -> Vec<[DVec2; 2]> {
    let pattern = match line.kind {
        LineKind::Cut | LineKind::Align => return vec![[line.from_mm, line.to_mm]],
        LineKind::Fold => &DASH_MM[..],
        LineKind::Valley => &DASH_DOT_MM[..],
        LineKind::Flat => &DOT_MM[..],
    };
    let way = line.to_mm - line.from_mm;
    let length = way.x.hypot(way.y);
    let period: f64 = pattern.iter().sum();
    let count = ((length - pattern[0]) / period).round().max(0.0);
    let stretch = length / (count * period + pattern[0]);
    let at = |mm: f64| line.from_mm + way * (mm * stretch / length).min(1.0);
    let mut strokes = Vec::new();
    for n in 0..=count as usize {
        let mut start = n as f64 * period;
        for pair in pattern.chunks_exact(2) {
            strokes.push([at(start), at(start + pair[0])]);
            start += pair[0] + pair[1];
            if n == count as usize {
                break;
            }
        }
    }
    strokes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_begin_and_end_with_the_line() {
        for kind in [LineKind::Fold, LineKind::Valley, LineKind::Flat] {
            for length in [1.0, 3.0, 7.9, 150.0] {
                let from_mm = DVec2::new(2.0, 1.0);
                let to_mm = from_mm + DVec2::Y * length;
                let strokes = strokes_mm(&SheetLine { kind, from_mm, to_mm, width_mm: 0.1 });
                assert_eq!(strokes[0][0], from_mm);
                let end = strokes[strokes.len() - 1][1];
                assert!((end.y - to_mm.y).abs() < 1e-9, "{kind:?} {length}: {strokes:?}");
                assert!(strokes.windows(2).all(|pair| pair[0][1].y < pair[1][0].y));
            }
        }
    }
}
