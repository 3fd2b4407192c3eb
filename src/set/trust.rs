//! How far a source of estimates is trusted: by how much its covariance is inflated, and which of its
//! terms it fills.

use super::RadiusSquared;
use crate::num::{Divisor, Float, Rounding, sqrt_ceil};

/// The factor by which a source's covariance is multiplied before it is believed, unit 2^-16.
///
/// At least 1: an inflation can only make the gate stricter. At most 4096 (a filter whose deviations are
/// 64 times too small is no filter). Learnt from recordings, or 1 where the source is honest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inflation(u32);

impl Inflation {
    /// The covariance as it is.
    pub const NONE: Self = Self(1 << 16);

    /// A factor, rounded up to 2^-16. `None` unless it is a number from 1 to 4096.
    #[must_use]
    pub fn new(factor: f64) -> Option<Self> {
        // What is below 1 would be rounded up to it. (A negative number is no `u32`.)
        if factor.to_bits() < 1f64.to_bits() {
            return None;
        }
        let raw = Float::of(factor)?.scaled(1 << 16, 0, Rounding::AwayFromZero)?;
        Self::from_q16(u32::try_from(raw).ok()?)
    }

    /// A factor in units of 2^-16. `None` unless it is from 1 to 4096.
    #[must_use]
    pub const fn from_q16(raw: u32) -> Option<Self> {
        if raw >= 1 << 16 && raw <= 1 << 28 {
            Some(Self(raw))
        } else {
            None
        }
    }

    /// The factor in units of 2^-16.
    #[must_use]
    pub const fn q16(self) -> u32 {
        self.0
    }

    /// A length below 2^40 times the factor's root, up.
    pub(super) fn of_length(self, length: i64) -> i64 {
        // The root, unit 2^-16: at most 2^22.
        let root = sqrt_ceil(u64::from(self.0) << 16);
        let product = length.saturating_mul(root);
        (product.saturating_add((1 << 16) - 1)) >> 16
    }
}

/// The share w of a pose-set's spread that is left to the plane where the terms between plane and yaw are
/// unknown: `diag(P_xy / w, P_yaw / (1 - w))` dominates every P with these blocks, for each w between 0
/// and 1. A larger share keeps the plane tighter and the yaw looser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SplitWeight(u8);

impl SplitWeight {
    /// Both blocks doubled.
    pub const HALF: Self = Self(128);

    /// A share in units of 1/256. `None` for 0.
    #[must_use]
    pub const fn from_q8(raw: u8) -> Option<Self> {
        if raw == 0 { None } else { Some(Self(raw)) }
    }

    /// The share in units of 1/256.
    #[must_use]
    pub const fn q8(self) -> u8 {
        self.0
    }
}

/// A share of all there is, times 256.
const WHOLE: u16 = 256;

/// Which terms of its covariance a source fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CrossTerms {
    /// All of them.
    Filled,
    /// None between yaw and plane (AMCL): what stands there is not looked at.
    YawUnknown(SplitWeight),
    /// Variances alone (a landing target's): what stands between x, y and yaw is not looked at. The
    /// plane's share is split evenly between x and y, in whole units of 1/256 and at least one each; yaw has
    /// the rest.
    AllUnknown(SplitWeight),
}

impl CrossTerms {
    /// A covariance with the terms that are not filled set to zero.
    pub(super) const fn of(self, covariance: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
        let [[xx, xy, _], [yx, yy, _], [_, _, tt]] = covariance;
        match self {
            Self::Filled => covariance,
            Self::YawUnknown(_) => [[xx, xy, 0.0], [yx, yy, 0.0], [0.0, 0.0, tt]],
            Self::AllUnknown(_) => [[xx, 0.0, 0.0], [0.0, yy, 0.0], [0.0, 0.0, tt]],
        }
    }

    /// Denominators of the shares of plane and yaw, times 256. Those of all that is unknown together, x, y
    /// and yaw where it is each of them, make up no more than the whole.
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

/// How far a source is trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Trust {
    /// By how much its covariance is inflated.
    pub inflation: Inflation,
    /// Which terms it fills.
    pub cross_terms: CrossTerms,
}

impl Trust {
    /// The covariance is believed as it is.
    pub const FULL: Self = Self {
        inflation: Inflation::NONE,
        cross_terms: CrossTerms::Filled,
    };

    /// Whether every number is in its range: one that fell over in memory is not.
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
    /// `radius * inflation / (share / 256)`.
    fn of(radius_squared: RadiusSquared, inflation: Inflation, share: u16) -> Self {
        // Below 2^24 * 2^28, unit 2^-32; 2^8 times as much over a share of 2^-8.
        let product = u64::from(radius_squared.q16()).wrapping_mul(u64::from(inflation.0));
        let quotient = match Divisor::new(i64::from(share)) {
            Some(by) if share < WHOLE => by.ceil((product << 8) as i64).unsigned_abs(),
            _ => product,
        };
        // Unit 2^-16 where 24 bits are enough.
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
    pub(super) fn of(radius_squared: RadiusSquared, trust: Trust) -> Self {
        let (plane, yaw) = trust.cross_terms.shares();
        let scaled = |share| Scaled::of(radius_squared, trust.inflation, share);
        Self {
            plane: scaled(plane),
            yaw: scaled(yaw),
        }
    }
}
