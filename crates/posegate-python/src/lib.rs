//! The Python module `posegate._core`: what `python/posegate/__init__.py` exports.
//!
//! Files are read and errors are worded by `posegate_cli::calls`, so they are those of the command line.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::ffi::OsString;
use std::path::PathBuf;

mod arrays;
mod error;
mod gate;
mod site;
mod table;
mod threads;
mod trust;
mod uncertainty;
mod verdict;

/// Runs a command line and returns its exit code. `library` is the file of this module.
#[pyfunction]
fn program(py: Python<'_>, library: PathBuf, words: Vec<OsString>) -> u8 {
    py.detach(|| posegate_cli::calls::program_of(&library, words))
}

/// Runs a command line that prints its answer, and returns the text.
#[pyfunction]
fn answer(py: Python<'_>, words: Vec<OsString>) -> PyResult<String> {
    let answer = py.detach(|| posegate_cli::calls::answer(words));
    answer.map_err(|refusal| error::refused(py, refusal))
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("PosegateError", py.get_type::<error::PosegateError>())?;
    module.add("REASONS", PyTuple::new(py, verdict::reasons())?)?;
    module.add_class::<table::PyTable>()?;
    module.add_class::<verdict::PyVerdict>()?;
    module.add_class::<site::PySite>()?;
    module.add_class::<uncertainty::PyBounded>()?;
    module.add_class::<gate::PyEvidence>()?;
    module.add_class::<gate::PyGate>()?;
    module.add_class::<gate::PyGateStep>()?;
    module.add_class::<gate::PyTracker>()?;
    module.add_function(wrap_pyfunction!(answer, module)?)?;
    module.add_function(wrap_pyfunction!(program, module)?)
}
