//! The result of the experiment, level by level, as text, CSV and JSON, and the ground truth of an image.

use std::fmt::Write as _;

use glam::DVec2;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use serde::Serialize;

use super::score::Score;
use crate::photographs::axes::{Axis, Level};
use crate::photographs::photograph::TrueCorner;
use crate::photographs::scene::Scene;
use deltille::export::kind::signed_png;
use deltille::raster::Gray;
use deltille_core::json;
use deltille_core::statistics::quantile;

/// Schema of the JSON result.
const SCHEMA: &str = "deltille/photographs/1";

/// Schema of the ground truth of an image.
const TRUTH_SCHEMA: &str = "deltille/photograph/1";

/// All photographs of a subject at one level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Name of the photographed target.
    pub subject: String,
    /// The varied quantity.
    pub axis: &'static str,
    /// Its level.
    pub level: String,
    /// Number of photographs.
    pub views: usize,
    /// Number of photographs with at least one correct label and no wrong one.
    pub labelled_views: usize,
    /// Total number of visible corners.
    pub visible: usize,
    /// Fraction of the visible corners reported with the correct label.
    pub recall: f64,
    /// Fraction of the visible corners reported at all.
    pub found: f64,
    /// Number of wrong labels.
    pub wrong: usize,
    /// Number of reports where there is no corner.
    pub nowhere: usize,
    /// Number of reports of corners under a cover.
    pub hidden: usize,
    /// Number of repeated reports of a corner.
    pub doubled: usize,
    /// RMS error per axis, px; `None` if nothing was found.
    pub rms_px: Option<f64>,
    /// 95th percentile of the distance from the true position, px.
    pub p95_px: Option<f64>,
    /// Mean of the squared error over the reported variance, per coordinate: 1 if the covariances are correct.
    pub normalised: Option<f64>,
    /// Median detection time, ms.
    pub time_ms: f64,
}

impl Row {
    /// Summarizes the photographs of one level.
    pub(crate) fn new(subject: &str, axis: Axis, level: &Level, scores: &[Score]) -> Self {
        let sum = |of: fn(&Score) -> usize| scores.iter().map(of).sum::<usize>();
        let visible = sum(|s| s.visible);
        let part = |count: usize| if visible == 0 { 1.0 } else { count as f64 / visible as f64 };
        let errors: Vec<DVec2> = scores.iter().flat_map(|s| s.errors_px.iter().copied()).collect();
        let squares: Vec<f64> =
            errors.iter().flat_map(|error| error.to_array()).map(|e| e * e).collect();
        let mut lengths: Vec<f64> = errors.iter().map(|error| error.x.hypot(error.y)).collect();
        let normalised: Vec<f64> =
            scores.iter().flat_map(|s| s.normalised.iter().map(|n| 0.5 * n)).collect();
        let mut times: Vec<f64> = scores.iter().map(|s| s.time_ms).collect();
        Self {
            subject: subject.to_owned(),
            axis: axis.name(),
            level: level.name.clone(),
            views: scores.len(),
            labelled_views: scores.iter().filter(|s| s.labelled > 0 && s.wrong == 0).count(),
            visible,
            recall: part(sum(|s| s.labelled)),
            found: part(sum(|s| s.found)),
            wrong: sum(|s| s.wrong),
            nowhere: sum(|s| s.nowhere),
            hidden: sum(|s| s.hidden),
            doubled: sum(|s| s.doubled),
            rms_px: mean(&squares).map(f64::sqrt),
            p95_px: quantile(&mut lengths, 0.95),
            normalised: mean(&normalised),
            time_ms: quantile(&mut times, 0.5).unwrap_or(0.0),
        }
    }

    /// Returns the number of reported corners that should not have been reported.
    pub fn false_corners(&self) -> usize {
        self.nowhere + self.hidden + self.doubled
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Formats the result as a table.
pub fn text(rows: &[Row]) -> String {
    let mut text = String::new();
    let mut last = None;
    for row in rows {
        if last.replace((&row.subject, row.axis)) != Some((&row.subject, row.axis)) {
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "{:<20}{:>9}{:>9}{:>7}{:>7}{:>9}{:>9}{:>8}{:>9}{:>9}",
                format!("{} {}", row.subject, row.axis),
                "recall %",
                "found %",
                "wrong",
                "false",
                "rms px",
                "p95 px",
                "e²/σ²",
                "labelled",
                "ms"
            );
        }
        let number = |v: Option<f64>, places: usize| {
            v.map_or_else(|| "–".to_owned(), |v| format!("{v:.places$}"))
        };
        let _ = writeln!(
            text,
            "{:<20}{:>9.1}{:>9.1}{:>7}{:>7}{:>9}{:>9}{:>8}{:>9}{:>9.1}",
            format!("  {}", row.level),
            100.0 * row.recall,
            100.0 * row.found,
            row.wrong,
            row.false_corners(),
            number(row.rms_px, 4),
            number(row.p95_px, 4),
            number(row.normalised, 2),
            format!("{}/{}", row.labelled_views, row.views),
            row.time_ms
        );
    }
    text
}

/// Formats the result as CSV.
pub fn csv(rows: &[Row]) -> String {
    let mut text =
        "subject,axis,level,views,labelled_views,visible,recall,found,wrong,nowhere,hidden,\
                    doubled,rms_px,p95_px,normalised,time_ms\n"
            .to_owned();
    for row in rows {
        let Row { subject, axis, level, views, labelled_views, visible, .. } = row;
        let Row { recall, found, wrong, nowhere, hidden, doubled, time_ms, .. } = row;
        let [rms, p95, normalised] = [row.rms_px, row.p95_px, row.normalised]
            .map(|value| value.map_or_else(String::new, |value| format!("{value:.5}")));
        let _ = writeln!(
            text,
            "{subject},{axis},{level},{views},{labelled_views},{visible},{recall:.5},{found:.5},\
             {wrong},{nowhere},{hidden},{doubled},{rms},{p95},{normalised},{time_ms:.2}"
        );
    }
    text
}

/// Formats the result as JSON, schema `deltille/photographs/1`.
pub fn json(rows: &[Row], seed: u64) -> String {
    #[derive(Serialize)]
    struct File<'a> {
        schema: &'static str,
        seed: u64,
        scene: Scene,
        rows: &'a [Row],
    }
    json::to_text(&File { schema: SCHEMA, seed, scene: Scene::default(), rows }, 2)
}

/// Formats the ground truth of an image with this file name, schema `deltille/photograph/1`.
pub(crate) fn truth(image: &str, target: &str, scene: &Scene, corners: &[TrueCorner]) -> String {
    #[derive(Serialize)]
    struct File<'a> {
        schema: &'static str,
        image: &'a str,
        target: &'a str,
        scene: &'a Scene,
        corners: &'a [TrueCorner],
    }
    json::to_text(&File { schema: TRUTH_SCHEMA, image, target, scene, corners }, 2)
}

/// Encodes a grey image as PNG.
pub(crate) fn png(image: &Gray<u8>) -> Vec<u8> {
    let (width, height) = (image.width() as u32, image.height() as u32);
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(image.pixels(), width, height, ExtendedColorType::L8)
        .expect("a grey image is written to memory");
    signed_png(bytes)
}
