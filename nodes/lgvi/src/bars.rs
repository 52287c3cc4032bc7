//! Bars of progress on standard error; nothing where that is no terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar with how much of `length` is done, and how long the rest will take.
pub(crate) fn bar(prefix: &'static str, length: u64, unit: &str) -> ProgressBar {
    styled(prefix, length, &format!("{{pos}}/{{len}} {unit}"))
}

/// A bar with a message in place of the count.
pub(crate) fn told(prefix: &'static str, length: u64) -> ProgressBar {
    styled(prefix, length, "{msg}")
}

fn styled(prefix: &'static str, length: u64, shown: &str) -> ProgressBar {
    let bar = ProgressBar::new(length);
    let template = format!("{{prefix:>10}} [{{bar:40}}] {shown}, about {{eta}} left");
    bar.set_style(style(&template));
    bar.set_prefix(prefix);
    bar
}

pub(crate) fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
