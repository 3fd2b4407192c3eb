//! Bounds on a robot's movement, and the resulting growth of a pose-set.
//!
//! An estimate says where the robot was at its stamp. A permission says where it may be until the permission ends. In
//! between the robot may drive. [`MotionBounds`] state its largest speeds. [`MotionBounds::within`] returns the movement that
//! they allow in a time ([`Growth`]), rounded up.
//!
//! ```
//! use posegate::motion::MotionBounds;
//! use posegate::set::{Estimate, Extent, PoseSet};
//!
//! // A differential drive: 0.3 m/s along its axis, none across, 30 degrees a second.
//! let bounds = MotionBounds::new(0.3, 0.0, 0.524).expect("numbers that are not below zero");
//! let growth = bounds.within(250);
//! // 7.5 cm, rounded up.
//! assert!((75_000..=75_002).contains(&growth.translation_um()));
//!
//! let estimate = Estimate { x_m: 1.0, y_m: 2.0, yaw_rad: 0.0 };
//! let later = PoseSet::bounded(estimate, 0.02, 0.01)?.grown(growth);
//! assert!(matches!(later.extent(), Extent::Bounded { translation_um: 95_000..=95_003, .. }));
//! # Ok::<(), posegate::set::InputError>(())
//! ```

use crate::num::{FloatUnit, Rounding, converted, sqrt_ceil};
use crate::set::Growth;

/// The largest speeds of a robot, in its own frame.
///
/// They bound every possible movement of the robot, not only the commanded one: a controller that limits the speed to
/// 0.3 m/s and overshoots by a tenth has a bound of 0.33 m/s. They are those of the point whose pose is reported: no speed across the axis is true of
/// a point on the axle of a differential drive whose wheels do not slip sideways. A point L metres ahead of the axle moves sideways by L times the turn rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotionBounds {
    /// Micrometres per millisecond, 2^-10, in the direction in which the robot is fastest.
    speed_q10: u32,
    /// The same across the robot's axis.
    side_q10: u32,
    /// 2^-24 turn per millisecond, 2^-16.
    turn_q16: u32,
}

/// m/s to micrometres per millisecond, 2^-10.
const SPEED: FloatUnit = FloatUnit::new(1_024_000, 0);
/// rad/s to 2^-24 turn per millisecond, 2^-16; rounded up to 2^-36.
const TURN: FloatUnit = FloatUnit::new(12_025_407_501_443_077_024, 36);
/// A speed is below 2^30 of its units, 1,048 m/s; a turn rate below 2^32, 24.5 rad/s.
const LARGEST: u32 = 1 << 30;

impl MotionBounds {
    /// The robot does not move while a permission is in force. Other means must ensure this, for example
    /// brakes that the same output releases.
    pub const STANDS_STILL: Self = Self {
        speed_q10: 0,
        side_q10: 0,
        turn_q16: 0,
    };

    /// Returns bounds from the largest speeds along and across the robot's axis (m/s) and the largest turn rate (rad/s), in
    /// either direction. Rounded up.
    ///
    /// `None` if a speed is below zero, not finite, or above 1,000 m/s or 24 rad/s.
    #[must_use]
    pub fn new(along_m_s: f64, across_m_s: f64, turn_rad_s: f64) -> Option<Self> {
        let up = |value: f64, unit: &FloatUnit| {
            let scaled = converted(value, unit, Rounding::AwayFromZero).ok()?;
            u32::try_from(scaled).ok()
        };
        let speed = |value: f64| up(value, &SPEED).filter(|speed| *speed < LARGEST);
        let [along, across] = [speed(along_m_s)?, speed(across_m_s)?].map(u64::from);
        // Below 2^61.
        let squares = along
            .wrapping_mul(along)
            .wrapping_add(across.wrapping_mul(across));
        let speed = if across == 0 {
            along
        } else {
            sqrt_ceil(squares).unsigned_abs()
        };
        Some(Self {
            speed_q10: u32::try_from(speed).ok()?,
            side_q10: u32::try_from(across).ok()?,
            turn_q16: up(turn_rad_s, &TURN)?,
        })
    }

    /// Returns bounds from the largest speed in any direction, m/s, and the largest turn rate, rad/s, as [`MotionBounds::new`].
    #[must_use]
    pub fn in_any_direction(speed_m_s: f64, turn_rad_s: f64) -> Option<Self> {
        let along = Self::new(speed_m_s, 0.0, turn_rad_s)?;
        Some(Self {
            side_q10: along.speed_q10,
            ..along
        })
    }

    /// Returns bounds from whole numbers, for constants, as [`MotionBounds::new`]: mm/s along and across the robot's axis, mrad/s of turn. Rounded up. Larger
    /// speeds are limited to 1,000 m/s and 24 rad/s.
    #[must_use]
    pub const fn of_mm_mrad(along_mm_s: u32, across_mm_s: u32, turn_mrad_s: u32) -> Self {
        let squares = wide(along_mm_s, along_mm_s).saturating_add(wide(across_mm_s, across_mm_s));
        let root = squares.isqrt();
        let root = root.wrapping_add(if root.wrapping_mul(root) < squares {
            1
        } else {
            0
        });
        Self {
            speed_q10: within_range(root.wrapping_mul(1 << 10)),
            side_q10: within_range(wide(across_mm_s, 1 << 10)),
            // 2^24 / (2 pi) * 2^16 / 10^6 is 174,992.7.
            turn_q16: limited(wide(turn_mrad_s, 174_993)),
        }
    }

    /// Returns `true` if the robot does not move: no speed is above 0.
    #[inline(always)]
    pub(crate) const fn stands_still(&self) -> bool {
        self.speed_q10 | self.turn_q16 == 0
    }

    /// Returns the largest movement within a time in milliseconds: the radius of its positions, how far they lead across the robot's axis, and the turn to
    /// either side.
    #[must_use]
    pub const fn within(&self, ms: u32) -> Growth {
        if self.stands_still() {
            return Growth::NONE;
        }
        let length = wide(self.speed_q10, ms).wrapping_add((1 << 10) - 1) >> 10;
        let side = wide(self.side_q10, ms).wrapping_add((1 << 10) - 1) >> 10;
        let turn = wide(self.turn_q16, ms).wrapping_add((1 << 16) - 1) >> 16;
        Growth::along(limited(length), limited(side), limited(turn))
    }

    /// Returns the numbers that state the bounds, for a digest of settings.
    #[must_use]
    pub const fn words(&self) -> [u32; 3] {
        [self.speed_q10, self.side_q10, self.turn_q16]
    }
}

const fn wide(a: u32, b: u32) -> u64 {
    (a as u64).wrapping_mul(b as u64)
}

const fn within_range(value: u64) -> u32 {
    if value < LARGEST as u64 {
        value as u32
    } else {
        LARGEST
    }
}

const fn limited(value: u64) -> u32 {
    if value > u32::MAX as u64 {
        u32::MAX
    } else {
        value as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use proptest::prelude::*;

    #[test]
    fn negative_infinite_and_too_large_speeds_are_refused() {
        assert_eq!(
            MotionBounds::new(0.0, 0.0, 0.0),
            Some(MotionBounds::STANDS_STILL)
        );
        for (along, across, turn) in [
            (-0.1, 0.0, 0.0),
            (0.0, -1e-12, 0.0),
            (0.0, 0.0, -1.0),
            (f64::NAN, 0.0, 0.0),
            (0.0, f64::INFINITY, 0.0),
            (1e4, 0.0, 0.0),
            (0.0, 0.0, 1e4),
        ] {
            let found = MotionBounds::new(along, across, turn);
            assert_eq!(found, None, "{along} {across} {turn}");
        }
    }

    #[test]
    fn longest_time_gives_largest_movement() {
        let bounds = MotionBounds::new(1.0, 0.0, 1.0).unwrap();
        let most = Growth::along(u32::MAX, 0, u32::MAX);
        assert_eq!(bounds.within(u32::MAX), most);
        assert_eq!(bounds.within(0), Growth::NONE);
        assert_eq!(MotionBounds::STANDS_STILL.within(u32::MAX), Growth::NONE);
        let any = MotionBounds::in_any_direction(1.0, 1.0)
            .unwrap()
            .within(250);
        let along = bounds.within(250);
        let [length, turn] = [along.translation_um(), along.yaw_q24()].map(i32::unsigned_abs);
        assert_eq!(any, Growth::new(length, turn));
        assert_eq!(along, Growth::along(length, 0, turn));
    }

    #[test]
    fn integer_and_float_speeds_give_equal_bounds() {
        let of = |along, across, turn| MotionBounds::of_mm_mrad(along, across, turn);
        for [along, across, turn] in [[300, 0, 524], [1_500, 400, 2_000], [0, 0, 0], [1, 1, 1]] {
            let [x, y, t] = [along, across, turn].map(|v| f64::from(v) * 1e-3);
            let exact = MotionBounds::new(x, y, t).unwrap();
            let found = of(along, across, turn);
            assert!(
                found.speed_q10 >= exact.speed_q10.saturating_sub(1)
                    && found.turn_q16 >= exact.turn_q16
            );
            assert!(
                found.speed_q10 <= exact.speed_q10 + 1_024,
                "{found:?} {exact:?}"
            );
            assert!(
                found.turn_q16 <= exact.turn_q16 + 2 + exact.turn_q16 / 100_000,
                "{found:?} {exact:?}"
            );
        }
        let fastest = of(u32::MAX, u32::MAX, u32::MAX);
        assert_eq!(fastest.words(), [LARGEST, LARGEST, u32::MAX]);
    }

    proptest! {
        #[test]
        fn movements_are_rounded_up(along in 0.0..3.0f64, across in 0.0..3.0f64, turn in 0.0..6.0f64, ms in 0u32..10_000) {
            let growth = MotionBounds::new(along, across, turn).unwrap().within(ms);
            let seconds = f64::from(ms) * 1e-3;
            let length = along.hypot(across) * seconds * 1e6;
            let found = f64::from(growth.translation_um());
            // Both speeds and their root are rounded up: by less than 1 + sqrt(2) of a unit, 2^-10 um per ms.
            prop_assert!(found >= length - 1e-6 && found <= length + 2.0 + 2.36e-3 * f64::from(ms), "{found} {length}");
            let angle = turn * seconds / TAU * 16_777_216.0;
            let found = f64::from(growth.yaw_q24());
            prop_assert!(found >= angle - 1e-6 && found <= angle + 2.0 + 2e-5 * f64::from(ms), "{found} {angle}");
        }
    }

    /// The rows of the error budget of movements: what a robot at its bounds moves in a time, from a stamp that is rounded down to a clock that is
    /// rounded down.
    #[test]
    fn error_budget_of_movements() {
        use crate::error_budget::{Exact, Random, Row, Search};
        use crate::gate::Settings;
        let mut random = Random::new(31);
        let mut searches = [(); 6].map(|()| Search::new());
        let metre = Exact::int(1_000_000);
        let radian = Exact::int(1 << 23).div(&Exact::pi());
        for _ in 0..crate::test_share(50_000, 20) {
            let [length, turn, rounded, turned, later, aside] = &mut searches;
            let (speed, rate) = (random.log_within(1e-3, 10.0), random.log_within(1e-3, 20.0));
            let ms = random.log_within(1.0, 5e3) as u32;
            let across = random.log_within(1e-3, 10.0) * random.within(-1.0, 1.0).max(0.0);
            let bounds = MotionBounds::new(speed, across, rate).unwrap();
            let square = |v: f64| &Exact::float(v) * &Exact::float(v);
            let fastest = (&square(speed) + &square(across)).sqrt();
            let growth = bounds.within(ms);
            let seconds = Exact::int(ms).div(&Exact::int(1_000));
            let exact = &(&fastest * &seconds) * &metre;
            length.case(growth.translation_um().into(), exact.to_f64());
            let exact = &(&Exact::float(rate) * &seconds) * &radian;
            turn.case(growth.yaw_q24().into(), exact.to_f64());
            let [mm, mm_across, mrad] = [speed, across, rate].map(|v| (v * 1e3) as u32);
            let constant = MotionBounds::of_mm_mrad(mm, mm_across, mrad).within(ms);
            let root = Exact::int(u64::from(mm).pow(2) + u64::from(mm_across).pow(2)).sqrt();
            let exact = &root * &Exact::int(ms);
            if mm > 0 {
                rounded.case(constant.translation_um().into(), exact.to_f64());
            }
            if mrad > 0 {
                let exact = &(&Exact::int(mrad).div(&Exact::int(1_000)) * &seconds) * &radian;
                turned.case(constant.yaw_q24().into(), exact.to_f64());
            }
            // A drive from a heading that is off to one side, whose turn and way across lead to the same side.
            let error = random.log_within(1e-4, 2.0);
            let fast = MotionBounds::new(speed, across, rate.min(1.0 / seconds.to_f64())).unwrap();
            let grown = fast.within(ms);
            let q24 = (error / TAU * 16_777_216.0) as i32;
            let steps = 64;
            let step = seconds.to_f64() / f64::from(steps);
            let rate = rate.min(1.0 / seconds.to_f64()) * random.unit().round();
            let mut place = [0.0f64; 2];
            for k in 0..steps {
                let since = (f64::from(k) + 0.5) * step;
                let (s, c) = (f64::from(q24) / 16_777_216.0 * TAU + rate * since).sin_cos();
                place[0] += (speed * c - across * s) * step;
                place[1] += (speed * s + across * c) * step;
            }
            aside.case(f64::from(grown.aside_um(q24)), place[1].abs() * 1e6);
            assert!(place[0].hypot(place[1]) * 1e6 <= f64::from(grown.translation_um()));
            // The true stamp begins its millisecond, and the permission's end ends its own.
            let period_ms = random.log_within(5.0, 500.0) as u32;
            let settings = Settings::for_source(period_ms, (random.unit() * 50.0) as u32);
            let age_ms = (random.unit() * f64::from(settings.maximum_age_ms)) as u32;
            let ends_ms = (age_ms + settings.permit_hold_ms + settings.response_ms)
                .min(settings.maximum_age_ms);
            let hair = Exact::dyadic(1, 40);
            let ends = &(&Exact::int(ends_ms) + &Exact::int(1)) - &hair;
            let seconds = ends.div(&Exact::int(1_000));
            let bound = settings.movement(bounds, age_ms);
            let exact = &(&fastest * &seconds) * &metre;
            later.case(bound.translation_um().into(), exact.to_f64());
            let exact = &(&Exact::float(rate) * &seconds) * &radian;
            later.case(bound.yaw_q24().into(), exact.to_f64());
        }
        let names = [
            "motion: a length within a time",
            "motion: a turn within a time",
            "motion: a length by whole numbers",
            "motion: a turn by whole numbers",
            "motion: a movement until a permission ends",
            "motion: a movement across the estimate's heading",
        ];
        for (search, name) in searches.iter().zip(names) {
            search.report(&Row {
                name,
                unit: "um, 2^-24 turn",
                looseness: None,
            });
        }
    }
}
