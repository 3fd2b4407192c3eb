//! The keys of a table of poses, from TOML.

use super::error::SiteError;
use super::reader::Node;
use super::{Extent, Layout, Step, TableSpec, keys};
use posegate::shape::is_arc;

/// The keys of a `table`. Each may be missing: the default is used.
#[derive(Clone, Copy, Default)]
pub(super) struct TableKeys {
    pub extent: Option<Extent>,
    pub step: Option<Step>,
    pub layout: Option<Layout>,
}

impl TableKeys {
    /// Reads the keys of a `table`.
    pub fn read(node: &Node<'_>) -> Result<Self, SiteError> {
        let table = node.table(&[&keys::EXTENT, &keys::STEP, &keys::LAYOUT])?;
        let read = |key| table.optional(key);
        Ok(Self {
            extent: read(&keys::EXTENT).as_ref().map(extent).transpose()?,
            step: read(&keys::STEP).as_ref().map(step).transpose()?,
            layout: read(&keys::LAYOUT).as_ref().map(layout).transpose()?,
        })
    }

    /// Fills missing keys from the defaults.
    pub fn or(self, defaults: &Self) -> Self {
        Self {
            extent: self.extent.or(defaults.extent),
            step: self.step.or(defaults.step),
            layout: self.layout.or(defaults.layout),
        }
    }

    /// Returns the specification; `None` without an extent or a step.
    pub fn complete(self) -> Option<TableSpec> {
        Some(TableSpec {
            extent: self.extent?,
            step: self.step?,
            layout: self.layout.unwrap_or_default(),
        })
    }
}

fn extent(node: &Node<'_>) -> Result<Extent, SiteError> {
    let table = node.table(&[&keys::EXTENT_X, &keys::EXTENT_Y, &keys::EXTENT_YAW])?;
    Ok(Extent {
        x: table.interval(&keys::EXTENT_X, |lo, hi| lo < hi)?,
        y: table.interval(&keys::EXTENT_Y, |lo, hi| lo < hi)?,
        yaw_deg: table.interval(&keys::EXTENT_YAW, |lo, hi| lo < hi && is_arc([lo, hi]))?,
    })
}

fn step(node: &Node<'_>) -> Result<Step, SiteError> {
    let table = node.table(&[&keys::STEP_XY, &keys::STEP_YAW])?;
    Ok(Step {
        xy: table.number(&keys::STEP_XY)?,
        yaw_deg: table.number(&keys::STEP_YAW)?,
    })
}

fn layout(node: &Node<'_>) -> Result<Layout, SiteError> {
    node.among([
        ("facets", Layout::Facets),
        ("grid", Layout::Grid),
        // Older site files say "both" for facets with cells beside them; facets alone decide now.
        ("both", Layout::Facets),
        ("auto", Layout::Facets),
    ])
}
