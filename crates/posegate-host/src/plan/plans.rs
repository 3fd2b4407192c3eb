//! Plans on a site, its libraries made ready once.

use std::collections::BTreeMap;

use super::{Options, PlanError, PlanResult, Prepared};
use crate::site::Site;

/// A site, and what was made ready of it.
#[derive(Debug)]
pub struct Plans<'a> {
    site: &'a Site,
    prepared: BTreeMap<String, Prepared<'a>>,
}

impl<'a> Plans<'a> {
    /// Of a site; nothing is made ready yet.
    #[must_use]
    pub const fn of(site: &'a Site) -> Self {
        Self {
            site,
            prepared: BTreeMap::new(),
        }
    }

    /// The plan of a task from a chain's start, as `posegate plan` finds it. `None` where there is nothing to look at.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn plan(
        &mut self,
        from: &str,
        task: &str,
        options: &Options,
    ) -> Result<Option<PlanResult>, PlanError> {
        // One library is enough where the site says how it is driven.
        let own = if self.site.navigation.model.is_some() {
            ""
        } else {
            from
        };
        if !self.prepared.contains_key(own) {
            match Prepared::of(self.site, Some(from)) {
                Ok(made) => {
                    self.prepared.insert(own.to_owned(), made);
                }
                Err(PlanError::NoLooks(_)) => return Ok(None),
                Err(error) => return Err(error),
            }
        }
        let chain = self.site.chains.get(from);
        let start = &chain
            .ok_or_else(|| PlanError::NoChain(from.to_owned()))?
            .start;
        let prepared = self.prepared.get_mut(own);
        prepared
            .map(|prepared| prepared.plan(start, task, options))
            .transpose()
    }
}
