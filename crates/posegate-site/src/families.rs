//! The families of tags that have a known name.

/// The names of the families that [`Family::named`](posegate::shape::Family::named) knows.
pub const FAMILIES: [&str; 9] = [
    "tag16h5",
    "tag25h9",
    "tag36h10",
    "tag36h11",
    "tagCircle21h7",
    "tagCircle49h12",
    "tagCustom48h12",
    "tagStandard41h12",
    "tagStandard52h13",
];

/// Returns the number of bits along the outer edge of a family's border (`width_at_border` of its
/// definition).
pub(super) fn family_bits(family: &str) -> Option<u32> {
    Some(match family {
        "tag36h11" | "tag36h10" => 8,
        "tag25h9" => 7,
        "tag16h5" | "tagCustom48h12" | "tagStandard52h13" => 6,
        "tagStandard41h12" | "tagCircle21h7" | "tagCircle49h12" => 5,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::{FAMILIES, family_bits};
    use posegate::shape::Family;

    #[test]
    fn listed_families_are_known() {
        let is_known = |name: &&str| Family::named(name).is_some() && family_bits(name).is_some();
        assert!(FAMILIES.iter().all(is_known));
    }
}
