//! Errors in the syntax of TOML.

use super::error::{SiteError, Source};

/// Returns the error for a text that is not TOML.
pub(super) fn syntax(source: Source<'_>, fault: &toml::de::Error) -> SiteError {
    let end = source.text.len();
    let span = fault.span().unwrap_or(end..end);
    let (message, expected) = match fault.message().split_once(", expected ") {
        Some((message, expected)) if expected != "nothing" => (message, expected),
        _ => (fault.message(), "TOML"),
    };
    let help = if message.contains("duplicate key") {
        "give each key and each table once: remove or rename this one"
    } else if message.contains("must be quoted") || message.contains("string") {
        "put text into double quotes, on one line"
    } else {
        "write `key = value` lines under [table] headers, as in the file that `posegate init` writes"
    };
    source
        .error(span, format!("not valid TOML: {message}"))
        .expected(expected)
        .help(help)
}
