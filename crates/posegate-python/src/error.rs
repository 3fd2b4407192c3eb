//! The one exception of the module.

use posegate_cli::calls::Refusal;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pyo3::create_exception!(
    posegate,
    PosegateError,
    PyValueError,
    "A file, an argument or a task that is refused. The text is what the program `posegate` prints; `help` says what to do."
);

/// Returns the exception for a refusal.
pub fn refused(py: Python<'_>, refusal: Refusal) -> PyErr {
    let Refusal { message, help } = refusal;
    let error = PosegateError::new_err(message);
    match error.value(py).setattr("help", help) {
        Ok(()) => error,
        Err(other) => other,
    }
}

/// Returns the exception for an argument.
pub fn refused_argument(py: Python<'_>, message: String, help: &str) -> PyErr {
    let help = Some(help.to_owned());
    refused(py, Refusal { message, help })
}
