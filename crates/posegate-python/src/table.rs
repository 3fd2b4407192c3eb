//! A table, and decisions on it.

use crate::arrays::Numbers;
use crate::error::{refused, refused_argument};
use crate::threads::on_all_cores;
use crate::trust::trust;
use crate::uncertainty::{PyBounded, belief};
use crate::verdict::PyVerdict;
use numpy::IntoPyArray;
use posegate::contain::Decision;
use posegate::contain::many::decide_many;
use posegate::gate::{Reason, Verdict};
use posegate::recordings::Evaluator;
use posegate::report::PoseEstimate;
use posegate::set::{Estimate, InputError, RadiusSquared, Trust, Uncertainty};
use posegate::table::Table;
use posegate_cli::calls::{self, Refusal};
use posegate_replay::factor;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyTuple};
use rayon::prelude::*;
use self_cell::self_cell;
use std::path::PathBuf;

/// Estimates have no age here, so any limit works.
const MAXIMUM_AGE_MS: u32 = 200;
/// The number of rows from which the work uses all cores.
const MANY: usize = 4096;

type Parsed<'a> = (Table<'a>, Evaluator<'a>);

self_cell! {
    /// The bytes of a table, and the table that borrows them.
    struct Checked {
        owner: Vec<u8>,

        #[covariant]
        dependent: Parsed,
    }
}

/// The proven table of a task.
///
/// >>> import posegate
/// >>> table = posegate.Table.open("demo-out/dock.posegate")
/// >>> cov = [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]
/// >>> table.decide(0.07, 0.0, 0.0, cov).reason
/// 'not_contained'
/// >>> bool(table.decide(0.0, 0.0, 0.0, cov)), bool(table.decide(0.0, 0.0, 0.0, cov, inflation=9.0))
/// (True, False)
/// >>> permit, reason, margin = table.decide_many([[0.0, 0.0, 0.0]], [cov], margins=True)
/// >>> bool(permit[0]), bool(margin[0] >= 1.0)
/// (True, True)
#[pyclass(frozen, name = "Table", module = "posegate")]
pub struct PyTable {
    checked: Checked,
}

impl PyTable {
    /// Checks the bytes of a table; `name` is their name in messages.
    pub fn checked(py: Python<'_>, bytes: Vec<u8>, name: &str) -> PyResult<Self> {
        calls::check_table(&bytes, name).map_err(|error| refused(py, error))?;
        let checked = Checked::try_new(bytes, |bytes| {
            let table = Table::parse(bytes).map_err(|error| error.to_string())?;
            let evaluator =
                Evaluator::new(bytes, MAXIMUM_AGE_MS).map_err(|error| error.to_string())?;
            Ok::<_, String>((table, evaluator))
        });
        let checked = checked.map_err(PyRuntimeError::new_err)?;
        Ok(Self { checked })
    }

    /// Returns the bytes.
    pub fn bytes(&self) -> &[u8] {
        self.checked.borrow_owner()
    }

    /// Returns the squared radius of the Gaussian pose-sets.
    pub fn radius_squared(&self) -> RadiusSquared {
        self.table().radius_squared()
    }

    fn table(&self) -> &Table<'_> {
        let (table, _) = self.checked.borrow_dependent();
        table
    }
}

#[pymethods]
impl PyTable {
    #[new]
    fn new(py: Python<'_>, data: PyBackedBytes) -> PyResult<Self> {
        Self::checked(py, data.to_vec(), "the argument")
    }

    /// Reads a table that `posegate table build` or `Site.build` has made.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let name = path.display().to_string();
        let bytes = py.detach(|| calls::read_table(path.into()));
        Self::checked(py, bytes.map_err(|error| refused(py, error))?, &name)
    }

    /// The name of the task.
    #[getter]
    fn task(&self) -> &str {
        self.table().task()
    }

    /// The confidence of the Gaussian pose-sets if none is given.
    #[getter]
    fn epsilon(&self) -> f64 {
        self.table().epsilon()
    }

    /// The table's bytes, to be written to a file.
    fn __bytes__<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.checked.borrow_owner())
    }

    fn __repr__(&self) -> String {
        let length = self.checked.borrow_owner().len();
        format!("<posegate.Table {:?}, {length} bytes>", self.task())
    }

    /// Decides on one estimate: m, m, rad, and its covariance by rows in m^2, m rad and rad^2, or a `Bounded`. `cross_terms` says which
    /// terms of the covariance the source fills; `inflation` multiplies it.
    #[pyo3(signature = (x, y, yaw, cov, epsilon=None, cross_terms="filled", inflation=1.0))]
    #[allow(clippy::too_many_arguments)]
    fn decide(
        &self,
        py: Python<'_>,
        x: f64,
        y: f64,
        yaw: f64,
        cov: &Bound<'_, PyAny>,
        epsilon: Option<f64>,
        cross_terms: &str,
        inflation: f64,
    ) -> PyResult<PyVerdict> {
        let trust = trust(py, cross_terms, inflation)?;
        let (table, evaluator) = self.checked.borrow_dependent();
        let radius = calls::radius(table, epsilon).map_err(|error| refused(py, error))?;
        let belief = belief([x, y, yaw], cov)?;
        let verdict = py.detach(|| evaluator.evaluate(0, 0, belief.pose_set(radius, trust)));
        Ok(verdict.into())
    }

    /// Decides on many estimates: arrays of shape (n, 3) and (n, 3, 3), or one `Bounded` for all. Returns two arrays: `True` for each that is permitted, and the
    /// code of its reason, an index of `REASONS`. With `margins` also the margins, NaN where a reason has none.
    #[pyo3(signature = (poses, covs, epsilon=None, margins=false, cross_terms="filled", inflation=1.0))]
    #[allow(clippy::too_many_arguments)]
    fn decide_many<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
        covs: &Bound<'py, PyAny>,
        epsilon: Option<f64>,
        margins: bool,
        cross_terms: &str,
        inflation: f64,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let trust = trust(py, cross_terms, inflation)?;
        let (table, evaluator) = self.checked.borrow_dependent();
        let radius = calls::radius(table, epsilon).map_err(|error| refused(py, error))?;
        let poses = Numbers::new(poses, "poses", &[None, Some(3)])?;
        let poses: &[[f64; 3]] = poses.numbers()?.as_chunks().0;
        let bounded = covs.cast::<PyBounded>().ok();
        let bounded = bounded.map(|bounded| bounded.get().uncertainty());
        let covs = match bounded {
            Some(_) => None,
            None => Some(Numbers::new(covs, "covs", &[None, Some(3), Some(3)])?),
        };
        let covs: &[[[f64; 3]; 3]] = match &covs {
            Some(covs) => covs.numbers()?.as_chunks().0.as_chunks().0,
            None => &[],
        };
        if bounded.is_none() && poses.len() != covs.len() {
            let message = format!("{} poses have {} covariances", poses.len(), covs.len());
            return Err(refused_argument(
                py,
                message,
                "give one covariance for each pose",
            ));
        }
        let with_margins = || {
            let all = poses.par_iter().enumerate().with_min_len(MANY / 16);
            let each = all.map(|(row, &[x_m, y_m, yaw_rad])| {
                let estimate = Estimate { x_m, y_m, yaw_rad };
                let spread = bounded.unwrap_or_else(|| Uncertainty::Gaussian(covs[row]));
                let set = PoseEstimate::new(estimate, spread).pose_set(radius, trust);
                if margins {
                    return code_and_margin(evaluator.evaluate(0, 0, set));
                }
                let code = evaluator.permits(0, 0, set).err().map_or(0, Reason::code);
                (code, f64::NAN)
            });
            each.unzip()
        };
        let (codes, found): (Vec<u8>, Vec<f64>) = py.detach(|| {
            if margins || bounded.is_some() || trust != Trust::FULL {
                return on_all_cores(with_margins);
            }
            let decide = || decide_many(table, radius, poses, covs);
            let found = if poses.len() < MANY {
                decide()
            } else {
                on_all_cores(decide)
            };
            (found.into_iter().map(code).collect(), Vec::new())
        });
        let permits: Vec<bool> = codes.iter().map(|code| *code == 0).collect();
        let (permits, codes) = (permits.into_pyarray(py), codes.into_pyarray(py));
        if margins {
            (permits, codes, found.into_pyarray(py)).into_pyobject(py)
        } else {
            (permits, codes).into_pyobject(py)
        }
    }
}

/// Returns the code of a verdict's reason, and its margin or NaN.
fn code_and_margin(verdict: Verdict) -> (u8, f64) {
    match verdict {
        Verdict::Permit { margin } => (0, factor(margin)),
        Verdict::Deny { reason, margin, .. } => (reason.code(), margin.map_or(f64::NAN, factor)),
    }
}

/// Returns the code of a reason, 0 for a permit.
fn code(found: Result<Decision, InputError>) -> u8 {
    match found {
        Ok(Decision::Inside) => 0,
        Ok(Decision::Outside(cause)) => Reason::from(cause).code(),
        Err(error) => Reason::from(error).code(),
    }
}

/// Returns a table that was built.
pub fn built(py: Python<'_>, bytes: Result<Vec<u8>, Refusal>) -> PyResult<PyTable> {
    PyTable::checked(py, bytes.map_err(|error| refused(py, error))?, "the table")
}
