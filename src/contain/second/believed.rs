//! The pose-set in question in the second evaluation's numbers, from the floats of an estimate.

use super::bits::{Short, Weight, fixed, is_above_zero, is_below, is_finite, root, wide, word32};
use super::turn;
use crate::num::quotient;
use crate::report::{Heading, PoseEstimate};
use crate::set::{CrossTerms, Inflation, Trust};

/// 10^6 with its top bit at bit 63, for use with the power [`MICRO_DOWN`].
const MICRO: u64 = 1_000_000 << 44;
const MICRO_DOWN: i32 = -44;
/// 2^32 / (2 pi), times 2^34.
const TURN: u64 = 11_743_562_013_128_004_905;
const TURN_DOWN: i32 = -34;
/// Half a turn, 2^-32 turn.
const HALF_TURN: i64 = 1 << 31;
/// Roll and pitch must be below 2^-4 rad each.
const TILT_POWER: i32 = -4;

/// The question: an estimate, the trust in its source, and the table's squared radius, 2^-16.
pub(super) struct Question<'a> {
    pub belief: &'a PoseEstimate,
    pub trust: Trust,
    pub radius_q16: u32,
    /// The largest movement of the robot, micrometres.
    pub moved_um: u32,
    /// Most of it that is across the robot's own heading.
    pub side_um: u32,
    /// The largest turn of the robot to either side, 2^-32 turn: at most one turn.
    pub swing: i64,
}

pub(super) struct Ellipsoid {
    /// The covariance of x, y (m) and yaw (rad): xx, xy, yy, x-yaw, y-yaw, yaw-yaw.
    pub covariance: [Short; 6],
    /// The squared radius in the plane with inflation and share, rounded down.
    pub plane: Weight,
    /// The squared radius in yaw with inflation and share, rounded down.
    pub yaw: Weight,
}

pub(super) struct Cylinder {
    /// Radius, 2^-8 um, rounded down.
    pub radius_q8: u64,
    /// Yaw, 2^-32 turn, rounded down; at most half a turn.
    pub yaw: i64,
}

impl Question<'_> {
    /// Returns the position relative to a table's goal, 2^-finer um, or `None` if a coordinate is not a
    /// number.
    pub fn above(&self, table: &[u8], finer: i32) -> Option<[i64; 2]> {
        let mut above = [0i64; 2];
        let coordinates = [(self.belief.x_m, 16), (self.belief.y_m, 20)];
        for (above, (at, goal)) in above.iter_mut().zip(coordinates) {
            let goal = i64::from(word32(table, goal)? as i32);
            let goal = if finer >= 0 {
                goal.wrapping_shl(finer.unsigned_abs())
            } else {
                goal.wrapping_shr(finer.unsigned_abs())
            };
            let at = fixed(at, MICRO, MICRO_DOWN.wrapping_add(finer))?;
            *above = at.wrapping_sub(goal);
        }
        Some(above)
    }

    /// Returns the heading, 2^-32 turn: off by at most one unit, or by at most 16 from a quaternion. `None`
    /// if it is invalid or the robot is tilted.
    #[inline(never)]
    pub fn heading(&self) -> Option<u32> {
        match &self.belief.heading {
            Heading::Radians(yaw) => of_radians(*yaw),
            Heading::RollPitchYaw([roll, pitch, yaw]) => {
                if !(is_below(*roll, TILT_POWER) && is_below(*pitch, TILT_POWER)) {
                    return None;
                }
                of_radians(*yaw)
            }
            Heading::Quaternion(entries) => of_quaternion(entries),
        }
    }

    /// Returns a bounded set's extents, or `None` if one is not above zero.
    pub fn cylinder(&self, translation_m: f64, yaw_rad: f64) -> Option<Cylinder> {
        // The root of the inflation, 2^-16, rounded down.
        let inflation = match self.trust.inflation {
            Inflation::NONE => 1 << 16,
            inflation => root(u64::from(inflation.q16()) << 16) as i64,
        };
        let extent = |value: f64, factor: u64, power: i32, most: i64| {
            let extent = fixed(value, factor, power).unwrap_or(most).min(most);
            let extent = extent.wrapping_mul(inflation) >> 16;
            is_above_zero(value).then_some(extent.min(most))
        };
        let radius = extent(translation_m, MICRO, MICRO_DOWN.wrapping_add(8), 1 << 36)?;
        // A movement makes a cylinder wider, exactly.
        let yaw = extent(yaw_rad, TURN, TURN_DOWN, HALF_TURN)?.wrapping_add(self.swing);
        Some(Cylinder {
            radius_q8: radius
                .unsigned_abs()
                .wrapping_add(u64::from(self.moved_um) << 8),
            yaw: yaw.min(HALF_TURN),
        })
    }

    /// Returns a Gaussian set, or `None` if a variance is not above zero or an entry that is used is not a
    /// number.
    #[inline(always)]
    pub fn ellipsoid(&self, covariance: &[[f64; 3]; 3]) -> Option<Ellipsoid> {
        let [[xx, xy, xt], [_, yy, yt], [_, _, tt]] = covariance;
        // Unit 2^-32; divided by the share and times 256, at most 2^60.
        let squared =
            u64::from(self.radius_q16).wrapping_mul(u64::from(self.trust.inflation.q16()));
        let share = |of: u64| shared(squared, of);
        let (plane, yaw, in_plane, with_yaw) = match self.trust.cross_terms {
            CrossTerms::Filled => {
                let weight = Weight::of(squared, -32);
                (weight, weight, true, true)
            }
            CrossTerms::YawUnknown(w) => {
                let w = u64::from(w.q8());
                (share(w)?, share(256u64.wrapping_sub(w))?, true, false)
            }
            CrossTerms::AllUnknown(w) => {
                let half = u64::from(w.q8() / 2).max(1);
                // Three shares of 256.
                let rest = 256u64.wrapping_sub(half).wrapping_sub(half);
                (share(half)?, share(rest)?, false, false)
            }
        };
        if ![*xx, *yy, *tt].into_iter().all(is_above_zero) {
            return None;
        }
        let between = |value: f64, is_filled: bool| if is_filled { value } else { 0.0 };
        let (xy, xt, yt) = (
            between(*xy, in_plane),
            between(*xt, with_yaw),
            between(*yt, with_yaw),
        );
        let entries = [*xx, xy, *yy, xt, yt, *tt];
        if !entries.into_iter().all(is_finite) {
            return None;
        }
        let covariance = entries.map(Short::of);
        is_possible(&covariance).then_some(Ellipsoid {
            covariance,
            plane,
            yaw,
        })
    }
}

/// Returns `true` if no minor of a covariance is below zero by more than its rounding.
///
/// The variances are scaled to 2^18 to 2^20. Each entry is then off by less than 3 (rounding 2, a half that
/// differs 1), a minor of two by at most 2^24, and the determinant, six products of three, by at most 2^46.
#[inline(never)]
fn is_possible(covariance: &[Short; 6]) -> bool {
    let [xx, xy, yy, xt, yt, tt] = covariance;
    let half = |variance: &Short| variance.top().wrapping_add(1) >> 1;
    let (x, y, t) = (half(xx), half(yy), half(tt));
    let entries = [
        (xx, x, x),
        (xy, x, y),
        (yy, y, y),
        (xt, x, t),
        (yt, y, t),
        (tt, t, t),
    ];
    let scaled = entries.map(|(entry, a, b)| entry.at(20i32.wrapping_sub(a).wrapping_sub(b)));
    let [Some(xx), Some(xy), Some(yy), Some(xt), Some(yt), Some(tt)] = scaled else {
        return false;
    };
    // Entries are below 2^30.
    let minor = |a: i32, b: i32, c: i32, d: i32| wide(a, b).wrapping_sub(wide(c, d));
    let least = -(1i64 << 24);
    let last = minor(yy, tt, yt, yt);
    let pairs = [minor(xx, yy, xy, xy), minor(xx, tt, xt, xt), last];
    if !pairs.iter().all(|pair| *pair >= least) {
        return false;
    }
    // Each entry is now below 2^21, and a product of three below 2^63.
    let [first, second, third] = [
        i64::from(xx).wrapping_mul(last),
        i64::from(xy).wrapping_mul(minor(xy, tt, yt, xt)),
        i64::from(xt).wrapping_mul(minor(xy, yt, yy, xt)),
    ];
    first.wrapping_sub(second).wrapping_add(third) >= -(1i64 << 46)
}

fn of_radians(yaw: f64) -> Option<u32> {
    // The low 32 bits are the heading; whole turns drop out.
    Some(fixed(yaw, TURN, TURN_DOWN)? as u32)
}

/// Returns the heading of `(w^2 + x^2 - y^2 - z^2, 2 (w z + x y))`.
fn of_quaternion(entries: &[f64; 4]) -> Option<u32> {
    let mut fixed = [0i64; 4];
    for (fixed, entry) in fixed.iter_mut().zip(entries) {
        if !is_below(*entry, 1) {
            return None;
        }
        // Unit 2^-30.
        *fixed = super::bits::fixed(*entry, 1 << 63, -33)?;
    }
    let [x, y, z, w] = fixed;
    // Unit 2^-60, each below 2^62.
    let times = |a: i64, b: i64| a.wrapping_mul(b) >> 1;
    let (xx, yy, zz, ww) = (times(x, x), times(y, y), times(z, z), times(w, w));
    let half = 1i64 << 59;
    let tilt = xx.saturating_add(yy);
    let norm = tilt.saturating_add(zz).saturating_add(ww);
    // The limits of a rotation's rounding and of a tilt of 5.07 degrees, and a little more.
    let is_rotation = norm.abs_diff(half) < (1 << 45);
    if !(is_rotation && tilt < (1 << 50) + (1 << 34)) {
        return None;
    }
    let cosine = ww.wrapping_add(xx).wrapping_sub(yy).wrapping_sub(zz) >> 29;
    let sine = times(w, z).wrapping_add(times(x, y)) >> 28;
    Some(turn::heading([cosine as i32, sine as i32]))
}

/// Returns `squared * 256 / of` as a weight, unit 2^-32. The first evaluation divides the same numbers. A fault in the division that both
/// call must not make both sets smaller, so the quotient is checked: `None` if it is wrong.
#[inline(never)]
fn shared(squared: u64, of: u64) -> Option<Weight> {
    let scaled = squared.wrapping_shl(8);
    let found = quotient(scaled, of)?;
    is_quotient(found, scaled, of).then_some(Weight::of(found, -32))
}

/// Returns `true` if `found` is `n / of`, rounded down, by another way than the division.
const fn is_quotient(found: u64, n: u64, of: u64) -> bool {
    n.wrapping_sub(found.wrapping_mul(of)) < of
}

#[cfg(test)]
mod tests {
    use super::is_quotient;

    #[test]
    fn only_the_exact_quotient_is_accepted() {
        for of in 1..=256u64 {
            for n in [0, 1, of - 1, of, 1 << 40, (1 << 60) - 1] {
                let exact = n / of;
                assert!(is_quotient(exact, n, of), "{n} / {of}");
                // Each single flipped bit that makes it smaller, and so the pose-set, is found.
                for bit in (0..64).filter(|bit| exact >> bit & 1 == 1) {
                    assert!(!is_quotient(exact ^ 1 << bit, n, of), "{n} / {of}: {bit}");
                }
                assert!(
                    !is_quotient(exact + 1, n, of)
                        && (exact == 0 || !is_quotient(exact - 1, n, of))
                );
            }
        }
    }
}
