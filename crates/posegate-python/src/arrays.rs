//! Arguments that are arrays: anything that NumPy converts to `float64`, with the shape checked.

use crate::error::refused_argument;
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// An array argument, contiguous and of `float64`.
pub struct Numbers<'py> {
    array: PyReadonlyArrayDyn<'py, f64>,
}

impl<'py> Numbers<'py> {
    /// Converts an argument. `shape` is what it must have; `None` is any length.
    pub fn new(
        argument: &Bound<'py, PyAny>,
        name: &str,
        shape: &[Option<usize>],
    ) -> PyResult<Self> {
        let py = argument.py();
        let numpy = py.import("numpy")?;
        let help = format!("give an array of shape {}", expected(shape));
        let refused = |message: String| refused_argument(py, message, &help);
        let array = numpy
            .call_method1("ascontiguousarray", (argument, "float64"))
            .map_err(|error| refused(format!("{name} is not an array of numbers: {error}")))?;
        let array: PyReadonlyArrayDyn<'py, f64> = array
            .extract()
            .map_err(|error| refused(format!("{name} is not an array of numbers: {error}")))?;
        let found = array.shape();
        let fits = found.len() == shape.len()
            && found
                .iter()
                .zip(shape)
                .all(|(found, expected)| expected.is_none_or(|n| n == *found));
        if !fits {
            let found: Vec<_> = found.iter().map(|n| Some(*n)).collect();
            return Err(refused(format!(
                "{name} has the shape {}, not {}",
                expected(&found),
                expected(shape)
            )));
        }
        Ok(Self { array })
    }

    /// Returns the numbers, the last axis fastest.
    pub fn numbers(&self) -> PyResult<&[f64]> {
        Ok(self.array.as_slice()?)
    }
}

/// Returns a shape as Python writes it, `n` for any length.
fn expected(shape: &[Option<usize>]) -> String {
    let axes: Vec<String> = shape
        .iter()
        .map(|axis| axis.map_or("n".into(), |length| length.to_string()))
        .collect();
    match axes.as_slice() {
        [one] => format!("({one},)"),
        all => format!("({})", all.join(", ")),
    }
}
