//! Which frame a report's numbers are in.

/// A frame by the digest of its name (64-bit FNV-1a; a leading `/` is dropped, as ROS 1 wrote it).
///
/// Numbers of another frame look as good as those of the right one, so a gate denies a report whose frame
/// is not the one that its source was declared with. Two names of one digest: a chance of 2^-64.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameId(u64);

impl FrameId {
    /// No frame: what an empty name is. No source can be declared with it.
    pub const UNNAMED: Self = Self(0);

    /// The frame of a name, such as `map`.
    #[must_use]
    pub const fn of(name: &str) -> Self {
        let mut rest = name.as_bytes();
        if let [b'/', after @ ..] = rest {
            rest = after;
        }
        if rest.is_empty() {
            return Self::UNNAMED;
        }
        let mut digest = 0xcbf2_9ce4_8422_2325u64;
        while let [byte, after @ ..] = rest {
            digest = (digest ^ *byte as u64).wrapping_mul(0x100_0000_01b3);
            rest = after;
        }
        Self(digest)
    }

    /// The digest, as C and serial lines carry it.
    #[must_use]
    pub const fn digest(self) -> u64 {
        self.0
    }

    /// A frame from its digest.
    #[must_use]
    pub const fn from_digest(digest: u64) -> Self {
        Self(digest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check values of FNV-1a from outside (its authors' test vectors).
    #[test]
    fn digests_are_fnv_1a() {
        assert_eq!(FrameId::of("a").digest(), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(FrameId::of("foobar").digest(), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn names_are_told_apart() {
        assert_eq!(FrameId::of("/map"), FrameId::of("map"));
        assert_ne!(FrameId::of("odom"), FrameId::of("map"));
        assert_ne!(FrameId::of("//map"), FrameId::of("map"));
        assert_eq!(FrameId::of(""), FrameId::UNNAMED);
        assert_eq!(FrameId::of("/"), FrameId::UNNAMED);
    }
}
