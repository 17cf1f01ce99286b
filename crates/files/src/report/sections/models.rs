//! Comparison of lens models on held-out views.

use crate::report::html::{escaped, meter};
use deltille_calibrate::{CameraEstimate, Candidate, Comparison, Region};

/// A model's camera against the one that was found.
struct Against {
    rms_px: f64,
    largest_px: f64,
}

/// The table of models of a camera; empty where none were tried.
pub(in crate::report) fn section(camera: &CameraEstimate, tried: &[Candidate]) -> String {
    if tried.is_empty() {
        return String::new();
    }
    let worst = tried.iter().filter_map(|one| one.held_out_px).fold(f64::MIN_POSITIVE, f64::max);
    let rows = tried.iter().map(|one| row(camera, one, worst));
    let best = tried.iter().find(|one| one.chosen).map(|one| one.model);
    let told = match (best, camera.model) {
        (Some(best), Some(own)) if best == own => {
            format!("{own} is the smallest that holds the lens.")
        }
        (Some(best), Some(own)) => match tried.iter().find(|one| one.model == own) {
            Some(one) if one.holds => {
                format!("{own} holds the lens; {best} does so with fewer parameters, or surer.")
            }
            Some(_) => format!("{own} was taken, and {best} holds the lens better: try it."),
            None => String::new(),
        },
        _ => String::new(),
    };
    format!(
        "<section><h2>Models</h2><p>{}</p><div class=\"wide-table\"><table class=\"plain models\"><tr>\
         <th>model</th><th>parameters</th><th>held out, px</th><th>its own views, px</th>\
         <th>differs by, px</th><th>at most, px</th><th></th></tr>{}</table></div><p class=\"note\">Each was found from two thirds of some views \
         and held against the others, where only poses are found: a model that is too small leaves more there, one that \
         is too large does not leave less. The difference (rms, and the largest) is that of projections at infinity from the \
         camera of this page, where corners were, after the turn that makes it least; that of the model of this page is what fewer views make.</p></section>\n",
        escaped(&told),
        rows.collect::<String>()
    )
}

/// A model in the table; `worst` is the largest RMS on views held out, px.
fn row(camera: &CameraEstimate, one: &Candidate, worst: f64) -> String {
    let own = camera.model == Some(one.model);
    let held_out = one
        .held_out_px
        .map_or("no camera".to_owned(), |px| format!("{px:.4}{}", meter(px / worst)));
    let rms =
        one.found.as_ref().map_or("–".to_owned(), |of| format!("{:.4}", of.inlier_rms_px()));
    let against = one.found.as_ref().and_then(|of| against(camera, of));
    let [differs, most] = against.map_or(["–", "–"].map(str::to_owned), |of| {
        [format!("{:.3}", of.rms_px), format!("{:.2}", of.largest_px)]
    });
    let notes = [
        (own, "of this page"),
        (one.chosen, "smallest that holds"),
        (one.holds && !one.chosen, "as good"),
        (one.held_out_px.is_some() && !one.is_stable, "parameters not told apart"),
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
