//! Proven tables of a site's tasks, each made once.

use std::borrow::ToOwned;
use std::collections::BTreeMap;
use std::string::String;
use std::vec::Vec;

use super::PlanError;
use crate::bake::{Layout, Order, TableSpec};
use crate::site::{Site, Task};
use crate::verify::{BuildError, build};

/// Proven tables of a site's tasks.
#[derive(Debug)]
pub struct Rooms<'a> {
    site: &'a Site,
    tables: BTreeMap<String, Vec<u8>>,
}

impl<'a> Rooms<'a> {
    /// None yet.
    #[must_use]
    pub const fn of(site: &'a Site) -> Self {
        Self {
            site,
            tables: BTreeMap::new(),
        }
    }

    /// Makes and proves the table of a task, unless it is there: as facets of the whole set where it has them, else as
    /// the site file wishes it.
    ///
    /// # Errors
    /// [`PlanError::Table`], [`PlanError::Unbounded`].
    pub fn make(&mut self, name: &str) -> Result<(), PlanError> {
        if self.tables.contains_key(name) {
            return Ok(());
        }
        let Some(task) = self.site.tasks.get(name) else {
            return Ok(());
        };
        let bytes = proven(self.site, name, task)?;
        self.tables.insert(name.to_owned(), bytes);
        Ok(())
    }

    /// The bytes of a task's table.
    #[must_use]
    pub fn bytes(&self, name: &str) -> Option<&[u8]> {
        self.tables.get(name).map(Vec::as_slice)
    }
}

/// The proven table of a task that is named as in the site file.
pub(super) fn proven(site: &Site, name: &str, task: &Task) -> Result<Vec<u8>, PlanError> {
    let order = |spec| Order {
        task: name,
        success: &task.success,
        spec,
        epsilon: site.epsilon,
        site_digest: site.digest,
    };
    let failed = |cause| PlanError::Table {
        task: name.to_owned(),
        cause,
    };
    let extent = crate::bake::wide_extent(&task.success);
    let extent = extent.or_else(|| crate::bake::extent(&task.success, None));
    let whole = extent.map(|extent| TableSpec {
        extent,
        step: task.wish.step.unwrap_or(Site::DEFAULT_STEP),
        layout: Layout::Facets,
    });
    let wished = site.chosen_table(task);
    let facets = whole.or(wished.map(|spec| TableSpec {
        layout: Layout::Facets,
        ..spec
    }));
    let spec = facets.ok_or_else(|| PlanError::Unbounded(name.to_owned()))?;
    match build(&order(spec), &|| ()) {
        Ok((bytes, _)) => Ok(bytes),
        Err(BuildError::Bake(crate::bake::BakeError::Epsilon(epsilon))) => {
            Err(PlanError::Epsilon(epsilon))
        }
        Err(first) => {
            let Some(spec) = wished.or(whole) else {
                return Err(failed(first));
            };
            let spec = TableSpec {
                layout: Layout::Auto,
                ..spec
            };
            let built = build(&order(spec), &|| ());
            built.map(|(bytes, _)| bytes).map_err(failed)
        }
    }
}
