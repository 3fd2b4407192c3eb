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

/// Returns the known family that a name means: `tag36h11` for `36h11` and for `apriltag3_36h11_classic`, `tagStandard41h12` for `standard41h12`.
pub(super) fn meant_family(name: &str) -> Option<&'static str> {
    let lower = name.to_ascii_lowercase();
    let is_decoration = |part: &&str| *part == "classic" || part.starts_with("apriltag");
    let parts = lower.split('_').filter(|part| !is_decoration(part));
    let bare: String = parts.collect();
    let bare = bare.strip_prefix("tag").unwrap_or(&bare);
    let is_meant = |family: &&&str| {
        let known = family.strip_prefix("tag").unwrap_or(family);
        known.eq_ignore_ascii_case(bare)
    };
    FAMILIES.iter().find(is_meant).copied()
}

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
    use super::{FAMILIES, family_bits, meant_family};
    use posegate::shape::Family;

    #[test]
    fn listed_families_are_known() {
        let is_known = |name: &&str| Family::named(name).is_some() && family_bits(name).is_some();
        assert!(FAMILIES.iter().all(is_known));
    }

    #[test]
    fn names_of_other_programs_are_meant() {
        for (name, family) in [
            ("apriltag3_36h11_classic", Some("tag36h11")),
            ("apriltag2_16h5_classic", Some("tag16h5")),
            ("25h9", Some("tag25h9")),
            ("Tag36h11", Some("tag36h11")),
            ("standard41h12", Some("tagStandard41h12")),
            ("apriltag3_Circle49h12", Some("tagCircle49h12")),
            ("aruco_4x4", None),
            ("", None),
        ] {
            assert_eq!(meant_family(name), family, "{name}");
        }
    }
}
