//! Did you mean: the known name that is most like a misspelt one.

use std::string::String;
use std::vec::Vec;
use std::{format, vec};

/// The most similar of the known names, unless all are too different to be meant.
pub(super) fn similar<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let allowed = (name.chars().count() / 3).max(1);
    known
        .map(|candidate| (distance(name, candidate), candidate))
        .filter(|&(distance, _)| distance <= allowed)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// The names in backticks, separated by commas.
pub(super) fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = names.map(|name| format!("`{name}`")).collect();
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
