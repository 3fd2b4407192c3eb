//! A task's table for plans and chains: baked first, proven only if a plan relies on it.

use super::PlanError;
use posegate::bake::{self, BakeError, BakeInput, Effort, Extent, Layout, TableSpec};
use posegate::shape::SuccessSet;
use posegate::table::Table;
use posegate::verify::{BuildError, build};
use posegate_site::{Site, TableOverrides};

/// A task's success set and its table.
#[derive(Clone, Debug)]
pub struct TaskTable {
    /// The task's name.
    pub name: String,
    /// The task's success set.
    pub success: SuccessSet,
    wish: TableOverrides,
    bytes: Vec<u8>,
    is_proven: bool,
    /// The bytes as baked, if the proof made the table stricter.
    wider: Option<Vec<u8>>,
    /// The proven bytes, while the baked bytes are in use again.
    stricter: Option<Vec<u8>>,
}

impl TaskTable {
    /// Bakes the facets of the complete set without a proof. If the set has no facets, builds and proves the table
    /// that the site file specifies.
    ///
    /// # Errors
    /// [`PlanError::Table`], [`PlanError::Unbounded`], [`PlanError::Epsilon`].
    pub(super) fn baked(
        site: &Site,
        name: &str,
        success: &SuccessSet,
        wish: TableOverrides,
    ) -> Result<Self, PlanError> {
        let mut table = Self {
            name: name.to_owned(),
            success: success.clone(),
            wish,
            bytes: Vec::new(),
            is_proven: false,
            wider: None,
            stricter: None,
        };
        match table.facets(site) {
            Some(bytes) => table.bytes = bytes,
            None => {
                table.prove(site)?;
            }
        }
        Ok(table)
    }

    /// Like [`TaskTable::baked`], then proves the table: as facets of the complete set if possible, else as the site
    /// file specifies.
    ///
    /// # Errors
    /// Those of [`TaskTable::baked`].
    pub(super) fn proven(
        site: &Site,
        name: &str,
        success: &SuccessSet,
        wish: TableOverrides,
    ) -> Result<Self, PlanError> {
        let mut table = Self::baked(site, name, success, wish)?;
        table.prove(site)?;
        Ok(table)
    }

    /// Returns `true` if the complete table is proven.
    #[must_use]
    pub const fn is_proven(&self) -> bool {
        self.is_proven
    }

    /// Parses the table's bytes.
    ///
    /// # Errors
    /// [`PlanError::Table`] if the bytes are not a table, which is an internal error.
    pub fn table(&self) -> Result<Table<'_>, PlanError> {
        Table::parse(&self.bytes).map_err(|error| PlanError::Table {
            task: self.name.clone(),
            cause: posegate::verify::VerifyError::Table(error).into(),
        })
    }

    /// Proves the complete table, unless it is already proven. Returns `true` if its bytes have changed.
    ///
    /// # Errors
    /// Those of [`TaskTable::baked`].
    pub(super) fn prove(&mut self, site: &Site) -> Result<bool, PlanError> {
        if self.is_proven {
            return Ok(false);
        }
        let bytes = match self.stricter.take() {
            Some(known) => known,
            None => self.built(site)?,
        };
        self.is_proven = true;
        let changed = bytes != self.bytes;
        let before = core::mem::replace(&mut self.bytes, bytes);
        self.wider = (changed && !before.is_empty()).then_some(before);
        Ok(changed)
    }

    /// Returns `true` if the table in use is stricter than the baked one.
    pub(super) const fn is_stricter(&self) -> bool {
        self.wider.is_some()
    }

    /// Restores the baked table if the proof made it stricter: another set may be provable by itself. Returns `true`
    /// if the bytes have changed. Keeps the proven bytes for later use.
    pub(super) fn relax(&mut self) -> bool {
        let Some(wider) = self.wider.take() else {
            return false;
        };
        self.stricter = Some(core::mem::replace(&mut self.bytes, wider));
        self.is_proven = false;
        true
    }

    fn order(&self, site: &Site, spec: TableSpec) -> BakeInput<'_> {
        BakeInput {
            task: &self.name,
            success: &self.success,
            spec,
            epsilon: site.epsilon,
        }
    }

    /// Returns the spec of facets of the complete set; `None` if the set is unbounded.
    fn complete(&self) -> Option<TableSpec> {
        let extent = bake::wide_extent(&self.success);
        let extent = extent.or_else(|| bake::extent(&self.success, None));
        extent.map(|extent| self.facets_on(extent))
    }

    fn facets_on(&self, extent: Extent) -> TableSpec {
        TableSpec {
            extent,
            step: self.wish.step.unwrap_or(Site::DEFAULT_STEP),
            layout: Layout::Facets,
        }
    }

    fn facets(&self, site: &Site) -> Option<Vec<u8>> {
        let order = self.order(site, self.complete()?);
        let mut plan = bake::facets(&order, Effort::default()).ok()?;
        plan.fit();
        bake::write_facets(&order, &plan).ok()
    }

    fn built(&self, site: &Site) -> Result<Vec<u8>, PlanError> {
        let failed = |cause| match cause {
            BuildError::Bake(BakeError::Epsilon(epsilon)) => PlanError::Epsilon(epsilon),
            cause => PlanError::Table {
                task: self.name.clone(),
                cause,
            },
        };
        let complete = self.complete();
        let chosen = posegate_site::chosen_table(&self.success, &self.wish);
        let facets = complete.or_else(|| chosen.map(|spec| self.facets_on(spec.extent)));
        let facets = facets.ok_or_else(|| PlanError::Unbounded(self.name.clone()))?;
        if let Ok((bytes, _)) = build(&self.order(site, facets), &|| ()) {
            return Ok(bytes);
        }
        let built = build(&self.order(site, chosen.unwrap_or(facets)), &|| ());
        built.map(|(bytes, _)| bytes).map_err(failed)
    }
}
