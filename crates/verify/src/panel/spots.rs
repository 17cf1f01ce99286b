//! Connected wrong pixels, each group reported as one spot.

use glam::DVec2;

use crate::document::page::Page;
use crate::finding::mark::MarkFinding;

/// Maximum number of spots listed for a page; a page with more is dirty all over.
const MAX_SPOTS: usize = 200;

/// Returns a finding for each connected spot of wrong pixels on a page.
pub(crate) fn named(page: &Page, mut wrong: Vec<bool>) -> Vec<MarkFinding> {
    let (width, height) = (page.image.width(), page.image.height());
    let mut spots = Vec::new();
    for start in 0..wrong.len() {
        if spots.len() == MAX_SPOTS {
            break;
        }
        if !std::mem::take(&mut wrong[start]) {
            continue;
        }
        let (mut stack, mut count, mut moment) = (vec![start], 0.0, DVec2::ZERO);
        while let Some(at) = stack.pop() {
            let (x, y) = (at % width, at / width);
            count += 1.0;
            moment += DVec2::new(x as f64, y as f64);
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                for x in x.saturating_sub(1)..(x + 2).min(width) {
                    if std::mem::take(&mut wrong[y * width + x]) {
                        stack.push(y * width + x);
                    }
                }
            }
        }
        let at_mm = page.page_from_px(moment / count);
        spots.push(MarkFinding::Spot { at_mm, area_mm2: count / page.px_per_mm.powi(2) });
    }
    spots
}
