//! A lower bound of the given pose-set: the poses that are certain to be in it.
//!
//! Decisions use a set of integers that contains the given one ([`SqrtFactor`], rounded outwards: about 22 um in x
//! and y, 2^-11 in yaw). A pose that is reported as one of the given set needs the opposite, a bound from inside.
//! No decision depends on this module.

use super::covariance::{Correlations, ScaledCovariance, is_positive_definite};
use super::{Extent, Growth, Inflation, SqrtFactor};
use crate::num::sqrt_ceil;

/// A set that is contained in the given one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) enum Given {
    /// `{ e : e e' <= T (1 - 2^-14) }` in the order of positive semi-definite matrices.
    Ellipsoid(Target),
    /// A cylinder: micrometres, 2^-24 turn.
    Cylinder { translation_um: i32, yaw_q24: i32 },
}

/// A lower bound of `r2 P`: um^2, um times 2^-24 turn, squares of 2^-24 turn, each below 2^60.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Target {
    xx: i64,
    yy: i64,
    tt: i64,
    xy: i64,
    xt: i64,
    yt: i64,
}

impl Target {
    /// Returns the target from `r2 P`, whose diagonal is rounded up by less than 2 and 2^-23 of it. The error of
    /// each other entry is subtracted from both of its diagonal entries.
    pub(super) fn of(square: &ScaledCovariance) -> Self {
        // A diagonal entry is below 2^60, and a slack below 2^43.
        let less = |diagonal: i64, a: i64, b: i64| {
            diagonal.wrapping_sub(2).wrapping_sub(a).wrapping_sub(b)
        };
        Self {
            xx: less(square.xx, square.xy_slack, square.xt_slack),
            yy: less(square.yy, square.xy_slack, square.yt_slack),
            tt: less(square.tt, square.xt_slack, square.yt_slack),
            xy: square.xy,
            xt: square.xt,
            yt: square.yt,
        }
    }

    /// Returns `F F'`, exactly: entries are below 2^29 in a length and 2^30 in yaw.
    fn of_factor(factor: &SqrtFactor) -> Self {
        let dot = |a: [i32; 3], b: [i32; 3]| {
            a.into_iter().zip(b).fold(0i64, |sum, (a, b)| {
                sum.wrapping_add(i64::from(a).wrapping_mul(i64::from(b)))
            })
        };
        let (x, y, yaw) = (factor.x, factor.y, [factor.yaw, 0, 0]);
        Self {
            xx: dot(x, x),
            yy: dot(y, y),
            tt: dot(yaw, yaw),
            xy: dot(x, y),
            xt: dot(x, yaw),
            yt: dot(y, yaw),
        }
    }

    /// Returns `true` if `e e' <= T (1 - 2^-14)` for an offset in units of half a micrometre (below 2^32) and
    /// 2^-32 turn.
    fn holds(&self, [x, y, yaw]: [i64; 3]) -> bool {
        // T in squares of these units, below 2^76; everything times 2^14.
        let rest = |entry: i64, unit: i128, a: i64, b: i64| {
            let entry = i128::from(entry)
                .wrapping_mul(unit)
                .wrapping_mul((1 << 14) - 1);
            let square = i128::from(a).wrapping_mul(i128::from(b));
            entry.wrapping_sub(square << 14)
        };
        let diagonal = [
            rest(self.xx, 4, x, x),
            rest(self.yy, 4, y, y),
            rest(self.tt, 1 << 16, yaw, yaw),
        ];
        if diagonal.iter().any(|entry| *entry <= 0) {
            return false;
        }
        let [hx, hy, ht] = diagonal.map(|entry| half(entry.unsigned_abs()));
        let scaled = |entry: i128, power: i32| {
            // To within 1: at most 2^30 if the matrix is definite.
            let entry = if power < 0 {
                entry >> power.unsigned_abs().min(127)
            } else {
                entry << power.unsigned_abs().min(30)
            };
            i64::try_from(entry)
                .ok()
                .filter(|v| v.unsigned_abs() <= 1 << 30)
        };
        let all = || {
            let [xx, yy, tt] = diagonal;
            Some(Correlations {
                diagonal: [
                    scaled(xx, hx.wrapping_mul(2))?,
                    scaled(yy, hy.wrapping_mul(2))?,
                    scaled(tt, ht.wrapping_mul(2))?,
                ],
                xy: scaled(rest(self.xy, 4, x, y), hx.wrapping_add(hy))?,
                xt: scaled(rest(self.xt, 512, x, yaw), hx.wrapping_add(ht))?,
                yt: scaled(rest(self.yt, 512, y, yaw), hy.wrapping_add(ht))?,
            })
        };
        all().is_some_and(is_positive_definite)
    }
}

/// Returns the h for which `entry 2^(2h)` lies in `[2^28, 2^30)`.
fn half(entry: u128) -> i32 {
    let top = 127i32.wrapping_sub(entry.leading_zeros() as i32);
    29i32.wrapping_sub(top) >> 1
}

/// Sixteen directions, a little shorter than 2^10.
const DIRECTIONS_Q10: [[i64; 2]; 16] = [
    [1023, 0],
    [945, 391],
    [723, 723],
    [391, 945],
    [0, 1023],
    [-391, 945],
    [-723, 723],
    [-945, 391],
    [-1023, 0],
    [-945, -391],
    [-723, -723],
    [-391, -945],
    [0, -1023],
    [391, -945],
    [723, -723],
    [945, -391],
];

impl Given {
    /// Returns the bound for a set that is given as integers: the set itself.
    pub(super) fn of(extent: Extent) -> Self {
        match extent {
            Extent::Gaussian(factor) | Extent::Grown { factor, .. } => {
                Self::Ellipsoid(Target::of_factor(&factor))
            }
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => Self::Cylinder {
                translation_um,
                yaw_q24,
            },
        }
    }

    /// Returns the bound for a cylinder whose extents were rounded up to the unit and, if they were inflated,
    /// rounded up again: the inflation's root by 2^-16 of its value.
    pub(super) fn of_cylinder(translation_um: i64, yaw_q24: i64, inflation: Inflation) -> Self {
        let less = |extent: i64| {
            let lost = if inflation == Inflation::NONE {
                1
            } else {
                inflation
                    .of_length(1)
                    .wrapping_add(extent >> 15)
                    .wrapping_add(2)
            };
            extent.wrapping_sub(lost).max(0) as i32
        };
        Self::Cylinder {
            translation_um: less(translation_um),
            yaw_q24: less(yaw_q24),
        }
    }

    /// Returns the bound of a cylinder with a movement added.
    pub(super) fn wider(self, by: Growth) -> Self {
        match self {
            Self::Ellipsoid(_) => self,
            Self::Cylinder {
                translation_um,
                yaw_q24,
            } => Self::Cylinder {
                translation_um: translation_um.wrapping_add(by.translation_um()),
                yaw_q24: yaw_q24.wrapping_add(by.yaw_q24()),
            },
        }
    }

    /// Returns `true` if an offset (um, um, 2^-32 turn) is certain to lead to a pose of the set, moved by up to `by`: if one of some movements back
    /// leads into the set. A pose that is in it may be missed. The movement leads at most `aside_um` across a heading, whose cosine and sine have
    /// the unit 2^-15.
    pub(super) fn holds_moved(
        &self,
        by: Growth,
        aside_um: i32,
        [c, s]: [i32; 2],
        [dx, dy, apart]: [i64; 3],
    ) -> bool {
        let radius = i64::from(by.translation_um());
        let turn = i64::from(by.yaw_q24()) << 8;
        let turn = apart.min(turn).max(turn.wrapping_neg());
        let length = sqrt_ceil(
            dx.wrapping_mul(dx)
                .wrapping_add(dy.wrapping_mul(dy))
                .unsigned_abs(),
        )
        .max(1);
        let (c, s, side) = (i64::from(c), i64::from(s), i64::from(aside_um));
        let back = |x: i64, y: i64| {
            // Shorter, until it is in the strip.
            let across = y.wrapping_mul(c).wrapping_sub(x.wrapping_mul(s)) >> 15;
            let across = (across.unsigned_abs() as i64).wrapping_add(2);
            let shorter = |v: i64| {
                let share = v.wrapping_mul(side.min(across)).checked_div(across);
                share.unwrap_or(0)
            };
            let (x, y) = if side < radius {
                (shorter(x), shorter(y))
            } else {
                (x, y)
            };
            [
                dx.wrapping_sub(x),
                dy.wrapping_sub(y),
                apart.wrapping_sub(turn),
            ]
        };
        let towards = |v: i64| {
            let share = v.wrapping_mul(radius.min(length)).checked_div(length);
            share.unwrap_or(0)
        };
        let straight = back(towards(dx), towards(dy));
        self.holds(straight)
            || DIRECTIONS_Q10.iter().any(|[x, y]| {
                let of = |v: i64| v.wrapping_mul(radius) >> 10;
                self.holds(back(of(*x), of(*y)))
            })
    }

    /// Returns `true` if an offset (um, um, 2^-32 turn; a real number of turns) from an estimate that was rounded is certain to lead to a pose of the
    /// set. The estimate was rounded by at most half a micrometre on each axis, and half of 2^-32 turn and a little.
    pub(super) fn holds(&self, [dx, dy, yaw]: [i64; 3]) -> bool {
        let (x, y) = (dx.wrapping_mul(2), dy.wrapping_mul(2));
        // The sets are convex: if the corners of the estimate's rounding box are inside, all of it is.
        let ends = |v: i64| [v.wrapping_sub(1), v.wrapping_add(1)];
        ends(x).into_iter().all(|x| {
            ends(y).into_iter().all(|y| match self {
                Self::Ellipsoid(target) => {
                    ends(yaw).into_iter().all(|yaw| target.holds([x, y, yaw]))
                }
                Self::Cylinder {
                    translation_um,
                    yaw_q24,
                } => {
                    let radius = i64::from(*translation_um).wrapping_mul(2);
                    let reach = i64::from(*yaw_q24).wrapping_mul(256);
                    let square = |v: i64| i128::from(v).wrapping_mul(i128::from(v));
                    square(x).wrapping_add(square(y)) <= square(radius)
                        && yaw.saturating_abs().wrapping_add(1) <= reach
                }
            })
        })
    }
}
