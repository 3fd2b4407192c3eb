//! Did you mean: the known name that is most like a misspelt one.

use crate::input::shortened;

/// The longest name that is compared or shown whole, bytes or characters.
const LONGEST: usize = 64;
/// So many names are shown.
const MOST: usize = 64;

/// The most similar of the known names, unless all are too different to be meant.
pub(super) fn similar<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // No name is so long, and the comparison takes the product of both lengths.
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

/// The names in backticks, separated by commas; of many the first ones.
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

/// Insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`, letter case
/// aside.
fn distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.to_lowercase().chars().collect();
    let b: Vec<char> = b.to_lowercase().chars().collect();
    let width = b.len() + 1;
    let mut cost = vec![0_usize; (a.len() + 1) * width];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            cost[i * width + j] = if i == 0 || j == 0 {
                i + j
            } else {
                let replaced = cost[(i - 1) * width + j - 1] + usize::from(a[i - 1] != b[j - 1]);
                let removed = cost[(i - 1) * width + j] + 1;
                let added = cost[i * width + j - 1] + 1;
                let swapped = if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                    cost[(i - 2) * width + j - 2] + 1
                } else {
                    usize::MAX
                };
                replaced.min(removed).min(added).min(swapped)
            };
        }
    }
    cost[a.len() * width + b.len()]
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
