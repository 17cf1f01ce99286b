//! Tables of a rig: relative camera poses, panels, targets and frames.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::report::content::Report;
use crate::report::html::{escaped, meter, out_row};
use crate::report::sections::numbers::{aligned, rounded};
use crate::report::sections::views::MAX_VIEWS;
use deltille_calibrate::{FrameEstimate, PanelPrior};
use deltille_core::camera::Pose;

/// Relative camera poses.
pub(in crate::report) fn places(report: &Report) -> String {
    let first = report.estimate.cameras.first().map_or("", |camera| camera.name.as_str());
    let rows = report.estimate.cameras.iter().map(|camera| {
        let place = pose_cells(&camera.camera_from_rig.inverse(), camera.pose_sd);
        format!(
            "<tr><td>{}</td>{place}<td class=\"number\">{:.4}</td><td class=\"number\">{}</td></tr>",
            escaped(&camera.name),
            camera.rms_px,
            camera.corner_count()
        )
    });
    format!(
        "<section><h2>Relative camera poses</h2><div class=\"wide-table\"><table class=\"plain\"><tr><th>camera</th>\
         {POSE_HEADS}<th>rms, px</th><th>corners</th></tr>{}</table></div><p class=\"note\">Positions of the optical \
         centres and rotation angles relative to camera {}, with the largest standard deviation (1σ) of any \
         axis.</p></section>\n",
        rows.collect::<String>(),
        escaped(first)
    )
}

/// The uncertainty of distances that pairs of cameras measure.
pub(in crate::report) fn distances(report: &Report) -> String {
    let name = |camera: usize| escaped(&report.estimate.cameras[camera].name);
    let rows = report.estimate.depth_uncertainties().into_iter().map(|([first, second], of)| {
        format!(
            "<tr><td>{} and {}</td><td class=\"number\">{:.0}</td><td class=\"number\">{:.4}</td><td class=\"number\">{:.3}</td>\
             </tr>",
            name(first),
            name(second),
            of.distance_mm,
            of.sd_mm,
            of.mm_per_px
        )
    });
    let rows: String = rows.collect();
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<section><h2>Triangulated distances</h2><div class=\"wide-table\"><table class=\"plain\"><tr><th>cameras</th>\
         <th>distance, mm</th><th>1σ from the calibration, mm</th><th>1σ for 1 px of noise, mm</th></tr>{rows}</table></div>\
         <p class=\"note\">Distances from the first of two cameras, where it saw corners and the second one sees the point too. \
         Errors from noise are proportional to the noise of the pixels.</p></section>\n"
    )
}

/// Relative poses of targets, where there are several.
pub(in crate::report) fn targets(report: &Report) -> String {
    let targets = &report.estimate.targets;
    if targets.len() < 2 {
        return String::new();
    }
    let rows = targets.iter().map(|target| {
        let place = pose_cells(&target.scene_from_target, target.pose_sd);
        format!("<tr><td>{}</td>{place}</tr>", escaped(&target.name))
    });
    format!(
        "<section><h2>Relative target poses</h2><div class=\"wide-table\"><table class=\"plain\"><tr><th>target</th>{POSE_HEADS}\
         </tr>{}</table></div><p class=\"note\">Pose of the frame of each target relative to target {}, with the \
         largest standard deviation (1σ) of any axis.</p></section>\n",
        rows.collect::<String>(),
        escaped(&targets[0].name)
    )
}

/// Heads of the columns of [`pose_cells`].
const POSE_HEADS: &str =
    "<th>x, mm</th><th>y, mm</th><th>z, mm</th><th>1σ, mm</th><th>rotation, °</th><th>1σ, °</th>";

/// The cells of a pose: translation, mm, rotation angle, degrees, and the largest standard deviation of each. `sd` contains
/// those of the rotation, rad, and of the translation, mm; it is `None` for the reference pose.
fn pose_cells(pose: &Pose, sd: Option<[f64; 6]>) -> String {
    let largest = |sd: &[f64]| sd.iter().copied().fold(0.0, f64::max);
    // Adding zero makes a negative zero positive.
    let at = pose.translation.to_array().map(|mm| (100.0 * mm).round() / 100.0 + 0.0);
    let [x, y, z] = at.map(|mm| format!("{mm:.2}").replace('-', "−"));
    let [turn, _] = pose.off(&Pose::IDENTITY);
    let turned = format!("{:.3}", turn.length().to_degrees());
    let [sd_mm, sd_deg] = sd.map_or(["–", "–"].map(str::to_owned), |sd| {
        [format!("{:.3}", largest(&sd[3..])), format!("{:.4}", largest(&sd[..3]).to_degrees())]
    });
    let cells = [x, y, z, sd_mm, turned, sd_deg];
    cells.map(|cell| format!("<td class=\"number\">{cell}</td>")).concat()
}

/// Refined panel poses relative to those of the target file.
pub(in crate::report) fn panels(report: &Report) -> String {
    let seen = report.estimate.corners().map(|corner| (corner.panel.index(), corner.panel.id()));
    let ids: BTreeMap<usize, u32> = seen.collect();
    let found = report.estimate.panels.iter().zip(report.stated).enumerate();
    let (mut named, mut columns) = (Vec::new(), [const { Vec::new() }; 4]);
    let figures = found.filter_map(|(index, (found, stated))| {
        let ([turn, shift], covariance) = (off(found, stated), found.covariance?);
        let (mm, mm_sd) = rounded(shift.length(), Some(deviation(shift, &covariance, 3)));
        let [turned, turned_sd] = [turn.length(), deviation(turn, &covariance, 0)];
        let (turned, turned_sd) = rounded(turned.to_degrees(), Some(turned_sd.to_degrees()));
        let id = ids.get(&index)?;
        Some((id, [mm, mm_sd, turned, turned_sd]))
    });
    for (id, figures) in figures {
        named.push(id);
        columns.iter_mut().zip(figures).for_each(|(column, text)| column.push(text));
    }
    let columns = columns.map(|column| aligned(&column));
    let rows = named.into_iter().enumerate().map(|(row, id)| {
        let cells = columns.iter().map(|column| column[row].as_str());
        format!("<tr><td>{id}</td>{}</tr>", cells.collect::<String>())
    });
    let rows: String = rows.collect();
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<section><h2>Refined panels</h2><div class=\"wide-table\"><table class=\"plain\"><tr><th>panel</th>\
         <th>translation, mm</th><th>1σ, mm</th><th>rotation, °</th><th>1σ, °</th></tr>{rows}</table></div>\
         <p class=\"note\">Displacement of each panel from its pose in the target file, with standard \
         deviations (1σ). Panels that are not listed kept their pose or were not seen.</p></section>\n"
    )
}

/// Rotation, rad, and translation, mm, of a panel relative to its stated pose.
fn off(found: &PanelPrior, stated: &PanelPrior) -> [DVec3; 2] {
    found.target_from_panel.off(&stated.target_from_panel)
}

/// Standard deviation of the length of a vector, from a block of the covariance; for a zero vector, the largest of any
/// direction.
fn deviation(of: DVec3, covariance: &[[f64; 6]; 6], block: usize) -> f64 {
    let entry = |i: usize, j: usize| covariance[block + i][block + j];
    let variance = match of.try_normalize() {
        Some(along) => {
            let along = along.to_array();
            let terms = (0..9).map(|k| along[k / 3] * entry(k / 3, k % 3) * along[k % 3]);
            terms.sum()
        }
        None => (0..3).map(|i| entry(i, i)).fold(0.0, f64::max),
    };
    variance.max(0.0).sqrt()
}

/// The frames, and the cameras and corners of each.
pub(in crate::report) fn frames(report: &Report) -> String {
    let estimate = report.estimate;
    let mut order: Vec<usize> = (0..estimate.frames.len()).collect();
    let rms = |&index: &usize| estimate.frames[index].rms_px;
    let note = match order.len() > MAX_VIEWS {
        true => format!("<p>The worst {MAX_VIEWS} of {} frames.</p>", order.len()),
        false => String::new(),
    };
    if order.len() > MAX_VIEWS {
        order.sort_by(|a, b| rms(b).total_cmp(&rms(a)));
        order.truncate(MAX_VIEWS);
        order.sort_unstable();
    }
    let worst = order.iter().map(rms).fold(f64::MIN_POSITIVE, f64::max);
    let rows = order.iter().map(|&index| row(report, index, &estimate.frames[index], worst));
    let excluded = estimate.excluded.iter().filter(|out| out.camera.is_none());
    let excluded = excluded.map(|out| format!("<tr>{}", out_row(out, 3)));
    format!(
        "<section><h2 class=\"frames\">Frames</h2>{note}<div class=\"wide-table\"><table class=\"plain\"><tr><th>frame</th>\
         <th class=\"words\">cameras</th><th>corners</th><th>rms, px</th></tr>{}</table></div></section>\n",
        rows.chain(excluded).collect::<String>()
    )
}

/// A row of the table; `worst` is the largest RMS in it, px.
fn row(report: &Report, index: usize, frame: &FrameEstimate, worst: f64) -> String {
    let views = report.estimate.cameras.iter().flat_map(|camera| {
        let views = camera.views.iter().filter(|view| view.frame == index);
        views.map(|view| (escaped(&camera.name), view.corners.len()))
    });
    let (cameras, corners): (Vec<String>, Vec<usize>) = views.unzip();
    format!(
        "<tr><td class=\"name\">{}</td><td>{}</td><td class=\"number\">{}</td>\
         <td class=\"number\">{:.4}{}</td></tr>",
        escaped(&frame.name),
        cameras.join(", "),
        corners.iter().sum::<usize>(),
        frame.rms_px,
        meter(frame.rms_px / worst)
    )
}
