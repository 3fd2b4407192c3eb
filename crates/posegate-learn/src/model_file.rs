//! Model files: strict reading, and writing.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::LearnError;

/// Reads a document. Unknown keys are refused.
pub(super) fn parse<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, LearnError> {
    toml::from_str(text).map_err(|fault| {
        let start = fault.span().map_or(0, |span| span.start);
        let before = text.get(..start).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        LearnError::Place {
            file: file.to_owned(),
            line: 1 + before.matches('\n').count() as u64,
            column: 1 + before[line_start..].chars().count(),
            what: format!("not a model: {}", fault.message()),
        }
    })
}

/// Returns the text of a document's file.
pub(super) fn write(document: &impl Serialize) -> Result<String, LearnError> {
    let text = toml::to_string(document);
    let text = text.map_err(|fault| LearnError::Unwritten(fault.to_string()))?;
    Ok(format!(
        "# Written by `posegate learn`; read by `posegate predict` and, in site files, by [error_model.NAME].\n{text}"
    ))
}
