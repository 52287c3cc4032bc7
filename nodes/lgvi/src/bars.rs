//! Bars of progress on standard error; nothing where that is no terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// How often spinners turn.
pub(crate) const TICK: Duration = Duration::from_millis(100);

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

/// A spinner with a message, for something of unknown length. It turns once its ticks are enabled.
pub(crate) fn spinner(prefix: &'static str) -> ProgressBar {
    let bar = ProgressBar::new_spinner();
    bar.set_style(style("{prefix:>10} {spinner} {msg}"));
    bar.set_prefix(prefix);
    bar
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
