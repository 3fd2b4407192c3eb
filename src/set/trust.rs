//! The trust in a source of estimates: the inflation of its covariance, and which of its terms it fills.

use super::RadiusSquared;
use crate::num::{Divisor, FloatUnit, Rounding, converted, sqrt_ceil};

/// The factor by which a source's covariance is multiplied before use, unit 2^-16.
///
/// At least 1: an inflation can only make the gate stricter. At most 4096 (a filter whose deviations are 64
/// times too small is useless). Learnt from recordings, or 1 if the source is honest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inflation(u32);

impl Inflation {
    /// The covariance is used unchanged.
    pub const NONE: Self = Self(1 << 16);

    /// Returns a factor, rounded up to 2^-16. `None` unless it is a number from 1 to 4096.
    #[must_use]
    pub fn new(factor: f64) -> Option<Self> {
        // A factor slightly below 1 would be rounded up to 1, so it is refused here. (A negative number is
        // not a `u32`.)
        if factor.to_bits() < 1f64.to_bits() {
            return None;
        }
        let raw = converted(factor, &FloatUnit::new(1 << 16, 0), Rounding::AwayFromZero).ok()?;
        Self::from_q16(u32::try_from(raw).ok()?)
    }

    /// Returns a factor from units of 2^-16. `None` unless it is from 1 to 4096.
    #[must_use]
    pub const fn from_q16(raw: u32) -> Option<Self> {
        if raw >= 1 << 16 && raw <= 1 << 28 {
            Some(Self(raw))
        } else {
            None
        }
    }

    /// Returns the factor in units of 2^-16.
    #[must_use]
    pub const fn q16(self) -> u32 {
        self.0
    }

    /// Returns the product of two factors, rounded up. `None` if it is beyond 4096.
    #[must_use]
    pub(crate) fn times(self, other: Self) -> Option<Self> {
        let product = u64::from(self.0)
            .wrapping_mul(u64::from(other.0))
            .wrapping_add(0xffff)
            >> 16;
        Self::from_q16(u32::try_from(product).ok()?)
    }

    /// Returns a length below 2^40 times the factor's root, rounded up.
    pub(super) fn of_length(self, length: i64) -> i64 {
        if self == Self::NONE {
            return length;
        }
        // The root, unit 2^-16: at most 2^22.
        let root = sqrt_ceil(u64::from(self.0) << 16);
        let product = length.saturating_mul(root);
        (product.saturating_add((1 << 16) - 1)) >> 16
    }
}

/// The share w of the plane in a pose-set's spread, if the terms between plane and yaw are unknown:
/// `diag(P_xy / w, P_yaw / (1 - w))` dominates every P with these blocks, for each w between 0 and 1. A
/// larger share keeps the plane tighter and the yaw looser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SplitWeight(u8);

impl SplitWeight {
    /// Both blocks doubled.
    pub const HALF: Self = Self(128);

    /// Returns a share from units of 1/256, or `None` for 0.
    #[must_use]
    pub const fn from_q8(raw: u8) -> Option<Self> {
        if raw == 0 { None } else { Some(Self(raw)) }
    }

    /// Returns the share in units of 1/256.
    #[must_use]
    pub const fn q8(self) -> u8 {
        self.0
    }
}

/// The share 1, times 256.
const WHOLE: u16 = 256;

/// The terms of its covariance that a source fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CrossTerms {
    /// All terms.
    Filled,
    /// All but those between yaw and plane (AMCL): the values there are ignored.
    YawUnknown(SplitWeight),
    /// Only the variances (such as a landing target's): the values between x, y and yaw are ignored. The
    /// plane's share is split evenly between x and y, in whole units of 1/256 and at least one each; yaw has
    /// the rest.
    AllUnknown(SplitWeight),
}

impl CrossTerms {
    /// Returns a covariance with the unfilled terms set to zero.
    pub(super) const fn of(self, covariance: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
        let [[xx, xy, _], [yx, yy, _], [_, _, tt]] = covariance;
        match self {
            Self::Filled => covariance,
            Self::YawUnknown(_) => [[xx, xy, 0.0], [yx, yy, 0.0], [0.0, 0.0, tt]],
            Self::AllUnknown(_) => [[xx, 0.0, 0.0], [0.0, yy, 0.0], [0.0, 0.0, tt]],
        }
    }

    /// Returns the denominators of the shares of plane and yaw, times 256. For unknown terms, the shares add
    /// up to at most 1 (x, y and yaw each count if all terms are unknown).
    const fn shares(self) -> (u16, u16) {
        let (plane, yaw) = match self {
            Self::Filled => return (WHOLE, WHOLE),
            Self::YawUnknown(SplitWeight(w)) => (w as u16, 256u16.wrapping_sub(w as u16)),
            Self::AllUnknown(SplitWeight(w)) => {
                let each = if w < 2 { 1 } else { (w >> 1) as u16 };
                (each, WHOLE.wrapping_sub(each << 1))
            }
        };
        (plane, yaw)
    }
}

/// The trust in a source's covariance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Trust {
    /// The factor by which the source's covariances are multiplied.
    pub inflation: Inflation,
    /// The terms of the covariance that the source fills.
    pub cross_terms: CrossTerms,
}

impl Trust {
    /// The covariance is used unchanged.
    pub const FULL: Self = Self {
        inflation: Inflation::NONE,
        cross_terms: CrossTerms::Filled,
    };

    /// Returns `true` if every number is in its range. A bit flip in memory can make it invalid.
    #[must_use]
    pub const fn is_valid(self) -> bool {
        Inflation::from_q16(self.inflation.0).is_some()
    }
}

/// A squared radius with inflation and shares: `mantissa * 2^-down`, rounded up, with 24 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Scaled {
    mantissa: u32,
    down: i32,
}

impl Scaled {
    /// Returns `radius * inflation / (share / 256)`.
    fn of(radius_squared: RadiusSquared, inflation: Inflation, share: u16) -> Self {
        // Below 2^24 * 2^28, unit 2^-32; times 2^8, divided by a share in units of 2^-8.
        let product = u64::from(radius_squared.q16()).wrapping_mul(u64::from(inflation.0));
        let quotient = match Divisor::new(i64::from(share)) {
            Some(by) if share < WHOLE => by.ceil((product << 8) as i64).unsigned_abs(),
            _ => product,
        };
        // Unit 2^-16 if 24 bits are enough.
        let by = 40u32.saturating_sub(quotient.leading_zeros()).max(16);
        let up = 1u64.wrapping_shl(by).wrapping_sub(1);
        let mut mantissa = quotient.saturating_add(up).wrapping_shr(by);
        let mut down = 32i32.wrapping_sub(by as i32);
        if mantissa >> 24 != 0 {
            // Rounded up to 2^24.
            mantissa >>= 1;
            down = down.wrapping_sub(1);
        }
        Self {
            mantissa: mantissa as u32,
            down,
        }
    }

    /// Returns the same number with 32 bits.
    pub(super) const fn with_32_bits(self) -> Self {
        let up = self.mantissa.leading_zeros() & 31;
        Self {
            mantissa: self.mantissa.wrapping_shl(up),
            down: self.down.wrapping_add(up as i32),
        }
    }

    pub(super) const fn mantissa(self) -> u32 {
        self.mantissa
    }

    pub(super) const fn down(self) -> i32 {
        self.down
    }
}

/// The squared radii of a set in the plane and in yaw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reach {
    pub plane: Scaled,
    pub yaw: Scaled,
}

impl Reach {
    #[inline]
    pub(super) fn of(radius_squared: RadiusSquared, trust: Trust) -> Self {
        if trust == Trust::FULL {
            let whole = Scaled {
                mantissa: radius_squared.q16(),
                down: 16,
            };
            return Self {
                plane: whole,
                yaw: whole,
            };
        }
        let (plane, yaw) = trust.cross_terms.shares();
        let scaled = |share| Scaled::of(radius_squared, trust.inflation, share);
        Self {
            plane: scaled(plane),
            yaw: scaled(yaw),
        }
    }
}
