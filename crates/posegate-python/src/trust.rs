//! The trust in the covariances of a source: which terms are filled, and the inflation.

use crate::error::refused_argument;
use posegate::set::{CrossTerms, Inflation, SplitWeight, Trust};
use pyo3::prelude::*;

/// Returns the trust that the arguments state.
pub fn trust(py: Python<'_>, cross_terms: &str, inflation: f64) -> PyResult<Trust> {
    let cross_terms = match cross_terms {
        "filled" => CrossTerms::Filled,
        "yaw_unknown" => CrossTerms::YawUnknown(SplitWeight::HALF),
        "all_unknown" => CrossTerms::AllUnknown(SplitWeight::HALF),
        other => {
            return Err(refused_argument(
                py,
                format!("cross_terms is {other:?}"),
                "write \"filled\", \"yaw_unknown\" or \"all_unknown\"",
            ));
        }
    };
    let inflation = Inflation::new(inflation).ok_or_else(|| {
        let message = format!("inflation is {inflation}");
        refused_argument(py, message, "give a number from 1 to 4096")
    })?;
    Ok(Trust {
        inflation,
        cross_terms,
    })
}
