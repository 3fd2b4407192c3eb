//! Plans on one site, whose libraries are prepared only once.

use std::collections::BTreeMap;

use super::{Options, PlanError, PlanResult, Prepared};
use posegate_site::Site;

/// A site and its prepared libraries.
#[derive(Debug)]
pub struct Plans<'a> {
    site: &'a Site,
    prepared: BTreeMap<String, Prepared<'a>>,
}

impl<'a> Plans<'a> {
    /// Creates the value for a site, with no library prepared yet.
    #[must_use]
    pub const fn of(site: &'a Site) -> Self {
        Self {
            site,
            prepared: BTreeMap::new(),
        }
    }

    /// Plans a task from a chain's start, as `posegate plan` does. Returns `None` if the site has no looks.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn plan(
        &mut self,
        from: &str,
        task: &str,
        options: &Options,
    ) -> Result<Option<PlanResult>, PlanError> {
        // One library is enough if the site has its own drive model.
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
