//! The uncertainty of an estimate: a covariance, or a bounded set.

use crate::arrays::Numbers;
use crate::error::refused_argument;
use posegate::report::PoseEstimate;
use posegate::set::{Estimate, Uncertainty};
use pyo3::prelude::*;

/// A bounded error, wherever a covariance is taken: the robot is within `translation` metres and `yaw` radians of the estimate.
///
/// >>> import posegate
/// >>> table = posegate.Table.open("demo-out/dock.posegate")
/// >>> table.decide(0.01, 0.0, 0.0, posegate.Bounded(0.02, 0.01)).permit
/// True
/// >>> table.decide(0.07, 0.0, 0.0, posegate.Bounded(0.02, 0.01)).reason
/// 'not_contained'
#[pyclass(frozen, eq, name = "Bounded", module = "posegate")]
#[derive(PartialEq)]
pub struct PyBounded {
    /// The radius in the plane, metres.
    #[pyo3(get)]
    translation: f64,
    /// The half width in yaw, radians.
    #[pyo3(get)]
    yaw: f64,
}

#[pymethods]
impl PyBounded {
    #[new]
    fn new(py: Python<'_>, translation: f64, yaw: f64) -> PyResult<Self> {
        let is_bound = |number: f64| number >= 0.0 && number.is_finite();
        if !(is_bound(translation) && is_bound(yaw)) {
            return Err(refused_argument(
                py,
                format!("a bound of {translation} m and {yaw} rad"),
                "give the largest errors, numbers from 0 on",
            ));
        }
        Ok(Self { translation, yaw })
    }

    fn __repr__(&self) -> String {
        format!(
            "Bounded(translation={:?}, yaw={:?})",
            self.translation, self.yaw
        )
    }
}

impl PyBounded {
    pub fn uncertainty(&self) -> Uncertainty {
        Uncertainty::Bounded {
            translation_m: self.translation,
            yaw_rad: self.yaw,
        }
    }
}

/// Returns the uncertainty that an argument states.
pub fn uncertainty(cov: &Bound<'_, PyAny>) -> PyResult<Uncertainty> {
    if let Ok(bounded) = cov.cast::<PyBounded>() {
        return Ok(bounded.get().uncertainty());
    }
    let cov = Numbers::new(cov, "cov", &[Some(3), Some(3)])?;
    let numbers = cov.numbers()?.as_chunks().0;
    Ok(Uncertainty::Gaussian(std::array::from_fn(|row| {
        numbers[row]
    })))
}

/// Returns the estimate of these arguments: m, m, rad.
pub fn belief([x_m, y_m, yaw_rad]: [f64; 3], cov: &Bound<'_, PyAny>) -> PyResult<PoseEstimate> {
    let estimate = Estimate { x_m, y_m, yaw_rad };
    Ok(PoseEstimate::new(estimate, uncertainty(cov)?))
}
