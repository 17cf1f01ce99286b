//! The certificate of an acceptance test: one page of A4.

use std::fmt::Write as _;

use crate::export::acceptance::Tested;
use crate::report::html::escaped;
use crate::report::plots::length_errors;
use deltille_calibrate::{Acceptance, Conformity, CornerLabel, LengthError, Temperature};
use deltille_core::words::{counted, places};

const STYLE: &str = include_str!("certificate.css");

/// Number of lengths in the table.
const ROWS: usize = 5;

/// The contents of a certificate.
#[derive(Clone, Debug)]
pub struct Certificate<'a> {
    /// What was tested, and with what.
    pub tested: Tested,
    /// The result.
    pub found: &'a Acceptance,
}

impl Certificate<'_> {
    /// The page as HTML with an embedded drawing.
    pub fn html(&self) -> String {
        let found = self.found;
        let mut page = format!(
            "<!DOCTYPE html>\n<!-- deltille {version} -->\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>Acceptance test – {title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
             <h1>Acceptance test of length measurement</h1>\n",
            version = env!("CARGO_PKG_VERSION"),
            title = escaped(&self.tested.calibration),
        );
        page += &self.head();
        page += &verdict(found);
        page += "<h2>Errors of length measurement</h2>";
        page += &length_errors::plot(found);
        page += &decisive(found);
        page += "<div class=\"sides\"><section>";
        page += &found.by_weight().first().map_or(String::new(), |of| budget(of));
        page += "</section><section>";
        page += &probing(found);
        page += &self.method();
        page += "</section></div>";
        page += "<div class=\"sign\"><div>Date</div><div>Tested by</div></div>\n</body>\n</html>\n";
        page
    }

    /// What was tested, and with what.
    fn head(&self) -> String {
        let found = self.found;
        let frames = match found.is_triangulated {
            true => counted(found.measured.len(), "set") + " of simultaneous images",
            false => counted(found.measured.len(), "image"),
        };
        let corners = counted(found.probing.corners, "measured corner");
        let images = format!("{frames} ({}), {corners}{}", listed(&found.measured), out(found));
        let tested = &self.tested;
        let mut rows = vec![
            ("Calibration", tested.calibration.clone()),
            ("Target", format!("{}; corners ± {} mm (1σ)", tested.target, found.board_accuracy_mm)),
            ("Images", images),
        ];
        if let Some(fingerprint) = &tested.calibration_sha256 {
            rows.insert(1, ("Its SHA-256", fingerprint.clone()));
        }
        let known = match &tested.lengths {
            Some(file) => {
                let missing: Vec<String> = found
                    .missing()
                    .map(|of| of.ends.map(|end| corner(&end, found.has_panels())).join(" – "))
                    .collect();
                let missing = match missing.as_slice() {
                    [] => String::new(),
                    all => format!("; not measured: {}", listed(all)),
                };
                format!("{}, known from {file}{missing}", counted(found.lengths.len(), "length"))
            }
            None => {
                format!("{} between corners of the target", counted(found.lengths.len(), "length"))
            }
        };
        rows.push(("Lengths", known));
        if let Some(of) = &found.request.temperature {
            let text = format!(
                "{} ± {} °C (lengths known at {} °C), expansion {} ± {} ppm/K",
                plain(of.celsius()),
                plain(of.sd_k),
                Temperature::REFERENCE_C,
                plain(of.expansion_per_k * 1e6),
                plain(of.expansion_sd_per_k * 1e6)
            );
            rows.push(("Temperature, 1σ", text));
        }
        if let Some(limit) = found.request.limit {
            let per = match limit.per_length > 0.0 {
                true => format!(" + L / {:.0}", 1.0 / limit.per_length),
                false => String::new(),
            };
            rows.push(("Limit of the error", format!("{} mm{per}", limit.constant_mm)));
        }
        let rows = rows
            .into_iter()
            .map(|(name, value)| format!("<tr><th>{name}</th><td>{}</td></tr>", escaped(&value)));
        format!("<table class=\"head\">{}</table>", rows.collect::<String>())
    }

    /// How lengths were measured.
    fn method(&self) -> String {
        let how = match self.found.is_triangulated {
            true => {
                "Corners are triangulated by all cameras that see them. The scale is that of the calibration. The probing error is the \
             largest distance of a corner from the target after the best rigid fit in each set of images."
            }
            false => {
                "Corners are measured in the plane of their panel, at the pose estimated from the same image. The scale is that of the \
             target: a common error of scale is not seen. The probing error is the largest distance of a corner from the target."
            }
        };
        let lines = match self.tested.lengths {
            Some(_) => "",
            None => {
                " In each image, up to seven lines in different directions are measured, with up to five lengths each, in the manner of \
             VDI/VDE 2634 part 1."
            }
        };
        format!(
            "<h2>Method</h2><p class=\"note\">{how}{lines} Uncertainties follow the GUM; conformity is judged by \
             ISO 14253-1. Images with the pose of an image of the calibration are not measured. Computed with deltille {}.</p>",
            env!("CARGO_PKG_VERSION")
        )
    }
}

/// The images that were not measured.
fn out(found: &Acceptance) -> String {
    let all = [
        (found.reused.len(), "with the pose of an image of the calibration"),
        (found.unmeasured.len(), "with too few corners"),
    ];
    let all = all.into_iter().filter(|(count, _)| *count > 0);
    let out: String = all.map(|(count, why)| format!("; not measured: {count} {why}")).collect();
    match found.extrapolated {
        0 => out,
        count => format!(
            "; {count} of {} outside the calibrated part of the image{out}",
            counted(found.observations, "observation")
        ),
    }
}

/// Length of a list, characters: about one line of the page.
const LISTED: usize = 70;

/// Length of a name in a list, characters.
const NAME: usize = 40;

/// The first names, as many as there is room for; the JSON has all.
fn listed(all: &[String]) -> String {
    let mut text = String::new();
    for (index, name) in all.iter().enumerate() {
        let short = match name.chars().count() {
            ..=NAME => name.clone(),
            count => format!("…{}", name.chars().skip(count - NAME).collect::<String>()),
        };
        if index > 0 && text.len() + short.len() > LISTED {
            let _ = write!(text, " and {} more", all.len() - index);
            break;
        }
        text += if index == 0 { "" } else { ", " };
        text += &short;
    }
    text
}

/// A number as it was given.
fn plain(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The judgement, and the decisive error.
fn verdict(found: &Acceptance) -> String {
    let (class, text) = match found.verdict() {
        Some(Conformity::Conforms) => (
            "conforms",
            "<b>Conforms.</b> All errors are within the limit by more than their expanded uncertainty.",
        ),
        Some(Conformity::Fails) => (
            "fails",
            "<b>Does not conform.</b> At least one error exceeds the limit by more than its expanded uncertainty.",
        ),
        Some(Conformity::Undecided) if found.count(Conformity::Undecided) == 0 => {
            ("undecided", "<b>Undecided.</b> Given lengths were not measured.")
        }
        Some(Conformity::Undecided) => (
            "undecided",
            "<b>Undecided.</b> The limit is within the expanded uncertainty of at least one error.",
        ),
        None => ("none", "<b>Measured.</b> No limit was given."),
    };
    let decisive = found.by_weight().first().map_or(String::new(), |of| {
        let mm = Places::of(of);
        let (which, limit) = match found.request.limit {
            Some(limit) => ("Decisive", format!(", limit {} mm", mm.text(limit.of(of.known_mm)))),
            None => ("Largest", String::new()),
        };
        format!(
            " {which} error: {} mm at {:.1} mm, expanded uncertainty {} mm{limit}.",
            mm.signed(of.error_mm()),
            of.known_mm,
            mm.text(of.budget.expanded_mm())
        )
    });
    let counts = found.verdict().map_or(String::new(), |_| {
        let all = [Conformity::Conforms, Conformity::Undecided, Conformity::Fails];
        let [conforms, undecided, fails] = all.map(|of| found.count(of));
        format!(" {conforms} lengths conform, {undecided} are undecided, {fails} do not conform.")
    });
    format!("<p class=\"verdict {class}\">{text}{counts}{decisive}</p>")
}

/// The lengths that matter most.
fn decisive(found: &Acceptance) -> String {
    let has_panels = found.has_panels();
    let first = if found.request.limit.is_some() { "Decisive: image" } else { "Largest: image" };
    let place = if has_panels { "panel: row, col" } else { "row, col" };
    let mut text = format!(
        "<table><tr><th>{first}</th><th>from – to ({place})</th><th class=\"number\">known mm</th>\
         <th class=\"number\">measured mm</th><th class=\"number\">error mm</th><th class=\"number\">U mm</th>"
    );
    if found.request.limit.is_some() {
        text += "<th class=\"number\">limit mm</th><th></th>";
    }
    text += "</tr>";
    for of in found.by_weight().into_iter().take(ROWS) {
        let mm = Places::of(of);
        let limit = found.request.limit.map_or(String::new(), |limit| {
            let verdict = found.conformity(of).map_or("", |of| of.name());
            format!(
                "<td class=\"number\">{}</td><td class=\"word\">{verdict}</td>",
                mm.text(limit.of(of.known_mm))
            )
        });
        let [from, to] = of.ends.map(|end| corner(&end, has_panels));
        let _ = write!(
            text,
            "<tr><td class=\"long\">{}</td><td>{from} – {to}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>\
             <td class=\"number\">{}</td><td class=\"number\">{}</td>{limit}</tr>",
            escaped(&of.frame),
            mm.text(of.known_mm),
            mm.text(of.measured_mm),
            mm.signed(of.error_mm()),
            mm.text(of.budget.expanded_mm()),
        );
    }
    text += "</table>";
    let _ = write!(
        text,
        "<p class=\"note\">{} of {} are within their expanded uncertainty U (confidence {:.0} %).</p>",
        found.within(),
        counted(found.lengths.len(), "error"),
        100.0 * Acceptance::CONFIDENCE
    );
    text
}

/// The budget of an error.
fn budget(of: &LengthError) -> String {
    let mm = Places::of(of);
    let budget = &of.budget;
    let rows = [
        ("Noise of the corners", budget.noise_mm),
        ("Lens model, and other errors of corners", budget.lens_mm),
        ("Calibrated parameters", budget.calibration_mm),
        ("Target", budget.target_mm),
        ("Temperature", budget.temperature_mm),
    ];
    let row = |(name, value): (&str, f64)| {
        // Two digits, also of small parts.
        let digits = if value > 0.0 { places(value.max(1e-6)).min(6) } else { 0 };
        format!("<tr><td>{name}</td><td class=\"number\">{value:.digits$}</td></tr>")
    };
    let freedom = match budget.freedom() {
        many if many > 1000.0 => "> 1000".to_owned(),
        few => format!("{few:.0}"),
    };
    format!(
        "<h2>Uncertainty of the first of these</h2><table><tr><th>Source</th><th class=\"number\">u mm</th></tr>{}\
         <tr class=\"total\"><td>Combined u</td><td class=\"number\">{}</td></tr>\
         <tr class=\"total\"><td>Expanded U, k = {:.2} (ν {freedom})</td><td class=\"number\">{}</td></tr></table>",
        rows.map(row).concat(),
        mm.text(budget.combined_mm()),
        budget.coverage_factor(),
        mm.text(budget.expanded_mm())
    )
}

fn probing(found: &Acceptance) -> String {
    let probing = &found.probing;
    let digits = places(probing.rms_mm.max(1e-6)).min(6);
    let at = probing.at.as_ref().map_or(String::new(), |(label, frame)| {
        let corner = corner(label, found.has_panels());
        format!(" (corner {corner} in <span class=\"long\">{}</span>)", escaped(frame))
    });
    format!(
        "<h2>Probing error</h2><p>{:.digits$} mm{at}; rms {:.digits$} mm over {}.</p>",
        probing.largest_mm,
        probing.rms_mm,
        counted(probing.corners, "corner")
    )
}

fn corner(of: &CornerLabel, with_panel: bool) -> String {
    match with_panel {
        true => format!("{}: {}, {}", of.panel, of.row, of.col),
        false => format!("{}, {}", of.row, of.col),
    }
}

/// Decimal places of lengths in mm, after their uncertainty.
struct Places(usize);

impl Places {
    fn of(length: &LengthError) -> Self {
        Self(places(length.budget.combined_mm().max(1e-6)).min(6))
    }

    fn text(&self, mm: f64) -> String {
        format!("{mm:.*}", self.0)
    }

    fn signed(&self, mm: f64) -> String {
        format!("{mm:+.*}", self.0).replace('-', "−")
    }
}
