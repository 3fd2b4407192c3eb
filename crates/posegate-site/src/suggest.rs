//! Finds the known name that is most similar to a misspelt one.

use posegate_files::input::shortened;

/// The longest name that is compared, in bytes, or shown in full, in characters.
const LONGEST: usize = 64;
/// The number of names that are shown.
const MOST: usize = 64;

/// Returns the most similar of the known names; `None` if all are too different.
#[must_use]
pub fn similar<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // No known name is this long, and the comparison's time is the product of both lengths.
    if name.len() > LONGEST {
        return None;
    }
    let allowed = (name.chars().count() / 3).max(1);
    known
        .filter(|candidate| candidate.len() <= LONGEST)
        .map(|candidate| (distance(name, candidate), candidate))
        .filter(|&(distance, _)| distance <= allowed)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// Returns all known names that are as similar as the most similar one, as a question; `None` if all are too
/// different.
pub fn question<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> Option<String> {
    let nearest = distance(name, similar(name, known.clone())?);
    let all = known.filter(|candidate| distance(name, candidate) == nearest);
    let quoted: Vec<String> = all.map(|candidate| format!("`{candidate}`")).collect();
    Some(format!("did you mean {}?", quoted.join(" or ")))
}

/// Returns the names in backticks, separated by commas. The names after the first `MOST` are only counted.
pub(super) fn list<'a>(mut names: impl Iterator<Item = &'a str>) -> String {
    let first = names.by_ref().take(MOST);
    let mut quoted: Vec<String> = first
        .map(|name| format!("`{}`", shortened(name, LONGEST)))
        .collect();
    match names.count() {
        0 => {}
        more => quoted.push(format!("and {more} more")),
    }
    quoted.join(", ")
}

/// Returns the number of insertions, deletions, replacements and swaps of neighbours that turn `a`
/// into `b`. Letter case is ignored.
fn distance(a: &str, b: &str) -> usize {
    strsim::osa_distance(&a.to_lowercase(), &b.to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::{distance, similar};

    #[test]
    fn long_names_are_not_compared() {
        use super::LONGEST;
        let long = "k".repeat(LONGEST + 1);
        assert_eq!(similar(&long, [&*long].into_iter()), None);
        assert_eq!(similar(&long[1..], [&*long].into_iter()), None);
        assert_eq!(
            similar(&long[1..], [&long[2..]].into_iter()),
            Some(&long[2..])
        );
    }

    #[test]
    fn distances_count_edits() {
        assert_eq!(distance("dock", "dock"), 0);
        assert_eq!(distance("dokc", "dock"), 1);
        assert_eq!(distance("", "dock"), 4);
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("FX", "fx"), 0);
    }

    #[test]
    fn only_similar_names_are_suggested() {
        let known = ["dock", "see-t7", "park"];
        assert_eq!(similar("dokc", known.into_iter()), Some("dock"));
        assert_eq!(similar("see-7", known.into_iter()), Some("see-t7"));
        assert_eq!(similar("charge", known.into_iter()), None);
    }
}
