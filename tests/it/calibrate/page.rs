//! The report page of a calibration shows the estimate, and files without residuals read like those with residuals.

use std::collections::BTreeMap;

use deltille::calibrate::{Comparison, Corner, Estimate, Model, Region, View};
use deltille::camera::Camera;
use deltille::export::calibration::{self, Print, Residuals};
use deltille::export::saved;
use deltille::raster::Gray;
use deltille::report::{Report, Sample, thumbnail};
use glam::{DVec2, DVec3};
use serde_json::Value;

use super::models::{camera, of, simulated};

const VIEWS: usize = 20;
const TILT_RAD: f64 = 0.7;

/// Row and column of a displaced corner of the board, and its displacement, mm.
const MOVED: (i32, i32) = (3, 4);
const MOVED_BY_MM: DVec2 = DVec2::new(0.2, -0.1);

fn views(truth: &Camera, seed: u64) -> Vec<View> {
    let mut views = simulated(truth, VIEWS, TILT_RAD, seed).0;
    let all = views.iter_mut().flat_map(|view| &mut view.sightings);
    for corner in all.flat_map(|sighting| &mut sighting.observations) {
        if (corner.row, corner.col) == MOVED {
            corner.panel_mm -= MOVED_BY_MM.extend(0.0);
        }
    }
    views
}

/// The page of an estimate with grey images and compared models.
fn page(model: Model) -> (Estimate, String) {
    let calibration = of(&views(&camera(model), 1), model);
    let estimate = calibration.solve().unwrap();
    let models = [calibration.compare_models(0).unwrap()];
    let found = &estimate.cameras[0];
    let grey = Gray::from_fn(found.camera.width as usize, found.camera.height as usize, |x, y| {
        ((x + y) % 200) as u8
    });
    let view = Sample::best(found, |_| true).unwrap();
    let mut report = Report::new("front", &estimate);
    report.models = &models;
    report.samples.extend(Sample::of(found, view, grey.clone()).map(|sample| (0, sample)));
    report.thumbnails.insert((0, view.name.clone()), thumbnail(&grey).unwrap());
    let html = report.html();
    (estimate, html)
}

/// All texts between two others.
fn between<'a>(text: &'a str, before: &str, after: &str) -> Vec<&'a str> {
    let parts = text.split(before).skip(1);
    parts.map(|part| part.split_once(after).map_or(part, |(inner, _)| inner)).collect()
}

/// The figure with this description.
fn picture<'a>(page: &'a str, shows: &str) -> &'a str {
    between(page, &format!("aria-label=\"{shows}\">"), "</figure>")[0]
}

/// The scale of a figure from the numbers at an axis.
fn axis(svg: &str, anchor: &str, place: &str) -> impl Fn(f64) -> f64 {
    let texts = between(svg, "<text x=\"", "</text>");
    let ticks: Vec<(f64, f64)> = texts
        .iter()
        .filter(|text| text.contains(&format!("text-anchor=\"{anchor}\"")))
        .filter_map(|text| {
            let at = if place == "x" { text } else { between(text, "y=\"", "\"")[0] };
            let at = at.split('"').next()?.parse().ok()?;
            let value = text.rsplit_once('>')?.1.replace('−', "-").parse().ok()?;
            Some((at, value))
        })
        .collect();
    let [(a, low), .., (b, high)] = ticks[..] else { panic!("{ticks:?}") };
    move |at| low + (at - a) / (b - a) * (high - low)
}

#[test]
fn the_page_is_self_contained_with_all_parts_in_order() {
    let (_, page) = page(Model::Radtan5);
    assert!(!page.contains("<script") && !page.contains("http"), "something from elsewhere");
    for place in between(&page, "href=\"", "\"").into_iter().chain(between(&page, "src=\"", "\"")) {
        let is_here = place.starts_with("data:image/png;base64,") || place.starts_with("#picture-");
        assert!(is_here, "{}", &place[..place.len().min(60)]);
    }
    let heads = between(&page, "<h2>", "</h2>");
    let expected = [
        "Summary",
        "Projection uncertainty",
        "Residuals and coverage",
        "3D view",
        "Distortion",
        "Undistorted image",
        "Models",
        "Parameters",
        "Views, worst first",
    ];
    assert_eq!(heads, expected);
    // The verdict comes first, and every figure has a caption.
    assert!(page.find("class=\"verdict").unwrap() < page.find("<h2>").unwrap());
    assert_eq!(page.matches("<figure").count(), page.matches("<figcaption>").count());
    for model in ["radtan", "radtan5", "kannala-brandt", "rational", "thin-prism"] {
        assert!(page.contains(&format!("<td>{model}</td>")), "{model}");
    }
}

#[test]
fn the_distortion_curve_matches_the_lens() {
    for (model, is_pinhole) in [(Model::Radtan, true), (Model::KannalaBrandt(4), false)] {
        let (estimate, page) = page(model);
        let lens = &estimate.cameras[0].camera;
        let svg = picture(&page, "Distortion curve");
        let (degrees, px) = (axis(svg, "middle", "x"), axis(svg, "end", "y"));
        let points = between(svg, "<polyline class=\"curve lens\" points=\"", "\"")[0];
        let points: Vec<[f64; 2]> = points
            .split(' ')
            .map(|point| {
                let (x, y) = point.split_once(',').unwrap();
                [degrees(x.parse().unwrap()), px(y.parse().unwrap())]
            })
            .collect();
        let high = points.iter().map(|[_, y]| *y).fold(f64::NEG_INFINITY, f64::max);
        let low = points.iter().map(|[_, y]| *y).fold(f64::INFINITY, f64::min);
        assert!(points.len() > 50 && points.last().unwrap()[0] > 30.0);
        for [angle, drawn] in points {
            let angle = angle.to_radians();
            let direction = DVec3::new(angle.sin(), 0.0, angle.cos());
            let radius = lens.project(1e9 * direction).unwrap().distance(lens.centre_px);
            let ideal = lens.focal_px.x * if is_pinhole { angle.tan() } else { angle };
            // Tangential terms and unequal focal lengths are in the band around the curve; the numbers of the drawing
            // are rounded to a tenth of a unit.
            let expected = radius - ideal;
            let most = 0.02 * (high - low).max(expected.abs()) + 1.0;
            assert!((drawn - expected).abs() < most, "{model} {angle}: {drawn} {expected}");
        }
    }
}

#[test]
fn residuals_over_the_target_are_means_over_all_views() {
    let (estimate, page) = page(Model::Radtan);
    let mut seen: BTreeMap<(i32, i32), Vec<&Corner>> = BTreeMap::new();
    for corner in estimate.corners() {
        seen.entry((corner.row, corner.col)).or_default().push(corner);
    }
    let svg = picture(&page, "Residuals of each corner of the target");
    let titles = between(svg, "<title>", "</title>");
    assert_eq!(titles.len(), seen.len());
    let mut moved = DVec2::ZERO;
    for title in titles {
        let numbers: Vec<f64> = title
            .split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'))
            .filter_map(|number| number.parse().ok())
            .collect();
        let [row, col, rms, x, y, views] = numbers[..] else { panic!("{title}") };
        let all = &seen[&(row as i32, col as i32)];
        // A corner that is an outlier in most views has a systematic error.
        let inliers = all.iter().filter(|corner| !corner.outlier).count();
        let counts = |corner: &&&Corner| 2 * inliers < all.len() || !corner.outlier;
        let corners: Vec<&&Corner> = all.iter().filter(counts).collect();
        let squares: f64 = corners.iter().map(|corner| corner.residual.length_squared()).sum();
        let expected = (squares / (2 * corners.len()) as f64).sqrt();
        assert_eq!(corners.len(), views as usize);
        assert!((rms - expected).abs() < 1e-4, "{title}: {expected}");
        if (row as i32, col as i32) == MOVED {
            moved = DVec2::new(x, y);
        } else {
            assert!(DVec2::new(x, y).length() < 0.05, "{title}");
        }
    }
    // Poses absorb a little of it.
    assert!(moved.distance(MOVED_BY_MM) < 0.05, "{moved}");
}

/// A file with residuals as written by versions up to 2026-11-24: without later additions.
fn as_before(text: &str) -> String {
    let mut file: Value = serde_json::from_str(text).unwrap();
    let of_file = file.as_object_mut().unwrap();
    assert!(of_file.remove("coverage").is_some() && of_file.remove("corners").is_some());
    for view in of_file["views"].as_array_mut().unwrap() {
        assert!(view.as_object_mut().unwrap().remove("corner_count").is_some());
    }
    file.to_string()
}

#[test]
fn files_without_residuals_and_earlier_files_give_the_same_page() {
    let found = of(&views(&camera(Model::Radtan), 2), Model::Radtan).solve().unwrap();
    let other = of(&views(&camera(Model::Radtan), 3), Model::Radtan).solve().unwrap();
    let written =
        |residuals| calibration::write(&found, &[], Print::default(), residuals, &[]).unwrap();
    let (brief, listed) = (written(Residuals::Omitted), written(Residuals::Listed));
    assert!(brief.len() < listed.len() / 4, "{} {}", brief.len(), listed.len());
    let read = |text: &str| saved::read_without_target(text).unwrap().cameras.remove(0);
    let all = [read(&brief), read(&listed), read(&as_before(&listed))];
    assert_eq!([0, 1, 2].map(|i| all[i].corner_count() > 0), [false, true, true]);
    let against = all.each_ref().map(|of| {
        let compared = Comparison::of(of, &other.cameras[0], None, Region::Seen).unwrap();
        (compared.compared().count(), compared.rms_px, compared.is_significant())
    });
    assert_eq!(against[0].0, against[1].0);
    for one in &against {
        assert!((one.1 - against[0].1).abs() < 1e-6 && one.2 == against[0].2, "{against:?}");
    }
    let sure = all
        .each_ref()
        .map(|of| of.projection_sd_px(None, deltille::calibrate::Source::Noise).unwrap());
    assert!((sure[0] / sure[1] - 1.0).abs() < 0.05 && sure[1] == sure[2], "{sure:?}");
}
