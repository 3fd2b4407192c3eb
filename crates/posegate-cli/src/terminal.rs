//! Prints answers on stdout, progress and warnings on stderr. Text from files is escaped. A failed write to stdout is an error.

use crate::failure::{Failure, to_stderr};
use indicatif::{ProgressBar, ProgressStyle};
use posegate_files::files;
use posegate_files::printable::{printable_json, printable_lines};
use serde_json::Value;
use std::fmt::Display;

/// Prints a line of text on stdout. The caller must escape names that may contain line ends.
pub fn print(line: &impl Display) -> Result<(), Failure> {
    let text = format!("{line}\n");
    Ok(files::print(printable_lines(&text).as_bytes())?)
}

/// Prints a line of JSON on stdout.
pub fn print_json(value: &Value) -> Result<(), Failure> {
    Ok(files::print(json_line(value).as_bytes())?)
}

/// Returns a line of JSON with its line end. Control characters of terminals are escaped by JSON's rules.
pub fn json_line(value: &Value) -> String {
    printable_json(&format!("{value}\n")).into_owned()
}

/// Prints a warning on stderr.
pub fn warn(line: &impl Display) {
    to_stderr(&printable_lines(&line.to_string()));
}

/// Returns a progress bar on stderr. It is hidden if stderr is not a terminal.
pub fn progress(length: u64, what: &'static str) -> ProgressBar {
    bar(length, what, "{msg:>10} [{bar:40}] {pos}/{len} {eta}")
}

/// As [`progress`], with the number of steps per second. It also redraws by itself, because single steps may take long.
pub fn progress_with_rate(length: u64, what: &'static str) -> ProgressBar {
    let template = "{msg:>10} [{bar:40}] {pos}/{len}, {per_sec}, {eta} left";
    let bar = bar(length, what, template);
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    bar
}

fn bar(length: u64, what: &'static str, template: &str) -> ProgressBar {
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length)
        .with_style(style)
        .with_message(what)
}
