//! A verdict with its reason, margin and worst pose, as `posegate gate` prints them.

use crate::error::refused_argument;
use posegate::gate::{Reason, Verdict};
use posegate_replay::{coordinates, factor};
use pyo3::prelude::*;

/// Returns the names of the reasons by their codes; 0 is a permit, which has no reason.
pub fn reasons() -> Vec<Option<&'static str>> {
    let mut names = vec![
        None;
        1 + Reason::ALL
            .iter()
            .map(|r| r.code())
            .max()
            .map_or(0, usize::from)
    ];
    for reason in Reason::ALL {
        names[usize::from(reason.code())] = Some(reason.name());
    }
    names
}

/// The gate's decision on one estimate. True if it permits.
///
/// >>> import posegate
/// >>> posegate.Verdict(False, "not_contained", 0.5, (0.1, 0.0, 0.0))
/// Verdict(permit=False, reason='not_contained', margin=0.5, worst_pose=(0.1, 0.0, 0.0))
#[pyclass(frozen, eq, name = "Verdict", module = "posegate")]
#[derive(PartialEq)]
pub struct PyVerdict {
    /// True if the task may start.
    #[pyo3(get)]
    permit: bool,
    /// The name of the reason of a denial.
    #[pyo3(get)]
    reason: Option<&'static str>,
    /// The largest factor by which the pose-set could be scaled: at least 1 with a permit.
    #[pyo3(get)]
    margin: Option<f64>,
    /// A pose of the pose-set that is not in the success set: x, y, yaw in the world frame.
    #[pyo3(get)]
    worst_pose: Option<(f64, f64, f64)>,
}

impl From<Verdict> for PyVerdict {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Permit { margin } => Self {
                permit: true,
                reason: None,
                margin: Some(factor(margin)),
                worst_pose: None,
            },
            Verdict::Deny {
                reason,
                margin,
                worst_pose,
            } => Self {
                permit: false,
                reason: Some(reason.name()),
                margin: margin.map(factor),
                worst_pose: worst_pose.map(|pose| coordinates(pose).into()),
            },
        }
    }
}

#[pymethods]
impl PyVerdict {
    #[new]
    #[pyo3(signature = (permit, reason=None, margin=None, worst_pose=None))]
    fn new(
        py: Python<'_>,
        permit: bool,
        reason: Option<&str>,
        margin: Option<f64>,
        worst_pose: Option<(f64, f64, f64)>,
    ) -> PyResult<Self> {
        let known = |name: &str| Reason::ALL.iter().find(|reason| reason.name() == name);
        let reason = reason
            .map(|name| {
                known(name).map(|reason| reason.name()).ok_or_else(|| {
                    refused_argument(
                        py,
                        format!("there is no reason {name:?}"),
                        "give one of posegate.REASONS",
                    )
                })
            })
            .transpose()?;
        Ok(Self {
            permit,
            reason,
            margin,
            worst_pose,
        })
    }

    fn __bool__(&self) -> bool {
        self.permit
    }

    fn __repr__(&self) -> String {
        let text = |value: Option<String>| value.unwrap_or_else(|| "None".into());
        format!(
            "Verdict(permit={}, reason={}, margin={}, worst_pose={})",
            if self.permit { "True" } else { "False" },
            text(self.reason.map(|reason| format!("'{reason}'"))),
            text(self.margin.map(|margin| format!("{margin:?}"))),
            text(self.worst_pose.map(|pose| format!("{pose:?}"))),
        )
    }
}
