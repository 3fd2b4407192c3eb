//! The growth of a pose-set by a movement: a cylinder of offsets, each of which may apply to every pose of the set.
//!
//! The grown set is `{ p + c : p in the set, |(cx, cy)| <= translation, |c_yaw| <= yaw }` (the Minkowski sum). It is not
//! an ellipsoid. The decision keeps both parts apart: along any normal, the extent of the sum is the sum of the extents.
//!
//! # A robot that hardly moves sideways
//! Each piece of the movement leads along the robot's heading of that moment, and little across. Relative to the estimate's heading, that heading is off
//! by at most the yaw error of a pose of the set and the turn of the movement, t together. So an offset leads at most
//! `side + translation sin(t)` across the estimate's heading ([`Growth::aside_um`]): the offsets are those of a strip in the disc.

use super::{Extent, Inflation, Q24_PER_RADIAN_Q52};
use crate::num::{Float, Rounding, UM_PER_M, wide};
use crate::pose::REACH_UM;

/// The largest offsets that a movement adds to a pose-set, in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Growth {
    translation_um: i32,
    /// Across the robot's own heading: at most the translation.
    side_um: i32,
    yaw_q24: i32,
}

/// The largest turn that is told apart, 2^-24 turn: 32 turns, as of a covariance. From this on, a turn is every heading at every scale.
pub(crate) const WIDEST_YAW: i32 = 1 << 29;

/// Returns a turn, 2^-24 turn, times `q16 / 2^16`, rounded up: at most [`WIDEST_YAW`], and that if the turn is.
pub(crate) const fn scaled_yaw(yaw_q24: i32, q16: u32) -> i32 {
    if yaw_q24 >= WIDEST_YAW {
        return WIDEST_YAW;
    }
    let product = wide(yaw_q24.unsigned_abs(), q16).wrapping_add(0xffff) >> 16;
    if product < WIDEST_YAW as u64 {
        product as i32
    } else {
        WIDEST_YAW
    }
}

impl Growth {
    /// No movement.
    pub const NONE: Self = Self {
        translation_um: 0,
        side_um: 0,
        yaw_q24: 0,
    };

    /// Returns a growth of a length in micrometres and a turn in units of 2^-24 turn. Lengths are limited to 268 m: no table contains a set of
    /// that size. Turns are limited to 32 turns.
    #[must_use]
    pub const fn new(translation_um: u32, yaw_q24: u32) -> Self {
        Self::along(translation_um, translation_um, yaw_q24)
    }

    /// Returns a growth of a length in micrometres, of which at most `side_um` is across the robot's own heading, and a turn, as [`Growth::new`].
    #[must_use]
    pub const fn along(translation_um: u32, side_um: u32, yaw_q24: u32) -> Self {
        let translation_um = if translation_um < REACH_UM.unsigned_abs() {
            translation_um as i32
        } else {
            REACH_UM
        };
        let yaw_q24 = if yaw_q24 < WIDEST_YAW.unsigned_abs() {
            yaw_q24 as i32
        } else {
            WIDEST_YAW
        };
        Self {
            translation_um,
            side_um: if side_um < translation_um.unsigned_abs() {
                side_um as i32
            } else {
                translation_um
            },
            yaw_q24,
        }
    }

    /// Returns a growth of a length in metres and a turn in radians, rounded up. `None` if one is negative or not finite.
    #[must_use]
    pub fn of(translation_m: f64, yaw_rad: f64) -> Option<Self> {
        let up = |value: f64, factor: u128, shift: i32| {
            let float = Float::of(value)?;
            if value == 0.0 {
                return Some(0);
            }
            let scaled = float
                .is_positive()
                .then(|| float.scaled(factor, shift, Rounding::AwayFromZero))?;
            Some(scaled.map_or(u32::MAX, |value| u32::try_from(value).unwrap_or(u32::MAX)))
        };
        Some(Self::new(
            up(translation_m, u128::from(UM_PER_M), 0)?,
            up(yaw_rad, Q24_PER_RADIAN_Q52, 52)?,
        ))
    }

    /// Returns the radius of the offsets in the plane, micrometres: at most 2^28.
    #[must_use]
    pub const fn translation_um(self) -> i32 {
        self.translation_um
    }

    /// Returns how much of the radius may be across the robot's own heading, micrometres.
    #[must_use]
    pub const fn side_um(self) -> i32 {
        self.side_um
    }

    /// Returns the largest offset across the estimate's heading, micrometres, rounded up, in a set whose yaw errors are at most `yaw_q24`: at most
    /// the radius.
    #[must_use]
    pub(crate) fn aside_um(self, yaw_q24: i32) -> i32 {
        // The usual case costs nothing.
        if self.side_um == self.translation_um {
            return self.translation_um;
        }
        let yaw_q24 = yaw_q24.saturating_add(self.yaw_q24);
        let swung = self.swung(yaw_q24).translation_um;
        swung.saturating_add(self.side_um).min(self.translation_um)
    }

    /// Returns the largest turn to either side, 2^-24 turn: at most 32 turns. From half a turn on, every heading is reached.
    #[must_use]
    pub const fn yaw_q24(self) -> i32 {
        self.yaw_q24
    }

    /// Returns `true` if nothing moves.
    #[inline(always)]
    pub(crate) const fn is_none(&self) -> bool {
        self.translation_um | self.yaw_q24 == 0
    }

    /// Returns the sum of both movements.
    #[must_use]
    #[cfg_attr(small_code, inline(never))]
    #[cfg_attr(not(small_code), inline(always))]
    pub const fn plus(self, other: Self) -> Self {
        if other.is_none() {
            return self;
        }
        Self::along(
            self.translation_um
                .wrapping_add(other.translation_um)
                .unsigned_abs(),
            self.side_um.wrapping_add(other.side_um).unsigned_abs(),
            self.yaw_q24.wrapping_add(other.yaw_q24).unsigned_abs(),
        )
    }

    /// Returns the largest change of this movement, in any direction of the plane, if its axes are turned by up to `yaw_q24`: a chord, rounded up.
    pub(crate) fn swung(self, yaw_q24: i32) -> Self {
        let product = wide(self.translation_um.unsigned_abs(), yaw_q24.unsigned_abs());
        // 2 pi / 2^24 from above, of at most 2^57: beyond 2^53, a chord is longer than every growth.
        let chord = product.saturating_mul(1_609) >> 32;
        Self::new(u32::try_from(chord.wrapping_add(1)).unwrap_or(u32::MAX), 0)
    }

    /// Returns the growth times the root of an inflation, rounded up.
    pub(crate) fn inflated(self, inflation: Inflation) -> Self {
        let up = |value: i32| {
            let length = inflation.of_length(i64::from(value));
            u32::try_from(length).unwrap_or(u32::MAX)
        };
        Self::along(up(self.translation_um), up(self.side_um), up(self.yaw_q24))
    }

    /// Returns the growth times `q16 / 2^16`, rounded up. `None` if that is out of range.
    pub(crate) fn scaled(self, q16: u32) -> Option<Self> {
        let up = |value: i32| {
            let product = u64::from(value.unsigned_abs()).wrapping_mul(u64::from(q16));
            product.wrapping_add(0xffff) >> 16
        };
        let [translation_um, side_um] = [self.translation_um, self.side_um].map(up);
        let translation_um = i32::try_from(translation_um).ok()?;
        (translation_um <= REACH_UM).then_some(Self {
            translation_um,
            side_um: i32::try_from(side_um).ok()?,
            yaw_q24: scaled_yaw(self.yaw_q24, q16),
        })
    }

    /// Returns an extent grown by this.
    pub(super) fn around(self, extent: Extent) -> Extent {
        match extent {
            Extent::Gaussian(_) if self.is_none() => extent,
            Extent::Gaussian(factor) => Extent::Grown { factor, by: self },
            Extent::Grown { factor, by } => Extent::Grown {
                factor,
                by: by.plus(self),
            },
            // Two cylinders make one, exactly.
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => Extent::Bounded {
                translation_um: translation_um
                    .saturating_add(self.translation_um)
                    .min(REACH_UM << 1),
                yaw_q24: yaw_q24.wrapping_add(self.yaw_q24).min(WIDEST_YAW << 1),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use proptest::prelude::*;

    /// Sixteen growths of 2^28 um sum to 2^32 um.
    #[test]
    fn repeated_growths_never_wrap_to_a_small_set() {
        use crate::set::{Estimate, PoseSet, RadiusSquared};
        let estimate = Estimate {
            x_m: 0.0,
            y_m: 0.0,
            yaw_rad: 0.0,
        };
        let most = Growth::new(u32::MAX, u32::MAX);
        let radius = RadiusSquared::from_q16(743_499).unwrap();
        let covariance = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]];
        for mut set in [
            PoseSet::bounded(estimate, 0.01, 0.01).unwrap(),
            PoseSet::gaussian(estimate, covariance, radius).unwrap(),
        ] {
            for count in 1..40 {
                set = set.grown(most);
                let (length, yaw) = match set.extent() {
                    Extent::Bounded {
                        translation_um,
                        yaw_q24,
                    } => (translation_um, yaw_q24),
                    Extent::Grown { by, .. } => (by.translation_um(), by.yaw_q24()),
                    Extent::Gaussian(_) => unreachable!("it moved"),
                };
                assert!(
                    length >= REACH_UM && yaw >= WIDEST_YAW,
                    "{count}: {length} {yaw}"
                );
                assert!(set.common().broad_um >= REACH_UM.unsigned_abs(), "{count}");
            }
        }
    }

    #[test]
    fn only_lengths_and_turns_that_are_numbers_make_a_growth() {
        assert_eq!(Growth::of(0.0, 0.0), Some(Growth::NONE));
        for (translation, yaw) in [
            (-1e-9, 0.0),
            (0.0, -1e-9),
            (f64::NAN, 0.0),
            (0.0, f64::INFINITY),
        ] {
            assert_eq!(Growth::of(translation, yaw), None, "{translation} {yaw}");
        }
        assert_eq!(Growth::of(1e9, 1e9), Some(Growth::new(u32::MAX, u32::MAX)));
    }

    proptest! {
        #[test]
        fn growths_are_rounded_up(translation in 0.0..200.0f64, yaw in 0.0..6.2f64, q16 in 0u32..1 << 20) {
            let growth = Growth::of(translation, yaw).unwrap();
            let um = f64::from(growth.translation_um());
            let q24 = f64::from(growth.yaw_q24());
            prop_assert!(um >= translation * 1e6 && um < translation * 1e6 + 1.001);
            let exact = yaw / TAU * 16_777_216.0;
            prop_assert!(q24 >= exact && q24 < exact + 1.001);
            if let Some(scaled) = growth.scaled(q16) {
                let scale = f64::from(q16) / 65_536.0;
                prop_assert!(f64::from(scaled.translation_um()) >= um * scale);
                prop_assert!(f64::from(scaled.yaw_q24()) >= (q24 * scale).min(f64::from(WIDEST_YAW)));
            }
        }
    }
}
