//! Records of the shards in a folder: each shard records the inventory whose part it makes.

use std::io;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::digest::{hex, sha256, sha256_of_file};
use super::error::{MAX_NAMED, SiteBuildError};
use super::inventory::Inventory;
use super::piece::{FORMAT, Recipe};
use super::shard::Shard;
use super::store::{Store, fault, json, parsed};
use posegate_site::Site;

/// The record of a shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct ShardRecord {
    format: u32,
    recipe: Recipe,
    /// SHA-256 of the inventory, from which its file name is made.
    inventory: String,
}

/// The common record of one or more shards.
struct Build {
    record: ShardRecord,
    shards: Vec<Shard>,
}

fn record_name(shard: Shard) -> String {
    format!("shard-{}-of-{}.json", shard.index(), shard.count())
}

fn inventory_name(sha256: &str) -> String {
    format!("inventory-{sha256}.json")
}

/// Writes the record of a shard, and the inventory unless it exists.
pub(super) fn write(
    parts: &Store,
    inventory: &Inventory,
    shard: Shard,
) -> Result<(), SiteBuildError> {
    let digest = sha256_of_json(inventory).map_err(fault(parts.folder()))?;
    let name = inventory_name(&digest);
    if sha256_of_file(&parts.path(&name)).ok().as_ref() != Some(&digest) {
        parts.write_json(&name, inventory)?;
    }
    let record = ShardRecord {
        format: FORMAT,
        recipe: inventory.recipe.clone(),
        inventory: digest,
    };
    parts.write_json(&record_name(shard), &record)
}

/// Returns the inventory that all shards record, and their number if it is the same for all. If a site is given,
/// shards of other sites are ignored, and the inventory must list the pieces of this site.
///
/// # Errors
/// [`SiteBuildError::NoShards`], [`SiteBuildError::OtherSite`], [`SiteBuildError::Mixed`] and [`SiteBuildError::Damaged`].
pub(super) fn inventory(
    parts: &Store,
    site: Option<&Site>,
) -> Result<(Inventory, Option<u32>), SiteBuildError> {
    let mut builds = builds(parts)?;
    let Some(first) = builds.first() else {
        return Err(SiteBuildError::NoShards(parts.folder().into()));
    };
    if let Some(site) = site {
        let digest = hex(&site.digest);
        let other = first.record.recipe.site_digest.clone();
        builds.retain(|build| build.record.recipe.site_digest == digest);
        if builds.is_empty() {
            return Err(SiteBuildError::OtherSite {
                parts: other,
                site: digest,
            });
        }
    }
    let [Build { record, shards }] = builds.as_slice() else {
        return Err(mixed(&builds));
    };
    let count = shards.first().map(|shard| shard.count());
    let count = count.filter(|count| shards.iter().all(|shard| shard.count() == *count));
    Ok((read_inventory(parts, record, site)?, count))
}

/// Returns all builds that shards record, in the order of their names.
fn builds(parts: &Store) -> Result<Vec<Build>, SiteBuildError> {
    let mut builds: Vec<Build> = Vec::new();
    for name in parts.names()? {
        let Some(shard) = name
            .strip_prefix("shard-")
            .and_then(|rest| rest.strip_suffix(".json"))
        else {
            continue;
        };
        let path = parts.path(&name);
        let bytes = parts.read(&name)?.unwrap_or_default();
        let record: ShardRecord = parsed(&bytes, &path)?;
        let shard = shard.replacen("-of-", "/", 1).parse().ok();
        let own = shard.filter(|shard| record.format == FORMAT && record_name(*shard) == name);
        let Some(shard) = own else {
            return Err(SiteBuildError::Damaged {
                path,
                why: "is not what a shard of this name writes".into(),
            });
        };
        match builds.iter_mut().find(|build| build.record == record) {
            Some(build) => build.shards.push(shard),
            None => builds.push(Build {
                record,
                shards: vec![shard],
            }),
        }
    }
    Ok(builds)
}

/// Returns the error that names the shards of each build.
fn mixed(builds: &[Build]) -> SiteBuildError {
    let builds = builds.iter().map(|Build { record, shards }| {
        let named = shards.iter().take(MAX_NAMED);
        let mut names: Vec<String> = named.map(|shard| record_name(*shard)).collect();
        if shards.len() > MAX_NAMED {
            names.push(format!("{} more", shards.len() - MAX_NAMED));
        }
        let plans = match record.recipe.plans {
            Some(_) => "with plans",
            None => "tables only",
        };
        format!(
            "site {:.12}, program {:.12}, {plans}, inventory {:.12}: {}",
            record.recipe.site_digest,
            record.recipe.program,
            record.inventory,
            names.join(", "),
        )
    });
    SiteBuildError::Mixed(builds.collect())
}

/// Returns the inventory of a record, compared with the pieces of `site`.
fn read_inventory(
    parts: &Store,
    record: &ShardRecord,
    site: Option<&Site>,
) -> Result<Inventory, SiteBuildError> {
    let name = inventory_name(&record.inventory);
    let path = parts.path(&name);
    let damaged = |why: &str| SiteBuildError::Damaged {
        path: path.clone(),
        why: why.into(),
    };
    let bytes = parts.read(&name)?;
    let bytes = bytes.ok_or_else(|| damaged("is missing: every shard writes it"))?;
    if sha256(&bytes) != record.inventory {
        return Err(damaged("was changed"));
    }
    let inventory: Inventory = parsed(&bytes, &path)?;
    if inventory.recipe != record.recipe {
        return Err(damaged("is of another site"));
    }
    if site.is_some_and(|site| Inventory::new(site, inventory.recipe.clone()) != inventory) {
        return Err(damaged(
            "does not list the pieces of the site that is named",
        ));
    }
    Ok(inventory)
}

/// Returns the SHA-256 of a value as [`json`] writes it.
fn sha256_of_json(value: &impl Serialize) -> io::Result<String> {
    let mut digest = Sha256::new();
    json(&mut digest, value)?;
    Ok(hex(&digest.finalize()))
}
