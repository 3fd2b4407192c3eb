//! The frame of a report's numbers.

/// A frame, as the digest of its name (64-bit FNV-1a; a leading `/` is dropped, as ROS 1 wrote it).
///
/// Numbers of another frame look as valid as those of the right one. So a gate denies a report whose frame differs
/// from the declared frame of its source. Two names have the same digest with a probability
/// of 2^-64.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameId(u64);

impl FrameId {
    /// No frame: the value of an empty name. A source with this frame is refused.
    pub const UNNAMED: Self = Self(0);

    /// Returns the frame with a name, such as `map`.
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

    /// Returns the digest, as C and serial lines carry it.
    #[must_use]
    pub const fn digest(self) -> u64 {
        self.0
    }

    /// Returns a frame from its digest.
    #[must_use]
    pub const fn from_digest(digest: u64) -> Self {
        Self(digest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published check values of FNV-1a (its authors' test vectors).
    #[test]
    fn frame_digest_is_fnv_1a() {
        assert_eq!(FrameId::of("a").digest(), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(FrameId::of("foobar").digest(), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn frame_names_differ_except_one_leading_slash() {
        assert_eq!(FrameId::of("/map"), FrameId::of("map"));
        assert_ne!(FrameId::of("odom"), FrameId::of("map"));
        assert_ne!(FrameId::of("//map"), FrameId::of("map"));
        assert_eq!(FrameId::of(""), FrameId::UNNAMED);
        assert_eq!(FrameId::of("/"), FrameId::UNNAMED);
    }
}
