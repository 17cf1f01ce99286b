//! Elements of HTML that all sections share.

use base64::Engine as _;

use deltille_calibrate::Excluded;

/// Figures with captions side by side; an empty figure is left out with its caption.
pub(super) fn figures(pictures: impl IntoIterator<Item = (String, String)>) -> String {
    let pictures = pictures.into_iter().filter(|(svg, _)| !svg.is_empty());
    let pictures = pictures
        .map(|(svg, caption)| format!("<figure>{svg}<figcaption>{caption}</figcaption></figure>"));
    format!("<div class=\"plots\">{}</div>", pictures.collect::<String>())
}

/// A section of the page; `body` is HTML.
pub(super) fn section(title: &str, body: &str) -> String {
    format!("<section><h2>{title}</h2>{body}</section>\n")
}

/// A bar below a number in a table; `part` is its length as a fraction of the longest, 0 to 1.
pub(super) fn meter(part: f64) -> String {
    format!("<div class=\"meter\" style=\"width:{:.0}%\"></div>", 100.0 * part)
}

/// A PNG as a `data:` URL, which makes the page self-contained.
pub(super) fn data_url(png: &[u8]) -> String {
    let data = base64::engine::general_purpose::STANDARD.encode(png);
    format!("data:image/png;base64,{data}")
}

/// A table row of an excluded view, spanning `columns` columns beside its name.
pub(super) fn out_row(out: &Excluded, columns: usize) -> String {
    format!(
        "<td class=\"name\">{}</td><td colspan=\"{columns}\" class=\"out\">excluded: {}</td></tr>",
        escaped(&out.view),
        escaped(&out.reason.to_string())
    )
}

/// Escapes the characters that are special in HTML.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
