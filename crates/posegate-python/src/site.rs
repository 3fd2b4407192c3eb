//! A site file: exact membership of poses, and tables.

use crate::arrays::Numbers;
use crate::error::refused;
use crate::table::{PyTable, built};
use crate::threads::on_all_cores;
use numpy::{IntoPyArray, PyArray1};
use posegate_cli::calls;
use posegate_site::Site;
use pyo3::prelude::*;
use rayon::prelude::*;
use std::path::PathBuf;

/// The number of poses from which a thread is worth its start.
const CHUNK: usize = 1024;

/// The cameras, tags and tasks of a place.
///
/// >>> import posegate
/// >>> site = posegate.Site.parse("""
/// ... [task.dock]
/// ... kind = "work"
/// ... goal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }
/// ... success = { shape = "box", x = [-0.08, 0.08], y = [-0.06, 0.06], yaw_deg = [-4.0, 4.0] }
/// ... [table]
/// ... extent = { x = [-0.5, 0.5], y = [-0.5, 0.5], yaw_deg = [-20.0, 20.0] }
/// ... step = { xy = 0.01, yaw_deg = 0.5 }
/// ... """)
/// >>> site.contains("dock", [[0.07, 0.0, 0.0], [0.09, 0.0, 0.0]])
/// array([ True, False])
/// >>> site.build("dock").task
/// 'dock'
#[pyclass(frozen, name = "Site", module = "posegate")]
pub struct PySite {
    site: Site,
    path: PathBuf,
    /// The text, if the site is not of a file.
    text: Option<String>,
}

#[pymethods]
impl PySite {
    /// Reads and checks a site file.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let site = py.detach(|| calls::read_site(path.clone().into()));
        let site = site.map_err(|error| refused(py, error))?;
        Ok(Self {
            site,
            path,
            text: None,
        })
    }

    /// Checks the text of a site file. Files that it names are relative to the working folder.
    #[staticmethod]
    fn parse(py: Python<'_>, text: String) -> PyResult<Self> {
        let path = PathBuf::from("the text");
        let site = py.detach(|| calls::parse_site(&text, "the text"));
        let site = site.map_err(|error| refused(py, error))?;
        Ok(Self {
            site,
            path,
            text: Some(text),
        })
    }

    /// The path of the site file; `None` for a text.
    #[getter]
    fn path(&self) -> Option<&PathBuf> {
        self.text.is_none().then_some(&self.path)
    }

    /// The text that was parsed; `None` for a file.
    #[getter]
    fn text(&self) -> Option<&str> {
        self.text.as_deref()
    }

    /// The names of the tasks.
    #[getter]
    fn tasks(&self) -> Vec<&str> {
        self.site.tasks.keys().map(String::as_str).collect()
    }

    fn __repr__(&self) -> String {
        let path = self.path.display().to_string();
        format!("<posegate.Site {path:?}, {} tasks>", self.site.tasks.len())
    }

    /// Returns `True` for each pose (an array of shape (n, 3)) that is in the success set of a task.
    fn contains<'py>(
        &self,
        py: Python<'py>,
        task: &str,
        poses: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let task = calls::task(&self.site, task).map_err(|error| refused(py, error))?;
        let poses = Numbers::new(poses, "poses", &[None, Some(3)])?;
        let poses: &[[f64; 3]] = poses.numbers()?.as_chunks().0;
        let [east, north] = self.site.map_origin;
        let is_inside =
            |[x, y, yaw]: &[f64; 3]| task.success.membership([x - east, y - north, *yaw]).inside;
        let inside: Vec<bool> = py.detach(|| {
            if poses.len() < CHUNK {
                return poses.iter().map(is_inside).collect();
            }
            on_all_cores(|| {
                let poses = poses.par_iter().with_min_len(CHUNK);
                poses.map(is_inside).collect()
            })
        });
        Ok(inside.into_pyarray(py))
    }

    /// Builds the table of a task and proves it.
    fn build(&self, py: Python<'_>, task: &str) -> PyResult<PyTable> {
        let path = self.path.clone().into();
        let bytes = py.detach(|| on_all_cores(|| calls::build_table(&self.site, path, task)));
        built(py, bytes)
    }
}
