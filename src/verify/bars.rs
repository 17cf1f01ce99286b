//! Check bars measured in a picture, without knowledge of how they were drawn.

use super::document::Page;

/// Distances from the line at which the end strokes are met, mm: beyond the line's own thickness
/// and within strokes that reach 1 mm to either side.
const OFFSETS_MM: std::ops::RangeInclusive<f64> = 0.4..=0.8;

/// How far from its expected end a stroke is looked for: at least so far, mm,
const REACH_MM: f64 = 3.0;
/// or so far in lengths of the bar.
const REACH: f64 = 0.05;

/// Ink that a stroke has at least at its darkest, 0 to 1; below it is dirt.
const MIN_INK: f64 = 0.2;

/// The distance between the outer edges of the end strokes of a bar near `ends_mm` on the page, mm;
/// `None` where one is missing.
pub(super) fn measure(page: &Page, ends_mm: [[f64; 2]; 2]) -> Option<f64> {
    let [from, to] = ends_mm.map(|end| page.px_from_page(end));
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    if length < 1.0 {
        return None;
    }
    let along = [dx / length, dy / length];
    let reach = (REACH_MM * page.px_per_mm).max(REACH * length);
    let start = outer_edge(page, from, [-along[0], -along[1]], reach)?;
    let end = outer_edge(page, to, along, reach)?;
    Some((length + start + end) / page.px_per_mm)
}

/// How far beyond `end`, in direction `outwards`, the outer edge of the stroke lies, px.
///
/// Ink is sampled at whole pixels along lines parallel to the bar. A stroke is what is dark on all
/// of them; the one nearest to the expected end counts. Its ink adds up to its width, and its centre
/// of gravity is its middle, whatever the resolution: edge = middle + width / 2.
fn outer_edge(page: &Page, end: [f64; 2], outwards: [f64; 2], reach: f64) -> Option<f64> {
    let across = [-outwards[1], outwards[0]];
    let (near, far) = (OFFSETS_MM.start() * page.px_per_mm, OFFSETS_MM.end() * page.px_per_mm);
    let lines = ((far - near).floor() as usize + 1).max(2);
    let offsets: Vec<f64> = (0..lines)
        .map(|i| near + (far - near) * i as f64 / (lines - 1) as f64)
        .flat_map(|offset| [offset, -offset])
        .collect();
    let ink = |t: f64| {
        offsets.iter().map(move |offset| {
            let at = |i: usize| end[i] + outwards[i] * t + across[i] * offset;
            page.ink([at(0), at(1)])
        })
    };
    let steps = reach.ceil() as i32;
    let position = |step: i32| f64::from(step);
    let least: Vec<f64> =
        (-steps..=steps).map(|step| ink(position(step)).fold(1.0, f64::min)).collect();

    // The darkest sample of each run above the threshold; of those the nearest to the end.
    let is_dark = |i: usize| least[i] >= MIN_INK;
    let centre = steps as usize;
    let nearest = (0..least.len()).filter(|&i| is_dark(i)).min_by_key(|&i| i.abs_diff(centre))?;
    let mut first = nearest;
    while first > 0 && least[first - 1] > 0.0 {
        first -= 1;
    }
    let mut last = nearest;
    while last + 1 < least.len() && least[last + 1] > 0.0 {
        last += 1;
    }
    let mean = |t: f64| ink(t).sum::<f64>() / offsets.len() as f64;
    let (mut width, mut moment) = (0.0, 0.0);
    for i in first..=last {
        let t = position(i as i32 - steps);
        let m = mean(t);
        width += m;
        moment += m * t;
    }
    Some(moment / width + width / 2.0)
}
