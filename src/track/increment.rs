//! One increment of the odometry.

use crate::motion::MotionBounds;
use crate::num::{BinaryAngle, Float, Rounding, sqrt_ceil, wide};
use crate::set::Q24_PER_RADIAN_Q52;

/// A movement since the previous increment, in the robot's axes at its start. It states its begin time, so that a lost increment is
/// detected.
///
/// What the tracker's bounds need of an increment: it is so short that the odometry cannot read 7/8 of a turn meanwhile (else it is refused as a
/// jump), the turn is at most an eighth of a turn, and the robot keeps its speeds ahead, to the left and of its turn (an arc).
///
/// The bounds of its length and slip also hold if the direction of movement leaves the range between its directions at both ends by at most
/// 0.014 rad in total. A robot that turns first and then drives has up to 1.42 times the deviation that this increment adds; that matters only for a
/// path of few increments. A robot that drives to and fro within one increment drives farther than these bounds allow for.
///
/// For late fixes, a tracker adds up increments that together last at most 8 ms to a single one. All of them together must then be what a single increment
/// must be. The lengths and turns of each are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Increment {
    pub(super) step: Step,
    pub(super) begins_ms: u32,
}

/// A movement up to a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Step {
    /// Along the robot's axis, 2^-8 um: from -4 m to 4 m.
    pub x_q8: i32,
    /// To the robot's left, 2^-8 um.
    pub y_q8: i32,
    /// Counter-clockwise, 2^-32 turn: at most an eighth of a turn.
    pub turn: i32,
    /// The time at its end, milliseconds of the controller's clock.
    pub stamp_ms: u32,
}

/// Bounds of the length and the turns that a robot drove in addition to those of an arc between both ends: powers of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Excess {
    /// The exponents of both, 0 for none.
    exponents: u8,
}

impl Excess {
    pub const NONE: Self = Self { exponents: 0 };
    /// What is added to an exponent: 2^-2 um is the smallest length, and 2^-22 turn the smallest turn.
    const LEAST: [u32; 2] = [5, 1];

    /// Returns bounds of a length, 2^-8 um, and of turns, 2^-24 turn. `None` above 4 mm or 1.4 degrees.
    fn of([length, turns]: [u32; 2]) -> Option<Self> {
        let exponent = |amount: u32, least: u32| {
            let bits = amount.checked_sub(1).map_or(0, |below| {
                u32::BITS
                    .wrapping_sub(below.leading_zeros())
                    .max(least.wrapping_add(1))
                    .wrapping_sub(least)
            });
            (bits < 16).then_some(bits as u8)
        };
        let [of_length, of_turn] = Self::LEAST;
        let exponents = exponent(length, of_length)? | exponent(turns, of_turn)? << 4;
        Some(Self { exponents })
    }

    /// Returns the length, 2^-8 um, and the turns, 2^-24 turn.
    fn amounts(self) -> [u32; 2] {
        let amount = |exponent: u8, least: u32| match u32::from(exponent) {
            0 => 0,
            exponent => 1_u32.wrapping_shl(exponent.wrapping_add(least)),
        };
        let [of_length, of_turn] = Self::LEAST;
        [
            amount(self.exponents & 0xf, of_length),
            amount(self.exponents >> 4, of_turn),
        ]
    }
}

/// The largest turn of an increment, 2^-32 turn.
const LARGEST_TURN: u32 = 1 << 29;
/// The largest entry of an increment on an axis, 2^-8 um.
const LONGEST: u32 = 1 << 30;

const fn is_small(x_q8: i32, y_q8: i32, turn: i32) -> bool {
    x_q8.unsigned_abs() <= LONGEST
        && y_q8.unsigned_abs() <= LONGEST
        && turn.unsigned_abs() <= LARGEST_TURN
}

impl Increment {
    /// Returns an increment from metres ahead, metres to the left, and radians counter-clockwise, each to the nearest unit of
    /// [`Increment::new`], and the times of its beginning and its end: the end of one increment is the beginning of the next. The
    /// tracker counts this rounding for every increment.
    /// `None` if a number is not finite, a length is above 4.19 m, or the turn is above an eighth of a turn.
    #[must_use]
    pub fn of(ahead_m: f64, left_m: f64, turn_rad: f64, span_ms: [u32; 2]) -> Option<Self> {
        let length = |value: f64| {
            let q8 = Float::of(value)?.scaled(256_000_000, 0, Rounding::Nearest)?;
            i32::try_from(q8).ok()
        };
        // The nearest angle of a large turn is that of its wrap.
        let q24 = Float::of(turn_rad)?.scaled(Q24_PER_RADIAN_Q52, 52, Rounding::AwayFromZero)?;
        let is_turn = q24.unsigned_abs() < 1 << 23;
        let turn = BinaryAngle::from_radians(turn_rad).filter(|_| is_turn)?;
        Self::new(length(ahead_m)?, length(left_m)?, turn.signed(), span_ms)
    }

    /// Returns an increment from lengths in units of 2^-8 um and a turn in units of 2^-32 turn, and the times of its beginning and
    /// its end. `None` if a length is above 2^30 units (4.19 m), or the turn is above an eighth of a turn.
    #[must_use]
    pub const fn new(
        ahead_q8: i32,
        left_q8: i32,
        turn: i32,
        [begins_ms, stamp_ms]: [u32; 2],
    ) -> Option<Self> {
        if !is_small(ahead_q8, left_q8, turn) {
            return None;
        }
        Some(Self {
            step: Step {
                x_q8: ahead_q8,
                y_q8: left_q8,
                turn,
                stamp_ms,
            },
            begins_ms,
        })
    }

    /// Returns the times of the movement's beginning and end, milliseconds of the controller's clock.
    #[must_use]
    pub const fn span_ms(&self) -> [u32; 2] {
        [self.begins_ms, self.step.stamp_ms]
    }

    /// Returns the movement ahead and to the left, 2^-8 um, and the turn counter-clockwise, 2^-32 turn. Axes are the
    /// robot's at the beginning.
    #[must_use]
    pub const fn entries(&self) -> [i32; 3] {
        [self.step.x_q8, self.step.y_q8, self.step.turn]
    }
}

impl Step {
    /// Returns upper bounds of the length that the robot drove, 2^-8 um, below 2^31.1, and of its turns, 2^-24 turn, below 2^21.1.
    ///
    /// If the direction of movement stays within a range `r < pi`, the length is at most the chord over `cos(r / 2)`. With
    /// `r = t + 0.014 rad` for a turn t of at most an eighth of a turn, that factor is at most `1 + 6 t^2 + 2^-12`, t in turns. The
    /// length of an arc is the chord times `(t / 2) / sin(t / 2)`, about a quarter of this above 1.
    pub fn driven(&self, excess: Excess) -> [u32; 2] {
        let chord = if self.y_q8 == 0 {
            self.x_q8.unsigned_abs()
        } else {
            sqrt_ceil(self.chord_squared()) as u32
        };
        let turn = self.turn_q24();
        // Unit 2^-28: at most 2^22 and a unit.
        let square = (wide(turn, turn) >> 20) as u32;
        let longer = square.wrapping_add(1).wrapping_mul(6).wrapping_add(1 << 16);
        let [length, turns] = excess.amounts();
        [
            chord
                .wrapping_add((wide(chord, longer) >> 28) as u32)
                .wrapping_add(length)
                .wrapping_add(1),
            turn.wrapping_add(turns),
        ]
    }

    /// Returns this movement and a later one as one, with the length and the turns that the robot drove in addition to those of an arc, of all that it
    /// `drove`. `None` if it is not the movement of an increment, or the robot drove much to and fro.
    #[inline(never)]
    pub fn and(&self, later: &Self, drove: [u32; 2]) -> Option<(Self, Excess)> {
        // Sums below 2^61, and below 2^31.6 after the shift: the movement of 8 ms is shorter than 4 m, or the sum is refused.
        let is_short = [self, later]
            .iter()
            .all(|one| one.chord_squared() < 1 << 58);
        let [c, s] = BinaryAngle(self.turn as u32).cos_sin_q30().map(i64::from);
        let (dx, dy) = (i64::from(later.x_q8), i64::from(later.y_q8));
        let sum = |from: i32, by: i64| from.wrapping_add((by.wrapping_add(1 << 29) >> 30) as i32);
        let both = Self {
            x_q8: sum(
                self.x_q8,
                c.wrapping_mul(dx).wrapping_sub(s.wrapping_mul(dy)),
            ),
            y_q8: sum(
                self.y_q8,
                s.wrapping_mul(dx).wrapping_add(c.wrapping_mul(dy)),
            ),
            turn: self.turn.wrapping_add(later.turn),
            stamp_ms: later.stamp_ms,
        };
        if !(is_short && is_small(both.x_q8, both.y_q8, both.turn)) {
            return None;
        }
        let ([length, turns], [own, own_turn]) = (drove, both.driven(Excess::NONE));
        let excess = [length.saturating_sub(own), turns.saturating_sub(own_turn)];
        Some((both, Excess::of(excess)?))
    }

    /// Returns the square of the distance between both ends, 2^-16 um^2: at most 2^61.
    fn chord_squared(&self) -> u64 {
        let [x, y] = [self.x_q8, self.y_q8].map(i32::unsigned_abs);
        wide(x, x).wrapping_add(wide(y, y))
    }

    /// Returns the magnitude of the turn, 2^-24 turn, rounded up: at most 2^21.
    pub fn turn_q24(&self) -> u32 {
        self.turn.unsigned_abs().wrapping_add(0xff) >> 8
    }

    /// Returns `true` if a robot can make this movement within `ms` and one millisecond for the rounding of both stamps.
    pub fn is_within(&self, bounds: MotionBounds, ms: u32) -> bool {
        let most = bounds.within(ms.saturating_add(1));
        let length_um = most.translation_um().unsigned_abs().saturating_add(2);
        self.chord_squared() >> 16 <= wide(length_um, length_um)
            && self.turn_q24() <= most.yaw_q24().unsigned_abs().saturating_add(2)
    }

    /// Returns upper bounds of the length and the turns that the robot drove in a part of the movement, as [`Step::driven`]: the share of an arc is not
    /// shorter, though its turn is smaller, and what was driven in addition may all have been in this part.
    pub fn driven_part(&self, excess: Excess, [after, whole]: [u32; 2]) -> [u32; 2] {
        let [more, turns] = excess.amounts();
        let [length, turn] = self.driven(Excess::NONE).map(|all| {
            let share = wide(all, after).checked_div(u64::from(whole));
            let share = share.and_then(|share| u32::try_from(share).ok());
            share.unwrap_or(u32::MAX).saturating_add(1)
        });
        [length.saturating_add(more), turn.saturating_add(turns)]
    }

    /// Returns the last `after / whole` of the movement.
    pub fn part(&self, [after, whole]: [u32; 2]) -> Self {
        let share = |value: i32| {
            let product = i64::from(value).wrapping_mul(i64::from(after));
            product.checked_div(i64::from(whole)).unwrap_or(0) as i32
        };
        Self {
            x_q8: share(self.x_q8),
            y_q8: share(self.y_q8),
            turn: share(self.turn),
            stamp_ms: self.stamp_ms,
        }
    }
}
