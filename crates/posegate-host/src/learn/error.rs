//! Why nothing was learnt.

/// Why nothing was learnt, or a model cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LearnError {
    /// A fault at a place of a file.
    #[error("{file}:{line}:{column}: {what}")]
    Place {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u64,
        /// Field of a line of a CSV, character of another file; from 1.
        column: usize,
        /// What is wrong there and what was expected.
        what: String,
    },
    /// A file with a header alone.
    #[error("{file}: there is a header and no row")]
    Empty {
        /// The file.
        file: String,
    },
    /// Too few rows for anything to be said.
    #[error("{found} {of} are too few: {needed} are needed for that share, with that confidence")]
    TooFew {
        /// How many there are.
        found: u64,
        /// Of what.
        of: &'static str,
        /// The fewest with which anything can be said.
        needed: u64,
    },
    /// Rows enough, but nowhere so that anything can be said.
    #[error("nothing can be said anywhere by {found} detections ({why})")]
    Nowhere {
        /// How many there are.
        found: u64,
        /// Why, with the number of cells.
        why: String,
    },
    /// A number that is no share.
    #[error("{name} {value} is no share; expected a number above 0 and below 1")]
    Share {
        /// What it is for.
        name: &'static str,
        /// The number.
        value: f64,
    },
    /// A model's file whose parts do not fit together.
    #[error("{file}: no model: {what}")]
    Model {
        /// The file.
        file: String,
        /// What does not fit.
        what: String,
    },
    /// A model that could not be written down.
    #[error("the model cannot be written: {0}")]
    Unwritten(String),
}
