//! Assembly of the pages of a sheet that is larger than the paper into one image.
//!
//! Every pixel of the sheet comes from the page in whose window it lies deepest; the other pages that show it must
//! agree.

use glam::DVec2;
use rayon::prelude::*;

use crate::document::page::Page;
use crate::finding::any::{Finding, PageFinding};
use deltille_core::raster::Gray;
use deltille_layout::{SheetLayout, SheetPage};

/// Largest accepted difference of ink between pages at a pixel: an edge displaced by 0.05 mm at 300 dpi changes a
/// pixel by 0.6, and interpolation between the pixels of two pages by up to 0.5.
const MAX_DIFFERENCE: f64 = 0.7;

/// Width of the rim of a window where nothing is compared, mm: it cuts through pixels.
const RIM_MM: f64 = 0.3;

/// The first location, from the top, where two pages of a sheet differ.
struct Difference {
    pages: [usize; 2],
    at_px: [usize; 2],
}

/// Assembles pages, one for each page of the layout, at a resolution.
pub(crate) fn assemble(
    pages: &[Page],
    layout: &SheetLayout,
    px_per_mm: f64,
) -> (Page, Vec<Finding>) {
    let size_px =
        [layout.width_mm, layout.height_mm].map(|mm| ((mm * px_per_mm).round() as usize).max(1));
    // Number of sheet pixels between two pixels of a page; each is the mean over the area of one pixel.
    let coarsest = pages.iter().map(|page| page.px_per_mm).fold(f64::INFINITY, f64::min);
    let mut sheet = Page {
        width_mm: layout.width_mm,
        height_mm: layout.height_mm,
        px_per_mm,
        image: Gray::from_fn(0, 0, |_, _| 255),
        smear_px: 1.0 + px_per_mm / coarsest,
        texel_px: 0.0,
        left_px: 0.0,
    };
    let at_mm = |x: usize, y: usize| sheet.page_from_px(DVec2::new(x as f64, y as f64));
    let mut pixels = vec![255u8; size_px[0] * size_px[1]];
    let rows = pixels.par_chunks_mut(size_px[0]).enumerate();
    let differences: Vec<Difference> = rows
        .filter_map(|(y, row)| {
            let mut difference = None;
            for (x, pixel) in row.iter_mut().enumerate() {
                let at = at_mm(x, y);
                let mut shown: Option<(usize, f64, f64)> = None;
                for (index, window) in layout.pages.iter().enumerate() {
                    let depth = depth_mm(window, at);
                    if depth < 0.0 {
                        continue;
                    }
                    let ink = ink(&pages[index], window, at, px_per_mm);
                    if let Some((other, other_depth, other_ink)) = shown {
                        let apart = (ink - other_ink).abs() > MAX_DIFFERENCE;
                        if apart && depth.min(other_depth) > RIM_MM {
                            let pages = [other, index];
                            difference.get_or_insert(Difference { pages, at_px: [x, y] });
                        }
                        if other_depth >= depth {
                            continue;
                        }
                    }
                    shown = Some((index, depth, ink));
                }
                if let Some((.., ink)) = shown {
                    *pixel = (255.0 * (1.0 - ink)).round() as u8;
                }
            }
            difference
        })
        .collect();
    sheet.image = Gray::from_vec(size_px[0], size_px[1], pixels).expect("rows fill the sheet");
    let mut findings = Vec::new();
    let mut named = Vec::new();
    for Difference { pages, at_px: [x, y] } in differences {
        if !named.contains(&pages) {
            named.push(pages);
            let labels = pages.map(|index| layout.pages[index].label.clone());
            let at_mm = sheet.page_from_px(DVec2::new(x as f64, y as f64));
            findings.push(PageFinding::PagesDiffer { pages: labels, at_mm }.into());
        }
    }
    (sheet, findings)
}

/// Returns how deep a position of the sheet lies within the window of a page, mm; negative outside.
fn depth_mm(page: &SheetPage, place: DVec2) -> f64 {
    let [left, lower, right, upper] = page.window_mm;
    let DVec2 { x, y } = place + page.sheet_at_mm;
    (x - left).min(right - x).min(y - lower).min(upper - y)
}

/// Returns the ink of a page at a position of the sheet, averaged over one pixel of the sheet, with
/// one sample for each pixel of the page in it.
fn ink(page: &Page, window: &SheetPage, place: DVec2, px_per_mm: f64) -> f64 {
    let middle = page.px_from_page(place + window.sheet_at_mm);
    let ratio = page.px_per_mm / px_per_mm;
    let samples = (ratio - 0.2).ceil().max(1.0) as usize;
    if samples == 1 {
        return page.ink(middle);
    }
    let step = ratio / samples as f64;
    let offset = |i: usize| (i as f64 - (samples - 1) as f64 / 2.0) * step;
    let offsets =
        (0..samples).flat_map(|i| (0..samples).map(move |j| DVec2::new(offset(i), offset(j))));
    offsets.map(|off| page.ink(middle + off)).sum::<f64>() / (samples * samples) as f64
}
