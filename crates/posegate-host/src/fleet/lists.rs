//! What the shards say of themselves and of their pieces.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::build::{EndedPiece, ShardManifest, inventory_name};
use super::digest::{hex, sha256};
use super::error::{FleetError, NAMED};
use super::inventory::Inventory;
use super::piece::{FORMAT, Piece};
use super::shard::Shard;
use super::store::{Store, parsed};
use crate::site::Site;

/// A shard's list with the name of its file.
pub(super) type NamedList = (String, ShardManifest);

/// The lists of all shards, in order: one site, one recipe, one number, none missing. Where a site is given, lists of others
/// are left out; and where all that is left is of one recipe, whose results are the same for any number of shards, one number of
/// shards that is complete is enough.
pub(super) fn shards(
    store: &Store,
    output: &Path,
    site: Option<&Site>,
) -> Result<Vec<NamedList>, FleetError> {
    let mut found = read(store)?;
    let Some((_, first)) = found.first() else {
        return Err(FleetError::NoShards(output.into()));
    };
    if let Some(site) = site {
        let digest = hex(&site.digest);
        let parts = first.recipe.site_digest.clone();
        found.retain(|(_, ended)| ended.recipe.site_digest == digest);
        if found.is_empty() {
            return Err(FleetError::OtherSite {
                parts,
                site: digest,
            });
        }
        let sets = sets(&found);
        let recipe = |set: &Set<'_>| {
            let first = set.lists.first();
            first.map(|(_, ended)| (ended.recipe.clone(), ended.inventory.clone()))
        };
        let alike = sets.windows(2).all(|two| match two {
            [one, other] => recipe(one) == recipe(other),
            _ => true,
        });
        let complete = sets.iter().find(|set| set.is_complete());
        if let Some(one) = complete.filter(|_| alike) {
            let own: BTreeSet<String> = one.lists.iter().map(|(name, _)| name.clone()).collect();
            found.retain(|(name, _)| own.contains(name));
        }
    }
    alike(&found)?;
    none_missing(&found)?;
    Ok(found)
}

/// Every list in the folder, by numbers of shards, then by shards.
fn read(store: &Store) -> Result<Vec<NamedList>, FleetError> {
    let mut found: Vec<NamedList> = Vec::new();
    for name in store.names()? {
        if !(name.starts_with("shard-") && name.ends_with(".json")) {
            continue;
        }
        let path = store.path(&name);
        let bytes = store.read(&name)?.unwrap_or_default();
        let ended: ShardManifest = parsed(&bytes, &path)?;
        let own = Shard::new(ended.shard, ended.of).map(ShardManifest::name);
        if ended.format != FORMAT || own.as_deref() != Ok(&name) {
            return Err(FleetError::Damaged {
                path,
                why: "is not what a shard of this name writes".into(),
            });
        }
        found.push((name, ended));
    }
    found.sort_by_key(|(_, ended)| (ended.of, ended.shard));
    Ok(found)
}

/// Lists that belong together.
struct Set<'a> {
    lists: Vec<&'a NamedList>,
}

impl Set<'_> {
    fn is_complete(&self) -> bool {
        let of = self.lists.first().map(|(_, ended)| ended.of as usize);
        // A list has the name of its shard and number: there are no two of one.
        of == Some(self.lists.len())
    }

    /// In words: how many shards, of which site, and which lists.
    fn told(&self) -> String {
        let Some((_, first)) = self.lists.first() else {
            return String::new();
        };
        let names: Vec<&str> = self.lists.iter().map(|(name, _)| name.as_str()).collect();
        let (named, others) = names.split_at(names.len().min(NAMED));
        let more = match others.len() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        format!(
            "{} of {} shards of the site {}: {}{more}",
            names.len(),
            first.of,
            first.recipe.site_digest.get(..12).unwrap_or_default(),
            named.join(", "),
        )
    }
}

/// The lists by what they must have in common.
fn sets(found: &[NamedList]) -> Vec<Set<'_>> {
    let mut sets: Vec<Set<'_>> = Vec::new();
    for list in found {
        let (_, ended) = list;
        let own = sets.iter_mut().find(|set| {
            set.lists.first().is_some_and(|(_, other)| {
                ended.of == other.of
                    && ended.recipe == other.recipe
                    && ended.inventory == other.inventory
            })
        });
        match own {
            Some(set) => set.lists.push(list),
            None => sets.push(Set {
                lists: std::vec![list],
            }),
        }
    }
    sets
}

/// One number of shards, one site, one recipe: or what there is, to choose from.
fn alike(found: &[NamedList]) -> Result<(), FleetError> {
    let Some((first, of)) = found.first() else {
        return Ok(());
    };
    let told = || sets(found).iter().map(Set::told).collect();
    // What is left of another number of shards is stale: no shard that is built again replaces it.
    if let Some((name, _)) = found.iter().find(|(_, ended)| ended.of != of.of) {
        return Err(FleetError::MixedCounts {
            one: first.clone(),
            other: name.clone(),
            sets: told(),
        });
    }
    let other = |ended: &ShardManifest| ended.recipe.site_digest != of.recipe.site_digest;
    if let Some((name, ended)) = found.iter().find(|(_, ended)| other(ended)) {
        return Err(FleetError::MixedSites {
            one: (first.clone(), of.recipe.site_digest.clone()),
            other: (name.clone(), ended.recipe.site_digest.clone()),
            sets: told(),
        });
    }
    let other =
        |ended: &ShardManifest| of.recipe != ended.recipe || of.inventory != ended.inventory;
    match found.iter().find(|(_, ended)| other(ended)) {
        Some((name, _)) => Err(FleetError::MixedRecipes {
            one: first.clone(),
            other: name.clone(),
            sets: told(),
        }),
        None => Ok(()),
    }
}

fn none_missing(found: &[NamedList]) -> Result<(), FleetError> {
    let of = found.first().map_or(0, |(_, ended)| ended.of);
    let there: BTreeSet<u32> = found.iter().map(|(_, ended)| ended.shard).collect();
    let missing = || (0..of).filter(|index| !there.contains(index));
    let first: Vec<String> = missing()
        .take(NAMED)
        .map(|index| format!("{index}/{of}"))
        .collect();
    if first.is_empty() {
        return Ok(());
    }
    Err(FleetError::Gap {
        count: missing().count(),
        first,
    })
}

/// All pieces of the site, as every shard had them; those of `site` where one is given.
pub(super) fn inventory(
    store: &Store,
    shards: &[NamedList],
    site: Option<&Site>,
) -> Result<Inventory, FleetError> {
    let of = shards.first().map(|(_, ended)| ended);
    let name = inventory_name(of.map_or("", |ended| &ended.inventory));
    let path = store.path(&name);
    let damaged = |why: &str| FleetError::Damaged {
        path: path.clone(),
        why: why.into(),
    };
    let bytes = store.read(&name)?;
    let bytes = bytes.ok_or_else(|| damaged("is missing: every shard writes it"))?;
    if inventory_name(&sha256(&bytes)) != name {
        return Err(damaged("was changed"));
    }
    let inventory: Inventory = parsed(&bytes, &path)?;
    if of.is_none_or(|ended| ended.recipe != inventory.recipe) {
        return Err(damaged("is of another site"));
    }
    if site.is_some_and(|site| Inventory::of(site, inventory.recipe.clone()) != inventory) {
        return Err(damaged(
            "does not list the pieces of the site that is named",
        ));
    }
    Ok(inventory)
}

/// A piece, and what its shard says of it.
pub(super) type ListedPiece<'a> = (&'a Piece, &'a EndedPiece);

/// What the shards say of each piece: each is listed once, by the shard whose share it is.
pub(super) fn listed<'a>(
    shards: &'a [NamedList],
    inventory: &'a Inventory,
) -> Result<Vec<ListedPiece<'a>>, FleetError> {
    let mut by_key: BTreeMap<&str, Vec<(usize, &EndedPiece)>> = BTreeMap::new();
    for (shard, (_, ended)) in shards.iter().enumerate() {
        for piece in &ended.pieces {
            by_key.entry(&piece.key).or_default().push((shard, piece));
        }
    }
    let count = shards.len();
    let name = |shard: usize| shards.get(shard).map_or("", |(name, _)| name).into();
    let (mut all, mut missing) = (Vec::new(), Vec::new());
    for (number, piece) in inventory.pieces().iter().enumerate() {
        let key = piece.key(&inventory.recipe);
        let own = inventory.owner(number, count);
        match by_key.remove(key.as_str()).as_deref() {
            None => missing.push(format!("{piece}: shard {own}/{count} does not list it")),
            Some([(shard, ended)]) if *shard == own => all.push((piece, *ended)),
            Some(listed) => {
                return Err(FleetError::Overlap {
                    piece: piece.clone(),
                    own: name(own),
                    by: listed.iter().map(|(shard, _)| name(*shard)).collect(),
                });
            }
        }
    }
    if !missing.is_empty() {
        return Err(FleetError::Missing(missing));
    }
    // What is no piece of the site.
    let other = by_key.into_values().flatten().next();
    if let Some((shard, piece)) = other {
        let name: String = name(shard);
        return Err(FleetError::Damaged {
            path: name.into(),
            why: format!("lists {}, which is no piece of the site", piece.key),
        });
    }
    Ok(all)
}
