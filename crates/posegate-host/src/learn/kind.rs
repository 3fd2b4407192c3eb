//! Model files: their kind, strict reading, writing.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{ErrorModel, InflationModel, LearnError};

/// A learnt model of either kind.
// A program holds only one, so the size of a variant does not matter.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Model {
    /// Bounds on the errors of observations.
    Bounds(ErrorModel),
    /// Factors of covariances.
    Inflation(InflationModel),
}

impl Model {
    /// Reads a model from the text of its file; errors name it `file`.
    ///
    /// # Errors
    /// The text is not a model of a kind and version that this crate supports.
    pub fn parse(text: &str, file: &str) -> Result<Self, LearnError> {
        let table: toml::Table = of(text, file)?;
        match table.get("kind").and_then(toml::Value::as_str) {
            Some("bounds") => ErrorModel::parse(text, file).map(Self::Bounds),
            Some("inflation") => InflationModel::parse(text, file).map(Self::Inflation),
            _ => Err(LearnError::Model {
                file: file.to_owned(),
                what: "`kind` is neither \"bounds\" nor \"inflation\"".into(),
            }),
        }
    }
}

/// Reads a document. Unknown keys are refused.
pub(super) fn of<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, LearnError> {
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

pub(super) fn write(document: &impl Serialize) -> Result<String, LearnError> {
    let text = toml::to_string(document);
    let text = text.map_err(|fault| LearnError::Unwritten(fault.to_string()))?;
    Ok(format!(
        "# Written by `posegate learn`; read by `posegate predict` and, in site files, by [error_model.NAME].\n{text}"
    ))
}
