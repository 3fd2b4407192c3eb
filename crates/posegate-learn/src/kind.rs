//! Models of any kind.

use super::model_file;
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
        let table: toml::Table = model_file::parse(text, file)?;
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
