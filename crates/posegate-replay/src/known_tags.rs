//! The tags of a site by family and number, as a detector reports them.

use posegate_site::{Site, SiteTag};
use std::collections::BTreeMap;

/// A tag's family without the prefix `tag`, which some detectors write, and its number.
type Key = (String, i64);

/// Two tags with the same family and number: an image does not distinguish them.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the tags `{first}` and `{second}` have the same family and id, so an image does not show which one is seen: give one another id, or leave one out of the site"
)]
pub struct AlikeTags {
    /// The name of one tag in the site file.
    pub first: String,
    /// The name of the other tag.
    pub second: String,
}

/// The tags of a site that a detection identifies.
#[derive(Clone, Debug, Default)]
pub struct KnownTags {
    tags: BTreeMap<Key, SiteTag>,
    alike: Option<AlikeTags>,
}

impl KnownTags {
    /// Returns the tags of a site. Tags with the same family and number are excluded: see [`Self::alike`].
    #[must_use]
    pub fn of(site: &Site) -> Self {
        let mut named: BTreeMap<Key, Vec<(&String, &SiteTag)>> = BTreeMap::new();
        for (name, tag) in &site.tags {
            let key = key(&tag.family, i64::from(tag.tag.id));
            named.entry(key).or_default().push((name, tag));
        }
        let mut known = Self::default();
        for (key, tags) in named {
            match tags.as_slice() {
                [(_, tag)] => {
                    known.tags.insert(key, (*tag).clone());
                }
                [(first, _), (second, _), ..] => {
                    known.alike.get_or_insert_with(|| AlikeTags {
                        first: (*first).clone(),
                        second: (*second).clone(),
                    });
                }
                [] => {}
            }
        }
        known
    }

    /// Returns the first two tags that were excluded because an image does not distinguish them.
    #[must_use]
    pub const fn alike(&self) -> Option<&AlikeTags> {
        self.alike.as_ref()
    }

    /// Returns the tag of a detection; the prefix `tag` of the family is optional.
    #[must_use]
    pub fn get(&self, family: &str, id: i64) -> Option<&SiteTag> {
        self.tags.get(&key(family, id))
    }

    /// Returns all tags that detections can identify, by family and number.
    pub fn all(&self) -> impl Iterator<Item = &SiteTag> {
        self.tags.values()
    }
}

fn key(family: &str, id: i64) -> Key {
    (family.strip_prefix("tag").unwrap_or(family).to_string(), id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate_site::SAMPLE;

    #[test]
    fn tags_with_equal_family_and_id_are_excluded() {
        let known = |more: &str| {
            let site = Site::parse(&format!("{SAMPLE}\n{more}"), "site.toml").unwrap();
            KnownTags::of(&site)
        };
        let alone = known("");
        assert!(alone.get("tag36h11", 7).is_some() && alone.get("36h11", 7).is_some());
        assert!(alone.get("tag36h11", 8).is_none() && alone.alike().is_none());
        let twin = "[tag.other]\nid = 7\nfamily = \"36h11\"\nsize = 0.3\npose = { x = 9.0, y = 9.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 90.0 }\n";
        let both = known(twin);
        assert!(both.get("tag36h11", 7).is_none() && both.all().count() == 0);
        let equal = both.alike().unwrap();
        assert_eq!([&*equal.first, &*equal.second], ["other", "t7"]);
    }
}
