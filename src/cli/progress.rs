//! Progress bars on standard error; silent when it is not a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar with position, rate and estimate, for `total` units of work called `unit`.
pub fn bar(total: u64, unit: &str) -> ProgressBar {
    let template = format!(
        "{{elapsed_precise}} {{wide_bar}} {{percent:>3}} %  {{human_pos}} {unit}  \
         {{per_sec}}  {{eta_precise}} left  {{msg}}"
    );
    let style = ProgressStyle::with_template(&template).expect("the template is well formed");
    ProgressBar::new(total).with_style(style)
}
