//! The printed images of AprilTags.
//!
//! The codes are those of the families' definitions in the AprilTag 3 library, one hexadecimal number per tag: the image's data
//! bits row by row from the upper left, white is 1.

/// The data bits of a tag, `true` is white: rows from the top, as a viewer sees the upright tag.
pub(super) type Bits = Vec<Vec<bool>>;

const CODES: [(&str, usize, &str); 3] = [
    ("tag16h5", 4, include_str!("tag_codes/tag16h5.txt")),
    ("tag25h9", 5, include_str!("tag_codes/tag25h9.txt")),
    ("tag36h11", 6, include_str!("tag_codes/tag36h11.txt")),
];

/// Returns the data bits of a tag, without the black border; `None` if the image of its family is not known, or the family
/// has no such tag.
#[must_use]
pub(super) fn bits(family: &str, id: u32) -> Option<Bits> {
    let (_, edge, codes) = CODES.into_iter().find(|(name, ..)| *name == family)?;
    let code = codes.lines().nth(usize::try_from(id).ok()?)?;
    let code = u64::from_str_radix(code, 16).ok()?;
    let bit = |row: usize, column: usize| code >> (edge * edge - 1 - edge * row - column) & 1 == 1;
    let row = |row: usize| (0..edge).map(|column| bit(row, column)).collect();
    Some((0..edge).map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate::shape::Family;

    fn turned(bits: &Bits) -> Bits {
        let edge = bits.len();
        let at = |row: usize, column: usize| bits[column][edge - 1 - row];
        let row = |row: usize| (0..edge).map(|column| at(row, column)).collect();
        (0..edge).map(row).collect()
    }

    fn differing(a: &Bits, b: &Bits) -> usize {
        let pairs = a.iter().flatten().zip(b.iter().flatten());
        pairs.filter(|(a, b)| a != b).count()
    }

    /// The name of a family states the least number of bits by which any two of its tags differ, in every rotation. A
    /// mistyped code would be closer to another code.
    #[test]
    fn tags_differ_by_at_least_the_family_distance() {
        for (family, least) in [("tag16h5", 5), ("tag25h9", 9), ("tag36h11", 11)] {
            let count = Family::named(family).unwrap().tags;
            let all: Vec<Bits> = (0..count).map(|id| bits(family, id).unwrap()).collect();
            assert_eq!(bits(family, count), None, "{family}");
            let mut nearest = usize::MAX;
            for (number, one) in all.iter().enumerate() {
                let mut turn = one.clone();
                for quarter in 0..4 {
                    for (other, bits) in all.iter().enumerate().skip(number) {
                        if other != number || quarter > 0 {
                            nearest = nearest.min(differing(&turn, bits));
                        }
                    }
                    turn = turned(&turn);
                }
            }
            assert_eq!(nearest, least, "{family}");
        }
    }

    /// The first tag of the family as printed: its data bits from the upper left.
    #[test]
    fn first_tag_equals_the_printed_one() {
        let rows: Vec<String> = bits("tag36h11", 0)
            .unwrap()
            .iter()
            .map(|row| row.iter().map(|w| if *w { '1' } else { '0' }).collect())
            .collect();
        assert_eq!(
            rows,
            ["110101", "011101", "011000", "101000", "010110", "000100"]
        );
        assert_eq!(bits("tagStandard41h12", 0), None);
    }
}
