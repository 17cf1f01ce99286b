//! Time of every stage of detection, on a synthetic image of a tagged board.
//!
//! `cargo bench --bench detect`; each figure is the time for one image of 1600 × 1200 pixels on one thread, with either
//! refinement. For photographs, use `deltille bench detect IMAGES…`.

use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use deltille::camera::{Camera, Pose};
use deltille::clock;
use deltille::detect::{Detector, DetectorConfig, Refinement};
use deltille::layout::Printing;
use deltille::raster::Gray;
use deltille::synth::{Light, scene_of_sheet};
use deltille::targets::{BoardSpec, Target};
use glam::DVec3;

/// Returns a board of 10 × 11 corners with tags, and its image at 35°.
fn photograph() -> (Target, Gray<u8>) {
    let spec = BoardSpec::deltille(10, 11, 20.0);
    let target = Printing::new("board", spec).expect("a board that fits A4");
    let sheets = target.draw().expect("a board that can be drawn").sheets;
    let scene = scene_of_sheet(&target, &sheets[0], 0);
    let centre = target.target.panels[0].middle_mm();
    let eye = centre + 420.0 * DVec3::new(0.4, -0.41, 0.82);
    let pose = Pose::looking_at(eye, centre, DVec3::Y);
    let light = Light::default().blur_px(0.8).noise(0.01).seed(1);
    let image = scene.render(&Camera::pinhole(1600, 1200, 75f64.to_radians()), &pose, &light);
    (target.target, image.map(|v| (v * 255.0 + 0.5) as u8))
}

fn detect(criterion: &mut Criterion) {
    let (target, image) = photograph();
    for (name, refinement) in [("polynomial", Refinement::Polynomial), ("model", Refinement::Model)]
    {
        let config = DetectorConfig::default().refinement(refinement);
        let detector = Detector::for_target(&target, config).unwrap().with_clock(clock::now);
        let stages: Vec<String> = detector.detect(&image, "").timing_ms.into_keys().collect();
        let mut group = criterion.benchmark_group(format!("detect, {name}"));
        for stage in stages {
            group.bench_function(&stage, |bencher| {
                bencher.iter_custom(|times| {
                    let ms: f64 =
                        (0..times).map(|_| detector.detect(&image, "").timing_ms[&stage]).sum();
                    Duration::from_secs_f64(ms / 1e3)
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, detect);
criterion_main!(benches);
