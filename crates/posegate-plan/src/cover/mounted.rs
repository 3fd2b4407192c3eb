//! Converts the chosen candidates to tags.

use std::collections::{BTreeMap, BTreeSet};

use super::CoverError;
use super::tags::Tags;
use posegate::shape::{Exclusion, Family, Shape, Visibility};
use posegate_site::{Site, SiteTag};

/// Returns the chosen candidates as tags, by number. A candidate without an id gets the least free id of its family,
/// if there is one.
pub(super) fn mounted_tags(
    site: &Site,
    names: &[&String],
    chosen: &Tags,
) -> Result<BTreeMap<usize, (String, SiteTag)>, CoverError> {
    let family = |tag: &SiteTag| tag.family.clone();
    let mounted = site.tags.values().map(|tag| (family(tag), tag.tag.id));
    let given = site.candidates.values();
    let given = given.filter_map(|found| Some((family(&found.tag), found.id?)));
    let mut taken: BTreeSet<(String, u32)> = mounted.chain(given).collect();
    chosen
        .iter()
        .map(|number| {
            let name = names[number];
            let found = &site.candidates[name];
            let mut tag = found.tag.clone();
            if found.id.is_none() {
                let known = Family::named(&tag.family);
                let mut all = 0..known.map_or(u32::MAX, |family| family.tags);
                let free = all.find(|id| !taken.contains(&(family(&tag), *id)));
                tag.tag.id = free.ok_or_else(|| CoverError::NoNumber(name.to_string()))?;
                taken.insert((family(&tag), tag.tag.id));
            }
            Ok((number, (name.to_string(), tag)))
        })
        .collect()
}

/// Returns the site with the chosen tags, without candidates.
pub(super) fn with_tags(site: &Site, chosen: &BTreeMap<usize, (String, SiteTag)>) -> Site {
    let mut with = site.clone();
    with.candidates.clear();
    let offers = core::mem::take(&mut with.planner.offers);
    for (name, tag) in chosen.values() {
        for (look, made) in offers.iter().filter(|(_, made)| made.tag == *name) {
            let mut made = made.clone();
            number(&mut made.success.shape, tag.tag.id);
            with.planner.looks.insert(look.clone(), made);
        }
        with.tags.insert(name.clone(), tag.clone());
    }
    with
}

/// Sets the tag's id in every view of a set.
fn number(shape: &mut Shape, id: u32) {
    let look = |view: &mut Visibility| view.tag.id = id;
    match shape {
        Shape::Visibility(view)
        | Shape::Bounded { view, .. }
        | Shape::Apart(
            Exclusion::Near { view, .. }
            | Exclusion::Square { view, .. }
            | Exclusion::Hidden { view, .. },
        ) => look(view),
        Shape::Any(sets) | Shape::All(sets) => {
            for set in sets {
                number(set, id);
            }
        }
        Shape::Box(_) | Shape::Footprint(_) | Shape::Apart(_) => {}
    }
}
