//! Errors of learning and of models.

use posegate_files::sheet::SheetError;

/// The reason why learning failed or a model cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LearnError {
    /// A fault at a position in a file.
    #[error("{file}:{line}:{column}: {what}")]
    Place {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u64,
        /// The field in a line of a CSV, or the character in a line of another file; from 1.
        column: usize,
        /// The fault and the expected value.
        what: String,
    },
    /// The description of the camera and the tags is impossible.
    #[error("what the detections were taken with: {what}")]
    TakenWith {
        /// The fault.
        what: &'static str,
    },
    /// A file with only a header.
    #[error("{file}: there is a header and no row")]
    Empty {
        /// The file.
        file: String,
    },
    /// Too few rows for any result.
    #[error("{found} {of} are too few: {needed} are needed for that share, with that confidence")]
    TooFew {
        /// Their number.
        found: u64,
        /// The kind of rows.
        of: &'static str,
        /// The smallest sufficient number.
        needed: u64,
    },
    /// Rows of too few runs.
    #[error(
        "{found} runs (drives, videos, approaches) are too few: {needed} are needed, because rows of one run depend on each other"
    )]
    TooFewRuns {
        /// Their number.
        found: u64,
        /// The smallest sufficient number.
        needed: u64,
    },
    /// There are too few robots (or runs) for a factor that is valid for a new one.
    #[error(
        "{found} groups in the column `{of}` are too few for a factor that holds for a new {of} with confidence {confidence}: {needed} are needed, with {rows} rows each"
    )]
    TooFewGroups {
        /// The groups with enough rows.
        found: u64,
        /// The column: `robot` or `run`.
        of: &'static str,
        /// The confidence.
        confidence: f64,
        /// The smallest sufficient number.
        needed: u64,
        /// The rows that a group needs.
        rows: u64,
    },
    /// Enough rows, but no cell gets a bound.
    #[error("no cell of the {found} detections gets a bound ({why})")]
    Nowhere {
        /// The number of detections.
        found: u64,
        /// The reasons, with numbers of cells.
        why: String,
    },
    /// A setting that is not in (0, 1).
    #[error("{name} {value} is no share; expected a number above 0 and below 1")]
    Share {
        /// The setting's name.
        name: &'static str,
        /// The setting's value.
        value: f64,
    },
    /// A model file whose parts do not match.
    #[error("{file}: not a model: {what}")]
    Model {
        /// The file.
        file: String,
        /// The mismatch.
        what: String,
    },
    /// The bounds are for the better one of two poses and the rows have one pose, or vice versa.
    #[error(
        "the model's bounds hold for {model}, and the rows have the errors of {rows}: give rows with `second_err_translation_m` and `second_err_yaw_rad` exactly if the model was learnt with them"
    )]
    Poses {
        /// The kind of poses in the model.
        model: &'static str,
        /// The kind of poses in the rows.
        rows: &'static str,
    },
    /// A model that could not be written.
    #[error("the model cannot be written: {0}")]
    Unwritten(String),
}

impl From<SheetError> for LearnError {
    fn from(error: SheetError) -> Self {
        Self::Place {
            file: error.file,
            line: error.line,
            column: error.column.unwrap_or(1),
            what: error.fault.to_string(),
        }
    }
}
