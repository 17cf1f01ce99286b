//! Comparison of lens models on held-out views.

use crate::report::html::{escaped, meter};
use deltille_calibrate::{CameraEstimate, Candidate, Comparison, Region};

/// Difference between the camera calibrated with a candidate model and the reported camera.
struct Against {
    rms_px: f64,
    largest_px: f64,
}

/// The table of models of a camera; empty if no models were compared.
pub(in crate::report) fn section(camera: &CameraEstimate, tried: &[Candidate]) -> String {
    if tried.is_empty() {
        return String::new();
    }
    let worst = tried.iter().filter_map(|one| one.held_out_px).fold(f64::MIN_POSITIVE, f64::max);
    let rows = tried.iter().map(|one| row(camera, one, worst));
    let best = tried.iter().find(|one| one.chosen).map(|one| one.model);
    let verdict = match (best, camera.model) {
        (Some(best), Some(own)) if best == own => {
            format!("{own} is the simplest adequate model for this lens.")
        }
        (Some(best), Some(own)) => match tried.iter().find(|one| one.model == own) {
            Some(one) if one.is_adequate => {
                format!(
                    "{own} describes the lens; {best} does so with fewer or better determined parameters."
                )
            }
            Some(_) => format!(
                "{own} was used, but of these models, {best} describes the lens best: try it, or --model auto, which also \
                 compares models of other kinds."
            ),
            None => String::new(),
        },
        _ => String::new(),
    };
    format!(
        "<section><h2>Models</h2><p>{}</p><div class=\"wide-table\"><table class=\"plain models\"><tr>\
         <th>model</th><th>parameters</th><th>held-out rms, px</th><th>training rms, px</th>\
         <th>difference, px</th><th>largest, px</th><th></th></tr>{}</table></div><p class=\"note\">Each model was calibrated from two \
         thirds of a sample of the views and evaluated on the rest, where only poses are estimated. A model with too few parameters has \
         a larger held-out rms; one with too many does not reduce it. The differences (rms and largest) compare \
         projections at infinity with those of the camera in this report, within the region with corners, after the rotation that minimizes them. For the model in this report they show the effect of using fewer views.</p></section>\n",
        escaped(&verdict),
        rows.collect::<String>()
    )
}

/// A row of the table; `worst` is the largest held-out RMS, px.
fn row(camera: &CameraEstimate, one: &Candidate, worst: f64) -> String {
    let own = camera.model == Some(one.model);
    let held_out = one
        .held_out_px
        .map_or("did not converge".to_owned(), |px| format!("{px:.4}{}", meter(px / worst)));
    let rms =
        one.found.as_ref().map_or("–".to_owned(), |of| format!("{:.4}", of.inlier_rms_px()));
    let against = one.found.as_ref().and_then(|of| against(camera, of));
    let [differs, most] = against.map_or(["–", "–"].map(str::to_owned), |of| {
        [format!("{:.3}", of.rms_px), format!("{:.2}", of.largest_px)]
    });
    let notes = [
        (own, "this report"),
        (one.chosen, "simplest adequate model"),
        (one.is_adequate && !one.chosen, "equally good"),
        (one.held_out_px.is_some() && !one.is_stable, "ill-conditioned parameters"),
    ];
    let notes: Vec<&str> =
        notes.iter().filter(|(is_so, _)| *is_so).map(|(_, note)| *note).collect();
    format!(
        "<tr{}><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{held_out}</td>\
         <td class=\"number\">{rms}</td><td class=\"number\">{differs}</td><td class=\"number\">{most}</td><td>{}</td></tr>",
        if own { " class=\"own\"" } else { "" },
        escaped(&one.model.to_string()),
        one.parameters,
        notes.join(", ")
    )
}

fn against(camera: &CameraEstimate, other: &CameraEstimate) -> Option<Against> {
    let found = Comparison::of(camera, other, None, Region::Seen).ok()?;
    Some(Against { rms_px: found.rms_px, largest_px: found.largest_px() })
}
